// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/force_torque.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include <kr5/core/error.hpp>
#include <kr5/core/levenberg_marquardt.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/physics/second_order.hpp>
#include <kr5/physics/servo.hpp>
#include <kr5/physics/wrench_sensor.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "identification/short_number.hpp"

namespace kr5::identification {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using kinematics::Rows;

void ForceTorqueOptions::validate() const {
  require(force_noise > 0 && std::isfinite(force_noise), "force_noise must be positive [N]");
  require(torque_noise > 0 && std::isfinite(torque_noise), "torque_noise must be positive [N m]");
  require(inertia.allFinite(), "inertia must be finite [kg m^2]");
}

namespace {

constexpr std::array<const char*, 6> components = {"fx", "fy", "fz", "tx", "ty", "tz"};

/// One entry of the parameter vector: what it is, and how large it may plausibly be.
struct SensorEntry {
  enum Kind { Bias, Rate, Mass, Com, Orientation, Gain } kind = Bias;
  Index row = 0, column = 0;
  std::string name, unit;
  double size = 1.0;
};

std::vector<SensorEntry> entries_of(const ForceTorqueOptions& options, double duration) {
  std::vector<SensorEntry> out;
  const auto force = [](Index c) { return c < 3; };
  for (Index c = 0; c < 6; ++c)
    out.push_back({SensorEntry::Bias, c, 0, std::string("bias.") + components[static_cast<std::size_t>(c)],
                   force(c) ? "N" : "N m", force(c) ? 10.0 : 1.0});
  out.push_back({SensorEntry::Mass, 0, 0, "tool.mass", "kg", 1.0});
  constexpr std::array axes = {"x", "y", "z"};
  for (Index c = 0; c < 3; ++c)
    out.push_back({SensorEntry::Com, c, 0, std::string("tool.com.") + axes[static_cast<std::size_t>(c)], "m", 0.05});
  if (options.fit_orientation)
    for (Index c = 0; c < 3; ++c)
      out.push_back(
          {SensorEntry::Orientation, c, 0, std::string("sensor.r") + axes[static_cast<std::size_t>(c)], "rad", 0.1});
  if (options.fit_drift)
    for (Index c = 0; c < 6; ++c)
      out.push_back({SensorEntry::Rate, c, 0, std::string("drift.") + components[static_cast<std::size_t>(c)],
                     force(c) ? "N/s" : "N m/s", (force(c) ? 10.0 : 1.0) / std::max(duration, 1e-9)});
  if (options.gain == GainModel::None) return out;
  for (Index c = 0; c < 6; ++c)
    for (Index s = 0; s < 6; ++s) {
      const std::string to = components[static_cast<std::size_t>(c)], from = components[static_cast<std::size_t>(s)];
      if (c == s)
        out.push_back({SensorEntry::Gain, c, s, "gain." + to, "-", 0.1});
      else if (options.gain == GainModel::Crosstalk)
        out.push_back({SensorEntry::Gain, c, s, "crosstalk." + to + "." + from,
                       force(c) == force(s) ? "-"
                       : force(c)           ? "1/m"
                                            : "m",
                       force(c) && !force(s) ? 1.0 : 0.1});
    }
  return out;
}

/// Wrench of a body on the sensor, in S: its weight less what accelerates it.
Vector6 body_wrench(double mass, const Vector3d& com, const Matrix3d& inertia, const Vector3d& gravity,
                    const Vector3d& w, const Vector3d& wd) {
  const Vector3d force = mass * (gravity - wd.cross(com) - w.cross(w.cross(com)));
  Vector6 out;
  out << force, com.cross(force) - inertia * wd - w.cross(inertia * w);
  return out;
}

/// Readings against the model, in standard deviations. A weak expectation about the start keeps what the readings do
/// not tell where it was.
class SensorProblem {
 public:
  SensorProblem(std::span<const ForceTorqueReading> readings, const ForceTorqueOptions& options,
                std::vector<SensorEntry> entries, double middle)
      : readings_(readings),
        R_nominal_(options.T_flange_sensor.linear()),
        inertia_(cell::Tool{.inertia = options.inertia}.inertia_matrix()),
        middle_(middle),
        entries(std::move(entries)),
        weight(VectorXd::Ones(static_cast<Index>(readings.size()))) {
    sigma << Vector3d::Constant(options.force_noise), Vector3d::Constant(options.torque_noise);
    start = VectorXd::Zero(static_cast<Index>(this->entries.size()));
    for (Index i = 0; i < start.size(); ++i) {
      const SensorEntry& e = entry(i);
      start[i] = e.kind == SensorEntry::Mass || (e.kind == SensorEntry::Gain && e.row == e.column) ? 1.0 : 0.0;
    }
  }

  struct Model {
    physics::WrenchSensor sensor;
    double mass = 1.0;
    Vector3d com = Vector3d::Zero();
    Matrix3d R_flange_sensor = Matrix3d::Identity();
  };

  Model model(const VectorXd& x) const {
    Model out;
    Vector3d turn = Vector3d::Zero();
    for (Index i = 0; i < x.size(); ++i) {
      const SensorEntry& e = entry(i);
      switch (e.kind) {
        case SensorEntry::Bias:
          out.sensor.bias[e.row] = x[i];
          break;
        case SensorEntry::Rate:
          out.sensor.rate[e.row] = x[i];
          break;
        case SensorEntry::Mass:
          out.mass = x[i];
          break;
        case SensorEntry::Com:
          out.com[e.row] = x[i];
          break;
        case SensorEntry::Orientation:
          turn[e.row] = x[i];
          break;
        case SensorEntry::Gain:
          out.sensor.gain(e.row, e.column) = x[i];
          break;
      }
    }
    const Vector6 change = (Vector6() << Vector3d::Zero(), turn).finished();
    out.R_flange_sensor = R_nominal_ * to_pose(change).linear();
    return out;
  }

  Vector6 predicted(const Model& model, std::size_t i) const {
    const ForceTorqueReading& reading = readings_[i];
    const Matrix3d R = model.R_flange_sensor.transpose();
    const Vector3d gravity = R * reading.gravity, w = R * reading.angular_velocity,
                   wd = R * reading.angular_acceleration;
    const Vector6 wrench = body_wrench(model.mass, model.com, inertia_, gravity, w, wd) +
                           body_wrench(reading.load_mass, reading.load_com, Matrix3d::Zero(), gravity, w, wd);
    return model.sensor.distorted(wrench, reading.t - middle_);
  }

  VectorXd residuals(const VectorXd& x) const {
    const Model at = model(x);
    VectorXd out(6 * weight.size());
    for (std::size_t i = 0; i < readings_.size(); ++i) {
      const auto k = static_cast<Index>(i);
      out.segment<6>(6 * k) = weight[k] * (predicted(at, i) - readings_[i].wrench).cwiseQuotient(sigma);
    }
    return out;
  }

  MatrixXd jacobian(const VectorXd& x) const {
    MatrixXd out(6 * weight.size(), x.size());
    for (Index i = 0; i < x.size(); ++i) {
      const double h = 1e-5 * entry(i).size;  // the model is a polynomial of low degree but for small rotations
      const VectorXd step = h * VectorXd::Unit(x.size(), i);
      out.col(i) = (residuals(x + step) - residuals(x - step)) / (2 * h);
    }
    return out;
  }

  /// Standard deviation of the expectation of an entry: far beyond what is plausible.
  double expectation(Index i) const { return 10 * entry(i).size; }

  NormalEquations<Eigen::Dynamic> equations(const VectorXd& x) const {
    const VectorXd r = residuals(x);
    const MatrixXd J = jacobian(x);
    NormalEquations<Eigen::Dynamic> out(x.size());
    out.information = J.transpose() * J;
    out.gradient = J.transpose() * r;
    out.cost = r.squaredNorm();
    out.count = static_cast<int>(r.size());
    for (Index i = 0; i < x.size(); ++i)
      out.add(VectorXd::Unit(x.size(), i) / expectation(i), (x[i] - start[i]) / expectation(i));
    return out;
  }

  const SensorEntry& entry(Index i) const { return entries[static_cast<std::size_t>(i)]; }

 private:
  std::span<const ForceTorqueReading> readings_;
  Matrix3d R_nominal_, inertia_;
  double middle_;  ///< Time at which the drift is zero while fitting [s].

 public:
  std::vector<SensorEntry> entries;
  VectorXd weight;  ///< 0 for a reading that is left out, else 1.
  Vector6 sigma;
  VectorXd start;
};

/// Sets the deviations of forces and torques to those of their residuals, each over the degrees of freedom that the
/// estimate leaves them.
void estimate_noise(SensorProblem& problem, const VectorXd& x) {
  const VectorXd r = problem.residuals(x);
  const MatrixXd J = problem.jacobian(x);
  MatrixXd information = J.transpose() * J;
  for (Index i = 0; i < x.size(); ++i) information(i, i) += 1 / std::pow(problem.expectation(i), 2);
  const MatrixXd solved = information.ldlt().solve(J.transpose());
  for (const Index group : {0, 3}) {
    double squares = 0.0, freedom = 0.0;
    for (Index i = 0; i < problem.weight.size(); ++i)
      for (Index c = 6 * i + group; c < 6 * i + group + 3; ++c) {
        squares += r[c] * r[c];
        freedom += problem.weight[i] - J.row(c).dot(solved.col(c));
      }
    if (freedom < 1) continue;  // as given
    constexpr double least = 1e-6;
    problem.sigma.segment<3>(group) *= std::max(std::sqrt(squares / freedom), least);
  }
}

/// Leaves out the readings whose residual is far beyond that of the others; whether any changed.
bool leave_out(SensorProblem& problem, const VectorXd& x) {
  constexpr double chance = 1e-6;
  const Index n = problem.weight.size();
  const VectorXd before = problem.weight;
  problem.weight.setOnes();
  const VectorXd r = problem.residuals(x);
  std::vector<double> sizes;
  for (Index i = 0; i < n; ++i) sizes.push_back(r.segment<6>(6 * i).squaredNorm());
  const double scale = std::max(median(sizes) / uncertainty::chi_square_quantile(0.5, 6), 1.0);
  const double limit = scale * uncertainty::chi_square_quantile(1 - chance, 6);
  for (Index i = 0; i < n; ++i) problem.weight[i] = sizes[static_cast<std::size_t>(i)] > limit ? 0.0 : 1.0;
  return problem.weight != before;
}

/// Components whose residuals grow with time.
void warn_of_drift(ForceTorqueResult& out, std::span<const ForceTorqueReading> readings, const SensorProblem& problem,
                   const VectorXd& residuals) {
  const Index n = problem.weight.size();
  const VectorXd t = VectorXd::NullaryExpr(n, [&](Index i) { return readings[static_cast<std::size_t>(i)].t; });
  const VectorXd about = problem.weight.cwiseProduct((t.array() - t.mean()).matrix());
  if (!(about.squaredNorm() > 0)) return;
  constexpr double clear = 4.5;
  for (Index c = 0; c < 6; ++c) {
    double slope = 0.0;
    for (Index i = 0; i < n; ++i) slope -= about[i] * residuals[6 * i + c];
    slope /= about.squaredNorm();
    if (std::abs(slope) * about.norm() > clear)
      out.warnings.push_back(std::string(components[static_cast<std::size_t>(c)]) + " drifts by " +
                             short_number(slope * problem.sigma[c]) + (c < 3 ? " N/s" : " N m/s") +
                             ": estimate the drift (fit_drift)");
  }
}

std::string joined_names(const std::vector<std::string>& names) {
  std::string out;
  for (const std::string& name : names) out += (out.empty() ? "" : ", ") + name;
  return out;
}

void check_wrench_readings(std::span<const ForceTorqueReading> readings) {
  require(!readings.empty(), "readings: none");
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const std::string at = "readings: row " + std::to_string(i) + ": ";
    const ForceTorqueReading& r = readings[i];
    require(r.wrench.allFinite(), at + "wrench is not finite [N, N m]");
    require(r.gravity.allFinite() && r.angular_velocity.allFinite() && r.angular_acceleration.allFinite(),
            at + "gravity, angular_velocity and angular_acceleration must be finite");
    require(std::isfinite(r.t), at + "t is not finite [s]");
    require(r.load_mass >= 0 && std::isfinite(r.load_mass) && r.load_com.allFinite(),
            at + "load_mass must not be negative [kg], load_com finite [m]");
  }
}

/// What the result holds besides parameters with their deviations.
void set_estimates(ForceTorqueResult& out, const SensorProblem& problem, const VectorXd& x, double middle) {
  const SensorProblem::Model model = problem.model(x);
  out.rate = model.sensor.rate;
  out.bias = model.sensor.bias - middle * model.sensor.rate;
  out.gain = model.sensor.gain;
  out.mass = model.mass;
  out.com = model.com;
  out.T_flange_sensor.linear() = model.R_flange_sensor;
  out.force_noise = problem.sigma[0];
  out.torque_noise = problem.sigma[3];
  out.predicted.resize(problem.weight.size(), 6);
  for (Index i = 0; i < problem.weight.size(); ++i) {
    out.predicted.row(i) = problem.predicted(model, static_cast<std::size_t>(i)).transpose();
    if (problem.weight[i] == 0) out.outliers.push_back(static_cast<int>(i));
  }
}

/// Parameters with their deviations; the names of those that the readings do not tell.
std::vector<std::string> set_parameters(ForceTorqueResult& out, const SensorProblem& problem, const VectorXd& x,
                                        double middle) {
  const NormalEquations<Eigen::Dynamic> at = problem.equations(x);
  const MatrixXd information = at.information.selfadjointView<Eigen::Lower>();
  out.covariance = information.ldlt().solve(MatrixXd::Identity(x.size(), x.size()));
  MatrixXd to_start = MatrixXd::Identity(x.size(), x.size());  // the bias at t = 0, from that at the middle
  const auto n = static_cast<Index>(problem.entries.size());
  std::vector<std::string> untold;
  for (Index i = 0; i < n; ++i)
    if (!(std::sqrt(out.covariance(i, i)) < problem.entry(i).size)) untold.push_back(problem.entry(i).name);
  for (Index i = 0; i < n; ++i)
    for (Index k = 0; k < n; ++k)
      if (problem.entry(i).kind == SensorEntry::Bias && problem.entry(k).kind == SensorEntry::Rate &&
          problem.entry(i).row == problem.entry(k).row)
        to_start(i, k) = -middle;
  const VectorXd values = to_start * x;
  out.covariance = (to_start * out.covariance * to_start.transpose()).eval();
  for (Index i = 0; i < n; ++i) {
    const SensorEntry& e = problem.entry(i);
    const bool told = std::find(untold.begin(), untold.end(), e.name) == untold.end();
    out.parameters.push_back({e.name, e.unit, values[i], std::sqrt(out.covariance(i, i)), told});
  }
  return untold;
}

}  // namespace

ForceTorqueResult identify_force_torque(std::span<const ForceTorqueReading> readings,
                                        const ForceTorqueOptions& options) {
  options.validate();
  check_wrench_readings(readings);
  const auto [first, last] =
      std::minmax_element(readings.begin(), readings.end(), [](const auto& a, const auto& b) { return a.t < b.t; });
  const double duration = last->t - first->t, middle = (last->t + first->t) / 2;
  require(!options.fit_drift || duration > 0, "fit_drift: needs readings at different times, t [s]");
  SensorProblem problem(readings, options, entries_of(options, duration), middle);
  ForceTorqueResult out;
  out.T_flange_sensor = options.T_flange_sensor;
  VectorXd x = problem.start;
  bool converged = false;
  constexpr int rounds = 4;
  for (int round = 0; round < rounds; ++round) {
    const auto found = levenberg_marquardt<Eigen::Dynamic>(x, problem, {.max_iterations = 100, .sigma = 1.0});
    x = found.x;
    converged = found.usable();
    out.fit.iterations += found.iterations;
    if (round == 0)
      out.fit.initial_rms = std::sqrt(problem.residuals(problem.start).squaredNorm() /
                                      (6.0 * static_cast<double>(problem.weight.size())));
    if (round + 1 == rounds) break;
    estimate_noise(problem, x);
    leave_out(problem, x);
  }
  const std::vector<std::string> untold = set_parameters(out, problem, x, middle);
  set_estimates(out, problem, x, middle);
  const VectorXd residuals = problem.residuals(x);
  out.fit.final_rms = std::sqrt(residuals.squaredNorm() / (6.0 * problem.weight.sum()));
  if (!options.fit_drift) warn_of_drift(out, readings, problem, residuals);
  if (!untold.empty()) {
    out.fit.message = "the readings do not determine " + joined_names(untold) +
                      ": turn the sensor so that gravity points along each of its axes, both ways" +
                      (options.gain == GainModel::None ? "" : ", without and with known loads at several places");
    return out;
  }
  if (out.mass < 0 || 3 * out.outliers.size() > readings.size()) {
    out.fit.message = out.mass < 0 ? "the tool has a negative mass: the wrench is that on the tool, not on the sensor, "
                                     "or gravity or orientation are reversed"
                                   : std::to_string(out.outliers.size()) + " of " + std::to_string(readings.size()) +
                                         " readings contradict the others: did the tool touch something?";
    return out;
  }
  out.fit.status = converged ? FitStatus::Converged : FitStatus::MaxIterations;
  out.fit.message = converged ? "converged" : "stopped at the limit of iterations";
  return out;
}

namespace {

void check_rows(const cell::Cell& cell, const Rows& q, const Rows& wrench, const VectorXd& t, bool timed) {
  require(q.cols() == cell.robot.joints(), "q: expected " + std::to_string(cell.robot.joints()) +
                                               " joint values a row, found " + std::to_string(q.cols()));
  require(wrench.cols() == 6, "wrench: expected 6 columns, found " + std::to_string(wrench.cols()));
  require(wrench.rows() == q.rows(),
          "wrench: expected " + std::to_string(q.rows()) + " rows, found " + std::to_string(wrench.rows()));
  require((t.size() == 0 && !timed) || t.size() == q.rows(),
          "t: expected " + std::to_string(q.rows()) + " times, found " + std::to_string(t.size()));
}

}  // namespace

std::vector<ForceTorqueReading> posture_readings(const cell::Cell& cell, const Rows& q, const Rows& wrench,
                                                 const VectorXd& t) {
  check_rows(cell, q, wrench, t, false);
  const kinematics::DhChain chain = cell::nominal_chain(cell);
  std::vector<ForceTorqueReading> out(static_cast<std::size_t>(q.rows()));
  for (Index i = 0; i < q.rows(); ++i) {
    ForceTorqueReading& reading = out[static_cast<std::size_t>(i)];
    reading.wrench = wrench.row(i).transpose();
    reading.gravity = chain.flange(q.row(i).transpose()).linear().transpose() * cell.robot.gravity;
    if (t.size() > 0) reading.t = t[i];
  }
  return out;
}

std::vector<ForceTorqueReading> motion_readings(const cell::Cell& cell, const VectorXd& t, const Rows& command,
                                                const Rows& wrench) {
  check_rows(cell, command, wrench, t, true);
  require(cell.servo && !cell.servo->joint.empty(), "servo.joint: this cell has no joint servo");
  require(cell.tool.has_value(), "tool: this cell has none");
  const std::vector<cell::SecondOrder> servos = physics::joint_servos(cell);
  const Index n = command.rows(), joints = command.cols();
  MatrixXd q(n, joints), qd(n, joints), qdd(n, joints);
  for (Index j = 0; j < joints; ++j) {
    const auto axis = physics::follow_smooth(servos[static_cast<std::size_t>(j)], t, command.col(j));
    q.col(j) = axis.col(0), qd.col(j) = axis.col(1), qdd.col(j) = axis.col(2);
  }
  const kinematics::DhChain chain = cell::nominal_chain(cell);
  std::vector<ForceTorqueReading> out = posture_readings(cell, q, wrench, t);
  constexpr double h = 1e-4;  // [s]: differences of a parabola through the instant, to 1e-8 of the accelerations
  for (Index i = 0; i < n; ++i) {
    const auto pose_at = [&](double s) {
      const VectorXd at = q.row(i) + s * qd.row(i) + 0.5 * s * s * qdd.row(i);
      return Pose(chain.flange(at) * cell.tool->T_flange_sensor);
    };
    const Pose before = pose_at(-h), now = pose_at(0.0), after = pose_at(h);
    const Matrix3d R_flange_sensor = cell.tool->T_flange_sensor.linear();
    const Matrix3d to_flange = R_flange_sensor * now.linear().transpose();
    const auto turn = [&](const Pose& to) { return Vector3d(to_vector(Pose(now.inverse() * to)).tail<3>()); };
    ForceTorqueReading& reading = out[static_cast<std::size_t>(i)];
    reading.gravity -= to_flange * (after.translation() - 2 * now.translation() + before.translation()) / (h * h);
    reading.angular_velocity = R_flange_sensor * (turn(after) - turn(before)) / (2 * h);
    reading.angular_acceleration = R_flange_sensor * (turn(after) + turn(before)) / (h * h);
  }
  return out;
}

}  // namespace kr5::identification
