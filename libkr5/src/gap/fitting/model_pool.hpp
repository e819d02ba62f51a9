// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gap/fitting/fit.hpp"

namespace kr5::gap {

/// Sets of effects that were fitted, most likely first.
class ModelPool {
 public:
  ModelPool(const FitProblem& problem, const Eigen::VectorXd& base) : problem_(problem), base_(base) {}

  const std::vector<Model>& all() const { return models_; }
  const Model& best() const { return models_.front(); }
  void replace(std::vector<Model> models) { models_ = std::move(models); }

  Model nominal() const { return empty_model(problem_, base_); }
  /// A model fitted without one of its parts; fitted now if it was not.
  Model without(const Model& model, std::size_t part);
  /// Fits a model with other parts, each set of them that was neither fitted nor taken away.
  void extend(const Model& from, std::vector<std::vector<Part>> sets, int threads);
  /// Takes a set of effects away for good.
  void drop(const std::vector<Part>& parts);

 private:
  /// The place of a set that was fitted, else the end.
  std::vector<Model>::iterator find(const std::vector<Part>& parts);
  bool is_dropped(const std::vector<Part>& parts) const;
  Model insert(Model model);

  const FitProblem& problem_;
  const Eigen::VectorXd& base_;
  std::vector<Model> models_;
  std::vector<std::vector<Part>> dropped_;
};

}  // namespace kr5::gap
