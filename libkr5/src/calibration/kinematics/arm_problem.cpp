// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/kinematics/arm_problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <kr5/core/error.hpp>
#include <kr5/core/statistics.hpp>

#include "calibration/cell_fit/arm_prior.hpp"
#include "calibration/hand_eye/closed_form.hpp"

namespace kr5::calibration::arm_problem {
namespace {

bool point_seen(const Eigen::Vector3d& point) { return point.allFinite(); }

std::vector<std::string> joint_term_names(const kinematics::DhChain& arm) {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < arm.joints.size(); ++i)
    if (arm.joints[i].type == kinematics::JointType::Revolute)
      for (const char* term : {"sin", "cos", "sin2", "cos2"})
        out.push_back("joint" + std::to_string(i + 1) + "." + term + " [rad]");
  return out;
}

/// Rotation and shift that carry points to others, in the sense of least squares.
Pose rigid_motion(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to) {
  const Eigen::Vector3d a = from.rowwise().mean(), b = to.rowwise().mean();
  Pose T = Pose::Identity();
  T.linear() = nearest_rotation((to.colwise() - b) * (from.colwise() - a).transpose());
  T.translation() = b - T.linear() * a;
  return T;
}

/// Placement for a first guess of where the first seen point of a posture sits on the flange.
Placement from_points(const Input& input, const Eigen::Vector3d& guess) {
  std::vector<Eigen::Vector3d> from, to;
  for (const ArmPosture& posture : input.postures)
    for (Eigen::Index c = 0; c < posture.points.cols(); ++c)
      if (point_seen(posture.points.col(c))) {
        from.push_back(input.nominal.flange(posture.q) * guess);
        to.push_back(posture.points.col(c));
        break;
      }
  Placement out;
  const auto as_matrix = [](const std::vector<Eigen::Vector3d>& points) {
    return Eigen::Matrix3Xd(
        Eigen::Map<const Eigen::Matrix3Xd>(points.front().data(), 3, static_cast<Eigen::Index>(points.size())));
  };
  out.T_world_base =
      input.options.T_world_base ? *input.options.T_world_base : rigid_motion(as_matrix(from), as_matrix(to));
  return out;
}

/// Points on the flange as the placement of the base implies them: medians over the postures.
void points_from_base(const Input& input, Placement& placement) {
  for (Eigen::Index c = 0; c < input.markers(); ++c) {
    std::vector<double> axis[3];
    for (const ArmPosture& posture : input.postures) {
      if (c >= posture.points.cols() || !point_seen(posture.points.col(c))) continue;
      const Eigen::Vector3d p =
          (placement.T_world_base * input.nominal.flange(posture.q)).inverse() * Eigen::Vector3d(posture.points.col(c));
      for (int k = 0; k < 3; ++k) axis[k].push_back(p[k]);
    }
    if (!axis[0].empty()) placement.points.col(c) << median(axis[0]), median(axis[1]), median(axis[2]);
  }
}

/// Tip and sockets by linear least squares: R_k tip + p_k = socket.
void place_sockets(const Input& input, Placement& placement) {
  const auto sockets = static_cast<Eigen::Index>(input.socket_names.size());
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(3 + 3 * sockets, 3 + 3 * sockets);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(3 + 3 * sockets);
  for (const ArmPosture& posture : input.postures) {
    if (posture.socket.empty()) continue;
    const Pose T = input.nominal.flange(posture.q);
    Eigen::MatrixXd row = Eigen::MatrixXd::Zero(3, A.cols());
    row.leftCols<3>() = T.linear();
    row.middleCols<3>(3 + 3 * static_cast<Eigen::Index>(input.socket(posture.socket))) = -Eigen::Matrix3d::Identity();
    A += row.transpose() * row;
    b -= row.transpose() * T.translation();
  }
  A.diagonal().array() += 1e-9;
  const Eigen::VectorXd x = A.ldlt().solve(b);
  placement.points.col(0) = x.head<3>();
  placement.sockets = Eigen::Map<const Eigen::Matrix3Xd>(x.data() + 3, 3, sockets);
}

void place_poses(const Input& input, Placement& placement) {
  std::vector<Pose> flange, world_in_tool;
  for (const ArmPosture& posture : input.postures) {
    if (!posture.T_world_tool) continue;
    flange.push_back(input.nominal.flange(posture.q));
    world_in_tool.push_back(posture.T_world_tool->inverse());
  }
  const ClosedForm found = closed_form(flange, world_in_tool, Mount::EyeInHand);
  placement.T_flange_tool = found.X;
  placement.T_world_base = found.Z.inverse();
}

double robust_cost(const ArmProblem& problem) {
  std::vector<double> squares;
  for (const auto& of_posture : problem.observations)
    for (const FitObservation o : of_posture) squares.push_back(problem.fit.residuals(o).squaredNorm());
  return median(squares);
}

}  // namespace

bool Input::any_pose() const {
  return std::any_of(postures.begin(), postures.end(), [](const ArmPosture& p) { return p.T_world_tool.has_value(); });
}

bool Input::any_point() const {
  return std::any_of(postures.begin(), postures.end(), [](const ArmPosture& p) { return p.points.cols() > 0; });
}

int Input::markers() const {
  Eigen::Index out = socket_names.empty() ? 0 : 1;
  for (const ArmPosture& posture : postures) out = std::max(out, posture.points.cols());
  return static_cast<int>(out);
}

std::size_t Input::socket(const std::string& name) const {
  const auto at = std::find(socket_names.begin(), socket_names.end(), name);
  require(at != socket_names.end(), "socket '" + name + "': no posture rests in it");
  return static_cast<std::size_t>(at - socket_names.begin());
}

Eigen::RowVector4d joint_error_basis(double q) {
  return {std::sin(q), std::cos(q) - 1, std::sin(2 * q), std::cos(2 * q) - 1};
}

Eigen::MatrixXd joint_error_regressor(const kinematics::DhChain& arm, const Eigen::VectorXd& q) {
  std::vector<Eigen::Index> revolute;
  for (std::size_t i = 0; i < arm.joints.size(); ++i)
    if (arm.joints[i].type == kinematics::JointType::Revolute) revolute.push_back(static_cast<Eigen::Index>(i));
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(q.size(), static_cast<Eigen::Index>(4 * revolute.size()));
  for (std::size_t k = 0; k < revolute.size(); ++k)
    out.block<1, 4>(revolute[k], static_cast<Eigen::Index>(4 * k)) = joint_error_basis(q[revolute[k]]);
  return out;
}

ArmProblem::ArmProblem(const Input& input, const Sigmas& sigmas, const Placement& placement, bool refine) {
  arm = fit.add_arm("arm", input.nominal);
  if (refine) {
    cell_fit::free_arm(fit, arm, input.nominal, sigmas.length, sigmas.angle);
    for (const std::string& name : input.options.hold)
      require(fit.hold(name),
              "hold: found '" + name + "', expected e.g. arm.joint2.a (b, theta_offset, a, alpha, beta)");
    const std::vector<std::string> names = joint_term_names(input.nominal);
    if (input.options.joint_errors && !names.empty()) {
      const auto count = static_cast<Eigen::Index>(names.size());
      joint_terms = fit.add_vector("joint_errors", Eigen::VectorXd::Zero(count), names);
      fit.set_prior(joint_terms, Eigen::VectorXd::Constant(count, sigmas.joint));
    }
  } else {
    fit.hold(arm);
  }
  if (input.any_pose() || input.any_point()) base = fit.add_pose("base", placement.T_world_base);
  if (base.exists() && input.options.T_world_base) fit.hold(base);
  if (input.any_pose()) tool = fit.add_pose("tool", placement.T_flange_tool);
  if (tool.exists() && input.options.T_flange_tool) fit.hold(tool);
  for (Eigen::Index c = 0; c < placement.points.cols(); ++c)
    points.push_back(fit.add_point("point" + std::to_string(c + 1), placement.points.col(c)));
  for (std::size_t s = 0; s < input.socket_names.size(); ++s)
    sockets.push_back(
        fit.add_point("socket." + input.socket_names[s], placement.sockets.col(static_cast<Eigen::Index>(s))));
  for (const ArmPosture& posture : input.postures) {
    std::vector<FitObservation>& mine = observations.emplace_back();
    const Eigen::MatrixXd regressor =
        joint_terms.exists() ? joint_error_regressor(input.nominal, posture.q) : Eigen::MatrixXd();
    PoseChain chain;
    if (base.exists()) chain.then(base);
    chain.then_arm(arm, posture.q, joint_terms, regressor);
    if (posture.T_world_tool)
      mine.push_back(
          fit.observe_pose(PoseChain(chain).then(tool), *posture.T_world_tool, sigmas.position, sigmas.rotation));
    for (Eigen::Index c = 0; c < posture.points.cols(); ++c)
      if (point_seen(posture.points.col(c)))
        mine.push_back(fit.observe_position(chain, points[static_cast<std::size_t>(c)],
                                            Eigen::Vector3d(posture.points.col(c)), sigmas.position));
    if (!posture.socket.empty())
      mine.push_back(fit.observe_position(PoseChain().then_arm(arm, posture.q, joint_terms, regressor), points.front(),
                                          sockets[input.socket(posture.socket)], sigmas.position));
  }
  for (const SocketDistance& d : input.distances)
    fit.observe_distance({}, sockets[input.socket(d.first)], sockets[input.socket(d.second)], d.distance, d.sigma);
}

void ArmProblem::begin_at(const ArmProblem& other) {
  fit.begin_at(arm, other.fit.values(other.arm));
  const auto take = [&](FitBlock mine, FitBlock theirs) {
    if (mine.exists() && theirs.exists()) fit.begin_at(mine, other.fit.values(theirs));
  };
  take(base, other.base), take(tool, other.tool), take(joint_terms, other.joint_terms);
  for (std::size_t k = 0; k < points.size(); ++k) take(points[k], other.points[k]);
  for (std::size_t k = 0; k < sockets.size(); ++k) take(sockets[k], other.sockets[k]);
}

void ArmProblem::set_weights(const std::vector<double>& weights) {
  for (std::size_t i = 0; i < observations.size(); ++i)
    for (const FitObservation o : observations[i]) fit.set_weight(o, weights[i]);
}

Placement ArmProblem::placement() const {
  Placement out;
  if (base.exists()) out.T_world_base = fit.pose(base);
  if (tool.exists()) out.T_flange_tool = fit.pose(tool);
  out.points.resize(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t k = 0; k < points.size(); ++k) out.points.col(static_cast<Eigen::Index>(k)) = fit.values(points[k]);
  out.sockets.resize(3, static_cast<Eigen::Index>(sockets.size()));
  for (std::size_t k = 0; k < sockets.size(); ++k)
    out.sockets.col(static_cast<Eigen::Index>(k)) = fit.values(sockets[k]);
  return out;
}

void robust_sigmas(const ArmProblem& problem, Sigmas& sigmas) {
  std::vector<double> position, rotation;
  for (const auto& of_posture : problem.observations)
    for (const FitObservation o : of_posture) {
      const Eigen::VectorXd r = problem.fit.residuals(o);
      for (Eigen::Index k = 0; k < r.size(); ++k) (k < 3 ? position : rotation).push_back(std::abs(r[k]));
    }
  if (!position.empty()) sigmas.position *= std::max(mad_to_sigma * median(position), 1e-6);
  if (!rotation.empty()) sigmas.rotation *= std::max(mad_to_sigma * median(rotation), 1e-6);
}

Placement place(const Input& input, Sigmas& sigmas) {
  std::vector<Placement> starts;
  if (input.any_pose()) {
    place_poses(input, starts.emplace_back());
  } else if (input.any_point()) {
    constexpr double lever = 0.2;  // a tool as long as that is found, too
    starts.push_back(from_points(input, Eigen::Vector3d::Zero()));
    for (int axis = 0; axis < 3; ++axis)
      for (const double side : {-lever, lever})
        starts.push_back(from_points(input, side * Eigen::Vector3d::Unit(axis)));
  } else {
    starts.emplace_back();
  }
  Placement best;
  double least = std::numeric_limits<double>::infinity();
  for (Placement& start : starts) {
    if (input.options.T_world_base) start.T_world_base = *input.options.T_world_base;
    if (input.options.T_flange_tool) start.T_flange_tool = *input.options.T_flange_tool;
    start.points.setZero(3, input.markers());
    if (input.any_point()) points_from_base(input, start);
    if (!input.socket_names.empty()) place_sockets(input, start);
    Sigmas own;
    ArmProblem problem(input, own, start, false);
    const bool anything =
        !(input.options.T_world_base && (input.options.T_flange_tool || !input.any_pose())) || !problem.points.empty();
    if (anything) problem.fit.solve({.loss = 2.0});
    const double cost = robust_cost(problem);
    if (!(cost < least)) continue;
    least = cost;
    best = problem.placement();
    robust_sigmas(problem, own);
    sigmas.position = own.position, sigmas.rotation = own.rotation;
  }
  return best;
}

}  // namespace kr5::calibration::arm_problem
