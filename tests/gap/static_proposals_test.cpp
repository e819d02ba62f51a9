#include "gap/planning/static_proposals.hpp"

#include <algorithm>
#include <cmath>

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"

/// @file
/// Experiments about one posture.

namespace static_proposals_test {

using namespace kr5;
using namespace linear_world;

namespace {

const std::vector<double> at_board = {0.1457, -0.2069, -3.5369, -0.1841, 0.3608, 2.8425};
const std::vector<double> at_target = {0.2126, 0.1947, -2.6322, 0.0843, -0.3349, 2.0727};

void add_joints(cell::Experiment& e, const std::vector<double>& q, Eigen::Index rows) {
  for (std::size_t j = 0; j < 6; ++j) add_column(e, "q" + std::to_string(j + 1), Eigen::VectorXd::Constant(rows, q[j]));
}

cell::Recording recorded() {
  cell::Recording r;
  r.cell = unit_noise();
  cell::Experiment views = experiment("views-1", cell::Kind::Views, cell::Split::Fit);
  add_column(views, "view", Eigen::VectorXd::Zero(4));
  add_column(views, "t", Eigen::VectorXd::Zero(4));
  add_joints(views, at_board, 4);
  add_column(views, "marker", Eigen::VectorXd::Zero(4));
  add_column(views, "corner", Eigen::VectorXd::LinSpaced(4, 0, 3));
  cell::Experiment scan = experiment("scan-1", cell::Kind::Scan, cell::Split::Fit);
  add_column(scan, "line", Eigen::VectorXd::Zero(5));
  add_column(scan, "t", Eigen::VectorXd::LinSpaced(5, 0, 1));
  add_column(scan, "speed", Eigen::VectorXd::Constant(5, 0.02));
  add_joints(scan, at_target, 5);
  add_column(scan, "x", Eigen::VectorXd::LinSpaced(5, -0.02, 0.02));
  cell::Experiment press = experiment("press-1", cell::Kind::Press, cell::Split::Fit);
  add_column(press, "run", Eigen::VectorXd::Zero(3));
  add_column(press, "t", Eigen::Vector3d(0, 1, 2));
  add_column(press, "zc", Eigen::Vector3d(0.001, 0.0, -0.004));
  cell::Experiment profile = experiment("profile-1", cell::Kind::Profile, cell::Split::Fit);
  for (const char* column : {"run", "t", "tilt", "alpha", "cx", "cy", "fc"})
    add_column(profile, column, Eigen::Vector3d(0, 1, 2));
  r.experiments = {views, scan, press, profile};
  return r;
}

const gap::Proposal& of(const std::vector<gap::Proposal>& all, const std::string& words) {
  const auto found =
      std::ranges::find_if(all, [&](const gap::Proposal& p) { return p.what.find(words) != std::string::npos; });
  REQUIRE(found != all.end());
  return *found;
}

Pose flange(const cell::Recording& r, const gap::Proposal& p) {
  const io::Table& table = p.experiment.data;
  return cell::nominal_chain(r.cell).flange(table.values.row(0).segment(table.find("q1"), 6).transpose());
}

Pose flange(const cell::Recording& r, const std::vector<double>& q) {
  return cell::nominal_chain(r.cell).flange(Eigen::Map<const Eigen::VectorXd>(q.data(), 6));
}

}  // namespace

TEST_CASE("views are moved in the camera's own axes, the board still before it") {
  const cell::Recording r = recorded();
  const std::vector<gap::Proposal> all = gap::view_proposals(gap::Family{r, {}});
  const Pose T_flange_camera = *cell::T_flange_camera(r.cell), T_base_camera = flange(r, at_board) * T_flange_camera;
  const double distance = (T_base_camera.inverse() * r.cell.board->T_base_target).translation().z();
  const auto moved = [&](const std::string& words) {
    return Pose(T_base_camera.inverse() * flange(r, of(all, words)) * T_flange_camera);
  };
  CHECK((moved("two thirds").translation() - Eigen::Vector3d(0, 0, distance / 3)).norm() < 1e-5);
  CHECK((moved("two thirds").rotation() - Eigen::Matrix3d::Identity()).norm() < 1e-5);
  const Eigen::AngleAxisd turn(moved("one side").rotation());
  CHECK(turn.angle() == Approx(0.35).epsilon(1e-3));
  CHECK(std::abs(turn.axis().x()) == Approx(1.0).epsilon(1e-3));
  // Turned about the point that the camera looked at.
  const Eigen::Vector3d centre(0, 0, distance);
  CHECK((moved("one side") * centre - centre).norm() < 1e-4);
}

TEST_CASE("scans are faster and slower, nearer and farther") {
  const cell::Recording r = recorded();
  const std::vector<gap::Proposal> all = gap::scan_proposals(gap::Family{r, {}});
  CHECK(of(all, "five times").experiment.data.column("speed")(0) == Approx(0.1));
  CHECK(of(all, "a fifth").experiment.data.column("speed")(0) == Approx(0.004));
  const Pose T_flange_scanner = *cell::T_flange_scanner(r.cell);
  for (const auto& [words, z] : {std::pair{"nearer", 0.03}, {"farther", -0.03}}) {
    const Pose moved =
        (flange(r, at_target) * T_flange_scanner).inverse() * flange(r, of(all, words)) * T_flange_scanner;
    CHECK((moved.translation() - Eigen::Vector3d(0, 0, z)).norm() < 1e-5);
  }
}

TEST_CASE("steps go up and down, presses as deep as before or deeper, at the cell's cycle") {
  const cell::Recording r = recorded();
  const double cycle = r.cell.servo->cycle;
  for (const gap::Proposal& p : gap::step_proposals(gap::Family{r, {}})) {
    const io::Table& table = p.experiment.data;
    const double most = table.column("zc").maxCoeff();
    CHECK(most > 0.0);
    CHECK(table.column("zc").minCoeff() == Approx(-most).epsilon(0.01));
    CHECK(table.column("t")(1) - table.column("t")(0) == Approx(cycle));
  }
  double deepest = 0.0;
  for (const gap::Proposal& p : gap::press_proposals(gap::Family{r, {}})) {
    CHECK(p.experiment.data.column("zc")(0) == Approx(0.002));  // above the bench
    deepest = std::min(deepest, p.experiment.data.column("zc").minCoeff());
  }
  CHECK(deepest == Approx(-1.8 * 0.004));
}

TEST_CASE("profiles are changed one quantity at a time") {
  const cell::Recording r = recorded();
  const std::vector<gap::Proposal> all = gap::profile_proposals(gap::Family{r, {}});
  const auto factor = [&](const std::string& words, const char* column) {
    return of(all, words).experiment.data.column(column)(1) / r.experiments[3].data.column(column)(1);
  };
  CHECK(factor("twice the force", "fc") == 2.0);
  CHECK(factor("twice the force", "tilt") == 1.0);
  CHECK(factor("0.6 times the tilt", "tilt") == 0.6);
  CHECK(factor("the tube's X axis", "cy") == -1.0);
  CHECK(factor("half as far", "cx") == 0.5);
  CHECK(factor("half as far", "cy") == 0.5);
  CHECK(gap::profile_proposals(gap::Family{r, {}, 0.7, 0, 0, 1, true}).size() < all.size());
}

TEST_CASE("a cell without the part, or a recording without the kind, has no such experiments") {
  cell::Recording r = recorded();
  r.cell.camera.reset();
  r.cell.laser.reset();
  r.cell.contact.reset();
  CHECK(gap::view_proposals(gap::Family{r, {}}).empty());
  CHECK(gap::scan_proposals(gap::Family{r, {}}).empty());
  CHECK(gap::press_proposals(gap::Family{r, {}}).empty());
  r.cell.servo.reset();
  CHECK(gap::step_proposals(gap::Family{r, {}}).empty());
  r.experiments.clear();
  CHECK(gap::profile_proposals(gap::Family{r, {}}).empty());
}

}  // namespace static_proposals_test
