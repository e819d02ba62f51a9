// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/job/belief.hpp>

namespace kr5::job {
namespace {

PelletEntry& entry_of(JobBelief& belief, const JobRecord& record) {
  while (static_cast<int>(belief.pellets.size()) < record.pellet) {
    PelletEntry added;
    added.number = static_cast<int>(belief.pellets.size()) + 1;
    added.begin = record.time;
    belief.pellets.push_back(added);
  }
  return belief.pellets[static_cast<std::size_t>(record.pellet - 1)];
}

void note_pellet(JobBelief& belief, const JobRecord& record) {
  if (record.pellet < 1) return;
  PelletEntry& entry = entry_of(belief, record);
  if (record.pellet_state == PelletState::Inserted && entry.state != PelletState::Inserted) ++belief.inserted;
  if (!finished(entry.state)) entry.end = record.time;
  entry.state = record.pellet_state;
  if (record.kind == RecordKind::Enter && record.phase == Phase::Pick) ++entry.picks;
  const bool begins =
      record.kind == RecordKind::Enter && record.phase == Phase::Search && record.outcome == Outcome::HoleFound;
  if (begins || record.kind == RecordKind::Attempt) ++entry.insertions;
}

void note_stop(JobBelief& belief, const JobRecord& record) {
  if (record.kind == RecordKind::Stop && belief.stop == StopReason::None) belief.stop = record.stop;
  if (record.kind == RecordKind::Release) belief.stop = StopReason::None;
}

}  // namespace

PelletState JobBelief::pellet_state() const noexcept {
  return pellet >= 1 ? pellets[static_cast<std::size_t>(pellet - 1)].state : PelletState::Waiting;
}

JobBelief believe(std::span<const JobRecord> records) {
  JobBelief out;
  for (const JobRecord& record : records) {
    out.begun = true;
    note_stop(out, record);
    if (record.kind == RecordKind::Stop || record.kind == RecordKind::Release) continue;
    note_pellet(out, record);
    if (record.phase != Phase::Look) out.phase = record.phase;  // it looks for what an earlier phase left
    out.pellet = record.pellet;
    out.station = record.station;
  }
  return out;
}

}  // namespace kr5::job
