// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/gravity_model.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>
#include <kr5/core/random.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/kinematics/inertial_regressor.hpp>

#include "identification/dynamics/column_grouping.hpp"
#include "identification/dynamics/right_angles.hpp"
#include "identification/dynamics/slow_samples.hpp"
#include "identification/log/residual_correlation.hpp"

namespace kr5::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int moments_per_link = 4;
constexpr double told_tolerance = 1e-4;  // share of a torque by untold directions that rounding may leave

void require_arm_values(const kinematics::DhChain& chain, Index size, const char* what) {
  require(size == static_cast<Index>(chain.joints.size()),
          std::string(what) + ": found " + std::to_string(size) +
              ", expected one a joint: " + std::to_string(chain.joints.size()));
}

/// Torques of a resting arm over m, m cx, m cy, m cz of every link, n x 4n.
class StaticRegressor {
 public:
  StaticRegressor(const kinematics::DhChain& chain, const Eigen::Vector3d& gravity)
      : regressor_(chain, gravity),
        still_(VectorXd::Zero(regressor_.joints())),
        full_(regressor_.joints(), regressor_.parameters()) {}

  MatrixXd operator()(const VectorXd& q) {
    regressor_.evaluate(q, still_, still_, full_);
    const int n = regressor_.joints();
    MatrixXd out(n, moments_per_link * n);
    for (int link = 0; link < n; ++link)
      out.middleCols(moments_per_link * link, moments_per_link) =
          full_.middleCols(kinematics::inertial_parameter_count * link, moments_per_link);
    return out;
  }

 private:
  kinematics::InertialRegressor regressor_;
  VectorXd still_;
  MatrixXd full_;
};

/// Moments come before masses, so that a mass is counted to the moment of the link that carries it.
std::vector<Index> moments_first(Index links) {
  std::vector<Index> out;
  for (Index link = 0; link < links; ++link)
    for (Index axis = 1; axis < moments_per_link; ++axis) out.push_back(moments_per_link * link + axis);
  for (Index link = 0; link < links; ++link) out.push_back(moments_per_link * link);
  return out;
}

/// Which mass moments torques tell, in whatever posture, with the RMS of the torques that a unit of each makes.
ColumnGrouping identifiable_moments(const kinematics::DhChain& chain, const Eigen::Vector3d& gravity, VectorXd& size) {
  const auto n = static_cast<Index>(chain.joints.size());
  const Index postures = 20 * n;
  const ArmInGravity arm = with_right_angles(chain, gravity);
  StaticRegressor regressor(arm.chain, arm.gravity);
  Random random(1);
  MatrixXd A(postures * n, moments_per_link * n);
  for (Index k = 0; k < postures; ++k)
    A.middleRows(k * n, n) = regressor(VectorXd::NullaryExpr(n, [&] { return random.uniform(-M_PI, M_PI); }));
  ColumnGrouping out = grouped_columns(A, moments_first(n));
  size.resize(static_cast<Index>(out.kept.size()));
  for (Index i = 0; i < size.size(); ++i)
    size[i] = A.col(out.kept[static_cast<std::size_t>(i)]).norm() / std::sqrt(static_cast<double>(postures));
  return out;
}

std::string moment_name(Index column) {
  const std::string link = std::to_string(column / moments_per_link + 1);
  constexpr const char* axes[] = {"", "x", "y", "z"};
  const Index axis = column % moments_per_link;
  return axis == 0 ? "m" + link : "m" + link + " c" + link + axes[axis];
}

/// The combination of mass moments of one row, its own first.
std::string combination_name(const MatrixXd& grouping, Index row, Index own) {
  std::string out = moment_name(own);
  for (Index c = 0; c < grouping.cols(); ++c) {
    const double factor = grouping(row, c);
    if (c == own || factor == 0.0) continue;
    char number[32] = "";
    if (std::abs(std::abs(factor) - 1) > 1e-9) std::snprintf(number, sizeof number, "%.6g ", std::abs(factor));
    out += (factor < 0 ? " - " : " + ") + (number + moment_name(c));
  }
  return out;
}

/// Own columns of a parameter in `grouping`: the one that belongs to it alone, with factor 1.
std::vector<Index> own_columns(const MatrixXd& grouping) {
  std::vector<Index> out;
  for (const Index c : moments_first(grouping.cols() / moments_per_link)) {
    const auto next = static_cast<Index>(out.size());
    if (next == grouping.rows()) break;
    const VectorXd column = grouping.col(c);
    if (column[next] == 1.0 && column.cwiseAbs().sum() < 1.0 + 1e-9) out.push_back(c);
  }
  return out;
}

constexpr Index friction_unknowns = 3;  // of a joint: Coulomb, viscous, offset

/// What the torques of one joint say, a row a sample: torque = gravity * moments + friction * friction_unknowns.
struct JointEquations {
  MatrixXd gravity, friction;
  VectorXd tau;
  double weight = 1.0;  // 1 / variance of a row

  Index rows() const { return tau.size(); }
  JointEquations part(Index first, Index count) const {
    return {gravity.middleRows(first, count), friction.middleRows(first, count), tau.segment(first, count), weight};
  }
};

/// Estimates of one set of equations.
struct GravityEstimate {
  VectorXd moments;
  MatrixXd covariance;  // of the moments
  MatrixXd untold;      // directions of the moments
  MatrixXd friction;    // n x friction_unknowns
  VectorXd coulomb_variance;
};

VectorXd gravity_residuals(const JointEquations& e, const GravityEstimate& x, Index joint) {
  return e.tau - e.gravity * x.moments - e.friction * x.friction.row(joint).transpose();
}

/// Least squares; `size` is the scale of a moment, of which the data may tell none.
GravityEstimate solve_gravity(const std::vector<JointEquations>& equations, const VectorXd& size) {
  const auto n = static_cast<Index>(equations.size());
  const Index p = size.size(), all = p + friction_unknowns * n;
  MatrixXd information = MatrixXd::Zero(all, all);
  VectorXd right = VectorXd::Zero(all);
  double rows = 0.0;
  for (Index j = 0; j < n; ++j) {
    const JointEquations& e = equations[static_cast<std::size_t>(j)];
    const Index at = p + friction_unknowns * j;
    information.topLeftCorner(p, p) += e.weight * e.gravity.transpose() * e.gravity;
    information.block(at, 0, friction_unknowns, p) = e.weight * e.friction.transpose() * e.gravity;
    information.block(0, at, p, friction_unknowns) = information.block(at, 0, friction_unknowns, p).transpose();
    information.block(at, at, friction_unknowns, friction_unknowns) = e.weight * e.friction.transpose() * e.friction;
    right.head(p) += e.weight * e.gravity.transpose() * e.tau;
    right.segment(at, friction_unknowns) = e.weight * e.friction.transpose() * e.tau;
    rows += e.weight * static_cast<double>(e.rows());
  }
  VectorXd scale(all);
  for (Index i = 0; i < all; ++i) {
    const double own = std::sqrt(information(i, i));
    const double least = i < p ? 1e-3 * size[i] * std::sqrt(rows) : 0.0;
    scale[i] = own > least ? 1 / own : (least > 0 ? 1 / least : 1.0);
  }
  const SymmetricEigen eigen = symmetric_eigen(MatrixXd(scale.asDiagonal() * information * scale.asDiagonal()));
  constexpr double least = 1e-10;
  const VectorXd inverse = eigen.values.unaryExpr([](double v) { return v > least ? 1 / v : 0.0; });
  const MatrixXd V = scale.asDiagonal() * eigen.vectors;
  const MatrixXd covariance = V * inverse.asDiagonal() * V.transpose();
  const VectorXd x = covariance * right;
  GravityEstimate out;
  out.moments = x.head(p);
  out.covariance = covariance.topLeftCorner(p, p);
  const auto dropped = static_cast<Index>((inverse.array() == 0.0).count());  // eigenvalues rise
  out.untold = MatrixXd(p, 0);
  for (Index i = 0; i < dropped; ++i) {
    const VectorXd direction = V.col(i).head(p);
    if (direction.cwiseQuotient(scale.head(p)).norm() < 1e-6) continue;  // of friction alone
    out.untold.conservativeResize(Eigen::NoChange, out.untold.cols() + 1);
    out.untold.rightCols<1>() = direction;
  }
  out.friction = x.tail(friction_unknowns * n).reshaped<Eigen::RowMajor>(n, friction_unknowns);
  out.coulomb_variance.resize(n);
  for (Index j = 0; j < n; ++j) {
    const Index at = p + friction_unknowns * j;
    out.coulomb_variance[j] = information(at, at) > 0 ? covariance(at, at) : std::numeric_limits<double>::infinity();
  }
  return out;
}

/// Least squares with the weights of the joints from their own residuals.
GravityEstimate solve_weighted_gravity(std::vector<JointEquations>& equations, const VectorXd& size) {
  GravityEstimate out = solve_gravity(equations, size);
  double total = 0.0;
  for (const JointEquations& e : equations) total += static_cast<double>(e.rows());
  for (int round = 0; round < 2; ++round) {  // the second changes weights by little
    for (std::size_t j = 0; j < equations.size(); ++j) {
      JointEquations& e = equations[j];
      if (e.rows() == 0) continue;
      const VectorXd r = gravity_residuals(e, out, static_cast<Index>(j));
      const double rows = static_cast<double>(e.rows());
      const double freedom = rows - friction_unknowns - static_cast<double>(size.size()) * rows / total;
      const double floor = 1e-12 * (1.0 + e.tau.squaredNorm() / rows);
      const double variance = r.squaredNorm() / std::max(freedom, 1.0);
      e.weight = 1 / std::max(variance * fit_autoregression(r).samples_per_independent(), floor);
    }
    out = solve_gravity(equations, size);
  }
  return out;
}

std::vector<JointEquations> equations_of(const std::vector<SlowSamples>& samples, const JointMotion& motion,
                                         StaticRegressor& regressor, const MatrixXd& columns,
                                         const GravityOptions& options) {
  const Index p = columns.cols();
  std::vector<JointEquations> out;
  for (const SlowSamples& s : samples) {
    const auto rows = static_cast<Index>(s.rows.size());
    out.push_back({MatrixXd(rows, p), MatrixXd::Zero(rows, friction_unknowns), VectorXd(rows)});
    for (Index r = 0; r < rows; ++r) {
      const Index k = s.rows[static_cast<std::size_t>(r)];
      out.back().tau[r] = motion.tau(k, s.joint);
      if (!s.resting) out.back().friction(r, 0) = motion.qd(k, s.joint) > 0 ? 1.0 : -1.0;
      if (options.viscous && s.several_speeds) out.back().friction(r, 1) = motion.qd(k, s.joint);
      if (options.offset) out.back().friction(r, 2) = 1.0;
    }
  }
  std::vector<Index> next(samples.size(), 0);  // the postures once, for all joints
  for (Index k = 0; k < motion.samples(); ++k) {
    const auto wants = [&](std::size_t j) {
      return next[j] < out[j].rows() && samples[j].rows[static_cast<std::size_t>(next[j])] == k;
    };
    bool any = false;
    for (std::size_t j = 0; j < out.size(); ++j) any = any || wants(j);
    if (!any) continue;
    const MatrixXd Y = regressor(motion.q.row(k).transpose()) * columns;
    for (std::size_t j = 0; j < out.size(); ++j)
      if (wants(j)) out[j].gravity.row(next[j]++) = Y.row(static_cast<Index>(j));
  }
  return out;
}

/// Errors on what was held out, and the residuals of all.
void judge_gravity(GravityResult& out, const std::vector<JointEquations>& all, const GravityEstimate& final,
                   const GravityEstimate& first, const GravityOptions& options) {
  const auto n = static_cast<Index>(all.size());
  out.residual_rms = out.held_out_rms = out.torque_rms = VectorXd::Zero(n);
  double squares = 0.0, rows = 0.0;
  for (Index j = 0; j < n; ++j) {
    const JointEquations& e = all[static_cast<std::size_t>(j)];
    if (e.rows() == 0) continue;
    const VectorXd r = gravity_residuals(e, final, j);
    out.residual_rms[j] = std::sqrt(r.squaredNorm() / static_cast<double>(e.rows()));
    squares += e.weight * r.squaredNorm();
    rows += static_cast<double>(e.rows());
    const Index held = held_out_count(e.rows(), options.held_out);
    if (held == 0) continue;
    const JointEquations last = e.part(e.rows() - held, held);
    out.held_out_rms[j] = std::sqrt(gravity_residuals(last, first, j).squaredNorm() / static_cast<double>(held));
    out.torque_rms[j] = std::sqrt(last.tau.squaredNorm() / static_cast<double>(held));
  }
  out.fit.final_rms = std::sqrt(squares / std::max(rows, 1.0));
}

void describe_gravity(GravityResult& out, const std::vector<SlowSamples>& samples) {
  for (const SlowSamples& s : samples)
    if (s.rows.empty())
      out.notes.push_back("joint " + std::to_string(s.joint + 1) +
                          " did not move slowly: its own torque, and what depends on its value, are not determined");
  if (out.model.untold.cols() > 0)
    out.notes.push_back(
        std::to_string(out.model.untold.cols()) + " of " + std::to_string(out.model.parameters.size()) +
        " combinations of mass moments are not determined by this motion; the model holds for postures like "
        "those of the motion");
}

}  // namespace

void GravityOptions::validate() const {
  require(gravity.allFinite() && gravity.norm() > 0, "gravity must be finite and not zero [m/s^2]");
  require(min_speed > 0, "min_speed must be positive [rad/s or m/s]");
  require(max_speed > min_speed, "max_speed must be greater than min_speed [rad/s or m/s]");
  require(held_out >= 0 && held_out < 0.9, "held_out must be at least 0 and less than 0.9 [-]");
}

std::vector<CarriedMass> carried_masses(const kinematics::DhChain& chain, std::span<const kinematics::Body> bodies,
                                        const VectorXd& q) {
  require_arm_values(chain, static_cast<Index>(bodies.size()), "bodies");
  const std::vector<Pose> T = chain.link_poses(q);
  std::vector<CarriedMass> out(bodies.size());
  CarriedMass behind;  // about the origin of link i
  for (std::size_t i = bodies.size(); i-- > 0;) {
    const Eigen::Vector3d origin = T[i].translation();
    const Eigen::Vector3d joint = i == 0 ? chain.T_base_0.translation() : T[i - 1].translation();
    const double mass = bodies[i].mass;
    behind.moment += behind.mass * (origin - joint) + mass * (T[i] * bodies[i].com - joint);
    behind.mass += mass;
    out[i] = behind;
  }
  return out;
}

VectorXd holding_torques(const kinematics::DhChain& chain, std::span<const CarriedMass> carried, const VectorXd& q,
                         const Eigen::Vector3d& gravity) {
  require_arm_values(chain, static_cast<Index>(carried.size()), "carried");
  const std::vector<Pose> T = chain.link_poses(q);
  VectorXd out(static_cast<Index>(carried.size()));
  for (std::size_t i = 0; i < carried.size(); ++i) {
    const Eigen::Vector3d axis = (i == 0 ? chain.T_base_0 : T[i - 1]).linear().col(2);
    const bool slides = chain.joints[i].type == kinematics::JointType::Prismatic;
    out[static_cast<Index>(i)] =
        slides ? -carried[i].mass * axis.dot(gravity) : -axis.dot(carried[i].moment.cross(gravity));
  }
  return out;
}

GravityPrediction GravityModel::predict(const VectorXd& q) const {
  require_arm_values(chain, q.size(), "q");
  const std::vector<Index> own = own_columns(grouping);
  const MatrixXd all = StaticRegressor(chain, gravity)(q);
  MatrixXd Y(all.rows(), static_cast<Index>(own.size()));
  for (std::size_t i = 0; i < own.size(); ++i) Y.col(static_cast<Index>(i)) = all.col(own[i]);
  GravityPrediction out{Y * parameters, VectorXd(all.rows())};
  for (Index i = 0; i < Y.rows(); ++i) {
    const double size = Y.row(i).norm();
    bool told = true;
    for (const auto& direction : untold.colwise())
      told = told && std::abs(Y.row(i).dot(direction)) <= told_tolerance * size * direction.norm();
    out.sigma[i] = told ? std::sqrt(std::max(0.0, Y.row(i).dot(covariance * Y.row(i).transpose())))
                        : std::numeric_limits<double>::infinity();
  }
  return out;
}

std::vector<kinematics::Body> GravityModel::bodies(std::span<const kinematics::Body> nominal) const {
  require_arm_values(chain, static_cast<Index>(nominal.size()), "bodies");
  VectorXd moments(grouping.cols());
  for (std::size_t i = 0; i < nominal.size(); ++i)
    moments.segment<moments_per_link>(moments_per_link * static_cast<Index>(i)) << nominal[i].mass,
        nominal[i].mass * nominal[i].com;
  const VectorXd change = parameters - grouping * moments;
  const std::vector<Index> own = own_columns(grouping);
  for (std::size_t i = 0; i < own.size(); ++i) moments[own[i]] += change[static_cast<Index>(i)];
  std::vector<kinematics::Body> out(nominal.begin(), nominal.end());
  for (std::size_t i = 0; i < out.size(); ++i) {
    const auto at = moments.segment<moments_per_link>(moments_per_link * static_cast<Index>(i));
    require(at[0] > 0 || at.tail<3>().norm() < 1e-12,
            "bodies: link " + std::to_string(i + 1) + " has no mass, so no first moment can be given to it [kg]");
    out[i].mass = at[0];
    if (at[0] > 0) out[i].com = at.tail<3>() / at[0];
  }
  return out;
}

namespace {

/// Gravity from samples to which nothing is objected.
GravityResult fit_gravity(const kinematics::DhChain& chain, const JointMotion& motion,
                          const std::vector<SlowSamples>& samples, const GravityOptions& options) {
  GravityResult out;
  VectorXd size;
  const ColumnGrouping group = identifiable_moments(chain, options.gravity, size);
  GravityModel& model = out.model;
  model.chain = chain;
  model.gravity = options.gravity;
  model.grouping = group.combination;
  MatrixXd columns = MatrixXd::Zero(model.grouping.cols(), model.grouping.rows());
  for (Index i = 0; i < columns.cols(); ++i) {
    const Index own = group.kept[static_cast<std::size_t>(i)];
    columns(own, i) = 1.0;
    model.names.push_back(combination_name(model.grouping, i, own));
  }
  StaticRegressor regressor(chain, options.gravity);
  std::vector<JointEquations> all = equations_of(samples, motion, regressor, columns, options);
  std::vector<JointEquations> early;
  for (const JointEquations& e : all) early.push_back(e.part(0, e.rows() - held_out_count(e.rows(), options.held_out)));
  const GravityEstimate first = solve_weighted_gravity(early, size), final = solve_weighted_gravity(all, size);
  model.parameters = final.moments;
  model.covariance = final.covariance;
  model.untold = final.untold;
  out.coulomb = final.friction.col(0);
  out.viscous = final.friction.col(1);
  out.offset = final.friction.col(2);
  out.coulomb_sigma = final.coulomb_variance.cwiseSqrt();
  judge_gravity(out, all, final, first, options);
  describe_gravity(out, samples);
  out.fit.status = FitStatus::Converged;
  out.fit.iterations = 1;
  out.fit.message = samples.front().resting ? "torques at rest fitted" : "torques of slow motion fitted";
  return out;
}

GravityResult refused(std::string problem) {
  GravityResult out;
  out.fit.message = std::move(problem);
  return out;
}

}  // namespace

GravityResult identify_gravity(const kinematics::DhChain& chain, const JointMotion& motion,
                               const GravityOptions& options) {
  options.validate();
  motion.validate();
  require_arm_values(chain, motion.q.cols(), "motion.q");
  const std::vector<SlowSamples> samples = slow_samples(motion, options.min_speed, options.max_speed);
  if (std::string problem = objection(motion, samples, options.held_out); !problem.empty())
    return refused(std::move(problem));
  return fit_gravity(chain, motion, samples, options);
}

GravityResult identify_gravity_at_rest(const kinematics::DhChain& chain, const MatrixXd& q, const MatrixXd& tau,
                                       const GravityOptions& options) {
  options.validate();
  require_arm_values(chain, q.cols(), "q");
  const MatrixXd still = MatrixXd::Zero(q.rows(), q.cols());
  const JointMotion postures{
      VectorXd::LinSpaced(q.rows(), 0.0, static_cast<double>(q.rows() - 1)), q, still, still, tau, {}};
  postures.validate();
  if (std::string problem = objection_to_postures(q.rows(), options.held_out); !problem.empty())
    return refused(std::move(problem));
  return fit_gravity(chain, postures, resting_samples(postures), options);
}

bool are_postures(const MatrixXd& q, bool timed) {
  constexpr double step = 0.05, bend = 0.5;  // [rad or m] of a row; of the change of a step over the step
  require(q.cols() > 0 && q.allFinite(), "q: expected finite values of at least one joint");
  if (q.rows() < 3) return q.rows() > 0;
  const MatrixXd steps = q.bottomRows(q.rows() - 1) - q.topRows(q.rows() - 1);
  const MatrixXd bends = steps.bottomRows(steps.rows() - 1) - steps.topRows(steps.rows() - 1);
  const auto middle = [](const MatrixXd& rows) {
    const VectorXd largest = rows.cwiseAbs().rowwise().maxCoeff();
    return median({largest.begin(), largest.end()});
  };
  return middle(steps) > step && (!timed || middle(bends) > bend * middle(steps));
}

}  // namespace kr5::identification
