// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/drives.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <string>

#include <Eigen/Cholesky>

#include <kr5/core/error.hpp>
#include <kr5/uncertainty/confidence.hpp>

namespace kr5::identification {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double min_drive_motion = 1e-3;  // of a joint, from which a coupling to it is looked for [rad or m]
constexpr double collinear = 1e-6;         // pivot of the scaled normal equations
constexpr double large_noise = 0.03;       // noise over motion that biases S

/// Probability that a Student variable is farther from 0 than |t|.
double two_sided(double t, double dof) { return 1 - uncertainty::fisher_cdf(t * t, 1, dof); }

/// The linear model of one motor: its angle over the joints in `joints`, with a zero for each group.
struct MotorModel {
  Index motor = 0;
  std::vector<Index> joints;  ///< Columns of the model; the own joint first.
  std::vector<Index> rows;
  MatrixXd X;         ///< Joint angles without their group's mean.
  VectorXd y;         ///< Motor angles, the same way.
  MatrixXd inverse;   ///< (X'X)^-1
  VectorXd s;         ///< Elements of S.
  VectorXd residual;  ///< In joint readings [rad or m].
  double dof = 0.0;
  bool determined = false;
};

struct Readings {
  const MatrixXd& phi;
  const MatrixXd& q;
  std::vector<int> group;
  bool common_zero;
};

/// Takes each group's mean from the columns; returns the number of groups.
Index centre_groups(const Readings& data, const std::vector<Index>& rows, MatrixXd& X, VectorXd& y) {
  if (data.common_zero) return 0;
  std::set<int> groups;
  for (const Index row : rows) groups.insert(data.group[static_cast<std::size_t>(row)]);
  for (const int g : groups) {
    std::vector<Index> mine;
    for (std::size_t k = 0; k < rows.size(); ++k)
      if (data.group[static_cast<std::size_t>(rows[k])] == g) mine.push_back(static_cast<Index>(k));
    const Eigen::RowVectorXd mean = X(mine, Eigen::all).colwise().mean();
    const double level = y(mine).mean();
    for (const Index k : mine) {
      X.row(k) -= mean;
      y[k] -= level;
    }
  }
  return static_cast<Index>(groups.size());
}

void solve_motor(const Readings& data, const std::set<Index>& left_out, MotorModel& m) {
  m.rows.clear();
  for (Index i = 0; i < data.q.rows(); ++i) {
    bool read = std::isfinite(data.phi(i, m.motor)) && left_out.count(i) == 0;
    for (const Index j : m.joints) read = read && std::isfinite(data.q(i, j));
    if (read) m.rows.push_back(i);
  }
  m.X = data.q(m.rows, m.joints);
  m.y = data.phi.col(m.motor)(m.rows);
  const Index groups = centre_groups(data, m.rows, m.X, m.y);
  m.dof = static_cast<double>(m.X.rows() - m.X.cols() - groups);
  m.determined = false;
  if (m.dof < 1) return;
  const MatrixXd normal = m.X.transpose() * m.X;
  const VectorXd scale = normal.diagonal().cwiseSqrt().cwiseInverse();
  if (!scale.allFinite()) return;
  const Eigen::LDLT<MatrixXd> factors(MatrixXd(scale.asDiagonal() * normal * scale.asDiagonal()));
  if (!(factors.vectorD().minCoeff() > collinear)) return;
  m.inverse = scale.asDiagonal() * factors.solve(MatrixXd::Identity(normal.rows(), normal.cols())) * scale.asDiagonal();
  m.s = m.inverse * (m.X.transpose() * m.y);
  m.residual = (m.y - m.X * m.s) / m.s.norm();
  m.determined = m.s[0] != 0.0;
}

/// Variance of a joint reading with its degrees of freedom, of one motor or of all.
struct ReadingNoise {
  double variance = 0.0, dof = 0.0;
};

ReadingNoise reading_noise(const std::vector<MotorModel>& models, Index motor, bool common) {
  ReadingNoise out;
  for (const MotorModel& m : models)
    if (m.determined && (common || m.motor == motor)) {
      out.variance += m.residual.squaredNorm();
      out.dof += m.dof;
    }
  out.variance /= std::max(out.dof, 1.0);
  return out;
}

double element_sigma(const MotorModel& m, Index element, const ReadingNoise& noise) {
  return std::sqrt(std::max(m.inverse(element, element) * noise.variance, 0.0)) * m.s.norm();
}

/// Joints that may turn a motor: those that were read and moved beside the motor's own.
std::vector<Index> candidate_joints(const Readings& data, Index motor, std::vector<UnseenCoupling>& unseen) {
  std::vector<Index> out = {motor};
  for (Index j = 0; j < data.q.cols(); ++j) {
    if (j == motor) continue;
    double low = INFINITY, high = -INFINITY;
    for (Index i = 0; i < data.q.rows(); ++i)
      if (std::isfinite(data.phi(i, motor)) && std::isfinite(data.q(i, motor)) && std::isfinite(data.q(i, j))) {
        low = std::min(low, data.q(i, j));
        high = std::max(high, data.q(i, j));
      }
    if (high - low > min_drive_motion)
      out.push_back(j);
    else
      unseen.push_back({static_cast<int>(motor) + 1, static_cast<int>(j) + 1,
                        "motor " + std::to_string(motor + 1) + ": the readings do not show whether joint " +
                            std::to_string(j + 1) + " turns it: that joint was not moved, or not read, beside it"});
  }
  return out;
}

/// The least significant coupling of a motor, if it is none; its place in `joints`, else -1.
Index weakest_coupling(const MotorModel& m, const ReadingNoise& noise, double candidates, const DriveOptions& options) {
  Index weakest = -1;
  double least = INFINITY;
  for (Index k = 1; k < m.s.size(); ++k) {
    const double t = std::abs(m.s[k]) / std::max(element_sigma(m, k, noise), 1e-300);
    if (t < least) least = t, weakest = k;
  }
  if (weakest < 0) return -1;
  const bool shown = two_sided(least, noise.dof) < options.coupling_false_alarm / candidates;
  const bool large = std::abs(m.s[weakest]) > options.min_coupling * std::abs(m.s[0]);
  return shown && large ? -1 : weakest;
}

/// The reading of one motor that contradicts the others most.
DriveOutlier worst_reading(const std::vector<MotorModel>& models, const MotorModel& m, const DriveOptions& options) {
  DriveOutlier out;
  const ReadingNoise noise = reading_noise(models, m.motor, options.common_noise);
  if (noise.dof < 2) return out;
  for (Index k = 0; k < m.residual.size(); ++k) {
    const double leverage = m.X.row(k) * m.inverse * m.X.row(k).transpose();
    const double left = std::max(1 - leverage, 1e-6), r = m.residual[k];
    const double without = (noise.variance * noise.dof - r * r / left) / (noise.dof - 1);
    const double p = two_sided(r / std::sqrt(std::max(without, 1e-300) * left), noise.dof - 1);
    if (p < out.significance)
      out = {static_cast<int>(m.motor + 1), static_cast<int>(m.rows[static_cast<std::size_t>(k)] + 1), -r / left, p};
  }
  return out;
}

VectorXd counts_of_a_turn(const DriveReadings& readings, const std::vector<int>& group, const DriveOptions& options) {
  if (options.counts_per_turn.size() > 0) return options.counts_per_turn;
  VectorXd out = VectorXd::Constant(readings.joint.cols(), NAN);
  if (readings.counts.size() == 0 || readings.motor.size() == 0) return out;
  const Readings data{readings.counts, readings.motor, group, options.common_zero};
  for (Index m = 0; m < out.size(); ++m) {
    MotorModel model;
    model.motor = m;
    model.joints = {m};
    solve_motor(data, {}, model);
    if (model.determined) out[m] = 2 * std::numbers::pi * std::abs(model.s[0]);
  }
  return out;
}

void check_drive_readings(const DriveReadings& r, const DriveOptions& options) {
  const Index n = r.joint.rows(), joints = r.joint.cols();
  require(n > 0 && joints > 0, "joint: no reading of any joint");
  require(r.counts.size() > 0 || r.motor.size() > 0, "counts, motor: neither encoder counts nor motor angles");
  for (const auto* m : {&r.counts, &r.motor})
    require(m->size() == 0 || (m->rows() == n && m->cols() == joints),
            "counts, motor: expected " + std::to_string(n) + " x " + std::to_string(joints) + " numbers, found " +
                std::to_string(m->rows()) + " x " + std::to_string(m->cols()));
  require(r.group.empty() || static_cast<Index>(r.group.size()) == n, "group: one number a reading, or none");
  require(options.counts_per_turn.size() == 0 || options.counts_per_turn.size() == joints,
          "counts_per_turn: one number a motor");
  require(r.motor.size() > 0 || options.counts_per_turn.size() > 0,
          "counts_per_turn: needed where no motor angles are given [-]");
}

void reject_readings(const Readings& data, const DriveOptions& options, std::vector<MotorModel>& models,
                     std::vector<std::set<Index>>& left_out, std::vector<DriveOutlier>& outliers) {
  for (;;) {
    DriveOutlier worst;
    MotorModel* of = nullptr;
    for (MotorModel& m : models) {
      if (!m.determined || m.dof < 2) continue;
      const DriveOutlier one = worst_reading(models, m, options);
      if (one.significance * static_cast<double>(m.rows.size()) < options.outlier_false_alarm &&
          one.significance < worst.significance) {
        worst = one;
        of = &m;
      }
    }
    if (!of) return;
    outliers.push_back(worst);
    left_out[static_cast<std::size_t>(of->motor)].insert(worst.reading - 1);
    solve_motor(data, left_out[static_cast<std::size_t>(of->motor)], *of);
  }
}

/// Writes a motor's row of the result.
void keep_motor(const MotorModel& m, const ReadingNoise& noise, double candidates, DriveResult& out) {
  MatrixXd covariance = MatrixXd::Zero(out.structure.cols(), out.structure.cols());
  for (Index a = 0; a < m.s.size(); ++a) {
    const Index joint = m.joints[static_cast<std::size_t>(a)];
    out.structure(m.motor, joint) = m.s[a];
    out.sigma(m.motor, joint) = element_sigma(m, a, noise);
    for (Index b = 0; b < m.s.size(); ++b)
      covariance(joint, m.joints[static_cast<std::size_t>(b)]) = m.inverse(a, b) * noise.variance * m.s.squaredNorm();
    if (a == 0) continue;
    const double t = m.s[a] / std::max(out.sigma(m.motor, joint), 1e-300);
    out.couplings.push_back({static_cast<int>(m.motor + 1), static_cast<int>(joint + 1), m.s[a],
                             out.sigma(m.motor, joint), std::min(1.0, candidates * two_sided(t, noise.dof))});
  }
  out.covariance[static_cast<std::size_t>(m.motor)] = covariance;
  out.noise[m.motor] = std::sqrt(noise.variance);
  const double motion = std::sqrt(m.X.col(0).squaredNorm() / static_cast<double>(m.X.rows()));
  if (out.noise[m.motor] > large_noise * motion)
    out.warnings.push_back("motor " + std::to_string(m.motor + 1) + ": the noise of the joint readings is " +
                           std::to_string(std::lround(100 * out.noise[m.motor] / motion)) +
                           " % of the motion, which makes the ratio too small; move the joint farther");
}

}  // namespace

void DriveOptions::validate() const {
  require((counts_per_turn.array() > 0).all(), "counts_per_turn must be positive [-]");
  require(coupling_false_alarm > 0 && coupling_false_alarm < 1, "coupling_false_alarm: between 0 and 1 [-]");
  require(outlier_false_alarm > 0 && outlier_false_alarm < 1, "outlier_false_alarm: between 0 and 1 [-]");
  require(min_coupling >= 0 && min_coupling < 1, "min_coupling: from 0 to below 1 [-]");
}

DriveResult identify_drives(const DriveReadings& readings, const DriveOptions& options) {
  options.validate();
  check_drive_readings(readings, options);
  const Index joints = readings.joint.cols();
  std::vector<int> group = readings.group;
  if (group.empty()) group.assign(static_cast<std::size_t>(readings.joint.rows()), 0);
  DriveResult out;
  out.structure = out.sigma = MatrixXd::Zero(joints, joints);
  out.covariance.assign(static_cast<std::size_t>(joints), MatrixXd::Zero(joints, joints));
  out.noise = VectorXd::Zero(joints);
  out.counts_per_turn = counts_of_a_turn(readings, group, options);
  MatrixXd phi = readings.motor;
  if (readings.counts.size() > 0 && out.counts_per_turn.allFinite())
    phi = readings.counts * (2 * std::numbers::pi * out.counts_per_turn.cwiseInverse()).asDiagonal();
  require(phi.size() > 0, "counts_per_turn: counts and motor angles do not determine it");
  const Readings data{phi, readings.joint, group, options.common_zero};

  std::vector<MotorModel> models(static_cast<std::size_t>(joints));
  std::vector<std::set<Index>> left_out(models.size());
  std::vector<double> candidates(models.size(), 1.0);
  for (std::size_t k = 0; k < models.size(); ++k) {
    MotorModel& m = models[k];
    m.motor = static_cast<Index>(k);
    m.joints = candidate_joints(data, m.motor, out.unseen);
    candidates[k] = std::max<double>(1.0, static_cast<double>(m.joints.size()) - 1);
    solve_motor(data, left_out[k], m);
    if (!m.determined) {
      out.fit.message = "motor " + std::to_string(k + 1) + ": " + std::to_string(m.rows.size()) +
                        " readings do not determine its ratio and " + std::to_string(m.joints.size() - 1) +
                        " couplings; read more postures, in which the joints move independently";
      return out;
    }
  }
  if (options.reject_outliers) reject_readings(data, options, models, left_out, out.outliers);
  for (std::size_t k = 0; k < models.size(); ++k) {
    MotorModel& m = models[k];
    for (;;) {
      const Index weak =
          weakest_coupling(m, reading_noise(models, m.motor, options.common_noise), candidates[k], options);
      if (weak < 0) break;
      m.joints.erase(m.joints.begin() + weak);
      solve_motor(data, left_out[k], m);
    }
  }
  for (std::size_t k = 0; k < models.size(); ++k)
    keep_motor(models[k], reading_noise(models, models[k].motor, options.common_noise), candidates[k], out);
  out.counts_per_joint = (out.counts_per_turn / (2 * std::numbers::pi)).asDiagonal() * out.structure;
  out.fit = {FitStatus::Converged, 1, 0.0, 1.0, "least squares"};
  return out;
}

}  // namespace kr5::identification
