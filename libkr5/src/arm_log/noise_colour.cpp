// SPDX-License-Identifier: BSD-3-Clause
#include "noise_colour.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/QR>

#include <kr5/arm_log/measured_positions.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/gap/findings.hpp>

namespace kr5::arm_log {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double min_correlation = 0.4;   // of neighbours, below which noise is as good as white
constexpr double longest_memory = 1.0;    // of noise; what lasts longer belongs to the motion [s]
constexpr double forgotten = 0.25;        // correlation at the end of a memory
constexpr double slow_structure = 0.9;    // part of the noise of neighbours that slow structure under white noise has
constexpr double predicted_share = 0.05;  // of the variance that functions of the motion may predict
constexpr double chance_of_one = 12.0;    // times the share that an independent value has, that the best may by chance
constexpr double most_by_chance = 0.5;    // share, from which too few rows are left to tell
constexpr int folds = 4;                  // parts of a log, each predicted by the others
constexpr Index most_blocks = 32;         // of which these are made
constexpr double memories = 3.0;          // of the noise, that a block lasts at least
constexpr int most_terms = 5;             // of a prediction
constexpr int most_ripple_cycles = 64;    // a turn, of ripples that are tried
constexpr Index fewest_rows = 200;

/// Mean product of values that stand `lag` rows apart, over the mean square; 0 stands for no value.
double correlation_at(const VectorXd& x, Index lag) {
  if (lag >= x.size()) return 0.0;
  double product = 0.0, pairs = 0.0, square = 0.0, values = 0.0;
  for (Index i = 0; i < x.size(); ++i) {
    if (x[i] == 0.0) continue;
    square += x[i] * x[i], ++values;
    if (i + lag < x.size() && x[i + lag] != 0.0) product += x[i] * x[i + lag], ++pairs;
  }
  return pairs > 0 && square > 0 ? product / pairs / (square / values) : 0.0;
}

/// Noise by third differences of values without a hole between them.
double neighbour_noise(const VectorXd& x) {
  std::vector<double> third;
  for (Index i = 3; i < x.size(); ++i)
    if (x[i] != 0.0 && x[i - 1] != 0.0 && x[i - 2] != 0.0 && x[i - 3] != 0.0)
      third.push_back(std::abs(x[i] - 3 * x[i - 1] + 3 * x[i - 2] - x[i - 3]));
  return mad_to_sigma * median(std::move(third)) / std::sqrt(20.0);
}

using Columns = std::vector<ArrayXd>;

/// Of mean 0 and unit size, side by side.
MatrixXd standardised(const Columns& columns) {
  MatrixXd out(columns.empty() ? 0 : columns.front().size(), static_cast<Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const ArrayXd about = columns[k] - columns[k].mean();
    out.col(static_cast<Index>(k)) = about / std::max(std::sqrt(about.square().mean()), 1e-12);
  }
  return out;
}

/// Functions of the joint itself, of its load and of time.
Columns own_functions(const identification::JointMotion& motion, int joint) {
  const ArrayXd q = motion.q.col(joint), v = motion.qd.col(joint), tau = motion.tau.col(joint), side = v.sign();
  Columns out = {side,
                 v,
                 v.abs(),
                 v * v.abs(),
                 motion.qdd.col(joint).array(),
                 tau,
                 tau.abs() * side,
                 motion.t,
                 motion.t.array().square()};
  for (const double harmonic : {1.0, 2.0, 3.0})
    for (const ArrayXd& wave : {ArrayXd((harmonic * q).sin()), ArrayXd((harmonic * q).cos())})
      out.push_back(wave), out.emplace_back(wave * side);
  const double fast = std::sqrt(v.square().mean());
  for (const double part : {0.03, 0.1, 0.3}) {  // about reversals
    const ArrayXd slow = side * (-v.abs() / std::max(part * fast, 1e-12)).exp();
    out.push_back(slow), out.emplace_back(slow * q.sin()), out.emplace_back(slow * q.cos());
  }
  return out;
}

/// Functions of the other joints, which couple with it.
Columns other_functions(const identification::JointMotion& motion, int joint) {
  Columns out;
  for (int k = 0; k < motion.joints(); ++k) {
    if (k == joint) continue;
    const ArrayXd q = motion.q.col(k), v = motion.qd.col(k);
    out.emplace_back(q.sin()), out.emplace_back(q.cos());
    out.push_back(v), out.emplace_back(v.sign());
  }
  return out;
}

/// Ripples over a turn of the joint.
Columns ripples(const identification::JointMotion& motion, int joint) {
  const ArrayXd q = motion.q.col(joint);
  Columns out;
  for (int cycles = 4; cycles <= most_ripple_cycles; ++cycles)
    out.emplace_back((cycles * q).sin()), out.emplace_back((cycles * q).cos());
  return out;
}

/// The columns that explain most of a vector, one after the other.
std::vector<Index> best_columns(MatrixXd columns, VectorXd left) {
  std::vector<Index> out;
  for (int k = 0; k < most_terms && k < columns.cols(); ++k) {
    const ArrayXd squares =
        columns.colwise().squaredNorm().transpose().array().max(1e-9 * static_cast<double>(left.size()));
    Index best = 0;
    ((columns.transpose() * left).array().square() / squares).maxCoeff(&best);
    out.push_back(best);
    const VectorXd direction = columns.col(best).normalized();
    left -= direction * direction.dot(left);
    columns -= direction * (direction.transpose() * columns);
  }
  return out;
}

/// Rows of a fold, or all others. Folds are made of blocks that lie all over a log.
std::vector<Index> rows_of(const VectorXd& values, Index block, int fold, bool inside) {
  std::vector<Index> out;
  for (Index i = 0; i < values.size(); ++i)  // 0 stands for no value
    if (values[i] != 0.0 && ((i / block) % folds == fold) == inside) out.push_back(i);
  return out;
}

/// Greatest share of the variance of values that functions predict in rows to which they were not fitted, by as many
/// of them as predict best.
double share_predicted(const Columns& columns, const VectorXd& values, Index block) {
  const MatrixXd functions = standardised(columns);
  ArrayXd after = ArrayXd::Zero(most_terms);
  for (int fold = 0; fold < folds; ++fold) {
    const std::vector<Index> own = rows_of(values, block, fold, true), others = rows_of(values, block, fold, false);
    const MatrixXd to_fit = functions(others, Eigen::all), to_judge = functions(own, Eigen::all);
    const VectorXd known = values(others), judged = values(own);
    std::vector<Index> chosen = best_columns(to_fit, known);
    for (int terms = most_terms; terms > 0; --terms) {
      chosen.resize(std::min(chosen.size(), static_cast<std::size_t>(terms)));
      const VectorXd fit = MatrixXd(to_fit(Eigen::all, chosen)).colPivHouseholderQr().solve(known);
      after[terms - 1] += (judged - to_judge(Eigen::all, chosen) * fit).squaredNorm();
    }
  }
  return 1 - after.minCoeff() / std::max(values.squaredNorm(), 1e-300);
}

/// Whether functions of the motion predict it, so that it is an error of the arm.
bool depends_on_motion(const identification::JointMotion& motion, const VectorXd& left, int joint, double correlation) {
  const auto memory = static_cast<Index>(std::ceil(memories * gap::colour_factor(correlation)));
  const Index block = std::max(left.size() / most_blocks, memory);
  const double rows = static_cast<double>((left.array() != 0.0).count());
  const double by_chance = predicted_share + chance_of_one * gap::colour_factor(correlation) / rows;
  if (by_chance > most_by_chance || left.size() < folds * block) return true;  // too few rows to tell
  for (const Columns& columns : {own_functions(motion, joint), other_functions(motion, joint), ripples(motion, joint)})
    if (!columns.empty() && share_predicted(columns, left, block) > by_chance) return true;
  return false;
}

}  // namespace

NoiseColour noise_colour(const identification::JointMotion& motion, const Eigen::Ref<const VectorXd>& left, int joint) {
  const double values = static_cast<double>((left.array() != 0.0).count());
  if (left.size() < fewest_rows || values < static_cast<double>(fewest_rows)) return {};
  const double sigma = std::sqrt(left.squaredNorm() / values);
  const double correlation = std::clamp(correlation_at(left, 1), 0.0, 0.99);
  if (correlation < min_correlation) return {};
  const auto memory = static_cast<Index>(longest_memory / middle_step(motion.t));
  if (std::abs(correlation_at(left, std::max<Index>(memory, 2))) > forgotten) return {};
  // Slow structure under white noise has the third differences of that noise alone; those of coloured noise are less.
  if (neighbour_noise(left) > slow_structure * sigma * std::sqrt(1 - correlation)) return {};
  if (depends_on_motion(motion, left, joint, correlation)) return {};
  return {sigma * std::sqrt(values / static_cast<double>(left.size())), correlation};
}

}  // namespace kr5::arm_log
