// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/gap/plan.hpp>

#include "gap/fitting/fit.hpp"

/// @file
/// Alternatives fitted to what was recorded, or to what would be.

namespace kr5::gap {

/// A simulator of a cell that carries another tool in some experiments, by their name.
class ToolSimulator : public cell::Simulator {
 public:
  using Tools = std::map<std::string, cell::Tool>;
  ToolSimulator(const cell::Simulator& inner, Tools tools) : inner_(inner), tools_(std::move(tools)) {}
  io::Table simulate(const cell::Cell& cell, const cell::Experiment& experiment) const override;
  const cell::Simulator& inner() const { return inner_; }
  const Tools& tools() const { return tools_; }

 private:
  const cell::Simulator& inner_;
  Tools tools_;
};

/// A recording of which every experiment may be fitted.
struct FitContext {
  FitContext(cell::Recording recording, const cell::Simulator& simulator, ToolSimulator::Tools tools = {});
  FitContext(const FitContext&) = delete;
  FitContext& operator=(const FitContext&) = delete;

  cell::Recording recording;
  ToolSimulator simulator;
  ComparisonData data;
  Eigen::VectorXd base;  ///< Residuals of the nominal cell.

  double chi2() const { return counted_residual(data, base).squaredNorm(); }
};

/// An alternative, fitted; it owns its hypotheses.
struct Fitted {
  Fitted() = default;
  explicit Fitted(const Model& model);

  std::vector<Candidate> candidates;  ///< One an effect.
  std::vector<Eigen::VectorXd> x;
  Eigen::MatrixXd information;
  double chi2 = 0.0;
  double log_evidence = 0.0;

  std::vector<Part> parts() const;
};

/// Each alternative, fitted to a context.
/// @throws InvalidArgument for an effect that the cell cannot have, or that shows nowhere in the recording.
std::vector<Fitted> fit_alternatives(const FitContext& context, const std::vector<Alternative>& alternatives,
                                     const PlanOptions& options);

/// The same alternative at other coordinates: fitted again from where it is, to all experiments of another context.
Fitted refit(const FitContext& context, const Fitted& from, int max_iterations);

/// The alternative at sizes its effects often have.
void assume_usual_size(Fitted& fitted);

/// What a cell with these effects would have recorded, noise apart.
cell::Recording synthesize_recording(const FitContext& context, const Fitted& truth);

/// Puts what is predicted into an experiment: in columns that it has, or in those named as well.
void show(cell::Experiment& experiment, const io::Table& predicted, const std::vector<std::string>& also = {});

}  // namespace kr5::gap
