// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "gap/fit.hpp"

/// @file
/// Effects that are periodic in a joint angle, with any number of cycles, at the cost of one simulation: the signature
/// of `c` cycles is that of a constant (torque, angle) times sin(c q) and cos(c q).

namespace kr5::gap {

/// The signature of a constant where the periodic effect acts, and the joint angle it is periodic in.
struct Carrier {
  std::string effect;
  int joint = 0;
  std::vector<int> experiments;
  Signature constant;
};

constexpr int most_cycles = 200;

/// Takes the carrier from the signatures of one cycle, sine and cosine.
Carrier make_carrier(const Data& data, const Candidate& one_cycle, int joint);

/// Cycles whose sine and cosine take most from what is left, best first.
std::vector<int> best_cycles(const Data& data, const Carrier& carrier, const Eigen::VectorXd& left, int count);

/// The effect with so many cycles, its signature from the carrier.
Candidate modulated(const Data& data, const Carrier& carrier, int cycles);

}  // namespace kr5::gap
