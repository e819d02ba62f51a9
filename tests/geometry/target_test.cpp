#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/geometry/target.hpp>

namespace target_test {

using namespace kr5;

TEST_CASE("every short form is read") {
  const Target chess = parse_target("chessboard:6x9:0.0236");
  CHECK(chess.kind == TargetKind::Chessboard);
  CHECK(chess.rows == 6);
  CHECK(chess.cols == 9);
  CHECK(chess.size == 0.0236);
  CHECK(parse_target("circles:10x10:0.0254").kind == TargetKind::CircleGrid);
  const Target tag = parse_target("tag:36h11:10:0.048");
  CHECK(tag.kind == TargetKind::Tag);
  CHECK(tag.first_id == 10);
  const Target grid = parse_target("grid:aruco_4x4_50:5x7:0.03:0.01:2");
  CHECK(grid.kind == TargetKind::TagGrid);
  CHECK(grid.gap == 0.01);
  CHECK(grid.first_id == 2);
  const Target charuco = parse_target("charuco:aruco_6x6_250:7x5:0.036195:0.018256");
  CHECK(charuco.kind == TargetKind::Charuco);
  CHECK(charuco.marker == 0.018256);
  CHECK(parse_target("charuco_legacy:aruco_6x6_250:8x5:0.03:0.02").legacy);
}

TEST_CASE("a wrong short form is refused and the right ones are shown") {
  const char* text =
      GENERATE("", "chess:6x9:0.02", "chessboard:6:0.02", "chessboard:6x9", "chessboard:6x9:0.02:1",
               "chessboard:6x9:-0.02", "chessboard:6x9:nan", "tag:36h12:0:0.05", "tag:36h11:587:0.05",
               "tag:36h11:-1:0.05", "grid:36h11:5x7:0.03:-1", "grid:16h5:9x9:0.03:0.01", "chessboard:1x9:0.02",
               "charuco:aruco_6x6_250:7x5:0.02:0.02", "tag:36h11:zero:0.05", "chessboard:99999999999x2:1");
  CAPTURE(text);
  CHECK_THROWS_AS(parse_target(text), InvalidArgument);
  CHECK_THROWS_WITH(parse_target("chess:6x9:0.02"), Catch::Contains("chessboard:6x9:0.0236"));
}

TEST_CASE("points follow the documented frames and numbers") {
  const TargetPoints chess = target_points(parse_target("chessboard:2x3:0.1"));
  CHECK(chess.ids == std::vector<int>{0, 1, 2, 3, 4, 5});
  CHECK(chess.points.col(5).isApprox(Eigen::Vector3d(0.2, 0.1, 0)));
  const TargetPoints tag = target_points(parse_target("tag:36h11:10:0.05"));
  CHECK(tag.ids == std::vector<int>{40, 41, 42, 43});
  CHECK(tag.points.col(0).isApprox(Eigen::Vector3d(-0.025, -0.025, 0)));
  CHECK(tag.points.col(2).isApprox(Eigen::Vector3d(0.025, 0.025, 0)));
  const TargetPoints grid = target_points(parse_target("grid:36h11:2x3:0.03:0.01"));
  CHECK(grid.points.col(0).norm() < 1e-15);
  CHECK(grid.points.col(4 * 5 + 2).isApprox(Eigen::Vector3d(0.11, 0.07, 0)));
  const TargetPoints charuco = target_points(parse_target("charuco:aruco_6x6_250:7x5:0.04:0.02"));
  CHECK(charuco.ids.size() == 24);
  CHECK(charuco.points.col(0).isApprox(Eigen::Vector3d(0.04, 0.04, 0)));
}

TEST_CASE("markers of a ChArUco board lie in the white squares") {
  Target board = parse_target("charuco:aruco_6x6_250:7x5:0.04:0.02");
  CHECK(target_markers(board).size() == 17);
  CHECK(target_markers(board)[0].T_target_marker.translation().isApprox(Eigen::Vector3d(0.06, 0.02, 0)));
  board.rows = 8;
  CHECK(target_markers(board)[0].T_target_marker.translation().isApprox(Eigen::Vector3d(0.06, 0.02, 0)));
  board.legacy = true;
  CHECK(target_markers(board)[0].T_target_marker.translation().isApprox(Eigen::Vector3d(0.02, 0.02, 0)));
}

TEST_CASE("a marker map with two equal ids, a mirrored pose or no marker is refused") {
  Target map;
  map.kind = TargetKind::MarkerMap;
  CHECK_THROWS_AS(map.validate(), InvalidArgument);
  map.map = {{3, 0.05, Pose::Identity()}, {3, 0.05, Pose::Identity()}};
  CHECK_THROWS_WITH(map.validate(), Catch::Contains("target.map[1].id: found 3, expected an id that occurs only once"));
  map.map = {{3, 0.05, Pose::Identity()}};
  CHECK_NOTHROW(map.validate());
  map.map[0].T_target_marker.linear()(2, 2) = -1;
  CHECK_THROWS_AS(map.validate(), InvalidArgument);
}

TEST_CASE("everything that is wrong with a target is told at once") {
  Target board = parse_target("grid:36h11:5x7:0.03:0.01");
  CHECK(board.problems().empty());
  board.rows = 0, board.gap = -1;
  REQUIRE(board.problems().size() == 2);
  CHECK(board.problems()[0].field == "rows");
  CHECK(board.problems()[0].found == "0");
  CHECK(board.problems()[1].field == "gap");
  board = parse_target("grid:36h11:5x7:0.03:0.01");
  board.family = "36h12";
  REQUIRE(board.problems().size() == 1);
  CHECK(board.problems()[0].field == "family");
  board.family = "25h9", board.first_id = 1;
  REQUIRE(board.problems().size() == 1);
  CHECK(board.problems()[0].expected == "ids of family 25h9, 0 to 34, for 35 markers");
}

}  // namespace target_test
