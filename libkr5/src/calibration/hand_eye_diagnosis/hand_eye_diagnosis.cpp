// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/hand_eye_diagnosis.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include <Eigen/Dense>

#include <kr5/core/error.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "calibration/hand_eye/closed_form.hpp"
#include "calibration/hand_eye_diagnosis/camera_hypotheses.hpp"
#include "calibration/hand_eye_diagnosis/cause_messages.hpp"
#include "calibration/hand_eye_diagnosis/lag_hypotheses.hpp"
#include "calibration/hand_eye_diagnosis/left_out.hpp"
#include "calibration/hand_eye_diagnosis/order_hypotheses.hpp"

namespace kr5::calibration {
namespace {

using evidence::Case;
using evidence::SetupHypothesis;

constexpr double families = 8;        // of hypotheses, which share the false alarms
constexpr std::size_t min_views = 6;  // for a second look without outliers

/// Turns of the target as the camera saw it, which do not depend on how the robot's numbers are read.
Eigen::Vector3d seen_turns(const evidence::Sightings& sightings) {
  std::vector<Pose> seen;
  for (std::size_t i = 0; i < sightings.index.size(); ++i)
    seen.push_back(sightings.views[i].solutions.front().T_camera_target);
  return principal_turns(seen);
}

/// Fisher's F as a gain in -2 log likelihood of n samples whose variance is estimated, `rest` of them left over.
double gain_of_f(double alpha, int freedom, double n, double rest) {
  if (rest < 1) return std::numeric_limits<double>::infinity();
  return n * std::log1p(freedom * uncertainty::fisher_quantile(1 - alpha, freedom, rest) / rest);
}

/// The gain in -2 log likelihood that a sound set exceeds with probability `alpha`.
double chance_gain(const Case& c, const SetupHypothesis& h, double alpha) {
  // A fixed wrong reading beats the right one by 2 log(1/alpha) no more often than alpha (Markov's inequality).
  if (h.freedom == 0) return 2 * (h.choices - std::log(alpha));
  const double a = std::max(alpha * std::exp(-h.choices), 1e-12);
  // Three of the six components of a pose may carry it all; for a camera the pixels may, of which a tag has few.
  const double n = 3.0 * h.reading.size(), robot = gain_of_f(a, h.freedom, n, n - 6 - h.freedom);
  if (h.causes.front() != HandEyeCause::CameraModelWrong) return robot;
  return std::max(robot, gain_of_f(a, h.freedom, c.sightings.freedom, c.sightings.freedom - h.freedom));
}

/// What a hypothesis gains over the sound one after paying for its freedom (Schwarz) and its choices.
double net_gain(const SetupHypothesis& sound, const SetupHypothesis& h) {
  return sound.score - h.score - h.freedom * std::log(6.0 * h.reading.size()) - 2 * h.choices;
}

/// Thousands of corners show any lens to be a little different. That is a cause only when it moves the camera beyond
/// the uncertainty that remains with the better one (that with the worse one is inflated by the fault itself).
bool matters(const Case& c, const SetupHypothesis& h) {
  if (h.causes.front() != HandEyeCause::CameraModelWrong) return true;
  const Vector6 moved = pose_difference(c.sound.fit.X, h.fit.X);
  const Matrix6 covariance = h.fit.covariance.topLeftCorner<6, 6>();
  return moved.dot(covariance.ldlt().solve(moved)) > uncertainty::chi_square_quantile(0.99, 6);
}

struct JudgedHypothesis {
  SetupHypothesis hypothesis;
  double gain = 0.0;  ///< Net.
  double held_out = 0.0;
};

double held_out(const Case& c, const SetupHypothesis& h) {
  if (h.causes.front() == HandEyeCause::CameraModelWrong) return evidence::held_out_with_camera(c, h.freedom);
  return held_out_rms(h.reading, c.sightings);
}

/// Whether outliers are looked for: of pairs only those count that the calibration left out, too.
bool looks_for_outliers(const Case& c, const HandEyeResult& result) {
  return !c.pairs || result.views.empty() || std::ranges::any_of(result.views, &HandEyeViewReport::outlier);
}

/// Significant hypotheses, the best of each kind, best first.
std::vector<JudgedHypothesis> compete(const Case& c, const HandEyeResult& result,
                                      const HandEyeDiagnosisOptions& options, double held_out_sound) {
  std::vector<JudgedHypothesis> out;
  const auto consider = [&](const std::vector<SetupHypothesis>& family) {
    const SetupHypothesis* best = nullptr;
    for (const SetupHypothesis& h : family)
      if (!best || net_gain(c.sound, h) > net_gain(c.sound, *best)) best = &h;
    if (!best || c.sound.score - best->score < chance_gain(c, *best, options.false_alarm / families)) return;
    if (!matters(c, *best)) return;
    const double error = held_out(c, *best);
    if (error < held_out_sound) out.push_back({*best, net_gain(c.sound, *best), error});
  };
  consider(evidence::other_formats(c));
  consider(evidence::other_size(c));
  consider(evidence::shifted_readings(c));
  consider(evidence::reordered_readings(c, options.seed));
  consider(evidence::moved_target(c));
  consider(evidence::delayed_readings(c));
  if (looks_for_outliers(c, result)) consider(evidence::outlier_readings(c));
  consider(c.pairs ? evidence::mirrored_target(c) : evidence::other_camera(c));
  std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.gain > b.gain; });
  return out;
}

/// Causes with their probabilities; those that the best one makes improbable are left out.
std::vector<NamedCause> name_causes(const Case& c, const std::vector<JudgedHypothesis>& candidates,
                                    const Pose& T_mount_camera, const HandEyeDiagnosis& so_far) {
  std::vector<NamedCause> out;
  const Eigen::Vector3d tool(0, 0, so_far.working_distance);
  double total = candidates.empty() ? 1.0 : std::exp(-0.5 * candidates.front().gain);
  for (const JudgedHypothesis& k : candidates) total += std::exp(0.5 * (k.gain - candidates.front().gain));
  for (const JudgedHypothesis& k : candidates) {
    const double probability = std::exp(0.5 * (k.gain - candidates.front().gain)) / total;
    if (probability < 0.01) continue;
    for (const HandEyeCause cause : k.hypothesis.causes) {
      NamedCause named;
      named.cause = cause;
      named.probability = probability;
      named.consequence = (k.hypothesis.fit.X * tool - T_mount_camera * tool).norm();
      named.held_out_before = so_far.held_out_rms;
      named.held_out_after = k.held_out;
      named.views = k.hypothesis.views;
      named.value = k.hypothesis.value;
      named.T_mount_camera = k.hypothesis.fit.X;
      if (k.hypothesis.fit.covariance.rows() >= 6) named.covariance = k.hypothesis.fit.covariance.topLeftCorner<6, 6>();
      evidence::describe(c, k.hypothesis, named);
      out.push_back(std::move(named));
    }
  }
  return out;
}

/// Expected error of a point in front of the camera, from the covariance of T_mount_camera.
void judge_tool_error(const HandEyeResult& result, HandEyeDiagnosis& out) {
  Eigen::Matrix<double, 3, 6> J;
  J << Eigen::Matrix3d::Identity(), -skew(Eigen::Vector3d(0, 0, out.working_distance));
  const Eigen::Matrix3d covariance = J * result.covariance * J.transpose();
  out.tool_error = std::sqrt(covariance.trace());
  // Radius of the ball: between that of one and that of three equal axes, by matching the first two moments.
  const double mean = covariance.trace(), square = covariance.squaredNorm();
  const double dof = square > 0 ? mean * mean / square : 3.0;
  out.tool_error_95 = std::sqrt(mean / dof * uncertainty::chi_square_quantile(0.95, dof));
}

double target_distance(const evidence::Sightings& sightings) {
  double sum = 0;
  for (std::size_t i = 0; i < sightings.index.size(); ++i)
    sum += sightings.views[i].solutions.front().T_camera_target.translation().norm();
  return sum / static_cast<double>(sightings.index.size());
}

/// Nothing can be allowed for, or the numbers mean something else: an answer that comes out right by luck (a camera
/// beside the arm may, from positions alone) would still be used with every later pose misread.
bool meaningless(const NamedCause& c) {
  using enum HandEyeCause;
  constexpr HandEyeCause certain[] = {TooLittleRotation, OneAxisRotation};
  constexpr HandEyeCause misread[] = {PosesInverted,   MirroredTarget,    WrongRotationForm,
                                      QuaternionOrder, DegreesForRadians, MillimetresForMetres};
  return std::ranges::count(certain, c.cause) || (c.probability > 0.5 && std::ranges::count(misread, c.cause));
}

/// An error that is stated misleads nobody: a cause counts by what it adds to that.
void decide(const HandEyeResult& result, const HandEyeDiagnosisOptions& options, HandEyeDiagnosis& out) {
  const double stated = out.tool_error_95;
  const auto ruinous = [&](const NamedCause& c) {
    return meaningless(c) || (c.probability > 0.5 && c.consequence > std::max(stated, 5 * options.tolerance));
  };
  const auto harmful = [&](const NamedCause& c) { return c.consequence > stated; };
  if (!result.fit.usable() || std::ranges::any_of(out.causes, ruinous) || stated > 10 * options.tolerance)
    out.verdict = CalibrationVerdict::Unusable;
  else if (std::ranges::any_of(out.causes, harmful) || stated > options.tolerance)
    out.verdict = CalibrationVerdict::Doubtful;
  else
    out.verdict = CalibrationVerdict::Good;
  out.text = evidence::verdict_text(result, options, out);
}

bool too_little_rotation(const evidence::Sightings& sightings, const HandEyeDiagnosisOptions& options,
                         HandEyeDiagnosis& out) {
  const Eigen::Vector3d seen = seen_turns(sightings);
  // A camera's noise looks like a little turning, and a flat target may be seen mirrored: the robot must agree.
  if (out.rotation_minor >= options.min_rotation || seen[1] >= 2 * options.min_rotation) return false;
  NamedCause named;
  const bool none = out.rotation_major < 2 * options.min_rotation;
  named.cause = none ? HandEyeCause::TooLittleRotation : HandEyeCause::OneAxisRotation;
  named.probability = 1.0;
  named.value = none ? out.rotation_major : out.rotation_minor;
  named.unit = "rad";
  evidence::describe_rotation(out, options, named);
  out.causes.push_back(std::move(named));
  return true;
}

/// Whether two views are the same picture at the same robot pose.
bool same_view(const HandEyeRecording& r, std::size_t i, std::size_t k) {
  const View &a = r.views[i], &b = r.views[k];
  return a.pixels.cols() == b.pixels.cols() && a.pixels == b.pixels && a.points == b.points &&
         r.rows.row(static_cast<Eigen::Index>(i)) == r.rows.row(static_cast<Eigen::Index>(k));
}

/// A recording in which every view stands once, and where each stood. A repeated view holds nothing new: counted as
/// independent it would make causes of differences far below the noise.
struct DistinctViews {
  HandEyeRecording recording;
  std::vector<int> index;

  explicit DistinctViews(const HandEyeRecording& all) : recording(all) {
    recording.views.clear();
    recording.times.clear();
    for (std::size_t i = 0; i < all.views.size(); ++i) {
      const auto seen = [&](int k) { return same_view(all, i, static_cast<std::size_t>(k)); };
      if (std::ranges::any_of(index, seen)) continue;
      recording.rows.row(static_cast<Eigen::Index>(index.size())) = all.rows.row(static_cast<Eigen::Index>(i));
      recording.views.push_back(all.views[i]);
      if (!all.times.empty()) recording.times.push_back(all.times[i]);
      index.push_back(static_cast<int>(i));
    }
    recording.rows.conservativeResize(static_cast<Eigen::Index>(index.size()), Eigen::NoChange);
  }
};

/// Causes and verdict.
HandEyeDiagnosis diagnose(Case& c, const HandEyeResult& result, const HandEyeDiagnosisOptions& options) {
  c.sound.reading = evidence::as_recorded(c, c.poses);
  HandEyeDiagnosis out;
  const Eigen::Vector3d turned = principal_turns(c.sound.reading.robot);
  out.rotation_major = turned[0];
  out.rotation_minor = turned[1];
  out.working_distance = options.working_distance > 0 ? options.working_distance : target_distance(c.sightings);
  if (result.fit.usable()) judge_tool_error(result, out);
  if (!too_little_rotation(c.sightings, options, out)) {
    c.sound.fit = evidence::fit_reading(c.sound.reading, c.sightings);
    c.sound.score = c.sound.fit.score;
    out.held_out_rms = evidence::held_out_rms(c.sound.reading, c.sightings);
    if (c.sound.fit.usable)
      out.causes = name_causes(c, compete(c, result, options, out.held_out_rms),
                               result.fit.usable() ? result.T_mount_camera : c.sound.fit.X, out);
  }
  decide(result, options, out);
  return out;
}

/// Views that the likeliest cause says to leave out; none where it says something else.
std::vector<int> views_to_leave_out(const HandEyeDiagnosis& d) {
  if (d.causes.empty() || d.causes.front().cause != HandEyeCause::OutlierViews || d.causes.front().probability < 0.5)
    return {};
  return d.causes.front().views;
}

/// Places of the views that are kept.
std::vector<int> kept_views(std::size_t count, const std::vector<int>& left_out) {
  std::vector<int> out;
  for (int i = 0; i < static_cast<int>(count); ++i)
    if (std::ranges::find(left_out, i) == left_out.end()) out.push_back(i);
  return out;
}

template <class T>
std::vector<T> at(const std::vector<T>& values, const std::vector<int>& index) {
  std::vector<T> out;
  if (!values.empty())
    for (const int i : index) out.push_back(values[static_cast<std::size_t>(i)]);
  return out;
}

/// The likelier first; of causes that are as good as certain, the one of more consequence.
bool comes_first(const NamedCause& a, const NamedCause& b) {
  constexpr double certain = 0.99;
  const double likely_a = std::min(a.probability, certain), likely_b = std::min(b.probability, certain);
  return likely_a != likely_b ? likely_a > likely_b : a.consequence > b.consequence;
}

/// A few bad views outweigh a small fault of all the others: what is found without them stands beside them.
/// @param without The diagnosis of the kept views.
void add_causes_beside_outliers(const HandEyeDiagnosis& without, const std::vector<int>& kept,
                                const HandEyeResult& result, const HandEyeDiagnosisOptions& options,
                                HandEyeDiagnosis& out) {
  for (NamedCause cause : without.causes) {
    cause.views = at(kept, cause.views);
    if (cause.cause != HandEyeCause::OutlierViews) out.causes.push_back(std::move(cause));
  }
  std::ranges::stable_sort(out.causes, comes_first);
  decide(result, options, out);
}

/// Poses as a controller would write them in the plainest format.
Eigen::MatrixXd as_rows(const std::vector<Pose>& T_base_flange) {
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(T_base_flange.size()), 7);
  for (Eigen::Index i = 0; i < rows.rows(); ++i)
    rows.row(i) = to_row(T_base_flange[static_cast<std::size_t>(i)], PoseFormat{});
  return rows;
}

}  // namespace

HandEyeRecording HandEyeRecording::from_views(std::span<const HandEyeView> views, const Pinhole& camera, Mount mount) {
  std::vector<Pose> poses;
  HandEyeRecording out{{}, {}, {}, {}, camera, mount};
  for (const HandEyeView& view : views) {
    poses.push_back(view.T_base_flange);
    out.views.push_back(view.view);
  }
  out.rows = as_rows(poses);
  return out;
}

HandEyePairsRecording HandEyePairsRecording::from_pairs(std::span<const PosePair> pairs, Mount mount) {
  std::vector<Pose> poses;
  HandEyePairsRecording out{{}, {}, {}, {}, {}, mount};
  for (const PosePair& pair : pairs) {
    poses.push_back(pair.T_base_flange);
    out.T_camera_target.push_back(pair.T_camera_target);
    out.names.push_back(pair.name);
  }
  out.rows = as_rows(poses);
  return out;
}

void HandEyePairsRecording::validate() const {
  const std::string n = std::to_string(T_camera_target.size());
  require(T_camera_target.size() >= 3, "at least three pairs of poses are needed, found " + n);
  require(rows.rows() == static_cast<Eigen::Index>(T_camera_target.size()),
          "found " + std::to_string(rows.rows()) + " robot poses for " + n + " poses of the target");
  require(names.empty() || names.size() == T_camera_target.size(),
          "found " + std::to_string(names.size()) + " names for " + n + " pairs of poses");
  require(times.empty() || times.size() == T_camera_target.size(),
          "found " + std::to_string(times.size()) + " time stamps for " + n + " pairs of poses");
}

void HandEyeRecording::validate() const {
  const std::string n = std::to_string(views.size());
  require(views.size() >= 3, "at least three views are needed, found " + n);
  require(rows.rows() == static_cast<Eigen::Index>(views.size()),
          "found " + std::to_string(rows.rows()) + " robot poses for " + n + " views; expected one pose for each view");
  require(times.empty() || times.size() == views.size(),
          "found " + std::to_string(times.size()) + " time stamps for " + n + " views");
  camera.validate();
}

void HandEyeDiagnosisOptions::validate() const {
  require(false_alarm > 0 && false_alarm < 0.5, "false_alarm must lie between 0 and 0.5");
  require(tolerance > 0, "tolerance must be positive [m]");
  require(working_distance >= 0, "working_distance must not be negative [m]; 0 means that of the target");
  require(min_rotation > 0 && min_rotation < 1, "min_rotation must lie between 0 and 1 [rad]");
}

HandEyeDiagnosis diagnose_hand_eye(const HandEyeRecording& given, const HandEyeResult& result,
                                   const HandEyeDiagnosisOptions& options) {
  given.validate();
  options.validate();
  const DistinctViews distinct(given);
  const HandEyeRecording& recording = distinct.recording;
  recording.validate();
  Case c{recording,
         evidence::find_sightings(recording.views, recording.camera),
         to_poses(recording.rows, recording.format),
         {}};
  require(c.sightings.index.size() >= 3, "fewer than three views give a pose of the target");
  HandEyeDiagnosis out = diagnose(c, result, options);
  const std::vector<int> kept = kept_views(recording.views.size(), views_to_leave_out(out));
  if (kept.size() < recording.views.size() && kept.size() >= min_views) {
    HandEyeRecording rest = recording;
    rest.rows = recording.rows(kept, Eigen::all).eval();
    rest.views = at(recording.views, kept), rest.times = at(recording.times, kept);
    add_causes_beside_outliers(diagnose_hand_eye(rest, result, options), kept, result, options, out);
  }
  for (NamedCause& cause : out.causes) cause.views = at(distinct.index, cause.views);
  return out;
}

HandEyeDiagnosis diagnose_hand_eye_pairs(const HandEyePairsRecording& given, const HandEyeResult& result,
                                         const HandEyeDiagnosisOptions& options) {
  given.validate();
  options.validate();
  HandEyeRecording recording{given.rows, given.format, {}, given.times, {}, given.mount};
  recording.views.resize(given.T_camera_target.size());
  for (std::size_t i = 0; i < given.names.size(); ++i) recording.views[i].name = given.names[i];
  Case c{recording,
         evidence::given_sightings(given.T_camera_target),
         to_poses(recording.rows, recording.format),
         {},
         true};
  HandEyeDiagnosis out = diagnose(c, result, options);
  const std::vector<int> kept = kept_views(given.T_camera_target.size(), views_to_leave_out(out));
  if (kept.size() < given.T_camera_target.size() && kept.size() >= min_views) {
    HandEyePairsRecording rest = given;
    rest.rows = given.rows(kept, Eigen::all).eval();
    rest.T_camera_target = at(given.T_camera_target, kept);
    rest.times = at(given.times, kept), rest.names = at(given.names, kept);
    add_causes_beside_outliers(diagnose_hand_eye_pairs(rest, result, options), kept, result, options, out);
  }
  return out;
}

}  // namespace kr5::calibration
