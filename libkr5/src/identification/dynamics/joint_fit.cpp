// SPDX-License-Identifier: BSD-3-Clause
#include "identification/dynamics/joint_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>
#include <Eigen/QR>

#include <kr5/core/linear.hpp>
#include <kr5/core/statistics.hpp>

#include "identification/dynamics/column_algebra.hpp"
#include "identification/dynamics/friction_terms.hpp"
#include "identification/log/runs.hpp"

namespace kr5::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using physics::RowRange;
using Positions = std::vector<std::vector<int>>;

VectorXd chosen(const VectorXd& beta, const std::vector<int>& positions) {
  VectorXd out(static_cast<Index>(positions.size()));
  for (std::size_t k = 0; k < positions.size(); ++k) out[static_cast<Index>(k)] = beta[positions[k]];
  return out;
}

MatrixXd residuals_of(const JointRows& rows, const Positions& positions, const VectorXd& beta) {
  MatrixXd out = rows.tau;
  for (std::size_t i = 0; i < positions.size(); ++i)
    out.col(static_cast<Index>(i)) -= rows.regressors[i].X * chosen(beta, positions[i]);
  return out;
}

/// Square of a factor that never vanishes, so that exact data have weights.
double safe_sigma(double variance, double scale) { return std::max(std::sqrt(std::max(variance, 0.0)), 1e-12 * scale); }

/// beta from R of [Y | tau]; columns that the data do not tell beside those before them are zero.
struct Solution {
  VectorXd beta;
  MatrixXd R;  ///< Of the told columns.
  std::vector<int> told, untold;
};

Solution solve(const MatrixXd& factor, double rank_tolerance) {
  const Index b = factor.cols() - 1;
  Solution out;
  out.beta = VectorXd::Zero(b);
  std::vector<int> order(static_cast<std::size_t>(b));
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = static_cast<int>(k);
  const ColumnSplit split = split_columns(factor.leftCols(b), order, rank_tolerance);
  out.told = split.independent;
  out.untold = split.dependent;
  if (out.told.empty()) return out;
  MatrixXd A(factor.rows(), static_cast<Index>(out.told.size()) + 1);
  for (std::size_t k = 0; k < out.told.size(); ++k) A.col(static_cast<Index>(k)) = factor.col(out.told[k]);
  A.col(A.cols() - 1) = factor.col(b);
  const MatrixXd R = triangular_factor(A);
  out.R = R.topLeftCorner(A.cols() - 1, A.cols() - 1);
  const VectorXd beta = out.R.triangularView<Eigen::Upper>().solve(R.col(A.cols() - 1).head(A.cols() - 1));
  for (std::size_t k = 0; k < out.told.size(); ++k) out.beta[out.told[k]] = beta[static_cast<Index>(k)];
  return out;
}

/// Columns `told` of a factor of all columns.
MatrixXd told_columns(const MatrixXd& A, const std::vector<int>& told) {
  MatrixXd out(A.rows(), static_cast<Index>(told.size()));
  for (std::size_t k = 0; k < told.size(); ++k) out.col(static_cast<Index>(k)) = A.col(told[k]);
  return out;
}

/// R of [X | y] of each joint.
std::vector<MatrixXd> joint_factors(const JointRows& rows) {
  std::vector<MatrixXd> out;
  for (std::size_t i = 0; i < rows.regressors.size(); ++i) {
    const MatrixXd& X = rows.regressors[i].X;
    MatrixXd both(X.rows(), X.cols() + 1);
    both << X, rows.tau.col(static_cast<Index>(i));
    out.push_back(triangular_factor(both));
  }
  return out;
}

/// Rows in which several neighbours of a run stand as one: their sum over the root of their number.
MatrixXd merged_rows(const MatrixXd& X, const std::vector<RowRange>& runs, Index each) {
  if (each == 1) return X;
  Index rows = 0;
  for (const RowRange& run : runs) rows += (run.size() + each - 1) / each;
  MatrixXd out(rows, X.cols());
  for (Index c = 0; c < X.cols(); ++c) {
    const double* from = X.col(c).data();
    double* to = out.col(c).data();
    for (const RowRange& run : runs)
      for (Index first = run.first; first < run.last; first += each) {
        const Index last = std::min(first + each, run.last);
        double sum = 0.0;
        for (Index t = first; t < last; ++t) sum += from[t];
        *to++ = sum / std::sqrt(static_cast<double>(last - first));
      }
  }
  return out;
}

/// How many neighbouring rows may stand as one in sums of columns times noise: as many as the columns hardly differ in,
/// so that what such sums hold of the noise is its mean over them. Logs of arms are sampled much faster than arms move.
Index mergeable_rows(const std::vector<JointRegressor>& regressors, const std::vector<RowRange>& runs) {
  constexpr double lost = 0.01;     // part of a squared column that may be lost [-]
  constexpr Index min_rows = 1000;  // that remain
  Index out = 64;
  for (const JointRegressor& joint : regressors) {
    while (out > 1 && joint.X.rows() < out * min_rows) out /= 2;
    const double rounding = 1e-20 * joint.X.colwise().squaredNorm().maxCoeff();
    for (Index c = 0; c < joint.X.cols() && out > 1; ++c) {
      const double whole = joint.X.col(c).squaredNorm();
      if (whole <= rounding) continue;
      while (out > 1 && merged_rows(joint.X.col(c), runs, out).squaredNorm() < (1 - lost) * whole) out /= 2;
    }
  }
  return out;
}

/// Rows of the noise: merged.
struct NoiseRows {
  std::vector<MatrixXd> X, Z;  ///< Z where instruments multiply from the left, otherwise empty.
  MatrixXd tau;
  std::vector<RowRange> runs;

  const MatrixXd& left(std::size_t joint) const { return Z.empty() ? X[joint] : Z[joint]; }
};

NoiseRows noise_rows(const JointRows& rows, const std::vector<JointRegressor>& left, Index each) {
  const std::vector<RowRange> runs = runs_of(rows.run_starts, rows.samples());
  NoiseRows out;
  for (const JointRegressor& joint : rows.regressors) out.X.push_back(merged_rows(joint.X, runs, each));
  if (&left != &rows.regressors)
    for (const JointRegressor& joint : left) out.Z.push_back(merged_rows(joint.X, runs, each));
  out.tau = merged_rows(rows.tau, runs, each);
  Index first = 0;
  for (const RowRange& run : runs) {
    const Index last = first + (run.size() + each - 1) / each;
    out.runs.push_back({first, last});
    first = last;
  }
  return out;
}

/// Filters columns backwards in time by 1 / A: with it, X^T Gamma X = sigma^2 result^T result for the covariance Gamma
/// of the autoregressive series.
MatrixXd correlated_columns(const MatrixXd& X, const Autoregression& model, const std::vector<RowRange>& runs) {
  MatrixXd out = X;
  const Index p = model.a.size();
  for (Index c = 0; c < out.cols(); ++c) {
    double* u = out.col(c).data();
    for (const RowRange& run : runs)
      for (Index t = run.last; t-- > run.first;) {
        const Index reach = std::min(p, run.last - 1 - t);
        for (Index k = 1; k <= reach; ++k) u[t] -= model.a[k - 1] * u[t + k];
      }
  }
  return out;
}

/// The meat of the sandwich: sum of w_i^4 X_i^T Gamma_i X_i.
MatrixXd scores(const NoiseRows& rows, const Positions& positions, Index columns,
                const std::vector<Autoregression>& noise, const VectorXd& squared_weights) {
  MatrixXd out = MatrixXd::Zero(columns, columns);
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const MatrixXd U = correlated_columns(rows.left(i), noise[i], rows.runs).transpose();
    MatrixXd G = MatrixXd::Zero(U.rows(), U.rows());
    G.selfadjointView<Eigen::Lower>().rankUpdate(U,
                                                 std::pow(noise[i].sigma * squared_weights[static_cast<Index>(i)], 2));
    out(positions[i], positions[i]) += MatrixXd(G.selfadjointView<Eigen::Lower>());
  }
  return out;
}

/// P S P^T over the told columns, which are those of P.
MatrixXd sandwich(const MatrixXd& P, const MatrixXd& S, const std::vector<int>& told) {
  const MatrixXd out = P * S(told, told) * P.transpose();
  return 0.5 * (out + out.transpose());
}

/// Weighted least squares with the variance of each joint estimated in turns.
struct WeightedFit {
  Solution solution;
  MatrixXd factor;  ///< Of all rows without weights.
  VectorXd weights;
  int iterations = 0;
  bool converged = false;
};

WeightedFit weighted_fit(const JointRows& rows, const Positions& positions, const JointFitOptions& options) {
  const std::vector<MatrixXd> factors = joint_factors(rows);
  const Index n = rows.joints(), b = rows.size();
  const double scale = rows.tau.norm() / std::sqrt(static_cast<double>(rows.tau.size()));
  WeightedFit out;
  out.weights = VectorXd::Ones(n);
  out.factor = stacked_factor(factors, positions, b + 1, out.weights).topLeftCorner(b, b);
  VectorXd before = VectorXd::Zero(n);
  while (true) {
    const MatrixXd R = stacked_factor(factors, positions, b + 1, out.weights);
    out.solution = solve(R, options.rank_tolerance);
    ++out.iterations;
    VectorXd sigma(n);
    for (Index i = 0; i < n; ++i) {
      const MatrixXd& F = factors[static_cast<std::size_t>(i)];
      const Index p = F.cols() - 1;
      const VectorXd left =
          F.col(p) - F.leftCols(p) * chosen(out.solution.beta, positions[static_cast<std::size_t>(i)]);
      // Degrees of freedom that this joint's rows have given to the estimate: the trace of their part of the hat
      // matrix.
      MatrixXd wide = MatrixXd::Zero(p + 1, b);
      for (Index c = 0; c < p; ++c)
        wide.col(positions[static_cast<std::size_t>(i)][static_cast<std::size_t>(c)]) = F.col(c);
      const MatrixXd told = told_columns(wide, out.solution.told).transpose();
      const double taken =
          told.rows() == 0 ? 0.0
                           : std::pow(out.weights[i], 2) *
                                 out.solution.R.transpose().triangularView<Eigen::Lower>().solve(told).squaredNorm();
      const double freedom = std::max(1.0, rows.used_rows(i) - taken);
      sigma[i] = safe_sigma(left.squaredNorm() / freedom, scale);
    }
    const bool settled = ((sigma - before).array().abs() <= 1e-4 * sigma.array()).all();
    before = sigma;
    if (options.estimator == Estimator::Ordinary) {
      out.converged = true;
      return out;
    }
    out.weights = sigma.cwiseInverse();
    out.converged = settled;
    if (settled || out.iterations >= options.max_iterations) return out;
  }
}

VectorXd joint_sigma(const JointRows& rows, const MatrixXd& residuals, double scale) {
  VectorXd out(residuals.cols());
  for (Index i = 0; i < out.size(); ++i) out[i] = safe_sigma(residuals.col(i).squaredNorm() / rows.used_rows(i), scale);
  return out;
}

/// Normal equations A beta = b over the told columns, of rows Z^T D X.
struct Equations {
  MatrixXd A;
  VectorXd b;
};

/// Adds Z^T X and Z^T tau of one joint.
void add_equations(Equations& out, const std::vector<int>& positions, const MatrixXd& Z, const MatrixXd& X,
                   const VectorXd& tau) {
  const MatrixXd A = Z.transpose() * X;
  const VectorXd b = Z.transpose() * tau;
  for (Index r = 0; r < A.rows(); ++r) {
    const int to = positions[static_cast<std::size_t>(r)];
    out.b[to] += b[r];
    for (Index c = 0; c < A.cols(); ++c) out.A(to, positions[static_cast<std::size_t>(c)]) += A(r, c);
  }
}

Equations normal_equations(const JointRows& rows, const std::vector<JointRegressor>& left, const Positions& positions,
                           const MatrixXd& weights) {
  Equations out{MatrixXd::Zero(rows.size(), rows.size()), VectorXd::Zero(rows.size())};
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const auto column = static_cast<Index>(i);
    add_equations(out, positions[i], weights.col(column).asDiagonal() * left[i].X, rows.regressors[i].X,
                  rows.tau.col(column));
  }
  return out;
}

/// Solves the equations of the told columns, each scaled to its own size; `inverse` is of A.
VectorXd solve_told(const Equations& at, const std::vector<int>& told, MatrixXd& inverse) {
  const auto count = static_cast<Index>(told.size());
  MatrixXd A(count, count);
  VectorXd b(count);
  for (Index r = 0; r < count; ++r) {
    b[r] = at.b[told[static_cast<std::size_t>(r)]];
    for (Index c = 0; c < count; ++c)
      A(r, c) = at.A(told[static_cast<std::size_t>(r)], told[static_cast<std::size_t>(c)]);
  }
  const VectorXd scale = A.diagonal().cwiseAbs().cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
  inverse = Eigen::PartialPivLU<MatrixXd>(MatrixXd(scale.asDiagonal() * A * scale.asDiagonal())).inverse();
  inverse = (scale.asDiagonal() * inverse * scale.asDiagonal()).eval();
  const VectorXd x = inverse * b;
  VectorXd out = VectorXd::Zero(at.b.size());
  for (Index k = 0; k < count; ++k) out[told[static_cast<std::size_t>(k)]] = x[k];
  return out;
}

/// Rows without their correlation: x_t + a_1 x_(t-1) + ...; the first ones of each run, which lack those before, are
/// zero.
MatrixXd uncorrelated_rows(const MatrixXd& X, const Autoregression& model, const std::vector<RowRange>& runs) {
  MatrixXd out = MatrixXd::Zero(X.rows(), X.cols());
  const Index order = model.a.size();
  for (const RowRange& run : runs) {
    const Index count = run.size() - order;
    if (count <= 0) continue;
    auto rows = out.middleRows(run.first + order, count);
    rows = X.middleRows(run.first + order, count);
    for (Index k = 1; k <= order; ++k) rows += model.a[k - 1] * X.middleRows(run.first + order - k, count);
  }
  return out;
}

/// The model of the residuals of a joint, of which those of rows that are left out are zero.
Autoregression of_used_rows(Autoregression model, const JointRows& rows, std::size_t joint) {
  const double share = rows.used_rows(static_cast<Index>(joint)) / static_cast<double>(rows.samples());
  model.sigma /= std::sqrt(share), model.variance /= share;
  return model;
}

/// Noise of the merged rows of each joint. An estimate that takes all samples alike fits part of correlated noise, at
/// the frequencies of the motion, and its residuals lack that part. So the noise is that of the residuals of an
/// estimate from rows without the correlation (generalized least squares; Cochrane and Orcutt 1949). These lack least,
/// and it is known what: their covariance is that of the noise less that of the torques which the estimate predicts.
/// @param residuals From which the correlation is known at first, merged.
std::vector<Autoregression> noise_models(const JointRows& rows, const NoiseRows& merged, const Positions& positions,
                                         const std::vector<int>& told, const MatrixXd& residuals) {
  std::vector<Autoregression> out;
  for (std::size_t i = 0; i < positions.size(); ++i)
    out.push_back(of_used_rows(fit_autoregression(residuals.col(static_cast<Index>(i)), merged.runs), rows, i));
  if (std::any_of(out.begin(), out.end(), [](const Autoregression& m) { return !(m.sigma > 0); })) return out;
  Equations sum{MatrixXd::Zero(rows.size(), rows.size()), VectorXd::Zero(rows.size())};
  for (std::size_t i = 0; i < positions.size(); ++i)
    add_equations(sum, positions[i],
                  uncorrelated_rows(merged.left(i), out[i], merged.runs) / (out[i].sigma * out[i].sigma),
                  uncorrelated_rows(merged.X[i], out[i], merged.runs),
                  uncorrelated_rows(merged.tau.col(static_cast<Index>(i)), out[i], merged.runs));
  MatrixXd inverse;
  const VectorXd beta = solve_told(sum, told, inverse);
  const SymmetricEigen axes = symmetric_eigen(MatrixXd(0.5 * (inverse + inverse.transpose())));
  if (!beta.allFinite() || !axes.vectors.allFinite()) return out;
  MatrixXd half = MatrixXd::Zero(rows.size(), axes.values.size());
  half(told, Eigen::all) = axes.vectors * axes.values.cwiseMax(0.0).cwiseSqrt().asDiagonal();
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const VectorXd others = merged.tau.col(static_cast<Index>(i)) - merged.X[i] * chosen(beta, positions[i]);
    VectorXd covariance = autocovariances(others, merged.runs);
    const MatrixXd own = triangular_factor(MatrixXd(half(positions[i], Eigen::all)).transpose()).transpose();
    const MatrixXd predicted = merged.X[i] * own;
    for (Index c = 0; c < predicted.cols(); ++c) covariance += autocovariances(predicted.col(c), merged.runs);
    out[i] = of_used_rows(autoregression_of(covariance, merged.tau.rows()), rows, i);
  }
  return out;
}

/// Samples that count as one, and the independent ones on which the noise of a joint is known, of the joint with the
/// fewest: less its share of the parameters.
/// @param residuals Of single rows.
void set_correlation(const JointRows& rows, const MatrixXd& residuals, std::size_t told, JointFit& fit) {
  fit.correlation.resize(static_cast<Index>(fit.noise.size()));
  double fewest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < fit.noise.size(); ++i) {
    const auto joint = static_cast<Index>(i);
    const double variance =
        fit.merged == 1 ? fit.noise[i].variance : residuals.col(joint).squaredNorm() / rows.used_rows(joint);
    fit.correlation[joint] = variance > 0 ? std::max(1.0, fit.noise[i].long_run_variance() / variance) : 1.0;
    fewest = std::min(fewest, rows.used_rows(joint) / fit.correlation[joint]);
  }
  fit.freedom = std::max(1.0, fewest - static_cast<double>(told) / static_cast<double>(fit.noise.size()));
}

/// Finds the noise of an estimate; the rows as it is the noise of.
NoiseRows find_noise(const JointRows& rows, const std::vector<JointRegressor>& left, const Positions& positions,
                     const std::vector<int>& told, const MatrixXd& residuals, JointFit& fit) {
  const std::vector<RowRange> runs = runs_of(rows.run_starts, rows.samples());
  fit.merged = std::min(mergeable_rows(rows.regressors, runs),
                        &left == &rows.regressors ? rows.samples() : mergeable_rows(left, runs));
  NoiseRows merged = noise_rows(rows, left, fit.merged);
  fit.noise = noise_models(rows, merged, positions, told, merged_rows(residuals, runs, fit.merged));
  set_correlation(rows, residuals, told.size(), fit);
  return merged;
}

/// Covariance of all columns from that of the told ones.
MatrixXd with_untold(const MatrixXd& covariance, const std::vector<int>& told, Index columns) {
  MatrixXd out = MatrixXd::Zero(columns, columns);
  out.diagonal().setConstant(std::numeric_limits<double>::infinity());
  for (std::size_t r = 0; r < told.size(); ++r)
    for (std::size_t c = 0; c < told.size(); ++c)
      out(told[r], told[c]) = covariance(static_cast<Index>(r), static_cast<Index>(c));
  return out;
}

/// Standard deviation of the residuals by their median. A torque of exactly zero is one that was left out, or one below
/// the resolution of the drive, as at rest: it says nothing of the noise, though it may be most of a log.
double robust_sigma(const VectorXd& residuals, const VectorXd& torques, double scale) {
  std::vector<double> sizes;
  for (Index k = 0; k < residuals.size(); ++k)
    if (torques[k] != 0.0) sizes.push_back(std::abs(residuals[k]));
  if (sizes.empty()) return 1e-12 * scale;
  return std::max(mad_to_sigma * median(std::move(sizes)), 1e-12 * scale);
}

/// Covariance of the estimate Z^T W (tau - X beta) = 0 with constant weights of the joints, for noise as it was found.
void set_covariance(const JointRows& rows, const std::vector<JointRegressor>& left, const Positions& positions,
                    const std::vector<int>& told, const MatrixXd& residuals, const MatrixXd& weights, JointFit& fit) {
  const NoiseRows merged = find_noise(rows, left, positions, told, residuals, fit);
  MatrixXd inverse;
  solve_told(normal_equations(rows, left, positions, weights), told, inverse);
  const MatrixXd S = scores(merged, positions, rows.size(), fit.noise, weights.row(0).transpose());
  fit.covariance = with_untold(sandwich(inverse, S, told), told, rows.size());
}

/// Huber's estimate by reweighting, from the weighted one.
void refine_robust(const JointRows& rows, const Positions& positions, const JointFitOptions& options,
                   const std::vector<int>& told, double scale, JointFit& fit) {
  VectorXd sigma(rows.joints());
  MatrixXd weights(rows.samples(), rows.joints()), inverse;
  fit.converged = false;
  while (!fit.converged && fit.iterations < options.max_iterations) {
    for (Index i = 0; i < rows.joints(); ++i) {
      sigma[i] = robust_sigma(fit.residuals.col(i), rows.tau.col(i), scale);
      const double limit = options.huber * sigma[i];
      weights.col(i) = fit.residuals.col(i).unaryExpr(
          [&](double e) { return (std::abs(e) > limit ? limit / std::abs(e) : 1.0) / (sigma[i] * sigma[i]); });
    }
    const VectorXd next = solve_told(normal_equations(rows, rows.regressors, positions, weights), told, inverse);
    ++fit.iterations;
    const MatrixXd moved = residuals_of(rows, positions, next);
    fit.converged = ((moved - fit.residuals).colwise().norm().transpose().array() <=
                     1e-4 * sigma.array() * std::sqrt(static_cast<double>(rows.samples())))
                        .all();
    fit.beta = next;
    fit.residuals = moved;
  }
  fit.sigma = sigma;
  // The estimate is as that of least squares from torques whose noise is the clipped residuals over the slope of their
  // mean, which is the share of residuals that are not clipped.
  JointRows clipped = rows;
  MatrixXd slope(rows.samples(), rows.joints()), scores = fit.residuals;
  for (Index i = 0; i < rows.joints(); ++i) {
    const double limit = options.huber * sigma[i];
    const auto clipped_rows = static_cast<double>((fit.residuals.col(i).array().abs() > limit).count());
    const double share = std::max(1 - clipped_rows / rows.used_rows(i), 0.1);
    scores.col(i) = scores.col(i).cwiseMax(-limit).cwiseMin(limit) / share;
    slope.col(i).setConstant(1.0 / (sigma[i] * sigma[i]));
  }
  clipped.tau += scores - fit.residuals;
  set_covariance(clipped, rows.regressors, positions, told, scores, slope, fit);
}

/// Instrumental variables: Z^T W (tau - X beta) = 0, with the weights of the residuals in turns.
void refine_instruments(const JointRows& rows, const std::vector<JointRegressor>& instruments,
                        const Positions& positions, const JointFitOptions& options, const std::vector<int>& told,
                        double scale, JointFit& fit) {
  MatrixXd inverse;
  VectorXd before = VectorXd::Zero(rows.joints());
  fit.converged = false;
  while (!fit.converged && fit.iterations < options.max_iterations) {
    fit.sigma = joint_sigma(rows, fit.residuals, scale);
    const MatrixXd weights = fit.sigma.array().square().inverse().matrix().transpose().replicate(rows.samples(), 1);
    fit.beta = solve_told(normal_equations(rows, instruments, positions, weights), told, inverse);
    fit.residuals = residuals_of(rows, positions, fit.beta);
    ++fit.iterations;
    fit.converged = ((fit.sigma - before).array().abs() <= 1e-4 * fit.sigma.array()).all();
    before = fit.sigma;
  }
  const VectorXd weights = fit.sigma.cwiseAbs2().cwiseInverse();
  set_covariance(rows, instruments, positions, told, fit.residuals, weights.transpose().replicate(rows.samples(), 1),
                 fit);
}

}  // namespace

double root_mean_square(const Eigen::Ref<const VectorXd>& values) {
  return std::sqrt(values.squaredNorm() / static_cast<double>(values.size()));
}

Eigen::ArrayXd moving_samples(const JointMotion& motion, const MatrixXd& structure, double min_speed, int joint) {
  const VectorXd noise =
      motion.speed_noise.size() > 0 ? motion.speed_noise : VectorXd(VectorXd::Zero(motion.qd.cols()));
  const auto moving = [&](const VectorXd& speed, double speed_noise) -> Eigen::ArrayXd {
    const Eigen::ArrayXd fast = (speed.array().abs() >= min_speed * root_mean_square(speed)).cast<double>();
    return fast * known_signs(speed.array(), speed_noise);
  };
  Eigen::ArrayXd out = moving(motion.qd.col(joint), noise[joint]);
  for (Index motor = 0; motor < structure.rows(); ++motor)
    if (is_shared(structure, motor) && structure(motor, joint) != 0.0) {
      const VectorXd share = structure.row(motor).transpose();
      out *= moving(motion.qd * share, share.cwiseProduct(noise).norm());
    }
  return out;
}

void leave_out_rest(const JointMotion& motion, const MatrixXd& structure, double min_speed, JointRows& rows) {
  if (min_speed == 0.0 && motion.speed_noise.size() == 0) return;
  rows.used.resize(rows.joints());
  for (int i = 0; i < rows.joints(); ++i) {
    const Eigen::ArrayXd keep = moving_samples(motion, structure, min_speed, i);
    rows.used[i] = keep.sum();
    rows.tau.col(i).array() *= keep;
    MatrixXd& X = rows.regressors[static_cast<std::size_t>(i)].X;
    X.array().colwise() *= keep;
  }
}

MatrixXd score_covariance(const JointRows& rows, const JointFit& fit, const VectorXd& weights) {
  return scores(noise_rows(rows, rows.regressors, fit.merged), column_positions(rows.regressors, rows.columns),
                rows.size(), fit.noise, weights.cwiseAbs2());
}

JointMotion part_of(const JointMotion& motion, Index first, Index count) {
  JointMotion out{motion.t.segment(first, count),      motion.q.middleRows(first, count),
                  motion.qd.middleRows(first, count),  motion.qdd.middleRows(first, count),
                  motion.tau.middleRows(first, count), {}};
  if (motion.temperature.size() > 0) out.temperature = motion.temperature.middleRows(first, count);
  out.speed_noise = motion.speed_noise;
  if (motion.run_starts.empty()) return out;
  out.run_starts.push_back(0);
  for (const int start : motion.run_starts)
    if (start > first && start < first + count) out.run_starts.push_back(static_cast<int>(start - first));
  return out;
}

JointFit fit_joint_rows(const JointRows& rows, const JointFitOptions& options,
                        const std::vector<JointRegressor>* instruments) {
  const Positions positions = column_positions(rows.regressors, rows.columns);
  const double scale = rows.tau.norm() / std::sqrt(static_cast<double>(rows.tau.size()));
  WeightedFit weighted = weighted_fit(rows, positions, options);
  JointFit fit;
  fit.beta = weighted.solution.beta;
  fit.factor = weighted.factor;
  fit.untold = weighted.solution.untold;
  fit.iterations = weighted.iterations;
  fit.converged = weighted.converged;
  fit.residuals = residuals_of(rows, positions, fit.beta);
  fit.sigma = options.estimator == Estimator::Ordinary ? joint_sigma(rows, fit.residuals, scale)
                                                       : VectorXd(weighted.weights.cwiseInverse());
  const std::vector<int>& told = weighted.solution.told;
  if (told.empty()) {
    fit.covariance = with_untold({}, told, rows.size());
    fit.correlation = VectorXd::Ones(rows.joints());
    return fit;
  }
  if (options.estimator == Estimator::Robust) {
    fit.iterations = 0;
    refine_robust(rows, positions, options, told, scale, fit);
    return fit;
  }
  if (options.estimator == Estimator::Instruments) {
    fit.iterations = 0;
    refine_instruments(rows, *instruments, positions, options, told, scale, fit);
    return fit;
  }
  const NoiseRows merged = find_noise(rows, rows.regressors, positions, told, fit.residuals, fit);
  const MatrixXd S = scores(merged, positions, rows.size(), fit.noise, weighted.weights.cwiseAbs2());
  const MatrixXd back = weighted.solution.R.triangularView<Eigen::Upper>().solve(
      MatrixXd::Identity(static_cast<Index>(told.size()), static_cast<Index>(told.size())));
  fit.covariance = with_untold(sandwich(back * back.transpose(), S, told), told, rows.size());
  return fit;
}

}  // namespace kr5::identification
