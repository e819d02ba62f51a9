// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include <kr5/core/fields.hpp>
#include <kr5/kinematics/dh_chain.hpp>

/// @file
/// Choice of the most informative postures for an arm's parameters, before anything is measured.

namespace kr5::calibration {

/// What a choice of postures makes small.
enum class PostureCriterion {
  Determinant,  ///< Volume of the region of the parameters (D-optimal; the observability index O1 of Borm and Menq
                ///< 1991).
  Prediction,   ///< Mean variance of the predicted place of the point over all candidates (I-optimal).
  Variance,     ///< Mean variance of the parameters, each over its prior (A-optimal).
};
constexpr auto enum_names(PostureCriterion) {
  return names<PostureCriterion>({{PostureCriterion::Determinant, "determinant"},
                                  {PostureCriterion::Prediction, "prediction"},
                                  {PostureCriterion::Variance, "variance"}});
}

struct PostureChoiceOptions {
  int count = 60;
  PostureCriterion criterion = PostureCriterion::Prediction;
  bool measures_pose = false;
  double sigma_position = 1e-4;                     ///< [m]
  double sigma_rotation = 1e-3;                     ///< [rad]
  double tolerance_length = 2e-3;                   ///< [m]
  double tolerance_angle = 5e-3;                    ///< [rad]
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< [m]
  int exchanges = 200;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("count", self.count, "Number of postures.");
    visit("criterion", self.criterion, "Quantity that is minimised: determinant | prediction | variance.");
    visit("measures_pose", self.measures_pose, "Whether the whole pose of the tool is measured, or a point of it.");
    visit("sigma_position", self.sigma_position, "Noise of a measured position per axis [m].");
    visit("sigma_rotation", self.sigma_rotation, "Noise of a measured orientation per axis [rad].");
    visit("tolerance_length", self.tolerance_length, "Spread of true about nominal lengths [m].");
    visit("tolerance_angle", self.tolerance_angle, "Spread of true about nominal angles [rad].");
    visit("point", self.point, "Measured point on the flange, or on the tool whose pose is measured [m].");
    visit("exchanges", self.exchanges, "Maximum number of exchanges after the first choice.");
  }
};

struct PostureChoice {
  std::vector<int> chosen;          ///< Places among the candidates, in ascending order.
  double value = 0.0;               ///< [-] or [m]
  std::vector<double> value_after;  ///< By number of postures.

  static void each_field(auto& self, auto&& visit) {
    visit("chosen", self.chosen, "Places among the candidates, in ascending order.");
    visit("value", self.value,
          "Of the determinant: logarithm of that of the information, per parameter [-]; of the prediction: RMS of the "
          "place [m]; of "
          "the variance: RMS over the prior [-].");
    visit("value_after", self.value_after, "The same of the first one, two, … postures of the first choice.");
  }
};

/// Chooses postures one after the other, then exchanges single ones while that helps (Fedorov 1972). The parameters are
/// those of calibrate_kinematics: arm, base and measured point or tool; candidates should respect limits and be seen.
/// @throws InvalidArgument for fewer candidates than postures, or invalid options.
PostureChoice choose_postures(const kinematics::DhChain& arm, std::span<const Eigen::VectorXd> candidates,
                              const PostureChoiceOptions& options = {});

}  // namespace kr5::calibration
