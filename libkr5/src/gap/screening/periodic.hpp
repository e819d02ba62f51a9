// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "gap/fitting/fit.hpp"

/// @file
/// Effects that are periodic in a joint angle, with any number of cycles, at the cost of one simulation: the signature
/// of `c` cycles is that of a constant (torque, angle) times sin(c q) and cos(c q).

namespace kr5::gap {

constexpr int most_cycles = 200;

/// The signature of a constant where the periodic effect acts, and the joint angle q it is periodic in.
struct Carrier {
  std::string effect;
  int joint = 0;
  std::vector<int> experiments;
  Signature constant;
  std::vector<Eigen::ArrayXcd> turns;  ///< e^{iq} of the rows of each part of `constant`.
  double square = 0.0;                 ///< Sum of its squares.
  Eigen::ArrayXcd squares;             ///< Sums of its squares times e^{2icq}, for every number of cycles c.
};

/// Takes the carrier from the signatures of one cycle, sine and cosine.
Carrier make_carrier(const ComparisonData& data, const Candidate& one_cycle, int joint);

/// Cycles whose sine and cosine take most from what is left, best first.
std::vector<int> best_cycles(const ComparisonData& data, const Carrier& carrier, const Eigen::VectorXd& left,
                             int count);

/// The effect with so many cycles, its signature from the carrier.
Candidate modulated(const ComparisonData& data, const Carrier& carrier, int cycles);

}  // namespace kr5::gap
