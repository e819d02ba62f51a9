// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/kinematics/deviated_arm.hpp>

#include <kr5/core/error.hpp>

namespace kr5::kinematics {
namespace {

/// A chain whose rows change one at a time: links before the first that changed are kept.
class KeptChain {
 public:
  explicit KeptChain(const DhChain& chain) : joints_(chain.joints), poses_(chain.joints.size() + 1, chain.T_base_0) {
    for (std::size_t i = 0; i < joints_.size(); ++i) poses_[i + 1] = poses_[i] * joints_[i].transform(0);
  }

  const Pose& flange(const std::vector<DhJoint>& rows) {
    std::size_t i = 0;
    while (i < rows.size() && same(rows[i], joints_[i])) ++i;
    for (; i < rows.size(); ++i) {
      joints_[i] = rows[i];
      poses_[i + 1] = poses_[i] * rows[i].transform(0);
    }
    return poses_.back();
  }

 private:
  static bool same(const DhJoint& x, const DhJoint& y) {
    return x.b == y.b && x.theta_offset == y.theta_offset && x.a == y.a && x.alpha == y.alpha && x.beta == y.beta;
  }

  std::vector<DhJoint> joints_;
  std::vector<Pose> poses_;
};

/// Joint values become part of the rows, so that the chain stands at zero.
void add_posture(std::vector<DhJoint>& joints, const Eigen::Ref<const Eigen::RowVectorXd>& q) {
  for (std::size_t i = 0; i < joints.size(); ++i)
    (joints[i].type == JointType::Revolute ? joints[i].theta_offset : joints[i].b) += q[static_cast<Eigen::Index>(i)];
}

}  // namespace

double& value_of(DhJoint& joint, DhParameter parameter) {
  switch (parameter) {
    case DhParameter::B:
      return joint.b;
    case DhParameter::Theta:
      return joint.theta_offset;
    case DhParameter::A:
      return joint.a;
    case DhParameter::Beta:
      return joint.beta;
    case DhParameter::Alpha:
      break;
  }
  return joint.alpha;
}

double value_of(const DhJoint& joint, DhParameter parameter) {
  DhJoint copy = joint;
  return value_of(copy, parameter);
}

std::string JointParameter::label() const { return std::string(name_of(parameter)) + std::to_string(joint + 1); }

std::vector<JointParameter> joint_parameters(const DhChain& chain) {
  std::vector<JointParameter> out;
  for (int i = 0; i < static_cast<int>(chain.joints.size()); ++i)
    for (const DhParameter p : {DhParameter::B, DhParameter::Theta, DhParameter::A, DhParameter::Alpha})
      out.push_back({i, p});
  return out;
}

Rows DeviatedArm::errors(const Eigen::Ref<const Rows>& deviations) const {
  const auto count = static_cast<Eigen::Index>(parameters.size()), n = static_cast<Eigen::Index>(nominal.joints.size());
  require(q.size() == n, "q has " + std::to_string(q.size()) + " values, the arm " + std::to_string(n) + " joints");
  for (const JointParameter& p : parameters)
    require(p.joint >= 0 && p.joint < n, "parameters: the arm has no joint " + std::to_string(p.joint + 1));
  const Eigen::Index width = count + (joints_vary ? n : 0);
  require(deviations.cols() == width,
          "deviations have " + std::to_string(deviations.cols()) + " columns, expected " + std::to_string(width));

  DhChain still = nominal;
  if (!joints_vary) add_posture(still.joints, q.transpose());
  KeptChain deviated(still), reference(still);
  std::vector<DhJoint> rows;
  Pose T_nominal = still.flange(Eigen::VectorXd::Zero(n));
  Rows out(deviations.rows(), 6);
  for (Eigen::Index k = 0; k < deviations.rows(); ++k) {
    rows = still.joints;
    if (joints_vary) {
      add_posture(rows, deviations.row(k).tail(n));
      T_nominal = reference.flange(rows);
    }
    for (Eigen::Index i = 0; i < count; ++i) {
      const JointParameter& p = parameters[static_cast<std::size_t>(i)];
      value_of(rows[static_cast<std::size_t>(p.joint)], p.parameter) += deviations(k, i);
    }
    const Pose& T = deviated.flange(rows);
    out.row(k).head<3>() = (T.translation() - T_nominal.translation()).transpose();
    out.row(k).tail<3>() = log_rotation(T.linear() * T_nominal.linear().transpose()).transpose();
  }
  return out;
}

}  // namespace kr5::kinematics
