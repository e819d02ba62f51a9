// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/fit/problem.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <kr5/core/error.hpp>

#include "fit/ceres_solver.hpp"
#include "fit/linearisation.hpp"

namespace kr5::fit {

void SolveOptions::validate() const {
  require(max_iterations >= 1, "max_iterations must be at least 1");
  require(loss >= 0 && std::isfinite(loss), "loss must not be negative [-]; 0: least squares");
  require(loss == 0 || !uncertainty, "uncertainty: the covariance holds for least squares only; set loss to 0");
  require(rank_tolerance > 0 && rank_tolerance < 1, "rank_tolerance must lie between 0 and 1 [-]");
  require(cost_tolerance > 0 && cost_tolerance < 1, "cost_tolerance must lie between 0 and 1 [-]");
}

Problem::Problem() : data_(std::make_unique<ProblemData>()) {}
Problem::~Problem() = default;
Problem::Problem(Problem&&) noexcept = default;
Problem& Problem::operator=(Problem&&) noexcept = default;

FitBlock Problem::add_pose(const std::string& name, const Pose& start) { return data_->keep(pose_block(name, start)); }
FitBlock Problem::add_nuisance_pose(const std::string& name, const Pose& start) {
  Block block = pose_block(name, start);
  block.nuisance = true;
  return data_->keep(std::move(block));
}
FitBlock Problem::add_nuisance_vector(const std::string& name, const Eigen::VectorXd& start,
                                      const std::vector<std::string>& coordinates) {
  Block block = vector_block(name, start, coordinates);
  block.nuisance = true;
  return data_->keep(std::move(block));
}
FitBlock Problem::add_arm(const std::string& name, const kinematics::DhChain& start) {
  return data_->keep(arm_block(name, start));
}
FitBlock Problem::add_point(const std::string& name, const Eigen::Vector3d& start) {
  return data_->keep(point_block(name, start));
}
FitBlock Problem::add_vector(const std::string& name, const Eigen::VectorXd& start,
                             const std::vector<std::string>& coordinates) {
  return data_->keep(vector_block(name, start, coordinates));
}
FitBlock Problem::add_camera(const std::string& name, const Pinhole& start) {
  return data_->keep(camera_block(name, start));
}

void Problem::hold(FitBlock block, int coordinate) {
  Block& b = data_->block(block);
  require(!b.nuisance, b.name + " is a nuisance: leave it out instead");
  require(coordinate >= -1 && coordinate < b.size(), b.name + ": there is no coordinate " + std::to_string(coordinate));
  for (int i = 0; i < b.size(); ++i)
    if (coordinate < 0 || i == coordinate) b.hold(i);
}

void Problem::tie(FitBlock block, int leader, int follower, double ratio) {
  Block& b = data_->block(block);
  require(b.kind != BlockKind::Pose && !b.nuisance, b.name + ": coordinates of a pose or a nuisance cannot be tied");
  for (const int i : {leader, follower})
    require(i >= 0 && i < b.size() && !b.held[static_cast<std::size_t>(i)],
            b.name + ": there is no free coordinate " + std::to_string(i));
  require(leader != follower, b.name + ": a coordinate cannot be tied to itself");
  require(std::isfinite(ratio) && ratio != 0, b.name + ": the ratio of tied coordinates must be finite and not 0");
  const int from = b.leader[static_cast<std::size_t>(follower)], to = b.leader[static_cast<std::size_t>(leader)];
  require(from != to, b.name + ": the coordinates are tied already");
  const double by_leader = ratio * b.ratio[leader] / b.ratio[follower];
  for (std::size_t i = 0; i < b.leader.size(); ++i)
    if (b.leader[i] == from) b.leader[i] = to, b.ratio[static_cast<Eigen::Index>(i)] *= by_leader;
  data_->forget();
}

bool Problem::any_free() const {
  for (const StoredMeasurement& e : data_->entries)
    for (const int b : e.blocks) {
      const Block& block = data_->blocks[static_cast<std::size_t>(b)];
      if (e.weight > 0 && !block.nuisance && !block.free().empty()) return true;
    }
  return false;
}

bool Problem::hold(const std::string& name) {
  for (Block& b : data_->blocks) {
    if (b.name == name && !b.nuisance) {
      std::fill(b.held.begin(), b.held.end(), true);
      return true;
    }
    for (std::size_t i = 0; i < b.coordinates.size() && !b.nuisance; ++i)
      if (b.coordinates[i].full_name() == name) {
        b.hold(static_cast<int>(i));
        return true;
      }
  }
  return false;
}

void Problem::set_prior(FitBlock block, const Eigen::VectorXd& sigma) {
  Block& b = data_->block(block);
  require(sigma.size() == b.size(), b.name + ": expected " + std::to_string(b.size()) + " standard deviations, found " +
                                        std::to_string(sigma.size()));
  require(!sigma.hasNaN() && (sigma.array() > 0).all(), b.name + ": standard deviations must be positive");
  b.prior = sigma;
}

void Problem::begin_at(FitBlock block, const Eigen::VectorXd& values) {
  Block& b = data_->block(block);
  require(values.size() == b.values.size() && values.allFinite(),
          b.name + ": expected " + std::to_string(b.values.size()) + " finite values");
  b.values = values;
}

void Problem::begin_at(FitBlock block, const Pose& pose) {
  require(pose.matrix().allFinite() && is_rotation(pose.linear(), 1e-3),
          "Problem: a pose to begin at has no proper rotation");
  from_pose(pose, block_of(data_->blocks, block, BlockKind::Pose, "pose").values.data());
}

void Problem::set_weight(FitMeasurement measurement, double weight) {
  require(weight >= 0 && std::isfinite(weight), "weight must not be negative [-]");
  data_->entry(measurement).weight = weight;
}

FitMeasurement Problem::add(std::unique_ptr<Measurement> measurement) { return data_->keep(std::move(measurement)); }

void Problem::set_covariance(FitMeasurement measurement, const Eigen::MatrixXd& covariance) {
  any_measurement(measurement).set_covariance(covariance);
}

Measurement& Problem::any_measurement(FitMeasurement which) { return *data_->entry(which).measurement; }
void Problem::refuse_kind() { throw InvalidArgument("Problem: this measurement is of another kind"); }

Solution Problem::solve(const SolveOptions& options) {
  options.validate();
  data_->free = data_->number_coordinates();
  Solution out;
  out.free_ = data_->free;
  for (const FitCoordinate& coordinate : out.free_.list) out.coordinates.push_back(coordinate.text());
  minimise(*data_, options, out);
  if (options.uncertainty) out.add_uncertainty(*this, options.rank_tolerance);
  return out;
}

Pose Problem::pose(FitBlock block) const { return block_of(data_->blocks, block, BlockKind::Pose, "pose").pose(); }
kinematics::DhChain Problem::arm(FitBlock block) const {
  return block_of(data_->blocks, block, BlockKind::Arm, "arm").arm();
}
Pinhole Problem::camera(FitBlock block) const {
  return block_of(data_->blocks, block, BlockKind::Camera, "camera").camera();
}
Eigen::VectorXd Problem::values(FitBlock block) const { return data_->block(block).values; }
Eigen::VectorXd Problem::change(FitBlock block) const { return data_->block(block).change(); }

Eigen::VectorXd Problem::residuals(FitMeasurement measurement) const {
  const StoredMeasurement& e = data_->entry(measurement);
  Eigen::VectorXd r(e.rows);
  if (!data_->evaluate(e, data_->values(e).data(), e.rows, 1.0, r.data(), nullptr))
    r.setConstant(std::numeric_limits<double>::infinity());
  return r;
}

std::optional<MeasurementDerivatives> Problem::derivatives(FitMeasurement measurement, bool condensed) const {
  const StoredMeasurement& e = data_->entry(measurement);
  if (data_->free.places.empty()) data_->free = data_->number_coordinates();
  auto at = linearise(*data_, data_->free, {&e}, condensed, 1.0);
  if (!at) return std::nullopt;
  const auto n = static_cast<Eigen::Index>(data_->free.list.size());
  MeasurementDerivatives out{std::move(at->r), Eigen::MatrixXd::Zero(at->J.rows(), n), std::move(at->N)};
  for (std::size_t k = 0; k < at->index.size(); ++k)  // tied coordinates share a place
    out.by_coordinate.col(at->index[k]) += at->J.col(static_cast<Eigen::Index>(k));
  return out;
}

}  // namespace kr5::fit
