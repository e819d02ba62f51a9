#include "calibration/hand_eye_diagnosis/reading_fit.hpp"

#include <random>

#include <catch2/catch.hpp>

#include <kr5/core/random.hpp>

#include "support/rates.hpp"
#include "support/trials.hpp"

// One reading of a hand-eye data set whose poses of the target are worse from some views than from others.

namespace reading_fit_test {

using namespace kr5;
using namespace kr5::calibration;
using evidence::fit_reading;
using evidence::Reading;
using evidence::ReadingFit;
using evidence::Sightings;

namespace {

constexpr double position = 1e-3, rotation = 2e-3;  // scales of the noise of the robot [m, rad]
constexpr int views = 24;

struct World {
  Pose X = Pose::Identity(), Y = Pose::Identity();
  Reading reading;
  Sightings sightings;
};

Pose near(Random& random, const Eigen::Vector3d& place, double turn) {
  Vector6 v;
  v << place + Eigen::Vector3d(random.normal_vector(3, 0.1)), random.normal_vector(3, turn);
  return to_pose(v);
}

/// @param tail Degrees of freedom of the multivariate t that the noise follows; 0: normal.
World made(Random& random, double tail) {
  World w;
  w.X = near(random, {0.05, 0, 0.1}, 0.3), w.Y = near(random, {1, 0, 0}, 0.3);
  w.sightings.noise_varies = true;
  for (int i = 0; i < views; ++i) {
    const Pose T = near(random, {0.7, 0, 0.6}, 0.5);
    double scale = 1;
    if (tail > 0) scale = std::sqrt(tail / std::chi_squared_distribution<double>(tail)(random.engine()));
    Vector6 noise;
    noise << random.normal_vector(3, scale * position), random.normal_vector(3, scale * rotation);
    w.reading.robot.push_back(T * to_pose(noise));
    w.reading.sighting.push_back(i);
    w.sightings.index.push_back(i);
    w.sightings.views.push_back({{{.T_camera_target = (T * w.X).inverse() * w.Y}}});
  }
  return w;
}

bool holds(const World& w, const ReadingFit& fit) {
  const Vector6 off = pose_difference(fit.X, w.X);
  return off.dot(fit.covariance.topLeftCorner<6, 6>().ldlt().solve(off)) < uncertainty::chi_square_quantile(0.95, 6);
}

}  // namespace

TEST_CASE("noise that varies from view to view is seen, and the covariance allows for it", "[statistics]") {
  Random random(test::full() ? 91 : 92);
  const int trials = test::trials(2000, 150);
  int seen = 0, nearer = 0, inside = 0;
  for (int t = 0; t < trials; ++t) {
    World w = made(random, 3.0);
    const ReadingFit varied = fit_reading(w.reading, w.sightings);
    REQUIRE(varied.usable);
    w.sightings.noise_varies = false;
    const ReadingFit normal = fit_reading(w.reading, w.sightings);
    seen += varied.score < normal.score - 10;
    nearer += (varied.X.translation() - w.X.translation()).norm() < (normal.X.translation() - w.X.translation()).norm();
    inside += holds(w, varied);
  }
  test::check_rate(seen, trials, 0.8, 0.75);
  test::check_rate(nearer, trials, 0.55, 0.5);
  test::check_rate(inside, trials, 0.9, 0.8);  // maximum likelihood: the noise counts as known
}

TEST_CASE("normal noise is not taken for noise that varies", "[statistics]") {
  Random random(93);
  const int trials = test::trials(2000, 150);
  int varied = 0, inside = 0;
  for (int t = 0; t < trials; ++t) {
    World w = made(random, 0);
    const ReadingFit fit = fit_reading(w.reading, w.sightings);
    REQUIRE(fit.usable);
    w.sightings.noise_varies = false;
    varied += fit.score < fit_reading(w.reading, w.sightings).score - 10;
    inside += holds(w, fit);
  }
  test::check_rare(varied, trials, 0.01, test::full() ? 0.015 : 0.06);
  test::check_rate(inside, trials, 0.85, 0.8);
}

TEST_CASE("a standard deviation is stated, of noise with tails as of normal noise", "[statistics]") {
  Random random(94);
  double sum = 0;
  const int trials = test::trials(400, 60);
  for (int t = 0; t < trials; ++t) {
    const World w = made(random, 8.0);
    sum += fit_reading(w.reading, w.sightings).sigma_position;
  }
  CHECK(sum / trials == Approx(position * std::sqrt(8.0 / 6)).epsilon(0.1));
}

}  // namespace reading_fit_test
