// SPDX-License-Identifier: BSD-3-Clause
#include "fit/ceres_solver.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <memory>

#include <ceres/ceres.h>
#include <kr5/geometry/pose_derivatives.hpp>

namespace kr5::fit {
namespace {

/// Poses as Ceres stores and moves them. Derivatives are handed over by coordinate, in the first columns of the stored
/// numbers, so that the derivative of plus() is the identity above a row of zeros.
class PoseManifold final : public ceres::Manifold {
 public:
  explicit PoseManifold(std::vector<int> free) : free_(std::move(free)) {}
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return static_cast<int>(free_.size()); }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    Vector6 d = Vector6::Zero();
    for (std::size_t k = 0; k < free_.size(); ++k) d[free_[k]] = delta[k];
    from_pose(to_pose_block(x) * to_pose(d), x_plus_delta);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<RowMatrix> J(jacobian, 7, TangentSize());
    J.setZero();
    for (std::size_t k = 0; k < free_.size(); ++k) J(free_[k], static_cast<Eigen::Index>(k)) = 1.0;
    return true;
  }
  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    const Vector6 d = pose_difference(to_pose_block(x), to_pose_block(y));
    for (std::size_t k = 0; k < free_.size(); ++k) y_minus_x[k] = d[free_[k]];
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<RowMatrix> J(jacobian, TangentSize(), 7);
    J.setZero();
    for (std::size_t k = 0; k < free_.size(); ++k) J(static_cast<Eigen::Index>(k), free_[k]) = 1.0;
    return true;
  }

 private:
  std::vector<int> free_;
};

/// Numbers of which some are held and some follow others.
class VectorManifold final : public ceres::Manifold {
 public:
  explicit VectorManifold(const Block& block)
      : place_(static_cast<std::size_t>(block.size()), -1), free_(block.free()), ratio_(block.ratio) {
    for (std::size_t i = 0; i < place_.size(); ++i) {
      const auto at = std::find(free_.begin(), free_.end(), block.leader[i]);
      if (at != free_.end()) place_[i] = static_cast<int>(at - free_.begin());
    }
  }
  int AmbientSize() const override { return static_cast<int>(place_.size()); }
  int TangentSize() const override { return static_cast<int>(free_.size()); }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    for (std::size_t i = 0; i < place_.size(); ++i)
      x_plus_delta[i] = x[i] + (place_[i] < 0 ? 0.0 : ratio_[static_cast<Eigen::Index>(i)] * delta[place_[i]]);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<RowMatrix> J(jacobian, AmbientSize(), TangentSize());
    J.setZero();
    for (std::size_t i = 0; i < place_.size(); ++i)
      if (place_[i] >= 0) J(static_cast<Eigen::Index>(i), place_[i]) = ratio_[static_cast<Eigen::Index>(i)];
    return true;
  }
  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    for (std::size_t k = 0; k < free_.size(); ++k) y_minus_x[k] = y[free_[k]] - x[free_[k]];
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<RowMatrix> J(jacobian, TangentSize(), AmbientSize());
    J.setZero();
    for (std::size_t k = 0; k < free_.size(); ++k) J(static_cast<Eigen::Index>(k), free_[k]) = 1.0;
    return true;
  }

 private:
  std::vector<int> place_;  ///< By number, among the free ones; -1: held.
  std::vector<int> free_;
  Eigen::VectorXd ratio_;
};

/// A measurement as Ceres sees it.
class MeasurementCost final : public ceres::CostFunction {
 public:
  MeasurementCost(const ProblemData& data, const StoredMeasurement& entry) : data_(data), entry_(entry) {
    set_num_residuals(data.condensed_rows(entry));
    for (const int b : entry.blocks)
      mutable_parameter_block_sizes()->push_back(
          static_cast<int>(data.blocks[static_cast<std::size_t>(b)].values.size()));
  }
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    return data_.evaluate(entry_, parameters, num_residuals(), entry_.weight, residuals, jacobians);
  }

 private:
  const ProblemData& data_;
  const StoredMeasurement& entry_;
};

/// What is known of a block before: its change from the start over the prior's standard deviation.
class PriorCost final : public ceres::CostFunction {
 public:
  explicit PriorCost(const Block& block) : block_(block) {
    for (int i = 0; i < block.size(); ++i)
      if (std::isfinite(block.prior[i])) rows_.push_back(i);
    set_num_residuals(static_cast<int>(rows_.size()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(block.values.size()));
  }
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::VectorXd change = block_.change(parameters[0]);
    Eigen::Map<RowMatrix> J(jacobians ? jacobians[0] : nullptr, num_residuals(), block_.values.size());
    for (std::size_t k = 0; k < rows_.size(); ++k) residuals[k] = change[rows_[k]] / block_.prior[rows_[k]];
    if (!jacobians || !jacobians[0]) return true;
    const Eigen::MatrixXd by_coordinates = block_.change_by_coordinates(parameters[0]);
    J.setZero();
    for (std::size_t k = 0; k < rows_.size(); ++k)
      J.row(static_cast<Eigen::Index>(k)).head(block_.size()) = by_coordinates.row(rows_[k]) / block_.prior[rows_[k]];
    return true;
  }

 private:
  const Block& block_;
  std::vector<int> rows_;
};

/// The values of all blocks in one piece: Ceres orders blocks by their addresses, and equal fits are to give equal
/// answers.
class StoredValues {
 public:
  explicit StoredValues(const std::vector<Block>& blocks) {
    Eigen::Index count = 0;
    for (const Block& block : blocks) first_.push_back(count), count += block.values.size();
    stored_.resize(count);
    for (std::size_t b = 0; b < blocks.size(); ++b)
      stored_.segment(first_[b], blocks[b].values.size()) = blocks[b].values;
  }
  double* at(std::size_t block) { return stored_.data() + first_[block]; }
  void write(std::vector<Block>& blocks) const {
    for (std::size_t b = 0; b < blocks.size(); ++b)
      blocks[b].values = stored_.segment(first_[b], blocks[b].values.size());
  }

 private:
  std::vector<Eigen::Index> first_;
  Eigen::VectorXd stored_;
};

/// One solve: the problem in the words of Ceres.
class CeresSolve {
 public:
  CeresSolve(ProblemData& data, const SolveOptions& options, int residuals)
      : data_(data), options_(options), values_(data.blocks), problem_(ownership()), known_(residuals) {
    add_measurements();
    for (std::size_t b = 0; b < data.blocks.size(); ++b) add_block(b);
  }

  ceres::Solver::Summary solve() {
    ceres::Solver::Options solver;
    solver.max_num_iterations = options_.max_iterations;
    solver.linear_solver_type = any_nuisance_ ? ceres::DENSE_SCHUR : ceres::DENSE_QR;
    solver.linear_solver_ordering = ordering_;
    solver.function_tolerance = options_.cost_tolerance;
    solver.parameter_tolerance = 1e-12;
    solver.gradient_tolerance = 1e-14;
    solver.max_num_consecutive_invalid_steps = 12;  // a long step may leave the range of a lens; the next is shorter
    solver.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem_, &summary);
    values_.write(data_.blocks);
    return summary;
  }

  /// Residuals and priors, less what is fitted.
  double degrees_of_freedom() const { return std::max(1.0, known_); }

 private:
  static ceres::Problem::Options ownership() {
    ceres::Problem::Options out;
    out.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return out;
  }

  void add_measurements() {
    for (const StoredMeasurement& e : data_.entries) {
      if (!(e.weight > 0)) continue;
      std::vector<double*> parameters;
      for (const int b : e.blocks) parameters.push_back(values_.at(static_cast<std::size_t>(b)));
      ceres::LossFunction* loss = nullptr;
      if (options_.loss > 0) loss = &losses_.emplace_back(options_.loss * std::sqrt(static_cast<double>(e.rows)));
      problem_.AddResidualBlock(new MeasurementCost(data_, e), loss, parameters);
    }
  }

  void add_block(std::size_t b) {
    const Block& block = data_.blocks[b];
    double* const at = values_.at(b);
    if (block.prior.size() && (!block.nuisance || problem_.HasParameterBlock(at)))
      problem_.AddResidualBlock(new PriorCost(block), nullptr, at);
    if (!problem_.HasParameterBlock(at)) return;
    const std::vector<int> free = block.free();
    known_ -= static_cast<double>(free.size());
    for (const int i : free) known_ += block.prior.size() && std::isfinite(block.prior[i]);
    ordering_->AddElementToGroup(at, block.nuisance ? 0 : 1);
    any_nuisance_ = any_nuisance_ || block.nuisance;
    if (free.empty()) {
      problem_.SetParameterBlockConstant(at);
    } else if (block.kind == BlockKind::Pose) {
      problem_.SetManifold(at, new PoseManifold(free));
    } else if (static_cast<int>(free.size()) < block.size()) {
      problem_.SetManifold(at, new VectorManifold(block));
    }
  }

  ProblemData& data_;
  const SolveOptions& options_;
  StoredValues values_;
  std::deque<ceres::CauchyLoss> losses_;  // one a measurement: the norm of n sound residuals is about the root of n
  ceres::Problem problem_;
  std::shared_ptr<ceres::ParameterBlockOrdering> ordering_ = std::make_shared<ceres::ParameterBlockOrdering>();
  double known_;
  bool any_nuisance_ = false;
};

FitStatus status_of(ceres::TerminationType type) {
  return type == ceres::CONVERGENCE      ? FitStatus::Converged
         : type == ceres::NO_CONVERGENCE ? FitStatus::MaxIterations
                                         : FitStatus::Degenerate;
}

}  // namespace

void minimise(ProblemData& data, const SolveOptions& options, Solution& solution) {
  for (const StoredMeasurement& e : data.entries)
    if (e.weight > 0) solution.residuals += e.rows;
  FitReport& fit = solution.fit;
  if (!data.exists()) {
    solution.cost = std::numeric_limits<double>::infinity();
    fit.message =
        "a measurement is impossible at the start: a point behind the camera or beyond its lens, or a path without a "
        "pose";
    return;
  }
  CeresSolve solve(data, options, solution.residuals);
  const ceres::Solver::Summary summary = solve.solve();
  fit.iterations = std::max(0, static_cast<int>(summary.iterations.size()) - 1);
  solution.cost = 2 * summary.final_cost;
  const double dof = solve.degrees_of_freedom();
  fit.initial_rms = std::sqrt(std::max(0.0, 2 * summary.initial_cost) / dof);
  fit.final_rms = std::sqrt(std::max(0.0, solution.cost) / dof);
  fit.status = status_of(summary.termination_type);
  fit.message = fit.status == FitStatus::Degenerate ? "the solver failed: " + summary.message
                                                    : std::to_string(solution.residuals) + " residuals, " +
                                                          std::to_string(solution.coordinates.size()) + " parameters";
}

}  // namespace kr5::fit
