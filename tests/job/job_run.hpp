#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include <unistd.h>

#include <kr5/job/journal_writer.hpp>
#include <kr5/job/supervisor.hpp>

#include "fake_cell.hpp"

/// @file
/// Programs that do a job in a fake cell, one after the other: each takes up what the journal says, and may end at any
/// instant.

namespace kr5::test {

/// A folder that is removed again.
class Folder {
 public:
  Folder() {
    static int made = 0;
    path_ =
        std::filesystem::temp_directory_path() / ("kr5_job_" + std::to_string(getpid()) + "_" + std::to_string(++made));
    std::filesystem::create_directory(path_);
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  std::filesystem::path operator/(const char* name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

/// One program: from its start to its end, or until it is killed, with all that is not on the disk.
class Program {
 public:
  Program(FakeCell& cell, const std::filesystem::path& file, const job::JobOptions& options, std::uint64_t seed = 1)
      : cell_(cell), journal_(file, "test"), random_(seed), ring_(std::make_unique<job::RecordRing>()) {
    ring_->begin_after(journal_.last_number());
    decision_ = job::decide_restart(journal_.belief(), cell.measure(), FakeCell::restart_options());
    if (job::goes_on(decision_.status)) supervisor_ = std::make_unique<job::Supervisor>(options, decision_, *ring_);
  }

  /// One cycle; what the disk and the cameras take is random.
  void cycle() {
    const robot::RobotReading reading = cell_.read();
    command_ = supervisor_->step(reading);
    if (first_) first_gap_ = (command_.tool.translation() - reading.T_base_tool.translation()).norm();
    const double way = (command_.tool.translation() - last_.translation()).norm();
    if (!first_ && !command_.stop) most_way_ = std::max(most_way_, way);
    first_ = false;
    last_ = command_.tool;
    cell_.send(command_);
    if (random_.integer(3) == 0) write();
    if (answering) answer();
  }
  void write() {
    if (ring_->after(unwritable - 1) == nullptr) job::write_records(*ring_, journal_, problem_);
  }
  /// Until the job ends, or a condition holds.
  bool run(const std::function<bool()>& until = [] { return false; }) {
    for (int k = 0; supervisor_ && k < 200000 && !supervisor_->finished(); ++k) {
      if (until()) return false;
      cycle();
    }
    write();
    return supervisor_ && supervisor_->finished();
  }

  const job::RestartDecision& decision() const { return decision_; }
  job::Supervisor& supervisor() { return *supervisor_; }
  job::Journal& journal() { return journal_; }
  job::RecordRing& ring() { return *ring_; }
  const robot::RobotCommand& command() const { return command_; }
  const std::string& problem() const { return problem_; }
  double first_gap() const { return first_gap_; }
  double most_way() const { return most_way_; }

  bool answering = true;  ///< Whether scans and looks are made.
  std::function<bool(const job::WayRequest&)> has_way = [](const job::WayRequest&) { return true; };
  /// Record that never comes to the disk; neither do those behind it.
  std::uint64_t unwritable = ~std::uint64_t{0};

 private:
  static job::WayResult no_way(const job::PerceptionRequest& asked) {
    job::WayResult out;
    out.stamp = asked.stamp;
    return out;
  }
  void answer() {
    const job::PerceptionRequest asked = supervisor_->request();
    if (asked.kind == job::RequestKind::None || random_.integer(10) != 0) return;
    if (asked.kind == job::RequestKind::Scan) supervisor_->deliver(cell_.scan(asked.stamp));
    if (asked.kind == job::RequestKind::Hole) supervisor_->deliver(cell_.look(asked.stamp));
    if (asked.kind == job::RequestKind::Station || asked.kind == job::RequestKind::Tube)
      supervisor_->deliver(cell_.place(asked));
    if (asked.kind == job::RequestKind::Way)
      supervisor_->deliver(has_way(asked.way) ? cell_.way(asked) : no_way(asked));
  }

  FakeCell& cell_;
  job::Journal journal_;
  Random random_;
  std::unique_ptr<job::RecordRing> ring_;
  job::RestartDecision decision_;
  std::unique_ptr<job::Supervisor> supervisor_;
  robot::RobotCommand command_;
  Pose last_ = Pose::Identity();
  std::string problem_;
  double first_gap_ = 0.0, most_way_ = 0.0;
  bool first_ = true;
};

}  // namespace kr5::test
