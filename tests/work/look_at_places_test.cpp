#include <kr5/work/look_at_places.hpp>

#include <catch2/catch.hpp>

#include <kr5/physics/tube.hpp>
#include <kr5/sim/bin_scan.hpp>

namespace look_at_places_test {

using namespace kr5;

namespace {

const sim::WorkCell& cell() {
  static const sim::WorkCell made(cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml"), {.pour = {.pellets = 1}});
  return made;
}

picking::Cloud cloud_of(const sim::BinScan& scan) {
  picking::Cloud out;
  out.points = scan.cloud().transpose();
  out.origins = scan.origins().transpose();
  return out;
}

/// The way of the scanner of the cell over a place.
sim::ScanPath path_over(const Pose& T_base_place, double reach) {
  const sim::BinScannerOptions& scanner = cell().options().scanner;
  sim::ScanPath out;
  constexpr int profiles = 100;
  out.times = Eigen::VectorXd::LinSpaced(profiles, 0, 1);
  for (const double t : out.times)
    out.T_base_flange.push_back(T_base_place * Eigen::Translation3d(0, (2 * t - 1) * reach, scanner.stand_off) *
                                Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()) * scanner.T_flange_scanner.inverse());
  return out;
}

/// What is seen of the tube with pellets whose middles are at these depths.
job::PlaceResult look_at_tube(const std::vector<double>& depths, double tilt = 0.0) {
  const work::WorkOptions options = work::work_options(cell());
  const cell::Cell& believed = cell().believed();
  const Pose& tube = believed.tube->T_base_tube;
  sim::PelletScene scene;
  scene.bin = {.T_base_bin = tube * Pose(Eigen::Translation3d(0, 0, -10)), .size = {0.1, 0.1, 1e-5}, .wall = 1e-5};
  for (const double depth : depths)
    scene.pellets.push_back({scene.bin.T_base_bin.inverse() * tube * Eigen::Translation3d(0, 0, -depth) *
                                 Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitX()),
                             believed.peg->radius, believed.peg->length});
  const std::vector<sim::SolidInBin> solids{{physics::tube_object(believed), scene.bin.T_base_bin.inverse() * tube}};
  return work::look_at_tube(cloud_of(sim::scan_bin(scene, path_over(tube, 0.025), cell().options().scanner, solids)),
                            believed, options);
}

job::PlaceResult look_at_stand(bool pellet) {
  const work::WorkOptions options = work::work_options(cell());
  const sim::StandShape& stand = cell().options().stand;
  sim::PelletScene scene;
  scene.bin = {.T_base_bin = stand.T_base_stand, .size = {0.12, 0.12, 1e-5}, .wall = 1e-5};
  const double height = options.pellets.min_height;
  if (pellet)
    scene.pellets.push_back({Pose(Eigen::Translation3d(0.025, 0.003, 0.5 * height)), options.pellets.radius, height});
  return work::look_at_stand(
      cloud_of(sim::scan_bin(scene, path_over(stand.T_base_stand, 0.05), cell().options().scanner)), options);
}

}  // namespace

TEST_CASE("a scan of the tube shows how deep the bore is free") {
  const double half = 0.5 * cell().believed().peg->length;
  for (const double top : {0.002, 0.01, 0.03}) {
    const job::PlaceResult seen = look_at_tube({top + half, top + 3 * half});
    INFO(top << " m");
    CHECK(seen.seen);
    CHECK_FALSE(seen.occupied);
    REQUIRE(seen.depth.has_value());
    CHECK(*seen.depth == Approx(top).margin(5e-4));
  }
}

TEST_CASE("a pellet that stands out of the tube, or leans in its mouth, is told from one that is in") {
  const double half = 0.5 * cell().believed().peg->length;
  CHECK(look_at_tube({half - 0.005}).occupied);
  CHECK(look_at_tube({-half}).occupied);
  CHECK(look_at_tube({half - 0.004}, 0.05).occupied);
}

TEST_CASE("a scan of the stand shows whether a pellet is on it") {
  CHECK(look_at_stand(true).occupied);
  CHECK(look_at_stand(false).seen);
  CHECK_FALSE(look_at_stand(false).occupied);
}

TEST_CASE("a cloud that shows neither stand nor tube shows nothing") {
  const work::WorkOptions options = work::work_options(cell());
  picking::Cloud elsewhere;
  elsewhere.points = Eigen::Matrix3Xd::Constant(3, 200, 5.0);
  CHECK_FALSE(work::look_at_stand(elsewhere, options).seen);
  CHECK_FALSE(work::look_at_tube(elsewhere, cell().believed(), options).seen);
}

}  // namespace look_at_places_test
