// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/fit/cell_fit.hpp>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <optional>

#include <ceres/ceres.h>
#include <Eigen/Dense>
#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>

#include "fit/block.hpp"
#include "fit/observation.hpp"

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

/// An observation as Ceres sees it.
class ObservationCost final : public ceres::CostFunction {
 public:
  ObservationCost(const std::vector<Block>& all, const Observation& observation)
      : all_(all), observation_(observation) {
    set_num_residuals(observation.condensed_rows(all));
    for (const int b : observation.blocks)
      mutable_parameter_block_sizes()->push_back(static_cast<int>(all[static_cast<std::size_t>(b)].values.size()));
  }
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    return observation_.evaluate(all_, parameters, num_residuals(), observation_.weight, residuals, jacobians);
  }

 private:
  const std::vector<Block>& all_;
  const Observation& observation_;
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

/// Lower triangular W with W' W = C^-1.
template <int Size>
Eigen::Matrix<double, Size, Size> whitening_of(const Eigen::MatrixXd& covariance, Eigen::Index size = Size) {
  using Square = Eigen::Matrix<double, Size, Size>;
  require(covariance.rows() == size && covariance.cols() == size && covariance.allFinite(),
          "covariance must be finite, of as many rows as there are numbers [m^2, rad^2]");
  const Eigen::LLT<Square> factors{Square(covariance)};
  require(factors.info() == Eigen::Success, "covariance must be positive definite [m^2, rad^2]");
  return factors.matrixL().solve(Square::Identity(size, size));
}

/// Measurements that share a nuisance, at the present values.
struct GroupDerivatives {
  std::vector<int> index;  ///< Places of the columns of `J` in the result.
  Eigen::MatrixXd J;       ///< By the free coordinates.
  Eigen::MatrixXd N;       ///< By the nuisance; without columns where there is none.
  Eigen::MatrixXd prior;   ///< The same of its prior: that of its change from the start over the standard deviations.
  Eigen::VectorXd r;
};

constexpr std::size_t most_named = 6;  // coordinates of a direction in its text

/// Directions that span the same space, each with as many zeros as elimination gives: readable by name.
Eigen::MatrixXd sparse_basis(Eigen::MatrixXd V) {
  for (Eigen::Index k = 0; k < V.cols(); ++k) {
    Eigen::Index row = 0;
    V.col(k).cwiseAbs().maxCoeff(&row);
    V.col(k) /= V(row, k);
    for (Eigen::Index other = 0; other < V.cols(); ++other)
      if (other != k) V.col(other) -= V(row, other) * V.col(k);
  }
  for (Eigen::Index k = 0; k < V.cols(); ++k) V.col(k).normalize();
  return V;
}

/// What remains of residuals whose nuisance is eliminated: they are M r, with covariance P where the model holds.
struct WithoutNuisance {
  Eigen::MatrixXd M;  ///< Symmetric, M M = I - N (N' N + R' R)^-1 N', R of the prior.
  Eigen::MatrixXd P;  ///< The projector on the range of M: less than the identity where no prior holds the nuisance.
  int rank = 0;
};

WithoutNuisance eliminate(const Eigen::MatrixXd& N, const Eigen::MatrixXd& prior) {
  constexpr double taken_up = 1e-9;  // share of a direction that is left where the nuisance takes it up
  const Eigen::MatrixXd inner = N.transpose() * N + prior.transpose() * prior;
  const Eigen::MatrixXd rest =
      Eigen::MatrixXd::Identity(N.rows(), N.rows()) - N * inner.ldlt().solve(Eigen::MatrixXd(N.transpose()));
  const SymmetricEigen eigen = symmetric_eigen(rest);
  const Eigen::VectorXd remains = eigen.values.unaryExpr([](double v) { return v > taken_up ? 1.0 : 0.0; });
  WithoutNuisance out;
  out.M = eigen.vectors * remains.cwiseProduct(eigen.values.cwiseMax(0.0).cwiseSqrt()).asDiagonal() *
          eigen.vectors.transpose();
  out.P = eigen.vectors * remains.asDiagonal() * eigen.vectors.transpose();
  out.rank = static_cast<int>(remains.sum());
  return out;
}

/// Derivatives by the free coordinates of as many residuals as tell all that is known with the nuisance eliminated. The
/// residuals are turned, so that this costs little for many of them.
Eigen::MatrixXd without_nuisance(const GroupDerivatives& at) {
  const Eigen::Index k = at.N.cols(), rows = at.N.rows();
  if (k == 0) return at.J;
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(rows + k, k), J = Eigen::MatrixXd::Zero(rows + k, at.J.cols());
  N.topRows(rows) = at.N, J.topRows(rows) = at.J;
  N.bottomRows(k) = at.prior;
  const Eigen::HouseholderQR<Eigen::MatrixXd> turn(N);
  J.applyOnTheLeft(turn.householderQ().adjoint());
  return J.bottomRows(rows);
}

/// Directions on which no measurement depends, of unit length, each coordinate over its sensitivity.
Eigen::MatrixXd open_directions(const Eigen::MatrixXd& information, double tolerance) {
  const Eigen::VectorXd sensitivity = information.diagonal().cwiseSqrt();
  const double least = tolerance * std::max(sensitivity.size() ? sensitivity.maxCoeff() : 0.0, 1e-300) * 1e-6;
  const Eigen::VectorXd scale = sensitivity.unaryExpr([&](double s) { return s > least ? 1 / s : 0.0; });
  const SymmetricEigen eigen = symmetric_eigen(Eigen::MatrixXd(scale.asDiagonal() * information * scale.asDiagonal()));
  Eigen::Index count = 0;
  while (count < eigen.values.size() && eigen.values[count] <= tolerance * tolerance) ++count;
  return eigen.vectors.leftCols(count);
}

/// Coordinates that take part in a combination of such directions of which no prior knows anything either.
std::vector<int> undetermined_coordinates(const Eigen::MatrixXd& open, const Eigen::VectorXd& prior_information) {
  constexpr double part = 1e-3;  // of a coordinate in a direction, or of a direction in the coordinates with a prior
  if (open.cols() == 0) return {};
  Eigen::MatrixXd held = open;
  for (Eigen::Index i = 0; i < held.rows(); ++i)
    if (!(prior_information[i] > 0)) held.row(i).setZero();
  const SymmetricEigen prior = symmetric_eigen(Eigen::MatrixXd(held.transpose() * held));
  Eigen::VectorXd shares = Eigen::VectorXd::Zero(open.rows());
  for (Eigen::Index k = 0; k < open.cols() && prior.values[k] <= part * part; ++k)
    shares += (open * prior.vectors.col(k)).cwiseAbs2();
  std::vector<int> out;
  for (Eigen::Index i = 0; i < shares.size(); ++i)
    if (shares[i] > part) out.push_back(static_cast<int>(i));
  return out;
}

void name_unidentifiable(const Eigen::MatrixXd& open, CellFitResult& result) {
  const Eigen::MatrixXd directions = sparse_basis(open);
  for (Eigen::Index k = 0; k < directions.cols(); ++k) {
    UnidentifiableDirection out;
    out.direction = directions.col(k);
    std::vector<int> order(static_cast<std::size_t>(out.direction.size()));
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int>(i);
    std::sort(order.begin(), order.end(),
              [&](int a, int b) { return std::abs(out.direction[a]) > std::abs(out.direction[b]); });
    for (const int i : order)
      if (std::abs(out.direction[i]) > 0.01 * std::abs(out.direction[order[0]]))
        out.coordinates.push_back(result.coordinates[static_cast<std::size_t>(i)]);
    out.text = out.coordinates.size() == 1 ? "no measurement depends on " : "only together: ";
    const std::size_t named = out.coordinates.size() > most_named + 1 ? most_named : out.coordinates.size();
    for (std::size_t i = 0; i < named; ++i) out.text += (i ? ", " : "") + out.coordinates[i];
    if (named < out.coordinates.size()) out.text += " and " + std::to_string(out.coordinates.size() - named) + " more";
    result.unidentifiable.push_back(std::move(out));
  }
}

}  // namespace

struct CellFit::Impl {
  std::vector<Block> blocks;
  std::vector<Observation> observations;
  std::vector<std::vector<int>> places;                          ///< By block and coordinate, in the result; -1: held.
  std::vector<std::vector<const Observation*>> observations_of;  ///< By block of a nuisance, those that take part.
  Eigen::MatrixXd covariance;

  Block& block(FitBlock handle, const char* what = "block") {
    require(handle.index >= 0 && handle.index < static_cast<int>(blocks.size()),
            std::string("CellFit: there is no such ") + what);
    return blocks[static_cast<std::size_t>(handle.index)];
  }
  const Block& block(FitBlock handle) const { return const_cast<Impl*>(this)->block(handle); }
  Block& block_of(FitBlock handle, BlockKind kind, const char* what) {
    Block& out = block(handle, what);
    require(out.kind == kind, out.name + " is no " + what);
    return out;
  }
  Observation& observation(FitObservation handle) {
    require(handle.index >= 0 && handle.index < static_cast<int>(observations.size()),
            "CellFit: there is no such measurement");
    return observations[static_cast<std::size_t>(handle.index)];
  }
  /// What is added changes what solve() found out.
  void forget() {
    places.clear(), observations_of.clear();
    covariance.resize(0, 0);
  }
  FitBlock keep(Block block) {
    forget();
    blocks.push_back(std::move(block));
    return {static_cast<int>(blocks.size()) - 1};
  }
  FitObservation keep(Observation observation, int rows) {
    forget();
    check_chain(observation.chain);
    observation.finish(rows);
    int nuisances = 0;
    for (const int b : observation.blocks) nuisances += blocks[static_cast<std::size_t>(b)].nuisance;
    require(nuisances <= 1, "CellFit: a measurement may have one nuisance pose");
    observations.push_back(std::move(observation));
    return {static_cast<int>(observations.size()) - 1};
  }
  void check_chain(const PoseChain& chain) {
    for (const PoseChain::Factor& factor : chain.factors()) {
      if (factor.path) require(std::isfinite(factor.t), "CellFit: the time on a path must be finite [s]");
      if (!factor.block.exists()) continue;
      if (factor.path) {
        require(block_of(factor.block, BlockKind::Vector, "delay").size() == 1, "delay must be a block of one number");
        continue;
      }
      if (factor.q.size() == 0) {
        block_of(factor.block, BlockKind::Pose, "pose");
        continue;
      }
      const Block& arm = block_of(factor.block, BlockKind::Arm, "arm");
      const auto joints = static_cast<Eigen::Index>(arm.chain.joints.size());
      require(factor.q.size() == joints && factor.q.allFinite(), arm.name + ": expected " + std::to_string(joints) +
                                                                     " finite joint values, found " +
                                                                     std::to_string(factor.q.size()));
      if (factor.joint_terms.exists())
        require(factor.regressor.rows() == joints && factor.regressor.cols() == block(factor.joint_terms).size() &&
                    factor.regressor.allFinite(),
                arm.name + ": the regressor of the joint terms must be finite, joints x coefficients");
    }
  }
  void check_point(const FitPoint& point) {
    if (point.block.exists())
      block_of(point.block, BlockKind::Point, "point");
    else
      require(point.value.allFinite(), "CellFit: a point must be finite");
  }
  std::vector<const double*> values(const Observation& o) const {
    std::vector<const double*> out;
    for (const int b : o.blocks) out.push_back(blocks[static_cast<std::size_t>(b)].values.data());
    return out;
  }

  std::vector<std::string> number_coordinates();
  /// Of the last solve.
  Eigen::Index coordinate_count() const {
    Eigen::Index n = 0;
    for (const auto& of_block : places)
      for (const int place : of_block) n = std::max<Eigen::Index>(n, place + 1);
    return n;
  }
  bool exists() const;
  void minimise(const CellFitOptions& options, CellFitResult& result);
  std::vector<std::vector<const Observation*>> groups() const;
  int nuisance_of(const Observation& o) const;
  /// With the weights in use or another one for all; `condensed`: with as few rows as say the same.
  std::optional<GroupDerivatives> linearise(const std::vector<const Observation*>& group, bool condensed,
                                            std::optional<double> weight = {}) const;
  Eigen::MatrixXd data_information(CellFitResult& result) const;
  Eigen::MatrixXd covariance_of(const std::vector<int>& index) const;
  Eigen::VectorXd nuisance_redundancy(int nuisance) const;
  void add_prior_information(Eigen::MatrixXd& information) const;
};

std::vector<std::string> CellFit::Impl::number_coordinates() {
  std::vector<bool> used(blocks.size(), false);
  for (const Observation& o : observations)
    for (const int b : o.blocks) used[static_cast<std::size_t>(b)] = used[static_cast<std::size_t>(b)] || o.weight > 0;
  std::vector<std::string> names;
  places.assign(blocks.size(), {});
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const Block& block = blocks[b];
    places[b].assign(static_cast<std::size_t>(block.size()), -1);
    if (block.nuisance || !(used[b] || block.prior.size())) continue;
    for (const int i : block.free()) {
      places[b][static_cast<std::size_t>(i)] = static_cast<int>(names.size());
      names.push_back(block.coordinates[static_cast<std::size_t>(i)]);
    }
    for (std::size_t i = 0; i < places[b].size(); ++i)
      places[b][i] = places[b][static_cast<std::size_t>(block.leader[i])];
  }
  require(!names.empty(), "CellFit: no parameter is free");
  observations_of.assign(blocks.size(), {});
  for (const Observation& o : observations)
    if (const int nuisance = nuisance_of(o); o.weight > 0 && nuisance >= 0)
      observations_of[static_cast<std::size_t>(nuisance)].push_back(&o);
  return names;
}

/// Whether every measurement in use has residuals at the present values.
bool CellFit::Impl::exists() const {
  Eigen::VectorXd r;
  for (const Observation& o : observations) {
    if (!(o.weight > 0)) continue;
    r.resize(o.rows);
    if (!o.evaluate(blocks, values(o).data(), o.rows, 1.0, r.data(), nullptr)) return false;
  }
  return true;
}

void CellFit::Impl::minimise(const CellFitOptions& options, CellFitResult& result) {
  for (const Observation& o : observations)
    if (o.weight > 0) result.residuals += o.rows;
  if (!exists()) {
    result.cost = std::numeric_limits<double>::infinity();
    result.fit.message =
        "a measurement is impossible at the start: a point behind the camera or beyond its lens, or a path without a "
        "pose";
    return;
  }
  // In one piece: Ceres orders blocks by their addresses, and equal fits are to give equal answers.
  std::vector<Eigen::Index> first;
  Eigen::Index count = 0;
  for (const Block& block : blocks) first.push_back(count), count += block.values.size();
  Eigen::VectorXd stored(count);
  const auto at = [&](std::size_t b) { return stored.data() + first[b]; };
  for (std::size_t b = 0; b < blocks.size(); ++b) stored.segment(first[b], blocks[b].values.size()) = blocks[b].values;

  ceres::Problem::Options ownership;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(ownership);
  std::deque<ceres::CauchyLoss> losses;  // one a measurement: the norm of n sound residuals is about the root of n
  for (Observation& o : observations) {
    if (!(o.weight > 0)) continue;
    std::vector<double*> parameters;
    for (const int b : o.blocks) parameters.push_back(at(static_cast<std::size_t>(b)));
    if (options.loss > 0) losses.emplace_back(options.loss * std::sqrt(static_cast<double>(o.rows)));
    problem.AddResidualBlock(new ObservationCost(blocks, o), options.loss > 0 ? &losses.back() : nullptr, parameters);
  }
  double known = result.residuals;  // residuals and priors, less what is fitted: degrees of freedom
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  bool any_nuisance = false;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const Block& block = blocks[b];
    if (block.prior.size() && (!block.nuisance || problem.HasParameterBlock(at(b))))
      problem.AddResidualBlock(new PriorCost(block), nullptr, at(b));
    if (!problem.HasParameterBlock(at(b))) continue;
    const std::vector<int> free = block.free();
    known -= static_cast<double>(free.size());
    for (const int i : free) known += block.prior.size() && std::isfinite(block.prior[i]);
    ordering->AddElementToGroup(at(b), block.nuisance ? 0 : 1);
    any_nuisance = any_nuisance || block.nuisance;
    if (free.empty()) {
      problem.SetParameterBlockConstant(at(b));
    } else if (block.kind == BlockKind::Pose) {
      problem.SetManifold(at(b), new PoseManifold(free));
    } else if (static_cast<int>(free.size()) < block.size()) {
      problem.SetManifold(at(b), new VectorManifold(block));
    }
  }
  ceres::Solver::Options solver;
  solver.max_num_iterations = options.max_iterations;
  solver.linear_solver_type = any_nuisance ? ceres::DENSE_SCHUR : ceres::DENSE_QR;
  solver.linear_solver_ordering = ordering;
  solver.function_tolerance = options.cost_tolerance;
  solver.parameter_tolerance = 1e-12;
  solver.gradient_tolerance = 1e-14;
  solver.max_num_consecutive_invalid_steps = 12;  // a long step may leave the range of a lens; the next is shorter
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  for (std::size_t b = 0; b < blocks.size(); ++b) blocks[b].values = stored.segment(first[b], blocks[b].values.size());
  result.fit.iterations = std::max(0, static_cast<int>(summary.iterations.size()) - 1);
  result.cost = 2 * summary.final_cost;
  const double dof = std::max(1.0, known);
  result.fit.initial_rms = std::sqrt(std::max(0.0, 2 * summary.initial_cost) / dof);
  result.fit.final_rms = std::sqrt(std::max(0.0, result.cost) / dof);
  result.fit.status = summary.termination_type == ceres::CONVERGENCE      ? FitStatus::Converged
                      : summary.termination_type == ceres::NO_CONVERGENCE ? FitStatus::MaxIterations
                                                                          : FitStatus::Degenerate;
  result.fit.message = result.fit.status == FitStatus::Degenerate
                           ? "the solver failed: " + summary.message
                           : std::to_string(result.residuals) + " residuals, " +
                                 std::to_string(result.coordinates.size()) + " parameters";
}

int CellFit::Impl::nuisance_of(const Observation& o) const {
  for (const int b : o.blocks)
    if (blocks[static_cast<std::size_t>(b)].nuisance) return b;
  return -1;
}

/// Measurements that take part; those that share a nuisance together.
std::vector<std::vector<const Observation*>> CellFit::Impl::groups() const {
  std::vector<std::vector<const Observation*>> out;
  for (const auto& of_nuisance : observations_of)
    if (!of_nuisance.empty()) out.push_back(of_nuisance);
  for (const Observation& o : observations)
    if (o.weight > 0 && nuisance_of(o) < 0) out.push_back({&o});
  return out;
}

std::optional<GroupDerivatives> CellFit::Impl::linearise(const std::vector<const Observation*>& group, bool condensed,
                                                         std::optional<double> weight) const {
  const auto rows_of = [&](const Observation* o) { return condensed ? o->condensed_rows(blocks) : o->rows; };
  Eigen::Index rows = 0;
  for (const Observation* o : group) rows += rows_of(o);
  GroupDerivatives out;
  out.r.resize(rows);
  std::vector<int> blocks_of;  // of the whole group, each once
  std::vector<Eigen::Index> first_column;
  for (const Observation* o : group)
    for (const int b : o->blocks) {
      if (std::find(blocks_of.begin(), blocks_of.end(), b) != blocks_of.end()) continue;
      blocks_of.push_back(b);
      first_column.push_back(static_cast<Eigen::Index>(out.index.size()));
      for (const int place : places[static_cast<std::size_t>(b)])
        if (place >= 0) out.index.push_back(place);
    }
  out.J = Eigen::MatrixXd::Zero(rows, static_cast<Eigen::Index>(out.index.size()));
  const int nuisance = nuisance_of(*group.front());
  if (nuisance >= 0) {
    const Block& block = blocks[static_cast<std::size_t>(nuisance)];
    out.N = Eigen::MatrixXd::Zero(rows, block.size());
    out.prior = Eigen::MatrixXd::Zero(block.size(), block.size());
    if (block.prior.size())
      out.prior = block.prior.cwiseInverse().asDiagonal() * block.change_by_coordinates(block.values.data());
  }
  Eigen::Index first = 0;
  for (const Observation* o : group) {
    const int own_rows = rows_of(o);
    std::vector<RowMatrix> jacobians(o->blocks.size());
    std::vector<double*> by;
    for (std::size_t k = 0; k < jacobians.size(); ++k) {
      const Block& block = blocks[static_cast<std::size_t>(o->blocks[k])];
      if (block.any_free()) jacobians[k].resize(own_rows, block.values.size());
      by.push_back(block.any_free() ? jacobians[k].data() : nullptr);
    }
    if (!o->evaluate(blocks, values(*o).data(), own_rows, weight.value_or(o->weight), out.r.data() + first, by.data()))
      return std::nullopt;
    for (std::size_t k = 0; k < o->blocks.size(); ++k) {
      const auto b = static_cast<std::size_t>(o->blocks[k]);
      if (blocks[b].nuisance) out.N.middleRows(first, own_rows) = jacobians[k].leftCols(out.N.cols());
      Eigen::Index column = first_column[static_cast<std::size_t>(
          std::find(blocks_of.begin(), blocks_of.end(), o->blocks[k]) - blocks_of.begin())];
      for (int i = 0; i < blocks[b].size(); ++i)
        if (places[b][static_cast<std::size_t>(i)] >= 0)
          out.J.block(first, column++, own_rows, 1) = blocks[b].ratio[i] * jacobians[k].col(i);
    }
    first += own_rows;
  }
  return out;
}

Eigen::MatrixXd CellFit::Impl::data_information(CellFitResult& result) const {
  const auto n = static_cast<Eigen::Index>(result.coordinates.size());
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(n, n);
  for (const auto& group : groups()) {
    const auto at = linearise(group, true);
    if (!at) continue;
    const Eigen::MatrixXd J = without_nuisance(*at);
    const Eigen::MatrixXd part = J.transpose() * J;
    for (std::size_t r = 0; r < at->index.size(); ++r)
      for (std::size_t c = 0; c < at->index.size(); ++c)
        H(at->index[r], at->index[c]) += part(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c));
  }
  return H;
}

/// Covariance of some free coordinates.
Eigen::MatrixXd CellFit::Impl::covariance_of(const std::vector<int>& index) const { return covariance(index, index); }

void CellFit::Impl::add_prior_information(Eigen::MatrixXd& information) const {
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const Block& block = blocks[b];
    if (!block.prior.size() || block.nuisance) continue;
    const Eigen::MatrixXd by_coordinates = block.change_by_coordinates(block.values.data()) * block.ratio.asDiagonal();
    const Eigen::MatrixXd own =
        by_coordinates.transpose() * block.prior.cwiseAbs2().cwiseInverse().asDiagonal() * by_coordinates;
    for (int i = 0; i < block.size(); ++i)
      for (int k = 0; k < block.size(); ++k) {
        const int row = places[b][static_cast<std::size_t>(i)], column = places[b][static_cast<std::size_t>(k)];
        if (row >= 0 && column >= 0) information(row, column) += own(i, k);
      }
  }
}

PoseChain& PoseChain::then(const Pose& T) {
  factors_.push_back({.constant = T, .block = {}, .q = {}, .joint_terms = {}, .regressor = {}, .path = {}});
  return *this;
}
PoseChain& PoseChain::then(FitBlock pose) {
  factors_.push_back({.block = pose, .q = {}, .joint_terms = {}, .regressor = {}, .path = {}});
  return *this;
}
PoseChain& PoseChain::then_inverse(FitBlock pose) {
  factors_.push_back({.block = pose, .inverse = true, .q = {}, .joint_terms = {}, .regressor = {}, .path = {}});
  return *this;
}
PoseChain& PoseChain::then_arm(FitBlock arm, const Eigen::VectorXd& q, FitBlock joint_terms,
                               const Eigen::MatrixXd& regressor) {
  factors_.push_back({.block = arm, .q = q, .joint_terms = joint_terms, .regressor = regressor, .path = {}});
  return *this;
}
PoseChain& PoseChain::then_inverse_arm(FitBlock arm, const Eigen::VectorXd& q, FitBlock joint_terms,
                                       const Eigen::MatrixXd& regressor) {
  then_arm(arm, q, joint_terms, regressor);
  factors_.back().inverse = true;
  return *this;
}

PoseChain& PoseChain::then_path(const PosePath& path, double t, FitBlock delay) {
  require(static_cast<bool>(path), "PoseChain: there is no path");
  factors_.push_back({.block = delay, .q = {}, .joint_terms = {}, .regressor = {}, .path = path, .t = t});
  return *this;
}

void CellFitOptions::validate() const {
  require(max_iterations >= 1, "max_iterations must be at least 1");
  require(loss >= 0 && std::isfinite(loss), "loss must not be negative [-]; 0: least squares");
  require(loss == 0 || !uncertainty, "uncertainty: the covariance holds for least squares only; set loss to 0");
  require(rank_tolerance > 0 && rank_tolerance < 1, "rank_tolerance must lie between 0 and 1 [-]");
  require(cost_tolerance > 0 && cost_tolerance < 1, "cost_tolerance must lie between 0 and 1 [-]");
}

CellFit::CellFit() : impl_(std::make_unique<Impl>()) {}
CellFit::~CellFit() = default;
CellFit::CellFit(CellFit&&) noexcept = default;
CellFit& CellFit::operator=(CellFit&&) noexcept = default;

FitBlock CellFit::add_pose(const std::string& name, const Pose& start) { return impl_->keep(pose_block(name, start)); }
FitBlock CellFit::add_nuisance_pose(const std::string& name, const Pose& start) {
  Block block = pose_block(name, start);
  block.nuisance = true;
  return impl_->keep(std::move(block));
}
FitBlock CellFit::add_nuisance_vector(const std::string& name, const Eigen::VectorXd& start,
                                      const std::vector<std::string>& coordinates) {
  Block block = vector_block(name, start, coordinates);
  block.nuisance = true;
  return impl_->keep(std::move(block));
}
FitBlock CellFit::add_arm(const std::string& name, const kinematics::DhChain& start) {
  return impl_->keep(arm_block(name, start));
}
FitBlock CellFit::add_point(const std::string& name, const Eigen::Vector3d& start) {
  return impl_->keep(point_block(name, start));
}
FitBlock CellFit::add_vector(const std::string& name, const Eigen::VectorXd& start,
                             const std::vector<std::string>& coordinates) {
  return impl_->keep(vector_block(name, start, coordinates));
}
FitBlock CellFit::add_camera(const std::string& name, const Pinhole& start) {
  return impl_->keep(camera_block(name, start));
}

void CellFit::hold(FitBlock block, int coordinate) {
  Block& b = impl_->block(block);
  require(!b.nuisance, b.name + " is a nuisance: leave it out instead");
  require(coordinate >= -1 && coordinate < b.size(), b.name + ": there is no coordinate " + std::to_string(coordinate));
  for (int i = 0; i < b.size(); ++i)
    if (coordinate < 0 || i == coordinate) b.hold(i);
}

void CellFit::tie(FitBlock block, int leader, int follower, double ratio) {
  Block& b = impl_->block(block);
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
  impl_->forget();
}

bool CellFit::any_free() const {
  for (const Observation& o : impl_->observations)
    for (const int b : o.blocks) {
      const Block& block = impl_->blocks[static_cast<std::size_t>(b)];
      if (o.weight > 0 && !block.nuisance && !block.free().empty()) return true;
    }
  return false;
}

bool CellFit::hold(const std::string& name) {
  for (Block& b : impl_->blocks) {
    if (b.name == name && !b.nuisance) {
      std::fill(b.held.begin(), b.held.end(), true);
      return true;
    }
    for (std::size_t i = 0; i < b.coordinates.size() && !b.nuisance; ++i)
      if (b.coordinates[i].substr(0, b.coordinates[i].find(" [")) == name) {
        b.hold(static_cast<int>(i));
        return true;
      }
  }
  return false;
}

void CellFit::set_prior(FitBlock block, const Eigen::VectorXd& sigma) {
  Block& b = impl_->block(block);
  require(sigma.size() == b.size(), b.name + ": expected " + std::to_string(b.size()) + " standard deviations, found " +
                                        std::to_string(sigma.size()));
  require(!sigma.hasNaN() && (sigma.array() > 0).all(), b.name + ": standard deviations must be positive");
  b.prior = sigma;
}

void CellFit::begin_at(FitBlock block, const Eigen::VectorXd& values) {
  Block& b = impl_->block(block);
  require(values.size() == b.values.size() && values.allFinite(),
          b.name + ": expected " + std::to_string(b.values.size()) + " finite values");
  b.values = values;
}

void CellFit::begin_at(FitBlock block, const Pose& pose) {
  require(pose.matrix().allFinite() && is_rotation(pose.linear(), 1e-3),
          "CellFit: a pose to begin at has no proper rotation");
  from_pose(pose, impl_->block_of(block, BlockKind::Pose, "pose").values.data());
}

void CellFit::set_weight(FitObservation observation, double weight) {
  require(weight >= 0 && std::isfinite(weight), "weight must not be negative [-]");
  impl_->observation(observation).weight = weight;
}

void CellFit::set_pixel_sigmas(FitObservation observation, const Eigen::VectorXd& sigmas) {
  Observation& o = impl_->observation(observation);
  require(o.kind == ObservationKind::Pixels && sigmas.size() == o.points.cols(),
          "CellFit: sigmas of pixels belong to a measurement of as many pixels");
  require(!sigmas.hasNaN() && (sigmas.array() > 0).all(), "sigmas must be positive [px]");
  o.whitening = sigmas.cwiseInverse();
}

void CellFit::set_covariance(FitObservation observation, const Eigen::MatrixXd& covariance) {
  Observation& o = impl_->observation(observation);
  switch (o.kind) {
    case ObservationKind::Pose:
      o.whitening6 = whitening_of<6>(covariance);
      return;
    case ObservationKind::Position:
    case ObservationKind::SphereSection:
      o.whitening3 = whitening_of<3>(covariance);
      return;
    case ObservationKind::PlanePoints:
      o.whitening_matrix = whitening_of<Eigen::Dynamic>(covariance, o.points.cols());
      return;
    default:
      throw InvalidArgument("CellFit: this kind of measurement has no covariance");
  }
}

FitObservation CellFit::observe_pose(const PoseChain& chain, const Pose& seen, double sigma_position,
                                     double sigma_rotation) {
  require(sigma_position > 0 && sigma_rotation > 0, "standard deviations must be positive [m, rad]");
  const FitObservation out = observe_pose(chain, seen, Matrix6(Matrix6::Identity()));
  Vector6 whitening;
  whitening << Eigen::Vector3d::Constant(1 / sigma_position), Eigen::Vector3d::Constant(1 / sigma_rotation);
  impl_->observation(out).whitening6 = whitening.asDiagonal();
  return out;
}

FitObservation CellFit::observe_pose(const PoseChain& chain, const Pose& seen, const Matrix6& covariance) {
  require(seen.matrix().allFinite() && is_rotation(seen.linear(), 1e-3), "a seen pose has no proper rotation");
  Observation o;
  o.kind = ObservationKind::Pose;
  o.chain = chain;
  o.seen = seen;
  o.whitening6 = whitening_of<6>(covariance);
  return impl_->keep(std::move(o), 6);
}

FitObservation CellFit::observe_position(const PoseChain& chain, const FitPoint& point, const FitPoint& seen,
                                         double sigma) {
  require(sigma > 0, "sigma must be positive [m]");
  return observe_position(chain, point, seen, Eigen::Matrix3d(sigma * sigma * Eigen::Matrix3d::Identity()));
}

FitObservation CellFit::observe_position(const PoseChain& chain, const FitPoint& point, const FitPoint& seen,
                                         const Eigen::Matrix3d& covariance) {
  impl_->check_point(point), impl_->check_point(seen);
  Observation o;
  o.kind = ObservationKind::Position;
  o.chain = chain;
  o.point = point;
  o.other = seen;
  o.whitening3 = whitening_of<3>(covariance);
  return impl_->keep(std::move(o), 3);
}

FitObservation CellFit::observe_distance(const PoseChain& chain, const FitPoint& point, const FitPoint& other,
                                         double distance, double sigma, FitBlock radius) {
  require(sigma > 0 && std::isfinite(distance), "sigma must be positive and distance finite [m]");
  impl_->check_point(point), impl_->check_point(other);
  if (radius.exists()) require(impl_->block(radius).size() == 1, "radius must be a block of one number");
  Observation o;
  o.kind = ObservationKind::Distance;
  o.chain = chain;
  o.point = point;
  o.other = other;
  o.radius = radius;
  o.distance = distance;
  o.whitening = Eigen::VectorXd::Constant(1, 1 / sigma);
  return impl_->keep(std::move(o), 1);
}

FitObservation CellFit::observe_on_plane(const PoseChain& chain, const FitPoint& point, double sigma) {
  require(sigma > 0, "sigma must be positive [m]");
  impl_->check_point(point);
  Observation o;
  o.kind = ObservationKind::Plane;
  o.chain = chain;
  o.point = point;
  o.whitening = Eigen::VectorXd::Constant(1, 1 / sigma);
  return impl_->keep(std::move(o), 1);
}

FitObservation CellFit::observe_on_plane(const PoseChain& chain, const Eigen::Matrix3Xd& points,
                                         const Eigen::MatrixXd& covariance) {
  require(points.cols() > 0 && points.allFinite(), "CellFit: points on a plane must be finite, and at least one");
  Observation o;
  o.kind = ObservationKind::PlanePoints;
  o.chain = chain;
  o.points = points;
  o.whitening_matrix = whitening_of<Eigen::Dynamic>(covariance, points.cols());
  return impl_->keep(std::move(o), static_cast<int>(points.cols()));
}

FitObservation CellFit::observe_sphere_section(const PoseChain& chain, const FitPoint& centre, double radius,
                                               const Eigen::Vector3d& seen, const Eigen::Matrix3d& covariance,
                                               FitBlock radius_block) {
  impl_->check_point(centre);
  require(radius > 0 && seen.allFinite() && seen[2] > 0, "radii of a sphere and of its section must be positive [m]");
  if (radius_block.exists()) require(impl_->block(radius_block).size() == 1, "radius must be a block of one number");
  Observation o;
  o.kind = ObservationKind::SphereSection;
  o.chain = chain;
  o.point = centre;
  o.distance = radius;
  o.radius = radius_block;
  o.section = seen;
  o.whitening3 = whitening_of<3>(covariance);
  return impl_->keep(std::move(o), 3);
}

FitObservation CellFit::observe_pixels(const PoseChain& T_camera_target, FitBlock camera,
                                       const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& pixels, double sigma,
                                       const FitDeformation& deformation) {
  require(sigma > 0, "sigma must be positive [px]");
  require(points.cols() == pixels.cols() && points.cols() > 0,
          std::to_string(points.cols()) + " points, but " + std::to_string(pixels.cols()) + " pixels");
  require(points.allFinite() && pixels.allFinite(), "points and pixels must be finite");
  impl_->block_of(camera, BlockKind::Camera, "camera");
  if (deformation.amounts.exists())
    require(deformation.displacements.rows() == 3 * points.cols() && deformation.displacements.allFinite() &&
                deformation.displacements.cols() ==
                    impl_->block_of(deformation.amounts, BlockKind::Vector, "vector of a deformation").size(),
            "displacements of a deformation must be finite, three rows a point and one column an amount");
  Observation o;
  o.kind = ObservationKind::Pixels;
  o.chain = T_camera_target;
  o.camera = camera;
  o.points = points;
  o.pixels = pixels;
  o.deformation = deformation;
  o.whitening = Eigen::VectorXd::Constant(points.cols(), 1 / sigma);
  return impl_->keep(std::move(o), static_cast<int>(2 * points.cols()));
}

CellFitResult CellFit::solve(const CellFitOptions& options) {
  options.validate();
  CellFitResult result;
  result.coordinates = impl_->number_coordinates();
  impl_->covariance.resize(0, 0);
  impl_->minimise(options, result);
  if (!options.uncertainty) return result;
  const Eigen::MatrixXd information = impl_->data_information(result);
  const Eigen::MatrixXd open = open_directions(information, options.rank_tolerance);
  name_unidentifiable(open, result);
  Eigen::MatrixXd of_priors = Eigen::MatrixXd::Zero(information.rows(), information.cols());
  impl_->add_prior_information(of_priors);
  impl_->covariance = covariance_of(information + of_priors, options.rank_tolerance);
  result.covariance = impl_->covariance;
  for (const int i : undetermined_coordinates(open, of_priors.diagonal())) {
    result.undetermined.push_back(result.coordinates[static_cast<std::size_t>(i)]);
    result.covariance.row(i).setZero();
    result.covariance.col(i).setZero();
    result.covariance(i, i) = std::numeric_limits<double>::infinity();
  }
  return result;
}

Pose CellFit::pose(FitBlock block) const { return impl_->block_of(block, BlockKind::Pose, "pose").pose(); }
kinematics::DhChain CellFit::arm(FitBlock block) const { return impl_->block_of(block, BlockKind::Arm, "arm").arm(); }
Pinhole CellFit::camera(FitBlock block) const { return impl_->block_of(block, BlockKind::Camera, "camera").camera(); }
Eigen::VectorXd CellFit::values(FitBlock block) const { return impl_->block(block).values; }
Eigen::VectorXd CellFit::change(FitBlock block) const { return impl_->block(block).change(); }

std::vector<int> CellFit::coordinates(FitBlock block) const {
  impl_->block(block);
  require(!impl_->places.empty(), "CellFit: solve() comes first");
  return impl_->places[static_cast<std::size_t>(block.index)];
}

Eigen::VectorXd CellFit::residuals(FitObservation observation) const {
  const Observation& o = impl_->observation(observation);
  Eigen::VectorXd r(o.rows);
  if (!o.evaluate(impl_->blocks, impl_->values(o).data(), o.rows, 1.0, r.data(), nullptr))
    r.setConstant(std::numeric_limits<double>::infinity());
  return r;
}

std::optional<CellFit::Derivatives> CellFit::derivatives(FitObservation observation, bool condensed) const {
  const Observation& o = impl_->observation(observation);
  if (impl_->places.empty()) impl_->number_coordinates();
  auto at = impl_->linearise({&o}, condensed, 1.0);
  if (!at) return std::nullopt;
  Derivatives out{std::move(at->r), Eigen::MatrixXd::Zero(at->J.rows(), impl_->coordinate_count()), std::move(at->N)};
  for (std::size_t k = 0; k < at->index.size(); ++k)  // tied coordinates share a place
    out.by_coordinate.col(at->index[k]) += at->J.col(static_cast<Eigen::Index>(k));
  return out;
}

CellFit::SquaredResiduals CellFit::squared_residuals(std::span<const FitObservation> observations, int first_row,
                                                     int end_row) const {
  require(!impl_->places.empty(), "CellFit: solve() comes first");
  const Eigen::Index n = impl_->coordinate_count();
  SquaredResiduals out{.gradient = Eigen::VectorXd::Zero(n), .information = Eigen::MatrixXd::Zero(n, n)};
  for (const FitObservation handle : observations) {
    const Observation& o = impl_->observation(handle);
    const int rows = std::min(end_row, o.rows) - first_row;
    if (!(o.weight > 0) || rows <= 0) continue;
    require(impl_->nuisance_of(o) < 0, "CellFit: squared residuals of a measurement with a nuisance");
    const auto about = impl_->linearise({&o}, false);
    if (!about) continue;
    const auto J = about->J.middleRows(first_row, rows);
    const auto r = about->r.segment(first_row, rows);
    out.squares += r.squaredNorm(), out.rows += rows;
    const Eigen::VectorXd g = J.transpose() * r;
    const Eigen::MatrixXd part = J.transpose() * J;
    for (std::size_t a = 0; a < about->index.size(); ++a) {
      out.gradient[about->index[a]] += g[static_cast<Eigen::Index>(a)];
      for (std::size_t b = 0; b < about->index.size(); ++b)
        out.information(about->index[a], about->index[b]) +=
            part(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b));
    }
  }
  return out;
}

CellFit::Agreement CellFit::agreement(FitObservation observation) const {
  return agreement(std::span(&observation, 1));
}

CellFit::Agreement CellFit::agreement(std::span<const FitObservation> observations) const {
  require(!observations.empty(), "CellFit: agreement of no measurement");
  require(impl_->covariance.size() > 0, "CellFit: solve() with its uncertainty comes first");
  const bool used = impl_->observation(observations.front()).weight > 0;
  std::vector<const Observation*> group;
  Agreement out;
  for (const FitObservation handle : observations) {
    const Observation& o = impl_->observation(handle);
    require((o.weight > 0) == used, "CellFit: agreement of measurements of which some are in use");
    out.dof += o.rows;
    group.push_back(&o);
  }
  const auto at = impl_->linearise(group, false, used ? std::nullopt : std::optional(1.0));
  if (!at) {
    out.squared_distance = std::numeric_limits<double>::infinity();
    out.residuals = Eigen::VectorXd::Constant(out.dof, out.squared_distance);
    out.redundancy = Eigen::VectorXd::Ones(out.dof);
    return out;
  }
  Eigen::MatrixXd J = at->J, own = Eigen::MatrixXd::Identity(out.dof, out.dof);
  out.residuals = at->r;
  if (at->N.cols() > 0) {
    const Block& nuisance = impl_->blocks[static_cast<std::size_t>(impl_->nuisance_of(*group.front()))];
    const WithoutNuisance left = eliminate(at->N, at->prior);
    J = left.M * at->J;
    own = left.P;
    out.dof = left.rank;
    out.residuals = left.M * (nuisance.prior.size() ? Eigen::VectorXd(at->r - at->N * nuisance.change()) : at->r);
  }
  const Eigen::MatrixXd spread = J * impl_->covariance_of(at->index) * J.transpose();
  // A measurement that took part has pulled the answer towards itself, one that did not is as uncertain as both.
  const Eigen::MatrixXd Q = used ? Eigen::MatrixXd(own - spread) : Eigen::MatrixXd(own + spread);
  const SymmetricEigen eigen = symmetric_eigen(Q);
  const Eigen::VectorXd along = eigen.vectors.transpose() * out.residuals;
  for (Eigen::Index k = 0; k < along.size(); ++k)
    if (eigen.values[k] > 1e-9) out.squared_distance += along[k] * along[k] / eigen.values[k];
  out.redundancy = Q.diagonal();
  return out;
}

/// Share of the prior of a nuisance that agrees with the data: 1 - variance after over variance before.
Eigen::VectorXd CellFit::Impl::nuisance_redundancy(int nuisance) const {
  const Block& block = blocks[static_cast<std::size_t>(nuisance)];
  const auto& of_block = observations_of[static_cast<std::size_t>(nuisance)];
  const auto at = of_block.empty() ? std::nullopt : linearise(of_block, true);
  if (!at) return Eigen::VectorXd::Zero(block.size());
  const Eigen::MatrixXd inner = at->N.transpose() * at->N + at->prior.transpose() * at->prior;
  const Eigen::MatrixXd alone = inner.ldlt().solve(Eigen::MatrixXd::Identity(block.size(), block.size()));
  const Eigen::MatrixXd by_others = alone * at->N.transpose() * at->J;
  const Eigen::MatrixXd after = alone + by_others * covariance_of(at->index) * by_others.transpose();
  return Eigen::VectorXd::Ones(block.size()) - (at->prior * after * at->prior.transpose()).diagonal();
}

Eigen::VectorXd CellFit::prior_redundancy(FitBlock block) const {
  const Block& b = impl_->block(block);
  require(b.prior.size() > 0, b.name + " has no prior");
  require(impl_->covariance.size() > 0, "CellFit: solve() with its uncertainty comes first");
  if (b.nuisance) return impl_->nuisance_redundancy(block.index);
  const std::vector<int>& places = impl_->places[static_cast<std::size_t>(block.index)];
  Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(b.size(), b.size());  // of the change from the start
  for (int i = 0; i < b.size(); ++i)
    for (int k = 0; k < b.size(); ++k) {
      const int row = places[static_cast<std::size_t>(i)], column = places[static_cast<std::size_t>(k)];
      if (row >= 0 && column >= 0) spread(i, k) = b.ratio[i] * b.ratio[k] * impl_->covariance(row, column);
    }
  const Eigen::MatrixXd by_coordinates = b.change_by_coordinates(b.values.data());
  const Eigen::VectorXd variance = (by_coordinates * spread * by_coordinates.transpose()).diagonal();
  Eigen::VectorXd out = Eigen::VectorXd::Zero(b.size());
  for (int i = 0; i < b.size(); ++i)
    if (places[static_cast<std::size_t>(i)] >= 0) out[i] = 1 - variance[i] / (b.prior[i] * b.prior[i]);
  return out;
}

}  // namespace kr5::fit
