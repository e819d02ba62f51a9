// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mutex>

#include <kr5/job/perception.hpp>
#include <kr5/picking/cloud.hpp>
#include <kr5/work/job_cycle.hpp>
#include <kr5/work/work_options.hpp>

namespace kr5::work {

/// A simulated cell that one thread moves while another one looks at it.
class SharedCell : public robot::Robot {
 public:
  explicit SharedCell(sim::WorkCell& cell) : cell_(cell) {}

  robot::RobotReading read() override {
    const std::lock_guard held(lock_);
    return cell_.read();
  }
  void send(const robot::RobotCommand& command) override {
    const std::lock_guard held(lock_);
    cell_.send(command);
  }
  double cycle() const override { return cell_.cycle(); }

  template <class Use>
  auto with_cell(Use use) {
    const std::lock_guard held(lock_);
    return use(cell_);
  }
  const cell::Cell& believed() const { return cell_.believed(); }
  const sim::WorkCellOptions& options() const { return cell_.options(); }

 private:
  sim::WorkCell& cell_;
  std::mutex lock_;
};

/// Scanner and camera of a simulated cell, what is made of their data, and ways of its arm.
class CellPerception {
 public:
  /// The cell must outlive it.
  CellPerception(SharedCell& cell, const WorkOptions& options) : cell_(cell), options_(options) {}

  /// Looks or plans, and delivers what was seen or planned.
  void answer(const LookRequest& asked, JobCycle& to);
  /// What was delivered last, for the last request.
  const job::ScanResult* scan() const noexcept { return scan_ ? &*scan_ : nullptr; }
  const job::HoleResult* hole() const noexcept { return hole_ ? &*hole_ : nullptr; }
  const job::PlaceResult* place() const noexcept { return place_ ? &*place_ : nullptr; }
  const job::WayResult* way() const noexcept { return way_ ? &*way_ : nullptr; }

 private:
  job::ScanResult look_into_bin();
  picking::Cloud finish_scan(sim::ScanPlace place);
  job::PlaceResult look_at(job::RequestKind kind);
  job::HoleResult look_for_tube(const Pose& T_base_flange);

  SharedCell& cell_;
  WorkOptions options_;
  int pictures_ = 0;
  std::optional<job::ScanResult> scan_;
  std::optional<job::HoleResult> hole_;
  std::optional<job::PlaceResult> place_;
  std::optional<job::WayResult> way_;
};

}  // namespace kr5::work
