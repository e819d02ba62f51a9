// SPDX-License-Identifier: BSD-3-Clause
#include "gap/periodic.hpp"

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

Signature times(const Data& data, const Signature& a, int joint, const std::function<double(double)>& factor) {
  Signature out;
  for (const auto& [block, values] : a.parts) {
    const Eigen::ArrayXd q = angles(data.experiment(data.blocks[block]), joint);
    out.parts.emplace_back(block, (values.cast<double>().array() * q.unaryExpr(factor)).matrix().cast<float>());
  }
  return out;
}

}  // namespace

Carrier make_carrier(const Data& data, const Candidate& one_cycle, int joint) {
  Carrier out{one_cycle.hypothesis.effect, joint, one_cycle.experiments, {}};
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
  return out;
}

std::vector<int> best_cycles(const Data& data, const Carrier& carrier, const Eigen::VectorXd& left, int count) {
  // Sums over the samples of K r e^{icq}, K^2 e^{2icq} and K^2 for all c, by powers of e^{iq}.
  std::vector<std::complex<double>> first(most_cycles + 1), second(most_cycles + 1);
  double total = 0.0;
  for (const auto& [block, values] : carrier.constant.parts) {
    const Eigen::ArrayXd q = angles(data.experiment(data.blocks[block]), carrier.joint);
    const auto r = data.blocks[block].of(left);
    for (Eigen::Index row = 0; row < q.size(); ++row) {
      const double k = values(row);
      if (k == 0.0) continue;
      const std::complex<double> z = std::polar(1.0, q(row));
      std::complex<double> power = 1.0;
      total += k * k;
      for (int c = 1; c <= most_cycles; ++c) {
        power *= z;
        first[c] += k * r(row) * power;
        second[c] += k * k * power * power;
      }
    }
  }
  std::vector<double> drop(most_cycles + 1, -1.0);
  for (int c = 1; c <= most_cycles; ++c) {
    Eigen::Matrix2d A;
    A << (total - second[c].real()) / 2, second[c].imag() / 2, second[c].imag() / 2, (total + second[c].real()) / 2;
    const Eigen::Vector2d b(first[c].imag(), first[c].real());
    drop[c] = b.dot((A + 1e-9 * Eigen::Matrix2d::Identity()).ldlt().solve(b));
  }
  std::vector<int> order(most_cycles);
  std::iota(order.begin(), order.end(), 1);
  std::partial_sort(order.begin(), order.begin() + count, order.end(), [&](int a, int b) { return drop[a] > drop[b]; });
  order.resize(static_cast<std::size_t>(count));
  return order;
}

Candidate modulated(const Data& data, const Carrier& carrier, int cycles) {
  Candidate out;
  out.hypothesis = periodic_hypothesis(data.recording->cell, carrier.effect, carrier.joint, cycles);
  out.hypothesis.log_prior = -std::log(static_cast<double>(most_cycles));
  out.experiments = carrier.experiments;
  out.signatures = {{times(data, carrier.constant, carrier.joint, [=](double q) { return std::sin(cycles * q); }),
                     times(data, carrier.constant, carrier.joint, [=](double q) { return std::cos(cycles * q); })}};
  return out;
}

}  // namespace kr5::gap
