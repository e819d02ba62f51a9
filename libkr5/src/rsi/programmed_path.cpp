// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/programmed_path.hpp>

#include <cmath>
#include <string>
#include <utility>

#include <kr5/core/error.hpp>

namespace kr5::rsi {

ProgrammedPath::ProgrammedPath(std::vector<Eigen::VectorXd> places, double speed, int joints)
    : places_(std::move(places)), speed_(speed), joints_(robot::JointVector::Zero(joints)) {
  require(speed > 0 && std::isfinite(speed), "path_speed: must be positive [rad/s]");
  for (std::size_t i = 0; i < places_.size(); ++i)
    require(places_[i].size() == joints && places_[i].allFinite(),
            "path[" + std::to_string(i) + "]: expected " + std::to_string(joints) + " joint values [rad or m]");
}

void ProgrammedPath::begin(const robot::JointVector& joints) noexcept {
  joints_ = joints;
  next_ = 0;
}

void ProgrammedPath::advance(double time, double share) noexcept {
  double reach = speed_ * share * time;  // [rad]
  while (reach > 0 && !finished()) {
    const robot::JointVector way = places_[next_] - joints_;
    const double longest = way.size() > 0 ? way.cwiseAbs().maxCoeff() : 0.0;
    if (longest > reach) {
      joints_ += reach / longest * way;
      return;
    }
    joints_ = places_[next_++];
    reach -= longest;
  }
}

}  // namespace kr5::rsi
