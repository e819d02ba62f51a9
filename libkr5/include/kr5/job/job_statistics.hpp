// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include <kr5/job/record.hpp>

/// @file
/// Figures of a job, from its records and what was measured meanwhile (Hayat et al. 2022, section 6.5).

namespace kr5::job {

/// Cycle by cycle, one column each; empty: not measured.
struct JobSamples {
  Eigen::VectorXd time;       ///< [s]
  Eigen::Matrix3Xd position;  ///< [m]
  Eigen::Matrix3Xd force;     ///< [N]
  std::vector<int> pellet;

  /// @throws InvalidArgument for unequal lengths, or times that do not rise.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("time", self.time, "Time of each cycle, by the same clock as the records [s].");
    visit("position", self.position, "Commanded position of the tool tip, a column a cycle [m].");
    visit("force", self.force, "Force of the environment on the tool, a column a cycle [N].");
    visit("pellet", self.pellet, "Number of the pellet in work; 0: none.");
  }
};

struct JobStatisticsOptions {
  double contact_force = 1.0;  ///< [N]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("contact_force", self.contact_force, "Force from which there is contact, for the impulse [N].");
  }
};

struct PhaseTime {
  Phase phase = Phase::CheckCell;
  int count = 0;
  double total = 0.0;  ///< [s]
  double max = 0.0;    ///< [s]

  static void each_field(auto& self, auto&& visit) {
    visit("phase", self.phase, "Phase.");
    visit("count", self.count, "How often it was gone through.");
    visit("total", self.total, "Time in it [s].");
    visit("max", self.max, "Longest time in it [s].");
  }
};

struct AttemptCount {
  int attempt = 0;
  int tried = 0;
  int inserted = 0;

  static void each_field(auto& self, auto&& visit) {
    visit("attempt", self.attempt, "Number of the attempt, from 1.");
    visit("tried", self.tried, "Number of pellets that came to it.");
    visit("inserted", self.inserted, "Number of those that it inserted.");
  }
};

struct PelletFigures {
  int number = 0;
  PelletState state = PelletState::Waiting;
  int picks = 0;
  int insertions = 0;
  double time = 0.0;        ///< [s]
  double peak_force = 0.0;  ///< [N]
  double impulse = 0.0;     ///< [N s]
  double peak_jerk = 0.0;   ///< [m/s^3]

  static void each_field(auto& self, auto&& visit) {
    visit("number", self.number, "Number of the pellet, from 1.");
    visit("state", self.state, "Where it is.");
    visit("picks", self.picks, "Number of attempts to pick it.");
    visit("insertions", self.insertions, "Number of attempts to insert it.");
    visit("time", self.time, "Time from its first pick to its end, without interruptions [s].");
    visit("peak_force", self.peak_force, "Maximum force [N].");
    visit("impulse", self.impulse, "Integral of the force of contact over time [N s].");
    visit("peak_jerk", self.peak_jerk, "Maximum jerk of the tool tip [m/s^3].");
  }
};

struct JobStatistics {
  double time = 0.0;  ///< [s]
  int inserted = 0;
  int programs = 0;
  int stops = 0;
  std::vector<PhaseTime> phases;
  std::vector<AttemptCount> attempts;
  std::vector<PelletFigures> pellets;
  double peak_force = 0.0;  ///< [N]
  double impulse = 0.0;     ///< [N s]
  double peak_jerk = 0.0;   ///< [m/s^3]
  double rms_jerk = 0.0;    ///< [m/s^3]

  static void each_field(auto& self, auto&& visit) {
    visit("time", self.time, "Time at work, without interruptions [s].");
    visit("inserted", self.inserted, "Number of pellets in the tube.");
    visit("programs", self.programs, "Number of programs that took the job up.");
    visit("stops", self.stops, "Number of stops.");
    visit("phases", self.phases, "Times by phase.");
    visit("attempts", self.attempts, "Success by attempt to insert.");
    visit("pellets", self.pellets, "Figures of each pellet.");
    visit("peak_force", self.peak_force, "Maximum force [N].");
    visit("impulse", self.impulse, "Integral of the force of contact over time [N s].");
    visit("peak_jerk", self.peak_jerk, "Maximum jerk of the tool tip [m/s^3].");
    visit("rms_jerk", self.rms_jerk, "Root mean square of the jerk of the tool tip [m/s^3].");
  }
};

/// @throws InvalidArgument for invalid samples or options.
JobStatistics job_statistics(std::span<const JobRecord> records, const JobSamples& samples = {},
                             const JobStatisticsOptions& options = {});

}  // namespace kr5::job
