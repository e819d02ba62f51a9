// SPDX-License-Identifier: BSD-3-Clause
#include "gap/reporting/oscillation.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include <Eigen/LU>

namespace kr5::gap {
namespace {

constexpr double main_part = 0.6;       // of the excess
constexpr double fewest_periods = 3.0;  // fewer are a drift
constexpr double fewest_rows = 4.0;     // a period
constexpr double steps_per_line = 4.0;  // of frequency, per 1 / duration

/// Time [s] and residual of the rows that count.
struct Rows {
  Eigen::ArrayXd t;
  Eigen::ArrayXd r;
  double step = 0.0;  ///< Median interval [s].
};

Rows rows_of(const ComparisonData& data, const Group& group, const Eigen::VectorXd& counted) {
  std::vector<double> t, r, steps;
  for (const int b : group.all) {
    const Block& block = data.blocks[b];
    const io::Table& table = data.experiment(block).data;
    if (table.find("t") < 0) return {};
    const Eigen::VectorXd times = table.column("t");
    for (Eigen::Index i = 0; i < block.rows; ++i) {
      if (i > 0) steps.push_back(times(i) - times(i - 1));
      if (data.use(block.first + i) == 0.0) continue;
      t.push_back(times(i));
      r.push_back(counted(block.first + i));
    }
  }
  if (steps.empty() || t.empty()) return {};
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  const auto size = static_cast<Eigen::Index>(t.size());
  return {Eigen::Map<Eigen::ArrayXd>(t.data(), size), Eigen::Map<Eigen::ArrayXd>(r.data(), size), *middle};
}

/// What a sine and a cosine take from the sum of squares.
double explained(const Eigen::ArrayXd& c, const Eigen::ArrayXd& s, const Eigen::ArrayXd& r) {
  Eigen::Matrix2d A;
  A << c.square().sum(), (c * s).sum(), (c * s).sum(), s.square().sum();
  const Eigen::Vector2d b((c * r).sum(), (s * r).sum());
  return A.determinant() > 1e-9 * A.trace() * A.trace() ? b.dot(A.inverse() * b) : 0.0;
}

/// The frequency that explains most, and how many were tried.
struct Peak {
  double frequency = 0.0;  ///< [Hz]
  double explained = 0.0;
  double tried = 0.0;
};

Peak highest_peak(const Rows& rows, double duration) {
  const double first = fewest_periods / duration, last = 1.0 / (fewest_rows * rows.step);
  const double step = 1.0 / (steps_per_line * duration);
  const auto phase = [&](double frequency) -> Eigen::ArrayXd { return 2 * std::numbers::pi * frequency * rows.t; };
  Eigen::ArrayXd c = phase(first).cos(), s = phase(first).sin();
  const Eigen::ArrayXd c_step = phase(step).cos(), s_step = phase(step).sin();  // to the next frequency, by addition
  Peak out;
  for (double f = first; f <= last; f += step, ++out.tried) {
    if (const double taken = explained(c, s, rows.r); taken > out.explained) {
      out.explained = taken;
      out.frequency = f;
    }
    const Eigen::ArrayXd turned = c * c_step - s * s_step;
    s = s * c_step + c * s_step;
    c = turned;
  }
  return out;
}

}  // namespace

std::optional<Dependence> main_oscillation(const ComparisonData& data, const Group& group,
                                           const Eigen::VectorXd& counted, double level) {
  const Rows rows = rows_of(data, group, counted);
  if (rows.t.size() < 16 || !(rows.step > 0.0)) return {};
  const double duration = rows.t.maxCoeff() - rows.t.minCoeff(),
               excess = rows.r.square().sum() - static_cast<double>(rows.r.size());
  const Peak peak = highest_peak(rows, duration);
  const double share = peak.explained / std::max(excess, 1e-9);
  const double p = std::min(1.0, peak.tried * std::exp(-peak.explained / 2));
  if (share < main_part || p > level) return {};
  char how[64];
  std::snprintf(how, sizeof how, "oscillates with a period of %.3g s", 1.0 / peak.frequency);
  return Dependence{"t", how, 1.0 - p, std::min(share, 1.0)};
}

}  // namespace kr5::gap
