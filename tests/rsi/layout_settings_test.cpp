// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/layout_settings.hpp>

#include <algorithm>
#include <filesystem>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/io/node.hpp>

using namespace kr5;
using namespace kr5::rsi;

namespace layout_settings_test {

LayoutSettings read(const std::string& text) {
  const std::filesystem::path file = std::filesystem::temp_directory_path() / "kr5_layout_settings_test.yaml";
  io::write_text(file, text);
  return load_layout_settings(file);
}

TEST_CASE("settings beside a configuration say what it does not hold") {
  TelegramLayout layout = usual_layout(Controller::Krc4);
  layout.send.push_back({.tag = "Force.Fx", .index = 20});
  const LayoutSettings settings = read(
      "format: kr5-rsi-settings/1\n"
      "axes: {sign: [1, 1, -1, 1, 1, 1], zero: [0, 0.5, 0, 0, 0, 0]}\n"
      "current_units: [0.5, 0.5, 0.5, 0.2, 0.2, 0.2]\n"
      "gripper: {hold: 3}\n"
      "meanings: {Force: sensor_wrench}\n");
  const TelegramLayout got = with_settings(layout, settings);
  REQUIRE(got.axes);
  CHECK((got.axes->sign[2] == -1 && got.axes->zero[1] == 0.5));
  CHECK((got.current_units.size() == 6 && got.current_units[3] == 0.2));
  CHECK(got.gripper.hold == 3);
  CHECK(got.send.back().meaning == Meaning::SensorWrench);
  const TelegramLayout same = with_settings(layout, {});
  CHECK((!same.axes && same.current_units.empty() && same.send.size() == layout.send.size()));
}

TEST_CASE("wrong settings are refused by their field") {
  const TelegramLayout layout = usual_layout(Controller::Krc4);
  LayoutSettings settings;
  settings.meanings["Nothing"] = Meaning::Override;
  CHECK_THROWS_WITH(with_settings(layout, settings), Catch::Contains("meanings.Nothing: the layout has no such"));
  settings = {};
  settings.axes.emplace();
  settings.axes->sign = Eigen::VectorXd::Ones(3);
  settings.axes->zero = Eigen::VectorXd::Zero(3);
  CHECK_THROWS_AS(with_settings(layout, settings), InvalidArgument);
  CHECK_THROWS_WITH(read("format: kr5-rsi-settings/2\n"), Catch::Contains("expected kr5-rsi-settings/1"));
  CHECK_THROWS_WITH(read("format: kr5-rsi-settings/1\naxis: {}\n"), Catch::Contains("axis"));
}

}  // namespace layout_settings_test
