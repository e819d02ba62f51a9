// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/work/job_cycle.hpp>

#include <atomic>

#include "work/handover.hpp"

namespace kr5::work {
namespace {

constexpr std::size_t most_rows = 8192;  // on their way: 98 s at 12 ms

}  // namespace

struct JobCycle::Shared {
  Shared(const WorkOptions& options, const job::RestartDecision& start, const cell::Cell& believed,
         job::RecordRing& ring)
      : controller(options.job, start, believed, ring), rows(most_rows) {}

  void take_results() noexcept;
  void ask(const robot::RobotReading& reading) noexcept;

  WorkController controller;
  HandoverSlot<job::ScanResult> scan;
  HandoverSlot<job::HoleResult> hole;
  HandoverSlot<job::PlaceResult> place;
  HandoverSlot<job::WayResult> way;
  HandoverSlot<LookRequest> request;
  HandoverRing<CycleRow> rows;
  std::atomic<std::uint64_t> lost_rows{0};
  std::atomic<bool> finished = false;
  robot::RobotReading last;
  bool begun = false;
  std::int64_t asked = -1;  ///< Stamp of the request that was handed over last.
};

void JobCycle::Shared::take_results() noexcept {
  const auto take = [this](auto& slot) {
    const auto* result = slot.look();
    if (!result) return;
    controller.supervisor().deliver(*result);
    slot.take();
  };
  take(scan);
  take(hole);
  take(place);
  take(way);
}

void JobCycle::Shared::ask(const robot::RobotReading& reading) noexcept {
  const job::PerceptionRequest& now = controller.supervisor().request();
  if (now.kind == job::RequestKind::None || now.stamp == asked) return;
  if (request.put({now, reading.joints, reading.T_base_flange})) asked = now.stamp;
}

JobCycle::JobCycle(const WorkOptions& options, const job::RestartDecision& start, const cell::Cell& believed,
                   job::RecordRing& ring)
    : shared_(std::make_unique<Shared>(options, start, believed, ring)) {}
JobCycle::~JobCycle() = default;
JobCycle::JobCycle(JobCycle&&) noexcept = default;

robot::RobotCommand JobCycle::step(const robot::RobotReading& reading) noexcept {
  Shared& s = *shared_;
  s.take_results();
  const robot::RobotCommand command = s.controller.step(reading);
  const job::Supervisor& supervisor = s.controller.supervisor();
  const CycleRow row{reading, s.controller.setpoint(), command.gripper, supervisor.state(),
                     supervisor.insertion().attempt};
  if (!s.rows.put(row)) s.lost_rows.fetch_add(1, std::memory_order_relaxed);
  s.ask(reading);
  s.last = reading;
  s.begun = true;
  s.finished.store(supervisor.finished(), std::memory_order_release);
  return command;
}

std::optional<LookRequest> JobCycle::take_request() noexcept {
  const LookRequest* found = shared_->request.look();
  if (!found) return std::nullopt;
  const LookRequest out = *found;
  shared_->request.take();
  return out;
}

bool JobCycle::deliver(const job::ScanResult& result) noexcept { return shared_->scan.put(result); }
bool JobCycle::deliver(const job::HoleResult& result) noexcept { return shared_->hole.put(result); }
bool JobCycle::deliver(const job::PlaceResult& result) noexcept { return shared_->place.put(result); }
bool JobCycle::deliver(const job::WayResult& result) noexcept { return shared_->way.put(result); }

void JobCycle::take_rows(const std::function<void(const CycleRow& row)>& use) {
  for (const CycleRow* row = shared_->rows.look(); row; row = shared_->rows.look()) {
    use(*row);
    shared_->rows.take();
  }
}

std::uint64_t JobCycle::lost_rows() const noexcept { return shared_->lost_rows.load(std::memory_order_relaxed); }
void JobCycle::stop_by_operator() noexcept { shared_->controller.supervisor().stop_by_operator(); }
bool JobCycle::finished() const noexcept { return shared_->finished.load(std::memory_order_acquire); }

/// The supervisor latches with the last reading, as it would have with the next one.
void JobCycle::end() noexcept {
  if (finished() || !shared_->begun) return;
  shared_->controller.supervisor().note_lost_link();
  step(shared_->last);
}

const job::JobState& JobCycle::state() const noexcept { return shared_->controller.supervisor().state(); }
const force::InsertionState& JobCycle::insertion() const noexcept {
  return shared_->controller.supervisor().insertion();
}

}  // namespace kr5::work
