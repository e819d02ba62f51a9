#include <array>
#include <filesystem>
#include <limits>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/io/fields.hpp>

namespace fields_test {

using namespace kr5;
using namespace kr5::io;
using Catch::Matchers::Contains;

namespace {

enum class Colour { Red, DarkBlue };
constexpr auto enum_names(Colour) { return names<Colour>({{Colour::Red, "red"}, {Colour::DarkBlue, "dark_blue"}}); }
constexpr auto old_names(Colour) { return names<Colour>({{Colour::DarkBlue, "navy"}}); }

struct Part {
  double mass = 0.0;
  Eigen::Vector3d com = Eigen::Vector3d::Zero();
  static constexpr std::array<std::string_view, 1> required = {"mass"};
  static void each_field(auto& self, auto&& visit) {
    visit("mass", self.mass, "Mass [kg].");
    visit("com", self.com, "Centre of mass [m].");
  }
};

struct Everything {
  double number = 1.0;
  int whole = 2;
  bool flag = false;
  std::string text;
  Colour colour = Colour::Red;
  std::optional<double> maybe;
  std::vector<Part> parts;
  std::map<std::string, double> map;
  Eigen::VectorXd vector;
  Eigen::MatrixXd matrix;
  Pose T_a_b = Pose::Identity();
  static void each_field(auto& self, auto&& visit) {
    visit("number", self.number, "A number.");
    visit("whole", self.whole, "A whole number.");
    visit("flag", self.flag, "A flag.");
    visit("text", self.text, "A text.");
    visit("colour", self.colour, "A colour.");
    visit("maybe", self.maybe, "A number or nothing.");
    visit("parts", self.parts, "Parts.");
    visit("map", self.map, "Numbers by name.");
    visit("vector", self.vector, "A vector.");
    visit("matrix", self.matrix, "A matrix.");
    visit("T_a_b", self.T_a_b, "A pose.");
  }
};

std::string complaint(const std::string& yaml) {
  Everything value;
  Reader reader("x.yaml");
  reader.read(parse_yaml(yaml, "x.yaml"), "", value);
  std::string text;
  for (const Diagnostic& p : reader.diagnostics()) text += p.text() + "\n";
  return text;
}

}  // namespace

TEST_CASE("a struct with every kind of field goes through a file unchanged") {
  Random random(11);
  Everything value;
  value.number = random.normal();
  value.whole = -5;
  value.flag = true;
  value.text = "yes";  // a truth value to YAML unless quoted
  value.colour = Colour::DarkBlue;
  value.maybe = 1e-300;
  value.parts = {{1.5, random.normal_vector(3)}, {2.5, random.normal_vector(3)}};
  value.map = {{"b", 0.1}, {"a", -2.0}};
  value.vector = random.normal_vector(4);
  value.matrix = Eigen::MatrixXd(random.normal_vector(6)).reshaped(2, 3);
  value.T_a_b = to_pose(random.normal_vector(6));
  const auto file = std::filesystem::temp_directory_path() / "kr5_io_everything.yaml";
  save(value, file);
  const auto back = load<Everything>(file);
  std::filesystem::remove(file);
  CHECK(to_yaml(to_node(back)) == to_yaml(to_node(value)));
  CHECK(back.T_a_b.matrix() == value.T_a_b.matrix());
  CHECK(back.text == "yes");
}

TEST_CASE("texts that look like something else stay texts") {
  for (const std::string text :
       {"12", "1e5", "true", "No", "null", "~", "", "2024-01-01", ".inf", "1:30", "- x", "a: b"}) {
    Reader reader("x");
    std::string back;
    REQUIRE(reader.read(parse_yaml(to_yaml(to_node(text)), "x"), "", back));
    CHECK(back == text);
    CHECK((to_yaml(to_node(text)).find('"') == 0 || text == "a: b"));
  }
}

TEST_CASE("absent keys keep their defaults and a null empties an optional") {
  Everything value;
  value.maybe = 3.0;
  Reader reader("x.yaml");
  CHECK(reader.read(parse_yaml("maybe: null\nnumber: 4", "x.yaml"), "", value));
  CHECK_FALSE(value.maybe);
  CHECK(value.number == 4.0);
  CHECK(value.whole == 2);
}

TEST_CASE("a name of an earlier version is read, and neither written nor offered") {
  Everything value;
  Reader reader("x.yaml");
  CHECK(reader.read(parse_yaml("colour: navy", "x.yaml"), "", value));
  CHECK(value.colour == Colour::DarkBlue);
  CHECK(to_node(value.colour).scalar == "dark_blue");
  CHECK(complaint("colour: green") == "x.yaml:1: colour: found 'green', expected one of red | dark_blue\n");
}

TEST_CASE("an unknown key is named with the one it was probably meant to be") {
  CHECK(
      complaint("a: 1\nparts:\n  - {mass: 1}\n  - mass: 1\n    comm: [0, 0, 0]\n") ==
      "x.yaml:5: parts[1].comm: found an unknown key, expected no such key; did you mean 'com'?\n"
      "x.yaml:1: a: found an unknown key, expected one of number whole flag text colour maybe parts map vector matrix "
      "T_a_b\n");
}

TEST_CASE("a value of the wrong type is named with line, field, what stands there and what should") {
  CHECK(complaint("\nnumber: fast") == "x.yaml:2: number: found 'fast', expected a number\n");
  CHECK(complaint("number: '1'") == "x.yaml:1: number: found the quoted text '1', expected a number\n");
  CHECK(complaint("number: .nan") == "x.yaml:1: number: found '.nan', expected a number, not NaN\n");
  CHECK(complaint("number: nan") == "x.yaml:1: number: found 'nan', expected a number\n");
  CHECK(complaint("number: ") == "x.yaml:1: number: found nothing, expected a number\n");
  CHECK(complaint("number: 1e999") == "x.yaml:1: number: found '1e999', expected a number\n");
  CHECK(complaint("whole: 1.5") == "x.yaml:1: whole: found '1.5', expected a whole number\n");
  CHECK(complaint("whole: 99999999999") == "x.yaml:1: whole: found '99999999999', expected a whole number\n");
  CHECK(complaint("flag: yes") == "x.yaml:1: flag: found 'yes', expected true or false\n");
  CHECK(complaint("text: [a]") == "x.yaml:1: text: found a list of 1, expected text\n");
  CHECK(complaint("colour: green") == "x.yaml:1: colour: found 'green', expected one of red | dark_blue\n");
  CHECK(complaint("parts: {mass: 1}") == "x.yaml:1: parts: found a map of 1, expected a list\n");
  CHECK(complaint("parts: [1]") == "x.yaml:1: parts[0]: found '1', expected a map of name: value\n");
  CHECK(complaint("map: [1]") == "x.yaml:1: map: found a list of 1, expected a map of name: value\n");
  CHECK(complaint("parts: [{mass: 1, com: [1, 2]}]") ==
        "x.yaml:1: parts[0].com: found a list of 2, expected a list of 3 numbers\n");
  CHECK(complaint("matrix: [[1, 2], [3]]") == "x.yaml:1: matrix: found a list of 2, expected rows of equal length\n");
  CHECK(complaint("vector: [1, x]") == "x.yaml:1: vector[1]: found 'x', expected a number\n");
}

TEST_CASE("a text as long as a file is shown by its beginning") {
  CHECK(complaint("number: " + std::string(500, 'x')) ==
        "x.yaml:1: number: found '" + std::string(80, 'x') + "...', expected a number\n");
}

TEST_CASE("a key that a struct requires is missed by name") {
  CHECK(complaint("parts:\n  - {com: [0, 0, 0]}") ==
        "x.yaml:2: parts[0].mass: found nothing, expected this key, it is required\n");
}

TEST_CASE("all that is wrong is told at once, up to a readable number") {
  const auto file = std::filesystem::temp_directory_path() / "kr5_io_wrong.yaml";
  write_text(file, "number: a\nwhole: b\nflag: c\n");
  CHECK_THROWS_WITH(load<Everything>(file), Contains(":1: number") && Contains(":2: whole") && Contains(":3: flag"));
  std::string many = "vector: [";
  for (int i = 0; i < 60; ++i) many += "x, ";
  write_text(file, many + "x]");
  CHECK_THROWS_WITH(load<Everything>(file), Contains("and 11 more"));
  std::filesystem::remove(file);
}

TEST_CASE("a pose is six numbers or a proper 4x4 matrix") {
  Everything value;
  Reader reader("x.yaml");
  CHECK(reader.read(parse_yaml("T_a_b: [1, 2, 3, 0.1, 0.2, 0.3]", "x"), "", value));
  CHECK(value.T_a_b.matrix() == from_xyzrpy((Vector6() << 1, 2, 3, 0.1, 0.2, 0.3).finished()).matrix());
  CHECK(complaint("T_a_b: [1, 2, 3]") ==
        "x.yaml:1: T_a_b: found a list of 3, expected a pose: six numbers x y z roll pitch yaw [m, rad], or a 4x4 "
        "matrix\n");
  CHECK_THAT(complaint("T_a_b: [[1,0,0,0],[0,1,0,0],[0,0,-1,0],[0,0,0,1]]"),
             Contains("x.yaml:1: T_a_b: found a mirrored rotation (determinant -1)"));
  CHECK_THAT(complaint("T_a_b: [[2,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"),
             Contains("a matrix that is not a rotation"));
  CHECK_THAT(complaint("T_a_b: [[1,0,0,0],[0,1,0,0],[0,0,1,0],[1,2,3,1]]"), Contains("last row 0 0 0 1"));
}

namespace {
struct Renamed {
  double T_long = 0.0, plain = 0.0;
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 1> file_keys = {{{"T_long", "T_L"}}};
  static constexpr std::array<std::string_view, 1> required = {"T_L"};
  static void each_field(auto& self, auto&& visit) {
    visit("T_long", self.T_long, "A field with another key in files.");
    visit("plain", self.plain, "A field with its own.");
  }
};
}  // namespace

TEST_CASE("a field may have another key in files, which is read, written, required and named") {
  Renamed value;
  Reader good("t");
  CHECK(good.read(parse_yaml("T_L: 2\nplain: 3\n", "t"), "", value));
  CHECK(value.T_long == 2.0);
  CHECK(to_yaml(to_node(value)) == "T_L: 2.0\nplain: 3.0\n");
  Reader bad("t");
  CHECK_FALSE(bad.read(parse_yaml("T_long: 2\n", "t"), "", value));
  REQUIRE(bad.diagnostics().size() == 2);
  CHECK(bad.diagnostics()[0].field == "T_L");
  CHECK(bad.diagnostics()[1].found == "an unknown key");
}

}  // namespace fields_test
