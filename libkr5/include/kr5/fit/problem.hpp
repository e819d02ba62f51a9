// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <concepts>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <kr5/fit/measurement.hpp>
#include <kr5/fit/solution.hpp>
#include <kr5/kinematics/dh_chain.hpp>

/// @file
/// The fit of a cell: parameters of arm, camera, scanner, tool and targets from any mixture of measurements, in one
/// solve (Ceres).

namespace kr5::fit {

struct SolveOptions {
  int max_iterations = 100;
  double loss = 0.0;              ///< [-]
  double rank_tolerance = 1e-6;   ///< [-]
  double cost_tolerance = 1e-14;  ///< [-]
  bool uncertainty = true;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("max_iterations", self.max_iterations, "Maximum number of iterations.");
    visit("loss", self.loss,
          "Scale of the Cauchy loss of each measurement, in standard deviations of its residuals; 0: least squares, "
          "without which there is no covariance [-].");
    visit("rank_tolerance", self.rank_tolerance,
          "Minimum share of its own sensitivity that a combination of parameters must keep beside all others to count "
          "as identifiable [-].");
    visit("cost_tolerance", self.cost_tolerance, "Relative change of the cost at which the iteration ends [-].");
    visit("uncertainty", self.uncertainty,
          "Whether covariance and unidentifiable directions are also computed; a first guess needs none.");
  }
};

/// A measurement near some values, over its standard deviations: residuals + by_coordinate d + by_nuisance n, where d
/// changes the free coordinates in their order and n is a change of its nuisance (of a pose a right perturbation).
struct MeasurementDerivatives {
  Eigen::VectorXd residuals;
  Eigen::MatrixXd by_coordinate;
  Eigen::MatrixXd by_nuisance;  ///< Without columns where there is none.
};

struct ProblemData;

/// Blocks of parameters with their priors, and the measurements that depend on them.
///
///     Problem problem;
///     const FitBlock arm = problem.add_arm("arm", nominal), base = problem.add_pose("base", T_world_base),
///                    tip = problem.add_point("tool", Eigen::Vector3d::Zero());
///     for (...)
///       problem.add(PositionMeasurement(PoseChain().then(base).then_arm(arm, q), tip, seen, sigma));
///     const Solution solution = problem.solve();
///     const kinematics::DhChain identified = problem.arm(arm);
///
/// Blocks of poses are perturbed from the right: T * to_pose(d). Residuals are whitened by the given standard
/// deviations.
class Problem {
 public:
  Problem();
  ~Problem();
  Problem(Problem&&) noexcept;
  Problem& operator=(Problem&&) noexcept;

  /// Coordinates x y z [m] rx ry rz [rad].
  FitBlock add_pose(const std::string& name, const Pose& start);
  /// A pose of which each measurement has its own, such as the error of a robot pose or the pose of a view. It is
  /// eliminated from the equations and not in the solution; a measurement may have one. A prior is needed only where
  /// its measurements do not determine it.
  FitBlock add_nuisance_pose(const std::string& name, const Pose& start = Pose::Identity());
  /// The same of numbers, such as the unknown joint value of one measurement.
  FitBlock add_nuisance_vector(const std::string& name, const Eigen::VectorXd& start,
                               const std::vector<std::string>& coordinates);
  /// Five coordinates a joint: b [m] theta_offset [rad] a [m] alpha beta [rad].
  FitBlock add_arm(const std::string& name, const kinematics::DhChain& start);
  /// Coordinates x y z [m].
  FitBlock add_point(const std::string& name, const Eigen::Vector3d& start);
  /// Coordinates of the given names with their units, such as "joint2.compliance [rad/(N m)]".
  FitBlock add_vector(const std::string& name, const Eigen::VectorXd& start,
                      const std::vector<std::string>& coordinates);
  /// Coordinates as in Pinhole::parameter_names.
  FitBlock add_camera(const std::string& name, const Pinhole& start);

  /// Keeps coordinates of a block at their start; -1: all.
  void hold(FitBlock block, int coordinate = -1);
  /// The same for a block by its name, or for one coordinate by its own without unit, such as "arm.joint2.a"; false
  /// when there is none of it.
  bool hold(const std::string& name);
  /// Lets a coordinate change as another one of its block does, times `ratio`: square pixels tie fy to fx.
  void tie(FitBlock block, int leader, int follower, double ratio = 1.0);
  /// Whether a measurement that takes part depends on a coordinate that is not held.
  bool any_free() const;
  /// Standard deviation of each coordinate about its start; infinite where nothing is known of it.
  void set_prior(FitBlock block, const Eigen::VectorXd& sigma);
  /// Values, as values() gives them, from which the next solve begins; a prior stays about the block's own start.
  void begin_at(FitBlock block, const Eigen::VectorXd& values);
  void begin_at(FitBlock block, const Pose& pose);

  template <std::derived_from<Measurement> Kind>
  FitMeasurement add(Kind measurement) {
    return add(std::unique_ptr<Measurement>(std::make_unique<Kind>(std::move(measurement))));
  }
  /// @throws InvalidArgument where it does not fit the blocks that it depends on.
  FitMeasurement add(std::unique_ptr<Measurement> measurement);
  /// Takes a measurement out (0) or gives it another weight.
  void set_weight(FitMeasurement measurement, double weight);
  void set_covariance(FitMeasurement measurement, const Eigen::MatrixXd& covariance);
  /// A measurement, to give it another noise. @throws InvalidArgument when it is of another kind.
  template <std::derived_from<Measurement> Kind>
  Kind& measurement(FitMeasurement which) {
    auto* const out = dynamic_cast<Kind*>(&any_measurement(which));
    if (!out) refuse_kind();
    return *out;
  }

  /// Minimises from the present values and keeps what it found.
  /// @throws InvalidArgument when nothing is free.
  Solution solve(const SolveOptions& options = {});

  Pose pose(FitBlock block) const;
  kinematics::DhChain arm(FitBlock block) const;
  Pinhole camera(FitBlock block) const;
  Eigen::VectorXd values(FitBlock block) const;  ///< As stored: of a pose see pose().
  /// Change of each coordinate of a block from its start, in its unit.
  Eigen::VectorXd change(FitBlock block) const;

  /// Residuals of a measurement over their standard deviations, at the present values.
  Eigen::VectorXd residuals(FitMeasurement measurement) const;
  /// A measurement at the present values, whether it takes part or not, by the coordinates of the last solve, or those
  /// that it would have. Empty where the model does not exist there, as behind a camera. `condensed`: with as few rows
  /// as tell the sum of squares, gradient and information of all.
  std::optional<MeasurementDerivatives> derivatives(FitMeasurement measurement, bool condensed = false) const;

 private:
  friend struct Solution;
  Measurement& any_measurement(FitMeasurement which);
  [[noreturn]] static void refuse_kind();

  std::unique_ptr<ProblemData> data_;
};

}  // namespace kr5::fit
