// SPDX-License-Identifier: BSD-3-Clause
#include "vision/camera_calibration/model_selection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <kr5/uncertainty/confidence.hpp>

namespace kr5::vision::detail {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double false_refusal = 0.05;  // chance to leave the usual model where it is right
constexpr double small_loss = 0.02;  // of the squared error; with few views a standard error alone would forgive a lot

/// Mean squared error of a view's points when each is predicted from the pose fitted to all others, camera known.
double leave_one_out(const CameraProblem& problem, const CameraState& state, std::size_t view,
                     const Eigen::VectorXd& weights) {
  const auto at = fit_pose(problem, state, view, weights).derivatives;
  if (!at) return infinite;
  const Eigen::MatrixXd& J = at->by_coordinate;
  const Eigen::LDLT<Matrix6> factor(J.transpose() * J);
  double sum = 0, count = 0;
  for (Eigen::Index i = 0; i < weights.size(); ++i) {
    if (weights[i] < 0.5 * weights.maxCoeff()) continue;  // beyond 6 sigma: a wrong point judges nobody
    const auto Ji = J.middleRows<2>(2 * i);
    const Eigen::Matrix2d hat = Ji * factor.solve(Ji.transpose());
    sum += ((Eigen::Matrix2d::Identity() - hat).inverse() * at->residuals.segment<2>(2 * i)).squaredNorm() / weights[i];
    ++count;
  }
  return count > 0 ? sum / count : infinite;
}

/// Squared held-out error of each used view.
std::vector<double> held_out_errors(const CameraProblem& problem, const CameraModel& model,
                                    const RobustAdjustment& reference, const std::vector<bool>& used,
                                    const CameraOptions& options) {
  std::vector<std::size_t> judged;
  for (std::size_t i = 0; i < used.size(); ++i)
    if (used[i]) judged.push_back(i);
  const std::size_t folds = std::min(std::size_t(options.folds), judged.size());
  std::vector<double> out(judged.size());
  for (std::size_t fold = 0; fold < folds; ++fold) {
    std::vector<bool> train = used;
    for (std::size_t k = fold; k < judged.size(); k += folds) train[judged[k]] = false;
    const RobustAdjustment fit =
        adjust_robustly(problem, model, reference.adjustment.state(), train, options.robust, 2);
    for (std::size_t k = fold; k < judged.size(); k += folds)
      out[k] = std::isfinite(fit.adjustment.cost())
                   ? leave_one_out(problem, fit.adjustment.state(), judged[k], reference.weights[judged[k]])
                   : infinite;
  }
  return out;
}

std::vector<CameraModel> candidates(const CameraOptions& options, bool flat) {
  const auto choices = [](const std::optional<bool>& given) {
    return given ? std::vector<bool>{*given} : std::vector<bool>{true, false};
  };
  std::vector<CameraModel> out;
  for (const auto& [lens, name] : enum_names(LensModel{}))
    for (const bool square : choices(options.square_pixels))
      for (const bool bent : choices(flat ? options.bent_target : std::optional(false)))
        if (!options.lens || *options.lens == lens) out.push_back({lens, square, bent});
  return out;
}

/// What cameras and boards are like as a rule: square pixels, paper that is not quite flat.
bool usual(const CameraModelScore& s, const CameraOptions& options, bool flat) {
  return s.lens == options.lens.value_or(LensModel::Brown5) &&
         s.square_pixels == options.square_pixels.value_or(true) &&
         s.bent_target == (flat && options.bent_target.value_or(true));
}

double mean(const std::vector<double>& v) {
  double sum = 0;
  for (const double x : v) sum += x;
  return sum / double(v.size());
}

/// Whether a model does worse than the best one beyond doubt, by the ratio of their errors in each view: some views err
/// more than others, and that alike under both. The best of many does well by luck as well, so that all of them share
/// the chance to be wrong.
bool refuted(const std::vector<double>& own, const std::vector<double>& best, std::size_t models) {
  constexpr double tiny = 1e-12;  // [px^2]
  const double n = double(own.size());
  std::vector<double> ratio(own.size());
  for (std::size_t i = 0; i < ratio.size(); ++i) ratio[i] = std::log((own[i] + tiny) / (best[i] + tiny));
  const double middle = mean(ratio);
  double sum = 0;
  for (const double r : ratio) sum += (r - middle) * (r - middle);
  const double std_of_mean = std::sqrt(sum / (n - 1) / n);
  return middle > uncertainty::student_factor(n - 1, 1 - 2 * false_refusal / double(models)) * std_of_mean;
}

void compare_with_best(const std::vector<std::vector<double>>& errors, std::size_t best,
                       std::vector<CameraModelScore>& scores) {
  const double n = double(errors[best].size());
  for (std::size_t m = 0; m < scores.size(); ++m) {
    std::vector<double> d(errors[m]);
    for (std::size_t i = 0; i < d.size(); ++i) d[i] -= errors[best][i];
    scores[m].excess = mean(d);
    double sum = 0;
    for (const double x : d) sum += (x - scores[m].excess) * (x - scores[m].excess);
    scores[m].excess_std = std::sqrt(sum / (n - 1) / n);
  }
}

}  // namespace

std::vector<CameraModelScore> compare_models(const CameraProblem& problem, const RobustAdjustment& reference,
                                             const std::vector<bool>& used, const CameraOptions& options) {
  std::vector<CameraModelScore> scores;
  std::vector<std::vector<double>> errors;
  for (const CameraModel& m : candidates(options, problem.plane.flat)) {
    errors.push_back(held_out_errors(problem, m, reference, used, options));
    const double error = mean(errors.back());
    if (!std::isfinite(error)) {
      errors.pop_back();
      continue;
    }
    const RobustAdjustment all = adjust_robustly(problem, m, reference.adjustment.state(), used, options.robust, 2);
    double squares = 0;
    for (std::size_t i = 0; i < used.size(); ++i)
      if (used[i]) squares += residuals(problem, all.adjustment.state(), i).squaredNorm();
    scores.push_back({m.lens, m.square_pixels, m.bent_target, int(free_basis(m).cols()), std::sqrt(error),
                      std::sqrt(squares / all.points)});
  }
  if (scores.empty()) return scores;
  const auto by_error = [](const auto& a, const auto& b) { return a.held_out_rms < b.held_out_rms; };
  const auto best = std::min_element(scores.begin(), scores.end(), by_error) - scores.begin();
  compare_with_best(errors, std::size_t(best), scores);
  CameraModelScore* chosen = &scores[std::size_t(best)];
  const double least = chosen->held_out_rms * chosen->held_out_rms;
  for (std::size_t m = 0; m < scores.size(); ++m)
    if (usual(scores[m], options, problem.plane.flat) &&
        !refuted(errors[m], errors[std::size_t(best)], scores.size())) {
      scores[m].chosen = true;
      return scores;
    }
  for (CameraModelScore& s : scores)
    if (s.excess <= std::min(s.excess_std, small_loss * least) &&
        (s.parameters < chosen->parameters ||
         (s.parameters == chosen->parameters && s.held_out_rms < chosen->held_out_rms)))
      chosen = &s;
  chosen->chosen = true;
  return scores;
}

}  // namespace kr5::vision::detail
