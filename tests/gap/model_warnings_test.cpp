#include <kr5/gap/model_warnings.hpp>

#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>

#include "gap/protocol.hpp"

/// @file
/// Causes that are larger than the errors of a model usually are.

namespace model_warnings_test {

using namespace kr5;
using gap::ModelWarningKind;

namespace {

/// What is warned of of a diagnosis with one cause.
std::vector<gap::ModelWarning> warnings(const std::string& effect, const std::string& target,
                                        const std::vector<gap::ParameterEstimate>& parameters) {
  gap::Diagnosis found;
  found.causes.push_back({{effect, target}, 1.0, parameters});
  return gap::model_warnings(found, protocol::nominal());
}

std::vector<gap::ModelWarning> warnings(const std::string& effect, const std::string& parameter, double value,
                                        double std, const std::string& unit) {
  return warnings(effect, "joint3", {{parameter, {value}, {std}, unit}});
}

}  // namespace

TEST_CASE("a mass is warned of that is surely half as large again, or smaller by that") {
  const double mass = protocol::nominal().robot.links.at(2).mass;
  const auto found = warnings("link_mass", "mass", 2 * mass, 0.1 * mass, "kg");
  REQUIRE(found.size() == 1);
  CHECK(found[0].kind == ModelWarningKind::Mass);
  CHECK(found[0].effect == "link_mass");
  CHECK(found[0].target == "joint3");
  CHECK(found[0].value == Approx(2));
  CHECK(found[0].std == Approx(0.1));
  CHECK(warnings("link_mass", "mass", 0.5 * mass, 0.05 * mass, "kg").size() == 1);
  CHECK(warnings("link_mass", "mass", 2 * mass, 0.3 * mass, "kg").empty());  // perhaps 1.4 times
  CHECK(warnings("link_mass", "mass", 1.4 * mass, 1e-6, "kg").empty());
  CHECK(warnings("link_mass", "mass", 0.7 * mass, 1e-6, "kg").empty());
}

TEST_CASE("a centre of mass may be off by 100 mm, a length by 10 mm and an angle by 0.05 rad") {
  const cell::Cell cell = protocol::nominal();
  const Eigen::Vector3d com = cell.robot.links.at(2).com;
  const auto centre = [&](double off, double std) {
    return warnings("link_com", "joint3", {{"com", {com.x() + off, com.y(), com.z()}, {std, std, std}, "m"}});
  };
  REQUIRE(centre(0.15, 0.01).size() == 1);
  CHECK(centre(0.15, 0.01)[0].kind == ModelWarningKind::Size);
  CHECK(centre(0.15, 0.01)[0].value == Approx(0.15));
  CHECK(centre(0.15, 0.01)[0].std == Approx(0.01 * std::sqrt(3.0)));
  CHECK(centre(0.15, 0.02).empty());  // perhaps 81 mm
  CHECK(centre(0.09, 1e-6).empty());
  const double a = cell.robot.dh.at(2).a, alpha = cell.robot.dh.at(2).alpha;
  CHECK(warnings("link_length", "a", a + 0.012, 5e-4, "m").size() == 1);
  CHECK(warnings("link_length", "a", a - 0.012, 2e-3, "m").empty());
  CHECK(warnings("link_twist", "alpha", alpha - 0.06, 1e-3, "rad").size() == 1);
  CHECK(warnings("link_twist", "alpha", alpha + 0.04, 1e-3, "rad").empty());
}

TEST_CASE("a large offset of a joint may be another zero") {
  const auto found = warnings("encoder_offset", "offset", -0.3, 0.01, "rad");
  REQUIRE(found.size() == 1);
  CHECK(found[0].kind == ModelWarningKind::Zero);
  CHECK(found[0].value == -0.3);
  CHECK(found[0].unit == "rad");
  CHECK(warnings("encoder_offset", "offset", 0.11, 0.01, "rad").empty());
}

TEST_CASE("what sits on no joint, adds to the cell or is not in the catalogue is not warned of") {
  CHECK(warnings("payload", "tool", {{"mass", {50.0}, {0.1}, "kg"}}).empty());
  CHECK(warnings("coulomb_friction", "coulomb", 500.0, 1.0, "N m").empty());
  CHECK(warnings("of_another_program", "mass", 50.0, 0.1, "kg").empty());
  CHECK(gap::model_warnings({}, protocol::nominal()).empty());
}

}  // namespace model_warnings_test
