#include <algorithm>

#include <catch2/catch.hpp>

#include <calibration/scanner_world.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "calibration/scanner/scanner_search.hpp"

namespace scanner_search_test {

using namespace kr5;
using namespace kr5::test;
using namespace kr5::calibration::scanner_problem;

namespace {

/// Distance of the nearest of the searched poses from the truth, with a radian as a metre, and its number.
std::pair<double, std::size_t> nearest(const ScannerWorld& w) {
  const std::optional<kinematics::DhChain> no_arm;
  const ScannerOptions options;
  ScannerInput input{w.views, w.targets, options, no_arm, {}, {}};
  for (const ScannerView& view : w.views) {
    input.target_of.push_back(view.target == w.targets.front().name ? 0 : 1);
    input.T_base_flange.push_back(view.T_base_flange);
  }
  std::pair<double, std::size_t> out{1e9, 0};
  const std::vector<Pose> found = searched_poses(input);
  for (std::size_t k = 0; k < found.size(); ++k)
    out = std::min(out, {pose_difference(w.T_flange_scanner, found[k]).norm(), k});
  return out;
}

}  // namespace

TEST_CASE("ten sections of a ball, on both sides of its centre, lead to the right one of all minima") {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const ScannerWorld w =
        make_scanner_world({.seed = seed, .tips = 0, .spheres = 10, .noise = 2e-5, .radius = 0.0125});
    const ScannerResult r = calibrate_scanner(w.views, w.targets);
    const Vector6 off = scanner_error(w, r);
    CAPTURE(seed, off.transpose(), r.rms, r.fit.message);
    REQUIRE(r.fit.usable());
    CHECK(off.dot(r.covariance.ldlt().solve(off)) < uncertainty::chi_square_quantile(0.9999, 6));
    CHECK(r.rms < 1e-4);  // of sections seen with 0.02 mm; beside a wrong minimum it is tenths of millimetres
  }
}

TEST_CASE("the search takes tips as they are, and known places with them") {
  for (const bool known : {false, true}) {
    const auto [distance, place] =
        nearest(make_scanner_world({.seed = 3, .tips = 12, .noise = 2e-5, .known_tip = known}));
    CAPTURE(known);
    CHECK(distance < 5e-3);
    CHECK(place == 0);
  }
}

TEST_CASE("planes alone are nothing to search by") {
  CHECK(nearest(make_scanner_world({.tips = 0, .planes = 20})).first == 1e9);
}

}  // namespace scanner_search_test
