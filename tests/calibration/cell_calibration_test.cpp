#include <map>
#include <numbers>

#include <catch2/catch.hpp>

#include <kr5/calibration/cell_calibration.hpp>
#include <kr5/core/error.hpp>
#include <kr5/kinematics/inverse.hpp>
#include <kr5/uncertainty/confidence.hpp>
#include <support/coverage.hpp>
#include <support/hand_eye_world.hpp>
#include <support/trials.hpp>

#include "scanner_world.hpp"

namespace cell_calibration_test {

using namespace kr5;
using namespace kr5::calibration;
using test::HandEyeWorld;

namespace {

/// A camera as a first calibration leaves it: off by more than its images tell.
Pinhole believed_camera(const Pinhole& camera, Random& random) {
  Pinhole out = camera;
  out.fx += random.normal_vector(1, 4.0)[0], out.fy += random.normal_vector(1, 4.0)[0];
  out.cx += random.normal_vector(1, 4.0)[0], out.cy += random.normal_vector(1, 4.0)[0];
  out.k1 += random.normal_vector(1, 0.01)[0], out.k2 += random.normal_vector(1, 0.01)[0];
  return out;
}

std::vector<CellStop> stops_of(const HandEyeWorld& world) {
  std::vector<CellStop> out;
  for (const HandEyeView& view : world.views) out.push_back({.view = view, .q = {}});
  return out;
}

/// The arm of the book with its alpha3 turned, so that the tool points forward and down.
kinematics::DhChain test_arm() {
  constexpr double quarter = std::numbers::pi / 2;
  kinematics::DhChain arm;
  const double b[] = {0.4, 0, 0, 0.62, 0, 0.115}, offset[] = {0, quarter, 0, 0, 0, 0}, a[] = {0.18, 0.6, 0.12, 0, 0, 0},
               alpha[] = {quarter, 0, quarter, -quarter, quarter, 0};
  for (int i = 0; i < 6; ++i) {
    kinematics::DhJoint& joint = arm.joints.emplace_back();
    joint.b = b[i], joint.theta_offset = offset[i], joint.a = a[i], joint.alpha = alpha[i];
  }
  return arm;
}

/// A cell whose arm, markers and camera are not as believed.
struct ArmCell {
  CellGeometry truth, believed;
  Pose T_flange_camera = Pose::Identity(), T_base_target = Pose::Identity();
  std::vector<CellStop> stops;
};

ArmCell make_arm_cell(std::uint64_t seed, int stops, double arm_error, double marker_error) {
  Random random(seed);
  ArmCell cell;
  cell.truth.camera = test::world_camera();
  cell.truth.arm = test_arm();
  cell.believed.arm = cell.truth.arm;
  for (kinematics::DhJoint& joint : cell.truth.arm.joints) {
    joint.a += arm_error * random.normal_vector(1, 1.0)[0];
    joint.alpha += arm_error * random.normal_vector(1, 1.0)[0];
    joint.theta_offset += arm_error * random.normal_vector(1, 1.0)[0];
  }
  cell.T_flange_camera = from_xyzrpy((Vector6() << 0.05, -0.03, 0.08, 0.1, -0.15, 1.6).finished());
  cell.T_base_target = from_xyzrpy((Vector6() << 0.75, -0.1, 0.05, std::numbers::pi, 0.05, 0.4).finished());
  Eigen::Matrix3Xd points(3, 0);
  std::vector<int> ids;
  for (int row = 0; row < 3; ++row)
    for (int col = 0; col < 4; ++col) {
      MapMarker marker{.id = 10 + 4 * row + col, .size = 0.04};
      marker.T_target_marker.translation() << 0.06 * col, 0.06 * row, 0.0;
      cell.believed.markers.push_back(marker);
      Vector6 d;
      d << random.normal_vector(3, marker_error), random.normal_vector(3, 10 * marker_error);
      if (!ids.empty()) marker.T_target_marker = marker.T_target_marker * to_pose(d);
      cell.truth.markers.push_back(marker);
      points.conservativeResize(3, points.cols() + 4);
      points.rightCols<4>() = marker.T_target_marker * square_corners(marker.size);
      for (int corner = 0; corner < 4; ++corner) ids.push_back(4 * marker.id + corner);
    }
  Eigen::Matrix3Xd listed = points;
  for (std::size_t m = 0; m < cell.believed.markers.size(); ++m)
    listed.middleCols<4>(static_cast<Eigen::Index>(4 * m)) =
        cell.believed.markers[m].T_target_marker * square_corners(0.04);
  const test::HandEyeWorldOptions range{.near = 0.35, .far = 0.6, .tilt = 0.7};
  while (static_cast<int>(cell.stops.size()) < stops) {
    const Pose T_camera_target = test::detail::random_target_pose(random, range, cell.truth.camera, points);
    const Pose T_base_flange = cell.T_base_target * T_camera_target.inverse() * cell.T_flange_camera.inverse();
    const auto reached = kinematics::inverse_kinematics(cell.truth.arm, T_base_flange).postures;
    if (reached.empty()) continue;
    Eigen::VectorXd q =
        reached[static_cast<std::size_t>(random.uniform(0, 0.999) * static_cast<double>(reached.size()))].q;
    const Pose T_exact = cell.truth.arm.flange(q);
    const Pose M = cell.T_flange_camera.inverse() * T_exact.inverse() * cell.T_base_target;
    View view = test::see(random, cell.truth.camera, points, M, 0.1, "stop" + std::to_string(cell.stops.size()));
    view.points = listed, view.ids = ids;
    q += random.normal_vector(6, 2e-5);  // of the encoders
    cell.stops.push_back({.view = {.T_base_flange = cell.believed.arm.flange(q), .view = view}, .q = q});
  }
  cell.believed.camera = believed_camera(cell.truth.camera, random);
  return cell;
}

double camera_error(const Pinhole& camera, const Pinhole& truth) {
  double worst = 0;
  for (const double u : {100.0, 640.0, 1180.0})
    for (const double v : {100.0, 480.0, 860.0})
      worst = std::max(worst, (truth.project(*camera.ray({u, v})) - Eigen::Vector2d(u, v)).norm());
  return worst;
}

}  // namespace

TEST_CASE("exact data give camera and hand-eye exactly, for both mounts") {
  for (const Mount mount : {Mount::EyeInHand, Mount::EyeToHand}) {
    const HandEyeWorld world = test::make_hand_eye_world({.mount = mount, .views = 12, .sigma_pixel = 0});
    Random random(3);
    const CellGeometry believed{.camera = believed_camera(world.camera, random), .markers = {}, .arm = {}};
    CAPTURE(name_of(mount), camera_error(believed.camera, world.camera));
    REQUIRE(camera_error(believed.camera, world.camera) > 1.0);
    const CellCalibrationResult r = calibrate_cell(stops_of(world), believed, {.mount = mount});
    CAPTURE(r.fit.message);
    REQUIRE(r.fit.usable());
    CHECK(camera_error(r.cell.camera, world.camera) < 1e-3);
    CHECK(pose_difference(r.T_mount_camera, world.T_mount_camera).norm() < 1e-6);
    CHECK(pose_difference(r.T_fixed_target, world.T_fixed_target).norm() < 1e-6);
    CHECK(r.unidentifiable.empty());
  }
}

TEST_CASE("the cell's 95 % regions hold camera pose, target pose and lens in 95 %", "[coverage][statistics]") {
  const bool given = GENERATE(true, false);
  const std::string what = std::string("cell, noise ") + (given ? "given" : "estimated");
  test::Coverage camera(what + ": camera pose", 6), target(what + ": target", 6), lens(what + ": focal length", 1);
  const int n = test::trials(2000, 60);
  for (int i = 0; i < n; ++i) {
    const HandEyeWorld world = test::make_hand_eye_world({.views = 15,
                                                          .rows = 5,
                                                          .cols = 6,
                                                          .square = 0.05,
                                                          .sigma_robot_position = 0.0005,
                                                          .sigma_robot_rotation = 0.001,
                                                          .seed = 9000u + static_cast<unsigned>(i)});
    CellCalibrationOptions options;
    if (given) options.sigma_pixel = 0.2, options.sigma_robot_position = 0.0005, options.sigma_robot_rotation = 0.001;
    const CellCalibrationResult r =
        calibrate_cell(stops_of(world), {.camera = world.camera, .markers = {}, .arm = {}}, options);
    REQUIRE(r.fit.usable());
    camera.add(pose_difference(r.T_mount_camera, world.T_mount_camera), r.covariance, r.covariance_dof);
    target.add(pose_difference(r.T_fixed_target, world.T_fixed_target), r.covariance_target, r.covariance_dof);
    REQUIRE(r.parameters.front().name == "camera.fx");
    lens.add(Eigen::VectorXd::Constant(1, r.cell.camera.fx - world.camera.fx),
             Eigen::MatrixXd::Constant(1, 1, r.parameter_covariance(0, 0)), r.covariance_dof);
  }
  for (const test::Coverage* c : {&camera, &target, &lens}) {
    c->check_mean();
    c->check_rate();
  }
}

TEST_CASE("camera, hand-eye, marker map and arm are found together") {
  const ArmCell cell = make_arm_cell(11, 40, 1e-3, 3e-4);
  const CellCalibrationResult r = calibrate_cell(cell.stops, cell.believed);
  CAPTURE(r.fit.message, r.sigma_pixel, r.sigma_robot_position, r.tolerance_length, r.tolerance_angle);
  REQUIRE(r.fit.usable());
  CHECK(r.sigma_pixel == Approx(0.1).epsilon(0.05));
  CHECK(camera_error(r.cell.camera, cell.truth.camera) < 0.5);
  CHECK(camera_error(cell.believed.camera, cell.truth.camera) > 2.0);
  for (std::size_t m = 0; m < cell.truth.markers.size(); ++m) {
    const Vector6 off = pose_difference(r.cell.markers[m].T_target_marker, cell.truth.markers[m].T_target_marker);
    CHECK(off.head<3>().norm() < 1e-4);
  }
  // Where the camera is in the frame of the map: the arm's own parameters alone are not all determined.
  double before = 0, after = 0;
  for (const CellStop& stop : cell.stops) {
    const Pose truth = cell.T_base_target.inverse() * cell.truth.arm.flange(stop.q) * cell.T_flange_camera;
    const Pose believed = r.start.T_fixed_target.inverse() * cell.believed.arm.flange(stop.q) * r.start.T_mount_camera;
    const Pose found = r.T_fixed_target.inverse() * r.cell.arm.flange(stop.q) * r.T_mount_camera;
    before += pose_difference(truth, believed).head<3>().squaredNorm();
    after += pose_difference(truth, found).head<3>().squaredNorm();
  }
  CHECK(after < before / 9);
}

TEST_CASE("every parameter lies where its covariance says") {
  const ArmCell cell = make_arm_cell(12, 40, 1e-3, 3e-4);
  const CellCalibrationResult r = calibrate_cell(cell.stops, cell.believed);
  REQUIRE(r.fit.usable());
  std::map<std::string, double> truth;
  for (int k = 0; k < Pinhole::parameter_count; ++k)
    truth[std::string("camera.") + Pinhole::parameter_names[k]] = cell.truth.camera.parameters()[k];
  for (std::size_t i = 0; i < 6; ++i) {
    const kinematics::DhJoint& joint = cell.truth.arm.joints[i];
    const std::string name = "arm.joint" + std::to_string(i + 1) + ".";
    truth[name + "b"] = joint.b, truth[name + "theta_offset"] = joint.theta_offset, truth[name + "a"] = joint.a;
    truth[name + "alpha"] = joint.alpha, truth[name + "beta"] = joint.beta;
  }
  std::vector<Eigen::Index> index;
  std::vector<double> off;
  for (std::size_t k = 0; k < r.parameters.size(); ++k)
    if (const auto at = truth.find(r.parameters[k].name); at != truth.end()) {
      index.push_back(static_cast<Eigen::Index>(k));
      off.push_back(r.parameters[k].value - at->second);
    }
  REQUIRE(index.size() == 8 + 25);
  const Eigen::VectorXd error = Eigen::Map<const Eigen::VectorXd>(off.data(), static_cast<Eigen::Index>(off.size()));
  const Eigen::MatrixXd C = r.parameter_covariance(index, index);
  const double squared = error.dot(C.ldlt().solve(error)), numbers = static_cast<double>(index.size());
  CHECK(uncertainty::chi_square_cdf(squared, numbers) < 0.9995);
  CHECK(uncertainty::chi_square_cdf(squared, numbers) > 0.0005);
}

TEST_CASE("what is held keeps its value") {
  const ArmCell cell = make_arm_cell(5, 25, 0.0, 0.0);
  CellGeometry believed = cell.believed;
  believed.camera = cell.truth.camera;
  const CellCalibrationResult r = calibrate_cell(cell.stops, believed, {.hold = {"camera", "markers", "arm.joint2.a"}});
  REQUIRE(r.fit.usable());
  CHECK(r.cell.camera.parameters() == believed.camera.parameters());
  CHECK(r.cell.arm.joints[1].a == believed.arm.joints[1].a);
  CHECK(r.cell.arm.joints[2].a != believed.arm.joints[2].a);
  for (const EstimatedParameter& p : r.parameters) CHECK(p.name != "arm.joint2.a");
  CHECK_THROWS_AS(calibrate_cell(cell.stops, believed, {.hold = {"arm.joint9.a"}}), InvalidArgument);
  const CellCalibrationResult still = calibrate_cell(cell.stops, believed, {.hold = {"arm", "markers"}});
  REQUIRE(still.fit.usable());
  CHECK(still.tolerance_length == 0.0);
  for (const EstimatedParameter& p : still.parameters) CHECK_FALSE(p.name.starts_with("arm."));
}

TEST_CASE("with the camera held and the noise given it is the hand-eye calibration") {
  for (const Mount mount : {Mount::EyeInHand, Mount::EyeToHand}) {
    const HandEyeWorld world = test::make_hand_eye_world(
        {.mount = mount, .views = 12, .sigma_robot_position = 0.0005, .sigma_robot_rotation = 0.001, .seed = 77});
    CellCalibrationOptions options{.mount = mount, .hold = {"camera"}};
    options.sigma_pixel = 0.2, options.sigma_robot_position = 0.0005, options.sigma_robot_rotation = 0.001;
    const CellCalibrationResult r =
        calibrate_cell(stops_of(world), {.camera = world.camera, .markers = {}, .arm = {}}, options);
    REQUIRE(r.fit.usable());
    const Vector6 apart = pose_difference(r.start.T_mount_camera, r.T_mount_camera);  // both stop where it is nothing
    CHECK(apart.dot(r.covariance.ldlt().solve(apart)) < 0.01 * 0.01);
    CHECK((r.covariance - r.start.covariance).norm() < 0.02 * r.start.covariance.norm());  // weights of single points
  }
}

TEST_CASE("a scanner shares the arm with the camera and is found beside it") {
  const ArmCell cell = make_arm_cell(41, 35, 1e-3, 0.0);
  test::ScannerWorld world;  // for the place of its tip and its scanner
  Random random(8);
  CellScan scan;
  scan.targets.push_back({.name = "pin", .kind = ScanTargetKind::Tip, .position = {}, .normal = {}});
  while (scan.views.size() < 30) {
    const Eigen::Vector3d at(random.uniform(-0.02, 0.02), 0.0, random.uniform(0.17, 0.21));
    const auto reached =
        kinematics::inverse_kinematics(cell.truth.arm, test::flange_over(world, world.tip, at, 0.4, random)).postures;
    if (reached.empty()) continue;
    ScannerView& view = scan.views.emplace_back();
    view.name = "profile" + std::to_string(scan.views.size()), view.target = "pin";
    view.q = reached.front().q + random.normal_vector(6, 2e-5);
    view.feature.kind = ScanTargetKind::Tip;
    view.feature.points = Eigen::Vector2d(at.x() + random.normal(2e-5), at.z() + random.normal(2e-5));
    view.feature.covariance = 4e-10 * Eigen::MatrixXd::Identity(2, 2);
    view.feature.fit.status = FitStatus::Converged;
  }
  const CellCalibrationResult r = calibrate_cell(cell.stops, cell.believed, {.hold = {"markers"}}, scan);
  CAPTURE(r.fit.message, r.sigma_pixel, r.scanner_start.sigma_position);
  REQUIRE(r.fit.usable());
  const Pose T_camera_scanner = cell.T_flange_camera.inverse() * world.T_flange_scanner;
  const Vector6 on_flange = pose_difference(world.T_flange_scanner, r.T_flange_scanner),
                in_camera = pose_difference(T_camera_scanner, r.T_camera_scanner);
  CHECK(uncertainty::chi_square_cdf(on_flange.dot(r.covariance_scanner.ldlt().solve(on_flange)), 6) < 0.9995);
  CHECK(uncertainty::chi_square_cdf(in_camera.dot(r.covariance_camera_scanner.ldlt().solve(in_camera)), 6) < 0.9995);
  // The last joint moves both: what is not known of it does not part them.
  const double apart = r.covariance.diagonal().head<3>().sum() + r.covariance_scanner.diagonal().head<3>().sum();
  CHECK(r.covariance_camera_scanner.diagonal().head<3>().sum() < apart);
  CHECK(r.sigma_pixel == Approx(0.1).epsilon(0.05));
}

TEST_CASE("a stop that contradicts the others is named and has no part") {
  HandEyeWorld world = test::make_hand_eye_world(
      {.views = 20, .sigma_robot_position = 0.0002, .sigma_robot_rotation = 0.0003, .seed = 21});
  world.views[7].T_base_flange.translation().x() += 0.03;
  const CellCalibrationResult r = calibrate_cell(stops_of(world), {.camera = world.camera, .markers = {}, .arm = {}});
  REQUIRE(r.fit.usable());
  for (std::size_t i = 0; i < r.views.size(); ++i) CHECK(r.views[i].outlier == (i == 7));
  CHECK(r.sigma_robot_position < 0.0004);
}

TEST_CASE("a cell begins at the second pose of its camera, too, and ends at the better one") {
  const auto calibrate = [](int views, std::uint64_t seed, HandEyeWorld& world) {
    world = test::make_hand_eye_world(
        {.views = views, .rows = 4, .cols = 4, .square = 0.003, .sigma_pixel = 1.2, .tilt = 0.3, .seed = seed});
    CellCalibrationOptions options;
    options.hold = {"camera"};
    CellCalibrationResult r = calibrate_cell(stops_of(world), {.camera = world.camera}, options);
    REQUIRE(r.start.second);
    CHECK_FALSE(r.start.fit.usable());
    return r;
  };
  HandEyeWorld world;
  SECTION("usable where both lead to one result") {
    const CellCalibrationResult r = calibrate(6, 18, world);
    REQUIRE(r.fit.usable());
    const Vector6 error = pose_difference(r.T_mount_camera, world.T_mount_camera);
    CHECK(error.dot(r.covariance.ldlt().solve(error)) < uncertainty::chi_square_quantile(0.9999, 6));
  }
  SECTION("with both told where it cannot tell them apart, either") {
    const CellCalibrationResult r = calibrate(5, 117, world);
    CHECK_FALSE(r.fit.usable());
    REQUIRE(r.second);
    const Vector6 error = pose_difference(r.T_mount_camera, world.T_mount_camera);  // hand-eye begins at the wrong one
    CHECK(error.dot(r.covariance.ldlt().solve(error)) < uncertainty::chi_square_quantile(0.9999, 6));
    CHECK(pose_difference(r.start.T_mount_camera, world.T_mount_camera).tail<3>().norm() > 1);
    CHECK(r.second->rotation > 1);
    CHECK_THAT(r.fit.message, Catch::Contains("two poses of the camera"));
  }
}

TEST_CASE("a wrist that turns about one axis is refused, and wrong input is named") {
  const HandEyeWorld still = test::make_hand_eye_world({.views = 10, .axes = 1});
  CHECK_FALSE(calibrate_cell(stops_of(still), {.camera = still.camera, .markers = {}, .arm = {}}).fit.usable());
  ArmCell cell = make_arm_cell(2, 6, 0.0, 0.0);
  std::vector<CellStop> stops = cell.stops;
  stops[3].q.conservativeResize(5);
  CHECK_THROWS_WITH(calibrate_cell(stops, cell.believed), Catch::Contains("stop3") && Catch::Contains("6 finite"));
  stops = cell.stops;
  stops[2].view.view.ids[0] = 4 * 77;
  CHECK_THROWS_WITH(calibrate_cell(stops, cell.believed), Catch::Contains("marker 77"));
  cell.believed.markers[1].id = cell.believed.markers[0].id;
  CHECK_THROWS_WITH(calibrate_cell(cell.stops, cell.believed), Catch::Contains("listed twice"));
}

TEST_CASE("views left out are predicted better by the joint calibration when the camera was off") {
  const ArmCell cell = make_arm_cell(31, 24, 1e-3, 3e-4);
  const std::vector<CellHeldOutView> judged = evaluate_cell(cell.stops, cell.believed, {}, 3);
  REQUIRE(judged.size() == cell.stops.size());
  int better = 0;
  for (const CellHeldOutView& view : judged) better += view.rms_px < view.separate_rms_px;
  CHECK(better > 18);  // of 24, by chance once in a hundred times
  CHECK_THROWS_AS(evaluate_cell(std::span(cell.stops).first(5), cell.believed), InvalidArgument);
}

}  // namespace cell_calibration_test
