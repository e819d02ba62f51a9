#include <catch2/catch.hpp>

#include <kr5/core/random.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/io/format.hpp>

namespace format_test {

using namespace kr5;
using namespace kr5::io;

namespace {
Node yaml(const std::string& text) { return parse_yaml(text, "t"); }

struct Link {
  double mass = 1.0, length = 0.0, width = 0.0;
  static constexpr std::array<std::string_view, 1> required = {"mass"};
  static void each_field(auto& self, auto&& visit) {
    visit("mass", self.mass, "Mass [kg].");
    visit("length", self.length, "Length [m].");
    visit("width", self.width, "Width [m].");
  }
};
}  // namespace

TEST_CASE("what did not change keeps the text in which it was read") {
  const Node source = yaml("b: 1e0\na: {x: 0.50, y: 2}\nextra: spelled\nlist: [1.00, 2.0]\n");
  const Node then = yaml("a: {x: 0.5, y: 2.0}\nb: 1.0\nlist: [1.0, 2.0]\n");
  const Node now = yaml("a: {x: 0.5, y: 3.0}\nb: 1.0\nlist: [1.0, 7.0]\nnew: 5.0\n");
  CHECK(to_yaml(merge_preserving_format(now, then, source)) ==
        "b: 1e0\na: {x: 0.50, y: 3.0}\nextra: spelled\nlist: [1.00, 7.0]\nnew: 5.0\n");
  CHECK(merge_preserving_format(then, then, source) == source);
}

TEST_CASE("what was removed, or has another shape now, is written anew") {
  const Node source = yaml("a: {x: 1}\nb: 2\nlist: [1]\n"), then = yaml("a: {x: 1.0}\nb: 2.0\nlist: [1.0]\n");
  const Node now = yaml("a: [1.0]\nlist: [1.0, 2.0]\n");
  CHECK(to_yaml(merge_preserving_format(now, then, source)) == "a: [1.0]\nlist: [1.0, 2.0]\n");
}

TEST_CASE("keys at their defaults stay out unless they are required") {
  CHECK(to_yaml(to_short_node(Link{})) == "{mass: 1.0}\n");
  CHECK(to_yaml(to_short_node(Link{1.0, 0.0, 2.0})) == "{mass: 1.0, width: 2.0}\n");
  CHECK(to_yaml(to_short_node(std::vector<Link>{{}, {3.0}})) == "- {mass: 1.0}\n- {mass: 3.0}\n");
}

TEST_CASE("a typed pose comes back as the six numbers typed, any other loses nothing") {
  Random random(5);
  for (int i = 0; i < 500; ++i) {
    Vector6 v;
    for (double& x : v) x = std::round(random.uniform(-1.5, 1.5) * 1e4) / 1e4;
    const Node node = pose_node(from_xyzrpy(v));
    Reader reader("t");
    Pose back;
    REQUIRE(reader.read(node, "T", back));
    CHECK(back.matrix() == from_xyzrpy(v).matrix());
    const Pose any = to_pose(random.normal_vector(6));
    REQUIRE(reader.read(pose_node(any), "T", back));
    CHECK(back.matrix() == any.matrix());
  }
  CHECK(to_yaml(pose_node(from_xyzrpy((Vector6() << 0.01, 0.065, -0.06, 0.02, -0.015, 1.57).finished()))) ==
        "[0.01, 0.065, -0.06, 0.02, -0.015, 1.57]\n");
}

}  // namespace format_test
