// SPDX-License-Identifier: BSD-3-Clause
#include "gap/screening/noise.hpp"

#include <algorithm>
#include <cmath>
#include <kr5/core/linear.hpp>
#include <limits>
#include <map>
#include <optional>

namespace kr5::gap {
namespace {

constexpr double spike = 7.0;        // noise alone is there once in a hundred million samples
constexpr std::size_t telling = 50;  // differences that tell a scale

bool in_order(cell::Kind kind) { return kind != cell::Kind::Poses && kind != cell::Kind::Views; }

/// 1 near the rim of a scanned sphere, where a ray moves far for a small cause.
Eigen::VectorXd edges(const cell::Experiment& e, const Eigen::VectorXd& r) {
  constexpr Eigen::Index near = 4;
  Eigen::VectorXd out = Eigen::VectorXd::Zero(r.size());
  const int sphere = e.data.find("sphere");
  if (sphere < 0) return out;
  for (Eigen::Index i = 1; i < r.size(); ++i)
    if (std::isnan(r(i)) || e.data.values(i, sphere) != e.data.values(i - 1, sphere))
      out.segment(std::max<Eigen::Index>(i - near, 0),
                  std::min(2 * near, r.size() - std::max<Eigen::Index>(i - near, 0)))
          .setOnes();
  return out;
}

/// |second differences| over those of unit noise: the size of one sample's noise, whatever is smooth.
/// @param correlation Of the noise of neighbouring samples.
std::vector<double> second_differences(const Eigen::VectorXd& r, const Eigen::VectorXd& run, double correlation = 0.0) {
  const double unit = std::sqrt(6 - 8 * correlation + 2 * correlation * correlation);
  std::vector<double> out;
  for (Eigen::Index i = 1; i + 1 < r.size(); ++i) {
    if (run(i - 1) != run(i) || run(i + 1) != run(i)) continue;
    const double d = r(i - 1) - 2 * r(i) + r(i + 1);
    if (!std::isnan(d)) out.push_back(std::abs(d) / unit);
  }
  return out;
}

/// |c0 - c1 + c2 - c3| / 2 of the four corners of each marker.
std::vector<double> corner_differences(const cell::Experiment& e, const Eigen::VectorXd& r) {
  const int view = e.data.find("view"), marker = e.data.find("marker"), corner = e.data.find("corner");
  std::vector<double> out;
  for (Eigen::Index i = 0; i + 3 < r.size(); ++i) {
    bool square = true;
    for (int k = 0; k < 4; ++k)
      square &= e.data.values(i + k, corner) == k && e.data.values(i + k, view) == e.data.values(i, view) &&
                e.data.values(i + k, marker) == e.data.values(i, marker);
    const double d = square ? (r(i) - r(i + 1) + r(i + 2) - r(i + 3)) / 2 : 0.0;
    if (square && !std::isnan(d)) out.push_back(std::abs(d));
  }
  return out;
}

/// The nearest sample in use of the same run, going by `step` from i; -1 when there is none.
Eigen::Index next_used(const Eigen::VectorXd& run, const Eigen::ArrayXd& use, Eigen::Index i, Eigen::Index step) {
  for (Eigen::Index k = i + step; k >= 0 && k < run.size() && run(k) == run(i); k += step)
    if (use(k) > 0) return k;
  return -1;
}

/// Whether a sample stands out from both neighbours, on the same side; at the end of a run from the two next to it.
bool isolated(const Eigen::VectorXd& r, const Eigen::VectorXd& run, const Eigen::ArrayXd& use, Eigen::Index i,
              double limit) {
  Eigen::Index before = next_used(run, use, i, -1), after = next_used(run, use, i, 1);
  if (before < 0 && after >= 0) before = next_used(run, use, after, 1);
  if (after < 0 && before >= 0) after = next_used(run, use, before, -1);
  if (before < 0 || after < 0) return false;
  const double from = r(i) - r(before), to = r(i) - r(after);
  return from * to > 0 && std::abs(from) > limit && std::abs(to) > limit;
}

NoiseScale scale_of(const std::string& key, std::optional<cell::Kind> kind, std::vector<double>& differences) {
  const double n = static_cast<double>(differences.size());
  const double ratio = mad_to_sigma * median(differences);
  return {key, kind, ratio, 1.8 * ratio / std::sqrt(n), n};  // of a median of correlated differences
}

/// What is left of a view's residuals by a smooth shift, of second order in the image.
Eigen::VectorXd rough(const Eigen::VectorXd& u, const Eigen::VectorXd& v, const Eigen::VectorXd& r,
                      const Eigen::ArrayXd& use) {
  const Eigen::ArrayXd x = (u.array() - u.mean()) / 100.0, y = (v.array() - v.mean()) / 100.0;
  Eigen::MatrixXd A(r.size(), 6);
  A << Eigen::VectorXd::Ones(r.size()), x, y, x.square(), x * y, y.square();
  const Eigen::MatrixXd weighted = use.matrix().asDiagonal() * A;
  const Eigen::VectorXd kept = use * r.array();
  return r - A * least_squares(weighted, kept);
}

/// Marks the stray corners of one view, rows `at` of a block: the farthest first, until none is far.
int mark_view(ComparisonData& data, const Block& block, const Eigen::VectorXd& r, const std::vector<Eigen::Index>& at) {
  constexpr std::size_t least = 20;
  if (at.size() < least) return 0;
  const cell::Experiment& e = data.experiment(block);
  const Eigen::VectorXd u = e.data.values(at, e.data.find("u")), v = e.data.values(at, e.data.find("v")), own = r(at);
  if (!own.allFinite()) return 0;
  Eigen::ArrayXd use = Eigen::ArrayXd::Ones(own.size());
  int found = 0;
  for (; found < own.size() / 10; ++found) {
    const Eigen::ArrayXd left = rough(u, v, own, use).array().abs() * use;
    std::vector<double> sizes(left.begin(), left.end());
    Eigen::Index worst = 0;
    if (left.maxCoeff(&worst) <= spike * std::max(mad_to_sigma * median(sizes), min_noise)) break;
    use(worst) = 0.0;
    data.use(block.first + at[static_cast<std::size_t>(worst)]) = 0.0;
  }
  return found;
}

/// Whether readings are so coarse beside their motion that a good part of them repeat the one before.
bool repeats(const Eigen::VectorXd& values, const Eigen::VectorXd& run) {
  constexpr double part = 0.1;
  Eigen::Index count = 0;
  for (Eigen::Index i = 1; i < values.size(); ++i) count += run(i) == run(i - 1) && values(i) == values(i - 1);
  return static_cast<double>(count) >= part * static_cast<double>(values.size());
}

/// Measured joint positions of a block whose encoder repeats itself; nothing of others.
std::optional<Eigen::VectorXd> coarse_positions(const ComparisonData& data, const Block& block) {
  if (block.kind != cell::Kind::Motion || block.noise != "position") return std::nullopt;
  Eigen::VectorXd values = data.experiment(block).data.column(block.column);
  if (!repeats(values, runs(data.experiment(block)))) return std::nullopt;
  return values;
}

/// Least difference between two readings; infinite where there is one value alone.
double resolution(const Eigen::VectorXd& values) {
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  double out = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < sorted.size(); ++i)
    if (const double d = sorted[i] - sorted[i - 1]; d > 0) out = std::min(out, d);
  return out;
}

/// Whether the loads of a joint are so coarse beside their noise that the median of a few values tells no size.
/// @param differences As of second_differences, in units of the declared noise.
bool is_coarse(const ComparisonData& data, const Block& block, const std::vector<double>& differences) {
  constexpr double step = 1.5;
  if (block.kind != cell::Kind::Motion || differences.size() < telling) return false;
  if (block.column.rfind("tau", 0) != 0 && block.column.rfind("i", 0) != 0) return false;
  double squares = 0.0;
  for (const double d : differences) squares += d * d;
  const double seen = block.sigma * std::sqrt(squares / static_cast<double>(differences.size()));
  const double least = resolution(data.experiment(block).data.column(block.column));
  return std::isfinite(least) && least > step * seen;
}

}  // namespace

int mark_repeats(ComparisonData& data) {
  int found = 0;
  for (const Block& block : data.blocks) {
    const std::optional<Eigen::VectorXd> values = coarse_positions(data, block);
    if (!values) continue;
    const Eigen::VectorXd run = runs(data.experiment(block));
    Eigen::Index first = 0;
    for (Eigen::Index i = 1; i <= values->size(); ++i) {
      if (i < values->size() && (*values)(i) == (*values)(first) && run(i) == run(first)) continue;
      const Eigen::Index middle = (first + i - 1) / 2;
      for (Eigen::Index k = first; k < i; ++k)
        if (k != middle) data.use(block.first + k) = 0.0, ++found;
      first = i;
    }
  }
  return found;
}

int mark_stray_corners(ComparisonData& data, const Eigen::VectorXd& residual) {
  int found = 0;
  for (const Block& block : data.blocks) {
    if (block.kind != cell::Kind::Views) continue;
    const io::Table& table = data.experiment(block).data;
    if (table.find("u") < 0 || table.find("v") < 0) continue;
    std::map<double, std::vector<Eigen::Index>> views;
    for (Eigen::Index row = 0; row < block.rows; ++row) views[table.values(row, table.find("view"))].push_back(row);
    for (const auto& [view, rows] : views) found += mark_view(data, block, block.rows_of(residual), rows);
  }
  return found;
}

int mark_spikes(ComparisonData& data, const Eigen::VectorXd& residual, bool near_edges) {
  int found = 0;
  for (const Block& block : data.blocks) {
    if (!in_order(block.kind)) continue;
    const Eigen::VectorXd r = block.rows_of(residual), run = runs(data.experiment(block));
    std::vector<double> differences = second_differences(r, run);
    const double seen = mad_to_sigma * median(differences);
    const double limit = spike * (seen < min_noise ? 1.0 : seen);  // of coarse numbers the declared noise, as below
    const Eigen::VectorXd edge = near_edges ? Eigen::VectorXd::Zero(r.size()) : edges(data.experiment(block), r);
    Eigen::ArrayXd use = data.use.segment(block.first, block.rows);
    // Once more for those that stand beside another.
    for (int pass = 0; pass < 3; ++pass)
      for (Eigen::Index i = 0; i < r.size(); ++i)
        if (use(i) > 0 && edge(i) == 0 && isolated(r, run, use, i, limit)) {
          use(i) = 0.0;
          ++found;
        }
    data.use.segment(block.first, block.rows) = use;
  }
  return found;
}

std::vector<NoiseScale> noise_scales(const ComparisonData& data, const Eigen::VectorXd& residual,
                                     std::vector<ColumnName>& coarse) {
  std::map<std::string, std::map<cell::Kind, std::vector<double>>> all;
  for (const Block& block : data.blocks) {
    std::vector<double> d;
    if (coarse_positions(data, block)) continue;  // what neighbours show is less than the rounding
    if (in_order(block.kind))
      d = second_differences(block.rows_of(residual), runs(data.experiment(block)), block.correlation);
    else if (block.kind == cell::Kind::Views)
      d = corner_differences(data.experiment(block), block.rows_of(residual));
    if (d.size() >= telling && (mad_to_sigma * median(d) < min_noise || is_coarse(data, block, d))) {
      coarse.push_back({data.experiment(block).name, block.column});
      continue;
    }
    auto& of_kind = all[block.noise][block.kind];
    of_kind.insert(of_kind.end(), d.begin(), d.end());
  }
  std::vector<NoiseScale> out;
  for (auto& [key, kinds] : all) {
    std::vector<NoiseScale> each;
    std::vector<double> pooled;
    for (auto& [kind, differences] : kinds) {
      pooled.insert(pooled.end(), differences.begin(), differences.end());
      if (differences.size() >= telling) each.push_back(scale_of(key, kind, differences));
    }
    if (pooled.size() < telling) continue;
    const NoiseScale common = scale_of(key, std::nullopt, pooled);
    const bool agree = std::all_of(each.begin(), each.end(), [&](const NoiseScale& s) {
      return std::abs(s.ratio - common.ratio) <= std::max(4 * std::hypot(s.std, common.std), 1.0 / 24);
    });
    if (agree)
      out.push_back(common);
    else
      out.insert(out.end(), each.begin(), each.end());
  }
  return out;
}

bool wrong(const NoiseScale& scale) { return std::abs(scale.ratio - 1) > std::max(4 * scale.std, 1.0 / 12); }

void correct(ComparisonData& data, const std::vector<NoiseScale>& scales, Eigen::VectorXd& residual) {
  for (const NoiseScale& scale : scales)
    for (Block& block : data.blocks)
      if (block.noise == scale.key && scale.kind.value_or(block.kind) == block.kind) {
        block.rows_of(residual) /= scale.ratio;
        block.sigma *= scale.ratio;
      }
}

std::vector<NoiseScale> correct_wrong(ComparisonData& data, std::vector<NoiseScale> scales, Eigen::VectorXd& residual) {
  std::erase_if(scales, [](const NoiseScale& scale) { return !wrong(scale); });
  correct(data, scales, residual);
  return scales;
}

}  // namespace kr5::gap
