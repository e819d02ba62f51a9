#include "calibration/postures/device_fit.hpp"

#include <algorithm>

#include <catch2/catch.hpp>

#include <calibration/arm_world.hpp>

namespace device_fit_test {

using namespace kr5;
using namespace kr5::calibration;
using namespace kr5::test;

namespace {

struct SeenTip {
  std::vector<Pose> flanges;
  Eigen::Matrix3Xd places;

  /// The true arm's flanges, so that nothing but noise is left.
  explicit SeenTip(const ArmWorld& w, double scale = 1.0) : places(3, static_cast<Eigen::Index>(w.postures.size())) {
    for (std::size_t i = 0; i < w.postures.size(); ++i) {
      flanges.push_back(w.arm.flange(w.postures[i].q));
      places.col(static_cast<Eigen::Index>(i)) = scale * w.postures[i].points.col(0);
    }
  }
};

}  // namespace

TEST_CASE("device and tip are found to the noise, with a fifth of the places wrong, at any scale") {
  Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const ArmWorld w = make_arm_world({.seed = static_cast<unsigned>(trial + 1)});
    const double scale = trial % 2 ? 1.0 : random.uniform(0.01, 100);
    SeenTip seen(w, scale);
    for (Eigen::Index i = 0; i < seen.places.cols(); i += 5) seen.places.col(i) += 0.1 * scale * random.direction();
    const DeviceFit found = fit_device(seen.flanges, seen.places, trial % 2 == 0);
    CHECK((found.tip - w.tip).norm() < 5e-4);
    CHECK(found.scale == Approx(scale).epsilon(1e-3));
    CHECK((found.T_device_base.linear() - w.T_world_base.linear()).norm() < 2e-3);
    CHECK((found.T_device_base.translation() / scale - w.T_world_base.translation()).norm() < 1e-3);
    CHECK(found.misfit < 5e-4);
    const Eigen::RowVectorXd off = (found.places - tip_places(seen.flanges, w.tip)).colwise().norm();
    double most = 0.0;
    for (Eigen::Index i = 0; i < off.size(); ++i)
      if (i % 5 != 0) most = std::max(most, off[i]);
    CHECK(most < 1e-3);  // noise 0.05 mm an axis, and what device and tip are off
    CHECK((found.scale_std > 0) == (trial % 2 == 0));
  }
}

TEST_CASE("one place, flanges alike and places alike give finite numbers") {
  const ArmWorld w = make_arm_world({.seed = 1, .postures = 10});
  SeenTip seen(w);
  for (const bool free_scale : {false, true}) {
    const DeviceFit one = fit_device({seen.flanges.front()}, seen.places.leftCols(1), free_scale);
    CHECK(one.misfit < 1e-9);
    CHECK(std::isfinite(one.scale_std));
    const DeviceFit still = fit_device(std::vector<Pose>(10, seen.flanges.front()), seen.places, free_scale);
    CHECK(std::isfinite(still.misfit));
    CHECK(std::isfinite(still.scale_std));
    const DeviceFit frozen = fit_device(seen.flanges, seen.places.col(0).replicate(1, 10), free_scale);
    CHECK(std::isfinite(frozen.misfit));
    CHECK(frozen.scale == 1.0);
  }
}

}  // namespace device_fit_test
