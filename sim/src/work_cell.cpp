// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/work_cell.hpp>

#include <cmath>
#include <limits>
#include <utility>

#include <kr5/core/error.hpp>
#include <kr5/io/fields.hpp>
#include <kr5/physics/tube.hpp>

#include "work_cell_world.hpp"

namespace kr5::sim {
namespace {

/// The plate of the stand as a bin without walls, with what lies on it.
PelletScene stand_scene(const CellSolids& solids, const std::vector<PelletTruth>& pellets) {
  constexpr double flat = 1e-5;  // height of walls that nobody sees [m]
  PelletScene out;
  out.bin = {.T_base_bin = solids.stand.T_base_stand, .wall = flat};
  out.bin.size << solids.stand.size, flat;
  for (const PelletTruth& p : pellets)
    if (p.place == PelletPlace::Stand || p.place == PelletPlace::Loose)
      out.pellets.push_back({out.bin.T_base_bin.inverse() * p.T_base_pellet, p.radius, p.height});
  return out;
}

PelletScene bin_scene(const CellSolids& solids, const std::vector<PelletTruth>& pellets) {
  PelletScene out{solids.bin, {}};
  for (const PelletTruth& p : pellets)
    if (p.place == PelletPlace::Bin)
      out.pellets.push_back({out.bin.T_base_bin.inverse() * p.T_base_pellet, p.radius, p.height});
  return out;
}

/// What is in a tube or beside it, as in a bin whose floor is out of sight: a bore may go down through the table.
PelletScene tube_scene(const CellSolids& solids, const std::vector<PelletTruth>& pellets) {
  constexpr double flat = 1e-5, size = 0.1, below = 10.0;  // of a bin that nobody sees [m]
  PelletScene out;
  out.bin = {.T_base_bin = solids.T_base_tubes.front() * Pose(Eigen::Translation3d(0, 0, -below)), .wall = flat};
  out.bin.size << size, size, flat;
  for (const PelletTruth& p : pellets)
    if (p.place != PelletPlace::Bin && p.place != PelletPlace::Grip)
      out.pellets.push_back({out.bin.T_base_bin.inverse() * p.T_base_pellet, p.radius, p.height});
  return out;
}

std::vector<SolidInBin> tubes_in(const PelletScene& scene, const cell::Cell& real, const CellSolids& solids) {
  std::vector<SolidInBin> out;
  for (const Pose& T_base_tube : solids.T_base_tubes)
    out.push_back({physics::tube_object(real), scene.bin.T_base_bin.inverse() * T_base_tube});
  return out;
}

/// Stand and tubes for camera and line scanner. @param first Tube from which on.
std::vector<cell::PlacedObject> objects(const cell::Cell& real, const CellSolids& solids, std::size_t first) {
  std::vector<cell::PlacedObject> out;
  for (std::size_t i = first; i < solids.T_base_tubes.size(); ++i) {
    cell::PlacedObject tube = physics::tube_object(real);
    tube.name += std::to_string(i + 1);
    tube.T_base_object = solids.T_base_tubes[i];
    out.push_back(tube);
  }
  cell::PlacedObject plate;
  plate.kind = SolidKind::Plate;
  plate.name = "stand";
  plate.width = solids.stand.size.x();
  plate.height = solids.stand.size.y();
  plate.T_base_object = solids.stand.T_base_stand;
  out.push_back(plate);
  return out;
}

}  // namespace

WorkCell::WorkCell(const cell::Cell& cell, const WorkCellOptions& options)
    : world_(std::make_unique<World>(cell, options)) {}
WorkCell::~WorkCell() = default;
WorkCell::WorkCell(WorkCell&&) noexcept = default;
WorkCell& WorkCell::operator=(WorkCell&&) noexcept = default;

const cell::Cell& WorkCell::believed() const { return world_->believed; }
const WorkCellOptions& WorkCell::options() const { return world_->options; }
double WorkCell::cycle() const { return world_->arm.cycle(); }

void WorkCell::place(const Eigen::VectorXd& joints) {
  require(world_->now.gripper.pellet < 0, "joints: the gripper holds a pellet, which would be torn along");
  world_->arm.place(joints);
  world_->now.T_base_tool = world_->arm.T_base_tool();
  world_->now.velocity.setZero();
}

robot::RobotReading WorkCell::read() { return world_->arm.read(world_->now.gripper.pellet >= 0); }
void WorkCell::send(const robot::RobotCommand& command) { world_->send(command); }

void WorkCell::start_scan() {
  WorkCellRecord& now = world_->now;
  now.scanning = true;
  ++now.scans;
  now.scan_times.clear();
  now.scan_real.clear();
  now.scan_told.clear();
}

std::function<BinScan()> WorkCell::end_scan(ScanPlace place) {
  WorkCellRecord& now = world_->now;
  require(std::exchange(now.scanning, false), "scan: none was started");
  require(now.scan_times.size() >= 2, "scan: the arm must move for two cycles at least");
  ScanPath path;
  path.times = Eigen::Map<const Eigen::VectorXd>(now.scan_times.data(), std::ssize(now.scan_times));
  path.T_base_flange = now.scan_real;
  BinScannerOptions scanner = world_->options.scanner;
  scanner.seed += 1000 * now.scans;
  if (!world_->options.noise) scanner.noise = 0.0;
  const CellSolids& solids = world_->solids;
  const PelletScene scene = place == ScanPlace::Bin     ? bin_scene(solids, now.pellets)
                            : place == ScanPlace::Stand ? stand_scene(solids, now.pellets)
                                                        : tube_scene(solids, now.pellets);
  std::vector<SolidInBin> beside;
  if (place == ScanPlace::Tube) beside = tubes_in(scene, world_->real, solids);
  return [scene, path, scanner, beside, told = now.scan_told] {
    BinScan out = scan_bin(scene, path, scanner, beside);
    out.T_base_flange = told;
    return out;
  };
}

Profile WorkCell::profile() {
  require(world_->real.laser.has_value(), "laser: the cell has none");
  LineScannerOptions options;
  options.noise = world_->options.noise;
  options.seed = static_cast<int>(world_->options.seed) + ++world_->now.profiles;
  LineScanner scanner(world_->real, objects(world_->real, world_->solids, 0), options);
  const Pose T_base_flange = world_->arm.T_base_flange();
  const Pose T_base_scanner = T_base_flange * scanner.T_flange_scanner();
  const double speed = world_->twist_at(T_base_scanner.translation()).head<3>().dot(T_base_scanner.linear().col(1));
  return scanner.read(T_base_flange, speed);
}

BinImage WorkCell::bin_picture(const BinImageOptions& options) const {
  const predict::CameraScene seen = picture();
  return render_bin(bin_scene(world_->solids, world_->now.pellets), seen.lens, seen.T_base_camera, options);
}

predict::CameraScene WorkCell::picture() const {
  require(world_->real.camera.has_value(), "camera: the cell has none");
  return predict::camera_scene(world_->real, world_->arm.T_base_flange(), objects(world_->real, world_->solids, 1));
}

WorkCellTruth WorkCell::truth() const {
  const WorkCellRecord& now = world_->now;
  WorkCellTruth out;
  out.time = world_->arm.time();
  out.T_base_flange = world_->arm.T_base_flange();
  out.T_base_tool = world_->arm.T_base_tool();
  out.T_base_bin = world_->solids.bin.T_base_bin;
  out.T_base_stand = world_->solids.stand.T_base_stand;
  out.T_base_tubes = world_->solids.T_base_tubes;
  out.pellets = now.pellets;
  for (int i = 0; i < static_cast<int>(out.pellets.size()); ++i) {
    PelletTruth& p = out.pellets[static_cast<std::size_t>(i)];
    p.tube = world_->solids.tube_around(world_->body(i));
    p.depth = p.tube >= 0 ? world_->solids.depth_in(p.tube, world_->body(i)) : 0.0;
  }
  out.gripped = now.gripper.pellet;
  if (out.gripped >= 0) out.T_tool_pellet = out.T_base_tool.inverse() * world_->pellet(out.gripped).T_base_pellet;
  out.slip = now.gripper.slipped + (world_->peg && !now.gripper.rigid ? world_->peg->slipped() : 0.0);
  out.contact = world_->arm.touched();
  out.max_force = now.gripper.force;
  return out;
}

WorkCellState WorkCell::state() const { return {io::to_node(world_->record())}; }

void WorkCell::restore(const WorkCellState& state) {
  WorkCellRecord from;
  io::Reader reader("state of a work cell");
  reader.read(state.document, "", from);
  reader.finish();
  world_->restore(from);
}

}  // namespace kr5::sim
