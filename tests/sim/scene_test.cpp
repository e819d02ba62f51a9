// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/io/node.hpp>
#include <kr5/io/reader.hpp>
#include <kr5/sim/scene.hpp>

namespace scene_test {

using namespace kr5;

namespace {

const std::filesystem::path scenes = KR5_SHARE_DIR "/scenes";

sim::Scene shipped(const std::string& name) { return sim::load_scene(scenes / (name + ".yaml")); }

std::string complaint(const sim::Scene& scene) {
  try {
    sim::run_scene(scene);
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "";
}

std::filesystem::path written(const std::string& text) {
  const std::filesystem::path file = std::filesystem::temp_directory_path() / "kr5_scene_test.yaml";
  io::write_text(file, text);
  return file;
}

}  // namespace

TEST_CASE("a scene runs, shows its rows and judges what is expected") {
  const sim::Scene scene = shipped("servo_step");
  const sim::SceneResult result = sim::run_scene(scene);
  CHECK(result.passed);
  CHECK(result.checks.size() == scene.expect.size());
  CHECK(result.rows.find("q6") > 0);
  CHECK(result.rows.values.rows() == 51);
  CHECK(result.steps == 51 * 12);
}

TEST_CASE("an expectation that does not come true fails its scene") {
  sim::Scene scene = shipped("servo_step");
  scene.expect[0].max = 0.1;
  const sim::SceneResult result = sim::run_scene(scene);
  CHECK_FALSE(result.passed);
  CHECK_FALSE(result.checks[0].passed);
  CHECK(result.checks[1].passed);
}

TEST_CASE("scenes of earlier versions have other words for minimum and maximum") {
  for (const auto& [word, meant] : {std::pair("least", sim::Statistic::Min),
                                    {"greatest", sim::Statistic::Max},
                                    {"min", sim::Statistic::Min},
                                    {"max", sim::Statistic::Max}}) {
    sim::Expectation found;
    io::Reader reader("x.yaml");
    const std::string text = "{column: z, statistic: " + std::string(word) + ", max: 1}";
    CHECK(reader.read(io::parse_yaml(text, "x.yaml"), "", found));
    CHECK(found.statistic == meant);
  }
}

TEST_CASE("bounds of a scene of an earlier version are read") {
  std::string text = io::read_text(scenes / "servo_step.yaml");
  for (const auto& [present, old] : {std::pair("min: ", "least: "), {"max: ", "most: "}})
    for (std::size_t at = 0; (at = text.find(present, at)) != std::string::npos; at += 1)
      text.replace(at, std::string(present).size(), old);
  const sim::Scene old = sim::load_scene(written(text)), present = shipped("servo_step");
  REQUIRE(old.expect.size() == present.expect.size());
  for (std::size_t i = 0; i < old.expect.size(); ++i) {
    CHECK(old.expect[i].min == present.expect[i].min);
    CHECK(old.expect[i].max == present.expect[i].max);
  }
}

TEST_CASE("statistics are those of their names, over the rows between from and to") {
  sim::Scene scene = shipped("motion_tracking");
  const io::Table rows = sim::run_scene(scene).rows;
  const Eigen::VectorXd q = rows.column("q1"), t = rows.column("t");
  double most = -1e9, sum = 0.0;
  int count = 0;
  for (Eigen::Index k = 0; k < t.size(); ++k)
    if (t[k] >= 1.0 - 1e-9 && t[k] <= 2.0 + 1e-9) most = std::max(most, q[k]), sum += q[k], ++count;
  scene.expect = {{"q1", sim::Statistic::Max, 1.0, 2.0, 0.0, {}}, {"q1", sim::Statistic::Mean, 1.0, 2.0, -9.0, {}}};
  const sim::SceneResult result = sim::run_scene(scene);
  CHECK(result.checks[0].value == most);
  CHECK(result.checks[1].value == Approx(sum / count));
}

TEST_CASE(
    "a start that no arm takes, joints beyond their limits and columns that are not there are named with the file") {
  sim::Scene scene = shipped("press_on_bench");
  scene.start_pose->translation().x() = 5.0;
  CHECK_THAT(complaint(scene),
             Catch::Contains("press_on_bench.yaml: start_pose: the arm cannot reach it (out_of_reach)"));
  scene = shipped("servo_step");
  scene.start[2] = 0.0;
  CHECK_THAT(complaint(scene), Catch::Contains("servo_step.yaml: start[2]: 0.000000 is beyond robot.limits"));
  scene = shipped("servo_step");
  scene.controller.target.conservativeResize(5);
  CHECK_THAT(complaint(scene), Catch::Contains("controller.target: found 5 values"));
  scene = shipped("servo_step");
  scene.expect[0].column = "q7";
  CHECK_THAT(complaint(scene), Catch::Contains("expect[0].column: this scene has no column 'q7'; it has t, q1"));
  scene = shipped("servo_step");
  scene.expect.clear();
  CHECK_THAT(complaint(scene), Catch::Contains("expect: expected at least one expectation"));
  scene = shipped("peg_roll");
  scene.step = 0.01;
  CHECK_THAT(complaint(scene), Catch::Contains("step: the stable bound of this contact is"));
  scene = shipped("stall_at_current_limit");
  scene.controller.current_limit.resize(0);
  CHECK_THAT(complaint(scene), Catch::Contains("controller.current_limit"));
}

TEST_CASE("a peg pushed sideways in its bore stops at the wall, which pushes back") {
  sim::Scene scene = shipped("peg_insertion");
  scene.expect = {{"z", sim::Statistic::Last, 0.0, {}, -1.0, {}}};
  scene.controller.height = -0.02;
  scene.controller.offset.setZero();
  scene.duration = 0.5;
  const double clearance = 9.7e-3 - 9.42e-3, force = scene.controller.force;
  const double aside = force * std::sin(1.5 * M_PI / 180);  // the contact is found to 1.5 degrees
  const double give = force / 23380.0;                      // of the arm, as it reads its place
  for (const double angle : {0.0, 1.0, 2.5, 4.0}) {
    scene.controller.direction = 3.0 * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
    const io::Table rows = sim::run_scene(scene).rows;
    const Eigen::Index last = rows.values.rows() - 1;
    CHECK(rows.column("x")[last] == Approx((clearance + give) * std::cos(angle)).margin(5e-6));
    CHECK(rows.column("y")[last] == Approx((clearance + give) * std::sin(angle)).margin(5e-6));
    CHECK(rows.column("z")[last] == -0.02);
    CHECK(rows.column("fx")[last] == Approx(-force * std::cos(angle)).margin(aside));  // S is X, -Y, -Z of B
    CHECK(rows.column("fy")[last] == Approx(force * std::sin(angle)).margin(aside));
  }
  scene.controller.direction.setZero();
  CHECK_THAT(complaint(scene), Catch::Contains("controller.direction: must not be zero"));
}

TEST_CASE("contact by ODE's mesh carries a rolling peg as the closed form does") {
  sim::Scene scene = shipped("peg_roll");
  scene.duration = 1.0;
  const io::Table closed = sim::run_scene(scene).rows;
  scene.contact = sim::ContactBy::Mesh;
  const sim::SceneResult mesh = sim::run_scene(scene);
  CHECK(mesh.passed);
  const Eigen::VectorXd off = (mesh.rows.column("z") - closed.column("z")).tail(closed.values.rows() / 2);
  CHECK(off.cwiseAbs().mean() < 1e-5);
  CHECK(off.cwiseAbs().maxCoeff() > 1e-9);  // it is another contact
}

TEST_CASE("a scene file that is wrong is refused with line and field") {
  const auto refused = [](const std::string& text) -> std::string {
    try {
      sim::run_scene(written(text));
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  const std::string head = "format: kr5-scene/1\ncell: nowhere.yaml\nduration: 1.0\n";
  CHECK_THAT(refused(head + "controller: {kind: fly}\nexpect:\n- {column: q1, most: 1}\n"),
             Catch::Contains(":4: controller.kind: found 'fly', expected one of off | servo | limited | push"));
  CHECK_THAT(refused(head + "controller: {kind: servo}\nexpect:\n- {colum: q1, most: 1}\n"),
             Catch::Contains("expect[0].colum") && Catch::Contains("column"));
  CHECK_THAT(refused(head + "controller: {kind: servo}\nexpect:\n- {column: q1, most: 1}\n"),
             Catch::Contains("nowhere.yaml"));
  CHECK_THAT(refused("format: kr5-scene/1\n"), Catch::Contains("duration"));
}

namespace {

/// The arm before its board, at rest.
sim::Scene picture_scene() {
  sim::Scene scene = shipped("camera_views");
  scene.controller.way_points.resize(1);
  scene.duration = 1.7;
  scene.expect = {{"q1", sim::Statistic::Last, 0.0, {}, -9.0, {}}};
  return scene;
}

}  // namespace

TEST_CASE("every way point has its picture, the last of them at the end of the scene") {
  const sim::Scene scene = shipped("camera_views");
  CHECK(sim::run_scene(scene).pictures.size() == scene.controller.way_points.size());
}

TEST_CASE("a scene takes its pictures at rest, from where the arm really is") {
  sim::Scene scene = picture_scene();
  const sim::SceneResult nominal = sim::run_scene(scene);
  REQUIRE(nominal.pictures.size() == 1);
  const sim::ScenePicture& picture = nominal.pictures[0];
  CHECK(picture.t == Approx(1.6).margin(0.012));
  const Pose wanted = *scene.controller.way_points[0].T_base_camera;
  CHECK((picture.scene.T_base_camera.matrix() - wanted.matrix()).cwiseAbs().maxCoeff() <
        1e-3);  // what the servo is still off
  const Pose by_readings = cell::nominal_chain(nominal.cell).flange(picture.q);
  CHECK((picture.T_base_flange.matrix() - by_readings.matrix()).cwiseAbs().maxCoeff() < 1e-12);

  scene.effects.emplace();
  scene.effects->set("joint_elasticity", "joint2", "stiffness", 2e5);
  scene.effects->set("camera_focal", "camera", "fx", 2300.0);
  const sim::SceneResult soft = sim::run_scene(scene);
  const double sag = (soft.pictures[0].T_base_flange.translation() -
                      cell::nominal_chain(soft.cell).flange(soft.pictures[0].q).translation())
                         .norm();
  CHECK(sag > 1e-4);
  CHECK(soft.pictures[0].scene.lens.fx == 2300.0);
}

TEST_CASE("profiles of a scene have the columns of the kind scan, and lag shows with the speed of the scanner alone") {
  sim::Scene scene = shipped("scan_tube");
  const sim::SceneResult plain = sim::run_scene(scene);
  CHECK(plain.passed);
  CHECK(plain.profiles.columns ==
        std::vector<std::string>{"line", "t", "speed", "q1", "q2", "q3", "q4", "q5", "q6", "x", "z", "sphere"});
  const Eigen::VectorXd speed = plain.profiles.column("speed");
  CHECK(speed.maxCoeff() > 0.1);
  CHECK(speed.maxCoeff() < 0.2);  // 0.15 m in 2 s, at most 1.875 times the mean
  scene.scanner->noise = false;
  scene.effects.emplace();
  const auto z = [&](double lag) {
    scene.effects->set("laser_lag", "laser", "lag", lag);
    return sim::run_scene(scene).rows.column("range");
  };
  const Eigen::VectorXd at_once = z(0.0), late = z(0.036);
  // A lag of three cycles shows what was there three rows before, as far as the speed is constant.
  double apart = 0.0, shifted = 0.0;
  for (Eigen::Index k = 0; k < at_once.size(); ++k) {
    const double t = 0.012 * static_cast<double>(k);
    if (t < 3.9 || t > 4.2) continue;  // over the ball
    apart = std::max(apart, std::abs(late[k] - at_once[k]));
    shifted = std::max(shifted, std::abs(late[k] - at_once[k - 3]));
  }
  CHECK(apart > 1e-3);
  CHECK(shifted < 0.3 * apart);
}

TEST_CASE("pictures and profiles on which there is nothing are refused by file and field") {
  sim::Scene scene = picture_scene();
  scene.controller.way_points[0].T_base_camera->translation().x() = 4.0;
  CHECK_THAT(complaint(scene),
             Catch::Contains("camera_views.yaml: controller.way_points[0].T_B_C: the arm cannot reach it"));
  scene = picture_scene();
  scene.camera->at = Eigen::VectorXd::Constant(1, 5.0);
  CHECK_THAT(complaint(scene), Catch::Contains("camera.at: must lie within the duration"));
  scene = picture_scene();
  scene.controller.way_points.clear();
  CHECK_THAT(complaint(scene), Catch::Contains("camera.at: expected times"));
  scene = shipped("scan_tube");
  scene.scanner->near = 0.4, scene.scanner->far = 0.6;
  CHECK_THAT(complaint(scene), Catch::Contains("scan_tube.yaml: scanner: of") &&
                                   Catch::Contains("from scanner.near to scanner.far, 40 cm to 60 cm") &&
                                   Catch::Contains("the nearest object is"));
  scene.scanner->far = 0.1;
  CHECK_THAT(complaint(scene), Catch::Contains("scan_tube.yaml: scanner.far: must be more than near"));
  scene = shipped("scan_tube");
  scene.objects.solids[0].depth = 0.0;
  CHECK_THAT(complaint(scene), Catch::Contains("objects.solids[0].depth: must be positive"));
  scene = shipped("peg_roll");
  scene.scanner.emplace();
  CHECK_THAT(complaint(scene), Catch::Contains("scanner: not supported by a push"));
}

TEST_CASE("a picture whose board lies behind the camera, or shows its back, says so") {
  // Looking up from the table, the board is behind; from below it, its back is seen.
  sim::Scene scene = picture_scene();
  cell::Cell cell = cell::load_cell(scene.file.parent_path() / scene.cell);
  cell.laser.reset(), cell.tube.reset();
  const auto file = std::filesystem::temp_directory_path() / "kr5_scene_test_cell.yaml";
  cell.board->T_base_target.translation().z() = 1.5;
  cell::save_cell(cell, file);
  scene.cell = file.string();
  CHECK_THAT(complaint(scene),
             Catch::Contains("camera.at[0]: at 1.596 s nothing is in the picture") && Catch::Contains("only the back"));
  cell.board->T_base_target =
      cell.board->T_base_target * Eigen::AngleAxisd(3.141592653589793, Eigen::Vector3d::UnitX());
  cell::save_cell(cell, file);
  CHECK_THAT(complaint(scene), Catch::Contains("'board' lies behind the camera"));
}

}  // namespace scene_test
