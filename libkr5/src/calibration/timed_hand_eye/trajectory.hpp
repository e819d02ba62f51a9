// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include <kr5/calibration/timed_hand_eye.hpp>
#include <kr5/fit/pose_chain.hpp>

/// @file
/// A pose stream as a function of time.

namespace kr5::calibration::timed {

/// Sorted, without repeated time stamps, checked.
/// @throws InvalidArgument naming the stream.
PoseStream tidy(const PoseStream& stream, const char* name);

/// Smooth interpolation through every pose: cubic Hermite in position and in the rotation vector of each interval.
class Trajectory {
 public:
  using Sample = fit::PathSample;

  /// `stream` must be tidy.
  Trajectory(PoseStream stream, double max_gap);

  /// Empty outside the stream and in its gaps.
  std::optional<Sample> at(double t) const;
  /// The same across gaps, and beyond the ends at the rate there.
  Sample extended(double t) const;
  double begin() const { return stream_.t.front(); }
  double end() const { return stream_.t.back(); }
  const PoseStream& stream() const { return stream_; }

 private:
  /// Number of the interval that holds t.
  std::size_t interval(double t) const;

  PoseStream stream_;
  std::vector<Vector6> slope_;  ///< position in the parent, rotation in the body [m/s, rad/s]
  double max_gap_;
};

/// Best alignment of the speeds of turning; correlation 0 when nothing overlaps enough.
SpeedAlignment align(const Trajectory& hand, const Trajectory& camera, const TimedHandEyeOptions& options);

}  // namespace kr5::calibration::timed
