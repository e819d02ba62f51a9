#include <cmath>
#include <limits>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/calibration/tool.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/uncertainty/confidence.hpp>
#include <support/coverage.hpp>
#include <support/trials.hpp>

namespace tool_test {

using namespace kr5;
using namespace kr5::calibration;

namespace {

struct Touches {
  Eigen::Vector3d tip, point;
  std::vector<Pose> poses;
};

/// Poses whose tip touches one point, with the wrist turned by up to `turn` about `axis` (any axis when zero).
Touches touches(Random& random, int count, double sigma_position, double sigma_rotation, double turn = 0.9,
                const Eigen::Vector3d& axis = Eigen::Vector3d::Zero()) {
  Touches t{0.2 * random.direction(), random.normal_vector(3), {}};
  for (int i = 0; i < count; ++i) {
    Pose T = Pose::Identity();
    T.linear() = exp_rotation((axis.isZero() ? random.direction() : axis) * random.uniform(turn / 4, turn));
    T.translation() = t.point - T.linear() * t.tip + random.normal_vector(3, sigma_position);
    T.linear() = T.linear() * exp_rotation(random.normal_vector(3, sigma_rotation));
    t.poses.push_back(T);
  }
  return t;
}

}  // namespace

TEST_CASE("four exact poses give the exact tip") {
  Random random(1);
  const Touches t = touches(random, 4, 0, 0);
  const ToolResult result = calibrate_tool(t.poses);
  CHECK(result.fit.status == FitStatus::Converged);
  CHECK((result.tip - t.tip).norm() < 1e-12);
  CHECK((result.point - t.point).norm() < 1e-12);
}

TEST_CASE("the 95 % region of the tip holds the truth in 93 to 97 % of trials", "[coverage][statistics]") {
  const int trials = test::trials(4000, 1000);
  struct Case {
    int count;
    double sigma_position, sigma_rotation;
  };
  for (const Case& c : {Case{4, 2e-4, 5e-4}, Case{6, 2e-4, 0}, Case{12, 2e-4, 2e-3}}) {
    Random random(2);
    test::Coverage coverage("tool, " + std::to_string(c.count) + " poses", 3);
    for (int tried = 0, i = 0; i < trials; ++tried) {
      REQUIRE(tried < 2 * trials);
      const Touches t = touches(random, c.count, c.sigma_position, c.sigma_rotation);
      const ToolResult result = calibrate_tool(t.poses);
      if (!result.fit.usable()) continue;  // four random turns may bear too little on the tip, and it says so
      ++i;
      coverage.add(result.tip - t.tip, result.covariance, result.covariance_dof);
    }
    CAPTURE(c.count, c.sigma_position, c.sigma_rotation, coverage.inside(), trials);
    coverage.check_mean();
    coverage.check_rate();
  }
}

TEST_CASE("with the noise given the region is that of the chi-square", "[coverage][statistics]") {
  Random random(3);
  ToolOptions options;
  options.sigma_position = 2e-4;
  options.sigma_rotation = 1e-3;
  test::Coverage coverage("tool, noise given", 3);
  constexpr int trials = 1000;
  for (int tried = 0, i = 0; i < trials; ++tried) {
    REQUIRE(tried < 2 * trials);
    const Touches t = touches(random, 6, options.sigma_position, options.sigma_rotation);
    const ToolResult result = calibrate_tool(t.poses, options);
    if (!result.fit.usable()) continue;  // as above
    ++i;
    REQUIRE(result.covariance_dof == uncertainty::known_noise);
    coverage.add(result.tip - t.tip, result.covariance);
  }
  CAPTURE(coverage.inside());
  coverage.check_mean();
  coverage.check_rate();
}

TEST_CASE("a pose that missed the point is named, and a sound set is left alone", "[statistics]") {
  Random random(4);
  int named = 0, alarms = 0;
  constexpr int trials = 300;
  for (int i = 0; i < trials; ++i) {
    Touches t = touches(random, 8, 2e-4, 5e-4);
    for (const auto& pose : calibrate_tool(t.poses).poses) alarms += pose.outlier;
    t.poses[3].translation() += 0.01 * random.direction();
    const ToolResult result = calibrate_tool(t.poses);
    named += result.poses[3].outlier;
  }
  CAPTURE(named, alarms);
  CHECK(uncertainty::binomial_interval(named, trials).low > 0.95);
  CHECK(uncertainty::binomial_interval(alarms, trials).high < 0.05);
}

TEST_CASE("an outlier does not move the tip, unless it is kept") {
  Random random(5);
  Touches t = touches(random, 10, 1e-4, 0);
  t.poses[7].translation().x() += 0.02;
  ToolOptions keep;
  keep.reject_outliers = false;
  CHECK((calibrate_tool(t.poses).tip - t.tip).norm() < 1e-3);
  const ToolResult kept = calibrate_tool(t.poses, keep);
  CHECK(kept.poses[7].outlier);
  CHECK((kept.tip - t.tip).norm() > 1e-3);
}

TEST_CASE("poses of one orientation do not determine the tip") {
  Random random(6);
  const ToolResult result = calibrate_tool(touches(random, 6, 1e-4, 1e-3, 1e-3).poses);
  CHECK(result.fit.status == FitStatus::Degenerate);
  CHECK(result.fit.message.find("same orientation") != std::string::npos);
}

TEST_CASE("turning about one axis only leaves the tip unknown along it") {
  Random random(7);
  const Eigen::Vector3d axis = random.direction();
  const ToolResult result = calibrate_tool(touches(random, 8, 1e-4, 1e-3, 1.5, axis).poses);
  CHECK(result.fit.status == FitStatus::Degenerate);
  CHECK(result.fit.message.find("one axis") != std::string::npos);
  CHECK(std::abs(result.weak_direction.dot(axis)) > 0.99);
}

TEST_CASE("a peg whose height changed by more than 10 mm is warned of") {
  Random random(8);
  const Touches t = touches(random, 6, 1e-4, 0);
  ToolOptions options;
  options.height_at_calibration = 0.050;
  options.height_now = 0.061;
  CHECK(calibrate_tool(t.poses, options).warnings.size() == 1);
  options.height_now = 0.0591;
  CHECK(calibrate_tool(t.poses, options).warnings.empty());
  options.previous = t.tip + Eigen::Vector3d(0, 0, 0.012);
  CHECK(calibrate_tool(t.poses, options).warnings.size() == 1);
  options.previous = t.tip + Eigen::Vector3d(0, 0, 0.008);
  CHECK(calibrate_tool(t.poses, options).warnings.empty());
}

TEST_CASE("broken input and options are refused by name") {
  Random random(9);
  std::vector<Pose> poses = touches(random, 5, 0, 0).poses;
  CHECK_THROWS_WITH(calibrate_tool(std::span(poses).first(3)), Catch::Contains("expected at least 4"));
  poses[1].translation().x() = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(calibrate_tool(poses), Catch::Contains("pose 2"));
  poses[1].translation().x() = 1e12;
  CHECK_THROWS_WITH(calibrate_tool(poses), Catch::Contains("pose 2") && Catch::Contains("millimetres"));
  ToolOptions options;
  options.height_now = 0.05;
  CHECK_THROWS_WITH(options.validate(), Catch::Contains("height_at_calibration"));
  options = {};
  options.sigma_rotation = 1e-3;
  CHECK_THROWS_WITH(options.validate(), Catch::Contains("sigma_position"));
}

}  // namespace tool_test
