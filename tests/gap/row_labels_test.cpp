#include "gap/reporting/row_labels.hpp"

#include <cmath>
#include <map>

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"

/// @file
/// What the arm was doing, row by row.

namespace row_labels_test {

using namespace kr5;
using namespace linear_world;

TEST_CASE("rows are at rest, slow or fast by the fastest joint, halved at the median of what moves") {
  cell::Recording r;
  r.cell = unit_noise();
  cell::Experiment e = motion("motion-1", cell::Split::Fit, 300);
  for (Eigen::Index i = 0; i < 300; ++i) {  // at rest, then joint 1 at 0.2 rad/s, joint 2 at 1 rad/s
    e.data.values(i, e.data.find("qc1")) = step * 0.2 * static_cast<double>(std::clamp<Eigen::Index>(i - 80, 0, 120));
    e.data.values(i, e.data.find("qc2")) = step * 1.0 * static_cast<double>(std::max<Eigen::Index>(i - 200, 0));
  }
  cell::Experiment still = experiment("poses-1", cell::Kind::Poses, cell::Split::Fit);
  add_column(still, "t", Eigen::VectorXd::Zero(3));
  r.experiments = {e, still};
  const gap::RowLabels found = gap::speeds(r);
  REQUIRE(found.size() == 2);
  CHECK(found[1].empty());
  REQUIRE(found[0].size() == 300);
  CHECK(found[0][50] == "at rest");
  CHECK(found[0][150].starts_with("slow, to "));
  CHECK(found[0][250].starts_with("fast, above "));
  CHECK(found[0][250].ends_with(" rad/s"));
  r.cell.robot.dh[0].type = kinematics::JointType::Prismatic;
  CHECK(gap::speeds(r)[0][250].ends_with(" rad/s or m/s"));
}

TEST_CASE("rows are near or far, low or high, halved at the medians; no words for an arm that hardly moved") {
  cell::Recording r;
  r.cell = unit_noise();
  cell::Experiment e = motion("motion-1", cell::Split::Fit, 200);
  for (Eigen::Index i = 0; i < 200; ++i)
    e.data.values(i, e.data.find("qc2")) = 0.004 * static_cast<double>(i);  // leans forward
  r.experiments = {e};
  const gap::RowLabels found = gap::pose_regions(r);
  REQUIRE(found[0].size() == 200);
  std::map<std::string, int> reach;
  for (const std::string& label : found[0]) ++reach[label.substr(0, label.find(','))];
  REQUIRE(reach.size() == 2);
  for (const auto& [label, count] : reach) {
    CHECK(label.starts_with("reach "));
    CHECK(count == Approx(100).margin(2));
  }
  // Independently: the side of the median follows the distance of the flange from the axis of joint 1.
  const kinematics::DhChain arm = cell::nominal_chain(r.cell);
  const auto distance = [&](Eigen::Index row) {
    return arm.flange(e.data.values.row(row).segment(e.data.find("qc1"), 6).transpose()).translation().head<2>().norm();
  };
  const bool grows = distance(199) > distance(0);
  CHECK(found[0][0].starts_with(grows ? "reach below" : "reach from"));
  CHECK(found[0][199].starts_with(grows ? "reach from" : "reach below"));
  for (int j = 1; j <= 6; ++j) r.experiments[0].data.values.col(e.data.find("qc" + std::to_string(j))).setConstant(0.1);
  CHECK(gap::pose_regions(r)[0].empty());
}

}  // namespace row_labels_test
