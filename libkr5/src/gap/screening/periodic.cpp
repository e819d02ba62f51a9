// SPDX-License-Identifier: BSD-3-Clause
#include "gap/screening/periodic.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <numeric>

namespace kr5::gap {
namespace {

/// The joint angle of each row of an experiment, as recorded, or as commanded.
Eigen::ArrayXd angles(const cell::Experiment& e, int joint) {
  const std::string number = std::to_string(joint + 1);
  const int q = e.data.find("q" + number);
  return e.data.values.col(q >= 0 ? q : e.data.find("qc" + number)).array();
}

bool has_angles(const cell::Experiment& e, int joint) {
  const std::string number = std::to_string(joint + 1);
  return e.data.find("q" + number) >= 0 || e.data.find("qc" + number) >= 0;
}

Signature times(const ComparisonData& data, const Signature& a, int joint,
                const std::function<double(double)>& factor) {
  Signature out;
  for (const auto& [block, values] : a.parts) {
    const Eigen::ArrayXd q = angles(data.experiment(data.blocks[block]), joint);
    out.parts.emplace_back(block, (values.cast<double>().array() * q.unaryExpr(factor)).matrix().cast<float>());
  }
  return out;
}

/// Adds the sums of w z^c over the rows, for every c from 1: eight rows at a time, in real numbers, since complex
/// products of the standard library look for infinities.
void add_powers(const Eigen::ArrayXd& w, const Eigen::ArrayXcd& z, Eigen::ArrayXcd& sums) {
  constexpr Eigen::Index width = 8;
  using Lanes = Eigen::Array<double, width, 1>;
  std::vector<Lanes> re(static_cast<std::size_t>(sums.size()), Lanes::Zero()), im = re;
  for (Eigen::Index row = 0; row < w.size(); row += width) {
    const Eigen::Index count = std::min(width, w.size() - row);
    Lanes zr = Lanes::Zero(), zi = Lanes::Zero(), pr = Lanes::Zero(), pi = Lanes::Zero();
    zr.head(count) = z.segment(row, count).real();
    zi.head(count) = z.segment(row, count).imag();
    pr.head(count) = w.segment(row, count);
    for (std::size_t c = 1; c < re.size(); ++c) {
      const Lanes turned = pr * zr - pi * zi;
      pi = pr * zi + pi * zr;
      pr = turned;
      re[c] += pr;
      im[c] += pi;
    }
  }
  for (std::size_t c = 1; c < re.size(); ++c)
    sums(static_cast<Eigen::Index>(c)) += std::complex<double>(re[c].sum(), im[c].sum());
}

/// What does not depend on the residual.
void add_turns(const ComparisonData& data, Carrier& carrier) {
  carrier.squares = Eigen::ArrayXcd::Zero(most_cycles + 1);
  for (const auto& [block, values] : carrier.constant.parts) {
    const Eigen::ArrayXd q = angles(data.experiment(data.blocks[block]), carrier.joint);
    const Eigen::ArrayXd k = values.cast<double>();
    Eigen::ArrayXcd z(q.size());
    for (Eigen::Index row = 0; row < q.size(); ++row) z(row) = k(row) == 0.0 ? 1.0 : std::polar(1.0, q(row));
    carrier.square += k.square().sum();
    add_powers(k.square(), z.square(), carrier.squares);
    carrier.turns.push_back(std::move(z));
  }
}

}  // namespace

Carrier make_carrier(const ComparisonData& data, const Candidate& one_cycle, int joint) {
  Carrier out{one_cycle.hypothesis.effect, joint, one_cycle.experiments, {}, {}, 0.0, {}};
  const Signature sine = times(data, one_cycle.signatures[0][0], joint, [](double q) { return std::sin(q); });
  const Signature cosine = times(data, one_cycle.signatures[0][1], joint, [](double q) { return std::cos(q); });
  out.constant = sine;
  for (const auto& part : cosine.parts) {  // sin^2 + cos^2 = 1
    const auto same = std::find_if(out.constant.parts.begin(), out.constant.parts.end(),
                                   [&](const auto& p) { return p.first == part.first; });
    if (same == out.constant.parts.end())
      out.constant.parts.push_back(part);
    else
      same->second += part.second;
  }
  std::sort(out.constant.parts.begin(), out.constant.parts.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  std::erase_if(out.constant.parts,
                [&](const auto& p) { return !has_angles(data.experiment(data.blocks[p.first]), joint); });
  add_turns(data, out);
  return out;
}

std::vector<int> best_cycles(const ComparisonData& data, const Carrier& carrier, const Eigen::VectorXd& left,
                             int count) {
  Eigen::ArrayXcd first = Eigen::ArrayXcd::Zero(most_cycles + 1);
  for (std::size_t i = 0; i < carrier.turns.size(); ++i) {
    const auto& [block, values] = carrier.constant.parts[i];
    add_powers(values.cast<double>().cwiseProduct(data.blocks[block].rows_of(left)), carrier.turns[i], first);
  }
  std::vector<double> drop(most_cycles + 1, -1.0);
  for (int c = 1; c <= most_cycles; ++c) {
    Eigen::Matrix2d A;
    const std::complex<double> twice = carrier.squares(c);
    A << carrier.square - twice.real(), twice.imag(), twice.imag(), carrier.square + twice.real();
    A /= 2;
    const Eigen::Vector2d b(first(c).imag(), first(c).real());
    drop[c] = b.dot((A + 1e-9 * Eigen::Matrix2d::Identity()).ldlt().solve(b));
  }
  std::vector<int> order(most_cycles);
  std::iota(order.begin(), order.end(), 1);
  std::partial_sort(order.begin(), order.begin() + count, order.end(), [&](int a, int b) { return drop[a] > drop[b]; });
  order.resize(static_cast<std::size_t>(count));
  return order;
}

Candidate modulated(const ComparisonData& data, const Carrier& carrier, int cycles) {
  Candidate out;
  out.hypothesis = periodic_hypothesis(data.recording->cell, {carrier.effect, carrier.joint}, cycles);
  out.hypothesis.log_prior = -std::log(static_cast<double>(most_cycles));
  out.experiments = carrier.experiments;
  out.signatures = {{times(data, carrier.constant, carrier.joint, [=](double q) { return std::sin(cycles * q); }),
                     times(data, carrier.constant, carrier.joint, [=](double q) { return std::cos(cycles * q); })}};
  return out;
}

}  // namespace kr5::gap
