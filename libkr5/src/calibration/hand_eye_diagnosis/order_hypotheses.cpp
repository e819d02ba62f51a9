// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/hand_eye_diagnosis/order_hypotheses.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <kr5/core/random.hpp>

#include "calibration/best_assignment.hpp"
#include "calibration/hand_eye/closed_form.hpp"
#include "calibration/hand_eye/model.hpp"

/// @file
/// Which pose belongs to which image. Turning from one stop to another, the wrist and the target (as the camera sees
/// it) turn by the same angle wherever the camera sits: three stops whose angles agree give a first calibration, which
/// says for every pose which image fits.

namespace kr5::calibration::evidence {
namespace {

using Order = std::vector<int>;  ///< Sighting of each pose.

double turn(const Pose& a, const Pose& b) { return log_rotation(a.linear().transpose() * b.linear()).norm(); }

class OrderSearch {
 public:
  OrderSearch(const Case& c, int seed)
      : mount_(c.recording.mount), robot_(c.sound.reading.robot), random_(static_cast<std::uint64_t>(seed)) {
    for (const int k : c.sound.reading.sighting)
      seen_.push_back(c.sightings.views[static_cast<std::size_t>(k)].solutions.front().T_camera_target);
    const auto n = static_cast<Eigen::Index>(robot_.size());
    robot_turns_.resize(n, n);
    seen_turns_.resize(n, n);
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = 0; j < n; ++j) {
        robot_turns_(i, j) = turn(robot_[static_cast<std::size_t>(i)], robot_[static_cast<std::size_t>(j)]);
        // The target's turn between two images is that of the wrist, seen from the camera.
        const Eigen::Matrix3d R =
            seen_[static_cast<std::size_t>(i)].linear() * seen_[static_cast<std::size_t>(j)].linear().transpose();
        seen_turns_(i, j) = log_rotation(R).norm();
      }
  }

  /// The best order found, and the one that follows from the recorded order.
  Order run() {
    Order recorded(robot_.size());
    std::iota(recorded.begin(), recorded.end(), 0);
    settle(closed_form(robot_, seen_, mount_));
    for (int trial = 0; trial < 400 && best_fitting_ * 5 < size() * 4; ++trial)
      if (const auto order = random_triple(); !order.empty()) settle(closed_form_of(order));
    return best_.empty() ? recorded : best_;
  }

 private:
  int size() const { return static_cast<int>(robot_.size()); }

  /// Three poses and three images whose turns agree to a degree: order, -1 where nothing is said.
  Order random_triple() {
    const double tolerance = 0.02;
    int p[3];
    for (int k = 0; k < 3; ++k) p[k] = random_.integer(size());
    if (p[0] == p[1] || p[1] == p[2] || p[0] == p[2] || robot_turns_(p[0], p[1]) < 0.15) return {};
    std::vector<std::array<int, 3>> fits;
    for (int a = 0; a < size(); ++a)
      for (int b = 0; b < size(); ++b) {
        if (a == b || std::abs(seen_turns_(a, b) - robot_turns_(p[0], p[1])) > tolerance) continue;
        for (int d = 0; d < size(); ++d)
          if (d != a && d != b && std::abs(seen_turns_(a, d) - robot_turns_(p[0], p[2])) < tolerance &&
              std::abs(seen_turns_(b, d) - robot_turns_(p[1], p[2])) < tolerance)
            fits.push_back({a, b, d});
      }
    if (fits.empty()) return {};
    const auto& chosen = fits[static_cast<std::size_t>(random_.integer(static_cast<int>(fits.size())))];
    Order order(robot_.size(), -1);
    for (int k = 0; k < 3; ++k) order[static_cast<std::size_t>(p[k])] = chosen[static_cast<std::size_t>(k)];
    return order;
  }

  ClosedForm closed_form_of(const Order& order) const {
    std::vector<Pose> robot, seen;
    for (std::size_t i = 0; i < order.size(); ++i)
      if (order[i] >= 0) robot.push_back(robot_[i]), seen.push_back(seen_[static_cast<std::size_t>(order[i])]);
    return closed_form(robot, seen, mount_);
  }

  /// Matches, refits what matches well, and matches again, ever more narrowly.
  void settle(ClosedForm c) {
    Order order;
    double total = 0;
    int fitting = 0;
    for (const double width : {0.10, 0.03, 0.01, 0.01}) {
      const auto n = size();
      Eigen::MatrixXd cost(n, n);
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          const Vector6 r = hand_eye::robot_residual(mount_, {c.X, c.Z}, robot_[static_cast<std::size_t>(i)],
                                                     seen_[static_cast<std::size_t>(j)]);
          cost(i, j) = std::log1p(r.squaredNorm() / (width * width));  // one bad pair shall not decide
        }
      order = best_assignment(cost);
      total = 0;
      Order good = order;
      fitting = 0;
      for (int i = 0; i < n; ++i) {
        const double pair = cost(i, order[static_cast<std::size_t>(i)]);
        total += pair;
        if (pair > std::log1p(9.0))
          good[static_cast<std::size_t>(i)] = -1;
        else
          ++fitting;
      }
      if (fitting < 4) return;
      c = closed_form_of(good);
    }
    if (total < best_cost_) best_cost_ = total, best_ = order, best_fitting_ = fitting;
  }

  Mount mount_;
  std::vector<Pose> robot_, seen_;
  Eigen::MatrixXd robot_turns_, seen_turns_;
  Random random_;
  Order best_;
  int best_fitting_ = 0;  ///< Pairs of it that agree to centimetres; when most do, the search is over.
  double best_cost_ = std::numeric_limits<double>::infinity();
};

}  // namespace

std::vector<SetupHypothesis> reordered_readings(const Case& c, int seed) {
  const int n = c.sound.reading.size();
  const Order order = OrderSearch(c, seed).run();
  SetupHypothesis h;
  h.reading = c.sound.reading;
  h.reading.sighting = order;
  for (int i = 0; i < n; ++i)
    if (order[static_cast<std::size_t>(i)] != i) h.views.push_back(c.sightings.index[static_cast<std::size_t>(i)]);
  if (h.views.empty()) return {};
  h.fit = fit_reading(h.reading, c.sightings);
  if (!h.fit.usable) return {};
  const auto m = static_cast<double>(h.views.size());
  h.score = h.fit.score;
  h.choices = std::lgamma(n + 1.0) - std::lgamma(n - m + 1.0);  // which views, and their order among themselves
  h.causes = {HandEyeCause::OutOfOrder};
  h.value = m;
  return {h};
}

}  // namespace kr5::calibration::evidence
