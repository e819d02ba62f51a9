// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/gap/diagnose.hpp>

#include "gap/fitting/posterior.hpp"
#include "gap/reporting/structure.hpp"

namespace kr5::gap {

/// What the simulator is known to be off in a column, in its unit; 0: nothing is known.
double known_error(const DiagnoseOptions& options, const std::string& column);

/// What a model leaves, column by column.
struct ResidualAnalysis {
  Eigen::VectorXd
      shown;  ///< Residuals of the model as fitted, nuisance parameters taken out; NaN where none is compared.
  Eigen::VectorXd counted;  ///< The same, less what the check experiments could still move the coordinates by.
  std::vector<Structure> structure;
  std::vector<bool> structured;  ///< By the tests of all columns together, at the false-alarm rate.
  std::vector<bool> beyond;      ///< Further off than what the simulator is known to be off allows for.
  std::vector<double> strength;  ///< Of the structure found, as a sum of squares.
  std::vector<double> strayed;   ///< By which parts of the model are not the same everywhere, as a sum of squares.
  /// Counted residuals of the model as fitted: whole, and without each of its parts, nothing refitted.
  Eigen::VectorXd whole;
  std::vector<Eigen::VectorXd> without;

  bool any_structure() const;
  bool any() const;  ///< Structure, or a column beyond what is known.
};
ResidualAnalysis analyze_residual(const FitProblem& problem, const std::vector<Group>& groups, const Model& model,
                                  const Eigen::VectorXd& base, const DiagnoseOptions& options);

/// Finds what the columns beyond what is known depend on, by tests against noise alone: tested against what the
/// simulator is known to be off, they show nothing.
void describe_beyond(const ComparisonData& data, const std::vector<Group>& groups, const DiagnoseOptions& options,
                     ResidualAnalysis& rest);

/// Whether an effect explains no more than the simulator may be off with the others: `with` is the model, `without` the
/// same fitted without the effect. A discrepancy has a dozen shapes to choose from in a column, any of which an effect
/// may have; twice what falls to one of them is its limit.
bool within_discrepancy(const FitProblem& problem, const std::vector<Group>& groups, const Model& with,
                        const Model& without, const Eigen::VectorXd& base, const DiagnoseOptions& options);

/// Whether an effect makes the columns that are judged fit worse, as it was fitted: `with` is the model, `without` the
/// same fitted without the effect.
bool worsens_check(const ComparisonData& data, const std::vector<Group>& groups, const Model& with,
                   const Model& without);

/// How far an effect may be trusted although its model leaves a structure, from 0 to 1: the part of what it explains
/// that lies in columns which are then clean. In columns that stay structured an effect is trusted when it leaves no
/// more than the simulator may be off, and not when it leaves a twentieth of what it explains (in between by the
/// logarithm): a wrong entry of the catalogue bends to part of any structure, seldom to all of it. The same holds for
/// how much of what it explains would be explained by another size of the effect elsewhere.
double trust(const ComparisonData& data, const std::vector<Group>& groups, const Model& model,
             const ResidualAnalysis& rest, std::size_t part, const DiagnoseOptions& options);

}  // namespace kr5::gap
