#include <limits>

#include <catch2/catch.hpp>

#include <kr5/calibration/turn_split.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>

namespace turn_split_test {

using namespace kr5;
using namespace kr5::calibration;
using Catch::Matchers::Contains;

/// Three joints that turn one after the other about (0.1, -0.5, 0.6), six rows each, joint values read to 1e-4.
Eigen::MatrixXd table(Random& random) {
  Eigen::MatrixXd q = Eigen::RowVector3d(0.1, -0.5, 0.6).replicate(18, 1);
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < 6; ++i) q(6 * k + i, k) += 0.1 * (i - 2.5);
  return q + Eigen::MatrixXd::NullaryExpr(18, 3, [&] { return random.uniform(-1e-4, 1e-4); });
}

TEST_CASE("turns in one table are found with the posture at which the other joints stand") {
  Random random(1);
  const TurnSplit split = split_turns(table(random));
  REQUIRE(split.usable());
  CHECK((split.home - Eigen::Vector3d(0.1, -0.5, 0.6)).cwiseAbs().maxCoeff() < 1.1e-4);
  for (int k = 0; k < 3; ++k) {
    std::vector<int> expected(6);
    for (int i = 0; i < 6; ++i) expected[static_cast<std::size_t>(i)] = 6 * k + i;
    CHECK(split.rows[static_cast<std::size_t>(k)] == expected);
  }
}

TEST_CASE("rows with every joint at home belong to each turn, in the order of the table") {
  Random random(2);
  Eigen::MatrixXd q = table(random);
  q.row(8) = q.row(0);
  q(8, 0) = q(9, 0);
  const TurnSplit split = split_turns(q);
  REQUIRE(split.usable());
  CHECK(split.rows[0] == std::vector<int>{0, 1, 2, 3, 4, 5, 8});
  CHECK(split.rows[1] == std::vector<int>{6, 7, 8, 9, 10, 11});
  CHECK(split.rows[2] == std::vector<int>{8, 12, 13, 14, 15, 16, 17});
}

TEST_CASE("joints that moved together, or never, are told by row and number") {
  Random random(3);
  Eigen::MatrixXd q = table(random);
  q(3, 1) += 0.2;
  q(9, 2) -= 0.3, q(9, 0) += 0.1;
  q.col(2).tail(6).setConstant(q(0, 2));
  const TurnSplit split = split_turns(q);
  CHECK_FALSE(split.usable());
  REQUIRE(split.several.size() == 2);
  CHECK(split.several[0].row == 3);
  CHECK(split.several[0].joints == std::vector<int>{0, 1});
  CHECK(split.several[1].row == 9);
  CHECK(split.several[1].joints == std::vector<int>{0, 1, 2});
  CHECK(split.still.empty());  // joint 3 left home in row 9
  q(9, 2) = q(0, 2), q(9, 0) = q(8, 0), q(3, 1) = q(2, 1);
  const TurnSplit alone = split_turns(q);
  CHECK(alone.several.empty());
  CHECK(alone.still == std::vector<int>{2});
  CHECK_FALSE(alone.usable());
}

TEST_CASE("of values that are as common as each other the earliest is home; a wider standstill joins values") {
  const Eigen::MatrixXd q = (Eigen::MatrixXd(6, 1) << 0.3, 0.1, 0.2, 0.3, 0.1, 0.25).finished();
  CHECK(split_turns(q).home[0] == 0.3);
  CHECK(split_turns(q).rows[0].size() == 6);
  CHECK(split_turns(q, {.max_standing = 0.06}).home[0] == 0.25);  // with 0.2 and both 0.3
  CHECK(split_turns(q, {.max_standing = 0.11}).home[0] == 0.2);   // within reach of all
  CHECK(split_turns(q, {.max_standing = 0.11}).still == std::vector<int>{0});
}

TEST_CASE("joint values that are none, or not finite, and a standstill that is none are refused") {
  Eigen::MatrixXd q = Eigen::MatrixXd::Zero(4, 2);
  CHECK_THROWS_WITH(split_turns(q.topRows(0)), Contains("no joint values"));
  CHECK_THROWS_WITH(split_turns(q.leftCols(0)), Contains("no joint values"));
  CHECK_THROWS_WITH(split_turns(q, {.max_standing = 0}), Contains("max_standing"));
  CHECK(split_turns(q).still == std::vector<int>{0, 1});
  q(2, 1) = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(split_turns(q), Contains("must be finite"));
}

}  // namespace turn_split_test
