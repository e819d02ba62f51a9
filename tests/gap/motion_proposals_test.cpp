#include "gap/planning/motion_proposals.hpp"

#include <algorithm>
#include <cmath>

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"
#include "gap/planning/workspace.hpp"

/// @file
/// Motions and postures to do next.

namespace motion_proposals_test {

using namespace kr5;
using namespace linear_world;

namespace {

/// A motion about a posture that the arm can take, and views from where the tool is far below that.
cell::Recording recorded() {
  cell::Recording r;
  r.cell = unit_noise();
  r.experiments = {motion("motion-1", cell::Split::Fit, 200),
                   experiment("views-1", cell::Kind::Views, cell::Split::Fit)};
  const double middle[] = {0.0, 0.02, -2.75, 0.0, -0.3, 1.571}, low[] = {0.0, 1.6, -1.7, 0.0, -0.3, 1.571};
  for (int j = 1; j <= 6; ++j) {
    const std::string number = std::to_string(j);
    if (j > 1) r.experiments[0].data.values.col(r.experiments[0].data.find("qc" + number)).setConstant(middle[j - 1]);
    add_column(r.experiments[1], "q" + number, Eigen::VectorXd::Constant(2, low[j - 1]));
  }
  return r;
}

Eigen::MatrixXd joints(const gap::Proposal& p, const std::string& letters) {
  return p.experiment.data.values.middleCols(p.experiment.data.find(letters + "1"), 6);
}

bool speaks_of(const gap::Proposal& p, const std::string& words) { return p.what.find(words) != std::string::npos; }

std::ptrdiff_t count(const std::vector<gap::Proposal>& all, const std::string& words) {
  return std::ranges::count_if(all, [&](const gap::Proposal& p) { return speaks_of(p, words); });
}

}  // namespace

TEST_CASE("motions stay within the workspace and its speeds, begin and end at rest, and follow the clock") {
  const cell::Recording r = recorded();
  const gap::Family family{r, {2}, 0.7, 3.0, 600.0, 1, false};
  const gap::Workspace workspace(family);
  const std::vector<gap::Proposal> all = gap::motion_proposals(family);
  for (const char* words :
       {"move all joints at once", "swing joint 1 ", "swing joint 2 ", "swing joint 3 ", "swing joint 4 ",
        "swing joint 5 ", "swing joint 6 ", "the arm stretched", "the arm drawn in", "3 kg more on the tool"}) {
    CAPTURE(words);
    CHECK(count(all, words) > 0);
  }
  for (const gap::Proposal& p : all) {
    CAPTURE(p.what);
    const Eigen::MatrixXd q = joints(p, "qc");
    const Eigen::Index n = q.rows();
    CHECK(workspace.contains_path(q));
    const Eigen::MatrixXd speed = (q.bottomRows(n - 1) - q.topRows(n - 1)) / workspace.cycle;
    CHECK((speed.cwiseAbs().colwise().maxCoeff().transpose().array() <= workspace.speed.array() * (1 + 1e-6)).all());
    CHECK((q.row(1) - q.row(0)).cwiseAbs().maxCoeff() < 0.05 * speed.cwiseAbs().maxCoeff() * workspace.cycle + 1e-6);
    CHECK((q.row(n - 1) - q.row(0)).norm() < 0.02);  // back where it began
    const Eigen::VectorXd t = p.experiment.data.column("t");
    CHECK((t.tail(n - 1) - t.head(n - 1)).minCoeff() == Approx(workspace.cycle));
    CHECK(t(0) >= gap::end_time_of(r, cell::Kind::Motion));
    CHECK(p.seconds >= gap::set_up + workspace.cycle * static_cast<double>(n) - 1e-9);
    CHECK((p.load > 0) == speaks_of(p, "3 kg more on the tool"));
  }
  CHECK(count(all, "joint 3") > count(all, "joint 2"));  // effects sit on it
  CHECK(count(all, "has been kept moving") == 2);
  CHECK(count(all, "cold start") == 0);  // the cell is cold still
}

TEST_CASE("motions of a cell whose servos can be simulated are commanded, of others measured") {
  cell::Recording r = recorded();
  const auto reference = [&] {
    return gap::motion_proposals(gap::Family{r, {}, 0.7}).front().experiment.joint_reference;
  };
  CHECK(reference() == cell::JointReference::Commanded);
  r.cell.servo->joint.clear();
  CHECK(reference() == cell::JointReference::Measured);
  r.cell.servo->torque = {{.stiffness = 20.0, .damping = 1.0}};
  CHECK(reference() == cell::JointReference::Commanded);
}

TEST_CASE("a cell that has moved for long may start cold again") {
  cell::Recording r = recorded();
  cell::Experiment& e = r.experiments.front();
  e.data.values.col(e.data.find("t")).array() += 600.0;
  const std::vector<gap::Proposal> all = gap::motion_proposals(gap::Family{r, {}, 0.7, 0.0, 0.0, 1, false});
  REQUIRE(count(all, "cold start") == 1);
  for (const gap::Proposal& p : all) CHECK((p.experiment.data.column("t")(0) == 0.0) == speaks_of(p, "cold start"));
}

TEST_CASE("of one joint only that joint moves, and a brief family has few short ones") {
  const cell::Recording r = recorded();
  const std::vector<gap::Proposal> all = gap::motion_proposals(gap::Family{r, {2}, 0.7, 0.0, 0.0, 1, true});
  REQUIRE_FALSE(all.empty());
  CHECK(all.size() < gap::motion_proposals(gap::Family{r, {2}, 0.7, 0.0, 0.0, 1, false}).size());
  for (const gap::Proposal& p : all) {
    if (!speaks_of(p, "swing joint")) continue;
    CHECK(speaks_of(p, "swing joint 3"));
    const Eigen::MatrixXd q = joints(p, "qc");
    for (Eigen::Index j = 0; j < 6; ++j) CHECK((q.col(j).maxCoeff() - q.col(j).minCoeff() > 1e-3) == (j == 2));
  }
}

TEST_CASE("the same seed proposes the same motions, and another one others") {
  const cell::Recording r = recorded();
  const auto first = [&](std::uint64_t seed) {
    return joints(gap::motion_proposals(gap::Family{r, {}, 0.7, 0, 0, seed, true})[0], "qc");
  };
  CHECK(first(5) == first(5));
  CHECK(first(5) != first(6));
}

TEST_CASE("postures to be measured are spread in the workspace, or run through one joint's range") {
  const cell::Recording r = recorded();
  const gap::Family family{r, {1}, 0.7, 0.0, 0.0, 1, false};
  const gap::Workspace workspace(family);
  const std::vector<gap::Proposal> all = gap::pose_proposals(family);
  REQUIRE(all.size() > 4);
  for (const gap::Proposal& p : all) {
    CAPTURE(p.what);
    const Eigen::MatrixXd q = joints(p, "q");
    for (Eigen::Index i = 0; i < q.rows(); ++i) CHECK(workspace.contains_path(q.row(i)));
    const Eigen::VectorXd t = p.experiment.data.column("t");
    CHECK(t(1) - t(0) == Approx(30.0));  // where no poses were recorded that tell the time
    if (!speaks_of(p, "the others at rest")) continue;
    Eigen::Index moving = 0;
    for (Eigen::Index j = 0; j < 6; ++j) moving += q.col(j).maxCoeff() > q.col(j).minCoeff();
    CHECK(moving == 1);
  }
}

}  // namespace motion_proposals_test
