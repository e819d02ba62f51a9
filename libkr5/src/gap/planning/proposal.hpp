// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <kr5/cell/recording.hpp>
#include <kr5/gap/diagnosis.hpp>

/// @file
/// Experiments that a cell could do next.

namespace kr5::gap {

/// To start an experiment [s].
inline constexpr double set_up = 30.0;

/// An experiment with its given columns, and how to do it.
struct Proposal {
  cell::Experiment experiment;
  std::string what;
  double load = 0.0;     ///< [kg]
  double seconds = 0.0;  ///< To do it, set-up and waiting included [s].
};

/// What proposals start from.
struct Family {
  const cell::Recording& recording;
  std::vector<int> joints;  ///< That the effects sit on, from 0; they are tried in more ways.
  double speed = 0.7;       ///< Part of the speed limits.
  double load = 0.0;        ///< [kg]
  double wait = 1800.0;     ///< [s]
  std::uint64_t seed = 1;
  bool brief = false;  ///< A few short ones.
};

/// Proposals of a kind; none where the cell lacks what they need, or (views, scan, profile) none was recorded.
std::vector<Proposal> proposals(const Family& family, cell::Kind kind);

/// The first recorded experiment of a kind, or nothing.
const cell::Experiment* recorded_experiment(const cell::Recording& recording, cell::Kind kind);
/// When the clock of a kind stands after all that was recorded [s].
double end_time_of(const cell::Recording& recording, cell::Kind kind);
/// Joints that effects sit on, from 0.
std::vector<int> joints_of(const std::vector<std::vector<EffectName>>& all);
/// An experiment like one that was recorded: its given columns after its clock, `what` and the time it takes.
Proposal repeat_experiment(const Family& family, const cell::Experiment& e, const std::string& what);
/// A number with two digits.
std::string two_digits(double value);

}  // namespace kr5::gap
