// SPDX-License-Identifier: BSD-3-Clause
#include "gap/reporting/row_labels.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>

#include <kr5/core/statistics.hpp>

namespace kr5::gap {
namespace {

constexpr double hardly = 0.02;  ///< Reaches and heights that differ by less are one [m].
constexpr double rest = 0.01;    ///< Joints slower than this stand still [rad/s or m/s].

std::string text(const char* format, double value) {
  char out[64];
  std::snprintf(out, sizeof out, format, value);
  return out;
}

/// Joint values as commanded, or else as read; no rows without.
Eigen::MatrixXd joint_values(const cell::Experiment& e, int joints) {
  for (const char* letters : {"qc", "q"}) {
    Eigen::MatrixXd out(e.data.values.rows(), joints);
    int found = 0;
    for (int j = 0; j < joints; ++j)
      if (const int at = e.data.find(letters + std::to_string(j + 1)); at >= 0)
        out.col(found++) = e.data.values.col(at);
    if (found == joints) return out;
  }
  return Eigen::MatrixXd(0, joints);
}

std::vector<double> pooled(const std::vector<Eigen::VectorXd>& all, double above) {
  std::vector<double> out;
  for (const Eigen::VectorXd& values : all)
    std::copy_if(values.begin(), values.end(), std::back_inserter(out), [&](double x) { return x > above; });
  return out;
}

/// Speed of the fastest joint in each row, by central differences.
Eigen::VectorXd fastest(const Eigen::MatrixXd& q, const Eigen::VectorXd& t) {
  const Eigen::Index n = q.rows();
  Eigen::VectorXd out = Eigen::VectorXd::Zero(n);
  for (Eigen::Index i = 0; i < n && n > 1; ++i) {
    const Eigen::Index a = std::max<Eigen::Index>(i - 1, 0), b = std::min(i + 1, n - 1);
    if (t(b) > t(a)) out(i) = (q.row(b) - q.row(a)).cwiseAbs().maxCoeff() / (t(b) - t(a));
  }
  return out;
}

/// Which side of the middle a value lies on, in words; none when all are about the same.
struct Side {
  Side(const std::vector<Eigen::VectorXd>& all, const char* what_of) : what(what_of) {
    const std::vector<double> values = pooled(all, -1e300);
    if (values.empty()) return;
    const auto [least, most] = std::minmax_element(values.begin(), values.end());
    differ = *most - *least > hardly;
    middle = median(values);
    if (middle - *least < hardly / 2) middle = (*least + *most) / 2;  // most of the time at one end
  }
  std::string operator()(double value) const {
    return differ ? what + (value < middle ? text(" below %.2f m", middle) : text(" from %.2f m", middle)) : "";
  }

  std::string what;
  double middle = 0.0;
  bool differ = false;
};

}  // namespace

RowLabels pose_regions(const cell::Recording& recording) {
  const kinematics::DhChain chain = cell::nominal_chain(recording.cell);
  std::vector<Eigen::VectorXd> reach, height;
  for (const cell::Experiment& e : recording.experiments) {
    const Eigen::MatrixXd q = joint_values(e, recording.cell.robot.joints());
    reach.emplace_back(q.rows());
    height.emplace_back(q.rows());
    if (q.rows() == 0) continue;
    const kinematics::Rows T = chain.flanges(q);  // a row the matrix, row by row
    reach.back() = T.col(3).cwiseAbs2() + T.col(7).cwiseAbs2();
    reach.back() = reach.back().cwiseSqrt();
    height.back() = T.col(11);
  }
  const Side of_reach(reach, "reach"), of_height(height, "height");
  RowLabels out(recording.experiments.size());
  if (!of_reach.differ && !of_height.differ) return out;
  for (std::size_t e = 0; e < out.size(); ++e)
    for (Eigen::Index i = 0; i < reach[e].size(); ++i) {
      const std::string a = of_reach(reach[e](i)), b = of_height(height[e](i));
      out[e].push_back(a + (a.empty() || b.empty() ? "" : ", ") + b);
    }
  return out;
}

RowLabels speeds(const cell::Recording& recording) {
  std::vector<Eigen::VectorXd> all;
  for (const cell::Experiment& e : recording.experiments) {
    const int t = e.data.find("t");
    const bool told = e.kind == cell::Kind::Motion && t >= 0;
    const Eigen::MatrixXd q = joint_values(e, recording.cell.robot.joints());
    all.push_back(told && q.rows() > 0 ? fastest(q, e.data.values.col(t)) : Eigen::VectorXd());
  }
  const std::vector<double> moving = pooled(all, rest);
  const double middle = moving.empty() ? rest : median(moving);
  const auto& dh = recording.cell.robot.dh;
  const bool turn = std::all_of(dh.begin(), dh.end(),
                                [](const kinematics::DhJoint& j) { return j.type == kinematics::JointType::Revolute; });
  const std::string unit = turn ? "rad/s" : "rad/s or m/s";
  RowLabels out;
  for (const Eigen::VectorXd& of : all) {
    out.emplace_back();
    for (const double speed : of)
      out.back().push_back(speed <= rest     ? "at rest"
                           : speed <= middle ? text("slow, to %.2g ", middle) + unit
                                             : text("fast, above %.2g ", middle) + unit);
  }
  return out;
}

}  // namespace kr5::gap
