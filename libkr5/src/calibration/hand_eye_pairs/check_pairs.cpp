// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/hand_eye_pairs/check_pairs.hpp"

#include <map>
#include <vector>

#include <kr5/core/error.hpp>

#include "calibration/hand_eye/start.hpp"

namespace kr5::calibration {
namespace {

void check_pose(const Pose& T, const std::string& where) {
  require(T.matrix().allFinite(), where + " must be finite");
  require(T.linear().determinant() > 0,
          where + " is a reflection: a left-handed frame, or a mirrored target; expected a rotation");
  require(is_rotation(T.linear(), 1e-3), where + " has no proper rotation");
  require(T.translation().cwiseAbs().maxCoeff() <= hand_eye::farthest_pose,
          where + " lies more than 100 km away; is its unit right?");
}

}  // namespace

std::string name_of_pair(std::span<const PosePair> pairs, std::size_t i) {
  return pairs[i].name.empty() ? std::to_string(i) : pairs[i].name;
}

void check_pairs(std::span<const PosePair> pairs) {
  require(pairs.size() >= 3,
          "hand-eye calibration needs at least three pairs of poses, found " + std::to_string(pairs.size()));
  std::map<std::vector<double>, std::size_t> known;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const std::string where = "pair " + name_of_pair(pairs, i);
    check_pose(pairs[i].T_base_flange, where + ": T_base_flange");
    check_pose(pairs[i].T_camera_target, where + ": T_camera_target");
    const Eigen::Matrix4d &T = pairs[i].T_base_flange.matrix(), &C = pairs[i].T_camera_target.matrix();
    std::vector<double> key(T.data(), T.data() + T.size());
    key.insert(key.end(), C.data(), C.data() + C.size());
    const auto [first, fresh] = known.emplace(std::move(key), i);
    require(fresh, where + " is the same as pair " + name_of_pair(pairs, first->second) +
                       ", in both poses: list each pair only once");
  }
}

}  // namespace kr5::calibration
