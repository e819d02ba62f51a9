// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/hand_eye/start.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <sstream>

#include <Eigen/Dense>
#include <kr5/core/linear.hpp>
#include <kr5/core/random.hpp>
#include <kr5/core/statistics.hpp>

#include "calibration/hand_eye/closed_form.hpp"

namespace kr5::calibration::hand_eye {
namespace {

constexpr int random_subsets = 60;
constexpr double trusted_share = 0.6;  // part of the views that must agree
// A second pose of a plane whose pixel error is this many times the first's cannot be the right one.
constexpr double hopeless_share = 25.0;

bool hopeful(const ObservedView& observed, const Resection& other) {
  return other.cost <=
         hopeless_share * std::max(observed.found.front().cost, 1e-6 * static_cast<double>(other.weights.size()));
}

double square(const Vector6& e, double lever) {
  return e.head<3>().squaredNorm() / (lever * lever) + e.tail<3>().squaredNorm();
}

Poses closed_form_of(Mount mount, const std::vector<ObservedView>& observed_views, std::span<const int> subset) {
  std::vector<Pose> T, M;
  for (const int i : subset) {
    T.push_back(observed_views[i].input->T_base_flange);
    M.push_back(observed_views[i].pose().T_camera_points);
  }
  const ClosedForm form = closed_form(T, M, mount);
  return {form.X, form.Z};
}

/// Squared disagreements of all views, and the views from best to worst.
struct Ranking {
  std::vector<int> order;
  double trimmed = std::numeric_limits<double>::infinity();
};

Ranking rank(Mount mount, const Poses& poses, const std::vector<ObservedView>& observed_views, double lever,
             std::size_t trusted) {
  std::vector<double> squares(observed_views.size());
  for (std::size_t i = 0; i < observed_views.size(); ++i)
    squares[i] = square(robot_error(mount, poses, observed_views[i]), lever);
  Ranking out;
  out.order.resize(observed_views.size());
  std::iota(out.order.begin(), out.order.end(), 0);
  std::stable_sort(out.order.begin(), out.order.end(), [&](int a, int b) { return squares[a] < squares[b]; });
  out.trimmed = 0;
  for (std::size_t k = 0; k < trusted; ++k) out.trimmed += squares[out.order[k]];
  return out;
}

}  // namespace

WristTurn wrist_turn(std::span<const Pose> T_base_flange) {
  std::vector<Eigen::Vector3d> turns;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < T_base_flange.size(); ++i)
    for (std::size_t j = i + 1; j < T_base_flange.size(); ++j) {
      turns.push_back(log_rotation(T_base_flange[i].linear().transpose() * T_base_flange[j].linear()));
      scatter += turns.back() * turns.back().transpose();
    }
  const Eigen::Vector3d main = symmetric_eigen(scatter).vectors.col(2);
  WristTurn out;
  for (const Eigen::Vector3d& w : turns) {
    out.most = std::max(out.most, w.norm());
    out.second = std::max(out.second, (w - w.dot(main) * main).norm());
  }
  return out;
}

std::string turn_shortage(std::span<const Pose> T_base_flange, double min_rotation) {
  const WristTurn turn = wrist_turn(T_base_flange);
  const double degrees = 180 / std::numbers::pi;
  std::ostringstream text;
  text.precision(2);
  text << std::fixed;
  if (turn.most < min_rotation)
    text << "the wrist turned by at most " << turn.most * degrees << " deg between views; at least "
         << min_rotation * degrees << " deg about two axes is needed";
  else if (turn.second < min_rotation)
    text << "the wrist turned about one axis only: " << turn.most * degrees << " deg about it, but at most "
         << turn.second * degrees << " deg about another; at least " << min_rotation * degrees
         << " deg about two axes is needed";
  return text.str();
}

double usual_reach(std::span<const HandEyeView> views) {
  std::vector<double> distance;
  for (const HandEyeView& v : views) distance.push_back(v.T_base_flange.translation().norm());
  const double reach = median(distance);
  return reach > 1e-6 ? reach : 1.0;
}

Pose fixed_target(Mount mount, const Pose& T_mount_camera, std::span<const ObservedView> observed_views) {
  std::vector<Pose> candidates;
  for (const ObservedView& observed : observed_views) {
    const Pose& T = observed.input->T_base_flange;
    candidates.push_back((mount == Mount::EyeInHand ? T : Pose(T.inverse())) * T_mount_camera *
                         observed.pose().T_camera_points);
  }
  const auto far = [&](const Pose& from) {
    double sum = 0;
    for (const Pose& to : candidates) sum += pose_difference(from, to).norm();
    return sum;
  };
  return *std::min_element(candidates.begin(), candidates.end(),
                           [&](const Pose& a, const Pose& b) { return far(a) < far(b); });
}

Vector6 robot_error(Mount mount, const Poses& poses, const ObservedView& observed) {
  return robot_residual(mount, poses, observed.input->T_base_flange, observed.pose().T_camera_points);
}

void choose_poses(Mount mount, const Poses& poses, std::vector<ObservedView>& observed_views, double lever) {
  for (ObservedView& observed : observed_views) {
    double best = std::numeric_limits<double>::infinity();
    int choice = 0;
    for (std::size_t k = 0; k < observed.found.size(); ++k) {
      if (k > 0 && !hopeful(observed, observed.found[k])) continue;
      observed.chosen = static_cast<int>(k);
      const double s = square(robot_error(mount, poses, observed), lever);
      if (s < best) best = s, choice = static_cast<int>(k);
    }
    observed.chosen = choice;
  }
}

Poses robust_start(Mount mount, std::vector<ObservedView>& observed_views, double lever) {
  const int n = static_cast<int>(observed_views.size());
  const std::size_t trusted = std::max<std::size_t>(3, static_cast<std::size_t>(std::ceil(trusted_share * n)));
  std::vector<int> all(n);
  std::iota(all.begin(), all.end(), 0);
  Random random(20221);  // the subsets are part of the method: the same data give the same answer
  Poses best;
  double best_trimmed = std::numeric_limits<double>::infinity();
  std::vector<ObservedView> best_sights = observed_views;
  for (int draw = 0; draw <= random_subsets; ++draw) {
    std::vector<int> subset = all;
    for (ObservedView& observed : observed_views) observed.chosen = 0;
    if (draw > 0) {
      std::shuffle(subset.begin(), subset.end(), random.engine());
      subset.resize(std::min(n, 3 + draw % 2));
      for (const int i : subset)
        if (observed_views[i].found.size() > 1 && hopeful(observed_views[i], observed_views[i].found[1]))
          observed_views[i].chosen = random.integer(2);
    }
    Poses poses = closed_form_of(mount, observed_views, subset);
    for (int settle = 0; settle < 3; ++settle) {
      choose_poses(mount, poses, observed_views, lever);
      const Ranking ranking = rank(mount, poses, observed_views, lever, trusted);
      if (ranking.trimmed < best_trimmed) best_trimmed = ranking.trimmed, best = poses, best_sights = observed_views;
      poses = closed_form_of(mount, observed_views, std::span(ranking.order).first(trusted));
    }
  }
  observed_views = best_sights;
  return best;
}

}  // namespace kr5::calibration::hand_eye
