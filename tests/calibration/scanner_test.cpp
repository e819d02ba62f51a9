#include <limits>

#include <catch2/catch.hpp>

#include <calibration/scanner_world.hpp>
#include <kr5/core/error.hpp>
#include <support/coverage.hpp>
#include <support/rates.hpp>
#include <support/trials.hpp>

namespace scanner_test {

using namespace kr5;
using namespace kr5::test;
using Catch::Matchers::Contains;

namespace {

std::vector<std::string> causes_of(const ScannerResult& r) {
  std::vector<std::string> out;
  for (const ScannerCause& cause : r.causes) out.push_back(cause.cause);
  return out;
}

}  // namespace

TEST_CASE("spheres, an unknown plane and both give the scanner exactly, without a nominal pose", "[scanner]") {
  for (const ScannerWorldOptions& o : {ScannerWorldOptions{.tips = 0, .spheres = 25},
                                       {.tips = 0, .planes = 25},
                                       {.tips = 0, .spheres = 12, .planes = 12}}) {
    const ScannerWorld w = make_scanner_world(o);
    const ScannerResult r = calibrate_scanner(w.views, w.targets);
    CAPTURE(o.spheres, o.planes, r.fit.message);
    REQUIRE(r.fit.usable());
    CHECK(scanner_error(w, r).norm() < 2e-6);
    CHECK(r.T_flange_scanner.linear().determinant() == Approx(1.0).margin(1e-12));
    CHECK(r.causes.empty());
  }
}

TEST_CASE("a sphere of unknown radius and a known tip are as good as their features", "[scanner]") {
  ScannerWorld w = make_scanner_world({.seed = 5, .tips = 0, .spheres = 40, .robot = 5e-5, .noise = 2e-5});
  w.targets[0].radius = 0;
  const ScannerResult r = calibrate_scanner(w.views, w.targets);
  REQUIRE(r.fit.usable());
  CHECK(r.targets[0].radius == Approx(0.02).margin(1e-4));
  CHECK(r.sigma_position == Approx(5e-5).epsilon(0.3));
  const Vector6 e = scanner_error(w, r);
  CHECK(e.dot(r.covariance.ldlt().solve(e)) < uncertainty::chi_square_quantile(0.999, 6));
  CHECK(r.held_out_rms > 0.5 * r.rms);
  CHECK(r.held_out_rms < 2 * r.rms);
}

TEST_CASE("the covariance of a scanner holds the truth", "[scanner][coverage][statistics]") {
  const int trials = test::trials(2000, 100);
  Coverage pose("scanner on the flange, sphere and plane", 6);
  for (int trial = 0; trial < trials; ++trial) {
    const ScannerWorld w = make_scanner_world({.seed = 100 + static_cast<unsigned>(trial),
                                               .tips = 0,
                                               .spheres = 15,
                                               .planes = 15,
                                               .robot = 5e-5,
                                               .noise = 2e-5});
    const ScannerResult r = calibrate_scanner(w.views, w.targets, {.folds = 0});
    REQUIRE(r.fit.usable());
    pose.add(scanner_error(w, r), r.covariance, r.dof);
  }
  pose.check_rate();
}

TEST_CASE("a calibrated arm places the tip better than the nominal one, over 25 trials", "[scanner]") {
  // Row 6: 25 repetitions with the scanner; the gain is the arm's own error.
  const kinematics::DhChain nominal =
      cell::nominal_chain(cell::load_cell(std::string(KR5_SHARE_DIR) + "/cells/kr5_arc.yaml"));
  Random random(8);
  kinematics::DhChain real = nominal;
  for (auto& joint : real.joints) {
    joint.b += random.normal(1e-3), joint.a += random.normal(1e-3);
    joint.theta_offset += random.normal(2e-3), joint.alpha += random.normal(2e-3);
  }
  const Pose truth = book_scanner_pose();
  Eigen::VectorXd home(6);
  home << 0.0, 0.02, -2.75, 0.0, -0.3, 1.571;
  const Eigen::Vector3d tip = real.flange(home) * truth * Eigen::Vector3d(0, 0, 0.19);
  const auto make_views = [&](int count, double scatter) {
    std::vector<ScannerView> views;
    for (int i = 0; i < count; ++i) {
      Eigen::VectorXd q = home;
      q.tail<3>() += random.normal_vector(3, scatter);
      // The first three joints are turned so that the profile meets the tip: Newton's method on y of the tip.
      for (int step = 0; step < 30; ++step) {
        const auto miss = [&](const Eigen::VectorXd& at) {
          const Eigen::Vector3d p = (real.flange(at) * truth).inverse() * tip;
          return Eigen::Vector3d(p.x(), p.y(), p.z() - 0.19 - 0.01 * std::sin(i));
        };
        Eigen::Matrix3d J;
        for (int k = 0; k < 3; ++k) J.col(k) = (miss(q + 1e-6 * Eigen::VectorXd::Unit(6, k)) - miss(q)) / 1e-6;
        const Eigen::Vector3d change =
            J.partialPivLu().solve(miss(q) - Eigen::Vector3d(0.015 * std::cos(2.0 * i), 0, 0));
        q.head<3>() -= std::min(1.0, 0.2 / change.norm()) * change;
      }
      const Eigen::Vector3d p = (real.flange(q) * truth).inverse() * tip;
      if (std::abs(p.y()) > 1e-9 || (q - home).cwiseAbs().maxCoeff() > 2.0) continue;
      ScannerView& view = views.emplace_back();
      view.target = "pin", view.q = q, view.T_base_flange = nominal.flange(q);
      view.feature.points = Eigen::Vector2d(p.x() + random.normal(2e-5), p.z() + random.normal(2e-5));
      view.feature.covariance = 4e-10 * Eigen::Matrix2d::Identity();
      view.feature.fit.status = FitStatus::Converged;
    }
    return views;
  };
  const std::vector<ScannerView> fitted = make_views(120, 0.35), further = make_views(60, 0.35);
  REQUIRE(fitted.size() > 60);
  REQUIRE(further.size() >= 25);
  const std::vector<ScanTarget> targets{{.name = "pin", .kind = ScanTargetKind::Tip, .position = tip, .normal = {}}};
  const ScannerResult plain = calibrate_scanner(fitted, targets),
                      with_arm = calibrate_scanner(fitted, targets, {}, nominal);
  REQUIRE(plain.fit.usable());
  REQUIRE(with_arm.fit.usable());
  double before = 0.0, after = 0.0;
  for (int i = 0; i < 25; ++i) {
    const ScannerView& v = further[static_cast<std::size_t>(i)];
    const Eigen::Vector3d p(v.feature.points(0, 0), 0, v.feature.points(1, 0));
    before += (v.T_base_flange * plain.T_flange_scanner * p - tip).norm() / 25;
    after += (with_arm.arm.flange(v.q) * with_arm.T_flange_scanner * p - tip).norm() / 25;
  }
  CAPTURE(before, after, fitted.size());
  CHECK(after < 2e-4);
  CHECK(before - after > 5e-4);
}

TEST_CASE("outliers of up to a fifth are named, and sound profiles are not", "[scanner]") {
  int sound = 0, wrong = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    ScannerWorld w =
        make_scanner_world({.seed = seed, .tips = 0, .spheres = 20, .planes = 20, .robot = 5e-5, .noise = 2e-5});
    for (std::size_t i = 0; i < w.views.size(); i += 5)
      w.views[i].T_base_flange.translation() += Eigen::Vector3d(0.01, -0.004 * static_cast<double>(i % 4), 0.008);
    const ScannerResult r = calibrate_scanner(w.views, w.targets);
    REQUIRE(r.fit.usable());
    for (std::size_t i = 0; i < w.views.size(); ++i) {
      if (i % 5 == 0)
        wrong += !r.views[i].outlier;
      else
        sound += r.views[i].outlier;
    }
    const Vector6 e = scanner_error(w, r);
    CHECK(e.dot(r.covariance.ldlt().solve(e)) < uncertainty::chi_square_quantile(0.9999, 6));
  }
  CHECK(wrong == 0);
  CHECK(sound <= 2);  // one false alarm in a hundred calibrations is promised
}

TEST_CASE("poses that do not turn, or about one axis, are named with the open direction", "[scanner]") {
  ScannerWorld w = make_scanner_world({.tips = 0, .spheres = 25, .robot = 5e-5, .noise = 2e-5, .tilt = 0.0});
  ScannerResult r = calibrate_scanner(w.views, w.targets);
  CHECK_FALSE(r.fit.usable());
  CHECK_THAT(r.fit.message, Contains("same orientation") && Contains("scanner.x") && Contains("turn the wrist"));
  CHECK(causes_of(r) == std::vector<std::string>{"same_orientation"});
  // A known place closes it: the turn alone follows from the motion along the profile.
  w.targets[0].position = w.sphere;
  CHECK(calibrate_scanner(w.views, w.targets).fit.usable());
}

TEST_CASE("targets at one place of every profile leave the orientation open, in words", "[scanner]") {
  const ScannerWorld w = make_scanner_world({.seed = 3, .tips = 25, .robot = 5e-5, .noise = 2e-5, .same_place = true});
  const ScannerResult r = calibrate_scanner(w.views, w.targets);
  CHECK_FALSE(r.fit.usable());
  CHECK_THAT(r.fit.message, Contains("same place of every profile") && Contains("change the stand-off"));
}

TEST_CASE("known targets serve where few profiles do not place them, with their tolerance", "[scanner]") {
  ScannerWorld w = make_scanner_world({.seed = 6, .tips = 0, .planes = 8, .robot = 5e-5, .noise = 2e-5});
  const ScannerResult free = calibrate_scanner(w.views, w.targets, {.sigma_position = 5e-5});
  w.targets[0].position = w.plane_point, w.targets[0].normal = w.normal;
  const ScannerResult known = calibrate_scanner(w.views, w.targets, {.sigma_position = 5e-5});
  w.targets[0].sigma = 1e-3;
  const ScannerResult tolerant = calibrate_scanner(w.views, w.targets, {.sigma_position = 5e-5});
  REQUIRE(known.fit.usable());
  REQUIRE(tolerant.fit.usable());
  for (const ScannerResult* r : {&known, &tolerant}) {
    const Vector6 e = scanner_error(w, *r);
    CHECK(e.dot(r->covariance.ldlt().solve(e)) < uncertainty::chi_square_quantile(0.999, 6));
  }
  CHECK(known.covariance.trace() < tolerant.covariance.trace());
  CHECK((!free.fit.usable() || tolerant.covariance.trace() < free.covariance.trace()));
}

TEST_CASE("an error of the robot's orientation counts at its lever arm", "[scanner][coverage][statistics]") {
  const int trials = test::trials(2000, 100);
  Coverage pose("scanner on the flange, orientation noise", 6);
  const double sigma = 3e-4;
  for (int trial = 0; trial < trials; ++trial) {
    ScannerWorld w = make_scanner_world(
        {.seed = 5000 + static_cast<unsigned>(trial), .tips = 0, .spheres = 25, .robot = 2e-5, .noise = 2e-5});
    Random random(9000 + static_cast<unsigned>(trial));
    for (ScannerView& view : w.views)
      view.T_base_flange.linear() = view.T_base_flange.linear() * exp_rotation(random.normal_vector(3, sigma));
    const ScannerResult r =
        calibrate_scanner(w.views, w.targets, {.sigma_position = 2e-5, .sigma_rotation = sigma, .folds = 0});
    REQUIRE(r.fit.usable());
    pose.add(scanner_error(w, r), r.covariance, r.dof);
  }
  pose.check_rate();
}

TEST_CASE("a shifted list, mirrored, swapped and scaled coordinates are named", "[scanner]") {
  const ScannerWorld w = make_scanner_world({.seed = 2, .tips = 30, .robot = 5e-5, .noise = 2e-5});
  ScannerOptions nominal;
  nominal.T_flange_scanner = w.T_flange_scanner;
  CHECK(causes_of(calibrate_scanner(w.views, w.targets, nominal)).empty());
  for (const int by : {1, -1}) {
    ScannerWorld wrong = w;
    const auto n = static_cast<int>(w.views.size());
    for (int i = 0; i < n; ++i)
      wrong.views[static_cast<std::size_t>(i)].T_base_flange =
          w.views[static_cast<std::size_t>((i + by + n) % n)].T_base_flange;
    const ScannerResult r = calibrate_scanner(wrong.views, wrong.targets);
    CHECK(causes_of(r) == std::vector<std::string>{"shifted_list"});
    CHECK_THAT(r.fit.message, Contains(by > 0 ? "previous" : "next"));
    CHECK_FALSE(r.fit.usable());
  }
  const auto change = [&](const Eigen::Matrix2d& M) {
    ScannerWorld wrong = w;
    for (ScannerView& view : wrong.views) {
      view.feature.points = M * view.feature.points;
      view.feature.covariance = M * view.feature.covariance * M.transpose();
    }
    return causes_of(calibrate_scanner(wrong.views, wrong.targets, nominal));
  };
  CHECK(change(Eigen::Vector2d(-1, 1).asDiagonal()) == std::vector<std::string>{"mirrored_x"});
  CHECK(change(Eigen::Vector2d(1, -1).asDiagonal()) == std::vector<std::string>{"mirrored_z"});
  CHECK(change((Eigen::Matrix2d() << 0, 1, 1, 0).finished()) == std::vector<std::string>{"swapped_columns"});
  CHECK(change(Eigen::Vector2d(1, 1.08).asDiagonal()) == std::vector<std::string>{"scale"});
}

TEST_CASE("tips whose line misses them are weighed across the profile by themselves", "[scanner]") {
  ScannerWorld w = make_scanner_world({.seed = 4, .tips = 60, .robot = 3e-5, .noise = 1e-5});
  Random random(4);
  for (ScannerView& view : w.views)  // the flange stood elsewhere along Y of the scanner
    view.T_base_flange = view.T_base_flange * w.T_flange_scanner *
                         Pose(Eigen::Translation3d(0, random.normal(4e-4), 0)) * w.T_flange_scanner.inverse();
  const ScannerResult r = calibrate_scanner(w.views, w.targets);
  REQUIRE(r.fit.usable());
  CHECK(r.sigma_across == Approx(4e-4).epsilon(0.35));  // three standard deviations of an estimate from 60
  CHECK(r.sigma_position < 1.5e-4);
  const Vector6 e = scanner_error(w, r);
  CHECK(e.dot(r.covariance.ldlt().solve(e)) < uncertainty::chi_square_quantile(0.999, 6));
}

TEST_CASE("broken data of a scanner calibration are refused with words", "[scanner]") {
  const ScannerWorld w = make_scanner_world({.tips = 0, .spheres = 8});
  const auto refuse = [&](auto&& spoil, const char* words) {
    ScannerWorld wrong = w;
    spoil(wrong);
    CHECK_THROWS_WITH(calibrate_scanner(wrong.views, wrong.targets), Contains(words));
  };
  refuse([](ScannerWorld& x) { x.views.resize(3); }, "at least four profiles, found 3");
  refuse([](ScannerWorld& x) { x.views[2].target = "cup"; }, "there is no target 'cup'");
  refuse([](ScannerWorld& x) { x.targets[0].kind = ScanTargetKind::Tip; }, "shows a sphere, but target ball is a tip");
  refuse(
      [](ScannerWorld& x) {
        x.views[1].feature =
            ProfileFeature{.kind = ScanTargetKind::Sphere, .points = {}, .covariance = {}, .used = {}, .fit = {}};
      },
      "no usable feature");
  refuse([](ScannerWorld& x) { x.views[0].T_base_flange.translation() *= 1000; }, "millimetres");
  refuse([](ScannerWorld& x) { x.views[0].T_base_flange.linear() *= -1; }, "no proper rotation");
  refuse([](ScannerWorld& x) { x.views[0].T_base_flange(0, 3) = std::numeric_limits<double>::quiet_NaN(); }, "proper");
  refuse([](ScannerWorld& x) { x.targets.push_back({.name = "cup", .position = {}, .normal = {}}); },
         "no profile shows it");
  refuse([](ScannerWorld& x) { x.targets[0].radius = 20; }, "millimetres");
  CHECK_THROWS_WITH(calibrate_scanner(w.views, w.targets, {.sigma_position = -1}), Contains("sigma_position"));
  CHECK_THROWS_WITH(
      calibrate_scanner(w.views, w.targets, {},
                        kinematics::DhChain{Pose::Identity(), {kinematics::DhJoint{}, kinematics::DhJoint{}}}),
      Contains("found 0 joint values, the arm has 2"));
}

}  // namespace scanner_test
