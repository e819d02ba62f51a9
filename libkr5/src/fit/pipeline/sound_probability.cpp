// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/fit/pipeline/sound_probability.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <kr5/uncertainty/confidence.hpp>

namespace kr5::fit::pipeline {

double sound_probability(double squared_distance, double rows, bool used, double dof) {
  if (!std::isfinite(squared_distance)) return 0.0;
  if (dof == uncertainty::known_noise) return 1 - uncertainty::chi_square_cdf(squared_distance, rows);
  if (!used) return 1 - uncertainty::fisher_cdf(squared_distance / rows, rows, dof);
  // The noise was estimated with this measurement among the others: take its part out.
  const double left = std::max(dof - rows, 1.0);
  const double external = squared_distance * left / std::max(dof - squared_distance, 1e-9);
  return 1 - uncertainty::fisher_cdf(external / rows, rows, left);
}

void settle_outliers(std::vector<double>& weights, double false_alarm, std::size_t fewest,
                     const std::function<std::vector<double>()>& probabilities, const std::function<void()>& refit) {
  constexpr int most_returns = 2;  // of one measurement, which might otherwise come and go for ever
  const double threshold = false_alarm / static_cast<double>(weights.size());
  std::vector<int> returns(weights.size(), 0);
  for (;;) {
    std::vector<std::pair<double, std::size_t>> order;
    const std::vector<double> sound = probabilities();
    for (std::size_t i = 0; i < weights.size(); ++i) order.emplace_back(sound[i], i);
    std::sort(order.begin(), order.end());
    bool changed = false, excluded = false;
    auto inside = static_cast<std::size_t>(std::count(weights.begin(), weights.end(), 1.0));
    for (const auto& [p, i] : order) {
      if (weights[i] == 0 && p > threshold && returns[i] < most_returns) {
        weights[i] = 1, changed = true;
        ++inside, ++returns[i];
      } else if (weights[i] == 1 && p < threshold && inside > fewest && !excluded) {
        // One out at a time, so that a gross one does not take sound ones with it.
        weights[i] = 0, changed = excluded = true;
        --inside;
      }
    }
    if (!changed) return;
    refit();
  }
}

}  // namespace kr5::fit::pipeline
