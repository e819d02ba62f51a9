#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>

#include <catch2/catch.hpp>

#include <kr5/calibration/hand_eye_diagnosis.hpp>
#include <kr5/calibration/hand_eye_pairs.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/geometry/resection.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include <support/hand_eye_faults.hpp>
#include <support/rates.hpp>
#include <support/trials.hpp>

namespace hand_eye_diagnosis_test {

using namespace kr5;
using namespace kr5::calibration;
using namespace kr5::test;

namespace {

/// What comes of recordings of one kind: how often each cause came first, and in how many others stood beside it.
struct Counts {
  std::map<std::string, int> first;
  int with_others = 0;
  std::string others;  ///< What stood beside.

  void add(const HandEyeDiagnosis& diagnosis) {
    ++first[diagnosis.causes.empty() ? "none" : std::string(name_of(diagnosis.causes.front().cause))];
    with_others += diagnosis.causes.size() > 1;
    for (std::size_t k = 1; k < diagnosis.causes.size(); ++k)
      others += std::string(name_of(diagnosis.causes[k].cause)) + " ";
  }
};

/// Appends a row to the table that tools/benchmarks/named_cause.py shows.
void record(const std::string& truth, const std::map<std::string, int>& named) {
  const char* file = std::getenv("KR5_CONFUSION");
  if (!file) return;
  std::ofstream out(file, std::ios::app);
  for (const auto& [name, count] : named) out << truth << ',' << name << ',' << count << '\n';
}

Counts count_causes(const std::string& truth, int trials, const std::function<Draw(std::uint64_t)>& draw) {
  Counts out;
  for (int t = 0; t < trials; ++t)
    out.add(diagnose_hand_eye(draw(5'300'000 + static_cast<std::uint64_t>(t)).recording, HandEyeResult{}));
  record(truth, out.first);
  return out;
}

/// The calibration of the recording as it is believed to be meant.
HandEyeResult calibrated(const HandEyeRecording& r) {
  const std::vector<Pose> poses = to_poses(r.rows, r.format);
  std::vector<HandEyeView> views;
  for (std::size_t i = 0; i < poses.size(); ++i) views.push_back({poses[i], r.views[i]});
  HandEyeOptions options;
  options.mount = r.mount;
  return calibrate_hand_eye(views, r.camera, options);
}

}  // namespace

TEST_CASE("sound recordings have no cause named", "[cause_counts][statistics]") {
  const int trials = test::trials(400, 30);
  std::map<std::string, int> named =
      count_causes("sound", trials, [](std::uint64_t seed) { return draw_sound(seed); }).first;
  CAPTURE(named);
  check_rate(named["none"], trials, 0.95, test::full() ? 0.95 : 0.8);
}

TEST_CASE("sound recordings of an imprecise robot have no cause named", "[cause_counts][statistics]") {
  const int trials = test::trials(200, 20);
  std::map<std::string, int> named = count_causes("sound_rough_robot", trials, [](std::uint64_t seed) {
                                       return draw_sound(seed, {}, {}, true);
                                     }).first;
  CAPTURE(named);
  check_rate(named["none"], trials, 0.95, test::full() ? 0.92 : 0.7);
}

TEST_CASE("views that are given ten times say no more than once", "[not_sanitized]") {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const HandEyeRecording once = draw_sound(5'400'000 + seed).recording;
    HandEyeRecording often = once;
    for (int k = 1; k < 10; ++k) {
      often.views.insert(often.views.end(), once.views.begin(), once.views.end());
      often.times.insert(often.times.end(), once.times.begin(), once.times.end());
    }
    often.rows = once.rows.replicate(10, 1);
    const HandEyeDiagnosis a = diagnose_hand_eye(once, HandEyeResult{}), b = diagnose_hand_eye(often, HandEyeResult{});
    REQUIRE(b.causes.size() == a.causes.size());
    for (std::size_t i = 0; i < a.causes.size(); ++i) {
      CHECK(b.causes[i].cause == a.causes[i].cause);
      CHECK(b.causes[i].probability == a.causes[i].probability);
      CHECK(b.causes[i].views == a.causes[i].views);
    }
    CHECK(b.held_out_rms == a.held_out_rms);
  }
}

TEST_CASE("the right cause comes first and alone, whatever the fault", "[cause_counts][statistics][not_sanitized]") {
  int right = 0, all = 0, with_others = 0;
  std::string others;
  for (const auto& [cause, name] : enum_names(HandEyeCause{})) {
    if (test::of_pairs_only(cause)) continue;
    const std::string truth(name);
    const int trials = test::trials(80, 6);
    Counts named = count_causes(truth, trials, [cause = cause](std::uint64_t seed) {
      return draw_fault(cause, seed + 77'000 * (1 + static_cast<int>(cause)));
    });
    CAPTURE(truth, named.first, named.others);
    if (named.with_others > 0) others += truth + ": " + named.others + "\n";
    with_others += named.with_others;
    check_rate(named.first[truth], trials, test::full() ? 0.95 : 0.8, test::full() ? 0.9 : 0.35);  // six prove little
    right += named.first[truth];
    all += trials;
  }
  check_rate(right, all, 0.95, test::full() ? 0.95 : 0.9);
  INFO(others << "each of these recordings has one fault, so every other cause is false");
  check_rare(with_others, all, 0.03, test::full() ? 0.04 : 0.1);
}

TEST_CASE("the size of a fault is found with it") {
  Draw d = draw_sound(31);
  for (View& v : d.recording.views) v.points *= 1.07;
  const HandEyeDiagnosis diagnosis = diagnose_hand_eye(d.recording, calibrated(d.recording));
  REQUIRE(diagnosis.causes.size() == 1);
  CHECK(diagnosis.causes[0].cause == HandEyeCause::TargetSizeWrong);
  CHECK(diagnosis.causes[0].value == Approx(1 / 1.07).epsilon(0.005));
  CHECK(diagnosis.causes[0].probability > 0.99);
  CHECK(diagnosis.causes[0].held_out_after < 0.5 * diagnosis.causes[0].held_out_before);
  CHECK_THAT(diagnosis.causes[0].text, Catch::Contains("0.934"));
  // The answer with the fault corrected is the true one, within its covariance.
  REQUIRE(diagnosis.causes[0].T_mount_camera);
  const Vector6 error = pose_difference(d.world.T_mount_camera, *diagnosis.causes[0].T_mount_camera);
  CHECK(error.dot(diagnosis.causes[0].covariance.ldlt().solve(error)) < uncertainty::chi_square_quantile(0.999, 6.0));
  CHECK_FALSE(diagnosis.causes[0].remedy.empty());
  CHECK(diagnosis.verdict == CalibrationVerdict::Unusable);
}

TEST_CASE("the verdict tells the expected error and names one outlier among the others") {
  Draw d = draw_fault(HandEyeCause::OutlierViews, 41);
  const HandEyeDiagnosis diagnosis = diagnose_hand_eye(d.recording, calibrated(d.recording));
  REQUIRE_FALSE(diagnosis.causes.empty());
  const NamedCause& cause = diagnosis.causes.front();
  REQUIRE(cause.cause == HandEyeCause::OutlierViews);
  const std::size_t others = d.recording.views.size() - cause.views.size();
  CHECK_THAT(cause.text, Catch::Contains(cause.views.size() == 1 ? "contradicts" : "contradict") &&
                             Catch::Contains("the other " + std::to_string(others) + " views"));
  CHECK_THAT(diagnosis.text,
             Catch::StartsWith("At ") && Catch::Contains("your tolerance: 2 mm") && Catch::Contains(cause.text));
}

TEST_CASE("a board of another size is named although some views are bad, too", "[not_sanitized]") {
  int found = 0;
  constexpr int trials = 6;
  for (std::uint64_t seed = 0; seed < trials; ++seed) {
    Draw d = draw_fault(HandEyeCause::OutlierViews, 6'100 + seed);
    for (View& v : d.recording.views) v.points *= 1.04;
    const HandEyeDiagnosis diagnosis = diagnose_hand_eye(d.recording, calibrated(d.recording));
    CAPTURE(diagnosis.text);
    if (diagnosis.causes.empty() || diagnosis.causes[0].cause != HandEyeCause::TargetSizeWrong) continue;
    ++found;
    CHECK(diagnosis.verdict != CalibrationVerdict::Good);
    for (const NamedCause& c : diagnosis.causes)
      for (const int view : c.views) CHECK(view < static_cast<int>(d.recording.views.size()));
  }
  CHECK(found >= trials - 1);
}

TEST_CASE("no fault is denied of a recording whose answer is bad") {
  // Points of every view scattered by centimetres: no single fault explains that.
  Random random(44);
  Draw d = draw_sound(33);
  for (View& v : d.recording.views)
    for (Eigen::Index i = 0; i < v.pixels.cols(); ++i) v.pixels.col(i) += random.normal_vector(2, 40.0);
  const HandEyeDiagnosis diagnosis = diagnose_hand_eye(d.recording, calibrated(d.recording));
  CAPTURE(diagnosis.text);
  CHECK(diagnosis.verdict != CalibrationVerdict::Good);
  CHECK_THAT(diagnosis.text, !Catch::Contains("No fault"));
}

TEST_CASE("the views of a calibration are a recording to diagnose") {
  Draw d = draw_sound(31);
  for (View& v : d.recording.views) v.points *= 1.07;
  const std::vector<Pose> poses = to_poses(d.recording.rows, d.recording.format);
  std::vector<HandEyeView> views;
  for (std::size_t i = 0; i < poses.size(); ++i) views.push_back({poses[i], d.recording.views[i]});
  const HandEyeRecording same = HandEyeRecording::from_views(views, d.recording.camera, d.recording.mount);
  CHECK(to_poses(same.rows, same.format).back().isApprox(poses.back(), 1e-12));
  const HandEyeResult result = calibrated(d.recording);
  const HandEyeDiagnosis a = diagnose_hand_eye(d.recording, result), b = diagnose_hand_eye(same, result);
  REQUIRE(b.causes.size() == 1);
  CHECK(b.causes[0].cause == HandEyeCause::TargetSizeWrong);
  CHECK(b.causes[0].value == Approx(a.causes[0].value).epsilon(1e-6));
  CHECK(b.tool_error_95 == Approx(a.tool_error_95).epsilon(1e-9));
  CHECK_THROWS_AS(diagnose_hand_eye(HandEyeRecording::from_views({}, d.recording.camera), result), InvalidArgument);
}

TEST_CASE("a fault of little consequence is named without condemning the answer") {
  HandEyeWorldOptions o;
  o.sigma_pixel = 0.1, o.sigma_robot_position = 0.05e-3, o.sigma_robot_rotation = 2e-4, o.views = 16, o.seed = 5;
  Draw d;
  d.world = make_hand_eye_world(o);
  d.recording.camera = d.world.camera;
  d.recording.mount = o.mount;
  set_poses(d, reported(d.world));
  for (const auto& v : d.world.views) d.recording.views.push_back(v.view);
  for (View& v : d.recording.views) v.points *= 1.005;
  const HandEyeResult result = calibrated(d.recording);
  const HandEyeDiagnosis diagnosis = diagnose_hand_eye(d.recording, result);
  REQUIRE_FALSE(diagnosis.causes.empty());
  const NamedCause& cause = diagnosis.causes.front();
  CHECK(cause.cause == HandEyeCause::TargetSizeWrong);
  const Eigen::Vector3d tool(0, 0, diagnosis.working_distance);
  const double error = (result.T_mount_camera * tool - d.world.T_mount_camera * tool).norm();
  CHECK(cause.consequence == Approx(error).margin(3 * diagnosis.tool_error_95));
  CHECK(cause.consequence > diagnosis.tool_error_95);
  CHECK(diagnosis.verdict == CalibrationVerdict::Doubtful);
  CHECK_THAT(diagnosis.text, Catch::Contains("Correcting this moves the result by"));
  // Who asks for a sixth of that error cannot use it.
  CHECK(diagnose_hand_eye(d.recording, result, {.tolerance = error / 6}).verdict == CalibrationVerdict::Unusable);
}

TEST_CASE("a fault that makes the answer meaningless makes it unusable", "[not_sanitized]") {
  using enum HandEyeCause;
  for (const HandEyeCause cause : {TooLittleRotation, OneAxisRotation, PosesInverted, WrongRotationForm,
                                   QuaternionOrder, DegreesForRadians, MillimetresForMetres, ShiftedByOne})
    for (std::uint64_t seed = 0; seed < static_cast<std::uint64_t>(test::trials(40, 3)); ++seed) {
      const Draw d = draw_fault(cause, 8'100'000 + seed);
      const HandEyeDiagnosis diagnosis = diagnose_hand_eye(d.recording, calibrated(d.recording));
      CAPTURE(name_of(cause), seed, diagnosis.text);
      CHECK(diagnosis.verdict == CalibrationVerdict::Unusable);
    }
}

TEST_CASE("the stated error at the tool holds the true one 95 % of the time, and a sound set is not called unusable",
          "[statistics]") {
  const int trials = test::trials(300, 40);
  int inside = 0;
  for (int t = 0; t < trials; ++t) {
    const Draw d = draw_sound(700'000 + static_cast<std::uint64_t>(t));
    HandEyeOptions options;
    options.mount = d.recording.mount;
    const HandEyeResult result = calibrate_hand_eye(d.world.views, d.recording.camera, options);
    const HandEyeDiagnosis diagnosis = diagnose_hand_eye(d.recording, result);
    const Eigen::Vector3d tool(0, 0, diagnosis.working_distance);
    const double error = (result.T_mount_camera * tool - d.world.T_mount_camera * tool).norm();
    CAPTURE(t, diagnosis.text, error);
    CHECK(diagnosis.verdict != CalibrationVerdict::Unusable);
    CHECK(diagnosis.tool_error < diagnosis.tool_error_95);
    inside += error < diagnosis.tool_error_95;
  }
  CAPTURE(inside, trials);
  CHECK(uncertainty::binomial_interval(inside, trials, 0.99).contains(0.95));  // not far too large either
  check_rate(inside, trials, 0.9, test::full() ? 0.9 : 0.75);  // an error stated at half its size would hold 42 %
}

TEST_CASE("recordings that do not fit together are refused") {
  Draw d = draw_sound(32);
  HandEyeRecording r = d.recording;
  r.rows.conservativeResize(r.rows.rows() - 1, r.rows.cols());
  CHECK_THROWS_WITH(diagnose_hand_eye(r, {}), Catch::Contains("expected one pose for each view"));
  r = d.recording;
  r.times = {1.0, 2.0};
  CHECK_THROWS_WITH(diagnose_hand_eye(r, {}), Catch::Contains("2 time stamps"));
  r = d.recording;
  r.views.resize(2);
  CHECK_THROWS_WITH(diagnose_hand_eye(r, {}), Catch::Contains("three views"));
  CHECK_THROWS_WITH(diagnose_hand_eye(d.recording, {}, {.tolerance = -1}), Catch::Contains("tolerance"));
}

namespace {

/// The poses of the target that the images of a draw show, in place of these images.
HandEyePairsRecording as_pairs(const Draw& d) {
  HandEyePairsRecording out{d.recording.rows, d.recording.format, {}, {}, d.recording.times, d.recording.mount};
  for (std::size_t i = 0; i < d.recording.views.size(); ++i) {
    const View& view = d.recording.views[i];
    // A flat board has two poses, of which a finder that follows it knows the right one.
    const Pose near = target_in_camera(d.world, d.recording.mount, d.world.views[i].T_base_flange);
    const std::vector<Resection> found = resect(view.points, view.pixels, d.recording.camera);
    const auto off = [&](const Resection& r) { return pose_difference(near, r.T_camera_points).tail<3>().norm(); };
    out.T_camera_target.push_back(std::ranges::min_element(found, {}, off)->T_camera_points);
    out.names.push_back(view.name);
  }
  return out;
}

HandEyeResult calibrated(const HandEyePairsRecording& r) {
  const std::vector<Pose> poses = to_poses(r.rows, r.format);
  std::vector<PosePair> pairs;
  for (std::size_t i = 0; i < poses.size(); ++i) pairs.push_back({r.names[i], poses[i], r.T_camera_target[i]});
  return calibrate_hand_eye_pairs(pairs, {.mount = r.mount});
}

HandEyePairsRecording draw_pairs(HandEyeCause cause, std::uint64_t seed) {
  if (!test::of_pairs_only(cause)) return as_pairs(draw_fault(cause, seed));
  HandEyePairsRecording out = as_pairs(draw_sound(seed));
  const Eigen::Vector3d mirror(1, -1, 1);
  for (Pose& T : out.T_camera_target) {
    T.linear() = mirror.asDiagonal() * T.linear() * mirror.asDiagonal();
    T.translation() = mirror.asDiagonal() * T.translation();
  }
  return out;
}

}  // namespace

TEST_CASE("the right cause comes first for pairs of poses, too, and sound pairs have none",
          "[statistics][not_sanitized]") {
  int right = 0, all = 0;
  std::string wrong;
  const auto names_first = [&](const HandEyePairsRecording& pairs, const std::string& truth) {
    const HandEyeDiagnosis d = diagnose_hand_eye_pairs(pairs, calibrated(pairs));
    const std::string first = d.causes.empty() ? "none" : std::string(name_of(d.causes.front().cause));
    if (first != truth) wrong += truth + " was called " + first + "; ";
    ++all;
    right += first == truth;
  };
  for (std::uint64_t seed = 0; seed < static_cast<std::uint64_t>(test::trials(200, 20)); ++seed)
    names_first(as_pairs(draw_sound(5'600'000 + seed)), "none");
  for (const auto& [cause, name] : enum_names(HandEyeCause{})) {
    if (cause == HandEyeCause::CameraModelWrong) continue;  // poses have no camera
    for (std::uint64_t seed = 0; seed < static_cast<std::uint64_t>(test::trials(40, 3)); ++seed)
      names_first(draw_pairs(cause, 5'700'000 + seed + 77'000 * static_cast<std::uint64_t>(cause)), std::string(name));
  }
  CAPTURE(wrong);
  check_rate(right, all, 0.9, test::full() ? 0.9 : 0.8);
}

TEST_CASE("the pairs of a calibration are a recording to diagnose") {
  const HandEyePairsRecording given = as_pairs(draw_fault(HandEyeCause::OutOfOrder, 42));
  const std::vector<Pose> poses = to_poses(given.rows, given.format);
  std::vector<PosePair> pairs;
  for (std::size_t i = 0; i < poses.size(); ++i) pairs.push_back({given.names[i], poses[i], given.T_camera_target[i]});
  const HandEyePairsRecording same = HandEyePairsRecording::from_pairs(pairs, given.mount);
  const HandEyeResult result = calibrated(given);
  const HandEyeDiagnosis a = diagnose_hand_eye_pairs(given, result), b = diagnose_hand_eye_pairs(same, result);
  REQUIRE(b.causes.size() == a.causes.size());
  REQUIRE_FALSE(b.causes.empty());
  CHECK(b.causes[0].cause == HandEyeCause::OutOfOrder);
  CHECK(b.causes[0].views == a.causes[0].views);
}

TEST_CASE("inverted camera poses are named as what the data can tell") {
  HandEyePairsRecording pairs = as_pairs(draw_sound(41));
  for (Pose& T : pairs.T_camera_target) T = T.inverse();
  const HandEyeDiagnosis d = diagnose_hand_eye_pairs(pairs, HandEyeResult{});
  REQUIRE_FALSE(d.causes.empty());
  CHECK(d.causes[0].cause == HandEyeCause::PosesInverted);
  CHECK_THAT(d.causes[0].text, Catch::Contains("the data cannot show which"));
  CHECK(d.verdict == CalibrationVerdict::Unusable);
}

TEST_CASE("pairs that do not fit together are refused by the diagnosis") {
  HandEyePairsRecording pairs = as_pairs(draw_sound(32));
  pairs.names.pop_back();
  CHECK_THROWS_WITH(diagnose_hand_eye_pairs(pairs, {}), Catch::Contains("names for"));
  pairs = as_pairs(draw_sound(32)), pairs.T_camera_target.pop_back();
  CHECK_THROWS_WITH(diagnose_hand_eye_pairs(pairs, {}), Catch::Contains("robot poses for"));
}

}  // namespace hand_eye_diagnosis_test
