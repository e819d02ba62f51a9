// SPDX-License-Identifier: BSD-3-Clause
#include "kinematics/closed_form.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "kinematics/wrist_arm.hpp"

namespace kr5::kinematics {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::Vector3d;

constexpr double axes_small = 1e-7;   // distance or sine below which axes 1 and 2 count as meeting or parallel
constexpr double nearly_real = 1e-3;  // roots of four joined ones are off the real line by the fourth root of rounding
constexpr double wrist_tolerance = 3e-10;  // of the wrist centre, over the size of the arm
constexpr double free_within = 1e-20;      // product of two distances from an axis that a turn about it cannot tell

/// Angle about a unit axis that brings `from` nearest to `to`; `free` where either lies on the axis.
double angle_onto(const Vector3d& axis, const Vector3d& from, const Vector3d& to, double free) {
  const Vector3d f = axis.cross(from), t = axis.cross(to);  // before products, of which little is left near the axis
  const double sine = axis.dot(f.cross(t)), cosine = f.dot(t);
  return std::hypot(sine, cosine) < free_within ? free : std::atan2(sine, cosine);
}

double angle_between(const Vector3d& a, const Vector3d& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

/// Angles at which l . (1, cos, sin) vanishes; `free` when it does everywhere.
std::vector<double> roots_of_line(const Vector3d& l, double free) {
  const double size = std::hypot(l[1], l[2]), cosine = -l[0] / size;
  if (l.norm() < 1e-14) return {free};
  if (!(std::abs(cosine) < 1 + nearly_real * nearly_real)) return {};
  const double middle = std::atan2(l[2], l[1]), half = std::acos(std::clamp(cosine, -1.0, 1.0));
  return {middle - half, middle + half};
}

/// Angles at which z^T Q z vanishes for z = (1, cos, sin), by the quartic in the tangent of half the angle; `free` when
/// it vanishes everywhere, by the measure of `scale`.
std::vector<double> roots_of_conic(const Matrix3d& Q, double scale, double free) {
  // The angle of the greatest value lies at infinity, so that the first coefficient is never small.
  double far = 0, most = 0;
  for (int k = 0; k < 8; ++k) {
    const double angle = k * std::numbers::pi / 4;
    const Vector3d z(1, std::cos(angle), std::sin(angle));
    const double value = std::abs(z.dot(Q * z));
    if (value > most) far = angle, most = value;
  }
  if (most < 1e-14 * scale) return {free};
  const double middle = far + std::numbers::pi, c = std::cos(middle), s = std::sin(middle);
  const Matrix3d N{{1, 0, 1}, {c, -2 * s, -c}, {s, 2 * c, -s}}, M = N.transpose() * Q * N;
  Matrix4d companion = Matrix4d::Zero();
  companion.diagonal(-1).setOnes();
  companion.col(3) << -M(0, 0), -2 * M(0, 1), -2 * M(0, 2) - M(1, 1), -2 * M(1, 2);
  companion.col(3) /= M(2, 2);
  const Eigen::Vector4cd roots = companion.eigenvalues();
  std::vector<double> angles;
  for (const std::complex<double>& t : roots)
    if (t.imag() >= 0 && t.imag() <= nearly_real * (1 + std::norm(t)))
      angles.push_back(middle + 2 * std::atan(t.real()));
  return angles;
}

/// Pieper 1968 for the wrist centre, Rodrigues' turns for the wrist.
class Solver {
 public:
  Solver(const WristArm& arm, const Pose& T_base_flange, const Eigen::VectorXd& near, double within)
      : axes_(arm.axes), arm_(arm), near_(near), within_(within) {
    const Pose move = T_base_flange * arm.T_base_flange.inverse();
    R_ = move.linear();
    wrist_ = (move * (arm.wrist * arm.size)) / arm.size;
    set_frame();
    set_forms();
  }

  std::vector<Posture> solve() {
    for (const double q3 : third()) shoulder(q3);
    return std::move(out_);
  }

 private:
  void set_frame() {
    const Vector3d &w1 = axes_[0].way, &w2 = axes_[1].way, across = w1.cross(w2);
    foot_ = axes_[0].point + w1 * w1.dot(axes_[1].point - axes_[0].point);
    const Vector3d n = axes_[1].point - foot_;
    sine_ = across.norm();
    skew_ = sine_ > axes_small;
    e_ = (skew_ ? across : n).normalized();
    f_ = w2.cross(e_);
    n_ = {n.dot(e_), n.dot(f_), n.dot(w2)};
    apart_ = std::abs(n_[0]) > axes_small;
  }

  /// x goes from the point of axis 2 to the wrist centre as joint 3 places it, y = u e + v f + w w2 is x turned about
  /// axis 2. That turn keeps x^2 and w; one about axis 1 keeps the height and the distance from the foot, which give
  /// v sine = h and y . n = k. All these are linear in z = (1, cos q3, sin q3).
  void set_forms() {
    const Axis& axis = axes_[2];
    const Vector3d lever = arm_.wrist - axis.point, radius = lever - axis.way * axis.way.dot(lever);
    Matrix3d x;
    x << axis.point + lever - radius - axes_[1].point, radius, axis.way.cross(radius);
    const Vector3d from_foot = wrist_ - foot_, n = axes_[1].point - foot_;
    square_ = 2 * x.transpose() * x.col(0);
    square_[0] = x.col(0).squaredNorm() + x.col(1).squaredNorm();
    w_ = x.transpose() * axes_[1].way;
    h_ = -axes_[0].way.dot(axes_[1].way) * w_;
    h_[0] += axes_[0].way.dot(wrist_ - axes_[1].point);
    k_ = -0.5 * square_;
    k_[0] += 0.5 * (from_foot.squaredNorm() - n.squaredNorm());
  }

  std::vector<double> third() const {
    if (!skew_) return roots_of_line(h_, near_[2]);
    const Vector3d m = sine_ * (k_ - n_[2] * w_) - n_[1] * h_;  // u n_e sine
    if (!apart_) return roots_of_line(m / sine_, near_[2]);
    const double s = sine_ * sine_, a = n_[0] * n_[0];
    Matrix3d Q = m * m.transpose() + a * (h_ * h_.transpose() + s * w_ * w_.transpose());  // u^2 + v^2 + w^2 = x^2
    Q.row(0) -= 0.5 * a * s * square_.transpose();
    Q.col(0) -= 0.5 * a * s * square_;
    return roots_of_conic(Q, s + a, near_[2]);
  }

  void shoulder(double q3) {
    const Vector3d z(1, std::cos(q3), std::sin(q3));
    const double w = w_.dot(z), square = square_.dot(z) - w * w;
    double v = skew_ ? h_.dot(z) / sine_ : 0.0;
    const double u = apart_ ? (k_.dot(z) - n_[1] * v - n_[2] * w) / n_[0] : std::sqrt(std::max(0.0, square - v * v));
    if (!skew_) v = std::sqrt(std::max(0.0, square - u * u));
    place(q3, u * e_ + v * f_);
    if (!apart_) place(q3, v * f_ - u * e_);
    if (!skew_) place(q3, u * e_ - v * f_);
  }

  void place(double q3, const Vector3d& y) {
    const Vector3d x = axes_[2].turned(q3, arm_.wrist) - axes_[1].point;
    const double q2 = angle_onto(axes_[1].way, x, y, near_[1]);
    const Vector3d placed = AngleAxisd(q2, axes_[1].way) * x + axes_[1].point;
    Vector3d q(angle_onto(axes_[0].way, placed - foot_, wrist_ - foot_, near_[0]), q2, q3);
    WristArm::Reach at = arm_.reach(q);
    // Newton; where a direction is lost it stays as it is.
    for (int k = 0; k < 10 && (wrist_ - at.wrist).norm() > 1e-15; ++k) {
      const Matrix3d A = at.J * at.J.transpose() + 1e-14 * Matrix3d::Identity();
      q += at.J.transpose() * A.ldlt().solve(wrist_ - at.wrist);
      at = arm_.reach(q);
    }
    if ((wrist_ - at.wrist).norm() < wrist_tolerance) wrist(q, named(at.J));
  }

  Singularity named(const Matrix3d& J) const {
    const Vector3d across = J.col(1).cross(J.col(2));
    const bool elbow = across.norm() < within_;
    const double beside = elbow ? J.col(0).norm() : std::abs(J.col(0).dot(across)) / across.norm();
    if (beside < within_) return elbow ? Singularity::Several : Singularity::Shoulder;
    return elbow ? Singularity::Elbow : Singularity::None;
  }

  /// Axes 4, 5 and 6 and where 6 must point span a triangle on the sphere, whose angle at 5 the half-angle formula
  /// gives without loss near either end.
  void wrist(const Vector3d& q, Singularity at) {
    const Vector3d &w4 = axes_[3].way, &w5 = axes_[4].way, &w6 = axes_[5].way;
    const Matrix3d R =
        (AngleAxisd(q[0], axes_[0].way) * AngleAxisd(q[1], axes_[1].way) * AngleAxisd(q[2], axes_[2].way))
            .toRotationMatrix()
            .transpose() *
        R_;
    const Vector3d pointed = R * w6;
    const double a = angle_between(w4, w5), b = angle_between(w5, w6), c = angle_between(w4, pointed);
    const double open = std::sin((c + b - a) / 2) * std::sin((c + a - b) / 2);
    const double shut = std::sin((a + b + c) / 2) * std::sin((a + b - c) / 2);
    if (open < -1e-12 || shut < -1e-12) return;
    const double bend = 2 * std::atan2(std::sqrt(std::max(0.0, open)), std::sqrt(std::max(0.0, shut)));
    if (std::sin(bend) < within_) at = at == Singularity::None ? Singularity::Wrist : Singularity::Several;
    const double straight = angle_onto(w5, w6, w4, 0.0);
    for (const double q5 : {straight - bend, straight + bend}) {
      const AngleAxisd R5(q5, w5);
      const double q4 = angle_onto(w4, R5 * w6, pointed, near_[3]);
      const Matrix3d R6 = (AngleAxisd(q4, w4) * R5).toRotationMatrix().transpose() * R;
      add({q[0], q[1], q[2], q4, q5, angle_onto(w6, w5, R6 * w5, 0.0)}, at);
    }
  }

  /// Once, also where two postures have become one.
  void add(const std::array<double, 6>& angles, Singularity at) {
    Posture posture{Eigen::VectorXd(6)};
    for (std::size_t i = 0; i < 6; ++i)
      posture.q[static_cast<Eigen::Index>(i)] = std::remainder(angles[i], 2 * std::numbers::pi);
    posture.singularity = at;
    const auto same = [&](const Posture& other) {
      const auto apart = [](double d) { return std::abs(std::remainder(d, 2 * std::numbers::pi)); };
      return (posture.q - other.q).unaryExpr(apart).maxCoeff() < 1e-6;
    };
    if (std::none_of(out_.begin(), out_.end(), same)) out_.push_back(std::move(posture));
  }

  const std::array<Axis, 6>& axes_;
  const WristArm& arm_;
  const Eigen::VectorXd& near_;
  double within_;
  Matrix3d R_;                         ///< Turn of the flange from where it is at zero.
  Vector3d wrist_;                     ///< Wanted place of the wrist centre.
  Vector3d foot_;                      ///< On axis 1, of the point of axis 2.
  Vector3d e_, f_;                     ///< Across axis 2: at right angles to axis 1, and the other.
  Vector3d n_;                         ///< From the foot to the point of axis 2, along e, f and axis 2.
  double sine_ = 0.0;                  ///< Of the angle between axes 1 and 2.
  bool skew_ = false, apart_ = false;  ///< Axes 1 and 2 are not parallel, do not meet.
  Vector3d square_, w_, h_, k_;        ///< Forms in z.
  std::vector<Posture> out_;
};

}  // namespace

bool has_closed_form(const DhChain& chain) { return wrist_arm(chain).has_value(); }

std::optional<std::vector<Posture>> closed_form(const DhChain& chain, const Pose& T_base_flange,
                                                const Eigen::VectorXd& near, double within) {
  const std::optional<WristArm> arm = wrist_arm(chain);
  if (!arm) return {};
  return Solver(*arm, T_base_flange, near, within).solve();
}

}  // namespace kr5::kinematics
