// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <kr5/kinematics/body.hpp>
#include <kr5/kinematics/dh_chain.hpp>

/// @file
/// Inverse dynamics of a chain by the recursive Newton-Euler scheme (Luh, Walker, Paul 1980), in the frames of the
/// links.

namespace kr5::kinematics {

/// A body fixed to a link, cut off at frame S: a tool below its force sensor.
struct SensorCut {
  int link = -1;                          ///< Counted from 0; -1 is the last.
  Pose T_link_sensor = Pose::Identity();  ///< Where it is cut.
  Body body;                              ///< What is cut off, in S.
};

struct MotionLoads {
  Rows tau;     ///< N x n joint torques [N m or N].
  Rows wrench;  ///< N x 6 wrench through the cut, force first, as in `Dynamics::wrench` [N, N m]; empty without one.
};

/// Equations of motion of a chain with massive links. Links are counted from 0; link i moves with joint i, its frame is
/// the DH frame behind that joint, the last is the flange. Copies are independent; one object is for one thread.
class Dynamics {
 public:
  /// @param bodies One a joint, in the frame of its link; @param gravity in B [m/s^2].
  /// @throws InvalidArgument when the numbers of bodies and joints differ.
  Dynamics(const DhChain& chain, std::span<const Body> bodies, const Eigen::Vector3d& gravity = {0.0, 0.0, -9.81});

  int joints() const { return static_cast<int>(joints_.size()); }

  /// What a link is made of, and what rides on it besides. @throws InvalidArgument when there is no such link.
  void set_body(int link, const Body& body);
  void add_body(int link, const Body& body, const Pose& T_link_body = Pose::Identity());
  /// In B [m/s^2]; a tilted base is a turned gravity.
  void set_gravity(const Eigen::Vector3d& gravity);

  /// Joint torques that make the motion q, qd, qdd. Allocates nothing.
  /// @param external Wrench of the environment on each link, about the origin and in the axes of its frame, force
  ///        first [N, N m]; n of them or none.
  /// @throws InvalidArgument when a size is not the number of joints.
  void torques(const Eigen::Ref<const Eigen::VectorXd>& q, const Eigen::Ref<const Eigen::VectorXd>& qd,
               const Eigen::Ref<const Eigen::VectorXd>& qdd, Eigen::Ref<Eigen::VectorXd> tau,
               std::span<const Vector6> external = {});
  Eigen::VectorXd torques(const Eigen::VectorXd& q, const Eigen::VectorXd& qd, const Eigen::VectorXd& qdd);
  /// Torques that hold the arm still [N m or N].
  Eigen::VectorXd gravity_torques(const Eigen::VectorXd& q);

  /// Wrench that moves what lies below the cut, about S and in its axes, force first [N, N m], in the motion of the
  /// last call of `torques`: the negative of what a force sensor at S reads. The body must not be part of the arm
  /// twice: it adds nothing to the torques here, `add_body` does.
  Vector6 wrench(const SensorCut& cut) const;
  /// Wrench that passes from link - 1 into a link, about the origin and in the axes of the frame of `link`, force first
  /// [N, N m], in the last call of `torques`.
  Vector6 joint_wrench(int link) const;

  /// The same for every row (N x n); allocates only the result.
  MotionLoads loads(const Eigen::Ref<const Rows>& q, const Eigen::Ref<const Rows>& qd,
                    const Eigen::Ref<const Rows>& qdd, const std::optional<SensorCut>& cut = {});

  /// M(q), n x n, symmetric: kinetic energy is qd^T M qd / 2.
  Eigen::MatrixXd mass_matrix(const Eigen::VectorXd& q);
  /// The same into a matrix, which is allocated only where its size is another.
  void mass_matrix(const Eigen::VectorXd& q, Eigen::MatrixXd& M);
  /// Its diagonal.
  Eigen::VectorXd mass_diagonal(const Eigen::VectorXd& q);

 private:
  friend class InertialRegressor;  // the derivative of this by the masses, on the same motion of the links

  struct Joint {
    bool revolute = true;
    double theta_offset = 0.0;
    Eigen::Matrix3d R;  ///< Constant part: link frame in the turned frame (revolute) or the frame before (prismatic).
    // In axes of the link frame, where they do not depend on a revolute q:
    Eigen::Vector3d z;  ///< Joint axis.
    Eigen::Vector3d p;  ///< From the origin of the frame before, at q = 0 of a prismatic joint.
  };
  /// Of a link frame, in its axes; gravity counts as an upward acceleration.
  struct Motion {
    Eigen::Vector3d w = Eigen::Vector3d::Zero(), wd = Eigen::Vector3d::Zero(), a = Eigen::Vector3d::Zero();
  };
  struct Link {
    Moments body;
    Motion motion;
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();                           ///< In the frame before.
    Eigen::Vector3d p = Eigen::Vector3d::Zero();                               ///< From the frame before, in own axes.
    Eigen::Vector3d f = Eigen::Vector3d::Zero(), n = Eigen::Vector3d::Zero();  ///< Force and torque into the link.
  };

  /// A with A p = wd x p + w x (w x p): acceleration of a point of a body over that of the origin.
  static Eigen::Matrix3d acceleration_field(const Eigen::Vector3d& w, const Eigen::Vector3d& wd);
  static void body_load(const Moments& body, const Motion& motion, Eigen::Vector3d& f, Eigen::Vector3d& n);
  int link_index(int link) const;
  void set_joint(std::size_t i, double q);
  /// Motion of a link from that of the one before.
  void move_link(std::size_t i, const Motion& before, double q, double qd, double qdd);
  /// From the base outwards: motion of every link.
  void move_links(const double* q, const double* qd, const double* qdd);
  /// The same, and the load that its body is.
  void forward_pass(const double* q, const double* qd, const double* qdd);
  /// From the flange inwards: what each joint carries.
  void backward_pass(double* tau, const Vector6* external);
  void composite_bodies(const Eigen::VectorXd& q, Eigen::MatrixXd* whole, Eigen::VectorXd* diagonal);
  /// Column i of M from the load f, n about and in the axes of the joint i.
  void propagate_unit_load(std::size_t i, Eigen::Vector3d f, Eigen::Vector3d n, Eigen::MatrixXd& M) const;

  std::vector<Joint> joints_;
  std::vector<Link> links_;
  Eigen::Matrix3d R_base_0_;
  Eigen::Vector3d a_0_;  ///< Of the base, in frame 0: gravity upside down.
};

}  // namespace kr5::kinematics
