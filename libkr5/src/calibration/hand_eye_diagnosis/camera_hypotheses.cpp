// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/hand_eye_diagnosis/camera_hypotheses.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Dense>

#include "calibration/hand_eye/model.hpp"
#include "calibration/hand_eye_diagnosis/left_out.hpp"

/// @file
/// The camera hypothesis: some intrinsic parameters are free, fitted over all pixels together with the poses.

namespace kr5::calibration::evidence {
namespace {

/// Directions in the twelve camera parameters that are freed, one a column.
using Directions = Eigen::Matrix<double, Pinhole::parameter_count, Eigen::Dynamic>;

Directions focal(const Pinhole& camera) {
  Directions D = Directions::Zero(Pinhole::parameter_count, 1);
  D(0, 0) = camera.fx, D(1, 0) = camera.fy;
  return D;
}

/// The first `count` of fx fy cx cy k1 k2 p1 p2 k3.
Directions first(const Pinhole& camera, int count) {
  Directions D = Directions::Identity(Pinhole::parameter_count, count);
  D.topRows<4>() *= camera.fx;  // unit steps of like size
  return D;
}

/// Gauss-Newton over camera, X, Y and the pose of the target in every view, the latter eliminated view by view.
class CameraFitter {
 public:
  CameraFitter(const Case& c, const Directions& directions, const SetupHypothesis& from)
      : case_(c), D_(directions), camera_(c.recording.camera), X_(from.fit.X), Y_(from.fit.Y) {
    weight_ << Eigen::Vector3d::Constant(1 / (from.fit.sigma_position * from.fit.sigma_position)),
        Eigen::Vector3d::Constant(1 / (from.fit.sigma_rotation * from.fit.sigma_rotation));
    for (const Sighting& s : c.sightings.views) poses_.push_back(s.solutions.front().T_camera_target);
  }

  /// The camera, or nothing when the fit runs away.
  std::optional<Pinhole> run() {
    for (int k = 0; k < 8; ++k)
      if (!step()) return std::nullopt;
    return camera_;
  }

 private:
  struct Block {
    Matrix6 H;
    Eigen::MatrixXd across;  ///< 6 x (camera, X, Y)
    Vector6 g;
  };

  void add_pixels(std::size_t i, Block& b, Eigen::MatrixXd& H, Eigen::VectorXd& g) const {
    const View& view = case_.recording.views[static_cast<std::size_t>(case_.sightings.index[i])];
    const double w = 1 / (case_.sightings.sigma_pixel * case_.sightings.sigma_pixel);
    const Eigen::Index k = D_.cols();
    for (Eigen::Index p = 0; p < view.points.cols(); ++p) {
      Eigen::Matrix<double, 2, 3> by_point;
      Eigen::Matrix<double, 2, Pinhole::parameter_count> by_camera;
      const Eigen::Vector3d x = view.points.col(p);
      const Eigen::Vector2d e = view.pixels.col(p) - camera_.project(poses_[i] * x, &by_point, &by_camera);
      Eigen::Matrix<double, 2, 6> J;
      J.leftCols<3>() = by_point * poses_[i].linear();
      J.rightCols<3>() = -J.leftCols<3>() * skew(x);
      const Eigen::Matrix<double, 2, Eigen::Dynamic> K = by_camera * D_;
      b.H += w * J.transpose() * J;
      b.g += w * J.transpose() * e;
      b.across.leftCols(k) += w * J.transpose() * K;
      H.topLeftCorner(k, k) += w * K.transpose() * K;
      g.head(k) += w * K.transpose() * e;
    }
  }

  void add_robot(std::size_t i, Block& b, Eigen::MatrixXd& H, Eigen::VectorXd& g) const {
    const Mount mount = case_.recording.mount;
    const Vector6 r = hand_eye::robot_residual(mount, {X_, Y_}, case_.sound.reading.robot[i], poses_[i]);
    const auto by = hand_eye::robot_derivatives(mount, {X_, Y_}, poses_[i], r);
    const Matrix6& B = by.by_target_seen;
    Eigen::Matrix<double, 6, 12> J;
    J << by.by_X, by.by_Z;
    const auto W = weight_.asDiagonal();
    b.H += B.transpose() * W * B;
    b.g -= B.transpose() * (W * r);
    b.across.rightCols<12>() += B.transpose() * W * J;
    H.bottomRightCorner<12, 12>() += J.transpose() * W * J;
    g.tail<12>() -= J.transpose() * (W * r);
  }

  bool step() {
    const Eigen::Index n = D_.cols() + 12;
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(n);
    std::vector<Block> blocks(poses_.size());
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      Block& b = blocks[i];
      b.H.setZero(), b.g.setZero(), b.across.setZero(6, n);
      add_pixels(i, b, H, g);
      add_robot(i, b, H, g);
      const Eigen::MatrixXd solved = b.H.ldlt().solve(b.across);
      H -= b.across.transpose() * solved;
      g -= solved.transpose() * b.g;
    }
    H.diagonal() *= 1 + 1e-9;
    const Eigen::VectorXd d = H.ldlt().solve(g);
    if (!d.allFinite()) return false;
    for (std::size_t i = 0; i < poses_.size(); ++i)
      poses_[i] = poses_[i] * to_pose(blocks[i].H.ldlt().solve(blocks[i].g - blocks[i].across * d));
    camera_.set_parameters(camera_.parameters() + D_ * d.head(D_.cols()));
    X_ = X_ * to_pose(d.segment<6>(D_.cols()));
    Y_ = Y_ * to_pose(d.tail<6>());
    return camera_.fx > 0 && camera_.fy > 0;
  }

  const Case& case_;
  Directions D_;
  Pinhole camera_;
  Pose X_, Y_;
  Vector6 weight_;
  std::vector<Pose> poses_;
};

/// The hypothesis with these directions freed, or nothing when it cannot be fitted.
std::optional<SetupHypothesis> with_freed(const Case& c, const Directions& freed) {
  SetupHypothesis h = c.sound;
  // Twice: with the right camera the robot turns out less noisy, and then says more about the camera.
  for (int round = 0; round < 2; ++round) {
    const auto found = CameraFitter(c, freed, h).run();
    if (!found) break;
    const Sightings again = find_sightings(c.recording.views, *found);
    if (again.index != c.sightings.index) break;
    const ReadingFit refit = fit_reading(h.reading, again);
    if (!refit.usable) break;
    h.fit = refit;
    h.camera = *found;
    h.score = refit.score + again.score() - c.sightings.score();
    h.freedom = static_cast<int>(freed.cols());
    h.value = h.camera.fx / c.recording.camera.fx;
    h.causes = {HandEyeCause::CameraModelWrong};
  }
  if (h.causes.empty()) return std::nullopt;
  return h;
}

std::vector<Directions> kinds(const Pinhole& camera) {
  return {focal(camera), first(camera, 4), first(camera, 6), first(camera, 9)};
}

/// The recording without every `folds`-th view, from `fold` on.
HandEyeRecording without(const HandEyeRecording& all, int folds, int fold) {
  HandEyeRecording out = all;
  out.views.clear(), out.times.clear();
  for (std::size_t i = 0; i < all.views.size(); ++i) {
    if (static_cast<int>(i) % folds == fold) continue;
    out.rows.row(static_cast<Eigen::Index>(out.views.size())) = all.rows.row(static_cast<Eigen::Index>(i));
    out.views.push_back(all.views[i]);
  }
  out.rows.conservativeResize(static_cast<Eigen::Index>(out.views.size()), Eigen::NoChange);
  return out;
}

}  // namespace

std::vector<SetupHypothesis> other_camera(const Case& c) {
  std::vector<SetupHypothesis> out;
  for (const Directions& freed : kinds(c.recording.camera))
    if (auto h = with_freed(c, freed)) out.push_back(std::move(*h));
  return out;
}

double held_out_with_camera(const Case& c, int freedom, int folds) {
  const auto all = kinds(c.recording.camera);
  const auto freed = std::find_if(all.begin(), all.end(), [&](const auto& D) { return D.cols() == freedom; });
  folds = std::min(folds, static_cast<int>(c.recording.views.size()));
  double sum = 0;
  int count = 0;
  for (int fold = 0; fold < folds; ++fold) {
    const HandEyeRecording kept = without(c.recording, folds, fold);
    Case part{kept, find_sightings(kept.views, kept.camera), to_poses(kept.rows, kept.format), {}};
    part.sound.reading = as_recorded(part, part.poses);
    part.sound.fit = fit_reading(part.sound.reading, part.sightings);
    part.sound.score = part.sound.fit.score;
    if (!part.sound.fit.usable) continue;
    const auto h = with_freed(part, *freed);
    if (!h) return std::numeric_limits<double>::infinity();  // what so few views less undo is no finding
    const Sightings seen = find_sightings(c.recording.views, h->camera);
    for (std::size_t k = 0; k < seen.index.size(); ++k) {
      if (seen.index[k] % folds != fold) continue;
      sum += squared_point_error(c.poses[static_cast<std::size_t>(seen.index[k])], seen.views[k], h->fit,
                                 c.recording.mount);
      ++count;
    }
  }
  return count ? std::sqrt(sum / count) : std::numeric_limits<double>::infinity();
}

}  // namespace kr5::calibration::evidence
