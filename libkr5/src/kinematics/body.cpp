// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/kinematics/body.hpp>

#include <cmath>

#include <kr5/core/linear.hpp>

namespace kr5::kinematics {
namespace {

/// Steiner's term: inertia about the origin of a point mass at p.
Eigen::Matrix3d point_inertia(double mass, const Eigen::Vector3d& p) {
  return mass * (p.squaredNorm() * Eigen::Matrix3d::Identity() - p * p.transpose());
}

}  // namespace

Eigen::Matrix3d inertia_matrix(const Vector6& v) {
  Eigen::Matrix3d I;
  I << v[0], v[3], v[4], v[3], v[1], v[5], v[4], v[5], v[2];
  return I;
}

Vector6 inertia_vector(const Eigen::Matrix3d& I) {
  return (Vector6() << I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)).finished();
}

Moments& Moments::operator+=(const Moments& other) {
  mass += other.mass;
  first += other.first;
  second += other.second;
  return *this;
}

Eigen::Matrix3d Body::inertia_matrix() const { return kinematics::inertia_matrix(inertia); }

Moments inertial_moments(const Body& body) {
  return {body.mass, body.mass * body.com, inertia_matrix(body.inertia) + point_inertia(body.mass, body.com)};
}

Body to_body(const Moments& m) {
  if (m.mass == 0.0) return {0.0, Eigen::Vector3d::Zero(), inertia_vector(m.second)};
  const Eigen::Vector3d com = m.first / m.mass;
  return {m.mass, com, inertia_vector(m.second - point_inertia(m.mass, com))};
}

Body transformed_body(const Pose& T_a_b, const Body& body) {
  const Eigen::Matrix3d R = T_a_b.linear();
  return {body.mass, T_a_b * body.com, inertia_vector(R * inertia_matrix(body.inertia) * R.transpose())};
}

Body merged_body(const Body& a, const Body& b) {
  // Not by way of the moments about the origin: far from it they would lose the digits of the inertia.
  if (a.mass + b.mass == 0.0) return {0.0, Eigen::Vector3d::Zero(), a.inertia + b.inertia};
  const double mass = a.mass + b.mass;
  const Eigen::Vector3d apart = b.com - a.com;
  return {mass, a.com + apart * (b.mass / mass),
          a.inertia + b.inertia + inertia_vector(point_inertia(a.mass * b.mass / mass, apart))};
}

bool is_real(const Body& body) {
  constexpr double slack = 1e-9;  // what rounding bends
  const Eigen::Vector3d l = symmetric_eigen(inertia_matrix(body.inertia)).values;
  return body.mass > 0.0 && l[0] >= -slack * std::abs(l[2]) && l[0] + l[1] >= l[2] * (1.0 - slack);
}

std::optional<Body> body_without(const Body& whole, const Body& part) {
  constexpr double least = 1e-9;
  Body out;
  out.mass = whole.mass - part.mass;
  if (!(out.mass > least * whole.mass)) return std::nullopt;
  const Eigen::Vector3d apart = (whole.com - part.com) * (whole.mass / out.mass);
  out.com = part.com + apart;
  out.inertia = whole.inertia - part.inertia - inertia_vector(point_inertia(out.mass * part.mass / whole.mass, apart));
  if (!is_real(out)) return std::nullopt;
  return out;
}

}  // namespace kr5::kinematics
