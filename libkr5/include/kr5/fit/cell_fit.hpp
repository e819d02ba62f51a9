// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <kr5/core/fit_report.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/kinematics/dh_chain.hpp>

/// @file
/// The fit of a cell: parameters of arm, camera, scanner, tool and targets from any mixture of measurements, in one
/// solve (Ceres). A measurement is made along a chain of poses, some of which are parameters.

namespace kr5::fit {

/// A block of parameters of a CellFit.
struct FitBlock {
  int index = -1;
  bool exists() const { return index >= 0; }
};

/// A measurement of a CellFit.
struct FitObservation {
  int index = -1;
};

/// A pose on a path, and its rate as a right perturbation [m/s, rad/s].
struct PathSample {
  Pose T = Pose::Identity();
  Vector6 rate = Vector6::Zero();
};
/// A pose as a function of time [s]; empty where the path has none.
using PosePath = std::function<std::optional<PathSample>(double t)>;

/// A product of poses, from the frame in which something is measured to the frame that is measured.
class PoseChain {
 public:
  struct Factor {
    Pose constant = Pose::Identity();
    FitBlock block;             ///< A pose, an arm or the delay of a path; without, the factor is constant.
    bool inverse = false;       ///< Of the pose of the block.
    Eigen::VectorXd q;          ///< Of an arm: joint values [rad or m].
    FitBlock joint_terms;       ///< Of an arm: coefficients c of errors of its joints, q + regressor c; may be absent.
    Eigen::MatrixXd regressor;  ///< Joints x coefficients.
    PosePath path;              ///< Without: a pose, an arm or a constant.
    double t = 0.0;             ///< Of a path, when it was seen [s].
  };

  PoseChain& then(const Pose& T);
  PoseChain& then(FitBlock pose);
  PoseChain& then_inverse(FitBlock pose);
  /// Pose of the flange in frame 0 of the arm, for joint values q.
  PoseChain& then_arm(FitBlock arm, const Eigen::VectorXd& q, FitBlock joint_terms = {},
                      const Eigen::MatrixXd& regressor = {});
  /// Its inverse.
  PoseChain& then_inverse_arm(FitBlock arm, const Eigen::VectorXd& q, FitBlock joint_terms = {},
                              const Eigen::MatrixXd& regressor = {});

  /// Pose of a path at the time t - delay, where `delay` is a block of one number [s]. A measurement for which the path
  /// has no pose bars the fit from going there: leave out those for which it has none at the start.
  PoseChain& then_path(const PosePath& path, double t, FitBlock delay = {});

  const std::vector<Factor>& factors() const { return factors_; }

 private:
  std::vector<Factor> factors_;
};

/// A point of a chain's last frame, or of the world: known, or a block of three coordinates.
struct FitPoint {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  FitBlock block;

  FitPoint() = default;
  FitPoint(const Eigen::Vector3d& known) : value(known) {}  // NOLINT: a known point is a point
  FitPoint(FitBlock unknown) : block(unknown) {}            // NOLINT: so is an unknown one
};

/// How a target departs from its nominal points: point k is moved by rows 3 k to 3 k + 2 of `displacements` times the
/// numbers of a block, such as bow and stretch of a board.
struct FitDeformation {
  FitBlock amounts;               ///< A vector.
  Eigen::MatrixXd displacements;  ///< 3 n x amounts [m per unit].
};

struct CellFitOptions {
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

/// A combination of parameters that the measurements do not determine.
struct UnidentifiableDirection {
  Eigen::VectorXd direction;             ///< In the order of CellFitResult::coordinates, of unit length.
  std::vector<std::string> coordinates;  ///< Those that take part, the greatest share first.
  std::string text;

  static void each_field(auto& self, auto&& visit) {
    visit("direction", self.direction, "Unit vector, in the order of the coordinates, each over its sensitivity [-].");
    visit("coordinates", self.coordinates, "Coordinates that take part, the greatest share first.");
    visit("text", self.text, "Explanation.");
  }
};

struct CellFitResult {
  FitReport fit;
  std::vector<std::string> coordinates;                 ///< Free parameters, nuisances apart: "arm.joint2.a [m]".
  Eigen::MatrixXd covariance;                           ///< In the order of `coordinates`, in their units.
  std::vector<UnidentifiableDirection> unidentifiable;  ///< By the measurements alone, without priors.
  std::vector<std::string> undetermined;  ///< Coordinates with a part that not even a prior holds: infinite variance.
  double cost = 0.0;                      ///< Sum of squared whitened residuals, or of their losses, and of priors [-].
  int residuals = 0;                      ///< Priors not counted.
};

/// Builds and solves the least-squares problem of a cell.
///
///     CellFit fit;
///     const FitBlock arm = fit.add_arm("arm", nominal), base = fit.add_pose("base", T_world_base),
///                    tip = fit.add_point("tool", Eigen::Vector3d::Zero());
///     for (...) fit.observe_position(PoseChain().then(base).then_arm(arm, q), tip, seen, sigma);
///     const CellFitResult result = fit.solve();
///     const kinematics::DhChain identified = fit.arm(arm);
///
/// Blocks of poses are perturbed from the right: T * to_pose(d). Residuals are whitened by the given standard
/// deviations.
class CellFit {
 public:
  CellFit();
  ~CellFit();
  CellFit(CellFit&&) noexcept;
  CellFit& operator=(CellFit&&) noexcept;

  /// Coordinates x y z [m] rx ry rz [rad].
  FitBlock add_pose(const std::string& name, const Pose& start);
  /// A pose of which each measurement has its own, such as the error of a robot pose or the pose of a view. It is
  /// eliminated from the equations and not in the result; a measurement may have one. A prior is needed only where its
  /// measurements do not determine it.
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
  /// Takes a measurement out (0) or gives it another weight.
  void set_weight(FitObservation observation, double weight);
  /// Gives each point of a measurement of pixels its own standard deviation [px]; infinite: it has no part.
  void set_pixel_sigmas(FitObservation observation, const Eigen::VectorXd& sigmas);
  /// Gives a measurement of a pose, a position, points on a plane or a sphere's section another covariance.
  void set_covariance(FitObservation observation, const Eigen::MatrixXd& covariance);

  /// The whole pose of the chain's last frame, with standard deviations per axis [m] and [rad].
  FitObservation observe_pose(const PoseChain& chain, const Pose& seen, double sigma_position, double sigma_rotation);
  /// The same with a covariance of the pose, right perturbation [m, rad].
  FitObservation observe_pose(const PoseChain& chain, const Pose& seen, const Matrix6& covariance);
  /// The place of a point of the chain's last frame; `seen` may be a block: a place that several measurements share.
  FitObservation observe_position(const PoseChain& chain, const FitPoint& point, const FitPoint& seen, double sigma);
  /// The same with a covariance [m^2].
  FitObservation observe_position(const PoseChain& chain, const FitPoint& point, const FitPoint& seen,
                                  const Eigen::Matrix3d& covariance);
  /// The distance of a point of the chain's last frame from another point [m]. With `radius`, a block of one number,
  /// the distance is that number: a point on a sphere.
  FitObservation observe_distance(const PoseChain& chain, const FitPoint& point, const FitPoint& other, double distance,
                                  double sigma, FitBlock radius = {});
  /// A point on the plane z = 0 of the chain's first frame.
  FitObservation observe_on_plane(const PoseChain& chain, const FitPoint& point, double sigma);
  /// Points (3 x n) of the chain's last frame on that plane, such as the line that a profile shows of it, with the
  /// covariance of their distances from it [m^2].
  FitObservation observe_on_plane(const PoseChain& chain, const Eigen::Matrix3Xd& points,
                                  const Eigen::MatrixXd& covariance);
  /// The circle that a scanner sees of a sphere: x, z and radius of the section by the plane y = 0 of the chain's first
  /// frame, with their covariance [m^2]; `centre` is that of the sphere, in the chain's last frame. With
  /// `radius_block`, a block of one number, the sphere's radius is that number.
  FitObservation observe_sphere_section(const PoseChain& chain, const FitPoint& centre, double radius,
                                        const Eigen::Vector3d& seen, const Eigen::Matrix3d& covariance,
                                        FitBlock radius_block = {});
  /// Pixels (2 x n) of points (3 x n) of the chain's last frame, which may deform; the chain begins in the camera.
  FitObservation observe_pixels(const PoseChain& T_camera_target, FitBlock camera, const Eigen::Matrix3Xd& points,
                                const Eigen::Matrix2Xd& pixels, double sigma, const FitDeformation& deformation = {});

  /// Minimises from the present values and keeps what it found.
  /// @throws InvalidArgument when nothing is free.
  CellFitResult solve(const CellFitOptions& options = {});

  Pose pose(FitBlock block) const;
  kinematics::DhChain arm(FitBlock block) const;
  Pinhole camera(FitBlock block) const;
  Eigen::VectorXd values(FitBlock block) const;  ///< As stored: of a pose see pose().
  /// Places of the free coordinates of a block in the result of the last solve, a tied one's being that of the one it
  /// follows; -1 for one that is held.
  std::vector<int> coordinates(FitBlock block) const;

  /// Residuals of a measurement over their standard deviations, at the present values.
  Eigen::VectorXd residuals(FitObservation observation) const;
  /// A measurement near the present values, over its standard deviations, whether it takes part or not: residuals +
  /// by_coordinate d + by_nuisance n, where d changes the coordinates in the order of CellFitResult::coordinates and n
  /// is a change of its nuisance (of a pose a right perturbation).
  struct Derivatives {
    Eigen::VectorXd residuals;
    Eigen::MatrixXd by_coordinate;
    Eigen::MatrixXd by_nuisance;  ///< Without columns where there is none.
  };
  /// Before a solve the coordinates are those that it would have. Empty where the model does not exist there, as behind
  /// a camera. `condensed`: pixels of a known camera as seven rows with the sum of squares, gradient and information of
  /// all.
  std::optional<Derivatives> derivatives(FitObservation observation, bool condensed = false) const;
  /// How a measurement agrees with the others, at the result of the last solve.
  struct Agreement {
    double squared_distance = 0.0;  ///< From what all others say, in its own uncertainty: chi-square of `dof` [-].
    int dof = 0;                    ///< Residuals, less what a nuisance without a prior takes up.
    Eigen::VectorXd residuals;      ///< Over their standard deviations, its nuisance eliminated [-].
    Eigen::VectorXd redundancy;     ///< Share of each residual that the parameters do not take up [-].
  };
  /// Sum of squared residuals near the result of the last solve, as a function of the change d of its coordinates:
  /// squares + 2 gradient' d + d' information d.
  struct SquaredResiduals {
    double squares = 0.0;         ///< [-]
    int rows = 0;                 ///< Residuals in the sum.
    Eigen::VectorXd gradient;     ///< In the order of the coordinates.
    Eigen::MatrixXd information;  ///< Likewise.
  };
  /// Of the residuals of some measurements: rows first_row up to, not including, end_row of each. Measurements taken
  /// out do not count. @throws InvalidArgument for a measurement with a nuisance.
  SquaredResiduals squared_residuals(std::span<const FitObservation> observations, int first_row, int end_row) const;
  Agreement agreement(FitObservation observation) const;
  /// Of measurements that belong together: made at once, or sharing a nuisance; all in use or none.
  Agreement agreement(std::span<const FitObservation> observations) const;
  /// Share of the prior's information on each coordinate that agrees with the data rather than replaces them [-]; of a
  /// nuisance pose, too.
  Eigen::VectorXd prior_redundancy(FitBlock block) const;
  /// Change of each coordinate of a block from its start, in its unit.
  Eigen::VectorXd change(FitBlock block) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace kr5::fit
