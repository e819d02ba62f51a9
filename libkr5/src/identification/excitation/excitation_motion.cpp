// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/excitation_motion.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <kr5/core/error.hpp>

#include "identification/excitation/point_profile.hpp"

namespace kr5::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

void check_excitation_motion(const ExcitationMotion& m) {
  if (m.kind == ExcitationKind::Fourier) {
    require(m.period > 0, "period must be positive [s]");
    require(m.offset.size() > 0, "offset: no joint");
    require(m.sine.rows() == m.offset.size() && m.cosine.rows() == m.offset.size() && m.sine.cols() == m.cosine.cols(),
            "sine, cosine: expected a row a joint and as many columns as one another");
    return;
  }
  require(m.points.rows() > 1 && m.points.cols() > 0, "points: at least two are needed");
  require(m.times.size() == m.points.rows(), "times: found " + std::to_string(m.times.size()) +
                                                 ", expected one a point: " + std::to_string(m.points.rows()));
  for (Index k = 1; k < m.times.size(); ++k) require(m.times[k] > m.times[k - 1], "times must rise [s]");
}

void add_harmonics(const ExcitationMotion& m, JointMotion& out) {
  const double w = 2 * M_PI / m.period;
  out.q = m.offset.transpose().replicate(out.samples(), 1);
  for (Index l = 0; l < m.sine.cols(); ++l) {
    const double rate = w * static_cast<double>(l + 1);
    const VectorXd s = (rate * out.t).array().sin(), c = (rate * out.t).array().cos();
    const auto A = m.sine.col(l).transpose(), B = m.cosine.col(l).transpose();
    out.q += s * A + c * B;
    out.qd += rate * (c * A - s * B);
    out.qdd -= rate * rate * (s * A + c * B);
  }
}

void add_strokes(const ExcitationMotion& m, JointMotion& out) {
  Index k = 0;
  for (Index i = 0; i < out.samples(); ++i) {
    while (k + 2 < m.times.size() && out.t[i] >= m.times[k + 1]) ++k;
    const double T = m.times[k + 1] - m.times[k], u = (out.t[i] - m.times[k]) / T;
    const ProfileState s = profile_state(m.profile, u);
    const auto way = m.points.row(k + 1) - m.points.row(k);
    out.q.row(i) = m.points.row(k) + s.place * way;
    out.qd.row(i) = s.speed / T * way;
    out.qdd.row(i) = s.acceleration / (T * T) * way;
  }
}

}  // namespace

ProfileState profile_state(ExcitationProfile profile, double u) {
  if (u <= 0) return {0.0, 0.0, 0.0};
  if (u >= 1) return {1.0, 0.0, 0.0};
  if (profile == ExcitationProfile::Quintic)
    return {u * u * u * (10 + u * (-15 + 6 * u)), 30 * u * u * (1 - u) * (1 - u), 60 * u * (1 - u) * (1 - 2 * u)};
  constexpr double r = profile_ramp, v = 1 / (1 - r), a = v / r;
  if (u < r) return {0.5 * a * u * u, a * u, a};
  if (u > 1 - r) return {1 - 0.5 * a * (1 - u) * (1 - u), a * (1 - u), -a};
  return {v * (u - 0.5 * r), v, 0.0};
}

double ExcitationMotion::duration() const {
  if (kind == ExcitationKind::Fourier) return period;
  return times.size() > 0 ? times[times.size() - 1] : 0.0;
}

JointMotion ExcitationMotion::states(const VectorXd& times_wanted) const {
  check_excitation_motion(*this);
  JointMotion out;
  out.t = times_wanted.cwiseMax(0.0).cwiseMin(duration());
  out.q = out.qd = out.qdd = out.tau = MatrixXd::Zero(times_wanted.size(), joints());
  if (kind == ExcitationKind::Fourier)
    add_harmonics(*this, out);
  else
    add_strokes(*this, out);
  out.t = times_wanted;
  return out;
}

JointMotion ExcitationMotion::sampled(double interval) const {
  require(interval > 0 && std::isfinite(interval), "interval must be positive [s]");
  const auto steps = static_cast<Index>(std::ceil(duration() / interval - 1e-9));
  VectorXd wanted(steps + 1);
  for (Index k = 0; k <= steps; ++k) wanted[k] = std::min(static_cast<double>(k) * interval, duration());
  return states(wanted);
}

}  // namespace kr5::identification
