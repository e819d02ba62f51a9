#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "gap/linear_world.hpp"

/// @file
/// Two shapes that effects of a linear world may have, and currents that hold both.

namespace two_shapes {

using namespace linear_world;

inline double wave(double t) { return 0.1 * std::sin(3.0 * t); }
inline double ramp(double t) { return 0.05 * t; }

/// Currents of a fit and a check motion: noise of 1, and so much of wave and ramp in i1.
inline std::vector<cell::Experiment> recorded(double of_wave, double of_ramp, std::uint64_t seed, int fit_rows = 400,
                                              int check_rows = 250) {
  Random random(seed);
  std::vector<cell::Experiment> out = {motion("motion-1", cell::Split::Fit, fit_rows),
                                       motion("motion-2", cell::Split::Check, check_rows)};
  for (cell::Experiment& e : out)
    add_column(e, "i1",
               random.normal_vector(e.data.values.rows()) + of_wave * at_times(e, wave) + of_ramp * at_times(e, ramp));
  return out;
}

}  // namespace two_shapes
