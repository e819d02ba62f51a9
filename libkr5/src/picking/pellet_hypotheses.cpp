// SPDX-License-Identifier: BSD-3-Clause
#include "pellet_hypotheses.hpp"

#include <numbers>

#include <kr5/core/linear.hpp>
#include <kr5/picking/cylinder_fit.hpp>

namespace kr5::picking {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

/// A start and how well the rays agree with it.
struct ScoredCylinder {
  double score = 0.0;
  SolidCylinder cylinder;
};

/// Adds the best ones that are some distance apart.
void add_best(std::vector<ScoredCylinder> candidates, std::size_t count, double apart,
              std::vector<SolidCylinder>& out) {
  std::sort(candidates.begin(), candidates.end(),
            [](const ScoredCylinder& a, const ScoredCylinder& b) { return a.score > b.score; });
  std::vector<Vector3d> taken;
  for (const ScoredCylinder& c : candidates) {
    if (taken.size() == count || c.score <= 0) break;
    const auto near = [&](const Vector3d& other) { return (other - c.cylinder.centre).norm() < apart; };
    if (std::any_of(taken.begin(), taken.end(), near)) continue;
    taken.push_back(c.cylinder.centre);
    out.push_back(c.cylinder);
  }
}

/// Counts of rays along the axis of a side without ends: that end on it, and that pass through where it would be.
class AxisProfile {
 public:
  AxisProfile(double reach, double step) : reach_(reach), step_(step), on_(bins(), 0), through_(bins(), 0) {}

  void add_on(double t) { add(on_, t); }
  void add_through(double t) { add(through_, t); }
  /// For prefix sums, once all rays are in.
  void close() {
    for (std::vector<double>* counts : {&on_, &through_})
      for (std::size_t i = 1; i < counts->size(); ++i) (*counts)[i] += (*counts)[i - 1];
  }
  /// How well ends at `low` and `high` agree: rays on it between them, passing rays outside.
  double score(double low, double high) const {
    const double edge = 2 * step_, strip = 4 * step_;
    return sum(on_, low, high) - 3 * sum(through_, low + edge, high - edge) + sum(through_, low - strip, low) -
           sum(on_, low - strip, low) + sum(through_, high, high + strip) - sum(on_, high, high + strip);
  }
  double reach() const { return reach_; }
  double step() const { return step_; }

 private:
  std::size_t bins() const { return static_cast<std::size_t>(2 * reach_ / step_) + 2; }
  std::size_t bin(double t) const {
    const double at = (t + reach_) / step_;
    return static_cast<std::size_t>(std::clamp(at, 0.0, static_cast<double>(on_.size() - 1)));
  }
  void add(std::vector<double>& counts, double t) {
    if (std::abs(t) < reach_) counts[bin(t)] += 1;
  }
  double sum(const std::vector<double>& counts, double low, double high) const {
    return high <= low ? 0.0 : counts[bin(high)] - counts[bin(low)];
  }

  double reach_, step_;
  std::vector<double> on_, through_;
};

void from_side(const PelletScene& scene, const Matrix3Xd& points, const std::optional<Vector3d>& axis,
               std::vector<SolidCylinder>& out) {
  const PelletOptions& o = scene.options;
  CylinderFitOptions options{.radius = o.radius};
  options.sigma_radius = o.radius_tolerance / std::sqrt(3.0);
  options.max_rounds = 4;  // what is suggested here is fitted anew as a solid
  const CylinderFit side = fit_cylinder(points, options, axis);
  if (!side.fit.usable() || std::abs(side.radius - o.radius) > 3 * o.radius_tolerance + 0.1 * o.radius) return;
  SolidCylinder at;
  at.frame << side.across, side.axis;
  at.frame = nearest_rotation(at.frame);
  at.centre = side.point;
  at.radius = std::clamp(side.radius, o.radius - o.radius_tolerance, o.radius + o.radius_tolerance);
  const double reach = side.length / 2 + 1.1 * o.max_height;
  AxisProfile profile(reach, o.radius / 16);
  const Matrix3d R = at.frame.transpose();
  const double gate = std::max(scene.tolerance(), 0.08 * o.radius), depth = scene.depth();
  const Vector3d view = R * scene.rays.direction_at(at.centre);
  const Vector2d seen = -view.head<2>().normalized();
  at.height = 2 * reach;
  scene.rays.near(at.centre, std::hypot(reach, at.radius), [&](const RayGrid::Ray& ray) {
    const Vector3d q = R * (ray.point - at.centre), e = R * ray.direction;
    const double rho = q.head<2>().norm();
    if (std::abs(rho - at.radius) < gate && q.head<2>().dot(seen) > 0.2 * rho) {
      if (!scene.explained[static_cast<std::size_t>(ray.column)]) profile.add_on(q.z());
      return;
    }
    if (e.head<2>().squaredNorm() < 0.02) return;
    const SolidCylinder::Chord side = at.side_chord(q, e);
    if (side.hits() && std::min(-side.in, side.out - side.in) > depth) profile.add_through(q.z() + side.in * e.z());
  });
  profile.close();
  std::vector<ScoredCylinder> candidates;
  const double height_step = std::max((o.max_height - o.min_height) / 4, 1e-9);
  for (double height = o.min_height; height <= o.max_height + 1e-9; height += height_step)
    for (double low = -reach; low + height <= reach; low += profile.step()) {
      ScoredCylinder c{profile.score(low, low + height), at};
      c.cylinder.height = height;
      c.cylinder.centre = at.centre + side.axis * (low + height / 2);
      candidates.push_back(c);
    }
  add_best(std::move(candidates), 3, 0.35 * o.radius, out);
}

/// Places in a plane; as single numbers, so that a compiler counts several at once.
struct PlanePoints {
  std::vector<float> x, y;

  void add(const Vector2d& p) {
    x.push_back(static_cast<float>(p.x()));
    y.push_back(static_cast<float>(p.y()));
  }
  /// Numbers of them nearer to a centre than each of three radii.
  std::array<int, 3> within(const Vector2d& centre, const std::array<double, 3>& radii) const {
    const auto u = static_cast<float>(centre.x()), v = static_cast<float>(centre.y());
    const auto a = static_cast<float>(radii[0] * radii[0]), b = static_cast<float>(radii[1] * radii[1]),
               c = static_cast<float>(radii[2] * radii[2]);
    int na = 0, nb = 0, nc = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const float dx = x[i] - u, dy = y[i] - v, d = dx * dx + dy * dy;
      na += d < a, nb += d < b, nc += d < c;
    }
    return {na, nb, nc};
  }
};

/// Rays in the plane of a face: where they end on it, and where they pass through.
struct FaceRays {
  PlanePoints on, through;

  /// How well a disc agrees: rays on it within, passing rays about it.
  double score(const Vector2d& centre, double radius, double step) const {
    const std::array<double, 3> radii = {radius - step, radius, radius + 2 * step};
    const auto ends = on.within(centre, radii), passes = through.within(centre, radii);
    return ends[1] - (ends[2] - ends[1]) - 3.0 * passes[0] + (passes[2] - passes[1]);
  }
};

void from_face(const PelletScene& scene, const Matrix3Xd& points, const Vector3d& normal,
               std::vector<SolidCylinder>& out) {
  const PelletOptions& o = scene.options;
  const Vector3d mean = points.rowwise().mean();
  const Matrix3Xd about = points.colwise() - mean;
  const SymmetricEigen eigen = symmetric_eigen(Matrix3d(about * about.transpose()));
  Vector3d n = eigen.vectors.col(0);
  if (n.dot(normal) < 0) n = -n;
  if (n.dot(normal) < 0.8) n = normal;
  const Matrix3d frame = axes_about(n), R = frame.transpose();
  const double gate = std::max(scene.tolerance(), 0.05 * o.radius), depth = scene.depth();
  FaceRays rays;
  scene.rays.near(mean, 3.2 * o.radius, [&](const RayGrid::Ray& ray) {
    const Vector3d q = R * (ray.point - mean), e = R * ray.direction;
    if (e.z() > -0.15) return;
    const Vector2d crossing = (q - e * (q.z() / e.z())).head<2>();
    if (std::abs(q.z()) < gate) {
      if (!scene.explained[static_cast<std::size_t>(ray.column)]) rays.on.add(crossing);
    } else if (q.z() < -depth) {
      rays.through.add(crossing);
    }
  });
  std::vector<ScoredCylinder> candidates;
  const double step = o.radius / 16;
  for (int k = 0; k < 9; ++k) {
    const double angle = 2 * std::numbers::pi * k / 8, out_by = k == 8 ? 0.0 : 0.6 * o.radius;
    Vector2d centre = out_by * Vector2d(std::cos(angle), std::sin(angle));
    double best = rays.score(centre, o.radius, step);
    for (double stride = 0.25 * o.radius; stride > 0.5 * step;) {
      const Vector2d from = centre;
      for (const Vector2d& move : {Vector2d(1, 0), Vector2d(-1, 0), Vector2d(0, 1), Vector2d(0, -1), Vector2d(0.7, 0.7),
                                   Vector2d(-0.7, 0.7), Vector2d(0.7, -0.7), Vector2d(-0.7, -0.7)}) {
        const double score = rays.score(from + stride * move, o.radius, step);
        if (score > best) best = score, centre = from + stride * move;
      }
      if (centre == from) stride /= 2;
    }
    ScoredCylinder c;
    c.score = best;
    c.cylinder.frame = frame;
    c.cylinder.radius = o.radius;
    c.cylinder.height = scene.middle_height();
    c.cylinder.centre = mean + frame.leftCols<2>() * centre - n * (c.cylinder.height / 2);
    candidates.push_back(c);
  }
  add_best(std::move(candidates), 2, 0.4 * o.radius, out);
}

}  // namespace

std::vector<SolidCylinder> hypotheses(const PelletScene& scene, const Cloud& cloud, const Patch& patch) {
  std::vector<SolidCylinder> out;
  const Matrix3Xd points = cloud.points(Eigen::all, patch.points);
  if (patch.kind != PatchKind::Curved) from_face(scene, points, patch.normal, out);
  if (patch.kind == PatchKind::Curved) from_side(scene, points, patch.axis, out);
  if (patch.kind == PatchKind::Mixed) from_side(scene, points, std::nullopt, out);
  return out;
}

}  // namespace kr5::picking
