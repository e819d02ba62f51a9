// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/cell_fit/sound_probability.hpp"

#include <algorithm>
#include <cmath>

#include <kr5/uncertainty/confidence.hpp>

namespace kr5::calibration::cell_fit {

double sound_probability(double squared_distance, double rows, bool used, double dof) {
  if (!std::isfinite(squared_distance)) return 0.0;
  if (dof == uncertainty::known_noise) return 1 - uncertainty::chi_square_cdf(squared_distance, rows);
  if (!used) return 1 - uncertainty::fisher_cdf(squared_distance / rows, rows, dof);
  // The noise was estimated with this measurement among the others: take its part out.
  const double left = std::max(dof - rows, 1.0);
  const double external = squared_distance * left / std::max(dof - squared_distance, 1e-9);
  return 1 - uncertainty::fisher_cdf(external / rows, rows, left);
}

}  // namespace kr5::calibration::cell_fit
