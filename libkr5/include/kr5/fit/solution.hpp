// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <kr5/core/fit_report.hpp>
#include <kr5/fit/pose_chain.hpp>

/// @file
/// What the measurements of a Problem say: covariance, directions that they leave open, and how they agree.

namespace kr5::fit {

class Problem;

/// A measurement of a Problem.
struct FitMeasurement {
  int index = -1;
};

/// One number of a block.
struct FitCoordinate {
  std::string block;
  std::string name;  ///< In its block: "joint2.a".
  std::string unit;

  std::string full_name() const { return block + "." + name; }
  /// "arm.joint2.a [m]".
  std::string text() const { return full_name() + (unit.empty() ? "" : " [" + unit + "]"); }
};

/// A combination of parameters that the measurements do not determine.
struct UnidentifiableDirection {
  Eigen::VectorXd direction;             ///< In the order of Solution::coordinates, of unit length.
  std::vector<std::string> coordinates;  ///< Those that take part, the greatest share first.
  std::string text;

  /// Whether a coordinate of the block takes part.
  bool involves(std::string_view block) const;

  static void each_field(auto& self, auto&& visit) {
    visit("direction", self.direction, "Unit vector, in the order of the coordinates, each over its sensitivity [-].");
    visit("coordinates", self.coordinates, "Coordinates that take part, the greatest share first.");
    visit("text", self.text, "Explanation.");
  }
};

/// How measurements agree with the others.
struct Agreement {
  double squared_distance = 0.0;  ///< From what all others say, in its own uncertainty: chi-square of `dof` [-].
  int dof = 0;                    ///< Residuals, less what a nuisance without a prior takes up.
  Eigen::VectorXd residuals;      ///< Over their standard deviations, its nuisance eliminated [-].
  Eigen::VectorXd redundancy;     ///< Share of each residual that the parameters do not take up [-].
};

/// Sum of squared residuals near a solution, as a function of the change d of its coordinates:
/// squares + 2 gradient' d + d' information d.
struct SquaredResiduals {
  double squares = 0.0;         ///< [-]
  int rows = 0;                 ///< Residuals in the sum.
  Eigen::VectorXd gradient;     ///< In the order of the coordinates.
  Eigen::MatrixXd information;  ///< Likewise.
};

/// The free coordinates of a problem: nuisances apart, and of blocks that a measurement in use or a prior knows.
struct FreeCoordinates {
  std::vector<FitCoordinate> list;
  std::vector<std::vector<int>> places;       ///< By block and coordinate, in the list; -1: held.
  std::vector<std::vector<int>> of_nuisance;  ///< By block of a nuisance, the measurements in use that have it.
};

/// Values are kept by the problem, what is known about them stands here. The members that take the problem ask it at
/// its present values, so call them before it is solved again.
struct Solution {
  FitReport fit;
  std::vector<std::string> coordinates;                 ///< Free parameters, nuisances apart: "arm.joint2.a [m]".
  Eigen::MatrixXd covariance;                           ///< In the order of `coordinates`, in their units.
  std::vector<UnidentifiableDirection> unidentifiable;  ///< By the measurements alone, without priors.
  std::vector<std::string> undetermined;  ///< Coordinates with a part that not even a prior holds: infinite variance.
  double cost = 0.0;                      ///< Sum of squared whitened residuals, or of their losses, and of priors [-].
  int residuals = 0;                      ///< Priors not counted.

  /// Places of the coordinates of a block in `coordinates`, a tied one's being that of the one it follows; -1 for one
  /// that is held.
  std::vector<int> places(FitBlock block) const;
  /// What `coordinates` are the texts of.
  const std::vector<FitCoordinate>& free_coordinates() const { return free_.list; }

  Agreement agreement(const Problem& problem, FitMeasurement measurement) const;
  /// Of measurements that belong together: made at once, or sharing a nuisance; all in use or none.
  Agreement agreement(const Problem& problem, std::span<const FitMeasurement> measurements) const;
  /// Of the residuals of some measurements: rows first_row up to, not including, end_row of each. Measurements taken
  /// out do not count. @throws InvalidArgument for a measurement with a nuisance.
  SquaredResiduals squared_residuals(const Problem& problem, std::span<const FitMeasurement> measurements,
                                     int first_row, int end_row) const;
  /// Share of the prior's information on each coordinate that agrees with the data rather than replaces them [-]; of a
  /// nuisance, too.
  Eigen::VectorXd prior_redundancy(const Problem& problem, FitBlock block) const;

 private:
  friend class Problem;
  void add_uncertainty(const Problem& problem, double rank_tolerance);
  Eigen::MatrixXd covariance_of(const std::vector<int>& places) const;
  Eigen::VectorXd nuisance_redundancy(const Problem& problem, FitBlock nuisance) const;

  FreeCoordinates free_;
  Eigen::MatrixXd determined_;  ///< The covariance without what is undetermined.
};

}  // namespace kr5::fit
