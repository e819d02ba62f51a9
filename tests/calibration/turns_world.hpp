#pragma once

#include <cmath>
#include <vector>

#include <kr5/calibration/circle_point.hpp>
#include <kr5/calibration/parallel_planes.hpp>
#include <kr5/core/random.hpp>
#include <kr5/kinematics/axis_chain.hpp>

/// @file
/// An arm whose joints turn one at a time before a measuring device.

namespace kr5::test {

using namespace calibration;

constexpr double degree = M_PI / 180;

/// The book's arm; without offsets, joint values 0, 0, 0 put the upper arm upright and the forearm across.
inline kinematics::DhChain arm_of(double a1, double a2, double a3, double b4) {
  kinematics::DhChain out;
  const double quarter = M_PI / 2;
  out.joints = {{.b = 0.4, .a = a1, .alpha = quarter},
                {.theta_offset = quarter, .a = a2, .alpha = 2 * quarter},
                {.a = a3, .alpha = quarter},
                {.b = b4, .theta_offset = 2 * quarter, .alpha = quarter},
                {.theta_offset = -quarter, .alpha = quarter},
                {.b = 0.115}};
  return out;
}

inline kinematics::DhChain book_arm() { return arm_of(0.18, 0.6, 0.12, 0.62); }

/// Samples of one joint that turns about q; what the device sees of points on the flange, with noise.
inline std::vector<JointSample> turn_samples(const kinematics::DhChain& arm, Eigen::VectorXd q, int joint,
                                             const Eigen::Matrix3Xd& on_flange, double sigma, Random& random,
                                             double arc, int count = 20) {
  std::vector<JointSample> out;
  const double home = q[joint];
  for (int i = 0; i < count; ++i) {
    q[joint] = home + arc * (static_cast<double>(i) / (count - 1) - 0.5);
    JointSample& sample = out.emplace_back();
    sample.q = q[joint];
    sample.points = arm.flange(q) * on_flange.colwise().homogeneous();
    for (Eigen::Index c = 0; c < on_flange.cols(); ++c) sample.points.col(c) += random.normal_vector(3, sigma);
  }
  return out;
}

/// The same of the pose of a tool on the flange.
inline std::vector<JointSample> pose_turn_samples(const kinematics::DhChain& arm, Eigen::VectorXd q, int joint,
                                                  const Pose& T_flange_tool, double sigma, double sigma_rotation,
                                                  Random& random, double arc, int count = 20) {
  std::vector<JointSample> out;
  const double home = q[joint];
  for (int i = 0; i < count; ++i) {
    q[joint] = home + arc * (static_cast<double>(i) / (count - 1) - 0.5);
    JointSample& sample = out.emplace_back();
    sample.q = q[joint];
    Vector6 noise;
    noise << random.normal_vector(3, sigma), random.normal_vector(3, sigma_rotation);
    sample.T_world_tool = arm.flange(q) * T_flange_tool * to_pose(noise);
  }
  return out;
}

/// The axis of one joint that turns about q, by three points on the flange.
inline JointAxisResult turn_of(const kinematics::DhChain& arm, const Eigen::VectorXd& q, int joint, double sigma,
                               Random& random, double arc, int count = 20) {
  return identify_joint_axis(turn_samples(arm, q, joint, 0.3 * Eigen::Matrix3d::Identity(), sigma, random, arc, count),
                             {.sigma_position = sigma, .outlier_false_alarm = 0});
}

/// Joint values for an upper arm that leans by `lean`, the forearm across axis 1, to the front or to the back, or along
/// it.
inline Eigen::VectorXd posture(double lean, bool upright, bool back) {
  Eigen::VectorXd q = Eigen::VectorXd::Zero(6);
  q << 0.2, lean, lean + (upright ? -M_PI / 2 : (back ? 0.0 : M_PI)), 0.0, 0.0, 0.0;
  return q;
}

/// Turns q5 until axis 6 is parallel to axis 1.
inline Eigen::VectorXd with_level_wrist(const kinematics::DhChain& arm, Eigen::VectorXd q) {
  double best = 0.0, most = -1.0;
  for (int k = 0; k < 4; ++k) {
    q[4] = k * M_PI / 2;
    const auto axes = kinematics::axes_of(arm, q);
    const double along = std::abs(axes[0].direction.dot(axes[5].direction));
    if (along > most) most = along, best = q[4];
  }
  q[4] = best;
  return q;
}

inline ParallelPlaneAxes turns_of(const kinematics::DhChain& arm, double lean, double sigma, Random& random,
                                  bool back = false) {
  const double arc = 50 * degree;
  const Eigen::VectorXd q = with_level_wrist(arm, posture(lean, false, back)),
                        up = with_level_wrist(arm, posture(lean, true, back));
  const auto turn = [&](const Eigen::VectorXd& at, int joint) { return turn_of(arm, at, joint, sigma, random, arc); };
  return {turn(q, 0), turn(q, 1), turn(q, 2), turn(q, 4), turn(q, 5), turn(up, 5)};
}

/// Turns of every joint of an arm about its home, one reflector on the flange under a tracker.
struct ArmTurns {
  kinematics::DhChain arm;  ///< In the frame of the tracker.
  Eigen::VectorXd home;
  Eigen::Vector3d reflector = Eigen::Vector3d(0.15, 0.05, 0.2);
  std::vector<std::vector<JointSample>> turns;

  Eigen::Vector3d place_at_home() const { return arm.flange(home) * reflector; }

  /// The arm with the parameters that its axes determine, in the form of chain_from_axes.
  kinematics::DhChain truth() const {
    return kinematics::chain_from_axes(kinematics::axes_of(arm, home), home, arm.flange(home));
  }
};

struct ArmTurnsOptions {
  double sigma = 1e-4;       ///< [m]
  double arc = 50 * degree;  ///< [rad]
  double home_spread = 0.0;  ///< [rad]
  int samples = 20;
  bool poses = false;            ///< Of a tool at the reflector, in place of points.
  double sigma_rotation = 1e-5;  ///< [rad]
};

inline ArmTurns make_arm_turns(Random& random, const ArmTurnsOptions& o = {}) {
  ArmTurns out;
  out.arm = book_arm(), out.home.resize(6);
  out.arm.T_base_0 = to_pose(Vector6(2.0, 1.0, 0.5, 0.3, 0.2, -1.0));
  out.home << 0.1, -0.5, 0.6, 0.3, 0.7, 0.2;
  for (double& q : out.home) q += random.uniform(-o.home_spread, o.home_spread);
  Vector6 tool;
  tool << out.reflector, 0.4, -0.3, 0.8;
  for (int k = 0; k < 6; ++k)
    out.turns.push_back(o.poses ? pose_turn_samples(out.arm, out.home, k, to_pose(tool), o.sigma, o.sigma_rotation,
                                                    random, o.arc, o.samples)
                                : turn_samples(out.arm, out.home, k, out.reflector, o.sigma, random, o.arc, o.samples));
  return out;
}

}  // namespace kr5::test
