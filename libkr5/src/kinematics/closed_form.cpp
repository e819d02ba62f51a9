// SPDX-License-Identifier: BSD-3-Clause
#include "kinematics/closed_form.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace kr5::kinematics {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double small = 1e-9;  // of a constant that must vanish [m or rad]

Matrix3d about_x(double angle) { return AngleAxisd(angle, Vector3d::UnitX()).toRotationMatrix(); }
Matrix3d about_z(double angle) { return AngleAxisd(angle, Vector3d::UnitZ()).toRotationMatrix(); }

/// The angles whose cosine is `c`; one when it is straight, none when there is none.
struct Corner {
  std::vector<double> angles;
  bool straight = false;
};

/// @param sine Of the positive angle, where it is known better than from the cosine.
Corner corner(double c, double sine, double within) {
  if (!(std::abs(c) <= 1.0 + 1e-12)) return {};
  if (sine < small) return {{c > 0 ? 0.0 : std::numbers::pi}, true};
  const double angle = std::atan2(sine, c);
  return {{angle, -angle}, sine < within};
}

double sine_of(double c) { return std::sqrt(std::max(0.0, (1.0 - c) * (1.0 + c))); }

Singularity both(Singularity a, Singularity b) {
  if (a == Singularity::None) return b;
  return b == Singularity::None ? a : Singularity::Several;
}

class Solver {
 public:
  Solver(const DhChain& chain, const Pose& T_B_F, const Eigen::VectorXd& near, double within)
      : rows_(chain.joints), near_(near), within_(within), T_0_6_(chain.T_B_0.inverse() * T_B_F) {
    const DhJoint& last = rows_[5];
    C6_ = about_x(last.alpha) * AngleAxisd(last.beta, Vector3d::UnitY()).toRotationMatrix();
    wrist_ = T_0_6_ * Vector3d(C6_.transpose() * Vector3d(-last.a, 0, -last.b));
  }

  std::vector<Posture> solve() {
    shoulder();
    return std::move(out_);
  }

 private:
  double theta_near(int i) const { return near_[i] + rows_[static_cast<std::size_t>(i)].theta_offset; }

  void shoulder() {
    const double s1 = std::sin(rows_[0].alpha), r = wrist_.head<2>().norm();
    // Distance of the plane of the arm from axis 1: what the offsets along the parallel axes leave.
    const double side = rows_[1].b + std::cos(rows_[1].alpha) * (rows_[2].b + std::cos(rows_[2].alpha) * rows_[3].b);
    const double reach = std::abs(rows_[1].a) + std::hypot(rows_[2].a, rows_[3].b) + std::abs(side);
    if (std::max(r, std::abs(side)) < small * reach) return elbow(theta_near(0), -rows_[0].a, Singularity::Shoulder);
    if (r < std::abs(side) * (1 - 1e-12)) return;
    const double forward = std::sqrt(std::max((r - side) * (r + side), 0.0));
    const double towards = std::atan2(wrist_.y(), wrist_.x());
    const Singularity at = forward < within_ * reach ? Singularity::Shoulder : Singularity::None;
    elbow(towards - std::atan2(-s1 * side, forward), forward - rows_[0].a, at);
    if (forward > 0.0) elbow(towards - std::atan2(-s1 * side, -forward), -forward - rows_[0].a, at);
  }

  /// `x`: of the wrist centre in frame 1.
  void elbow(double theta1, double x, Singularity at) {
    const double s1 = std::sin(rows_[0].alpha), flip = std::cos(rows_[1].alpha) > 0 ? 1.0 : -1.0;
    const Vector2d p(x, s1 * (wrist_.z() - rows_[0].b)), v(rows_[2].a, -std::sin(rows_[2].alpha) * rows_[3].b);
    const double upper = rows_[1].a, lower = v.norm();
    const double c = (p.squaredNorm() - upper * upper - lower * lower) / (2 * std::abs(upper) * lower);
    // The square of an angle, not the angle, is what the distance tells near a stretched arm.
    const Corner bend = corner(c, 1.0 - std::abs(c) < within_ * within_ / 2 ? 0.0 : sine_of(c), within_);
    for (const double angle : bend.angles) {
      const double theta3 = angle - std::atan2(v.y(), v.x()) + (upper < 0 ? std::numbers::pi : 0.0);
      const Vector2d u = Eigen::Rotation2Dd(theta3) * v, arm(upper + u.x(), flip * u.y());
      // Folded onto the shoulder, joint 2 turns freely.
      const bool free = arm.norm() < small * (std::abs(upper) + lower);
      const double theta2 = free ? theta_near(1) : std::atan2(p.y(), p.x()) - std::atan2(arm.y(), arm.x());
      wrist(theta1, theta2, theta3, bend.straight || free ? both(at, Singularity::Elbow) : at);
    }
  }

  void wrist(double theta1, double theta2, double theta3, Singularity at) {
    const Matrix3d R_0_3 = about_z(theta1) * about_x(rows_[0].alpha) * about_z(theta2) * about_x(rows_[1].alpha) *
                           about_z(theta3) * about_x(rows_[2].alpha);
    const Matrix3d M = R_0_3.transpose() * T_0_6_.linear() * C6_.transpose();
    const Matrix3d X4 = about_x(rows_[3].alpha), X5 = about_x(rows_[4].alpha);
    const double c = (X4(1, 1) * X5(1, 1) - M(2, 2)) / (X4(2, 1) * X5(2, 1));
    // With right angles in the wrist the sine is known where the cosine is flat.
    const bool right = std::abs(X4(1, 1)) < small && std::abs(X5(1, 1)) < small;
    const Corner bend = corner(c, right ? std::hypot(M(0, 2), M(1, 2)) : sine_of(c), within_);
    for (const double theta5 : bend.angles) {
      const Vector3d w = X4 * about_z(theta5) * X5.col(2);
      const double theta4 =
          w.head<2>().norm() < small ? theta_near(3) : std::atan2(M(1, 2), M(0, 2)) - std::atan2(w.y(), w.x());
      const Matrix3d Z6 = (about_z(theta4) * X4 * about_z(theta5) * X5).transpose() * M;
      const bool lost = bend.straight || w.head<2>().norm() < within_;
      add({theta1, theta2, theta3, theta4, theta5, std::atan2(Z6(1, 0), Z6(0, 0))},
          lost ? both(at, Singularity::Wrist) : at);
    }
  }

  void add(const std::array<double, 6>& theta, Singularity at) {
    Posture posture;
    posture.q.resize(6);
    for (std::size_t i = 0; i < 6; ++i)
      posture.q[static_cast<Eigen::Index>(i)] = std::remainder(theta[i] - rows_[i].theta_offset, 2 * std::numbers::pi);
    posture.singularity = at;
    out_.push_back(std::move(posture));
  }

  const std::vector<DhJoint>& rows_;
  const Eigen::VectorXd& near_;
  double within_;
  Pose T_0_6_;
  Matrix3d C6_;
  Vector3d wrist_;
  std::vector<Posture> out_;
};

}  // namespace

bool has_closed_form(const DhChain& chain) {
  if (chain.joints.size() != 6) return false;
  const auto& d = chain.joints;
  for (std::size_t i = 0; i < 6; ++i)
    if (d[i].type != JointType::Revolute || (i < 5 && std::abs(d[i].beta) > small)) return false;
  const bool basis = std::abs(std::cos(d[0].alpha)) < small && std::abs(std::sin(d[1].alpha)) < small;
  const bool lengths = std::abs(d[1].a) > small && std::hypot(d[2].a, std::sin(d[2].alpha) * d[3].b) > small;
  const bool point = std::abs(d[3].a) < small && std::abs(d[4].a) < small && std::abs(d[4].b) < small;
  // Axis 3 must not be parallel to axis 4, nor 4 to 5, nor 5 to 6: the wrist could not turn freely.
  const bool turns = std::abs(std::sin(d[3].alpha)) > 1e-3 && std::abs(std::sin(d[4].alpha)) > 1e-3;
  return basis && lengths && point && turns;
}

std::vector<Posture> closed_form(const DhChain& chain, const Pose& T_B_F, const Eigen::VectorXd& near, double within) {
  return Solver(chain, T_B_F, near, within).solve();
}

}  // namespace kr5::kinematics
