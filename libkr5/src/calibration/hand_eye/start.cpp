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

constexpr int random_subsets = 60, settling_rounds = 3;
constexpr std::size_t most_starts = 4;
constexpr double rival_share = 100.0;  // squared disagreement over the best up to which another start is looked at
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

/// Keeps where a subset ended, of several at the same place the best.
void keep_end(const RobustStart& end, const std::vector<ObservedView>& observed_views, double lever,
              std::vector<RobustStart>& ends) {
  const auto same = [&](const RobustStart& other) { return same_poses(other.poses, end.poses, lever); };
  const auto at = std::find_if(ends.begin(), ends.end(), same);
  if (at != ends.end() && at->trimmed <= end.trimmed) return;
  const RobustStart kept{end.poses, chosen_of(observed_views), end.trimmed};
  if (at == ends.end())
    ends.push_back(kept);
  else
    *at = kept;
}

/// The best, and those that end elsewhere and are not much worse.
std::vector<RobustStart> ordered(const RobustStart& best, std::vector<RobustStart> ends, double lever) {
  std::stable_sort(ends.begin(), ends.end(),
                   [](const RobustStart& a, const RobustStart& b) { return a.trimmed < b.trimmed; });
  std::vector<RobustStart> out = {best};
  for (const RobustStart& end : ends)
    if (out.size() < most_starts && end.trimmed < rival_share * best.trimmed &&
        !same_poses(best.poses, end.poses, lever))
      out.push_back(end);
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

std::vector<int> chosen_of(const std::vector<ObservedView>& observed_views) {
  std::vector<int> out;
  for (const ObservedView& observed : observed_views) out.push_back(observed.chosen);
  return out;
}

bool same_poses(const Poses& one, const Poses& other, double lever) {
  constexpr double near = 0.05;  // [rad], and of the lever
  const auto close = [&](const Pose& a, const Pose& b) {
    const Vector6 d = pose_difference(a, b);
    return d.head<3>().norm() < near * lever && d.tail<3>().norm() < near;
  };
  return close(one.X, other.X) && close(one.Z, other.Z);
}

std::vector<RobustStart> robust_starts(Mount mount, std::vector<ObservedView> observed_views, double lever) {
  const int n = static_cast<int>(observed_views.size());
  const std::size_t trusted = std::max<std::size_t>(3, static_cast<std::size_t>(std::ceil(trusted_share * n)));
  std::vector<int> all(n);
  std::iota(all.begin(), all.end(), 0);
  Random random(20221);  // the subsets are part of the method: the same data give the same answer
  RobustStart best{.poses = {}, .chosen = {}, .trimmed = std::numeric_limits<double>::infinity()};
  std::vector<RobustStart> ends;
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
    RobustStart at{.poses = closed_form_of(mount, observed_views, subset), .chosen = {}, .trimmed = 0.0};
    for (int settle = 0; settle < settling_rounds; ++settle) {
      choose_poses(mount, at.poses, observed_views, lever);
      const Ranking ranking = rank(mount, at.poses, observed_views, lever, trusted);
      at.trimmed = ranking.trimmed;
      if (at.trimmed < best.trimmed) best = {at.poses, chosen_of(observed_views), at.trimmed};
      if (settle + 1 == settling_rounds) keep_end(at, observed_views, lever, ends);
      at.poses = closed_form_of(mount, observed_views, std::span(ranking.order).first(trusted));
    }
  }
  return ordered(best, ends, lever);
}

}  // namespace kr5::calibration::hand_eye
