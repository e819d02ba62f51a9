// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>

#include <kr5/cell/cell.hpp>
#include <kr5/predict/camera_scene.hpp>
#include <kr5/robot/robot.hpp>
#include <kr5/sim/bin_image.hpp>
#include <kr5/sim/bin_scan.hpp>
#include <kr5/sim/line_scanner.hpp>
#include <kr5/sim/work_cell_options.hpp>
#include <kr5/sim/work_cell_state.hpp>
#include <kr5/sim/work_cell_truth.hpp>

/// @file
/// A simulated work cell for the way of pellets from a bin to tubes (Hayat et al. 2022, chapter 6): arm, force/torque
/// sensor, suction cup and fingers, scanner and camera; bin, stand and tubes. It moves when it is sent a command, and
/// tells what a real cell would tell. Whatever else is known of it is its `truth`, for judges alone.
///
/// Only pellets touch: arm and grippers pass through everything. What lies at rest stays where it is when a pellet
/// from the grip presses on it; a pellet that is pulled out of the pile, or falls into the bin, moves the others.

namespace kr5::sim {

/// Where pellets are looked for.
enum class ScanPlace { Bin, Stand, Tube };
constexpr auto enum_names(ScanPlace) {
  return names<ScanPlace>({{ScanPlace::Bin, "bin"}, {ScanPlace::Stand, "stand"}, {ScanPlace::Tube, "tube"}});
}

/// The same commands to a cell of the same options give the same readings, bit by bit.
class WorkCell : public robot::Robot {
 public:
  /// The arm rests at joint values 0 until it is placed; the pellets are poured and lie still.
  /// @throws InvalidArgument naming the option, or the part of the cell that is not there: tool, contact, tube, servo,
  /// links of the arm; pellets that do not fit into the bin.
  explicit WorkCell(const cell::Cell& cell, const WorkCellOptions& options = {});
  ~WorkCell() override;
  WorkCell(WorkCell&&) noexcept;
  WorkCell& operator=(WorkCell&&) noexcept;

  /// What the controller is told of the cell: nominal pellet as its peg, bores by the clearance, no effects.
  const cell::Cell& believed() const;
  const WorkCellOptions& options() const;

  /// The arm stands there at rest, with no command on its way; pellets stay where they are.
  /// @throws InvalidArgument for joint values that are not as many as those of the arm, or with a pellet in the grip.
  void place(const Eigen::VectorXd& joints);
  robot::RobotReading read() override;
  void send(const robot::RobotCommand& command) override;
  double cycle() const override;

  /// Profiles are taken from now on, one each cycle.
  void start_scan();
  /// They end: profiles over the real motion, with the poses that the arm reported.
  /// @throws InvalidArgument when no scan was started, or the arm has not moved since.
  BinScan finish_scan(ScanPlace place) { return end_scan(place)(); }
  /// The same, what the scanner saw yet to be computed: by any thread, while the cell goes on.
  std::function<BinScan()> end_scan(ScanPlace place);
  /// The profile of the line scanner of the cell on stand and tubes at this instant, in its own frame.
  /// @throws InvalidArgument for a cell without laser.
  Profile profile();
  /// Picture of the bin by the camera of the cell.
  /// @throws InvalidArgument for a cell without camera.
  BinImage bin_picture(const BinImageOptions& options = {}) const;
  /// What the camera has before it besides pellets: tubes and stand, to be drawn by vision::render.
  /// @throws InvalidArgument for a cell without camera.
  predict::CameraScene picture() const;

  /// Not for controllers.
  WorkCellTruth truth() const;

  /// The whole state after a command and before the next reading: a cell that is given it goes on as this one does.
  WorkCellState state() const;
  /// @throws InvalidArgument naming the field that does not fit this cell.
  void restore(const WorkCellState& state);

 private:
  struct World;
  std::unique_ptr<World> world_;
};

}  // namespace kr5::sim
