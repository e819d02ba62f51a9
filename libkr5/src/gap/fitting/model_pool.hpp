// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <utility>
#include <vector>

#include "gap/fitting/fit.hpp"

namespace kr5::gap {

/// Models of sets of effects.
struct ModelSets {
  std::vector<Model> kept;     ///< Most likely first.
  std::vector<Model> dropped;  ///< Excluded from what may be blamed.
};

/// Sets of effects that were fitted, to which others are added. It refers to problem and base.
class ModelPool {
 public:
  ModelPool(const FitProblem& problem, const Eigen::VectorXd& base, ModelSets sets = {})
      : problem_(problem), base_(base), models_(std::move(sets.kept)), dropped_(std::move(sets.dropped)) {}

  const FitProblem& problem() const { return problem_; }
  const Eigen::VectorXd& base() const { return base_; }

  /// Those that were not dropped, most likely first.
  const std::vector<Model>& all() const { return models_; }
  const Model& best() const { return models_.front(); }
  ModelSets take() && { return {std::move(models_), std::move(dropped_)}; }

  Model nominal() const { return empty_model(problem_, base_); }
  /// The model of a set of effects that was fitted, dropped or not.
  Model fitted(const std::vector<Part>& parts) const { return parts.empty() ? nominal() : *find(parts); }
  /// A model fitted without one of its parts; fitted now if it was not.
  Model without(const Model& model, std::size_t part);
  /// Fits a model without each of its parts, on all cores.
  void fit_without_each(const Model& model, int threads);
  /// Fits a model with other parts, each set of them that was not fitted before.
  void extend(const Model& from, std::vector<std::vector<Part>> sets, int threads);
  /// Fits a model again, with its own slopes.
  Model refit(const Model& model, int threads);
  /// Excludes a set of effects from all; `without` still gives its fit.
  void drop(const std::vector<Part>& parts);
  /// Includes a set that was dropped.
  void admit(const std::vector<Part>& parts);

 private:
  void extend(const Model& from, const Model& near, std::vector<std::vector<Part>> sets, int threads);
  /// A set that was fitted, dropped or not; nullptr: it was not.
  const Model* find(const std::vector<Part>& parts) const;
  const Model& insert(Model model);

  const FitProblem& problem_;
  const Eigen::VectorXd& base_;
  std::vector<Model> models_;
  std::vector<Model> dropped_;
};

}  // namespace kr5::gap
