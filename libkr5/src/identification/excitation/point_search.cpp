// SPDX-License-Identifier: BSD-3-Clause
#include "identification/excitation/point_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <kr5/core/random.hpp>

#include "identification/excitation/point_profile.hpp"

namespace kr5::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double looked_at_interval = 0.04;  // of what a stroke tells [s]

/// A way from one point to the next.
struct Stroke {
  double time = 0.0;
  double speed_override = 1.0;
  bool slowed = false;  ///< Because of torques.
  Index samples = 0;
  MatrixXd information = {};
};

/// Points with the strokes between them; the last point is the first.
struct Tour {
  std::vector<VectorXd> points;
  std::vector<Stroke> strokes;  ///< Stroke k leads from point k to the next.

  double duration() const {
    double out = 0.0;
    for (const Stroke& s : strokes) out += s.time;
    return out;
  }
  MatrixXd mean_information() const {
    MatrixXd out = strokes.front().information;
    Index samples = strokes.front().samples;
    for (std::size_t k = 1; k < strokes.size(); ++k) out += strokes[k].information, samples += strokes[k].samples;
    return out / static_cast<double>(samples);
  }
};

/// Makes strokes and tours within the limits of the joints.
class TourSource {
 public:
  TourSource(ExcitationProblem& problem, const ExcitationOptions& options, Random& random)
      : problem_(problem), options_(options), random_(random) {}

  double speed_override() { return random_.uniform(options_.min_override, 1.0); }

  ExcitationMotion motion(const VectorXd& from, const VectorXd& to, double time) const {
    ExcitationMotion out{.kind = ExcitationKind::PointToPoint, .profile = options_.profile};
    out.points.resize(2, from.size());
    out.points << from.transpose(), to.transpose();
    out.times = Eigen::Vector2d(0.0, time);
    return out;
  }

  /// All joints start and end together, so the slowest sets the time.
  double time(const VectorXd& from, const VectorXd& to, double override) const {
    const VectorXd way = (to - from).cwiseAbs();
    const double by_speed = max_speed(options_.profile) * way.cwiseQuotient(problem_.limits().speed).maxCoeff();
    const double by_acceleration =
        std::sqrt(max_acceleration(options_.profile) * way.cwiseQuotient(problem_.limits().acceleration).maxCoeff());
    return std::max({by_speed / override, by_acceleration / override, 0.02});
  }

  /// The time of least length of which the torques are not too great: those of inertia fall with its square. When
  /// weight and friction alone are too great, the time is as it was.
  double slowed_time(const VectorXd& from, const VectorXd& to, double override) const {
    constexpr double factor = 1.15, max_factor = 10.0;
    const double first = time(from, to, override);
    if (problem_.limits().torque.size() == 0) return first;
    for (double t = first; t <= max_factor * first; t *= factor)
      if (problem_.torque_objection(motion(from, to, t).sampled(considered_interval)).empty()) return t;
    return first;
  }

  Stroke stroke(const VectorXd& from, const VectorXd& to, double override) {
    Stroke out{.time = slowed_time(from, to, override), .speed_override = override};
    out.slowed = out.time > time(from, to, override);
    const JointMotion states = motion(from, to, out.time).sampled(looked_at_interval);
    out.samples = states.samples();
    out.information = problem_.information(states);
    return out;
  }

  /// A point to which the arm may go; nearer ones after each that it may not.
  VectorXd reachable_point(const VectorXd& from, double override) {
    constexpr int tries = 40;
    VectorXd to;
    double part = 1.0;
    for (int k = 0; k < tries; ++k, part *= 0.9) {
      to = from + part * (problem_.clear_posture(random_) - from);
      const double slowed = slowed_time(from, to, override);
      if (problem_.objection(motion(from, to, slowed).sampled(considered_interval)).empty()) break;
    }
    return to;
  }

  /// Random points up to the duration, and back. The first is the start, if there is one.
  Tour tour() {
    Tour out;
    out.points.push_back(options_.start.size() > 0 ? VectorXd(options_.start) : problem_.clear_posture(random_));
    double total = 0.0;
    while (true) {
      const double override = speed_override();
      const VectorXd next = reachable_point(out.points.back(), override);
      const Stroke there = stroke(out.points.back(), next, override);
      if (total + there.time + slowed_time(next, out.points.front(), 1.0) > options_.duration) break;
      out.strokes.push_back(there);
      out.points.push_back(next);
      total += there.time;
    }
    if (out.points.size() > 1) {
      out.strokes.push_back(stroke(out.points.back(), out.points.front(), 1.0));
      out.points.push_back(out.points.front());
    }
    return out;
  }

  /// With another point at place `k`, and its strokes.
  Tour exchanged(const Tour& from, std::size_t k) {
    Tour out = from;
    const bool near = random_.integer(2) == 0;
    const MotionLimits& l = problem_.limits();
    VectorXd next = problem_.clear_posture(random_);
    if (near) next = from.points[k] + random_.uniform(0.05, 0.4) * (next - problem_.clear_posture(random_));
    out.points[k] = next.cwiseMax(l.lower).cwiseMin(l.upper);
    if (k == 0) out.points.back() = out.points.front();
    const std::size_t before = k == 0 ? out.strokes.size() - 1 : k - 1;
    for (const std::size_t s : {before, k}) {
      const double override = random_.integer(3) == 0 ? speed_override() : from.strokes[s].speed_override;
      out.strokes[s] = stroke(out.points[s], out.points[s + 1], override);
    }
    return out;
  }

  ExcitationMotion motion(const Tour& tour) const {
    ExcitationMotion out{.kind = ExcitationKind::PointToPoint, .profile = options_.profile};
    out.points.resize(static_cast<Index>(tour.points.size()), problem_.joints());
    out.times = VectorXd::Zero(out.points.rows());
    for (Index k = 0; k < out.points.rows(); ++k) {
      out.points.row(k) = tour.points[static_cast<std::size_t>(k)].transpose();
      if (k > 0) out.times[k] = out.times[k - 1] + tour.strokes[static_cast<std::size_t>(k - 1)].time;
    }
    return out;
  }

 private:
  ExcitationProblem& problem_;
  const ExcitationOptions& options_;
  Random& random_;
};

}  // namespace

ExcitationSearch search_points(ExcitationProblem& problem, const ExcitationOptions& options) {
  Random random(options.seed);
  TourSource source(problem, options, random);
  ExcitationSearch out;
  out.objection = "the duration: too short for two strokes";
  Tour best_tour;
  double best = std::numeric_limits<double>::infinity();
  const auto consider = [&](Tour tour) {
    if (tour.strokes.size() < 2 || tour.duration() > options.duration) return false;
    const MatrixXd mean = tour.mean_information();
    const double value = problem.value(mean);
    if (!(value < best)) return false;
    std::string objection = problem.objection(source.motion(tour).sampled(considered_interval));
    if (!objection.empty()) {
      if (!std::isfinite(best)) out.objection = std::move(objection);
      return false;
    }
    best = value;
    best_tour = std::move(tour);
    out.objection.clear();
    out.condition_after.push_back(problem.shown_condition(mean));
    return true;
  };
  const int attempts = 10 * options.starts, steps = attempts + options.exchanges;
  int kept = 0;
  for (int k = 0; k < attempts && (kept < options.starts || !std::isfinite(best)); ++k) {
    kept += consider(source.tour()) || std::isfinite(best);
    if (options.progress) options.progress(static_cast<double>(k) / steps);
  }
  if (!std::isfinite(best)) return out;
  const std::size_t first = options.start.size() > 0 ? 1 : 0;
  for (int k = 0; k < options.exchanges; ++k) {
    const std::size_t places = best_tour.points.size() - 1 - first;
    out.exchanges += consider(source.exchanged(best_tour, first + static_cast<std::size_t>(k) % places));
    if (options.progress) options.progress(static_cast<double>(attempts + k + 1) / steps);
  }
  out.motion = source.motion(best_tour);
  for (const Stroke& stroke : best_tour.strokes) out.slowed_strokes += stroke.slowed;
  return out;
}

}  // namespace kr5::identification
