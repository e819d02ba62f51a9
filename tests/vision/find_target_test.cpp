#include <algorithm>
#include <filesystem>
#include <fstream>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/vision/find_target.hpp>
#include <kr5/vision/render.hpp>

#include "support/reference.hpp"

namespace find_target_test {

using namespace kr5;
using namespace kr5::vision;
namespace fs = std::filesystem;

namespace {

Pinhole camera(int width, int height, double f, double k1 = 0.0) {
  Pinhole c{.width = width, .height = height, .fx = f, .fy = f, .cx = (width - 1) / 2.0, .cy = (height - 1) / 2.0};
  c.k1 = k1;
  return c;
}

/// The target in the middle of the image at `distance`, tilted about an axis in its plane and rolled.
PlacedTarget placed(const Target& target, double distance, double tilt, double azimuth, double roll) {
  PlacedTarget p{target, Pose::Identity()};
  p.T_camera_target.linear() = exp_rotation(tilt * Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), 0)) *
                               exp_rotation(roll * Eigen::Vector3d::UnitZ());
  const Eigen::Matrix2d area = printed_area(target);
  const Eigen::Vector2d middle = area.rowwise().mean();
  p.T_camera_target.translation() =
      Eigen::Vector3d(0, 0, distance) - p.T_camera_target.linear() * Eigen::Vector3d(middle.x(), middle.y(), 0);
  return p;
}

/// Largest distance of a seen point from the truth with the same number [px]; infinite when a number is not there.
double worst_error(const View& seen, const View& truth) {
  double worst = 0;
  for (std::size_t i = 0; i < seen.ids.size(); ++i) {
    const auto it = std::find(truth.ids.begin(), truth.ids.end(), seen.ids[i]);
    if (it == truth.ids.end()) return 1e9;
    worst = std::max(worst,
                     (seen.pixels.col(static_cast<Eigen::Index>(i)) - truth.pixels.col(it - truth.ids.begin())).norm());
  }
  return worst;
}

/// Images of a folder of the reference data.
std::vector<fs::path> images(const fs::path& folder, const std::string& prefix = "") {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string ending = entry.path().extension();
    if ((ending == ".png" || ending == ".jpg") && entry.path().filename().string().starts_with(prefix))
      files.push_back(entry.path());
  }
  return files;
}

int found_in(const std::vector<fs::path>& files, const std::string& target, std::size_t points) {
  int found = 0;
  for (const fs::path& file : files) {
    const Detection seen = find_target(load_image(file), parse_target(target));
    if (!seen.found()) UNSCOPED_INFO(file.filename() << ": " << seen.message);
    found += seen.found() && seen.view.ids.size() >= points;
  }
  return found;
}

}  // namespace

TEST_CASE("every kind of target is found where it was rendered") {
  const std::string form = GENERATE(
      "chessboard:6x9:0.02", "chessboard:5x5:0.02", "tag:36h11:10:0.05", "tag:25h9:3:0.05", "tag:16h5:7:0.05",
      "tag:41h12:100:0.05", "tag:aruco_5x5_100:9:0.05", "grid:36h11:3x4:0.03:0.01", "grid:aruco_4x4_50:3x4:0.03:0.01",
      "charuco:aruco_6x6_250:7x5:0.036:0.018", "circles:7x9:0.02", "circles:8x8:0.02");
  CAPTURE(form);
  const Target target = parse_target(form);
  const Pinhole lens = camera(800, 600, 800, -0.1);
  RenderOptions look{.blur = 0.7, .noise = 2.0};
  look.big_dot = form == "circles:8x8:0.02" ? 0 : -1;
  const double extent = (printed_area(target).col(1) - printed_area(target).col(0)).maxCoeff();
  // A grid with a bigger dot is recognised upside down, too.
  const PlacedTarget p = placed(target, 2.2 * extent, 0.5, 0.8, look.big_dot == 0 ? 2.9 : 0.2);
  const Detection seen = find_target(render(std::span(&p, 1), lens, look), target);
  INFO(seen.message);
  REQUIRE(seen.found());
  const View truth = visible_points(target, p.T_camera_target, lens);
  CHECK(seen.view.ids.size() == truth.ids.size());
  CHECK(worst_error(seen.view, truth) < 0.1);
  CHECK(seen.sigma.minCoeff() > 0);
}

TEST_CASE("the stated uncertainty of tag corners covers their error, below the error of the detector's own corners") {
  Random random(11);
  const Pinhole lens = camera(240, 200, 400);
  double own = 0, detector = 0, normalised = 0;
  int count = 0;
  for (int trial = 0; trial < 24; ++trial) {
    Target target = parse_target("tag:36h11:0:0.1");
    target.first_id = random.integer(587);
    const double side = random.uniform(40, 100);
    const PlacedTarget p =
        placed(target, 0.1 * 400 / side, random.uniform(0, 0.8), random.uniform(0, 6.28), random.uniform(0, 6.28));
    RenderOptions look{
        .blur = random.uniform(0.5, 2.0) * std::min(1.0, side / 60), .noise = random.uniform(0, 8), .seed = trial};
    const Image image = render(std::span(&p, 1), lens, look);
    const View truth = visible_points(target, p.T_camera_target, lens);
    TagOptions plain;
    plain.refine = Refinement::None;
    const auto ours = find_tags(image), theirs = find_tags(image, plain);
    if (ours.size() != 1 || theirs.size() != 1 || !ours[0].refined) continue;
    for (int k = 0; k < 4; ++k) {
      const double e2 = (ours[0].corners.col(k) - truth.pixels.col(k)).squaredNorm();
      own += e2;
      detector += (theirs[0].corners.col(k) - truth.pixels.col(k)).squaredNorm();
      normalised += e2 / 2 / (ours[0].sigma[k] * ours[0].sigma[k]);
      ++count;
    }
  }
  REQUIRE(count >= 80);
  CHECK(std::sqrt(own) < 0.5 * std::sqrt(detector));
  // Mean of squares over their stated variance: 1 when the uncertainty is right; corners of one tag are correlated.
  CHECK(normalised / count > 0.6);
  CHECK(normalised / count < 1.6);
}

TEST_CASE("equal ids in one image are both kept") {
  const Target target = parse_target("tag:36h11:5:0.05");
  PlacedTarget pair[2] = {placed(target, 0.5, 0, 0, 0), placed(target, 0.6, 0, 0, 0)};
  pair[0].T_camera_target.translation().x() = -0.06;
  pair[1].T_camera_target.translation().x() = 0.06;
  const auto tags = find_tags(render(pair, camera(640, 480, 600)));
  REQUIRE(tags.size() == 2);
  CHECK(tags[0].id == 5);
  CHECK(tags[1].id == 5);
  const Detection seen = find_target(render(pair, camera(640, 480, 600)), target);
  CHECK(seen.view.ids.size() == 4);
  CHECK_THAT(seen.message, Catch::Contains("same ids"));
}

TEST_CASE("a board seen in part says which points") {
  const Target target = parse_target("grid:36h11:4x5:0.03:0.01");
  PlacedTarget p = placed(target, 0.35, 0.1, 0, 0);
  p.T_camera_target.translation().x() += 0.12;
  const Pinhole lens = camera(640, 480, 700);
  const Detection seen = find_target(render(std::span(&p, 1), lens), target);
  REQUIRE(seen.found());
  CHECK(seen.view.ids.size() < 80);
  CHECK(worst_error(seen.view, visible_points(target, p.T_camera_target, lens)) < 0.1);
}

TEST_CASE("a grid of tags whose rows and columns are exchanged, or of another width, is refused by name") {
  const Target target = parse_target("grid:36h11:4x6:0.02:0.006");
  const Pinhole lens = camera(800, 600, 900, -0.15);
  const PlacedTarget p = placed(target, 0.3, 0.5, 0.7, 0.2);
  const Image image = render(std::span(&p, 1), lens);
  REQUIRE(find_target(image, target).found());
  for (const char* stated : {"grid:36h11:6x4:0.02:0.006", "grid:36h11:3x8:0.02:0.006"}) {
    const Detection seen = find_target(image, parse_target(stated));
    CAPTURE(stated, seen.message);
    CHECK(seen.status == DetectStatus::WrongSize);
    CHECK_THAT(seen.message, Catch::Contains("a grid of 4x6"));
  }
}

TEST_CASE("what is wrong is said when nothing is found") {
  const Target tag = parse_target("tag:36h11:5:0.05"), chess = parse_target("chessboard:6x9:0.02");
  const Pinhole lens = camera(640, 480, 600);
  const PlacedTarget p = placed(tag, 0.3, 0.2, 0.3, 0.1), board = placed(chess, 0.5, 0.2, 0.3, 0.1);
  Image image = render(std::span(&p, 1), lens);
  for (int y = 0; y < image.height; ++y)
    std::reverse(image.pixels.begin() + y * image.width, image.pixels.begin() + (y + 1) * image.width);
  CHECK(find_target(image, tag).status == DetectStatus::Mirrored);
  const Image upright = render(std::span(&p, 1), lens);
  CHECK(find_target(upright, parse_target("tag:36h11:6:0.05")).status == DetectStatus::WrongMarker);
  const Detection family = find_target(upright, parse_target("tag:25h9:5:0.05"));
  CHECK(family.status == DetectStatus::WrongFamily);
  CHECK_THAT(family.message, Catch::Contains("36h11"));
  const Detection size = find_target(render(std::span(&board, 1), lens), parse_target("chessboard:5x7:0.02"));
  CHECK(size.status == DetectStatus::WrongSize);
  CHECK_THAT(size.message, Catch::Contains("6x9") || Catch::Contains("9x6"));
  CHECK(find_target(Image(640, 480, 4), chess).status == DetectStatus::TooDark);
  CHECK(find_target(Image(640, 480, 255), chess).status == DetectStatus::Overexposed);
  RenderOptions soft{.blur = 12};
  CHECK(find_target(render(std::span(&p, 1), lens, soft), tag).status == DetectStatus::Blurred);
  CHECK_FALSE(find_target(Image(8, 8, 100), tag).found());
}

TEST_CASE("a chessboard is not found inside a larger one") {
  const Pinhole lens = camera(800, 600, 700, -0.15);
  const PlacedTarget board = placed(parse_target("chessboard:6x9:0.02"), 0.3, 0.5, 0.8, 0.3);
  const Image image = render(std::span(&board, 1), lens, {.blur = 0.8, .noise = 3});
  for (const char* wanted : {"chessboard:4x4:0.02", "chessboard:6x8:0.02"}) {
    const Detection seen = find_target(image, parse_target(wanted));
    CAPTURE(wanted, seen.message);
    CHECK(seen.status == DetectStatus::WrongSize);
    CHECK_THAT(seen.message, Catch::Contains("of 6x9") || Catch::Contains("of 9x6"));
  }
}

TEST_CASE("two chessboards side by side are no larger one") {
  const Target target = parse_target("chessboard:4x4:0.02");
  PlacedTarget pair[2] = {placed(target, 0.4, 0.2, 0, 0), placed(target, 0.4, 0.2, 0, 0)};
  pair[0].T_camera_target.translation().x() -= 0.075;
  pair[1].T_camera_target.translation().x() += 0.075;
  CHECK(find_target(render(pair, camera(800, 600, 700)), target).found());
}

TEST_CASE("legacy ChArUco boards with an even number of rows are found, each by its own name only") {
  const Pinhole lens = camera(800, 600, 800);
  for (const char* form : {"charuco_legacy:aruco_6x6_250:4x6:0.036:0.022", "charuco:aruco_6x6_250:4x6:0.036:0.022"}) {
    const Target target = parse_target(form);
    const PlacedTarget p = placed(target, 0.4, 0.4, 0.8, 0.3);
    const Image image = render(std::span(&p, 1), lens, {.blur = 0.7, .noise = 2});
    const Detection seen = find_target(image, target);
    CAPTURE(form, seen.message);
    REQUIRE(seen.found());
    CHECK(seen.view.ids.size() == 15);
    CHECK(worst_error(seen.view, visible_points(target, p.T_camera_target, lens)) < 0.1);
    Target other = target;
    other.legacy = !target.legacy;
    const Detection wrong = find_target(image, other);
    CHECK_FALSE(wrong.found());
    CHECK_THAT(wrong.message, Catch::Contains("charuco_legacy"));
  }
}

TEST_CASE("tags lie where they were rendered, however the image is shrunk for the search") {
  const Target target = parse_target("tag:36h11:10:0.05");
  const Pinhole lens = camera(640, 480, 700);
  const PlacedTarget p = placed(target, 0.25, 0.4, 0.8, 0.3);
  const View truth = visible_points(target, p.T_camera_target, lens);
  const Image image = render(std::span(&p, 1), lens, {.blur = 0.7, .noise = 2});
  for (const double decimate : {1.0, 1.5, 2.0, 2.5, 3.0, 3.7})
    for (const Refinement refine : {Refinement::Model, Refinement::None}) {
      TagOptions options;
      options.decimate = decimate, options.refine = refine;
      const auto tags = find_tags(image, options);
      CAPTURE(decimate, int(refine));
      REQUIRE(tags.size() == 1);
      CHECK((tags[0].corners - truth.pixels).colwise().norm().maxCoeff() < (refine == Refinement::Model ? 0.1 : 1.5));
    }
}

TEST_CASE("in a large image a small tag is found alone, and beside large ones when asked for") {
  const Target small = parse_target("tag:36h11:3:0.008"), large = parse_target("tag:36h11:5:0.05");
  PlacedTarget both[2] = {placed(small, 0.5, 0.1, 0, 0.2), placed(large, 0.5, 0.2, 0, 0)};
  both[0].T_camera_target.translation().x() = -0.1;
  both[1].T_camera_target.translation().x() = 0.06;
  const Pinhole lens = camera(2200, 1500, 2000);  // 32 and 200 px a side, in 3.3 Mpx
  const auto ids = [](const std::vector<TagDetection>& tags) {
    std::vector<int> out;
    for (const TagDetection& tag : tags) out.push_back(tag.id);
    return out;
  };
  CHECK(ids(find_tags(render(std::span(both, 1), lens))) == std::vector<int>{3});
  const Image image = render(both, lens);
  CHECK(ids(find_tags(image, {.decimate = 2})) == std::vector<int>{3, 5});
  CHECK(find_target(image, small).found());  // not seen at first, the finer search finds it
}

TEST_CASE("bad options and empty images are refused") {
  CHECK_THROWS_AS(find_tags(ImageView{}), InvalidArgument);
  TagOptions options;
  options.families = {"36h12"};
  CHECK_THROWS_WITH(find_tags(Image(9, 9), options), Catch::Contains("36h11"));
  options = {};
  options.decimate = 0.1;
  CHECK_THROWS_WITH(find_tags(Image(9, 9), options), Catch::Contains("decimate"));
  CHECK_THROWS_AS(find_target(Image(9, 9), Target{}), InvalidArgument);
}

TEST_CASE("all 47 tags of the AprilTag reference images are found with default options, and no other") {
  int expected = 0, hit = 0, other = 0;
  for (const fs::path& file : images(test::reference("data/tags_apriltag"))) {
    std::vector<std::pair<int, Eigen::Vector2d>> truth;
    std::ifstream list(fs::path(file).replace_extension(".txt"));
    for (std::string line; std::getline(list, line);) {
      int id = 0;
      double c[8];
      if (std::sscanf(line.c_str(), "%d, (%lf %lf), (%lf %lf), (%lf %lf), (%lf %lf)", &id, c, c + 1, c + 2, c + 3,
                      c + 4, c + 5, c + 6, c + 7) == 9)
        truth.emplace_back(id, Eigen::Vector2d(c[0] + c[2] + c[4] + c[6], c[1] + c[3] + c[5] + c[7]) / 4);
    }
    expected += static_cast<int>(truth.size());
    for (const TagDetection& tag : find_tags(load_image(file))) {
      const auto it = std::find_if(truth.begin(), truth.end(), [&](const auto& t) {
        return t.first == tag.id && (tag.corners.rowwise().mean() - t.second).norm() < 4;
      });
      if (it == truth.end()) {
        ++other;
      } else {
        ++hit;
        truth.erase(it);
      }
    }
  }
  CHECK(expected == 47);
  CHECK(hit == expected);
  CHECK(other == 0);
}

TEST_CASE("targets are found in every real image that shows them") {
  const fs::path industrial = test::reference("data/handeye_industrial_calibration");
  const auto dots = images(industrial / "test_set_10x10/images");
  CHECK(found_in(dots, "circles:10x10:0.0254", 100) == static_cast<int>(dots.size()));
  const auto charuco = images(industrial / "test_set_charuco/images");
  CHECK(found_in(charuco, "charuco:aruco_6x6_250:7x5:0.036195:0.018256", 6) >= static_cast<int>(charuco.size()) - 1);
  const auto tags = images(test::reference("data/handeye_visp_franka") / "eye-to-hand");
  CHECK(found_in(tags, "tag:36h11:10:0.048", 4) == static_cast<int>(tags.size()));
  const auto boards = images(test::reference("data/handeye_visp_franka") / "eye-in-hand");
  CHECK(found_in(boards, "chessboard:6x9:0.0236", 54) == static_cast<int>(boards.size()));
  const auto circles = images(test::reference("data/camera_visp"));
  CHECK(found_in(circles, "circles:6x6:0.034", 36) == static_cast<int>(circles.size()));
  const auto stereo = images(test::reference("data/camera_opencv_stereo"));
  CHECK(found_in(stereo, "chessboard:6x9:0.025", 54) == static_cast<int>(stereo.size()));
}

namespace {

/// Dots of rows that are shifted against each other by `shift` of a step, seen through H (board to pixels).
Image shifted_dots(int rows, int cols, double shift, const Eigen::Matrix3d& H, std::uint8_t dot, std::uint8_t paper) {
  Image image(900, 700, paper);
  const Eigen::Matrix3d back = H.inverse();
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const Eigen::Vector2d p = (back * Eigen::Vector3d(x, y, 1)).hnormalized();
      const double row = std::round(p.y());
      if (row < 0 || row >= rows) continue;
      const double beside = shift * (static_cast<int>(row) % 2), column = std::round(p.x() - beside);
      if (column < 0 || column >= cols) continue;
      const double off = (p - Eigen::Vector2d(column + beside, row)).norm();
      const double cover = std::clamp((0.24 - off) * 40 + 0.5, 0.0, 1.0);
      image.at(x, y) = static_cast<std::uint8_t>(std::lround(paper + cover * (dot - paper)));
    }
  return image;
}

}  // namespace

TEST_CASE("dots of which every other row is shifted are no grid of straight rows") {
  Eigen::Matrix3d H;
  H << 55, 4, 160, 2, 50, 120, 2e-3, 1e-2, 1;
  for (const auto& [dot, paper] : {std::pair{20, 235}, {235, 20}}) {
    CAPTURE(dot);
    const auto ink = static_cast<std::uint8_t>(dot), sheet = static_cast<std::uint8_t>(paper);
    CHECK(find_target(shifted_dots(9, 7, 0.0, H, ink, sheet), parse_target("circles:9x7:0.02")).found());
    for (const char* form : {"circles:9x7:0.02", "circles:7x9:0.02"}) {
      const Detection seen = find_target(shifted_dots(9, 7, 0.5, H, ink, sheet), parse_target(form));
      CHECK(seen.status == DetectStatus::WrongSize);
      CHECK_THAT(seen.message, Catch::Contains("asymmetric grid"));
    }
  }
}

TEST_CASE("markers that are mirrored, inverted or of another family are told") {
  const Target tag = parse_target("tag:tag36h11:7:0.08");
  CHECK(tag.family == "36h11");
  const PlacedTarget p = placed(tag, 0.5, 0.2, 1, 0.1);
  const Image good = render(std::span(&p, 1), camera(640, 480, 600));
  Image mirrored = good, inverted = good;
  for (int y = 0; y < good.height; ++y)
    std::reverse(mirrored.pixels.begin() + y * good.width, mirrored.pixels.begin() + (y + 1) * good.width);
  for (std::uint8_t& grey : inverted.pixels) grey = static_cast<std::uint8_t>(255 - grey);
  const TagOptions wanted{.families = {"DICT_APRILTAG_36h11"}};
  REQUIRE(find_tags(good, wanted).size() == 1);
  CHECK(find_tags(good, wanted)[0].family == "36h11");
  CHECK(explain_no_tags(mirrored, wanted).status == DetectStatus::Mirrored);
  CHECK(explain_no_tags(inverted, wanted).status == DetectStatus::Inverted);
  CHECK(find_target(inverted, tag).status == DetectStatus::Inverted);
  const Detection other = explain_no_tags(good, {.families = {"tagStandard41h12", "25h9"}});
  CHECK(other.status == DetectStatus::WrongFamily);
  CHECK_THAT(other.message, Catch::Contains("but of 36h11: ids 7"));
  CHECK(explain_no_tags(Image(640, 480, 10), wanted).status == DetectStatus::TooDark);
}

}  // namespace find_target_test
