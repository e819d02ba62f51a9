// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/joint_reading.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <string>

#include <Eigen/Geometry>

#include <kr5/core/error.hpp>
#include <kr5/predict/fast_simulator.hpp>

#include "joint_columns.hpp"

namespace kr5::arm_log {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double alike_together = 0.9;  // correlation of all loads with the simulation, from which a reading fits
constexpr double clear_reading = 1.5;   // logarithm by which a reading must lessen what all joints leave
constexpr double min_shift = 0.1;  // of the centre of what a joint carries by another zero; less may be an error [m]
constexpr std::array<double, 4> right_angles = {0.0, std::numbers::pi / 2, std::numbers::pi, -std::numbers::pi / 2};
constexpr std::array<double, 6> plain_offsets = {0.2, 0.4, 0.6, 0.8, 1.0, 1.2};  // of either sign [rad]

bool turns(const cell::Cell& cell, std::size_t joint) {
  return cell.robot.dh[joint].type == kinematics::JointType::Revolute;
}

JointReading plain_reading(int joints) {
  const auto n = static_cast<std::size_t>(joints);
  JointReading out{std::vector<int>(n), std::vector<int>(n, 1), std::vector<double>(n, 0.0)};
  std::iota(out.order.begin(), out.order.end(), 0);
  return out;
}

/// How loads are like their simulation.
struct Likeness {
  double together = 0.0;                  // correlation of all
  double mean = 0.0;                      // of those of the joints
  std::vector<double> left = {};          // root mean square of each joint; empty: it cannot be simulated
  std::vector<double> left_negated = {};  // with the loads of the other sign
};

double correlation_about_zero(const MatrixXd& a, const MatrixXd& b) {
  return a.cwiseProduct(b).sum() / std::max(a.norm() * b.norm(), 1e-300);
}

std::vector<double> root_mean_squares(const MatrixXd& x) {
  std::vector<double> out;
  for (Index k = 0; k < x.cols(); ++k)
    out.push_back(
        std::max(x.col(k).norm() / std::sqrt(static_cast<double>(x.rows())), std::numeric_limits<double>::min()));
  return out;
}

/// The likeness of the loads of one motion in different readings.
class ReadingTrials {
 public:
  ReadingTrials(const cell::Cell& cell, const cell::Experiment& experiment)
      : cell_(cell), experiment_(experiment), family_(load_family(experiment)) {
    const int n = cell.robot.joints();
    q_ = joint_columns(experiment, "qc", n);
    loads_ = joint_columns(experiment, family_, n);
  }

  const MatrixXd& q() const { return q_; }

  Likeness of(const JointReading& reading) const {
    cell::Experiment moved = experiment_;
    const auto n = static_cast<Index>(reading.order.size());
    MatrixXd got(loads_.rows(), n);
    for (Index column = 0; column < n; ++column) {
      const auto joint = static_cast<std::size_t>(reading.order[static_cast<std::size_t>(column)]);
      const std::string number = std::to_string(joint + 1);
      moved.data.values.col(moved.data.find("qc" + number)) =
          (reading.sign[joint] * q_.col(column).array() + reading.zero[joint]).matrix();
      got.col(static_cast<Index>(joint)) = reading.sign[joint] * loads_.col(column);
    }
    cell::Experiment shown = moved;
    try {
      shown.data = simulator_.predict(cell_, moved);
    } catch (const InvalidArgument&) {
      return {};
    }
    const MatrixXd model = joint_columns(shown, family_, static_cast<int>(n));
    Likeness out{correlation_about_zero(got, model), 0.0, root_mean_squares(got - model),
                 root_mean_squares(got + model)};
    for (Index k = 0; k < n; ++k) out.mean += correlation_about_zero(got.col(k), model.col(k)) / static_cast<double>(n);
    return out;
  }

 private:
  const cell::Cell& cell_;
  const cell::Experiment& experiment_;
  std::string family_;
  MatrixXd q_, loads_;
  predict::FastSimulator simulator_;
};

/// Logarithm by which a reading lessens what the joints leave, all of them together.
double gain(const std::vector<double>& before, const std::vector<double>& after) {
  if (before.empty() || after.empty()) return -std::numeric_limits<double>::infinity();
  double out = 0.0;
  for (std::size_t k = 0; k < before.size(); ++k) out += std::log(before[k] / after[k]);
  return out;
}

std::vector<std::vector<int>> likely_orders(const cell::Cell& cell) {
  const std::vector<int> plain = plain_reading(cell.robot.joints()).order;
  std::vector<std::vector<int>> out;
  for (std::size_t a = 0; a < plain.size(); ++a)
    for (std::size_t b = a + 1; b < plain.size(); ++b) {
      out.push_back(plain);
      std::swap(out.back()[a], out.back()[b]);
    }
  out.emplace_back(plain.rbegin(), plain.rend());
  if (const auto& names = cell.robot.joint_names; !names.empty()) {
    out.push_back(plain);
    std::sort(out.back().begin(), out.back().end(),
              [&](int a, int b) { return names[static_cast<std::size_t>(a)] < names[static_cast<std::size_t>(b)]; });
  }
  return out;
}

/// One joint counted another way: the other direction, another zero, or both.
std::vector<JointReading> other_conventions(const cell::Cell& cell, const JointReading& reading) {
  std::vector<JointReading> out;
  for (std::size_t joint = 0; joint < reading.order.size(); ++joint)
    for (const int sign : {1, -1})
      for (const double zero : right_angles) {
        if (zero != 0.0 && !turns(cell, joint)) continue;
        JointReading other = reading;
        other.sign[joint] = sign;
        other.zero[joint] = zero;
        if (other != reading) out.push_back(other);
      }
  return out;
}

/// One revolute joint read with an offset that is no right angle.
std::vector<JointReading> other_offsets(const cell::Cell& cell) {
  std::vector<JointReading> out;
  for (std::size_t joint = 0; joint < cell.robot.dh.size(); ++joint)
    for (const double size : plain_offsets)
      for (const double sign : {1.0, -1.0}) {
        if (!turns(cell, joint)) continue;
        out.push_back(plain_reading(cell.robot.joints()));
        out.back().zero[joint] = sign * size;
      }
  return out;
}

/// The least by which one of the zeros of a reading moves the centre of what its joint carries [m].
double smallest_shift(const JointReading& reading, const VectorXd& arms) {
  double out = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < reading.zero.size(); ++k)
    if (reading.zero[k] != 0.0)
      out = std::min(out, 2 * std::sin(std::abs(reading.zero[k]) / 2) * arms[static_cast<Index>(k)]);
  return out;
}

/// The middle of each column, of an even number between both.
VectorXd middle_posture(const MatrixXd& q) {
  VectorXd out(q.cols());
  for (Index j = 0; j < q.cols(); ++j) {
    std::vector<double> x(q.col(j).begin(), q.col(j).end());
    std::sort(x.begin(), x.end());
    out[j] = 0.5 * (x[(x.size() - 1) / 2] + x[x.size() / 2]);
  }
  return out;
}

bool measured_loads(const cell::Experiment& experiment) {
  return experiment.joint_reference == cell::JointReference::Measured && !load_family(experiment).empty() &&
         experiment.data.values.rows() > 0;
}

}  // namespace

double load_likeness(const cell::Cell& cell, const cell::Experiment& experiment) {
  if (!measured_loads(experiment)) return 1.0;
  return ReadingTrials(cell, experiment).of(plain_reading(cell.robot.joints())).mean;
}

std::optional<std::vector<int>> fitting_order(const cell::Cell& cell, const cell::Experiment& experiment) {
  if (!measured_loads(experiment)) return std::nullopt;
  const ReadingTrials readings(cell, experiment);
  const JointReading plain = plain_reading(cell.robot.joints());
  const double own = readings.of(plain).mean;
  if (own + better_likeness >= 1) return std::nullopt;
  Likeness best;
  best.mean = -2.0;
  std::vector<int> found;
  for (const std::vector<int>& order : likely_orders(cell)) {
    JointReading other = plain;
    other.order = order;
    const Likeness likeness = readings.of(other);
    if (likeness.mean <= best.mean) continue;
    best = likeness;
    found = order;
  }
  if (!(best.together > alike_together && best.mean > own + better_likeness)) return std::nullopt;
  return found;
}

std::optional<JointReading> fitting_convention(const cell::Cell& cell, const cell::Experiment& experiment) {
  if (!measured_loads(experiment)) return std::nullopt;
  const ReadingTrials readings(cell, experiment);
  JointReading reading = plain_reading(cell.robot.joints());
  const Likeness own = readings.of(reading);
  if (own.left.empty() || own.mean + better_likeness >= 1) return std::nullopt;
  const VectorXd arms = lever_arms(cell, middle_posture(readings.q()));
  Likeness best = own;
  for (int k = 0; k < cell.robot.joints(); ++k) {
    Likeness nearest;
    JointReading next;
    double most = -std::numeric_limits<double>::infinity();
    for (const JointReading& other : other_conventions(cell, reading)) {
      const Likeness likeness = readings.of(other);
      const double won = gain(best.left, likeness.left);
      if (won <= most) continue;
      most = won, nearest = likeness, next = other;
    }
    if (!(most >= clear_reading) || smallest_shift(next, arms) < min_shift) break;
    best = nearest, reading = next;
  }
  // All loads of the other sign are another mistake, which leaves as little.
  const bool clear = std::min(gain(own.left, best.left), gain(own.left_negated, best.left)) > clear_reading;
  if (!clear || best.together <= alike_together) return std::nullopt;
  // An offset of one joint, which is no convention, may do better.
  for (const JointReading& rival : other_offsets(cell))
    if (!(gain(readings.of(rival).left, best.left) > 0)) return std::nullopt;
  return reading;
}

VectorXd lever_arms(const cell::Cell& cell, const VectorXd& q) {
  const kinematics::DhChain chain = cell::nominal_chain(cell);
  const std::vector<Pose> links = chain.link_poses(q);
  std::vector<std::pair<double, Eigen::Vector3d>> bodies;  // mass and centre in the base
  for (std::size_t k = 0; k < cell.robot.links.size(); ++k)
    bodies.emplace_back(cell.robot.links[k].mass, links[k] * cell.robot.links[k].com);
  if (cell.tool) bodies.emplace_back(cell.tool->mass, chain.flange(q) * cell.tool->T_flange_sensor * cell.tool->com);
  VectorXd out(q.size());
  for (std::size_t joint = 0; joint < links.size(); ++joint) {
    const Pose& before = joint == 0 ? chain.T_base_0 : links[joint - 1];
    double mass = 0.0;
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    for (std::size_t k = joint; k < bodies.size(); ++k)
      mass += bodies[k].first, moment += bodies[k].first * bodies[k].second;
    const Eigen::Vector3d centre = mass > 0 ? Eigen::Vector3d(moment / mass) : before.translation();
    out[static_cast<Index>(joint)] = before.rotation().col(2).cross(centre - before.translation()).norm();
  }
  return out;
}

}  // namespace kr5::arm_log
