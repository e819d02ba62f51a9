// SPDX-License-Identifier: BSD-3-Clause
#include "gap/reporting/structure.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <kr5/uncertainty/confidence.hpp>

#include "gap/reporting/variables.hpp"

namespace kr5::gap {
namespace {

constexpr int bins = 12;

/// Means of a residual over bins of a variable.
struct Means {
  std::vector<double> edges, mean, count;

  double statistic() const {
    double sum = 0.0;
    for (std::size_t k = 0; k < mean.size(); ++k) sum += count[k] * mean[k] * mean[k];
    return sum;
  }
  double dof() const {
    return static_cast<double>(std::count_if(count.begin(), count.end(), [](double n) { return n > 0; }));
  }
};

Means means_over(const Eigen::VectorXd& variable, const Eigen::VectorXd& r, const Eigen::ArrayXd& use) {
  Means out;
  out.edges = quantile_edges(variable, bins);
  out.mean.assign(out.edges.size() + 1, 0.0);
  out.count.assign(out.edges.size() + 1, 0.0);
  for (Eigen::Index i = 0; i < r.size(); ++i) {
    if (use(i) == 0.0) continue;
    const auto bin = std::upper_bound(out.edges.begin(), out.edges.end(), variable(i)) - out.edges.begin();
    out.mean[static_cast<std::size_t>(bin)] += r(i);
    out.count[static_cast<std::size_t>(bin)] += 1.0;
  }
  for (std::size_t k = 0; k < out.mean.size(); ++k)
    if (out.count[k] > 0) out.mean[k] /= out.count[k];
  return out;
}

/// The shape of means over bins of a variable.
Dependence shape_of(const Means& m, const VariableValues& v) {
  Dependence out{v.variable, Shape::Varies};
  out.unit = v.unit;
  double mean = 0.0, n = 0.0;
  for (std::size_t k = 0; k < m.mean.size(); ++k) {
    mean += m.count[k] * m.mean[k];
    n += m.count[k];
  }
  mean /= std::max(n, 1.0);
  double total = 0.0, most = 0.0;
  std::size_t at = 0, rising = 0;
  for (std::size_t k = 0; k < m.mean.size(); ++k) {
    const double part = m.count[k] * (m.mean[k] - mean) * (m.mean[k] - mean);
    total += part;
    if (part > most) {
      most = part;
      at = k;
    }
    if (k > 0 && m.mean[k] > m.mean[k - 1]) ++rising;
  }
  const bool in_one_bin = most > 0.5 * total, first = at == 0, last = at == m.mean.size() - 1;
  if (mean * mean * n > 4 * total) {
    out.shape = Shape::Offset;
  } else if (!(in_one_bin && (first || last)) && (rising + 1 >= m.mean.size() - 1 || rising <= 1)) {
    out.shape = rising + 1 >= m.mean.size() - 1 ? Shape::Grows : Shape::Falls;
  } else if (in_one_bin) {
    out.shape = first ? Shape::Below : last ? Shape::Above : Shape::Between;
    if (!first) out.lower = m.edges[at - 1];
    if (!last) out.upper = m.edges[at];
  }
  return out;
}

/// Sums over pieces of `length` samples: what is slower than that stands out.
Test run_test(const Eigen::VectorXd& r, const Eigen::ArrayXd& use, int length) {
  Test out{{{VariableKind::Column, 0, "t"}, Shape::Drifts}, 0.0, 0.0};
  out.dependence.samples = length;
  for (Eigen::Index i = 0; i + length <= r.size(); i += length) {
    const double n = use.segment(i, length).sum();
    if (n <= 0) continue;
    const double sum = r.segment(i, length).sum();
    out.statistic += sum * sum / n;
    out.dof += 1.0;
  }
  return out;
}

struct Stack {
  Eigen::VectorXd r;
  Eigen::ArrayXd use;
};

Stack stack(const ComparisonData& data, const Group& group, const Eigen::VectorXd& counted) {
  Eigen::Index n = 0;
  for (const int b : group.all) n += data.blocks[b].rows;
  Stack out{Eigen::VectorXd(n), Eigen::ArrayXd(n)};
  Eigen::Index at = 0;
  for (const int b : group.all) {
    const Block& block = data.blocks[b];
    out.r.segment(at, block.rows) = block.rows_of(counted);
    out.use.segment(at, block.rows) = data.use.segment(block.first, block.rows);
    at += block.rows;
  }
  return out;
}

}  // namespace

std::vector<double> quantile_edges(Eigen::VectorXd values, int bins) {
  std::vector<double> edges;
  for (int k = 1; k < bins; ++k) {
    double* middle = values.data() + values.size() * k / bins;
    std::nth_element(values.data(), middle, values.data() + values.size());
    if (edges.empty() || *middle > edges.back()) edges.push_back(*middle);
  }
  return edges;
}

std::vector<Group> make_groups(const ComparisonData& data) {
  std::vector<Group> out;
  for (std::size_t b = 0; b < data.blocks.size(); ++b) {
    const Block& block = data.blocks[b];
    auto group = std::find_if(out.begin(), out.end(),
                              [&](const Group& g) { return g.kind == block.kind && g.column == block.column; });
    if (group == out.end()) group = out.insert(out.end(), {block.kind, block.column, {}, {}});
    group->all.push_back(static_cast<int>(b));
    if (block.split == cell::Split::Check) group->judged.push_back(static_cast<int>(b));
  }
  for (Group& group : out)
    if (group.judged.empty()) group.judged = group.all;
  return out;
}

Gap gap_of(const ComparisonData& data, const std::vector<int>& blocks, const Eigen::VectorXd& counted) {
  Gap out;
  for (const int b : blocks) {
    const Block& block = data.blocks[b];
    const auto r = block.rows_of(counted).array();
    out.rms += r.isNaN().select(0.0, r.square()).sum();
    out.samples += r.isNaN().select(0.0, data.use.segment(block.first, block.rows)).sum();
  }
  out.rms = out.samples > 0 ? std::sqrt(out.rms / out.samples) : 0.0;
  return out;
}

std::vector<Test> tests(const ComparisonData& data, const Group& group, const Eigen::VectorXd& counted, double scale) {
  const Stack s = stack(data, group, scale * counted);
  std::vector<Test> out;
  out.push_back({{}, s.r.squaredNorm(), std::max(s.use.sum(), 1.0)});
  if (group.kind != cell::Kind::Poses)
    for (const int length : {4, 16, 64, 256})
      if (s.r.size() >= 4 * length) out.push_back(run_test(s.r, s.use, length));
  for (const VariableValues& v : variables(data, group, counted)) {
    const Means plain = means_over(v.values, s.r, s.use);
    if (plain.dof() < 2) continue;
    out.push_back({shape_of(plain, v), plain.statistic(), plain.dof()});
    if (v.sign.size() == 0) continue;
    const Means turned = means_over(v.values, s.r.cwiseProduct(v.sign), s.use);
    out.push_back({shape_of(turned, v), turned.statistic(), turned.dof()});
    out.back().dependence.sign_joint = v.variable.joint;
  }
  return out;
}

double p_value(const Test& test, double discrepancy) {
  const double inflation = 1.0 + discrepancy / test.dof;
  return 1.0 - uncertainty::chi_square_cdf(test.statistic / inflation, test.dof);
}

Structure structure(const ComparisonData& data, const Group& group, const Eigen::VectorXd& counted, double discrepancy,
                    double level, double scale) {
  const std::vector<Test> all = tests(data, group, counted, scale);
  const double excess = std::max(all.front().statistic - all.front().dof, 1e-9);
  const double count = static_cast<double>(all.size());
  Structure out;
  for (const Test& test : all) {
    const double p = std::min(1.0, count * p_value(test, discrepancy));
    out.p = std::min(out.p, p);
    if (p < level) out.strength = std::max(out.strength, test.statistic - test.dof);
    if (test.dependence.variable.kind == VariableKind::None || p > level) continue;
    out.dependences.push_back(test.dependence);
    out.dependences.back().evidence = 1.0 - p;
    out.dependences.back().share = std::clamp((test.statistic - test.dof) / excess, 0.0, 1.0);
  }
  // That it lasts longer than a sample is said only where nothing tells what it depends on.
  const auto lasts = [](const Dependence& d) { return d.shape == Shape::Drifts; };
  std::sort(out.dependences.begin(), out.dependences.end(), [&](const Dependence& a, const Dependence& b) {
    return lasts(a) != lasts(b) ? lasts(b) : a.share > b.share;
  });
  if (!out.dependences.empty() && !lasts(out.dependences.front())) std::erase_if(out.dependences, lasts);
  return out;
}

double best_free_shape(const ComparisonData& data, const std::vector<Group>& groups, const Eigen::VectorXd& counted,
                       double width) {
  double best = 0.0;
  const auto take = [&](const Stack& s, const Eigen::VectorXd& shape) {
    const double square = (shape.array().square() * s.use).sum();
    if (square <= 0) return;
    const double size = shape.dot(s.r) / square, rms = std::sqrt(square / s.use.sum());
    const double cost = std::log1p(width * width * s.use.sum()) + 2 * std::log1p(std::pow(size * rms / width, 2));
    best = std::max(best, size * size * square - cost);
  };
  for (const Group& group : groups) {
    const Stack s = stack(data, group, counted);
    take(s, Eigen::VectorXd::Ones(s.r.size()));
    for (const VariableValues& v : variables(data, group, counted)) {
      const double mean = v.values.mean();
      take(s, (v.values.array() - mean).matrix());
      if (v.sign.size() > 0) take(s, v.sign.cwiseProduct((v.values.array() - mean).matrix()));
    }
  }
  return best;
}

}  // namespace kr5::gap
