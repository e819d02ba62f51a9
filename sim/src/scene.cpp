// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/scene.hpp>

#include <algorithm>
#include <cmath>

#include <kr5/core/error.hpp>
#include <kr5/io/fields.hpp>
#include <kr5/predict/cell_objects.hpp>

#include "scene_arm.hpp"
#include "scene_push.hpp"

namespace kr5::sim {
namespace {

double compute_statistic(const Eigen::VectorXd& values, Statistic statistic) {
  using enum Statistic;
  switch (statistic) {
    case Last:
      return values[values.size() - 1];
    case Mean:
      return values.mean();
    case Min:
      return values.minCoeff();
    case Max:
      return values.maxCoeff();
    case Range:
      return values.maxCoeff() - values.minCoeff();
    case Rms:
      return std::sqrt(values.squaredNorm() / static_cast<double>(values.size()));
  }
  return NAN;
}

SceneCheck check_expectation(const Expectation& e, const io::Table& rows, const std::string& field) {
  const int column = rows.find(e.column);
  if (column < 0) {
    std::string known;
    for (const std::string& name : rows.columns) known += (known.empty() ? "" : ", ") + name;
    throw InvalidArgument(field + ".column: this scene has no column '" + e.column + "'; it has " + known);
  }
  constexpr double rounding = 1e-9;
  std::vector<double> chosen;
  for (Eigen::Index k = 0; k < rows.values.rows(); ++k) {
    const double t = rows.values(k, 0);
    if (t < e.begin - rounding || (e.end && t > *e.end + rounding)) continue;
    if (!std::isnan(rows.values(k, column))) chosen.push_back(rows.values(k, column));
  }
  require(!chosen.empty(), field + ": no rows between begin and end");
  const auto values = Eigen::Map<Eigen::VectorXd>(chosen.data(), static_cast<Eigen::Index>(chosen.size()));
  SceneCheck out{e, compute_statistic(values, e.statistic), false};
  out.passed = (!e.min || out.value >= *e.min) && (!e.max || out.value <= *e.max);
  return out;
}

constexpr double longest_scene = 3600.0;  // [s], of which every controller cycle is a row that is kept
constexpr double shortest_cycle = 1e-4;   // [s]

cell::Cell load_scene_cell(const Scene& scene) {
  cell::Cell cell = cell::load_cell(scene.file.parent_path() / scene.cell);
  if (scene.effects) cell.effects = *scene.effects;
  if (scene.frictionless && cell.drives) {
    cell.drives->friction.coulomb.setZero();
    cell.drives->friction.viscous.setZero();
  }
  return cell;
}

void check_scene(const Scene& scene) {
  require(scene.format == "kr5-scene/1", "format: found '" + scene.format + "', expected kr5-scene/1");
  require(scene.duration > 0.0 && scene.duration <= longest_scene,
          "duration: must be positive, and at most " + std::to_string(static_cast<int>(longest_scene)) + " s");
  require(scene.cycle >= shortest_cycle && scene.cycle <= longest_scene, "cycle: must be 0.0001 s or more");
  require(!scene.expect.empty(), "expect: expected at least one expectation");
  for (std::size_t i = 0; i < scene.expect.size(); ++i)
    require(scene.expect[i].min || scene.expect[i].max, "expect[" + std::to_string(i) + "]: 'min' or 'max' is needed");
  require(std::is_sorted(scene.events.begin(), scene.events.end(),
                         [](const SceneEvent& a, const SceneEvent& b) { return a.at < b.at; }),
          "events: must be in order of time");
}

SceneResult run_checked_scene(const Scene& scene) {
  check_scene(scene);
  SceneResult out;
  out.cell = load_scene_cell(scene);
  out.camera = scene.camera;
  out.solids = scene.objects.solids;
  if (scene.objects.bench) out.solids.push_back(predict::wide_plate("bench", *scene.objects.bench));
  out.passed = true;
  out.cell.validate();
  const cell::Cell cell = out.cell;
  scene.controller.kind == ControllerKind::Push ? run_push_scene(scene, cell, out) : run_arm_scene(scene, cell, out);
  for (std::size_t i = 0; i < scene.expect.size(); ++i) {
    out.checks.push_back(check_expectation(scene.expect[i], out.rows, "expect[" + std::to_string(i) + "]"));
    out.passed &= out.checks.back().passed;
  }
  return out;
}

/// Bounds of expectations under their present keys: before version 0.3 they were `least` and `most`.
io::Node with_present_bounds(io::Node node) {
  for (auto& [key, list] : node.entries) {
    if (key != "expect") continue;
    for (io::Node& expectation : list.items)
      for (auto& [bound, value] : expectation.entries)
        bound = bound == "least" ? "min" : bound == "most" ? "max" : bound;
  }
  return node;
}

}  // namespace

double scene_cycle(const Scene& scene, const cell::Cell& cell) {
  return cell.servo && cell.servo->cycle > 0.0 ? cell.servo->cycle : scene.cycle;
}

Scene load_scene(const std::filesystem::path& file) {
  Scene scene;
  io::Reader reader(file.string());
  reader.read(with_present_bounds(io::load_yaml(file)), "", scene);
  reader.finish();
  scene.file = file;
  return scene;
}

SceneResult run_scene(const Scene& scene) {
  try {
    return run_checked_scene(scene);
  } catch (const InvalidArgument& e) {
    throw InvalidArgument((scene.file.empty() ? std::string("scene") : scene.file.string()) + ": " + e.what());
  }
}

SceneResult run_scene(const std::filesystem::path& file) { return run_scene(load_scene(file)); }

}  // namespace kr5::sim
