// SPDX-License-Identifier: BSD-3-Clause
#include "scene_push.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <kr5/core/error.hpp>

#include "peg_slide.hpp"
#include "scene_rows.hpp"

namespace kr5::sim {

void run_push_scene(const Scene& scene, const cell::Cell& cell, SceneResult& out) {
  const Controller& c = scene.controller;
  require(cell.tool && cell.contact && cell.peg && cell.tube, "cell: a push needs tool, contact, peg and tube");
  require(c.force > 0.0 && c.speed > 0.0, "controller: force and speed of a push must be positive");
  require(scene.events.empty(), "events: are not supported by a push");
  require(!scene.camera && !scene.scanner, std::string(scene.camera ? "camera" : "scanner") +
                                               ": not supported by a push, which moves the tool without an arm");
  require(c.direction.norm() > 0.0, "controller.direction: must not be zero");
  const Eigen::Vector3d axis = -c.direction.normalized();
  PegSlide peg(cell, PegSlide::FrictionBy::Contact, scene.contact, axis);
  require(scene.step <= peg.longest_step(),
          "step: the stable bound of this contact is " + std::to_string(1e3 * peg.longest_step()) + " ms");
  const double cycle = scene_cycle(scene, cell);
  const double wanted = scene.step > 0.0 ? scene.step : peg.longest_step();
  const auto count = static_cast<int>(std::ceil(cycle / wanted - 1e-6));
  const double step = cycle / count;
  // Below the held force the push is a damper against the wanted speed, which the step must resolve.
  const double damper = std::min(10.0 * c.force / c.speed, 0.3 * peg.mass() / step);
  peg.place(0.0, 0.0);
  RowTable rows({"t", "z", "fx", "fy", "fz", "tx", "ty", "tz", "depth", "push", "x", "y", "tilt", "alpha"});
  PegPosture at{c.tilt, 0.0, c.offset.x(), c.offset.y(), c.force, c.height};
  double push = 0.0;
  for (double t = 0.0; t < scene.duration + 1e-9; t += cycle) {
    for (int i = 1; i <= count; ++i, ++out.steps) {
      at.alpha = 2.0 * std::numbers::pi * c.turns * (t + i * step) / scene.duration;
      push = std::clamp(damper * (c.speed + peg.speed()), -c.force, c.force);
      peg.advance(at, push, step);
    }
    const Vector6 w = peg.wrench();
    const Eigen::Vector3d bottom = Eigen::Vector3d(at.cx, at.cy, at.cz) + peg.reading(std::max(push, 0.0)) * axis;
    rows.add({t + cycle, bottom.z(), w[0], w[1], w[2], w[3], w[4], w[5], peg.depth(), push, bottom.x(), bottom.y(),
              at.tilt, at.alpha});
  }
  out.rows = rows.table();
}

}  // namespace kr5::sim
