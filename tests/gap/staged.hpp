#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "gap/linear_world.hpp"
#include "gap/stages/judge_stage.hpp"

/// @file
/// A diagnosis stage by stage, of currents with effects of the caller that are linear and known.

namespace staged {

using namespace linear_world;

inline double wave(double t) { return 0.2 * std::sin(3.0 * t); }
inline double ramp(double t) { return 0.05 * t; }
inline double near_wave(double t) { return 0.2 * std::sin(3.0 * t + 0.05); }

/// Motions to fit and to check; i1 and i2 have a noise of 1.
struct Recorded {
  double of_wave = 0.0;    ///< In i1.
  double of_ramp = 0.0;    ///< In i1.
  double of_square = 0.0;  ///< A square wave in i2, which no effect explains.
  double noise = 1.0;      ///< Of i2.
  std::uint64_t seed = 151;
  bool check = true;

  cell::Recording recording() const {
    Random random(seed);
    cell::Recording r;
    r.cell = unit_noise();
    r.experiments = {motion("motion-1", cell::Split::Fit, 500)};
    if (check) r.experiments.push_back(motion("motion-2", cell::Split::Check, 400));
    for (cell::Experiment& e : r.experiments) {
      const Eigen::Index rows = e.data.values.rows();
      add_column(e, "i1", random.normal_vector(rows) + of_wave * at_times(e, wave) + of_ramp * at_times(e, ramp));
      add_column(e, "i2", random.normal_vector(rows, noise) + of_square * at_times(e, [](double t) {
                                                                return std::sin(9.0 * t) > 0 ? 1.0 : -1.0;
                                                              }));
    }
    return r;
  }
};

/// The effects that are tried.
inline gap::DiagnoseOptions options() {
  gap::DiagnoseOptions out;
  out.own_hypotheses = {adding("wave", "i1", wave), adding("ramp", "i1", ramp)};
  out.threads = 1;
  return out;
}

/// What the stages before judging make of a recording.
struct Stages {
  explicit Stages(cell::Recording r, gap::DiagnoseOptions with = staged::options())
      : recording(std::move(r)),
        options(std::move(with)),
        compared(gap::compare_stage(recording, simulator, options)),
        noise(gap::noise_stage(compared, options)),
        screened(gap::screen_stage(noise, options)) {}
  Stages(const Stages&) = delete;
  Stages& operator=(const Stages&) = delete;

  gap::SearchOutput searched() const { return gap::search_stage(screened, options); }
  gap::JudgeOutput judged() const { return gap::judge_stage(screened, searched(), options); }

  cell::Recording recording;
  Zeros simulator;
  gap::DiagnoseOptions options;
  gap::CompareOutput compared;
  gap::NoiseOutput noise;
  gap::ScreenOutput screened;
};

inline std::vector<std::string> names(const std::vector<gap::Part>& parts) {
  std::vector<std::string> out;
  for (const gap::Part& p : parts) out.push_back(p.candidate->hypothesis.effect);
  return out;
}

}  // namespace staged
