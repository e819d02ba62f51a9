// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <string>
#include <vector>

#include <kr5/identification/excitation.hpp>
#include <kr5/kinematics/dh_chain.hpp>

namespace kr5::identification {

/// How near an arm comes to its keep-out zones.
struct NearestApproach {
  double clearance = std::numeric_limits<double>::infinity();  ///< [m]
  std::string where = {};                                      ///< "link 3 to table"; empty without zones.
};

/// An arm as capsules: about the offset b and the length a of every link, and from the flange to the guarded points.
/// What the first joint does not move is left out. Keeps references.
class ArmClearance {
 public:
  /// @param limits Of the motions that are looked at; finite by then.
  ArmClearance(const kinematics::DhChain& chain, const MotionLimits& limits, const ExcitationOptions& options)
      : chain_(chain), limits_(limits), options_(options) {}

  /// A lower bound over the whole motion: between the samples, that of the nearer one less the way that the part can
  /// have gone since. Ends at the first approach below `enough`.
  NearestApproach along(const JointMotion& states, double enough = -std::numeric_limits<double>::infinity()) const;

 private:
  struct Part {
    int link;  ///< From 0; the number of links: the tool.
    double radius;
    LineSegment segment;
  };
  std::vector<Part> parts(const std::vector<Pose>& frames, const Eigen::VectorXd& q) const;
  /// Of each joint: greatest distance of the arm behind it from its axis [m].
  Eigen::VectorXd reaches() const;
  /// Greatest way of a part while the joints go by at most `steps`.
  double max_way(const Part& part, const std::vector<Pose>& frames, const Eigen::VectorXd& steps,
                 const Eigen::VectorXd& reach) const;
  std::string name_of_part(const Part& part) const;

  const kinematics::DhChain& chain_;
  const MotionLimits& limits_;
  const ExcitationOptions& options_;
};

}  // namespace kr5::identification
