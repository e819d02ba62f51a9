// SPDX-License-Identifier: BSD-3-Clause
#include "vision/markers/marker_map_adjustment.hpp"

#include <algorithm>
#include <limits>

#include <Eigen/Cholesky>

namespace kr5::vision {
namespace {

using Vector8 = Eigen::Matrix<double, 8, 1>;
using Matrix86 = Eigen::Matrix<double, 8, 6>;

/// Place of a marker in the vector of unknowns; -1 for the reference.
int column_of_marker(const MapProblem& p, int marker) {
  return marker == p.reference ? -1 : 6 * (marker - (marker > p.reference ? 1 : 0));
}
int column_of_camera(const MapProblem& p, int image) { return 6 * (p.markers - 1 + image); }

double cost_of(const MapProblem& p, const MapState& state) {
  double cost = 0;
  Vector8 r;
  for (const Sighting& s : p.sightings) {
    if (!map_residual(p, s, state, r, nullptr, nullptr)) return std::numeric_limits<double>::infinity();
    cost += r.squaredNorm();
  }
  return cost;
}

void normal_equations(const MapProblem& p, const MapState& state, Eigen::MatrixXd& A, Eigen::VectorXd& g) {
  A.setZero();
  g.setZero();
  Vector8 r;
  Matrix86 J, K;
  for (const Sighting& s : p.sightings) {
    map_residual(p, s, state, r, &J, &K);
    const int m = column_of_marker(p, s.marker), c = column_of_camera(p, s.image);
    A.block<6, 6>(c, c) += K.transpose() * K;
    g.segment<6>(c) += K.transpose() * r;
    if (m < 0) continue;
    A.block<6, 6>(m, m) += J.transpose() * J;
    A.block<6, 6>(c, m) += K.transpose() * J;  // lower half: images stand below markers
    g.segment<6>(m) += J.transpose() * r;
  }
}

MapState moved(const MapProblem& p, MapState state, const Eigen::VectorXd& step) {
  for (int m = 0; m < p.markers; ++m)
    if (m != p.reference)
      state.T_map_marker[static_cast<std::size_t>(m)] =
          state.T_map_marker[static_cast<std::size_t>(m)] * to_pose(step.segment<6>(column_of_marker(p, m)));
  for (int i = 0; i < p.images; ++i)
    state.T_camera_map[static_cast<std::size_t>(i)] =
        state.T_camera_map[static_cast<std::size_t>(i)] * to_pose(step.segment<6>(column_of_camera(p, i)));
  return state;
}

}  // namespace

bool map_residual(const MapProblem& p, const Sighting& s, const MapState& state, Vector8& r, Matrix86* by_marker,
                  Matrix86* by_camera) {
  const Pose& T_map_marker = state.T_map_marker[static_cast<std::size_t>(s.marker)];
  const Pose& T_camera_map = state.T_camera_map[static_cast<std::size_t>(s.image)];
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector3d in_map = T_map_marker * p.square.col(k), in_camera = T_camera_map * in_map;
    if (!(in_camera.z() > 1e-6)) return false;
    Eigen::Matrix<double, 2, 3> P;
    r.segment<2>(2 * k) = s.corners.col(k) - p.camera.project(in_camera, &P, nullptr);
    if (by_camera) {
      const Eigen::Matrix<double, 2, 3> Q = P * T_camera_map.linear();
      by_camera->block<2, 3>(2 * k, 0) = Q;
      by_camera->block<2, 3>(2 * k, 3) = -Q * skew(in_map);
      by_marker->block<2, 3>(2 * k, 0) = Q * T_map_marker.linear();
      by_marker->block<2, 3>(2 * k, 3) = -by_marker->block<2, 3>(2 * k, 0) * skew(p.square.col(k));
    }
  }
  return true;
}

MapSolution adjust_map(const MapProblem& p, MapState& state, int max_iterations) {
  const int n = 6 * (p.markers - 1 + p.images);
  MapSolution solution;
  Eigen::MatrixXd A(n, n);
  Eigen::VectorXd g(n);
  double damping = 1e-4;
  solution.cost = cost_of(p, state);
  normal_equations(p, state, A, g);
  while (solution.iterations < max_iterations && !solution.converged && damping < 1e8) {
    ++solution.iterations;
    Eigen::MatrixXd B = A;
    B.diagonal() *= 1 + damping;
    const Eigen::VectorXd step = B.selfadjointView<Eigen::Lower>().ldlt().solve(g);
    MapState next = moved(p, state, step);
    const double cost = cost_of(p, next);
    if (!(cost <= solution.cost)) {
      solution.converged = step.cwiseAbs().maxCoeff() < 1e-10;
      damping *= 10;
      continue;
    }
    solution.converged = solution.cost - cost < 1e-10 * cost || step.cwiseAbs().maxCoeff() < 1e-10;
    state = std::move(next);
    solution.cost = cost;
    damping = std::max(damping / 10, 1e-12);
    normal_equations(p, state, A, g);
  }
  solution.information = A.selfadjointView<Eigen::Lower>();
  return solution;
}

}  // namespace kr5::vision
