#include <catch2/catch.hpp>

#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Cholesky>

#include <kr5/cell/recording.hpp>
#include <kr5/core/error.hpp>
#include <kr5/physics/scanner.hpp>
#include <kr5/physics/tube.hpp>
#include <kr5/predict/cell_objects.hpp>
#include <kr5/predict/fast_simulator.hpp>
#include <kr5/sim/line_scanner.hpp>

namespace line_scanner_test {

using namespace kr5;
using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

cell::Cell shipped() { return cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml"); }

/// A flange that holds the scanner of the cell straight above a point, looking down.
Pose above(const cell::Cell& cell, double x, double y, double z, double yaw = 0.0) {
  const Pose T_base_scanner = from_xyzrpy((Vector6() << x, y, z, M_PI, 0.0, yaw).finished());
  return T_base_scanner * physics::laser_mount(cell).inverse();
}

sim::LineScannerOptions quiet(int points = 601, double width = 0.09) {
  sim::LineScannerOptions out;
  out.points = points, out.width = width, out.noise = false;
  return out;
}

Pose T_base_scanner(const cell::Cell& cell, const Pose& T_base_flange) {
  return T_base_flange * physics::laser_mount(cell);
}

struct Ball {
  Vector3d centre;
  double radius;
};

/// Least squares on |p|^2 = 2 c.p + (r^2 - |c|^2).
Ball fit_ball(const std::vector<Vector3d>& points) {
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& p : points) middle += p / static_cast<double>(points.size());
  Eigen::MatrixX4d A(static_cast<Index>(points.size()), 4);
  VectorXd b(A.rows());
  for (Index k = 0; k < A.rows(); ++k) {
    const Vector3d p = points[static_cast<std::size_t>(k)] - middle;
    A.row(k) << 2.0 * p.transpose(), 1.0;
    b[k] = p.squaredNorm();
  }
  const Eigen::Vector4d s = (A.transpose() * A).ldlt().solve(A.transpose() * b);
  return {middle + s.head<3>(), std::sqrt(s[3] + s.head<3>().squaredNorm())};
}

/// Points of the sphere in the base, over a pass along Y of the scanner.
std::vector<Vector3d> scan_ball(const cell::Cell& cell, sim::LineScanner& scanner, int number) {
  const Vector3d c = cell.laser->target->sphere;
  std::vector<Vector3d> points;
  for (int line = 0; line < 25; ++line) {
    const Pose T_base_flange = above(cell, c.x(), c.y() - 0.02 + 0.04 * line / 24, c.z() + 0.19, 0.4);
    const sim::Profile& profile = scanner.read(T_base_flange);
    for (Index k = 0; k < profile.x.size(); ++k)
      if (profile.object[static_cast<std::size_t>(k)] == number)
        points.push_back(T_base_scanner(cell, T_base_flange) * Vector3d(profile.x[k], 0.0, profile.z[k]));
  }
  return points;
}

int number_of(const std::vector<cell::PlacedObject>& objects, const std::string& name) {
  for (std::size_t i = 0; i < objects.size(); ++i)
    if (objects[i].name == name) return static_cast<int>(i);
  throw std::runtime_error("no object " + name);
}

}  // namespace

TEST_CASE("the sphere that profiles show has the place and the radius of the cell's") {
  const cell::Cell cell = shipped();
  const auto objects = predict::scanner_objects(cell);
  sim::LineScanner scanner(cell, objects, quiet());
  const auto exact = scan_ball(cell, scanner, number_of(objects, "sphere"));
  REQUIRE(exact.size() > 2000);
  CHECK((fit_ball(exact).centre - cell.laser->target->sphere).norm() < 1e-9);
  CHECK(fit_ball(exact).radius == Approx(cell.laser->target->radius).epsilon(1e-8));

  sim::LineScannerOptions noisy = quiet();
  noisy.noise = true;
  sim::LineScanner real(cell, objects, noisy);
  const Ball found = fit_ball(scan_ball(cell, real, number_of(objects, "sphere")));
  // Noise of z through a fit of n points: far below 10 sigma / sqrt(n), for a cap that fixes all four.
  const double bound = 10.0 * cell.noise.laser / std::sqrt(2000.0) * 5.0;
  CHECK((found.centre - cell.laser->target->sphere).norm() < bound);
  CHECK(std::abs(found.radius - cell.laser->target->radius) < bound);
}

TEST_CASE("noise of a plane has the standard deviation the cell states") {
  const cell::Cell cell = shipped();
  sim::LineScannerOptions options = quiet(20000);
  options.noise = true;
  sim::LineScanner scanner(cell, {predict::wide_plate("bench", 0.3)}, options);
  const VectorXd z = scanner.read(above(cell, 0.6, 0.3, 0.49)).z;
  const double sigma = std::sqrt((z.array() - z.mean()).square().sum() / static_cast<double>(z.size() - 1));
  CHECK(z.mean() == Approx(0.19).margin(5.0 * cell.noise.laser / std::sqrt(20000.0)));
  CHECK(sigma == Approx(cell.noise.laser).epsilon(0.025));  // 5 sigma of an estimate from 20000
}

TEST_CASE("a profile across a tube shows plane, rim, bore and rim where the radii say") {
  const cell::Cell cell = shipped();
  cell::PlacedObject raised = physics::tube_object(cell);
  raised.T_base_object.translation().z() += 0.02;
  sim::LineScanner scanner(cell, {raised, predict::wide_plate("plane", 0.3)}, quiet(6001, 0.06));
  const Vector3d t = raised.T_base_object.translation();
  const sim::Profile& p = scanner.read(above(cell, t.x(), t.y(), t.z() + 0.19));
  for (Index k = 0; k < p.x.size(); ++k) {
    const double r = std::abs(p.x[k]);
    CAPTURE(r);
    if (std::abs(r - raised.radius) < 1e-9 || std::abs(r - raised.inner_radius) < 1e-9) continue;
    const double expected = r > raised.radius ? 0.19 + 0.02 : r > raised.inner_radius ? 0.19 : 0.19 + raised.depth;
    if (r < raised.inner_radius && 0.19 + 0.02 < expected) {
      CHECK(p.z[k] == Approx(0.19 + 0.02));  // the bench stands in the bore: nearer than its bottom
      continue;
    }
    CHECK(p.z[k] == Approx(expected).margin(1e-12));
  }
}

TEST_CASE("bias grows with the square of the way from the best stand-off, and is nothing there") {
  cell::Cell cell = shipped();
  cell.effects.set("laser_bias", "laser", "bias", 1e-3);
  sim::LineScanner scanner(cell, {predict::wide_plate("bench", 0.0)}, quiet(3));
  for (const double range : {0.14, 0.165, 0.19, 0.215, 0.24}) {
    const double off = (range - 0.19) / 0.05;
    CHECK(scanner.read(above(cell, 0.6, 0.0, range)).z[1] == Approx(range + 1e-3 * off * off).epsilon(1e-12));
  }
}

TEST_CASE("a late profile is the one taken further back along Y, and standing still shows no lag") {
  cell::Cell cell = shipped();
  const auto objects = predict::scanner_objects(cell);
  const Vector3d c = cell.laser->target->sphere;
  const Pose here = above(cell, c.x(), c.y(), c.z() + 0.19);
  sim::LineScanner punctual(cell, objects, quiet());
  cell.effects.set("laser_lag", "laser", "lag", 0.05);
  sim::LineScanner late(cell, objects, quiet());
  const double speed = 0.1, back = speed * 0.05;
  const Pose before =
      T_base_scanner(cell, here) * Eigen::Translation3d(0.0, -back, 0.0) * physics::laser_mount(cell).inverse();
  const VectorXd expected = punctual.read(before).z, still = punctual.read(here).z;
  CHECK((late.read(here, speed).z - expected).cwiseAbs().maxCoeff() < 1e-12);
  CHECK((late.read(here, 0.0).z - still).cwiseAbs().maxCoeff() == 0.0);
  CHECK((expected - still).cwiseAbs().maxCoeff() > 1e-4);
}

TEST_CASE("effects of the scanner at their off values leave no trace, and its mount moves what it sees") {
  cell::Cell cell = shipped();
  const auto objects = predict::scanner_objects(cell);
  const Pose T = above(cell, 0.7, 0.05, 0.5);
  const VectorXd plain = sim::LineScanner(cell, objects, quiet()).read(T, 0.1).z;
  cell.effects.set("laser_bias", "laser", "bias", 0.0);
  cell.effects.set("laser_lag", "laser", "lag", 0.0);
  cell.effects.set("laser_mount", "laser", "T_E_L", *cell.laser->T_tool_scanner);
  CHECK((sim::LineScanner(cell, objects, quiet()).read(T, 0.1).z - plain).cwiseAbs().maxCoeff() < 1e-12);
  cell.effects.set("laser_mount", "laser", "T_E_L",
                   Pose(*cell.laser->T_tool_scanner * Eigen::Translation3d(0.0, 0.0, -0.01)));
  CHECK(sim::LineScanner(cell, objects, quiet()).read(T).z[0] == Approx(plain[0] + 0.01));
}

TEST_CASE("a profile is what the fast simulator predicts for the kind scan") {
  cell::Cell cell = shipped();
  cell.effects.set("laser_bias", "laser", "bias", 8e-4);
  cell.effects.set("laser_lag", "laser", "lag", 0.02);
  const VectorXd q = (VectorXd(6) << 0.1, 0.05, -2.7, 0.1, -0.35, 1.4).finished();
  const double speed = 0.06;
  sim::LineScannerOptions options = quiet(101);
  options.near = 0.0, options.far = 2.0;
  sim::LineScanner scanner(cell, predict::scanner_objects(cell), options);
  const sim::Profile& profile = scanner.read(cell::nominal_chain(cell).flange(q), speed);
  cell::Experiment scan{"scan", cell::Kind::Scan, "", cell::Split::Fit, {}};
  scan.data.columns = {"line", "t", "speed", "q1", "q2", "q3", "q4", "q5", "q6", "x"};
  scan.data.values.resize(profile.x.size(), 10);
  for (Index k = 0; k < profile.x.size(); ++k) scan.data.values.row(k) << 0.0, 0.0, speed, q.transpose(), profile.x[k];
  const VectorXd z = predict::FastSimulator().predict(cell, scan).column("z");
  int same = 0;
  for (Index k = 0; k < z.size(); ++k) {
    const auto& object = scanner.objects()[static_cast<std::size_t>(profile.object[static_cast<std::size_t>(k)])];
    if (object.kind == SolidKind::Tube) continue;  // which the kind scan does not know
    CHECK(profile.z[k] == Approx(z[k]).epsilon(1e-12));
    ++same;
  }
  CHECK(same > 50);
}

TEST_CASE("what is out of range has no reading, and bad options are named") {
  const cell::Cell cell = shipped();
  sim::LineScanner scanner(cell, {predict::wide_plate("bench", 0.0)}, quiet(5));
  const sim::Profile& profile = scanner.read(above(cell, 0.6, 0.0, 0.5));
  CHECK(profile.z.array().isNaN().all());
  CHECK(profile.object == std::vector<int>(5, -1));
  CHECK(scanner.nearest() == Approx(0.5));
  sim::LineScannerOptions options = quiet();
  options.far = 0.05;
  CHECK_THROWS_WITH(sim::LineScanner(cell, {}, options), Catch::Contains("far"));
  cell::Cell none = cell;
  none.laser.reset();
  CHECK_THROWS_WITH(sim::LineScanner(none, {}, quiet()), Catch::Contains("laser"));
}

}  // namespace line_scanner_test
