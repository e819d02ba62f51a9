// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/turn_split.hpp>

#include <algorithm>
#include <cmath>

#include <kr5/core/error.hpp>

namespace kr5::calibration {
namespace {

/// Where a joint stands most often: the first value with the most others within `distance`.
double commonest_value(const Eigen::Ref<const Eigen::VectorXd>& values, double distance) {
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  std::ptrdiff_t most = 0;
  double out = values[0];
  for (const double value : values) {
    const auto low = std::partition_point(sorted.begin(), sorted.end(), [&](double v) { return value - v > distance; }),
               high = std::partition_point(low, sorted.end(), [&](double v) { return v - value <= distance; });
    if (high - low > most) most = high - low, out = value;
  }
  return out;
}

}  // namespace

void TurnSplitOptions::validate() const {
  require(max_standing > 0 && std::isfinite(max_standing), "max_standing must be positive [rad]");
}

TurnSplit split_turns(const Eigen::Ref<const Eigen::MatrixXd>& q, const TurnSplitOptions& options) {
  options.validate();
  require(q.rows() > 0 && q.cols() > 0, "q: there are no joint values");
  require(q.allFinite(), "q must be finite [rad]");
  TurnSplit out;
  out.home.resize(q.cols());
  for (Eigen::Index k = 0; k < q.cols(); ++k) out.home[k] = commonest_value(q.col(k), options.max_standing);
  out.rows.resize(static_cast<std::size_t>(q.cols()));
  std::vector<bool> moved(out.rows.size(), false);
  for (int i = 0; i < static_cast<int>(q.rows()); ++i) {
    std::vector<int> away;
    for (int k = 0; k < static_cast<int>(q.cols()); ++k)
      if (std::abs(q(i, k) - out.home[k]) > options.max_standing) away.push_back(k);
    for (const int k : away) moved[static_cast<std::size_t>(k)] = true;
    if (away.empty())
      for (std::vector<int>& rows : out.rows) rows.push_back(i);
    else if (away.size() == 1)
      out.rows[static_cast<std::size_t>(away.front())].push_back(i);
    else
      out.several.push_back({i, away});
  }
  for (std::size_t k = 0; k < moved.size(); ++k)
    if (!moved[k]) out.still.push_back(static_cast<int>(k));
  return out;
}

}  // namespace kr5::calibration
