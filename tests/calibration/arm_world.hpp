#pragma once

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include <kr5/calibration/kinematics.hpp>
#include <kr5/cell/cell.hpp>
#include <kr5/core/random.hpp>

/// @file
/// A true arm about a nominal one, and what a measuring device sees of it.

namespace kr5::test {

using namespace calibration;

inline kinematics::DhChain nominal_arm() {
  return cell::nominal_chain(cell::load_cell(std::string(KR5_SHARE_DIR) + "/cells/kr5_arc.yaml"));
}

struct ArmWorldOptions {
  unsigned seed = 1;
  int postures = 60;
  double length = 1e-3, angle = 2e-3, joint = 0.0;  // spread of the true arm about the nominal one
  double sigma = 5e-5, sigma_rotation = 1e-4;
  bool poses = false;  // else one point a posture
};

/// The true arm and what a device sees of it.
struct ArmWorld {
  kinematics::DhChain nominal, arm;
  Eigen::MatrixXd joint_errors;
  Pose T_world_base = Pose::Identity(), T_flange_tool = Pose::Identity();
  Eigen::Vector3d tip;
  std::vector<ArmPosture> postures;

  Pose flange(const Eigen::VectorXd& q) const {
    Eigen::VectorXd there = q;
    for (Eigen::Index i = 0; i < q.size(); ++i)
      there[i] += joint_errors.row(i).dot(
          Eigen::RowVector4d(std::sin(q[i]), std::cos(q[i]) - 1, std::sin(2 * q[i]), std::cos(2 * q[i]) - 1));
    return arm.flange(there);
  }
};

inline Eigen::VectorXd random_posture(Random& random) {
  Eigen::VectorXd q(6);
  const double range[] = {2.0, 0.8, 1.0, 2.5, 1.8, 3.0};
  for (int i = 0; i < 6; ++i) q[i] = random.uniform(-range[i], range[i]);
  return q;
}

inline ArmWorld make_arm_world(const ArmWorldOptions& o) {
  Random random(o.seed);
  ArmWorld w;
  w.nominal = w.arm = nominal_arm();
  for (std::size_t i = 0; i < w.arm.joints.size(); ++i) {
    auto& joint = w.arm.joints[i];
    joint.b += random.normal(o.length), joint.a += random.normal(o.length);
    joint.theta_offset += random.normal(o.angle), joint.alpha += random.normal(o.angle);
    if (std::abs(std::sin(joint.alpha)) < 0.1 && i + 1 < 6) joint.beta += random.normal(o.angle);
  }
  w.joint_errors = Eigen::MatrixXd::Zero(6, 4);
  for (Eigen::Index i = 0; i < 6; ++i) w.joint_errors.row(i) = random.normal_vector(4, o.joint).transpose();
  Vector6 at;
  at << random.normal_vector(3, 2.0), random.normal_vector(3, 1.0);
  w.T_world_base = to_pose(at);
  at << random.normal_vector(3, 0.05), random.normal_vector(3, 1.0);
  w.T_flange_tool = to_pose(at);
  w.tip = Eigen::Vector3d(0.1, -0.05, 0.15);
  for (int i = 0; i < o.postures; ++i) {
    ArmPosture& p = w.postures.emplace_back();
    p.name = "p" + std::to_string(i);
    p.q = random_posture(random);
    const Pose T = w.T_world_base * w.flange(p.q);
    if (o.poses) {
      Vector6 noise;
      noise << random.normal_vector(3, o.sigma), random.normal_vector(3, o.sigma_rotation);
      p.T_world_tool = T * w.T_flange_tool * to_pose(noise);
    } else {
      p.points = T * w.tip + random.normal_vector(3, o.sigma);
    }
  }
  return w;
}

constexpr double socket_distance = 0.05;  // [m]

/// Postures that put the tip into the sockets "left" and "right" in turn, by a few Newton steps from random ones.
inline std::vector<ArmPosture> socket_postures(const ArmWorld& w, std::size_t count, Random& random) {
  const Eigen::Vector3d sockets[] = {{0.8, 0.1, 0.4}, {0.8 + socket_distance, 0.1, 0.4}};
  std::vector<ArmPosture> out;
  while (out.size() < count) {
    ArmPosture p;
    p.socket = out.size() % 2 ? "right" : "left";
    p.q = random_posture(random);
    for (int step = 0; step < 50; ++step) {
      const Pose T = w.flange(p.q);
      const Eigen::Vector3d off = sockets[out.size() % 2] - T * w.tip;
      Eigen::MatrixXd J(3, 6);
      for (int k = 0; k < 6; ++k) {
        Eigen::VectorXd moved = p.q;
        moved[k] += 1e-7;
        J.col(k) = (w.flange(moved) * w.tip - T * w.tip) / 1e-7;
      }
      p.q += J.transpose() * (J * J.transpose() + 1e-9 * Eigen::Matrix3d::Identity()).ldlt().solve(off);
    }
    if ((w.flange(p.q) * w.tip - sockets[out.size() % 2]).norm() > 1e-9 || p.q.cwiseAbs().maxCoeff() > 3.2) continue;
    p.q += random.normal_vector(6, 2e-5);
    out.push_back(p);
  }
  return out;
}

}  // namespace kr5::test
