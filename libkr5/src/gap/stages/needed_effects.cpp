// SPDX-License-Identifier: BSD-3-Clause
#include "gap/stages/needed_effects.hpp"

#include "gap/reporting/residual_analysis.hpp"

namespace kr5::gap {

bool within_nuisance(const FitProblem& problem, const Model& model) {
  constexpr double most = 4.0;  // of some thirty parameters one in 500 times
  if (problem.prior.size() == 0.0) return true;
  const Eigen::VectorXd off =
      problem.prior.estimate(project(problem.data, problem.nuisance, counted_residual(problem.data, model.residual)));
  return off.cwiseAbs().maxCoeff() < most * problem.prior.size();
}

bool is_needless(ModelPool& models, const std::vector<Group>& groups, const Model& model, std::size_t part,
                 const DiagnoseOptions& options) {
  const FitProblem& problem = models.problem();
  const Model without = models.without(model, part);
  const bool cause = !model.parts[part].candidate->hypothesis.of_recording;
  return (cause && worsens_check(problem.data, groups, model, without)) ||
         (within_nuisance(problem, without) &&
          within_discrepancy(problem, groups, model, without, models.base(), options));
}

}  // namespace kr5::gap
