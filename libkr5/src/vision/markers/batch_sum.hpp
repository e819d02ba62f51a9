// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "vision/grey_level_fit.hpp"

namespace kr5::vision {

constexpr int lanes = 16;
/// One number for each of some samples. Single precision: the processor takes four of them at a time, and a millionth
/// of a grey level is nothing.
using Lane = Eigen::Array<float, lanes, 1>;

/// Normal equations of many residuals, `lanes` at a time. Sums are handed on to double precision before they grow long.
template <int N>
class BatchSum {
 public:
  /// Derivatives, and as the last one the residual (model - seen); `used`: 0 or 1 for each.
  void add(std::array<Lane, N + 1>& J, const Lane& used, double scale) {
    const auto bound = static_cast<float>(huber_limit * scale);
    const Lane size = J[N].abs(), w = used * (size > bound).select(bound / size.max(1e-20f), 1.0f);
    cost_ += static_cast<double>((w * size * (size > bound).select(2 * size - bound, size)).sum());
    count_ += static_cast<int>(used.sum());
    const Lane root = w.sqrt();
    for (Lane& column : J) column *= root;
    auto* sum = sums_.data();
    for (int c = 0; c < N; ++c)
      for (int r = c; r <= N; ++r, ++sum) {
        const Lane product = J[static_cast<std::size_t>(r)] * J[static_cast<std::size_t>(c)];
        *sum += (product.segment<4>(0) + product.segment<4>(4)) + (product.segment<4>(8) + product.segment<4>(12));
      }
    if (++pending_ == 8) hand_on();
  }

  NormalEquations<N> result() {
    hand_on();
    total_.cost = cost_, total_.count = count_;
    return total_;
  }

 private:
  void hand_on() {
    auto* sum = sums_.data();
    for (int c = 0; c < N; ++c)
      for (int r = c; r <= N; ++r, ++sum) {
        (r < N ? total_.information(r, c) : total_.gradient[c]) += static_cast<double>(sum->sum());
        sum->setZero();
      }
    pending_ = 0;
  }

  using Part = Eigen::Array<float, 4, 1>;
  std::array<Part, N*(N + 3) / 2> sums_ = [] {
    std::array<Part, N*(N + 3) / 2> zero;
    zero.fill(Part::Zero());
    return zero;
  }();
  NormalEquations<N> total_;
  double cost_ = 0.0;
  int count_ = 0, pending_ = 0;
};

}  // namespace kr5::vision
