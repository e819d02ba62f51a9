// SPDX-License-Identifier: BSD-3-Clause
#include "gap/reporting/gap_figures.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <kr5/core/random.hpp>
#include <kr5/gap/measure.hpp>

namespace kr5::gap {
namespace {

/// Groups above the floor.
std::vector<const Group*> exceeding(const std::vector<Group>& groups, const std::vector<bool>& above) {
  std::vector<const Group*> out;
  for (std::size_t g = 0; g < groups.size(); ++g)
    if (above[g]) out.push_back(&groups[g]);
  return out;
}

/// RMS of the gaps of some columns.
double rms_gap(const ComparisonData& data, const std::vector<const Group*>& groups, const Eigen::VectorXd& counted) {
  double sum = 0.0;
  for (const Group* group : groups) {
    const double gap = gap_over_noise(data, *group, counted);
    sum += gap * gap;
  }
  return groups.empty() ? 1.0 : std::sqrt(sum / static_cast<double>(groups.size()));
}

/// 95 % of the RMS gap when pieces of the recording, each longer than what errors last, are drawn again and again.
uncertainty::Interval bootstrap(const ComparisonData& data, const std::vector<const Group*>& groups,
                                const Eigen::VectorXd& counted) {
  constexpr Eigen::Index piece = 25;
  constexpr int draws = 400;
  struct Pieces {
    std::vector<double> chi2, samples;
  };
  std::vector<Pieces> all;
  for (const Group* group : groups) {
    Pieces& pieces = all.emplace_back();
    const double inflation = inflation_of(data, *group);
    for (const int b : group->judged) {
      const Block& block = data.blocks[b];
      const Eigen::Index length = std::max<Eigen::Index>(1, std::min(piece, block.rows / 20));
      for (Eigen::Index i = 0; i < block.rows; i += length) {
        const Eigen::Index n = std::min(length, block.rows - i);
        const auto r = counted.segment(block.first + i, n).array();
        pieces.chi2.push_back(inflation * inflation * r.isNaN().select(0.0, r.square()).sum());
        pieces.samples.push_back(r.isNaN().select(0.0, data.use.segment(block.first + i, n)).sum());
      }
    }
  }
  Random random(1);
  std::vector<double> values;
  for (int draw = 0; draw < draws && !all.empty(); ++draw) {
    double sum = 0.0;
    for (const Pieces& pieces : all) {
      double chi2 = 0.0, samples = 0.0;
      for (std::size_t k = 0; k < pieces.chi2.size(); ++k) {
        const auto i = static_cast<std::size_t>(random.integer(static_cast<int>(pieces.chi2.size())));
        chi2 += pieces.chi2[i];
        samples += pieces.samples[i];
      }
      sum += chi2 / std::max(samples, 1.0);
    }
    values.push_back(std::sqrt(sum / static_cast<double>(all.size())));
  }
  if (values.empty()) return {1.0, 1.0};
  std::sort(values.begin(), values.end());
  return {values[draws / 40], values[draws - 1 - draws / 40]};
}

}  // namespace

double inflation_of(const ComparisonData& data, const Group& group) {
  return group.judged.empty() ? 1.0 : data.blocks[group.judged.front()].inflation;
}

double gap_over_noise(const ComparisonData& data, const Group& group, const Eigen::VectorXd& counted) {
  return inflation_of(data, group) * gap_of(data, group.judged, counted).rms;
}

bool above_floor(const Gap& gap) { return gap.rms > noise_limit(gap.samples); }

bool above_noise(const ComparisonData& data, const Group& group, const Eigen::VectorXd& counted) {
  constexpr double noticeable = 1.25;  // noise that is estimated from a recording is known to a tenth or so
  Gap gap = gap_of(data, group.judged, counted);
  const double inflation = inflation_of(data, group);
  if (inflation > 1.0 && gap.rms < min_judged) return false;
  gap.rms *= inflation;
  return above_floor(gap) && (inflation == 1.0 || gap.rms > noticeable);
}

std::vector<bool> above_noise(const ComparisonData& data, const std::vector<Group>& groups,
                              const Eigen::VectorXd& counted) {
  std::vector<bool> out;
  for (const Group& group : groups) out.push_back(above_noise(data, group, counted));
  return out;
}

std::vector<ColumnExcess> column_excesses(const ComparisonData& data, const std::vector<Group>& groups,
                                          const ResidualAnalysis& rest) {
  std::vector<ColumnExcess> out;
  double total = 0.0;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    if (!rest.structured[g] && !rest.beyond[g] && !above_noise(data, groups[g], rest.shown)) continue;
    std::vector<Dependence> depends = rest.structure[g].dependences;
    if (depends.size() > 3) depends.resize(3);
    const double over_noise = gap_over_noise(data, groups[g], rest.shown);
    const double excess = std::max(over_noise * over_noise - 1, 0.0);
    total += excess;
    out.push_back({std::string(kr5::name_of(groups[g].kind)), groups[g].column,
                   cell::find_column(groups[g].kind, groups[g].column).target, over_noise, excess, std::move(depends)});
  }
  for (ColumnExcess& place : out) place.share = total > 0 ? place.share / total : 0.0;
  std::sort(out.begin(), out.end(), [](const ColumnExcess& a, const ColumnExcess& b) { return a.share > b.share; });
  return out;
}

GapReduction gap_reduction(const ComparisonData& data, const std::vector<Group>& groups, const std::vector<bool>& above,
                           const Eigen::VectorXd& before, const Eigen::VectorXd& after) {
  const std::vector<const Group*> shown = exceeding(groups, above);
  GapReduction out;
  out.before = rms_gap(data, shown, before);
  out.after = rms_gap(data, shown, after);
  out.before_ci = bootstrap(data, shown, before);
  out.after_ci = bootstrap(data, shown, after);
  for (const Group* group : shown)
    out.columns.push_back({group->name(), gap_over_noise(data, *group, before), gap_over_noise(data, *group, after)});
  return out;
}

double explained_fraction(const ComparisonData& data, const std::vector<Group>& groups, const std::vector<bool>& above,
                          const Eigen::VectorXd& without, const Eigen::VectorXd& with) {
  double from = 0.0, to = 0.0;
  for (const Group* group : exceeding(groups, above)) {
    from += std::pow(gap_over_noise(data, *group, without), 2) - 1;
    to += std::pow(gap_over_noise(data, *group, with), 2) - 1;
  }
  return from > 0 ? std::clamp((from - to) / from, 0.0, 1.0) : 0.0;
}

}  // namespace kr5::gap
