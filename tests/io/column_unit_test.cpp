#include <kr5/io/column_unit.hpp>

#include <numbers>
#include <set>

#include <catch2/catch.hpp>

namespace column_unit_test {

using namespace kr5;

TEST_CASE("units of a quantity follow each other, that of SI first, and no name stands twice") {
  std::set<std::string> quantities, names;
  std::string last;
  for (const io::ColumnUnit& unit : io::column_units()) {
    INFO(unit.quantity << " " << unit.name);
    CHECK(names.insert(unit.name).second);
    if (unit.quantity == last) continue;
    CHECK(quantities.insert(unit.quantity).second);
    CHECK(unit.factor == 1.0);
    last = unit.quantity;
  }
}

TEST_CASE("a unit is known in its usual spellings") {
  const auto is = [](const char* text, const char* name) {
    const io::ColumnUnit* unit = io::find_unit(text);
    return unit && unit->name == name;
  };
  CHECK(is("deg", "deg"));
  CHECK(is("Degrees", "deg"));
  CHECK(is("°", "deg"));
  CHECK(is("nm", "N m"));
  CHECK(is("N.m", "N m"));
  CHECK(is("Nm", "Nm"));
  CHECK(is("ma", "mA"));
  CHECK(is("mN", "mN"));
  CHECK(is("nanosec", "ns"));
  CHECK(is("RAD", "rad"));
  CHECK(io::find_unit("turns") == nullptr);
  CHECK(io::find_unit("") == nullptr);
  CHECK(io::find_unit("deg")->factor == Approx(std::numbers::pi / 180).epsilon(1e-15));
  CHECK(io::find_unit("tick")->factor * 4096 == Approx(2 * std::numbers::pi).epsilon(1e-15));
}

TEST_CASE("a unit is taken off the end of a name, an index is not") {
  const auto split = [](const std::string& column) {
    const io::UnitName out = io::split_unit(column);
    return std::pair(out.name, out.unit);
  };
  using Pair = std::pair<std::string, std::string>;
  CHECK(split("q1 [deg]") == Pair{"q1", "deg"});
  CHECK(split("tx (N mm)") == Pair{"tx", "N mm"});
  CHECK(split("x_mm") == Pair{"x", "mm"});
  CHECK(split("cur_1_mA") == Pair{"cur_1", "mA"});
  CHECK(split("position[0]") == Pair{"position[0]", ""});
  CHECK(split("position[ 12 ]") == Pair{"position[ 12 ]", ""});
  CHECK(split("a[0] [rad]") == Pair{"a[0]", "rad"});
  CHECK(split("[deg]") == Pair{"[deg]", ""});
  CHECK(split("q []") == Pair{"q []", ""});
  CHECK(split("_mm") == Pair{"_mm", ""});
  CHECK(split("time_s") == Pair{"time_s", ""});  // which may be anything
  CHECK(split("elbow_joint") == Pair{"elbow_joint", ""});
  CHECK(split("") == Pair{"", ""});
}

}  // namespace column_unit_test
