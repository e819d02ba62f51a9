// SPDX-License-Identifier: BSD-3-Clause
#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/io/node.hpp>
#include <kr5/sim/scene.hpp>

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
  scene.expect[0].most = 0.1;
  const sim::SceneResult result = sim::run_scene(scene);
  CHECK_FALSE(result.passed);
  CHECK_FALSE(result.checks[0].passed);
  CHECK(result.checks[1].passed);
}

TEST_CASE("statistics are those of their names, over the rows between from and to") {
  sim::Scene scene = shipped("motion_tracking");
  const io::Table rows = sim::run_scene(scene).rows;
  const Eigen::VectorXd q = rows.column("q1"), t = rows.column("t");
  double most = -1e9, sum = 0.0;
  int count = 0;
  for (Eigen::Index k = 0; k < t.size(); ++k)
    if (t[k] >= 1.0 - 1e-9 && t[k] <= 2.0 + 1e-9) most = std::max(most, q[k]), sum += q[k], ++count;
  scene.expect = {{"q1", sim::Statistic::Greatest, 1.0, 2.0, 0.0, {}},
                  {"q1", sim::Statistic::Mean, 1.0, 2.0, -9.0, {}}};
  const sim::SceneResult result = sim::run_scene(scene);
  CHECK(result.checks[0].value == most);
  CHECK(result.checks[1].value == Approx(sum / count));
}

TEST_CASE(
    "a start that no arm takes, joints beyond their limits and columns that are not there are named with the file") {
  sim::Scene scene = shipped("press_on_bench");
  scene.start_pose->translation().x() = 5.0;
  CHECK_THAT(complaint(scene),
             Catch::Contains("press_on_bench.yaml: start_pose: the arm cannot take it (out_of_reach)"));
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
  CHECK_THAT(complaint(scene), Catch::Contains("expect: a scene that expects nothing"));
  scene = shipped("peg_roll");
  scene.step = 0.01;
  CHECK_THAT(complaint(scene), Catch::Contains("step: the stable bound of this contact is"));
  scene = shipped("stall_at_current_limit");
  scene.controller.current_limit.resize(0);
  CHECK_THAT(complaint(scene), Catch::Contains("controller.current_limit"));
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
