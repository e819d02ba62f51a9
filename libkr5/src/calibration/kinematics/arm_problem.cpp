// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/kinematics/arm_problem.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <kr5/core/error.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/fit/measurements/distance.hpp>
#include <kr5/fit/measurements/pixels.hpp>
#include <kr5/fit/measurements/pose.hpp>
#include <kr5/fit/measurements/position.hpp>
#include <kr5/geometry/point_alignment.hpp>

#include "calibration/hand_eye/closed_form.hpp"
#include "calibration/parameters/arm_prior.hpp"

namespace kr5::calibration::arm_problem {
namespace {

bool point_seen(const Eigen::Vector3d& point) { return point.allFinite(); }

/// Without the refinement not every coordinate exists.
void hold_named(ArmProblem& problem, const Input& input, bool refine) {
  for (const std::string& name : input.options.hold)
    require(problem.fit.hold(name) || !refine,
            "hold: found '" + name +
                "', expected e.g. arm.joint2.a (b, theta_offset, a, alpha, beta), tool.x or "
                "base (of what is estimated: base, tool, camera, target)");
}

bool is_revolute(const kinematics::DhJoint& joint) { return joint.type == kinematics::JointType::Revolute; }

/// Names of the coefficients in the order of joint_term_regressor, and the standard deviation of each.
std::vector<std::string> joint_term_names(const Input& input, const Sigmas& sigmas, std::vector<double>& prior) {
  std::vector<std::string> out;
  const auto& joints = input.nominal.joints;
  for (std::size_t i = 0; input.options.joint_errors && i < joints.size(); ++i)
    if (is_revolute(joints[i]))
      for (const char* term : {"sin", "cos", "sin2", "cos2"}) {
        out.push_back("joint" + std::to_string(i + 1) + "." + term + " [rad]");
        prior.push_back(sigmas.joint);
      }
  for (std::size_t i = 0; input.options.elasticity && i < joints.size(); ++i) {
    out.push_back("joint" + std::to_string(i + 1) + ".compliance " +
                  (is_revolute(joints[i]) ? "[rad/(N m)]" : "[m/N]"));
    prior.push_back(sigmas.compliance);
  }
  return out;
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
      input.options.T_world_base ? *input.options.T_world_base : align_points(as_matrix(from), as_matrix(to)).T_to_from;
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
    for (const fit::FitMeasurement o : of_posture) squares.push_back(problem.fit.residuals(o).squaredNorm());
  return squares.empty() ? 0.0 : median(squares);
}

/// A start with what follows from it, or from the options: points, sockets, camera and target.
void complete_start(const Input& input, Placement& start) {
  if (input.options.T_world_base) start.T_world_base = *input.options.T_world_base;
  if (input.options.T_flange_tool) start.T_flange_tool = *input.options.T_flange_tool;
  if (input.options.T_flange_camera) start.T_flange_camera = *input.options.T_flange_camera;
  if (input.options.T_base_target) start.T_base_target = *input.options.T_base_target;
  start.points.setZero(3, input.markers());
  if (input.any_point()) points_from_base(input, start);
  if (!input.socket_names.empty()) place_sockets(input, start);
}

/// The nominal arm placed as well as it allows, in the sense that postures far off count little.
ArmProblem placed(const Input& input, const Placement& start) {
  ArmProblem problem(input, Sigmas{}, start, false);
  if (problem.fit.any_free()) problem.fit.solve({.loss = 2.0, .cost_tolerance = 1e-9, .uncertainty = false});
  return problem;
}

/// Postures spread evenly over all, enough to choose a start by.
std::vector<ArmPosture> some_postures(std::span<const ArmPosture> all, std::size_t most) {
  std::vector<ArmPosture> out;
  for (std::size_t k = 0; k < most; ++k) out.push_back(all[k * all.size() / most]);
  return out;
}

}  // namespace

bool Input::any_pose() const {
  return std::any_of(postures.begin(), postures.end(), [](const ArmPosture& p) { return p.T_world_tool.has_value(); });
}

bool Input::any_point() const {
  return std::any_of(postures.begin(), postures.end(), [](const ArmPosture& p) { return any_seen(p.points); });
}

bool Input::any_view() const {
  return std::any_of(postures.begin(), postures.end(), [](const ArmPosture& p) { return p.pixels.cols() > 0; });
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

Eigen::MatrixXd joint_term_regressor(const Input& input, const ArmPosture& posture) {
  const auto& joints = input.nominal.joints;
  const auto n = static_cast<Eigen::Index>(joints.size());
  const auto revolute = static_cast<Eigen::Index>(std::count_if(joints.begin(), joints.end(), is_revolute));
  const Eigen::Index errors = input.options.joint_errors ? 4 * revolute : 0;
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(n, errors + (input.options.elasticity ? n : 0));
  for (Eigen::Index i = 0, k = 0; i < n && errors > 0; ++i)
    if (is_revolute(joints[static_cast<std::size_t>(i)]))
      out.block<1, 4>(i, k) = joint_error_basis(posture.q[i]), k += 4;
  if (input.options.elasticity) out.rightCols(n) = (-posture.torques).asDiagonal();  // the link gives way to its load
  return out;
}

ArmProblem::ArmProblem(const Input& input, const Sigmas& sigmas, const Placement& placement, bool refine) {
  const KinematicsOptions& options = input.options;
  arm = fit.add_arm("arm", input.nominal);
  if (refine) {
    parameters::free_arm(fit, arm, input.nominal, sigmas.length, sigmas.angle);
    std::vector<double> prior;
    const std::vector<std::string> names = joint_term_names(input, sigmas, prior);
    if (!names.empty()) {
      const auto count = static_cast<Eigen::Index>(names.size());
      joint_terms = fit.add_vector("joint_errors", Eigen::VectorXd::Zero(count), names);
      fit.set_prior(joint_terms, Eigen::Map<const Eigen::VectorXd>(prior.data(), count));
    }
  } else {
    fit.hold(arm);
  }
  if (input.any_pose() || input.any_point()) base = fit.add_pose("base", placement.T_world_base);
  if (base.exists() && options.T_world_base) fit.hold(base);
  if (input.any_pose()) tool = fit.add_pose("tool", options.T_flange_tool.value_or(placement.T_flange_tool));
  if (tool.exists() && options.T_flange_tool) {
    if (options.tolerance_tool > 0) {
      constexpr double any = std::numeric_limits<double>::infinity();
      for (int k = 3; k < 6; ++k) fit.hold(tool, k);
      const double t = options.tolerance_tool;
      fit.set_prior(tool, (Eigen::VectorXd(6) << t, t, t, any, any, any).finished());
    } else {
      fit.hold(tool);
    }
  }
  if (input.any_view()) {
    lens = fit.add_camera("lens", *options.camera);
    fit.hold(lens);
    camera = fit.add_pose("camera", placement.T_flange_camera);
    target = fit.add_pose("target", placement.T_base_target);
  }
  for (Eigen::Index c = 0; c < placement.points.cols(); ++c)
    points.push_back(fit.add_point("point" + std::to_string(c + 1), placement.points.col(c)));
  for (std::size_t s = 0; s < input.socket_names.size(); ++s)
    sockets.push_back(
        fit.add_point("socket." + input.socket_names[s], placement.sockets.col(static_cast<Eigen::Index>(s))));
  hold_named(*this, input, refine);
  for (const ArmPosture& posture : input.postures) observe_posture(input, posture, sigmas);
  for (const SocketDistance& d : input.distances)
    distances.push_back(fit.add(fit::DistanceMeasurement({}, sockets[input.socket(d.first)],
                                                         sockets[input.socket(d.second)], d.distance, d.sigma)));
}

void ArmProblem::observe_posture(const Input& input, const ArmPosture& posture, const Sigmas& sigmas) {
  std::vector<fit::FitMeasurement>& mine = observations.emplace_back();
  const Eigen::MatrixXd regressor = joint_terms.exists() ? joint_term_regressor(input, posture) : Eigen::MatrixXd();
  fit::PoseChain chain;
  if (base.exists()) chain.then(base);
  chain.then_arm(arm, posture.q, joint_terms, regressor);
  if (posture.T_world_tool)
    mine.push_back(fit.add(fit::PoseMeasurement(fit::PoseChain(chain).then(tool), *posture.T_world_tool,
                                                sigmas.position, sigmas.rotation)));
  for (Eigen::Index c = 0; c < posture.points.cols(); ++c)
    if (point_seen(posture.points.col(c)))
      mine.push_back(fit.add(fit::PositionMeasurement(chain, points[static_cast<std::size_t>(c)],
                                                      Eigen::Vector3d(posture.points.col(c)), sigmas.position)));
  if (!posture.socket.empty())
    mine.push_back(
        fit.add(fit::PositionMeasurement(fit::PoseChain().then_arm(arm, posture.q, joint_terms, regressor),
                                         points.front(), sockets[input.socket(posture.socket)], sigmas.position)));
  std::vector<fit::FitMeasurement>& seen = views.emplace_back();
  if (posture.pixels.cols() > 0)
    seen.push_back(fit.add(fit::PixelMeasurement(
        fit::PoseChain().then_inverse(camera).then_inverse_arm(arm, posture.q, joint_terms, regressor).then(target),
        lens, posture.target_points, posture.pixels, sigmas.pixel)));
}

std::vector<fit::FitMeasurement> ArmProblem::of_posture(std::size_t i) const {
  std::vector<fit::FitMeasurement> out = observations[i];
  out.insert(out.end(), views[i].begin(), views[i].end());
  return out;
}

void ArmProblem::begin_at(const ArmProblem& other) {
  fit.begin_at(arm, other.fit.values(other.arm));
  const auto take = [&](fit::FitBlock mine, fit::FitBlock theirs) {
    if (mine.exists() && theirs.exists()) fit.begin_at(mine, other.fit.values(theirs));
  };
  take(base, other.base), take(tool, other.tool), take(joint_terms, other.joint_terms);
  take(camera, other.camera), take(target, other.target);
  for (std::size_t k = 0; k < points.size(); ++k) take(points[k], other.points[k]);
  for (std::size_t k = 0; k < sockets.size(); ++k) take(sockets[k], other.sockets[k]);
}

void ArmProblem::set_weights(const std::vector<double>& weights) {
  for (std::size_t i = 0; i < observations.size(); ++i)
    for (const fit::FitMeasurement o : of_posture(i)) fit.set_weight(o, weights[i]);
}

Placement ArmProblem::placement() const {
  Placement out;
  if (base.exists()) out.T_world_base = fit.pose(base);
  if (tool.exists()) out.T_flange_tool = fit.pose(tool);
  if (camera.exists()) out.T_flange_camera = fit.pose(camera), out.T_base_target = fit.pose(target);
  out.points.resize(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t k = 0; k < points.size(); ++k) out.points.col(static_cast<Eigen::Index>(k)) = fit.values(points[k]);
  out.sockets.resize(3, static_cast<Eigen::Index>(sockets.size()));
  for (std::size_t k = 0; k < sockets.size(); ++k)
    out.sockets.col(static_cast<Eigen::Index>(k)) = fit.values(sockets[k]);
  return out;
}

void robust_sigmas(const ArmProblem& problem, Sigmas& sigmas) {
  std::vector<double> position, rotation, pixel;
  for (const auto& of_view : problem.views)
    for (const fit::FitMeasurement o : of_view)
      for (const double r : problem.fit.residuals(o)) pixel.push_back(std::abs(r));
  if (!pixel.empty()) sigmas.pixel *= std::max(mad_to_sigma * median(pixel), 1e-6);
  for (const auto& of_posture : problem.observations)
    for (const fit::FitMeasurement o : of_posture) {
      const Eigen::VectorXd r = problem.fit.residuals(o);
      for (Eigen::Index k = 0; k < r.size(); ++k) (k < 3 ? position : rotation).push_back(std::abs(r[k]));
    }
  if (!position.empty()) sigmas.position *= std::max(mad_to_sigma * median(position), 1e-6);
  if (!rotation.empty()) sigmas.rotation *= std::max(mad_to_sigma * median(rotation), 1e-6);
}

std::vector<Placement> starts(const Input& input) {
  std::vector<Placement> out;
  if (input.any_pose()) {
    place_poses(input, out.emplace_back());
  } else if (input.any_point()) {
    constexpr double lever = 0.2;  // a tool as long as that is found, too
    out.push_back(from_points(input, Eigen::Vector3d::Zero()));
    for (int axis = 0; axis < 3; ++axis)
      for (const double side : {-lever, lever}) out.push_back(from_points(input, side * Eigen::Vector3d::Unit(axis)));
  } else {
    out.emplace_back();
  }
  for (Placement& start : out) complete_start(input, start);
  return out;
}

fit::pipeline::Minimum<Placement> descend(const Input& input, Placement start) {
  constexpr std::size_t enough = 100;
  const bool many = input.postures.size() > 2 * enough && input.socket_names.empty();
  const std::vector<ArmPosture> some = many ? some_postures(input.postures, enough) : std::vector<ArmPosture>{};
  const Input few{input.nominal, many ? std::span<const ArmPosture>(some) : input.postures, input.distances,
                  input.options, input.socket_names};
  if (many) complete_start(few, start);
  const ArmProblem problem = placed(few, start);
  fit::pipeline::Minimum<Placement> out{problem.placement(), robust_cost(problem)};
  if (many) {
    out.at.points.setZero(3, input.markers());
    points_from_base(input, out.at);
  }
  return out;
}

Placement place_at(const Input& input, const Placement& start, Sigmas& sigmas) {
  const ArmProblem problem = placed(input, start);
  Sigmas own;
  robust_sigmas(problem, own);
  sigmas.position = own.position, sigmas.rotation = own.rotation, sigmas.pixel = own.pixel;
  return problem.placement();
}

}  // namespace kr5::calibration::arm_problem
