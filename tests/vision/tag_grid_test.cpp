#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/vision/tag_grid.hpp>
#include <support/rates.hpp>

namespace tag_grid_test {

using namespace kr5;
using namespace kr5::vision;
using Catch::Matchers::Contains;
using Eigen::Vector2d;
using Tags = std::vector<TagDetection>;

const Pinhole straight{.width = 1280, .height = 960, .fx = 1100, .fy = 1100, .cx = 639.5, .cy = 479.5};
constexpr double side = 0.03;

/// Where the first corner of a tag stands, in sides.
using Places = std::function<Vector2d(int id)>;

Places row_by_row(int cols, double gap) {
  return [=](int id) -> Vector2d { return (1 + gap) * Vector2d(id % cols, id / cols); };
}

/// A board before the camera, its middle in the middle of the image.
Pose board_pose(double tilt_x, double tilt_y, double turn, const Vector2d& middle, double distance) {
  Pose T = Pose::Identity();
  T.linear() = exp_rotation(Eigen::Vector3d(tilt_x, tilt_y, 0)) * exp_rotation(Eigen::Vector3d(0, 0, turn));
  T.translation() =
      Eigen::Vector3d(0, 0, distance) - T.linear() * Eigen::Vector3d(side * middle.x(), side * middle.y(), 0);
  return T;
}

Tags seen(const std::vector<int>& ids, const Places& places, const Pinhole& camera, const Pose& T_camera_board) {
  Tags out;
  for (const int id : ids) {
    TagDetection& tag = out.emplace_back();
    tag.family = "36h11", tag.id = id;
    const Vector2d corners[] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    for (int k = 0; k < 4; ++k) {
      const Vector2d at = side * (places(id) + corners[k]);
      tag.corners.col(k) = camera.project(T_camera_board * Eigen::Vector3d(at.x(), at.y(), 0));
    }
  }
  return out;
}

std::vector<int> first(int count) {
  std::vector<int> out(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) out[static_cast<std::size_t>(i)] = i;
  return out;
}

Tags whole_board(int rows, int cols, double gap, const Pinhole& camera, const Pose& T) {
  return seen(first(rows * cols), row_by_row(cols, gap), camera, T);
}

Vector2d middle_of(int rows, int cols, double gap) { return (1 + gap) / 2 * Vector2d(cols, rows); }

TagGrid guess(const Tags& tags, const TagGridOptions& options = {}) {
  return guess_tag_grid(std::vector<Tags>{tags}, options);
}

TEST_CASE("rows, columns and gap are exact from slanted views", "[tag_grid]") {
  for (const auto& [rows, cols] : {std::pair(4, 5), std::pair(5, 4), std::pair(2, 3), std::pair(3, 2), std::pair(9, 7)})
    for (const double gap : {0.05, 1.0 / 3, 1.0})
      for (const auto& [x, y, turn] :
           {std::tuple(0.0, 0.0, 0.0), std::tuple(0.9, -0.4, 0.7), std::tuple(-0.5, 1.0, 3.0)}) {
        INFO(rows << " x " << cols << ", gap " << gap << ", tilt " << x << " " << y);
        const TagGrid found = guess(whole_board(
            rows, cols, gap, straight, board_pose(x, y, turn, middle_of(rows, cols, gap), 0.08 * (rows + cols))));
        REQUIRE(found.fit.usable());
        CHECK(found.rows == rows);
        CHECK(found.cols == cols);
        CHECK(found.gap == Approx(gap).epsilon(1e-9));
        CHECK(found.gap_spread < 1e-9);
        CHECK(found.misfit < 1e-6);
        CHECK(found.family == "36h11");
        CHECK(found.ids == first(rows * cols));
      }
}

TEST_CASE("a lens that bends the board changes the gap by little", "[tag_grid]") {
  for (const double k1 : {-0.35, 0.25}) {
    Pinhole lens = straight;
    lens.fx = lens.fy = 700, lens.k1 = k1, lens.k2 = 0.1;
    const double gap = 0.25;
    for (const double tilt : {0.0, 0.6}) {
      const TagGrid found =
          guess(whole_board(6, 8, gap, lens, board_pose(tilt, -tilt, 0.2, middle_of(6, 8, gap), 0.3)));
      INFO("k1 " << k1 << ", tilt " << tilt);
      REQUIRE(found.fit.usable());
      CHECK(found.rows == 6);
      CHECK(found.cols == 8);
      CHECK(found.gap == Approx(gap).epsilon(0.01));
      CHECK(found.misfit > 0.01);  // it is bent
    }
  }
}

TEST_CASE("noise of the corners shows in the spread of the gaps", "[tag_grid]") {
  Random random(1);
  Tags tags = whole_board(5, 7, 0.25, straight, board_pose(0.4, 0.3, 0.1, middle_of(5, 7, 0.25), 0.6));
  for (TagDetection& tag : tags)
    for (double& value : tag.corners.reshaped()) value += random.normal(0.5);
  const TagGrid found = guess(tags);
  REQUIRE(found.fit.usable());
  CHECK(found.cols == 7);
  CHECK(found.gap == Approx(0.25).margin(0.01));
  CHECK(found.gap_spread > 0.005);
  CHECK(found.gap_spread < 0.05);
}

TEST_CASE("some of the tags suffice, and never tell another grid", "[tag_grid]") {
  Random random(2);
  const int rows = 5, cols = 4;
  const Pose T = board_pose(0.5, -0.6, 0.4, middle_of(rows, cols, 0.25), 0.5);
  for (const int count : {7, 10, 15}) {
    int told = 0;
    for (int trial = 0; trial < 40; ++trial) {
      std::vector<int> ids = first(rows * cols - 1);
      std::shuffle(ids.begin(), ids.end(), random.engine());
      ids.resize(static_cast<std::size_t>(count - 1));
      ids.push_back(rows * cols - 1);
      const TagGrid found = guess(seen(ids, row_by_row(cols, 0.25), straight, T));
      if (!found.fit.usable()) continue;
      ++told;
      CHECK(found.rows == rows);
      CHECK(found.cols == cols);
      CHECK(found.gap == Approx(0.25).epsilon(1e-6));
    }
    test::check_rate(told, 40, 0.95, 0.83);  // few may lie in too few rows and columns
  }
}

TEST_CASE("the image with most tags tells of the grid, all images of its tags", "[tag_grid]") {
  const Places places = row_by_row(4, 0.25);
  const Pose T = board_pose(0.2, 0.1, 0.0, middle_of(5, 4, 0.25), 0.5);
  const Tags upper = seen({0, 1, 2, 3, 4, 5, 6}, places, straight, T),
             lower = seen({12, 13, 18, 19}, places, straight, T);
  const TagGrid found = guess_tag_grid(std::vector<Tags>{lower, {}, upper});
  REQUIRE(found.fit.usable());
  CHECK(found.cols == 4);
  CHECK(found.rows == 5);
  CHECK(found.ids == std::vector<int>{0, 1, 2, 3, 4, 5, 6, 12, 13, 18, 19});
}

TEST_CASE("a wrong id that is seen now and then is left out", "[tag_grid]") {
  const Tags board = whole_board(5, 4, 0.25, straight, board_pose(0.2, 0.5, 0.0, middle_of(5, 4, 0.25), 0.5));
  Tags wrong = board;
  wrong.push_back(board[3]), wrong.back().id = 587;
  wrong.back().corners.array() += 40;
  const TagGrid found = guess_tag_grid(std::vector<Tags>{board, wrong, board});
  REQUIRE(found.fit.usable());
  CHECK(found.rows == 5);
  CHECK(found.cols == 4);
  CHECK(found.ids == first(20));
  CHECK_FALSE(guess(wrong).fit.usable());  // in one image nothing tells which is wrong
}

TEST_CASE("tags with equal ids, and those of another family, are not used", "[tag_grid]") {
  Tags tags = whole_board(4, 5, 0.25, straight, board_pose(0.2, 0.5, 0.0, middle_of(4, 5, 0.25), 0.5));
  tags.push_back(tags[7]);
  tags.back().corners.array() += 30;
  for (int k = 0; k < 3; ++k) {
    tags.push_back(tags[static_cast<std::size_t>(k)]);
    tags.back().family = "16h5", tags.back().id = 20 + k;
  }
  const TagGrid found = guess(tags);
  REQUIRE(found.fit.usable());
  CHECK(found.family == "36h11");
  CHECK(found.ids == first(20));
  CHECK(found.cols == 5);
  CHECK(found.gap == Approx(0.25).epsilon(1e-9));
}

TEST_CASE("tags that stand otherwise are not taken for a grid", "[tag_grid]") {
  const Pose T = board_pose(0.3, -0.2, 0.1, {4, 4}, 0.8);
  const auto standing = [&](int count, const Places& places) { return guess(seen(first(count), places, straight, T)); };
  const auto at = [](double x, double y) -> Vector2d { return 1.25 * Vector2d(x, y); };
  CHECK_FALSE(standing(8, [&](int i) { return at(i, 0); }).fit.usable());               // one row
  CHECK_FALSE(standing(8, [&](int i) { return at(0, i); }).fit.usable());               // one column
  CHECK_FALSE(standing(20, [&](int i) { return at(i % 4, -(i / 4)); }).fit.usable());   // numbered from below
  CHECK_FALSE(standing(20, [&](int i) { return at(3 - i % 4, i / 4); }).fit.usable());  // from the right
  CHECK_FALSE(standing(20, [&](int i) { return at(i / 5, i % 5); }).fit.usable());      // column by column
  CHECK_FALSE(standing(20, [&](int i) { return at(7 * i % 20 % 4, 7 * i % 20 / 4); }).fit.usable());
  CHECK_FALSE(  // in the white squares of a chessboard
      standing(15, [&](int i) { return at(2 * (i % 3) + i / 3 % 2, i / 3); }).fit.usable());
  const TagGrid cloud = standing(20, [&](int i) { return at(std::fmod(3.7 * i * i, 6), std::fmod(2.3 * i * i, 5)); });
  CHECK_FALSE(cloud.fit.usable());
  CHECK_THAT(cloud.fit.message, Contains("no grid"));
  CHECK(cloud.ids.size() == 20);
}

TEST_CASE("few tags, one, and none are told apart", "[tag_grid]") {
  const Tags board = whole_board(5, 4, 0.25, straight, board_pose(0.2, 0.5, 0.0, middle_of(5, 4, 0.25), 0.5));
  const TagGrid none = guess_tag_grid(std::vector<Tags>{});
  CHECK_FALSE(none.fit.usable());
  CHECK(none.family.empty());
  CHECK(none.ids.empty());
  CHECK(guess({}).ids.empty());
  const TagGrid one = guess({board[6]});
  CHECK_FALSE(one.fit.usable());
  CHECK(one.ids == std::vector<int>{6});
  const Tags five(board.begin(), board.begin() + 5), six(board.begin(), board.begin() + 6);
  CHECK_THAT(guess(five).fit.message, Contains("found 5 tags"));
  CHECK(guess(six).cols == 4);
  const Tags apart = {board[0], board[2], board[5], board[7], board[8], board[10], board[13], board[15], board[16]};
  CHECK_THAT(guess(apart).fit.message, Contains("no two neighbours"));
}

TEST_CASE("what is no detection or no option is refused", "[tag_grid]") {
  Tags tags = whole_board(4, 5, 0.25, straight, board_pose(0.2, 0.5, 0.0, middle_of(4, 5, 0.25), 0.5));
  CHECK_THROWS_WITH(guess(tags, {.tolerance = 0.5}), Contains("tolerance"));
  CHECK_THROWS_WITH(guess(tags, {.min_tags = 4}), Contains("min_tags"));
  tags[2].corners(1, 1) = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(guess(tags), Contains("tag 2: corners"));
  tags[2].id = -1;
  CHECK_THROWS_WITH(guess(tags), Contains("must not be negative"));
}

TEST_CASE("tags that are seen as one point have no gap", "[tag_grid]") {
  Tags tags = whole_board(4, 5, 0.25, straight, board_pose(0, 0, 0, middle_of(4, 5, 0.25), 0.5));
  for (TagDetection& tag : tags) tag.corners.setConstant(100.0);
  CHECK_FALSE(guess(tags).fit.usable());
}

}  // namespace tag_grid_test
