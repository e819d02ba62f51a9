// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <map>
#include <numeric>
#include <optional>
#include <string>

#include <Eigen/SVD>

#include <kr5/calibration/hand_eye_diagnosis.hpp>

#include "hand_eye_world.hpp"

/// @file
/// Recordings of random cells, sound ones and ones with a fault of a size that matters.

namespace kr5::test {

/// A random recording. Noise: 0.1 to 0.5 px, robot 0.05 to 0.5 mm and 0.01 to 0.1 deg per axis; 8 to 25 views; both
/// mounts; boards of 4x5 to 8x11 points 20 to 40 mm apart; quaternions or Euler angles.
struct Draw {
  calibration::HandEyeRecording recording;
  HandEyeWorld world;
  Random random{0};
};

inline Eigen::MatrixXd pose_rows(const std::vector<Pose>& poses, const calibration::PoseFormat& format) {
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(poses.size()), calibration::to_row(poses[0], format).size());
  for (std::size_t i = 0; i < poses.size(); ++i)
    rows.row(static_cast<Eigen::Index>(i)) = calibration::to_row(poses[i], format);
  return rows;
}

inline std::vector<Pose> reported(const HandEyeWorld& w) {
  std::vector<Pose> out;
  for (const auto& v : w.views) out.push_back(v.T_base_flange);
  return out;
}

inline void set_poses(Draw& d, const std::vector<Pose>& poses) {
  d.recording.rows = pose_rows(poses, d.recording.format);
}

inline HandEyeWorldOptions draw_options(Random& random) {
  HandEyeWorldOptions o;
  o.mount = random.integer(2) ? Mount::EyeInHand : Mount::EyeToHand;
  o.views = 8 + random.integer(18);
  o.rows = 4 + random.integer(5);
  o.cols = o.rows + 1 + random.integer(3);
  o.square = random.uniform(0.02, 0.04);
  o.sigma_pixel = random.uniform(0.1, 0.5);
  o.sigma_robot_position = random.uniform(0.05e-3, 0.5e-3);
  o.sigma_robot_rotation = random.uniform(0.01, 0.1) * std::numbers::pi / 180;
  o.seed = static_cast<std::uint64_t>(random.integer(1 << 30));
  return o;
}

/// An arm that sweeps slowly past the target, photographed on the move: its poses are a smooth curve.
inline void sweep(Draw& d, const HandEyeWorldOptions& o, double interval, double lag) {
  const Eigen::Matrix3Xd points = board_points(o.rows, o.cols, o.square);
  const Eigen::Vector3d middle = points.rowwise().mean();
  Vector6 size, phase, period;
  size << 0.12, 0.09, 0.12, 0.4, 0.4, 0.5;
  const auto place_at = [&](double t) {
    Vector6 v;
    for (int k = 0; k < 6; ++k) v[k] = size[k] * std::sin(2 * std::numbers::pi * t / period[k] + phase[k]);
    return v;
  };
  // A short sweep may turn about one axis alone, which is a fault of its own.
  for (double second = 0; second < 0.07;) {
    for (int k = 0; k < 6; ++k) phase[k] = d.random.uniform(0, 6.28), period[k] = d.random.uniform(7, 14);
    Eigen::MatrixX3d turns(o.views, 3);
    for (int i = 0; i < o.views; ++i) turns.row(i) = place_at(interval * i).tail<3>();
    turns.rowwise() -= turns.colwise().mean().eval();
    second = Eigen::JacobiSVD<Eigen::MatrixXd>(turns).singularValues()[1] / std::sqrt(o.views);
  }
  const auto seen_at = [&](double t) {
    const Vector6 v = place_at(t);
    Pose T = Pose::Identity();
    T.linear() = exp_rotation(v.tail<3>());
    T.translation() = v.head<3>() + Eigen::Vector3d(0, 0, 0.65) - T.linear() * middle;
    return T;
  };
  HandEyeWorld& w = d.world;
  w.views.clear(), w.T_base_flange.clear(), d.recording.views.clear(), d.recording.times.clear();
  for (int i = 0; i < o.views; ++i) {
    const double t = interval * i;
    Vector6 e;
    e << d.random.normal_vector(3, o.sigma_robot_position), d.random.normal_vector(3, o.sigma_robot_rotation);
    const Pose T = flange_for(w, o.mount, seen_at(t - lag)) * to_pose(e).inverse();
    w.views.push_back({T, see(d.random, w.camera, points, seen_at(t), o.sigma_pixel, "view" + std::to_string(i))});
    d.recording.views.push_back(w.views.back().view);
    d.recording.times.push_back(t);
  }
}

/// `axes` the wrist turns about, `turn` [rad] it does at most; `rough`: a robot of 0.5 to 3 mm and 0.1 to 0.3 deg.
inline Draw draw_sound(std::uint64_t seed, std::optional<int> axes = {}, std::optional<double> turn = {},
                       bool rough = false) {
  Draw d;
  d.random = Random(seed);
  HandEyeWorldOptions o = draw_options(d.random);
  if (axes) o.axes = *axes;
  if (rough) {
    o.sigma_robot_position = d.random.uniform(0.5e-3, 3e-3);
    o.sigma_robot_rotation = d.random.uniform(0.1, 0.3) * std::numbers::pi / 180;
  }
  d.world = make_hand_eye_world(o);
  d.recording.camera = d.world.camera;
  d.recording.mount = o.mount;
  const calibration::RotationForm forms[] = {
      calibration::RotationForm::QuaternionXyzw, calibration::RotationForm::QuaternionWxyz,
      calibration::RotationForm::RotationVector, calibration::RotationForm::Rpy, calibration::RotationForm::KukaAbc};
  d.recording.format.rotation = forms[d.random.integer(5)];
  if (row_length(d.recording.format.rotation) == 6 && d.random.integer(2))
    d.recording.format.angle = calibration::AngleUnit::Degree;
  if (d.random.integer(2)) d.recording.format.position = calibration::LengthUnit::Millimetre;
  for (const auto& v : d.world.views) d.recording.views.push_back(v.view);
  if (turn) {  // the wrist turns a little about every axis instead
    const Pose middle = target_in_camera(d.world, o.mount, d.world.T_base_flange[0]);
    for (std::size_t i = 0; i < d.world.views.size(); ++i) {
      Pose T = middle;
      T.translation() = target_in_camera(d.world, o.mount, d.world.T_base_flange[i]).translation();
      T.linear() = middle.linear() * exp_rotation(*turn * d.random.uniform(-1, 1) * d.random.direction());
      Vector6 e;
      e << d.random.normal_vector(3, o.sigma_robot_position), d.random.normal_vector(3, o.sigma_robot_rotation);
      d.world.views[i].T_base_flange = flange_for(d.world, o.mount, T) * to_pose(e);
      d.world.views[i].view = d.recording.views[i] =
          see(d.random, d.world.camera, d.world.views[i].view.points, T, o.sigma_pixel, "view" + std::to_string(i));
    }
  } else if (d.random.integer(4) == 0 && !axes) {  // stops on a smooth path are sound, too
    sweep(d, o, d.random.uniform(0.5, 1.5), 0.0);
  }
  set_poses(d, reported(d.world));
  return d;
}

/// Faults that images cannot have, pairs of poses can.
inline bool of_pairs_only(calibration::HandEyeCause cause) {
  return cause == calibration::HandEyeCause::MirroredTarget;
}

namespace faults {

inline void invert(Draw& d) { d.recording.format.meaning = calibration::PoseMeaning::FlangeBase; }

/// Writes the poses in one rotation form and claims another.
inline void mistake(Draw& d, calibration::RotationForm written, calibration::RotationForm read) {
  d.recording.format.rotation = written;
  set_poses(d, reported(d.world));
  d.recording.format.rotation = read;
}

inline void other_form(Draw& d) {
  using calibration::RotationForm;
  mistake(d, RotationForm::Rpy, d.random.integer(2) ? RotationForm::KukaAbc : RotationForm::RotationVector);
}

inline void other_quaternion(Draw& d) {
  mistake(d, calibration::RotationForm::QuaternionXyzw, calibration::RotationForm::QuaternionWxyz);
}

inline void other_angle(Draw& d) {
  using calibration::AngleUnit, calibration::RotationForm;
  const RotationForm forms[] = {RotationForm::Rpy, RotationForm::KukaAbc, RotationForm::RotationVector};
  d.recording.format.rotation = forms[d.random.integer(3)];
  const bool degrees = d.random.integer(4) > 0;
  d.recording.format.angle = degrees ? AngleUnit::Degree : AngleUnit::Radian;
  set_poses(d, reported(d.world));
  d.recording.format.angle = degrees ? AngleUnit::Radian : AngleUnit::Degree;
}

inline void other_length(Draw& d) {
  if (d.random.integer(3) == 0) {
    for (View& v : d.recording.views) v.points *= 1000;
    return;
  }
  d.recording.format.position = calibration::LengthUnit::Millimetre;
  set_poses(d, reported(d.world));
  d.recording.format.position = calibration::LengthUnit::Metre;
}

inline void resize_target(Draw& d) {
  const double factor = 1 + (d.random.integer(2) ? 1 : -1) * d.random.uniform(0.03, 0.2);
  for (View& v : d.recording.views) v.points *= factor;
}

inline void mix_order(Draw& d) {
  const std::vector<Pose> poses = reported(d.world);
  const int n = static_cast<int>(poses.size());
  std::vector<int> order(poses.size());
  std::iota(order.begin(), order.end(), 0);
  if (d.random.integer(3) == 0) {  // sorted as text: 0, 1, 10, 11, 2
    if (n > 10)
      std::sort(order.begin(), order.end(), [](int a, int b) { return std::to_string(a) < std::to_string(b); });
    else
      std::reverse(order.begin(), order.end());
  } else {
    std::vector<int> some = order;
    std::shuffle(some.begin(), some.end(), d.random.engine());
    some.resize(static_cast<std::size_t>(2 + d.random.integer(n - 1)));
    for (std::size_t k = 0; k + 1 < some.size(); ++k) std::swap(order[some[k]], order[some[k + 1]]);
  }
  std::vector<Pose> mixed;
  for (const int k : order) mixed.push_back(poses[static_cast<std::size_t>(k)]);
  set_poses(d, mixed);
}

inline void shift(Draw& d) {
  std::vector<Pose> poses = reported(d.world);
  const bool later = d.random.integer(2);
  std::rotate(poses.begin(), later ? poses.begin() + 1 : poses.end() - 1, poses.end());
  (later ? poses.back() : poses.front()) =
      (later ? poses[poses.size() - 2] : poses[1]) *
      to_pose((Vector6() << d.random.normal_vector(3, 0.1), d.random.normal_vector(3, 0.2)).finished());
  set_poses(d, poses);
}

inline void move_target(Draw& d) {
  std::vector<Pose> poses = reported(d.world);
  const int n = static_cast<int>(poses.size()), split = 3 + d.random.integer(n - 5);
  Vector6 by;
  by << d.random.uniform(0.003, 0.03) * d.random.direction(),
      d.random.uniform(1, 10) * std::numbers::pi / 180 * d.random.direction();
  // The same images come about when the robot stands elsewhere.
  HandEyeWorld after = d.world;
  after.T_fixed_target = d.world.T_fixed_target * to_pose(by);
  for (std::size_t i = static_cast<std::size_t>(split); i < poses.size(); ++i)
    poses[i] = flange_for(after, d.recording.mount, target_in_camera(d.world, d.recording.mount, poses[i]));
  set_poses(d, poses);
}

inline void delay(Draw& d, std::uint64_t seed) {
  Random again(seed);
  const HandEyeWorldOptions o = draw_options(again);
  sweep(d, o, d.random.uniform(0.5, 1.2), (d.random.integer(2) ? 1 : -1) * d.random.uniform(0.02, 0.2));
  set_poses(d, reported(d.world));
}

inline void change_camera(Draw& d) {
  Pinhole& camera = d.recording.camera;
  if (d.random.integer(3) == 0) {
    camera.k1 = camera.k2 = camera.p1 = camera.p2 = 0;
    return;
  }
  const double factor = 1 + (d.random.integer(2) ? 1 : -1) * d.random.uniform(0.02, 0.1);
  camera.fx *= factor, camera.fy *= factor;
}

inline void spoil_views(Draw& d) {
  std::vector<Pose> poses = reported(d.world);
  std::vector<std::size_t> which(poses.size());
  std::iota(which.begin(), which.end(), 0);
  std::shuffle(which.begin(), which.end(), d.random.engine());
  which.resize(static_cast<std::size_t>(1 + d.random.integer(std::max(static_cast<int>(poses.size()) / 5, 1))));
  for (const std::size_t k : which) {
    Vector6 by;
    by << d.random.uniform(0.005, 0.03) * d.random.direction(),
        d.random.uniform(1, 5) * std::numbers::pi / 180 * d.random.direction();
    poses[k] = poses[k] * to_pose(by);
  }
  set_poses(d, poses);
}

}  // namespace faults

/// Spoils a recording. Sizes: target off by 3 to 20 %; moved by 3 to 30 mm and 1 to 10 deg; focal length off by 2 to
/// 10 % or lens distortion left away; lag 20 to 200 ms at 50 to 150 mm/s; 1 to a fifth of the views off by 5 to 30 mm
/// and 1 to 5 deg; two to all poses exchanged; turns of at most 4 deg, or about one axis.
inline Draw draw_fault(calibration::HandEyeCause cause, std::uint64_t seed) {
  using enum calibration::HandEyeCause;
  if (cause == TooLittleRotation)
    return draw_sound(seed, {}, Random(seed + 7).uniform(0.2, 4.0) * std::numbers::pi / 180);
  if (cause == OneAxisRotation) return draw_sound(seed, 1);
  Draw d = draw_sound(seed);
  if (cause == ClockOffset) {
    faults::delay(d, seed);
    return d;
  }
  static const std::map<calibration::HandEyeCause, void (*)(Draw&)> table = {
      {PosesInverted, faults::invert},
      {WrongRotationForm, faults::other_form},
      {QuaternionOrder, faults::other_quaternion},
      {DegreesForRadians, faults::other_angle},
      {MillimetresForMetres, faults::other_length},
      {TargetSizeWrong, faults::resize_target},
      {OutOfOrder, faults::mix_order},
      {ShiftedByOne, faults::shift},
      {TargetMoved, faults::move_target},
      {CameraModelWrong, faults::change_camera},
      {OutlierViews, faults::spoil_views},
  };
  table.at(cause)(d);
  return d;
}

}  // namespace kr5::test
