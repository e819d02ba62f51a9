#include <kr5/core/fields.hpp>

#include <map>

#include <catch2/catch.hpp>

/// @file
/// What is said of fields.

namespace fields_test {

using namespace kr5;

struct Result {
  double a = 1, b = 2;
  static void each_field(auto& self, auto&& visit) {
    visit("a", self.a, "Length of a [m].");
    visit("b", self.b, covariance_doc("a", "Covariance of a [m^2]."));
  }
};

TEST_CASE("a field tells its unit, and what else is said of it") {
  CHECK(unit_of("Length [m].") == "m");
  CHECK(unit_of("Joint [rad or m], and z of steps [N m].") == "N m");
  CHECK(unit_of("Share [-].") == "-");
  CHECK(unit_of("A name.") == "-");
  CHECK(unit_of("] no unit [") == "-");
  CHECK(without_unit("Length of the arm [m].") == "Length of the arm.");
  CHECK(without_unit("Joint [rad or m], and z of steps  [N m]") == "Joint, and z of steps");
  CHECK(without_unit("A name.") == "A name.");
  CHECK(without_unit("An interval [0, 1") == "An interval [0, 1");
}

TEST_CASE("a covariance says of which fields it is, a text alone is said of any field") {
  const Result value;
  std::map<std::string, std::string> of, texts;
  Result::each_field(value, [&](const char* name, const auto&, const FieldDoc& doc) { of[name] = doc.covariance_of; });
  Result::each_field(value, [&](const char* name, const auto&, const char* doc) { texts[name] = doc; });
  CHECK(of == std::map<std::string, std::string>{{"a", ""}, {"b", "a"}});
  CHECK(texts.at("b") == "Covariance of a [m^2].");
  static_assert(HasFields<Result>);
}

}  // namespace fields_test
