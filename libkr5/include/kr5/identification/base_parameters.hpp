// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <kr5/identification/dynamics_model.hpp>

/// @file
/// Base parameters: the combinations of parameters that motions can tell (Gautier 1991; Hayat et al. 2022, eq. 4.38).

namespace kr5::identification {

struct BaseParameterOptions {
  int samples = 0;          ///< Random states; 0: twice the number of parameters.
  std::uint64_t seed = 1;   ///< Of the states.
  Eigen::VectorXd lower;    ///< Least joint values [rad or m]; empty: -pi, or -1 m.
  Eigen::VectorXd upper;    ///< Greatest joint values [rad or m]; empty: pi, or 1 m.
  double tolerance = 1e-8;  ///< Part of a column, over its length, below which it counts as dependent [-].

  /// @throws InvalidArgument naming the field.
  void validate() const;
  static void each_field(auto& self, auto&& visit) {
    visit("samples", self.samples, "Number of random states; 0: twice the number of parameters.");
    visit("seed", self.seed, "Random seed.");
    visit("lower", self.lower, "Lower joint limits; empty: -pi, or -1 m [rad or m].");
    visit("upper", self.upper, "Upper joint limits; empty: pi, or 1 m [rad or m].");
    visit("tolerance", self.tolerance, "Part of a column below which it counts as dependent [-].");
  }
};

/// The regrouping chi_b = B chi with Y chi = Y_b chi_b, where Y_b are the independent columns of Y.
struct BaseParameters {
  std::vector<std::string> parameters;   ///< Names of the P standard parameters.
  std::vector<int> independent;          ///< Their columns that are kept, b of them, in ascending order.
  Eigen::MatrixXd regrouping;            ///< B, b x P [-, m, m^2].
  std::vector<std::string> expressions;  ///< Each base parameter in standard ones: "I2zz + Ia2 - 0.36 m2".
  std::vector<std::string> units;        ///< Of each base parameter.

  int size() const { return static_cast<int>(independent.size()); }
  /// Base parameters of standard ones.
  Eigen::VectorXd values(const Eigen::VectorXd& chi) const { return regrouping * chi; }
  /// Standard parameters that have these base parameters: the independent ones, and zeros.
  Eigen::VectorXd standard(const Eigen::VectorXd& base) const;
  /// Whether motions can tell a combination of standard parameters (P coefficients).
  bool identifiable(const Eigen::VectorXd& combination, double tolerance = 1e-6) const;

  static void each_field(auto& self, auto&& visit) {
    visit("parameters", self.parameters, "Names of the standard parameters.");
    visit("independent", self.independent, "Columns of the regressor that are kept, from 0.");
    visit("regrouping", self.regrouping, "B, base x standard: base parameters are B chi.");
    visit("expressions", self.expressions, "Each base parameter as an expression in standard parameters.");
    visit("units", self.units, "Unit of each base parameter.");
  }
};

/// Base parameters of a model, from the regressor of random states. Of columns that depend
/// on each other, inertias are kept before first moments, those before masses, and inner links before outer ones.
/// @throws InvalidArgument naming the field.
BaseParameters base_parameters(const DynamicsModel& model, const BaseParameterOptions& options = {});

/// What one motion tells of the base parameters.
struct Observability {
  double condition = 0.0;                   ///< Of the observation matrix in SI units [-].
  double scaled_condition = 0.0;            ///< The same with columns of unit length [-].
  Eigen::VectorXd singular_values;          ///< With columns of unit length, in descending order [-].
  std::vector<std::string> unidentifiable;  ///< Combinations of base parameters that the motion cannot tell, by name.
  std::vector<int> unmoved;                 ///< Joints that never moved, counted from 1.

  static void each_field(auto& self, auto&& visit) {
    visit("condition", self.condition, "Condition number of the observation matrix in SI units [-].");
    visit("scaled_condition", self.scaled_condition, "The same with columns of unit length [-].");
    visit("singular_values", self.singular_values, "Singular values with columns of unit length, descending [-].");
    visit("unidentifiable", self.unidentifiable, "Combinations that the motion does not determine, by name.");
    visit("unmoved", self.unmoved, "Joints that never moved, counted from 1.");
  }
};

/// @param tolerance Least singular value, over the greatest, of a combination that counts as told [-].
Observability observability(const DynamicsModel& model, const BaseParameters& base, const JointMotion& motion,
                            double tolerance = 1e-6);
/// The same from a factor R with R^T R = Y_b^T Y_b, of the rows that were used; the motion tells which joints moved.
Observability observability_from_factor(const BaseParameters& base, const JointMotion& motion, const Eigen::MatrixXd& R,
                                        double tolerance = 1e-6);

/// Upper triangular factor (b x b) of the observation matrix of a motion: R^T R = Y_b^T Y_b.
Eigen::MatrixXd observation_factor(const DynamicsModel& model, const BaseParameters& base, const JointMotion& motion);

}  // namespace kr5::identification
