// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <kr5/core/error.hpp>
#include <kr5/core/fields.hpp>

/// @file
/// Levenberg-Marquardt for small dense least-squares problems (Moré 1978; Nocedal and Wright 2006, section 10.3): the
/// one optimiser of resection, edges in images, depth profiles and the diagnosis. With a fixed number of parameters
/// nothing allocates, and nothing but the constructor throws, so that it may run in a control cycle.

namespace kr5 {

/// The normal equations of residuals r(x) at one x, which may be weighted. N: number of parameters, or Eigen::Dynamic.
template <int N>
struct NormalEquations {
  using Vector = Eigen::Matrix<double, N, 1>;
  using Matrix = Eigen::Matrix<double, N, N>;

  Matrix information;  ///< Sum of w J^T J, J the derivative of a residual; only the lower triangle is used.
  Vector gradient;     ///< Sum of w J^T r: half the derivative of the cost.
  double cost = 0.0;   ///< Sum of w r^2, or of a robust loss; infinite or NaN where the model does not exist.
  int count = 0;       ///< Number of residuals.

  explicit NormalEquations(Eigen::Index size = N == Eigen::Dynamic ? 0 : N)
      : information(Matrix::Zero(size, size)), gradient(Vector::Zero(size)) {}

  /// Adds a residual of the given weight.
  void add(const Vector& jacobian, double residual, double weight = 1.0) noexcept {
    accumulate(jacobian, residual, weight);
    cost += weight * residual * residual;
  }

  /// Adds a residual whose loss grows only linearly beyond `limit` (Huber).
  void add_huber(const Vector& jacobian, double residual, double limit) noexcept {
    const double size = std::abs(residual);
    accumulate(jacobian, residual, size > limit ? limit / size : 1.0);
    cost += size > limit ? limit * (2 * size - limit) : size * size;
  }

  /// Takes a parameter out: it does not move.
  void hold(Eigen::Index parameter) noexcept {
    information.row(parameter).setZero();
    information.col(parameter).setZero();
    gradient[parameter] = 0;
  }

  /// Variance of a residual of weight 1: the cost over the degrees of freedom, at least one.
  double variance() const noexcept {
    return cost / std::max<double>(1.0, static_cast<double>(count) - static_cast<double>(gradient.size()));
  }

  /// Covariance of the estimate for residuals of the given variance; empty when the residuals do not determine every
  /// parameter.
  std::optional<Matrix> covariance(double residual_variance) const {
    const Vector scale = information.diagonal().cwiseSqrt().cwiseInverse();
    if (!scale.allFinite()) return std::nullopt;
    const Matrix full = information.template selfadjointView<Eigen::Lower>();
    const Eigen::LDLT<Matrix> factors(Matrix(scale.asDiagonal() * full * scale.asDiagonal()));
    if (!(factors.vectorD().minCoeff() > 1e-14)) return std::nullopt;  // the diagonal was 1
    const Matrix inverse = factors.solve(Matrix::Identity(scale.size(), scale.size()));
    return Matrix(residual_variance * scale.asDiagonal() * inverse * scale.asDiagonal());
  }
  std::optional<Matrix> covariance() const { return covariance(variance()); }

 private:
  void accumulate(const Vector& jacobian, double residual, double weight) noexcept {
    const int n = N == Eigen::Dynamic ? static_cast<int>(jacobian.size()) : N;
    for (int c = 0; c < n; ++c) {  // the lower triangle, in whole pairs; rankUpdate is slower at this size
      const double factor = weight * jacobian[c];
      for (int r = c & ~1; r < n; ++r) information(r, c) += factor * jacobian[r];
    }
    gradient += weight * residual * jacobian;
    ++count;
  }
};

/// State of a minimisation.
enum class LevenbergMarquardtStatus {
  Running,        ///< step() is to be tried.
  Converged,      ///< step() is negligible; it may be taken without trying it.
  MaxIterations,  ///< Stopped after the allowed number of trials.
  NoDecrease,     ///< No step lowers the cost, however short: a kink, rounding, or derivatives that are wrong.
  NotFinite,      ///< The normal equations are not finite.
};

constexpr auto enum_names(LevenbergMarquardtStatus) {
  return names<LevenbergMarquardtStatus>({{LevenbergMarquardtStatus::Running, "running"},
                                          {LevenbergMarquardtStatus::Converged, "converged"},
                                          {LevenbergMarquardtStatus::MaxIterations, "max_iterations"},
                                          {LevenbergMarquardtStatus::NoDecrease, "no_decrease"},
                                          {LevenbergMarquardtStatus::NotFinite, "not_finite"}});
}

/// Stopping rule: a minimisation has converged when a step changes the cost by at most tolerance^2 * sigma^2, either as
/// the normal equations predict it (the step is then shorter than `tolerance` standard deviations of the estimate) or
/// as it was found (where derivatives are approximate). For a damped step both changes count times 1 + damping.
struct LevenbergMarquardtOptions {
  int max_iterations = 50;
  double tolerance = 1e-3;        ///< [-]
  double sigma = 0.0;             ///< Unit of the residuals.
  double min_sigma = 1e-9;        ///< Unit of the residuals.
  double initial_damping = 1e-4;  ///< [-]

  /// @throws InvalidArgument naming the field.
  void validate() const {
    require(max_iterations >= 0, "max_iterations must not be negative");
    require(tolerance > 0 && std::isfinite(tolerance), "tolerance must be positive [-]");
    require(sigma >= 0 && std::isfinite(sigma), "sigma must not be negative; 0 means estimated");
    require(min_sigma > 0 && std::isfinite(min_sigma), "min_sigma must be positive");
    require(initial_damping > 0 && std::isfinite(initial_damping), "initial_damping must be positive [-]");
  }

  static void each_field(auto& self, auto&& visit) {
    visit("max_iterations", self.max_iterations, "Maximum number of trial steps.");
    visit("tolerance", self.tolerance, "Step, in standard deviations of the estimate, at which to stop [-].");
    visit("sigma", self.sigma, "Standard deviation of a residual; 0: estimated from the residuals.");
    visit("min_sigma", self.min_sigma, "Lower limit of the estimated sigma, for fits without noise.");
    visit("initial_damping", self.initial_damping, "Damping of the first step, relative to the information [-].");
  }
};

/// The minimisation, one step at a time: for problems whose cost is cheaper than its derivatives, and for real-time
/// code that may spend only some evaluations in a cycle. levenberg_marquardt() is the loop over it:
/// @code
/// optimizer.begin(equations(x));
/// while (optimizer.running()) {
///   const auto trial = x + optimizer.step();
///   if (optimizer.accept(cost(trial))) optimizer.update(equations(x = trial));
/// }
/// @endcode
template <int N>
class LevenbergMarquardt {
 public:
  using Equations = NormalEquations<N>;
  using Vector = typename Equations::Vector;
  using Matrix = typename Equations::Matrix;
  using Status = LevenbergMarquardtStatus;

  /// @throws InvalidArgument for invalid options.
  explicit LevenbergMarquardt(const LevenbergMarquardtOptions& options = {}) : options_(options) {
    options_.validate();
  }

  /// Starts at a point with these normal equations. A parameter whose row of `information` is zero is held.
  void begin(const Equations& at) noexcept {
    damping_ = options_.initial_damping;
    iterations_ = 0;
    status_ = Status::Running;
    update(at);
  }
  /// The normal equations at the point that was accepted; its cost may be another one, when weights have changed.
  void update(const Equations& at) noexcept {
    const bool same_weights = std::abs(at.cost - cost_) <= negligible_;
    if (status_ == Status::Converged && same_weights) return;
    status_ = Status::Running;
    information_ = at.information.template selfadjointView<Eigen::Lower>();
    gradient_ = at.gradient;
    cost_ = at.cost;
    const double sigma =
        options_.sigma > 0 ? options_.sigma : std::max(std::sqrt(std::max(at.variance(), 0.0)), options_.min_sigma);
    negligible_ = options_.tolerance * options_.tolerance * sigma * sigma;
    scale_ = information_.diagonal().unaryExpr([](double a) { return a > 0 ? 1 / std::sqrt(a) : 0.0; });
    information_ = (scale_.asDiagonal() * information_ * scale_.asDiagonal()).eval();
    solve();
    if (running() && iterations_ >= options_.max_iterations) status_ = Status::MaxIterations;
  }

  bool running() const noexcept { return status_ == Status::Running; }
  Status status() const noexcept { return status_; }
  int iterations() const noexcept { return iterations_; }
  /// The change of the parameters to try next.
  const Vector& step() const noexcept { return step_; }

  /// Judges the step by the cost where it leads. When it is accepted, update() must follow; else step() is shorter now.
  bool accept(double cost) noexcept {
    ++iterations_;
    const bool better = cost <= cost_;
    if (std::abs(cost - cost_) * (1 + damping_) <= negligible_) {
      status_ = Status::Converged;
      step_.setZero();
    }
    if (better) {
      cost_ = cost;
      damping_ = std::max(0.1 * damping_, min_damping);
    } else if (running()) {
      damping_ = std::max(10 * damping_, damping_after_failure);
      solve();
      if (running() && damping_ > max_damping) status_ = Status::NoDecrease;
      if (running() && iterations_ >= options_.max_iterations) status_ = Status::MaxIterations;
    }
    return better;
  }

 private:
  static constexpr double min_damping = 1e-9, damping_after_failure = 1e-3, max_damping = 1e8;

  /// Solves the normal equations, scaled to a unit diagonal (so that units do not matter), with the present damping.
  void solve() noexcept {
    Matrix damped = information_;
    for (Eigen::Index i = 0; i < scale_.size(); ++i) damped(i, i) = scale_[i] > 0 ? 1 + damping_ : 1.0;
    step_ = -scale_.cwiseProduct(damped.ldlt().solve(scale_.cwiseProduct(gradient_)));
    const double decrease = -gradient_.dot(step_) * (1 + damping_);  // that damping shortens a step is no convergence
    if (!std::isfinite(cost_) || !step_.allFinite())
      status_ = Status::NotFinite;
    else if (decrease <= negligible_)
      status_ = Status::Converged;
  }

  LevenbergMarquardtOptions options_;
  Matrix information_;
  Vector gradient_, scale_, step_;
  double cost_ = 0.0, negligible_ = 0.0, damping_ = 0.0;
  int iterations_ = 0;
  Status status_ = Status::NotFinite;
};

/// Bounds of each parameter; equal ones hold it.
template <int N>
struct Box {
  using Vector = Eigen::Matrix<double, N, 1>;
  Vector lower, upper;

  Vector clamp(const Vector& x) const { return x.cwiseMax(lower).cwiseMin(upper); }
  /// Takes out of the equations the parameters that stand at a bound and would leave the box.
  void hold(const Vector& x, NormalEquations<N>& at) const {
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      const bool out = (x[i] <= lower[i] && at.gradient[i] >= 0) || (x[i] >= upper[i] && at.gradient[i] <= 0);
      if (out) at.hold(i);
    }
  }
};

/// Where a minimisation ended.
template <int N, class State>
struct LevenbergMarquardtResult {
  State x;
  NormalEquations<N> equations;  ///< At the last point tried that was accepted; gives cost and covariance.
  LevenbergMarquardtStatus status = LevenbergMarquardtStatus::NotFinite;
  int iterations = 0;

  bool converged() const { return status == LevenbergMarquardtStatus::Converged; }
  /// Whether this is a minimum, as far as rounding and the derivatives let it be seen.
  bool usable() const { return converged() || status == LevenbergMarquardtStatus::NoDecrease; }
};

/// Minimises the cost of `problem` from `x`. State: Eigen::Vector, or any type that `moved` takes.
///
/// The problem needs `NormalEquations<N> equations(const State&)`, and may have
/// - `double cost(const State&)`: when it is cheaper than the equations, which are then asked for at accepted points;
/// - `State moved(const State&, const Vector& step)`: when it is not x + step, as for poses, or shorter, to stay where
/// the model exists;
/// - `bool reweigh(const State&, const NormalEquations<N>&)`: called at accepted points, returns whether weights
/// changed;
/// - `Box<N> box`: bounds that are kept at every point, after `moved`. The start is moved into them.
/// @throws InvalidArgument for invalid options.
template <int N, class State, class Problem>
LevenbergMarquardtResult<N, State> levenberg_marquardt(State x, Problem&& problem,
                                                       const LevenbergMarquardtOptions& options = {}) {
  using Vector = typename NormalEquations<N>::Vector;
  constexpr bool boxed = requires { problem.box; };
  constexpr bool has_cost = requires { problem.cost(x); };
  const auto moved = [&](const State& from, const Vector& step) -> State {
    const auto free = [&]() -> State {
      if constexpr (requires { problem.moved(from, step); })
        return problem.moved(from, step);
      else
        return from + step;
    };
    if constexpr (boxed)
      return problem.box.clamp(free());
    else
      return free();
  };
  const auto free_of = [&](const NormalEquations<N>& at) {
    NormalEquations<N> out = at;
    if constexpr (boxed) problem.box.hold(x, out);
    return out;
  };
  LevenbergMarquardt<N> optimizer(options);
  if constexpr (boxed) x = problem.box.clamp(x);
  NormalEquations<N> now = problem.equations(x);
  optimizer.begin(free_of(now));
  while (optimizer.running()) {
    State trial = moved(x, optimizer.step());
    NormalEquations<N> next = now;
    if constexpr (has_cost)
      next.cost = problem.cost(trial);
    else
      next = problem.equations(trial);
    if (!optimizer.accept(next.cost)) continue;
    x = std::move(trial);
    bool stale = has_cost;
    if constexpr (requires { problem.reweigh(x, next); }) stale = problem.reweigh(x, next) || stale;
    now = stale ? problem.equations(x) : next;
    optimizer.update(free_of(now));
  }
  if (optimizer.status() == LevenbergMarquardtStatus::Converged) x = moved(x, optimizer.step());
  return {std::move(x), std::move(now), optimizer.status(), optimizer.iterations()};
}

}  // namespace kr5
