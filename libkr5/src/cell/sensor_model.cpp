// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/sensor_model.hpp>

namespace kr5::cell {

robot::SensorModel sensor_model(const Cell& cell) {
  robot::SensorModel out;
  out.arm = nominal_chain(cell);
  out.gravity = cell.robot.gravity;
  if (!cell.tool) return out;
  out.T_flange_tool = cell.tool->T_flange_tool;
  out.T_flange_sensor = cell.tool->T_flange_sensor;
  out.mass = cell.tool->mass;
  out.com = cell.tool->com;
  return out;
}

}  // namespace kr5::cell
