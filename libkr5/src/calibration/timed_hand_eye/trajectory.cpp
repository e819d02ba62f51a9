// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/timed_hand_eye/trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <kr5/core/error.hpp>
#include <kr5/geometry/pose_derivatives.hpp>

namespace kr5::calibration::timed {
namespace {

constexpr double grid = 0.01;  // of the resampled speeds [s]
const double missing = std::numeric_limits<double>::quiet_NaN();

/// Mean speed between two poses of a stream.
Vector6 secant(const PoseStream& s, std::size_t i, std::size_t j) {
  Vector6 v;
  v << s.poses[j].translation() - s.poses[i].translation(),
      log_rotation(s.poses[i].linear().transpose() * s.poses[j].linear());
  return v / (s.t[j] - s.t[i]);
}

/// Speed of turning over the window around each instant of the grid; NaN where the stream has none.
std::vector<double> speeds(const Trajectory& trajectory, double start, std::size_t count, double window) {
  std::vector<double> out(count, missing);
  for (std::size_t i = 0; i < count; ++i) {
    const double t = start + grid * static_cast<double>(i);
    const auto a = trajectory.at(t - window / 2), b = trajectory.at(t + window / 2);
    if (a && b) out[i] = log_rotation(a->T.linear().transpose() * b->T.linear()).norm() / window;
  }
  return out;
}

/// Correlation of a[i] with b[i + shift] where both are there; 0 for fewer than `least` pairs.
double correlate(const std::vector<double>& a, const std::vector<double>& b, std::ptrdiff_t shift, double least) {
  double n = 0, sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const auto j = static_cast<std::ptrdiff_t>(i) + shift;
    if (j < 0 || j >= static_cast<std::ptrdiff_t>(b.size())) continue;
    const double x = a[i], y = b[static_cast<std::size_t>(j)];
    if (std::isnan(x) || std::isnan(y)) continue;
    n += 1, sa += x, sb += y, saa += x * x, sbb += y * y, sab += x * y;
  }
  const double scale = (n * saa - sa * sa) * (n * sbb - sb * sb);
  return n < least || scale <= 0 ? 0.0 : (n * sab - sa * sb) / std::sqrt(scale);
}

void keep(const std::vector<double>& speed, double start, std::vector<double>& t, std::vector<double>& out) {
  for (std::size_t i = 0; i < speed.size(); i += 2)
    if (!std::isnan(speed[i])) t.push_back(start + grid * static_cast<double>(i)), out.push_back(speed[i]);
}

}  // namespace

PoseStream tidy(const PoseStream& stream, const char* name) {
  const std::string who = std::string("calibrate_timed_hand_eye: ") + name;
  require(stream.t.size() == stream.poses.size(), who + ": found " + std::to_string(stream.t.size()) + " times and " +
                                                      std::to_string(stream.poses.size()) + " poses, expected as many");
  std::vector<std::size_t> order(stream.t.size());
  std::iota(order.begin(), order.end(), 0);
  for (const std::size_t i : order)
    require(std::isfinite(stream.t[i]) && stream.poses[i].matrix().allFinite() && is_rotation(stream.poses[i].linear()),
            who + ": pose " + std::to_string(i + 1) + " is not finite with a proper rotation");
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return stream.t[a] < stream.t[b]; });
  PoseStream out;
  for (const std::size_t i : order) {
    if (!out.t.empty() && stream.t[i] - out.t.back() < 1e-6) continue;
    out.t.push_back(stream.t[i]);
    out.poses.push_back(stream.poses[i]);
  }
  constexpr double longest = 1e5;  // more than a day, in steps of the resampled speeds
  require(out.t.empty() || out.t.back() - out.t.front() <= longest,
          who + ": the times span " + std::to_string(out.t.back() - out.t.front()) +
              " s, expected at most 1e5; are they in milliseconds or nanoseconds, or does one of them belong to "
              "another clock?");
  require(out.t.size() >= 10,
          who + ": found " + std::to_string(out.t.size()) + " poses at different times, expected 10");
  return out;
}

Trajectory::Trajectory(PoseStream stream, double max_gap) : stream_(std::move(stream)), max_gap_(max_gap) {
  const std::size_t n = stream_.t.size();
  slope_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t before = i == 0 ? 0 : i - 1, after = std::min(i + 1, n - 1);
    if (before == i || after == i) {
      slope_[i] = secant(stream_, before, after);
      continue;
    }
    const double left = stream_.t[i] - stream_.t[before], right = stream_.t[after] - stream_.t[i];
    slope_[i] = (right * secant(stream_, before, i) + left * secant(stream_, i, after)) / (left + right);
  }
}

std::size_t Trajectory::interval(double t) const {
  const auto upper = std::upper_bound(stream_.t.begin() + 1, stream_.t.end() - 1, t);
  return static_cast<std::size_t>(upper - stream_.t.begin()) - 1;
}

std::optional<Trajectory::Sample> Trajectory::at(double t) const {
  if (!(t >= begin() && t <= end())) return std::nullopt;
  const std::size_t i = interval(t);
  if (stream_.t[i + 1] - stream_.t[i] > max_gap_) return std::nullopt;
  return extended(t);
}

Trajectory::Sample Trajectory::extended(double t) const {
  const double within = std::clamp(t, begin(), end());
  const std::size_t i = interval(within), j = i + 1;
  const double h = stream_.t[j] - stream_.t[i], u = (within - stream_.t[i]) / h;
  Vector6 chord = h * secant(stream_, i, j), end_slope = slope_[j];
  end_slope.tail<3>() = right_jacobian_inverse(chord.tail<3>()) * end_slope.tail<3>();
  const double u2 = u * u, u3 = u2 * u;
  const Vector6 d = (u3 - 2 * u2 + u) * h * slope_[i] + (3 * u2 - 2 * u3) * chord + (u3 - u2) * h * end_slope;
  const Vector6 rate = (3 * u2 - 4 * u + 1) * slope_[i] + (6 * u - 6 * u2) / h * chord + (3 * u2 - 2 * u) * end_slope;
  Sample sample{stream_.poses[i], Vector6::Zero()};
  sample.T.translation() += d.head<3>();
  sample.T.linear() = sample.T.linear() * exp_rotation(d.tail<3>());
  sample.rate.head<3>() = sample.T.linear().transpose() * rate.head<3>();
  sample.rate.tail<3>() = right_jacobian(d.tail<3>()) * rate.tail<3>();
  if (t != within) {
    const Pose beyond = to_pose(Vector6((t - within) * sample.rate));
    sample.T = sample.T * beyond;
    sample.rate.head<3>() = beyond.linear().transpose() * sample.rate.head<3>();
  }
  return sample;
}

SpeedAlignment align(const Trajectory& hand, const Trajectory& camera, const TimedHandEyeOptions& options) {
  const auto count = [](const Trajectory& s) { return static_cast<std::size_t>((s.end() - s.begin()) / grid) + 1; };
  const auto a = speeds(hand, hand.begin(), count(hand), options.window);
  const auto b = speeds(camera, camera.begin(), count(camera), options.window);
  SpeedAlignment out;
  keep(a, hand.begin(), out.t_hand, out.hand);
  keep(b, camera.begin(), out.t_camera, out.camera);
  const double least = options.min_duration / grid / 2;  // gaps of the camera may take half
  const double start = hand.begin() - camera.begin();    // a[i] and b[i + shift] have this offset plus -shift
  const auto reach = static_cast<std::ptrdiff_t>(std::ceil(options.max_offset / grid));
  const auto centre = static_cast<std::ptrdiff_t>(std::lround(start / grid));
  std::ptrdiff_t best = centre;
  for (std::ptrdiff_t shift = centre - reach; shift <= centre + reach; ++shift) {
    const double c = correlate(a, b, shift, least);
    if (c > out.correlation) out.correlation = c, best = shift;
  }
  if (out.correlation <= 0) return out;
  const double left = correlate(a, b, best - 1, least), right = correlate(a, b, best + 1, least);
  const double curvature = left - 2 * out.correlation + right;
  const double fine = curvature < 0 ? std::clamp(0.5 * (left - right) / curvature, -0.5, 0.5) : 0.0;
  out.offset = grid * (static_cast<double>(best) + fine) - start;
  return out;
}

}  // namespace kr5::calibration::timed
