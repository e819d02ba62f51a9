// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/planar_gravity.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>

#include "identification/dynamics/slow_samples.hpp"
#include "identification/log/residual_correlation.hpp"

namespace kr5::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index harmonic_terms = 3;      // of a harmonic: constant, sine, cosine
constexpr double min_eigenvalue = 1e-7;  // of the scaled information: some 1.5 degrees of arc

using HarmonicRow = Eigen::Matrix<double, 1, harmonic_terms>;

HarmonicRow harmonic_row(const GravityAngle& angle, const VectorXd& q) {
  require(angle.factors.size() == q.size(),
          "q: found " + std::to_string(q.size()) + " values, expected " + std::to_string(angle.factors.size()));
  const double psi = angle.factors.dot(q);
  return {1.0, std::sin(psi), std::cos(psi)};
}

/// Torque of joint `k` of the list over the terms of joints 0 to k.
VectorXd torque_row(std::span<const GravityAngle> angles, std::size_t k, const VectorXd& q) {
  VectorXd out(harmonic_terms * static_cast<Index>(k + 1));
  double factor = 1.0;
  for (std::size_t i = k + 1; i-- > 0;) {
    out.segment<harmonic_terms>(harmonic_terms * static_cast<Index>(i)) =
        factor * harmonic_row(angles[i], q).transpose();
    if (i > 0) factor *= angles[i].distal;
  }
  return out;
}

/// What the slow samples of one joint say: torque = behind * terms of the joints behind + own * terms and friction.
struct HarmonicEquations {
  MatrixXd behind, own;
  VectorXd tau;
};

HarmonicEquations harmonic_equations(const JointMotion& motion, std::span<const GravityAngle> angles, std::size_t k,
                                     const SlowSamples& samples, const GravityOptions& options) {
  const auto rows = static_cast<Index>(samples.rows.size());
  const auto before = harmonic_terms * static_cast<Index>(k);
  const bool viscous = options.viscous && samples.several_speeds;
  HarmonicEquations out{MatrixXd(rows, before), MatrixXd(rows, harmonic_terms + (viscous ? 2 : 1)), VectorXd(rows)};
  for (Index r = 0; r < rows; ++r) {
    const Index sample = samples.rows[static_cast<std::size_t>(r)];
    const VectorXd row = torque_row(angles, k, motion.q.row(sample).transpose());
    const double speed = motion.qd(sample, samples.joint);
    if (before > 0) out.behind.row(r) = row.head(before).transpose();
    out.own.row(r).head<harmonic_terms>() = row.tail<harmonic_terms>().transpose();
    out.own(r, harmonic_terms) = speed > 0 ? 1.0 : -1.0;
    if (viscous) out.own(r, harmonic_terms + 1) = speed;
    out.tau[r] = motion.tau(sample, samples.joint);
  }
  return out;
}

/// Inverse of the information of `own`; empty when it is too small an arc.
MatrixXd inverse_information(const MatrixXd& own) {
  const MatrixXd information = own.transpose() * own;
  const VectorXd scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const SymmetricEigen eigen = symmetric_eigen(MatrixXd(scale.asDiagonal() * information * scale.asDiagonal()));
  if (!scale.allFinite() || eigen.values[0] < min_eigenvalue) return {};
  const MatrixXd V = scale.asDiagonal() * eigen.vectors;
  return V * eigen.values.cwiseInverse().asDiagonal() * V.transpose();
}

/// RMS error on the last samples of a fit of the others.
double error_held_out(const HarmonicEquations& e, const VectorXd& rest, Index held) {
  const Index fitted = rest.size() - held;
  const MatrixXd inverse = inverse_information(e.own.topRows(fitted));
  if (held == 0 || inverse.size() == 0) return 0.0;
  const VectorXd x = inverse * (e.own.topRows(fitted).transpose() * rest.head(fitted));
  return std::sqrt((rest.tail(held) - e.own.bottomRows(held) * x).squaredNorm() / static_cast<double>(held));
}

void check_angles(const JointMotion& motion, std::span<const GravityAngle> angles) {
  require(!angles.empty(), "angles: none is given");
  for (std::size_t k = 0; k < angles.size(); ++k) {
    const std::string name = "angles[" + std::to_string(k) + "].";
    require(angles[k].joint >= 0 && angles[k].joint < motion.joints(),
            name + "joint: found " + std::to_string(angles[k].joint) + ", expected 0 to " +
                std::to_string(motion.joints() - 1));
    require(angles[k].factors.size() == motion.joints() && angles[k].factors.allFinite(),
            name + "factors: expected one a joint");
  }
}

/// Adds joint k to the model; `terms_found` holds the terms of those behind it.
bool add_joint(PlanarGravity& out, VectorXd& terms_found, const HarmonicEquations& e, const GravityAngle& angle,
               double held_out) {
  const MatrixXd inverse = inverse_information(e.own);
  if (inverse.size() == 0) return false;
  const MatrixXd P = inverse * e.own.transpose();
  const VectorXd rest = e.tau - e.behind * terms_found, x = P * rest, r = rest - e.own * x;
  const double freedom = std::max<double>(1.0, static_cast<double>(r.size() - x.size()));
  const double variance = r.squaredNorm() / freedom * fit_autoregression(r).samples_per_independent();
  const Index before = terms_found.size();
  const MatrixXd taken_over = -(P * e.behind).topRows<harmonic_terms>();  // by the terms of those behind
  MatrixXd covariance(before + harmonic_terms, before + harmonic_terms);
  covariance.topLeftCorner(before, before) = out.covariance;
  covariance.bottomLeftCorner(harmonic_terms, before) = taken_over * out.covariance;
  covariance.topRightCorner(before, harmonic_terms) = covariance.bottomLeftCorner(harmonic_terms, before).transpose();
  covariance.bottomRightCorner(harmonic_terms, harmonic_terms) =
      variance * inverse.topLeftCorner<harmonic_terms, harmonic_terms>() +
      taken_over * out.covariance * taken_over.transpose();
  out.covariance = covariance;
  terms_found.conservativeResize(before + harmonic_terms);
  terms_found.tail<harmonic_terms>() = x.head<harmonic_terms>();
  out.joints.push_back({.angle = angle,
                        .constant = x[0],
                        .sine = x[1],
                        .cosine = x[2],
                        .coulomb = x[harmonic_terms],
                        .viscous = x.size() > harmonic_terms + 1 ? x[harmonic_terms + 1] : 0.0,
                        .residual_rms = std::sqrt(r.squaredNorm() / static_cast<double>(r.size())),
                        .held_out_rms = error_held_out(e, rest, held_out_count(rest.size(), held_out))});
  return true;
}

}  // namespace

std::vector<GravityAngle> gravity_angles(const kinematics::DhChain& chain, const VectorXd& q,
                                         const Eigen::Vector3d& gravity) {
  constexpr double parallel = 1e-3;  // sine of the angle between axes [-]
  const std::vector<Pose> T = chain.link_poses(q);
  require(gravity.norm() > 0, "gravity must not be zero [m/s^2]");
  std::vector<Eigen::Vector3d> axes;
  std::vector<int> horizontal;
  for (std::size_t i = 0; i < chain.joints.size(); ++i) {
    axes.push_back((i == 0 ? chain.T_base_0 : T[i - 1]).linear().col(2));
    const bool turns = chain.joints[i].type == kinematics::JointType::Revolute;
    if (turns && std::abs(axes[i].dot(gravity.normalized())) < parallel) horizontal.push_back(static_cast<int>(i));
  }
  const auto axis = [&](int i) -> const Eigen::Vector3d& { return axes[static_cast<std::size_t>(i)]; };
  std::vector<int> most;
  for (const int first : horizontal) {
    std::vector<int> group;
    for (const int i : horizontal)
      if (axis(i).cross(axis(first)).norm() < parallel) group.push_back(i);
    if (group.size() > most.size()) most = group;
  }
  require(!most.empty(), "q: no joint has a horizontal axis in this posture");
  std::vector<GravityAngle> out;
  for (std::size_t k = most.size(); k-- > 0;) {
    GravityAngle angle{most[k], VectorXd::Zero(q.size()), 1.0};
    for (std::size_t i = 0; i <= k; ++i) angle.factors[most[i]] = axis(most[i]).dot(axis(most[k])) > 0 ? 1.0 : -1.0;
    if (k + 1 < most.size()) angle.distal = axis(most[k]).dot(axis(most[k + 1])) > 0 ? 1.0 : -1.0;
    out.push_back(angle);
  }
  return out;
}

GravityPrediction PlanarGravity::predict(const VectorXd& q) const {
  std::vector<GravityAngle> angles;
  VectorXd all(harmonic_terms * static_cast<Index>(joints.size()));
  for (const GravityHarmonic& h : joints) {
    all.segment<harmonic_terms>(harmonic_terms * static_cast<Index>(angles.size())) << h.constant, h.sine, h.cosine;
    angles.push_back(h.angle);
  }
  GravityPrediction out{VectorXd(static_cast<Index>(joints.size())), VectorXd(static_cast<Index>(joints.size()))};
  for (std::size_t k = 0; k < joints.size(); ++k) {
    const VectorXd row = torque_row(angles, k, q);
    out.tau[static_cast<Index>(k)] = row.dot(all.head(row.size()));
    out.sigma[static_cast<Index>(k)] =
        std::sqrt(std::max(0.0, row.dot(covariance.topLeftCorner(row.size(), row.size()) * row)));
  }
  return out;
}

PlanarGravity identify_planar_gravity(const JointMotion& motion, std::span<const GravityAngle> angles,
                                      const GravityOptions& options) {
  options.validate();
  motion.validate();
  check_angles(motion, angles);
  const std::vector<SlowSamples> samples = slow_samples(motion, options.min_speed, options.max_speed);
  PlanarGravity out;
  VectorXd found;
  for (std::size_t k = 0; k < angles.size(); ++k) {
    const SlowSamples& own = samples[static_cast<std::size_t>(angles[k].joint)];
    const std::string joint = "joint " + std::to_string(own.joint + 1);
    out.fit.message = own.rows.empty() ? joint + " did not move slowly" : objection(motion, {own}, options.held_out);
    if (!out.fit.message.empty()) return out;
    const HarmonicEquations e = harmonic_equations(motion, angles, k, own, options);
    if (!add_joint(out, found, e, angles[k], options.held_out)) {
      out.fit.message = joint + " moved over too small an angle to distinguish a harmonic of it from a constant";
      return out;
    }
  }
  out.fit = {FitStatus::Converged, 1, 0.0, 1.0, "harmonics of " + std::to_string(angles.size()) + " joints fitted"};
  return out;
}

}  // namespace kr5::identification
