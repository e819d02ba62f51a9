// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/scanner/scanner_start.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Dense>
#include <kr5/core/linear.hpp>
#include <kr5/core/random.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/geometry/pose.hpp>

namespace kr5::calibration::scanner_problem {
namespace {

constexpr int random_subsets = 60, plane_normals = 250, plane_candidates = 6, robust_rounds = 4;
constexpr double min_eigenvalue = 1e-9;  // of scaled normal equations; below, the direction is left at zero

/// Linear equations in the columns r_x, r_z and t of the scanner's pose, followed by the unknown places of targets.
struct LinearSystem {
  Eigen::MatrixXd A;  ///< Rows x unknowns.
  Eigen::VectorXd b;
  std::vector<std::size_t> view;  ///< Of each row.
};

/// Rows of the coefficients of R (x, 0, z) + t, carried by M.
Eigen::MatrixXd pose_rows(const Eigen::MatrixXd& M, const Eigen::Vector2d& point) {
  Eigen::MatrixXd out(M.rows(), 9);
  out << point.x() * M, point.y() * M, M;
  return out;
}

bool has_known_place(const ScanTarget& target) { return target.position.has_value(); }

/// Tips, centres of arcs (which lie beside the profile by less than the radius) and points on known planes.
LinearSystem closed_form_system(const ScannerInput& input) {
  std::vector<Eigen::Index> column(input.targets.size(), -1);
  Eigen::Index unknowns = 9;
  for (std::size_t k = 0; k < input.targets.size(); ++k)
    if (input.targets[k].kind != ScanTargetKind::Plane && !has_known_place(input.targets[k]))
      column[k] = unknowns, unknowns += 3;
  LinearSystem out;
  std::vector<Eigen::RowVectorXd> rows;
  std::vector<double> right;
  for (std::size_t i = 0; i < input.views.size(); ++i) {
    const ScanTarget& target = input.target(i);
    const Pose& T = input.T_base_flange[i];
    const ProfileFeature& feature = input.views[i].feature;
    if (target.kind == ScanTargetKind::Plane && !has_known_place(target)) continue;
    for (Eigen::Index p = 0; p < feature.points.cols(); ++p) {
      Eigen::MatrixXd M = T.linear();
      Eigen::VectorXd there = has_known_place(target) ? Eigen::VectorXd(*target.position - T.translation())
                                                      : Eigen::VectorXd(-T.translation());
      if (target.kind == ScanTargetKind::Plane) {
        M = (target.normal->transpose() * M).eval();
        there = (target.normal->transpose() * there).eval();
      }
      const Eigen::MatrixXd of_pose = pose_rows(M, feature.points.col(p));
      for (Eigen::Index r = 0; r < M.rows(); ++r) {
        Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(unknowns);
        row.head<9>() = of_pose.row(r);
        if (column[input.target_of[i]] >= 0) row[column[input.target_of[i]] + r] = -1.0;
        rows.push_back(std::move(row));
        right.push_back(there[r]);
        out.view.push_back(i);
      }
    }
  }
  out.A.resize(static_cast<Eigen::Index>(rows.size()), unknowns);
  for (std::size_t r = 0; r < rows.size(); ++r) out.A.row(static_cast<Eigen::Index>(r)) = rows[r];
  out.b = Eigen::Map<const Eigen::VectorXd>(right.data(), static_cast<Eigen::Index>(right.size()));
  return out;
}

/// Weighted least squares; what the rows leave open is zero.
Eigen::VectorXd solve_linear(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& weights) {
  const Eigen::MatrixXd H = A.transpose() * weights.asDiagonal() * A;
  const Eigen::VectorXd g = A.transpose() * weights.asDiagonal() * b;
  const Eigen::VectorXd scale = H.diagonal().unaryExpr([](double d) { return d > 0 ? 1 / std::sqrt(d) : 0.0; });
  const SymmetricEigen eigen = symmetric_eigen(Eigen::MatrixXd(scale.asDiagonal() * H * scale.asDiagonal()));
  const Eigen::VectorXd inverse = eigen.values.unaryExpr([](double v) { return v > min_eigenvalue ? 1 / v : 0.0; });
  return scale.asDiagonal() * eigen.vectors *
         inverse.cwiseProduct(eigen.vectors.transpose() * scale.cwiseProduct(g)).eval();
}

/// The rotation nearest to two columns, X and Z.
Eigen::Matrix3d rotation_from_axes(const Eigen::Vector3d& x, const Eigen::Vector3d& z) {
  Eigen::Matrix3d M;
  M << x, z.cross(x), z;
  return nearest_rotation(M);
}

Pose pose_of_unknowns(const Eigen::VectorXd& unknowns) {
  Pose out = Pose::Identity();
  out.linear() = rotation_from_axes(unknowns.head<3>(), unknowns.segment<3>(3));
  out.translation() = unknowns.segment<3>(6);
  return out;
}

/// Weights that follow the residuals of rows (Cauchy), with the scale of their median.
void reweigh(const Eigen::VectorXd& residuals, Eigen::VectorXd& weights) {
  std::vector<double> sizes;
  for (const double r : residuals) sizes.push_back(std::abs(r));
  const double scale = std::max(2 * mad_to_sigma * median(sizes), 1e-9);
  weights = residuals.unaryExpr([&](double r) { return 1 / (1 + r * r / (scale * scale)); });
}

/// The pose by robust least squares of the given rows.
Eigen::VectorXd robust_linear(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(b.size()), x;
  for (int round = 0; round < robust_rounds; ++round) {
    x = solve_linear(A, b, weights);
    reweigh(A * x - b, weights);
  }
  return solve_linear(A, b, weights);
}

/// Closed form of all rows, robust, and of random views, of which some hold no outlier.
void add_closed_forms(const ScannerInput& input, std::vector<Pose>& out) {
  const LinearSystem system = closed_form_system(input);
  if (system.A.rows() < 9) return;
  out.push_back(pose_of_unknowns(robust_linear(system.A, system.b)));
  const auto views = static_cast<int>(input.views.size());
  const int wanted = static_cast<int>(system.A.cols()) / 3 + 3;
  if (views < wanted + 4) return;
  Random random(1);
  Pose best = out.back();
  double least = median_distance(input, best);
  for (int trial = 0; trial < random_subsets; ++trial) {
    std::vector<bool> chosen(input.views.size(), false);
    for (int k = 0; k < wanted; ++k) chosen[static_cast<std::size_t>(random.integer(views))] = true;
    Eigen::VectorXd weights(system.b.size());
    for (Eigen::Index r = 0; r < weights.size(); ++r)
      weights[r] = chosen[system.view[static_cast<std::size_t>(r)]] ? 1.0 : 0.0;
    const Pose T = pose_of_unknowns(solve_linear(system.A, system.b, weights));
    const double distance = median_distance(input, T);
    if (distance < least) least = distance, best = T;
  }
  out.push_back(best);
}

/// The unknown plane that most profiles show: for each of its normals the rest is linear.
void add_plane_search(const ScannerInput& input, std::vector<Pose>& out) {
  std::vector<int> count(input.targets.size(), 0);
  for (std::size_t i = 0; i < input.views.size(); ++i)
    if (input.target(i).kind == ScanTargetKind::Plane && !has_known_place(input.target(i))) ++count[input.target_of[i]];
  const auto plane = static_cast<std::size_t>(std::max_element(count.begin(), count.end()) - count.begin());
  if (count[plane] < 5) return;
  std::vector<std::pair<double, Pose>> found;
  for (int k = 0; k < plane_normals; ++k) {
    const double z = (k + 0.5) / plane_normals, turn = k * std::numbers::pi * (3 - std::sqrt(5.0));
    const double across = std::sqrt(1 - z * z);
    const Eigen::RowVector3d normal(across * std::cos(turn), across * std::sin(turn), z);
    Eigen::MatrixXd A(2 * count[plane], 10);
    Eigen::VectorXd b(A.rows());
    Eigen::Index row = 0;
    for (std::size_t i = 0; i < input.views.size(); ++i) {
      if (input.target_of[i] != plane) continue;
      const Pose& T = input.T_base_flange[i];
      for (Eigen::Index p = 0; p < 2; ++p, ++row) {
        A.row(row) << pose_rows(normal * T.linear(), input.views[i].feature.points.col(p)), -1.0;
        b[row] = -normal.dot(T.translation());
      }
    }
    // The axes have unit length and are normal to each other: what is left after that is the cost.
    const Pose axes = pose_of_unknowns(robust_linear(A, b));
    Eigen::MatrixXd rest(A.rows(), 4);
    rest << A.rightCols<4>();
    const Eigen::VectorXd left = b - A.leftCols<3>() * axes.linear().col(0) - A.middleCols<3>(3) * axes.linear().col(2);
    const Eigen::VectorXd place = robust_linear(rest, left);
    std::vector<double> sizes;
    for (const double r : Eigen::VectorXd(rest * place - left)) sizes.push_back(std::abs(r));
    Pose T = axes;
    T.translation() = place.head<3>();
    found.emplace_back(median(sizes), T);
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (int k = 0; k < plane_candidates; ++k) out.push_back(found[static_cast<std::size_t>(k)].second);
}

double component_median(const std::vector<Eigen::Vector3d>& points, int axis) {
  std::vector<double> values;
  for (const Eigen::Vector3d& p : points) values.push_back(p[axis]);
  return median(values);
}

/// Plane of points by least squares, with weights that follow the residuals.
Pose plane_of_points(const std::vector<Eigen::Vector3d>& points) {
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(points.size()));
  Pose out = Pose::Identity();
  for (int round = 0; round < robust_rounds; ++round) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (std::size_t k = 0; k < points.size(); ++k)
      mean += weights[static_cast<Eigen::Index>(k)] / weights.sum() * points[k];
    for (std::size_t k = 0; k < points.size(); ++k)
      spread += weights[static_cast<Eigen::Index>(k)] * (points[k] - mean) * (points[k] - mean).transpose();
    const Eigen::Vector3d normal = symmetric_eigen(spread).vectors.col(0);
    out.linear() = rotation_from_z(normal.z() < 0 ? Eigen::Vector3d(-normal) : normal);
    out.translation() = mean;
    Eigen::VectorXd off(weights.size());
    for (std::size_t k = 0; k < points.size(); ++k) off[static_cast<Eigen::Index>(k)] = normal.dot(points[k] - mean);
    reweigh(off, weights);
  }
  return out;
}

}  // namespace

ScannerPlacement place_targets(const ScannerInput& input, const Pose& T_flange_scanner) {
  ScannerPlacement out;
  out.T_flange_scanner = T_flange_scanner;
  for (std::size_t k = 0; k < input.targets.size(); ++k) {
    const ScanTarget& target = input.targets[k];
    TargetPlacement& at = out.targets.emplace_back();
    std::vector<Eigen::Vector3d> shown;
    double largest = 0.0;
    for (std::size_t i = 0; i < input.views.size(); ++i) {
      if (input.target_of[i] != k) continue;
      const ProfileFeature& feature = input.views[i].feature;
      for (Eigen::Index p = 0; p < feature.points.cols(); ++p)
        shown.emplace_back(input.T_base_flange[i] * T_flange_scanner * in_scanner(feature.points.col(p)));
      largest = std::max(largest, feature.radius);
    }
    at.radius = target.radius > 0 ? target.radius : largest;  // the section through the centre is the largest
    if (target.kind == ScanTargetKind::Plane) {
      at.T_base_plane = plane_of_points(shown);
      if (target.position) {
        at.T_base_plane.linear() = rotation_from_z(*target.normal);
        at.T_base_plane.translation() = *target.position;
      }
      at.position = at.T_base_plane.translation();
    } else {
      at.position = target.position ? *target.position
                                    : Eigen::Vector3d(component_median(shown, 0), component_median(shown, 1),
                                                      component_median(shown, 2));
    }
  }
  return out;
}

double median_distance(const ScannerInput& input, const Pose& T_flange_scanner) {
  const ScannerPlacement placement = place_targets(input, T_flange_scanner);
  std::vector<double> out;
  for (std::size_t i = 0; i < input.views.size(); ++i) {
    const TargetPlacement& target = placement.targets[input.target_of[i]];
    const ProfileFeature& feature = input.views[i].feature;
    const Pose T = input.T_base_flange[i] * T_flange_scanner;
    if (feature.kind == ScanTargetKind::Plane) {
      const Eigen::Vector3d normal = target.T_base_plane.linear().col(2);
      double most = 0.0;
      for (Eigen::Index p = 0; p < 2; ++p)
        most = std::max(most, std::abs(normal.dot(T * in_scanner(feature.points.col(p)) - target.position)));
      out.push_back(most);
    } else {
      out.push_back((T * in_scanner(feature.points.col(0)) - target.position).norm());
    }
  }
  return median(out);
}

std::vector<Pose> scanner_starts(const ScannerInput& input) {
  std::vector<Pose> out;
  add_closed_forms(input, out);
  add_plane_search(input, out);
  if (input.options.T_flange_scanner) out.push_back(*input.options.T_flange_scanner);
  if (out.empty()) out.push_back(Pose::Identity());
  return out;
}

std::optional<AxisScales> axis_scales(const ScannerInput& input, const std::vector<double>& weights) {
  for (const ScannerView& view : input.views)
    if (view.feature.kind == ScanTargetKind::Sphere) return std::nullopt;  // their centres lie beside the profiles
  const LinearSystem system = closed_form_system(input);
  const auto dof = static_cast<double>(system.A.rows() - system.A.cols());
  if (dof < 6) return std::nullopt;
  Eigen::VectorXd by_row(system.b.size());
  for (Eigen::Index r = 0; r < by_row.size(); ++r) by_row[r] = weights[system.view[static_cast<std::size_t>(r)]];
  const Eigen::MatrixXd H = system.A.transpose() * by_row.asDiagonal() * system.A;
  const Eigen::LDLT<Eigen::MatrixXd> factors(H);
  if (!(factors.vectorD().minCoeff() > 1e-12 * factors.vectorD().maxCoeff())) return std::nullopt;
  const Eigen::VectorXd x = factors.solve(system.A.transpose() * by_row.asDiagonal() * system.b);
  const double variance = by_row.dot((system.A * x - system.b).cwiseAbs2()) / dof;
  const Eigen::MatrixXd covariance = variance * factors.solve(Eigen::MatrixXd::Identity(H.rows(), H.cols()));
  AxisScales out;
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector3d axis = x.segment<3>(3 * k);
    out.scale[k] = axis.norm();
    out.std[k] = std::sqrt(axis.normalized().dot(covariance.block<3, 3>(3 * k, 3 * k) * axis.normalized()));
  }
  return out;
}

}  // namespace kr5::calibration::scanner_problem
