// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/core/fields.hpp>

/// @file
/// The phases of a job from bin to tube, and what ends each of them (Hayat et al. 2022, chapter 6).

namespace kr5::job {

enum class Phase {
  CheckCell,  ///< Whether the cell is as it is believed, with the arm standing.
  Look,       ///< At the places where a job that was interrupted may have left its pellet.
  Scan,       ///< Over the bin, until a scan tells what can be picked.
  Pick,       ///< A pellet of the bin, until the gripper holds it.
  Stand,      ///< Out of the bin and onto the station, until it stands there alone.
  Regrip,     ///< Taken from the station as it goes into the tube.
  Approach,   ///< To the tube, looked for until its place is known.
  Search,     ///< By force, until the pellet is in the mouth of the bore.
  Insert,     ///< Pushed to its depth.
  Next,       ///< Let go, away from the tube, counted.
  Stopped,    ///< Held, until a person has released the stop.
  Done,
};
constexpr int phase_count = 12;
constexpr auto enum_names(Phase) {
  using enum Phase;
  return names<Phase>({{CheckCell, "check_cell"},
                       {Look, "look"},
                       {Scan, "scan"},
                       {Pick, "pick"},
                       {Stand, "stand"},
                       {Regrip, "regrip"},
                       {Approach, "approach"},
                       {Search, "search"},
                       {Insert, "insert"},
                       {Next, "next"},
                       {Stopped, "stopped"},
                       {Done, "done"}});
}

/// What ends a phase.
enum class Outcome {
  None,  ///< It goes on.
  CellReady,
  Resumed,  ///< The cell is ready, and a job that was interrupted goes on where it was.
  CellFault,
  NotSeen,        ///< A look has not shown the place.
  Contradiction,  ///< What is seen cannot be: a person must look.
  PicksFound,
  NothingGraspable,
  BinEmpty,
  Gripped,
  HeldLying,  ///< The gripper holds it, but not as it goes into the tube: it is put down once more.
  NotGripped,
  NoPickLeft,  ///< Every pick of the scan has been tried.
  Stood,
  NotReleased,
  Dropped,        ///< The gripper lost what it held.
  DroppedInBore,  ///< The same in the mouth of the tube.
  HoleFound,
  HoleMoved,  ///< It is not where the arm went; nearer, the next look tells more.
  HoleNotFound,
  InBore,
  NotInserted,
  Unreachable,  ///< The arm cannot go where it should, nor on from there; nothing was touched for it.
  AtDepth,
  LeftBore,  ///< Blocked, and out again for another attempt.
  NextPick,
  NextScan,
  AllInserted,
  Stop,  ///< The stop has latched.
};
constexpr auto enum_names(Outcome) {
  using enum Outcome;
  return names<Outcome>({{None, "none"},
                         {CellReady, "cell_ready"},
                         {Resumed, "resumed"},
                         {CellFault, "cell_fault"},
                         {NotSeen, "not_seen"},
                         {Contradiction, "contradiction"},
                         {PicksFound, "picks_found"},
                         {NothingGraspable, "nothing_graspable"},
                         {BinEmpty, "bin_empty"},
                         {Gripped, "gripped"},
                         {HeldLying, "held_lying"},
                         {NotGripped, "not_gripped"},
                         {NoPickLeft, "no_pick_left"},
                         {Stood, "stood"},
                         {NotReleased, "not_released"},
                         {Dropped, "dropped"},
                         {DroppedInBore, "dropped_in_bore"},
                         {HoleFound, "hole_found"},
                         {HoleMoved, "hole_moved"},
                         {HoleNotFound, "hole_not_found"},
                         {InBore, "in_bore"},
                         {NotInserted, "not_inserted"},
                         {Unreachable, "unreachable"},
                         {AtDepth, "at_depth"},
                         {LeftBore, "left_bore"},
                         {NextPick, "next_pick"},
                         {NextScan, "next_scan"},
                         {AllInserted, "all_inserted"},
                         {Stop, "stop"}});
}

/// Where a pellet of the job is.
enum class PelletState {
  Waiting,        ///< In the bin.
  Picked,         ///< In the gripper, on its way to the station.
  Stood,          ///< On the station.
  Regripped,      ///< In the gripper, as it goes into the tube.
  Seated,         ///< At its depth in the tube, still held.
  Missing,        ///< Lost from the grip at the tube; whether it is in, is to be seen.
  MissingInBore,  ///< The same in the mouth of the bore.
  Inserted,       ///< In the tube, let go.
  Dropped,        ///< Lost from the grip between bin and tube.
  Lost,           ///< Not where it was put.
};
constexpr auto enum_names(PelletState) {
  using enum PelletState;
  return names<PelletState>({{Waiting, "waiting"},
                             {Picked, "picked"},
                             {Stood, "stood"},
                             {Regripped, "regripped"},
                             {Seated, "seated"},
                             {Missing, "missing"},
                             {MissingInBore, "missing_in_bore"},
                             {Inserted, "inserted"},
                             {Dropped, "dropped"},
                             {Lost, "lost"}});
}

/// Whether nothing more is done with a pellet.
constexpr bool finished(PelletState state) noexcept { return state >= PelletState::Inserted; }
/// Whether a look must tell where it is.
constexpr bool missing(PelletState state) noexcept {
  return state == PelletState::Missing || state == PelletState::MissingInBore;
}

}  // namespace kr5::job
