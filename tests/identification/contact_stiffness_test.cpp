#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/identification/contact_stiffness.hpp>

#include "support/coverage.hpp"
#include "support/trials.hpp"

namespace contact_stiffness_test {

using namespace kr5;
using namespace kr5::identification;
using Catch::Matchers::Contains;
using Eigen::VectorXd;

namespace {

constexpr double stiffness = 23.38e3, touch = 0.1234;

/// Ten readings 0.1 mm apart, as in the book, three of them before contact.
ContactLog ten_readings(std::uint64_t seed, double noise = 0.15) {
  ContactLog log;
  log.depth = VectorXd::LinSpaced(10, touch - 0.25e-3, touch + 0.65e-3);
  Random random(seed);
  log.force = stiffness * (log.depth.array() - touch).max(0.0);
  log.force += random.normal_vector(10, noise);
  return log;
}

/// In and out to 2 mm in 6 s, read every 12 ms.
ContactLog cycle_log(std::uint64_t seed, double position_noise, double force_noise, double way_out = stiffness,
                     double damping = 0.0) {
  ContactLog log;
  const int n = 500;
  log.t = VectorXd::LinSpaced(n, 0.0, 0.012 * (n - 1));
  const Eigen::ArrayXd phase = log.t.array() * 3.14159265358979 / 6.0;
  const Eigen::ArrayXd p = -0.5e-3 + 2.5e-3 * phase.sin();
  const Eigen::ArrayXd speed = 2.5e-3 * 3.14159265358979 / 6.0 * phase.cos();
  log.depth = touch + p;
  log.force.resize(n);
  for (int i = 0; i < n; ++i)
    log.force[i] = p[i] > 0 ? std::max((speed[i] > 0 ? stiffness : way_out) * p[i] + damping * speed[i], 0.0) : 0.0;
  Random random(seed);
  log.depth += random.normal_vector(n, position_noise);
  log.force += random.normal_vector(n, force_noise);
  return log;
}

double std_of(const ContactStiffnessResult& result, int index) { return std::sqrt(result.covariance(index, index)); }

}  // namespace

TEST_CASE("ten readings tell the stiffness of the book, 23.38 N/mm") {
  const ContactStiffnessResult result = identify_contact_stiffness(ten_readings(1));
  REQUIRE(result.fit.usable());
  CHECK(std::abs(result.stiffness - stiffness) < 3 * std_of(result, 0));
  CHECK(std_of(result, 0) < 0.03 * stiffness);
  CHECK(std::abs(result.position - touch) < 3 * std_of(result, 1));
  CHECK(result.free_readings == 3);
  CHECK(result.contact_readings == 7);
  CHECK(result.warnings.empty());
  CHECK(identify_contact_stiffness(ten_readings(1, 0.0)).stiffness == Approx(stiffness).epsilon(1e-6));
}

TEST_CASE("readings in contact only: the offset is taken as zero, which is said") {
  ContactLog log = ten_readings(2);
  log.depth = log.depth.tail(6).eval();
  log.force = log.force.tail(6).eval();
  const ContactStiffnessResult result = identify_contact_stiffness(log);
  REQUIRE(result.fit.usable());
  CHECK(std::abs(result.stiffness - stiffness) < 3 * std_of(result, 0));
  REQUIRE(result.warnings.size() == 1);
  CHECK_THAT(result.warnings[0], Contains("no reading is before contact"));
  CHECK(std_of(result, 2) == 0.0);
}

TEST_CASE("noise of the depth flattens a line fitted to forces alone; with both variables it does not") {
  const double position_noise = 0.2e-3;
  const ContactLog log = cycle_log(3, position_noise, 0.15);
  const ContactStiffnessResult both = identify_contact_stiffness(log, {.position_noise = position_noise});
  const ContactStiffnessResult one = identify_contact_stiffness(log);
  REQUIRE(both.fit.usable());
  CHECK(std::abs(both.stiffness - stiffness) < 3 * std_of(both, 0));
  CHECK(one.stiffness < stiffness - 5 * std_of(both, 0));
  CHECK(both.fit.final_rms == Approx(1.0).margin(0.15));  // in units of the noise that was stated
}

TEST_CASE("outliers are named and do not matter") {
  ContactLog log = ten_readings(4);
  log.force[7] += 8.0;
  ContactStiffnessResult result = identify_contact_stiffness(log);
  CHECK(result.outliers == std::vector<int>{7});
  CHECK(std::abs(result.stiffness - stiffness) < 3 * std_of(result, 0));

  log = cycle_log(5, 0.0, 0.15);
  std::vector<int> wrong;
  for (int i = 20; i < 500; i += 25) {
    log.force[i] += i % 2 ? 4.0 : -4.0;
    wrong.push_back(i);
  }
  result = identify_contact_stiffness(log);
  CHECK(result.outliers == wrong);
  CHECK(std::abs(result.stiffness - stiffness) < 3 * std_of(result, 0));
}

TEST_CASE("a way out of another stiffness is told from the way in, and damping from both") {
  const ContactStiffnessResult yielding = identify_contact_stiffness(cycle_log(6, 0.0, 0.15, 1.1 * stiffness));
  REQUIRE(yielding.unloading_stiffness);
  CHECK(std::abs(yielding.stiffness - stiffness) < 3 * std_of(yielding, 0));
  CHECK(*yielding.unloading_stiffness == Approx(1.1 * stiffness).epsilon(0.01));
  CHECK_THAT(yielding.warnings.at(0), Contains("the way out has a stiffness of"));

  const ContactLog damped = cycle_log(7, 0.0, 0.15, stiffness, 2000.0);
  const ContactStiffnessResult result = identify_contact_stiffness(damped, {.fit_damping = true});
  CHECK_FALSE(result.unloading_stiffness);
  CHECK(std::abs(result.stiffness - stiffness) < 3 * std_of(result, 0));
  CHECK(std::abs(result.damping - 2000.0) < 3 * std_of(result, 3));
}

TEST_CASE("a contact that grows stiffer is told, and fitted when asked for") {
  ContactLog log = cycle_log(8, 0.0, 0.15);
  for (Eigen::Index i = 0; i < log.depth.size(); ++i)
    log.force[i] += stiffness * 100.0 * std::pow(std::max(log.depth[i] - touch, 0.0), 2);
  CHECK_THAT(identify_contact_stiffness(log).warnings.at(0), Contains("no straight line"));
  const ContactStiffnessResult result = identify_contact_stiffness(log, {.fit_hardening = true});
  CHECK(std::abs(result.hardening - 100.0) < 3 * std_of(result, 4));
  CHECK(std::abs(result.stiffness - stiffness) < 3 * std_of(result, 0));
}

TEST_CASE("the stated covariance of a stiffness holds", "[statistics]") {
  const int trials = test::trials(2000, 150);
  test::Coverage ten("identify_contact_stiffness, ten readings", 3), both("identify_contact_stiffness, both noises", 3);
  const Eigen::Vector3d truth(stiffness, touch, 0.0);
  for (int k = 0; k < trials; ++k) {
    const auto seed = static_cast<std::uint64_t>(k) + 50;
    const ContactStiffnessResult few = identify_contact_stiffness(ten_readings(seed));
    REQUIRE(few.fit.usable());
    ten.add(Eigen::Vector3d(few.stiffness, few.position, few.force_offset) - truth,
            few.covariance.topLeftCorner<3, 3>());
    const ContactStiffnessResult many =
        identify_contact_stiffness(cycle_log(seed, 2e-5, 0.15), {.position_noise = 2e-5});
    both.add(Eigen::Vector3d(many.stiffness, many.position, many.force_offset) - truth,
             many.covariance.topLeftCorner<3, 3>());
  }
  ten.check_rate();
  both.check_rate();
}

TEST_CASE("readings that tell no stiffness are refused with the reason") {
  ContactLog log = ten_readings(9);
  log.force = -log.force;
  CHECK_THAT(identify_contact_stiffness(log).fit.message, Contains("force falls with depth"));

  log = ten_readings(9);
  log.depth.setConstant(0.1);
  CHECK_THAT(identify_contact_stiffness(log).fit.message, Contains("press to different depths"));

  log = cycle_log(9, 0.0, 0.15);
  log.force = Random(1).normal_vector(500, 0.15);
  CHECK_FALSE(identify_contact_stiffness(log).fit.usable());

  log = ten_readings(9);
  log.depth.conservativeResize(3), log.force.conservativeResize(3);
  CHECK_THAT(identify_contact_stiffness(log).fit.message, Contains("found 3 readings"));

  log = ten_readings(9);
  log.depth *= 1e3;  // millimetres
  const ContactStiffnessResult result = identify_contact_stiffness(log);
  CHECK_THAT(result.warnings.at(0), Contains("are depths in m"));
}

TEST_CASE("readings with an invalid number are refused with their row") {
  ContactLog log = ten_readings(10);
  log.force[4] = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(identify_contact_stiffness(log), Contains("force: row 4 is not finite"));
  log = ten_readings(10);
  CHECK_THROWS_WITH(identify_contact_stiffness(log, {.fit_damping = true}), Contains("fit_damping: needs the times"));
  CHECK_THROWS_WITH(identify_contact_stiffness(log, {.position_noise = -1}), Contains("position_noise"));
  log.t = VectorXd::Zero(10);
  CHECK_THROWS_WITH(identify_contact_stiffness(log), Contains("t: row 1 is not later"));
}

}  // namespace contact_stiffness_test
