#include <kr5/arm_log/two_publishers.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/random.hpp>

namespace two_publishers_test {

using namespace kr5;
using arm_log::written_in_turn;
using Eigen::VectorXd;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

VectorXd course(Eigen::Index rows) {
  return VectorXd::LinSpaced(rows, 0, static_cast<double>(rows) / 200).array().sin();
}

/// A course with a row of another after every `every` rows.
template <class Other>
VectorXd mixed(const VectorXd& own, int every, const Other& other) {
  std::vector<double> out;
  for (Eigen::Index k = 0; k < own.size(); ++k) {
    out.push_back(own[k]);
    if (k % every == 0) out.push_back(other(k));
  }
  return Eigen::Map<VectorXd>(out.data(), static_cast<Eigen::Index>(out.size()));
}

TEST_CASE("two publishers that take turns are told, at equal rates and others", "[two_publishers]") {
  const VectorXd own = course(900);
  for (const int every : {1, 2, 3, 8}) {
    INFO("every " << every);
    CHECK(written_in_turn(mixed(own, every, [](Eigen::Index) { return 0.0; })));
    CHECK(written_in_turn(mixed(own, every, [&](Eigen::Index k) { return own[std::max<Eigen::Index>(k - 40, 0)]; })));
  }
  Random random(1);
  const VectorXd noisy = own + random.normal_vector(own.size(), 1e-4);
  CHECK(written_in_turn(mixed(noisy, 1, [&](Eigen::Index) { return 0.3 + random.normal(1e-4); })));
  CHECK(written_in_turn(180 / std::numbers::pi * mixed(noisy, 2, [](Eigen::Index) { return 0.0; })));
}

TEST_CASE("one publisher is not taken for two, with noise, coarse steps, flicker and spikes", "[two_publishers]") {
  Random random(2);
  const VectorXd own = course(3000);
  for (const double size : {0.0, 1e-5, 1e-3, 1e-2, 0.1}) {
    INFO("noise or step " << size);
    CHECK_FALSE(written_in_turn(own + random.normal_vector(3000, size)));
    if (size > 0) CHECK_FALSE(written_in_turn(size * (own / size).array().round()));
  }
  VectorXd flicker = 1.5e-3 * (own / 1.5e-3).array().floor(), spikes = own;
  for (double& value : flicker) value += random.uniform() < 0.3 ? 1.5e-3 : 0.0;  // of a 12-bit encoder
  for (double& value : spikes) value = random.uniform() < 0.02 ? 3.0 : value;
  CHECK_FALSE(written_in_turn(flicker));
  CHECK_FALSE(written_in_turn(180 / std::numbers::pi * flicker));
  CHECK_FALSE(written_in_turn(spikes));
}

TEST_CASE("of what stands still, and of few readings, nothing is said", "[two_publishers]") {
  CHECK_FALSE(written_in_turn(VectorXd()));
  CHECK_FALSE(written_in_turn(VectorXd::Constant(100, 1.0)));
  const VectorXd turns = mixed(VectorXd::Ones(60), 1, [](Eigen::Index) { return 0.0; });
  CHECK_FALSE(written_in_turn(turns.head(19)));
  CHECK_FALSE(written_in_turn(VectorXd::Constant(100, nan)));
  // Two readings alone, over and over, are the last digit of a coarse encoder as well.
  CHECK_FALSE(written_in_turn(turns));
}

TEST_CASE("readings that are missing are passed over", "[two_publishers]") {
  const VectorXd own = course(900);
  VectorXd turns = mixed(own, 1, [&](Eigen::Index k) { return own[std::max<Eigen::Index>(k - 40, 0)]; }), one = own;
  for (Eigen::Index k = 0; k < turns.size(); k += 7) turns[k] = nan;
  for (Eigen::Index k = 0; k < one.size(); k += 7) one[k] = nan;
  CHECK(written_in_turn(turns));
  CHECK_FALSE(written_in_turn(one));
}

}  // namespace two_publishers_test
