// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/hand_eye.hpp>
#include <kr5/core/error.hpp>

namespace kr5::calibration {

void HandEyeOptions::validate() const {
  require(sigma_pixel >= 0, "sigma_pixel must not be negative [px]; 0 means estimated");
  require(sigma_robot_position >= 0, "sigma_robot_position must not be negative [m]; 0 means estimated");
  require(sigma_robot_rotation >= 0, "sigma_robot_rotation must not be negative [rad]; 0 means estimated");
  require(min_rotation > 0 && min_rotation < 3.14, "min_rotation must lie between 0 and pi [rad]");
  require(outlier_false_alarm >= 0 && outlier_false_alarm < 1, "outlier_false_alarm must lie in [0, 1) [-]");
  require(max_iterations >= 1, "max_iterations must be at least 1");
}

}  // namespace kr5::calibration
