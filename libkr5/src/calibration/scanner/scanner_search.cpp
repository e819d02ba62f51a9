// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/scanner/scanner_search.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Dense>
#include <kr5/core/levenberg_marquardt.hpp>
#include <kr5/core/linear.hpp>

namespace kr5::calibration::scanner_problem {
namespace {

constexpr int rotations = 32;          // all over: neighbours are some 60 degrees apart
constexpr int rounds = 25;             // of one search
constexpr std::size_t most_used = 60;  // profiles; more tell no better in which valley a start lies
constexpr std::size_t most_poses = 6;
constexpr double apart_position = 2e-3, apart_rotation = 0.02;  // of poses that count as two [m, rad]

/// Rotation i of a set that covers all of them evenly (Alexa 2022, super-Fibonacci spirals).
Eigen::Matrix3d spread_rotation(int i) {
  const double s = i + 0.5, share = s / rotations, turn = 2 * std::numbers::pi * s;
  const double a = turn / std::numbers::sqrt2, b = turn / 1.533751168755204288;
  const double near = std::sqrt(share), far = std::sqrt(1 - share);
  return Eigen::Quaterniond(far * std::cos(b), near * std::sin(a), near * std::cos(a), far * std::sin(b))
      .toRotationMatrix();
}

/// A tip or the middle of an arc in the scanner; the centre of the sphere lies beside the profile by `beside`.
struct SeenPoint {
  std::size_t view = 0, target = 0;
  Eigen::Vector3d in_profile = Eigen::Vector3d::Zero();
  double beside = 0.0;  ///< [m]

  Eigen::Vector3d on_side(double side) const { return in_profile + side * beside * Eigen::Vector3d::UnitY(); }
};

std::vector<SeenPoint> seen_points(const ScannerInput& input) {
  std::vector<SeenPoint> all;
  for (std::size_t i = 0; i < input.views.size(); ++i) {
    const ScanTarget& target = input.target(i);
    const ProfileFeature& feature = input.views[i].feature;
    if (target.kind == ScanTargetKind::Plane) continue;
    SeenPoint& point = all.emplace_back(SeenPoint{i, input.target_of[i], in_scanner(feature.points.col(0)), 0.0});
    if (target.kind == ScanTargetKind::Sphere && target.radius > feature.radius)
      point.beside = std::sqrt(target.radius * target.radius - feature.radius * feature.radius);
  }
  if (all.size() <= most_used) return all;
  std::vector<SeenPoint> some;
  for (std::size_t k = 0; k < most_used; ++k) some.push_back(all[k * all.size() / most_used]);
  return some;
}

/// Scanner and targets, in which the centre of a sphere goes to the side of each profile where it lies at the moment.
class PlaceProblem {
 public:
  using Equations = NormalEquations<Eigen::Dynamic>;

  struct State {
    Pose T = Pose::Identity();  ///< T_flange_scanner
    Eigen::VectorXd places;     ///< Of the unknown targets, three numbers each.
  };

  PlaceProblem(const ScannerInput& input, const std::vector<SeenPoint>& points)
      : input_(input), points_(points), first_(input.targets.size(), -1) {
    for (const SeenPoint& point : points)
      if (!input.targets[point.target].position && first_[point.target] < 0)
        first_[point.target] = unknown_, unknown_ += 3;
  }

  State moved(const State& from, const Eigen::VectorXd& step) const {
    return {from.T * to_pose(Vector6(step.head<6>())), from.places + step.tail(unknown_)};
  }

  Equations equations(const State& state) const {
    Equations out(6 + unknown_);
    Eigen::MatrixXd J(3, 6 + unknown_);
    for (const SeenPoint& point : points_) {
      const Pose& T = input_.T_base_flange[point.view];
      const Eigen::Index first = first_[point.target];
      const Eigen::Vector3d place =
          first >= 0 ? Eigen::Vector3d(state.places.segment<3>(first)) : *input_.targets[point.target].position;
      const Eigen::Vector3d at = (T * state.T).inverse() * place;
      const Eigen::Vector3d r = at - point.on_side(std::copysign(1.0, at.y()));
      J.setZero();
      J.leftCols<3>() = -Eigen::Matrix3d::Identity();
      J.middleCols<3>(3) = skew(at);
      if (first >= 0) J.middleCols<3>(6 + first) = (T.linear() * state.T.linear()).transpose();
      for (Eigen::Index k = 0; k < 3; ++k) out.add(J.row(k).transpose(), r[k]);
    }
    return out;
  }

  /// Places of scanner and targets for a rotation, by linear least squares, with all centres on one side.
  State placed(const Eigen::Matrix3d& rotation, double side) const {
    constexpr double open = 1e-3;  // share of its own sensitivity that a direction keeps
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(3 + unknown_, 3 + unknown_), A(3, 3 + unknown_);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(3 + unknown_);
    for (const SeenPoint& point : points_) {
      const Pose& T = input_.T_base_flange[point.view];
      Eigen::Vector3d b = -(T * Eigen::Vector3d(rotation * point.on_side(side)));
      A.setZero();
      A.leftCols<3>() = T.linear();
      if (first_[point.target] >= 0)
        A.middleCols<3>(3 + first_[point.target]) = -Eigen::Matrix3d::Identity();
      else
        b += *input_.targets[point.target].position;
      H += A.transpose() * A, g += A.transpose() * b;
    }
    const Eigen::VectorXd x = covariance_of(H, open) * g;
    State out;
    out.T.linear() = rotation, out.T.translation() = x.head<3>();
    out.places = x.tail(unknown_);
    return out;
  }

 private:
  const ScannerInput& input_;
  const std::vector<SeenPoint>& points_;
  std::vector<Eigen::Index> first_;  ///< By target, of its place; -1: known or not seen.
  Eigen::Index unknown_ = 0;
};

/// RMS misfit [m] and pose where the search from a rotation ends.
std::pair<double, Pose> search_from(const PlaceProblem& problem, int rotation, double side, std::size_t points) {
  const auto end =
      levenberg_marquardt<Eigen::Dynamic>(problem.placed(spread_rotation(rotation), side), problem,
                                          {.max_iterations = rounds, .tolerance = 0.03, .initial_damping = 1e-3});
  return {std::sqrt(end.equations.cost / static_cast<double>(points)), end.x.T};
}

}  // namespace

std::vector<Pose> searched_poses(const ScannerInput& input) {
  const std::vector<SeenPoint> points = seen_points(input);
  if (points.size() < 4) return {};
  const PlaceProblem problem(input, points);
  const bool sides = std::any_of(points.begin(), points.end(), [](const SeenPoint& p) { return p.beside > 0; });
  std::vector<std::pair<double, Pose>> found;
  for (int i = 0; i < rotations; ++i) {
    found.push_back(search_from(problem, i, 1.0, points.size()));
    if (sides) found.push_back(search_from(problem, i, -1.0, points.size()));
  }
  std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Pose> out;
  for (const auto& one : found) {
    const Pose& T = one.second;  // Clang 14 captures no structured binding
    const auto near = [&](const Pose& other) {
      const Vector6 d = pose_difference(other, T);
      return d.head<3>().norm() < apart_position && d.tail<3>().norm() < apart_rotation;
    };
    if (std::any_of(out.begin(), out.end(), near)) continue;
    out.push_back(T);
    if (out.size() == most_poses) break;
  }
  return out;
}

}  // namespace kr5::calibration::scanner_problem
