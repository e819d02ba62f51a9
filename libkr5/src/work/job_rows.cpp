// SPDX-License-Identifier: BSD-3-Clause
#include "work/job_rows.hpp"

#include <string>

namespace kr5::work {
namespace {

constexpr const char* pose_axes[] = {"x", "y", "z", "rx", "ry", "rz"};
constexpr const char* wrench_axes[] = {"fx", "fy", "fz", "tx", "ty", "tz"};

}  // namespace

JobRows::JobRows(Eigen::Index joints)
    : joints_(joints), columns_{"time", "phase", "pellet", "attempt", "gripped", "hold", "fingers"} {
  for (const char* axis : pose_axes) columns_.push_back(std::string("set_") + axis);
  for (const char* axis : pose_axes) columns_.push_back(std::string("tool_") + axis);
  for (const char* axis : wrench_axes) columns_.emplace_back(axis);
  for (Eigen::Index i = 1; i <= joints; ++i) columns_.push_back("q" + std::to_string(i));
  for (Eigen::Index i = 1; i <= joints; ++i) columns_.push_back("i" + std::to_string(i));
}

void JobRows::add(const robot::RobotReading& reading, const Pose& setpoint, const robot::GripperCommand& gripper,
                  const job::JobState& state, int attempt) {
  Eigen::VectorXd row = Eigen::VectorXd::Zero(std::ssize(columns_));
  row.head<7>() << reading.time, static_cast<double>(state.phase), state.pellet, attempt, reading.status.gripped,
      gripper.hold, gripper.fingers;
  row.segment<6>(7) = to_vector(setpoint);
  row.segment<6>(13) = to_vector(reading.T_base_tool);
  row.segment<6>(19) = reading.wrench;
  row.segment(25, joints_) = reading.joints;
  if (reading.currents.size() == joints_) row.segment(25 + joints_, joints_) = reading.currents;
  rows_.push_back(std::move(row));
}

io::Table JobRows::table() const {
  io::Table out;
  out.columns = columns_;
  out.values.resize(std::ssize(rows_), std::ssize(columns_));
  for (std::size_t k = 0; k < rows_.size(); ++k) out.values.row(static_cast<Eigen::Index>(k)) = rows_[k].transpose();
  return out;
}

job::JobSamples JobRows::samples() const {
  job::JobSamples out;
  const auto n = std::ssize(rows_);
  out.time.resize(n);
  out.position.resize(3, n);
  out.force.resize(3, n);
  for (std::ptrdiff_t k = 0; k < n; ++k) {
    const Eigen::VectorXd& row = rows_[static_cast<std::size_t>(k)];
    out.time[k] = row[0];
    out.position.col(k) = row.segment<3>(7);
    out.force.col(k) = row.segment<3>(19);
    out.pellet.push_back(static_cast<int>(row[2]));
  }
  return out;
}

}  // namespace kr5::work
