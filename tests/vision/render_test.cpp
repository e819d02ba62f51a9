#include <catch2/catch.hpp>

#include <cmath>
#include <numbers>

#include <Eigen/LU>

#include <kr5/core/error.hpp>
#include <kr5/vision/family.hpp>
#include <kr5/vision/render.hpp>

namespace render_test {

using namespace kr5;
using namespace kr5::vision;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

Pinhole wide_camera() {
  Pinhole c{.width = 800, .height = 600, .fx = 700, .fy = 705, .cx = 395, .cy = 305};
  c.k1 = -0.21, c.k2 = 0.06, c.p1 = 4e-4, c.p2 = -3e-4, c.k3 = 0.01, c.k4 = 0.02, c.k5 = -0.01, c.k6 = 0.003;
  return c;
}

Pinhole plain_camera(int width = 640, int height = 480, double focal = 600) {
  return {
      .width = width, .height = height, .fx = focal, .fy = focal, .cx = (width - 1) / 2.0, .cy = (height - 1) / 2.0};
}

Pose tilted(double x, double y, double z) { return from_xyzrpy((Vector6() << x, y, z, 0.35, -0.3, 0.2).finished()); }
Pose square_on(double x, double y, double z) { return from_xyzrpy((Vector6() << x, y, z, 0, 0, 0).finished()); }

Image picture(const Target& target, const Pose& T, const Pinhole& c, const RenderOptions& o = {}) {
  const PlacedTarget placed{target, T};
  return render(std::span(&placed, 1), c, o);
}

/// Part of a window that is black, and its centre of mass: what a dot's picture must agree with.
Vector3d dark_moment(ImageView image, const Vector2d& near, int half, const RenderOptions& o) {
  Vector3d moment = Vector3d::Zero();
  const int u = static_cast<int>(std::lround(near.x())), v = static_cast<int>(std::lround(near.y()));
  for (int y = v - half; y <= v + half; ++y)
    for (int x = u - half; x <= u + half; ++x) {
      const double dark = (o.white - image.at(x, y)) / (o.white - o.black);
      moment += dark * Vector3d(x, y, 1);
    }
  return {moment.x() / moment.z(), moment.y() / moment.z(), moment.z()};
}

/// The same for the projected outline of a disc, by Green's theorem.
Vector3d disc_moment(const Pinhole& c, const Pose& T, const Vector3d& centre, double radius) {
  Vector3d m = Vector3d::Zero();
  const int n = 720;
  std::vector<Vector2d> outline;
  for (int k = 0; k < n; ++k) {
    const double a = 2 * std::numbers::pi * k / n;
    outline.push_back(c.project(T * Vector3d(centre + radius * Vector3d(std::cos(a), std::sin(a), 0))));
  }
  for (int k = 0; k < n; ++k) {
    const Vector2d p = outline[k], q = outline[(k + 1) % n];
    const double cross = p.x() * q.y() - p.y() * q.x();
    m += Vector3d((p.x() + q.x()) * cross / 6, (p.y() + q.y()) * cross / 6, cross / 2);
  }
  return {m.x() / m.z(), m.y() / m.z(), m.z()};
}

/// Point whose offset to every pixel around is square to the gradient there (Förstner): the crossing of the edges.
Vector2d refine_corner(ImageView image, Vector2d p) {
  for (int iteration = 0; iteration < 20; ++iteration) {
    Eigen::Matrix2d A = Eigen::Matrix2d::Zero();
    Vector2d b = Vector2d::Zero();
    const int u = static_cast<int>(std::lround(p.x())), v = static_cast<int>(std::lround(p.y()));
    for (int y = v - 9; y <= v + 9; ++y)
      for (int x = u - 9; x <= u + 9; ++x) {
        const Vector2d g((image.at(x + 1, y) - image.at(x - 1, y)) / 2.0,
                         (image.at(x, y + 1) - image.at(x, y - 1)) / 2.0);
        const double weight = std::exp(-(Vector2d(x, y) - p).squaredNorm() / 30);
        A += weight * g * g.transpose();
        b += weight * g * g.dot(Vector2d(x, y));
      }
    p = A.inverse() * b;
  }
  return p;
}

}  // namespace

TEST_CASE("dots have the place and the area of their projection, through a rational lens") {
  const Target grid = parse_target("circles:6x8:0.03");
  const Pinhole c = wide_camera();
  const Pose T = tilted(-0.1, -0.08, 0.45);
  const RenderOptions o;
  const Image image = picture(grid, T, c, o);
  const View truth = visible_points(grid, T, c);
  REQUIRE(truth.ids.size() == 48);
  for (int k = 0; k < 48; ++k) {
    const Vector3d seen = dark_moment(image, truth.pixels.col(k), 19, o);
    const Vector3d expected = disc_moment(c, T, truth.points.col(k), 0.0075);
    CHECK((seen - expected).head<2>().norm() < 0.01);
    CHECK(seen.z() == Approx(expected.z()).epsilon(0.003));
  }
}

TEST_CASE("an edge along the rows of the image lies where it should at every fraction of a pixel") {
  const Target board = parse_target("chessboard:3x3:0.1");
  const Pinhole c = plain_camera();
  RenderOptions o;
  for (int step = 0; step < 37; ++step) {
    const double shift = 1e-3 * step / 37.0;
    const Image image = picture(board, square_on(shift, -0.1, 1.0), c, o);
    double bright = 0;  // row 270: black from -0.1 m to 0, then white to 0.1 m
    for (int x = 300; x <= 340; ++x) bright += (image.view().at(x, 269) - o.black) / (o.white - o.black);
    const double edge = 340.5 - bright, expected = c.project({shift, 0, 1}).x();
    CHECK(std::abs(edge - expected) < 0.01);
  }
}

TEST_CASE("corners of a slanted chessboard are found where the truth says") {
  const Target board = parse_target("chessboard:5x7:0.03");
  const Pinhole c = wide_camera();
  const Pose T = tilted(-0.1, -0.08, 0.4);
  RenderOptions o;
  o.blur = 2.0;  // wide enough that sampling the gradient at whole pixels does no harm
  const Image image = picture(board, T, c, o);
  const View truth = visible_points(board, T, c);
  REQUIRE(truth.ids.size() == 35);
  double sum = 0;
  for (int k = 0; k < 35; ++k)
    sum += (refine_corner(image, truth.pixels.col(k) + Vector2d(0.7, -0.6)) - truth.pixels.col(k)).squaredNorm();
  CHECK(std::sqrt(sum / 35) < 0.02);
}

TEST_CASE("moving the target by whole pixels moves the image and nothing else") {
  const Target board = parse_target("grid:36h11:2x3:0.08:0.02");
  const Pinhole c = plain_camera();
  const Image a = picture(board, square_on(-0.1, -0.1, 1.0), c);
  const Image b = picture(board, square_on(-0.1 + 7.0 / 600, -0.1 + 4.0 / 600, 1.0), c);
  int different = 0;
  for (int y = 50; y < 400; ++y)
    for (int x = 50; x < 550; ++x) different += std::abs(a.view().at(x, y) - b.view().at(x + 7, y + 4)) > 1;
  CHECK(different == 0);
}

TEST_CASE("every cell of a marker is printed, of each family and on each kind of board") {
  const auto text =
      GENERATE("tag:36h11:10:0.2", "tag:25h9:3:0.2", "tag:16h5:7:0.2", "tag:41h12:100:0.2", "tag:aruco_4x4_50:3:0.2",
               "tag:aruco_7x7_1000:999:0.2", "grid:25h9:2x2:0.1:0.03:5", "grid:aruco_5x5_100:2x3:0.08:0",
               "charuco:aruco_6x6_250:4x5:0.06:0.045", "charuco_legacy:aruco_6x6_250:4x5:0.06:0.045");
  CAPTURE(text);
  const Target target = parse_target(text);
  const Pinhole c = plain_camera(800, 800, 700);
  const Pose T = tilted(target.kind == TargetKind::Tag ? 0 : -0.1, target.kind == TargetKind::Tag ? 0 : -0.1, 0.5);
  const Image image = picture(target, T, c);
  int wrong = 0;
  for (const MapMarker& m : target_markers(target)) {
    const MarkerPattern p = marker_pattern(target.family, m.id);
    for (int i = 0; i < p.cells; ++i)
      for (int j = 0; j < p.cells; ++j) {
        if (target.gap == 0 && target.kind == TargetKind::TagGrid && (i * j == 0)) continue;
        const Vector3d at = m.size / p.square * Vector3d(j + 0.5 - p.cells / 2.0, i + 0.5 - p.cells / 2.0, 0);
        const Vector2d pixel = c.project(T * m.T_target_marker * at);
        const int grey =
            image.view().at(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y())));
        wrong += grey != (p.at(i, j) ? 220 : 30);
      }
  }
  CHECK(wrong == 0);
}

TEST_CASE("the first square of a ChArUco board is black, of a legacy one with even rows white") {
  const Pinhole c = plain_camera();
  const auto first = [&](const char* text) {
    const Image image = picture(parse_target(text), square_on(0, 0, 1), c);
    const Vector2d middle = c.project({0.007, 0.007, 1});
    return static_cast<int>(image.view().at(static_cast<int>(middle.x()), static_cast<int>(middle.y())));
  };
  CHECK(first("charuco:aruco_4x4_50:4x5:0.1:0.07") == 30);
  CHECK(first("charuco_legacy:aruco_4x4_50:4x5:0.1:0.07") == 220);
  CHECK(first("charuco_legacy:aruco_4x4_50:5x4:0.1:0.07") == 30);
}

TEST_CASE("a nearer target hides a farther one, and the back of a marker is plain paper") {
  Target map;
  map.kind = TargetKind::MarkerMap;
  map.map = {{0, 0.2, square_on(0, 0, 1.0)}, {1, 0.2, square_on(0, 0, 0.8)}};
  Target front = map;
  front.map.erase(front.map.begin());
  const Pinhole c = plain_camera();
  const Image both = picture(map, Pose::Identity(), c), one = picture(front, Pose::Identity(), c);
  CHECK(both.pixels == one.pixels);

  Pose turned = square_on(0, 0, 0.8);
  turned.linear() = exp_rotation({std::numbers::pi, 0, 0});
  const Image back = picture(parse_target("tag:36h11:0:0.2"), turned, c);
  CHECK(back.view().at(320, 240) == 220);
  CHECK(*std::min_element(back.pixels.begin(), back.pixels.end()) == 110);
  CHECK(visible_points(parse_target("tag:36h11:0:0.2"), turned, c).ids.empty());
}

TEST_CASE("the truth leaves out what lies outside the image or behind the camera") {
  const Target board = parse_target("chessboard:2x9:0.1");
  const Pinhole c = plain_camera();
  const View part = visible_points(board, square_on(0, 0, 1), c);
  CHECK(part.ids == std::vector<int>{0, 1, 2, 3, 4, 5, 9, 10, 11, 12, 13, 14});
  CHECK((c.project(Vector3d(part.points.col(7)) + Vector3d(0, 0, 1)) - part.pixels.col(7)).norm() == 0);
  CHECK(visible_points(board, square_on(0, 0, -1), c).ids.empty());
}

TEST_CASE("noise has the asked spread and the same seed gives the same image") {
  const Pinhole c = plain_camera();
  RenderOptions o;
  o.noise = 3.0;
  const Image a = render({}, c, o), same = render({}, c, o);
  CHECK(a.pixels == same.pixels);
  double sum = 0;
  for (const auto p : a.pixels) sum += (p - o.background) * (p - o.background);
  const double n = static_cast<double>(a.pixels.size());
  CHECK(std::sqrt(sum / n) == Approx(std::sqrt(9.0 + 1.0 / 12)).epsilon(5 / std::sqrt(2 * n)));  // rounding adds 1/12
  o.seed = 2;
  CHECK(a.pixels != render({}, c, o).pixels);
}

TEST_CASE("blur spreads an edge by its sigma, and light falls off as asked") {
  const Pinhole c = plain_camera();
  RenderOptions o;
  o.blur = 2.0;
  const Image image = picture(parse_target("chessboard:3x3:0.1"), square_on(0, -0.1, 1.0), c, o);
  double moment = 0;
  for (int x = 300; x <= 338; ++x) {
    const double slope = (image.view().at(x + 1, 269) - image.view().at(x, 269)) / (o.white - o.black);
    moment += slope * (x + 0.5 - 319.5) * (x + 0.5 - 319.5);
  }
  CHECK(std::sqrt(moment) == Approx(std::sqrt(4.0 + 1.0 / 12)).epsilon(0.02));  // the pixel's own width adds 1/12

  RenderOptions light;
  light.gradient_x = 0.5, light.vignetting = 0.4, light.background = 100;
  const Image shaded = render({}, c, light);
  CHECK(shaded.view().at(639, 240) == Approx(150 * 0.8).margin(1));
  CHECK(shaded.view().at(0, 240) == Approx(50 * 0.8).margin(1));
  CHECK(shaded.view().at(320, 0) == Approx(100 * 0.8).margin(1));
}

TEST_CASE("a target is drawn to scale") {
  const double dpm = 300 / 0.0254;
  const Image image = draw_target(parse_target("tag:36h11:0:0.0508"), dpm);
  CHECK(image.width == 1200);  // 2 inches and half of it on either side
  CHECK(image.height == 1200);
  int black = 0;
  for (int x = 0; x < 1200; ++x) black += image.view().at(x, 305) == 0;
  CHECK(black == 600);
  CHECK_THROWS_AS(draw_target(parse_target("tag:36h11:0:0.0508"), -1), InvalidArgument);
}

TEST_CASE("bad options and targets are refused by name") {
  const Pinhole c = plain_camera();
  RenderOptions o;
  o.blur = -1;
  CHECK_THROWS_WITH(render({}, c, o), Catch::Contains("blur"));
  CHECK_THROWS_WITH(render({}, Pinhole{}, {}), Catch::Contains("width"));
  Target tag = parse_target("tag:16h5:0:0.1");
  tag.first_id = 30;
  CHECK_THROWS_WITH(picture(tag, square_on(0, 0, 1), c), Catch::Contains("30") && Catch::Contains("16h5"));
  tag.kind = TargetKind::MarkerMap;
  tag.map = {{0, 0.1, Pose::Identity()}};
  CHECK_THROWS_AS(printed_area(tag), InvalidArgument);
}

namespace {

/// Part of the picture that is not background, and its centre of mass, of something evenly grey.
Vector3d grey_moment(ImageView image, double background, double grey) {
  Vector3d moment = Vector3d::Zero();
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      moment += std::clamp((image.at(x, y) - background) / (grey - background), 0.0, 1.0) * Vector3d(x, y, 1);
  return {moment.x() / moment.z(), moment.y() / moment.z(), moment.z()};
}

PlacedSolid placed(SolidKind kind, double radius, double inner, double depth, const Pose& T) {
  Solid solid{.kind = kind};
  solid.radius = radius, solid.inner_radius = inner, solid.depth = depth, solid.grey = 255.0;
  return {solid, T};
}

}  // namespace

TEST_CASE("a ball on the optical axis is a disc of the radius that its tangent cone has") {
  const Pinhole camera = plain_camera();
  const double distance = 0.4, radius = 0.05;
  const PlacedSolid ball = placed(SolidKind::Ball, radius, 0, 0, square_on(0, 0, distance));
  const auto on = [&](double background) {
    return render({}, std::span(&ball, 1), camera, {.oversampling = 32, .background = background});
  };
  const Image image = on(0.0), bright = on(255.0);
  // The part of a pixel that the ball covers is what a brighter background does not change.
  double area = 0;
  Vector2d centre = Vector2d::Zero();
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const double covered = 1.0 - (bright.view().at(x, y) - image.view().at(x, y)) / 255.0;
      area += covered, centre += covered * Vector2d(x, y);
    }
  const double expected = camera.fx * radius / std::sqrt(distance * distance - radius * radius);
  CHECK(std::sqrt(area / std::numbers::pi) == Approx(expected).margin(0.005));
  CHECK((centre / area - Vector2d(camera.cx, camera.cy)).norm() < 0.005);
  CHECK(image.view().at(static_cast<int>(camera.cx) - 20, static_cast<int>(camera.cy) - 25) >
        image.view().at(static_cast<int>(camera.cx) + 20,
                        static_cast<int>(camera.cy) + 25));  // light from the upper left
}

TEST_CASE("the mouth of a tube is the ring between the pictures of its circles") {
  Pinhole camera = wide_camera();
  RenderOptions options;
  options.background = 0.0;
  Pose T = tilted(0.03, -0.02, 0.3);
  T.linear() =
      T.linear() * Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitX()).toRotationMatrix();  // Z to the camera
  // A plate of depth hides nothing of the rim, and a bore without light is black but for its wall: count the rim.
  const double inner = 0.025, outer = 0.04;
  const PlacedSolid tube = placed(SolidKind::Tube, outer, inner, 0.0005, T);
  const Image image = render({}, std::span(&tube, 1), camera, options);
  const Vector3d hole = disc_moment(camera, T, Vector3d::Zero(), inner),
                 disc = disc_moment(camera, T, Vector3d::Zero(), outer);
  const Vector2d on_rim = camera.project(T * Vector3d((inner + outer) / 2, 0, 0));
  const int top = image.view().at(static_cast<int>(std::lround(on_rim.x())), static_cast<int>(std::lround(on_rim.y())));
  const double rim = grey_moment(image, 0.0, top).z();
  const double bottom = 0.15 * std::abs(hole.z());  // of the bore, in units of the rim's grey
  CHECK(rim - bottom == Approx(std::abs(disc.z()) - std::abs(hole.z())).epsilon(0.02));
}

TEST_CASE("solids hide targets behind them and are hidden by those before, and the rest is as without them") {
  const Pinhole camera = plain_camera();
  const PlacedTarget board{parse_target("grid:36h11:2x3:0.03:0.01"), square_on(-0.05, -0.03, 0.4)};
  const Image alone = render(std::span(&board, 1), camera);
  const auto differ = [&](double depth) {
    const PlacedSolid ball = placed(SolidKind::Ball, 0.01, 0, 0, square_on(0, 0, depth));
    const Image both = render(std::span(&board, 1), std::span(&ball, 1), camera);
    int count = 0;
    double far = 0;
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x)
        if (both.view().at(x, y) != alone.view().at(x, y))
          ++count, far = std::max(far, std::hypot(x - camera.cx, y - camera.cy));
    return std::pair(count, far);
  };
  CHECK(differ(0.5).first == 0);
  CHECK(differ(0.3).first > 500);
  CHECK(differ(0.3).second < 600 * 0.01 / 0.28);
}

TEST_CASE("a solid without a size is refused") {
  const PlacedSolid ball = placed(SolidKind::Ball, 0.0, 0, 0, square_on(0, 0, 1));
  CHECK_THROWS_WITH(render({}, std::span(&ball, 1), plain_camera()), Catch::Contains("radius"));
}

}  // namespace render_test
