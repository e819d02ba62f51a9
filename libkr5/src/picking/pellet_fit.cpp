// SPDX-License-Identifier: BSD-3-Clause
#include "pellet_fit.hpp"

#include <array>
#include <limits>
#include <numbers>

#include <kr5/core/levenberg_marquardt.hpp>

namespace kr5::picking {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

enum class PelletSurface { Side, Top, Bottom };  // Top: the end the axis points to

/// A place on one of the surfaces; an edge is one on the surface that does not show there.
struct SurfacePoint {
  Vector3d point;
  PelletSurface surface;
  double sigma;
  bool edge = false;
};

/// atan2 to 1e-4 (Abramowitz and Stegun 1964, 4.4.49): the bound of a sector is not exact, and it is asked for each
/// ray.
double rough_angle(double y, double x) {
  const double a = std::abs(x), b = std::abs(y), z = std::min(a, b) / std::max({a, b, 1e-300}), s = z * z;
  double angle = z * (0.9998660 + s * (-0.3302995 + s * (0.1801410 + s * (-0.0851330 + s * 0.0208351))));
  if (b > a) angle = std::numbers::pi / 2 - angle;
  if (x < 0) angle = std::numbers::pi - angle;
  return y < 0 ? -angle : angle;
}

/// Sectors of the rim of a face, or strips of the side: the last ray on it and the first that passes by.
struct EdgeSearch {
  struct Gap {
    double on = -1e9, by = 1e9;
    Vector3d on_point = Vector3d::Zero(), by_point = Vector3d::Zero();
    std::vector<double> hidden;
  };
  static constexpr int sectors = 36;
  std::array<Gap, sectors> gaps;

  static std::size_t sector(double x, double y) {
    const int k = static_cast<int>((rough_angle(y, x) / (2 * std::numbers::pi) + 0.5) * sectors);
    return static_cast<std::size_t>(std::clamp(k, 0, sectors - 1));
  }
  void on(std::size_t k, double where, const Vector3d& point) {
    if (where > gaps[k].on) gaps[k].on = where, gaps[k].on_point = point;
  }
  void by(std::size_t k, double where, const Vector3d& point) {
    if (where < gaps[k].by) gaps[k].by = where, gaps[k].by_point = point;
  }
  /// What lies there is hidden, so that a gap about it is no edge.
  void hide(std::size_t k, double where) { gaps[k].hidden.push_back(where); }
  void add_to(std::vector<SurfacePoint>& out, PelletSurface surface, double expected, double pitch, double tolerance,
              double noise) const {
    for (const Gap& gap : gaps) {
      const double width = gap.by - gap.on, middle = (gap.by + gap.on) / 2;
      if (gap.on < 0 || width > 2.5 * pitch + 0.5 * tolerance || width < -2 * tolerance) continue;
      const auto between = [&](double where) { return where > gap.on - pitch && where < gap.by + pitch; };
      if (std::any_of(gap.hidden.begin(), gap.hidden.end(), between)) continue;
      if (std::abs(middle - expected) > 2 * pitch + 3 * tolerance) continue;
      out.push_back({(gap.on_point + gap.by_point) / 2, surface,
                     std::hypot(std::max(std::abs(width), pitch) / std::sqrt(12.0), noise), true});
    }
  }
};

/// Where only the side is seen, the ends lie beyond its points, and no further from each other than the height allows.
void add_extent(const PelletScene& scene, const SolidCylinder& at, std::vector<SurfacePoint>& out) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const SurfacePoint& s : out) {
    if (s.surface != PelletSurface::Side) return;
    const double t = at.local(s.point).z();
    low = std::min(low, t), high = std::max(high, t);
  }
  if (!(low < high)) return;
  const double play = std::max(scene.options.max_height - (high - low), 2 * scene.rays.pitch());
  const double sigma = play / std::sqrt(12.0) * std::sqrt(2.0);  // of each end, so that the centre has play / sqrt(12)
  const double middle = (low + high) / 2, half = scene.middle_height() / 2;
  out.push_back({at.centre + at.axis() * (middle + half), PelletSurface::Top, sigma, true});
  out.push_back({at.centre + at.axis() * (middle - half), PelletSurface::Bottom, sigma, true});
}

/// Points on the surfaces of a cylinder and its edges; all in the coordinates of the base.
std::vector<SurfacePoint> points_seen(const PelletScene& scene, const SolidCylinder& at, double gate) {
  std::vector<SurfacePoint> out;
  const Matrix3d R = at.frame.transpose();
  const double half = at.height / 2, depth = scene.depth(), sigma = std::max(scene.noise, 1e-5);
  const double margin = std::min(gate, 0.05 * at.radius);
  EdgeSearch rim[2], ends[2];  // of top and bottom
  scene.rays.near(at.centre, at.bounding_radius() + 3 * scene.rays.pitch(), [&](const RayGrid::Ray& ray) {
    const Vector3d q = R * (ray.point - at.centre), e = R * ray.direction;
    const double rho = q.head<2>().norm(), across = rho - at.radius, along = std::abs(q.z()) - half;
    const bool known = scene.explained[static_cast<std::size_t>(ray.column)];
    const bool side_seen = e.head<2>().dot(q.head<2>())<-0.1 * rho, face_seen = -e.z() * q.z()> 0.1 * std::abs(q.z());
    if (!known && side_seen && std::abs(across) < gate && along < -margin)
      out.push_back({ray.point, PelletSurface::Side, sigma});
    if (!known && face_seen && std::abs(along) < gate && across < -margin)
      out.push_back({ray.point, q.z() > 0 ? PelletSurface::Top : PelletSurface::Bottom, sigma});

    if (std::abs(e.z()) > 0.15) {  // the rim of the end towards the sensor
      const int end = e.z() < 0 ? 0 : 1;
      const double sign = end == 0 ? 1 : -1, above = sign * q.z() - half;
      const Vector3d crossing = q + e * ((sign * half - q.z()) / e.z());
      const double where = crossing.head<2>().norm();
      const auto sector = [&] { return EdgeSearch::sector(crossing.x(), crossing.y()); };
      const auto place = [&] { return Vector3d(at.centre + at.frame * crossing); };
      if (std::abs(above) < gate && !known)
        rim[end].on(sector(), where, place());
      else if (above < -depth)
        rim[end].by(sector(), where, place());
      else if (above > 0)
        rim[end].hide(sector(), where);
    }
    if (e.head<2>().squaredNorm() > 0.02) {  // the ends of the side
      if (std::abs(across) < gate && side_seen && !known) {
        const std::size_t k = EdgeSearch::sector(q.x(), q.y());
        ends[q.z() > 0 ? 0 : 1].on(k, std::abs(q.z()), ray.point);
      } else if (const SolidCylinder::Chord side = at.side_chord(q, e); side.hits()) {
        const Vector3d entry = q + side.in * e;
        if (std::min(-side.in, side.out - side.in) > depth)
          ends[entry.z() > 0 ? 0 : 1].by(EdgeSearch::sector(entry.x(), entry.y()), std::abs(entry.z()),
                                         at.centre + at.frame * entry);
        else if (side.in > 0)
          ends[entry.z() > 0 ? 0 : 1].hide(EdgeSearch::sector(entry.x(), entry.y()), std::abs(entry.z()));
      }
    }
  });
  const double pitch = scene.rays.pitch();
  add_extent(scene, at, out);
  for (int end = 0; end < 2; ++end) {
    rim[end].add_to(out, PelletSurface::Side, at.radius, pitch, gate, sigma);
    ends[end].add_to(out, end == 0 ? PelletSurface::Top : PelletSurface::Bottom, half, pitch, gate, sigma);
  }
  return out;
}

using Vector7 = Eigen::Matrix<double, 7, 1>;

/// Steps: centre in the frame of the cylinder, tilts about its first two axes, radius, height.
struct PelletProblem {
  const PelletScene& scene;
  const std::vector<SurfacePoint>& seen;
  const SolidCylinder& start;

  NormalEquations<7> equations(const SolidCylinder& at) const {
    NormalEquations<7> out;
    const Matrix3d R = at.frame.transpose();
    for (const SurfacePoint& s : seen) {
      const Vector3d q = R * (s.point - at.centre);
      Vector7 row = Vector7::Zero();
      double residual = 0;
      if (s.surface == PelletSurface::Side) {
        const double rho = std::max(q.head<2>().norm(), 1e-9);
        const Eigen::Vector2d n = q.head<2>() / rho;
        residual = rho - at.radius;
        row << -n.x(), -n.y(), 0, q.z() * n.y(), -q.z() * n.x(), -1, 0;
      } else {
        const double sign = s.surface == PelletSurface::Top ? 1 : -1;
        residual = sign * q.z() - at.height / 2;
        row << 0, 0, -sign, -sign * q.y(), sign * q.x(), 0, -0.5;
      }
      out.add_huber(row / s.sigma, residual / s.sigma, 2.5);
    }
    add_priors(at, out);
    return out;
  }

  SolidCylinder moved(const SolidCylinder& from, const Vector7& step) const {
    const PelletOptions& o = scene.options;
    SolidCylinder out = from;
    out.centre += from.frame * step.head<3>();
    out.frame = from.frame * exp_rotation({step[3], step[4], 0});
    out.radius = std::clamp(from.radius + step[5], o.radius - o.radius_tolerance, o.radius + o.radius_tolerance);
    out.height = std::clamp(from.height + step[6], o.min_height, o.max_height);
    return out;
  }

 private:
  /// What is known beforehand: the sizes lie evenly in their ranges; the rest keeps near the start what is not seen.
  void add_priors(const SolidCylinder& at, NormalEquations<7>& out) const {
    const PelletOptions& o = scene.options;
    const double sigma_radius = std::max(o.radius_tolerance / std::sqrt(3.0), 1e-6);
    const double sigma_height = std::max((o.max_height - o.min_height) / std::sqrt(12.0), 1e-6);
    out.add(Vector7::Unit(5) / sigma_radius, (at.radius - o.radius) / sigma_radius);
    out.add(Vector7::Unit(6) / sigma_height, (at.height - scene.middle_height()) / sigma_height);
    const Vector3d shift = at.frame.transpose() * (at.centre - start.centre);
    for (int k = 0; k < 3; ++k) out.add(Vector7::Unit(k) / o.radius, shift[k] / o.radius);
    const Vector3d turn = log_rotation(start.frame.transpose() * at.frame);
    for (int k = 0; k < 2; ++k) out.add(Vector7::Unit(3 + k) / 0.5, turn[k] / 0.5);
  }
};

}  // namespace

RayVerdict judge(const PelletScene& scene, const SolidCylinder& cylinder) {
  RayVerdict out;
  const Matrix3d R = cylinder.frame.transpose();
  const double sigma = std::max(scene.noise, 0.005 * scene.options.radius), unlikely = 1 / (16 * sigma * sigma);
  const double tolerance = scene.tolerance(), depth = scene.depth(), inner = cylinder.radius + 1.5 * scene.rays.pitch();
  scene.rays.near(cylinder.centre, 1.3 * cylinder.bounding_radius(), [&](const RayGrid::Ray& ray) {
    const Vector3d q = R * (ray.point - cylinder.centre), e = R * ray.direction;
    if (std::abs(e.z()) > 0.3) {
      const double above = (e.z() < 0 ? q.z() : -q.z()) - cylinder.height / 2;
      const double where = (q + e * (above / std::abs(e.z()))).head<2>().norm();
      if (where > inner && where < inner + 0.3 * cylinder.radius) {
        ++out.about;
        out.level += std::abs(above) < tolerance && !scene.explained[static_cast<std::size_t>(ray.column)];
      } else if (where > 0.75 * cylinder.radius && where < cylinder.radius - 0.5 * scene.rays.pitch() &&
                 above < tolerance) {
        ++out.inside_rim;
        out.past_rim += above < -depth;
      }
    }
    if (const double distance = cylinder.distance(q); std::abs(distance) < tolerance) {
      const bool on_side = q.head<2>().norm() - cylinder.radius > std::abs(q.z()) - cylinder.height / 2;
      const double towards = on_side ? -e.head<2>().dot(q.head<2>()) : -e.z() * q.z();
      if (towards > 0) {  // not the back of it, which another one touches
        ++out.on;
        out.misfit += std::min(distance * distance * unlikely, 1.0);
        out.new_on += !scene.explained[static_cast<std::size_t>(ray.column)];
        return;
      }
    }
    const SolidCylinder::Chord chord = cylinder.chord(q, e);
    if (!chord.hits()) return;
    if (chord.in > 0) {
      ++out.before;
      out.close += chord.in < 3 * tolerance;
    } else if (passes_through(scene, cylinder, chord, q, e)) {
      ++out.through;
    } else if (const double below = std::min(-chord.in, chord.out - chord.in); below > tolerance && below <= depth) {
      ++out.under;
    }
  });
  return out;
}

PelletFit fit_pellet(const PelletScene& scene, const SolidCylinder& start, FitStart from) {
  PelletFit out;
  out.cylinder = start;
  const double narrow = scene.tolerance();
  std::vector<SurfacePoint> seen;
  NormalEquations<7> end;
  std::vector<double> gates = {narrow, narrow};
  if (from == FitStart::Hypothesis)
    gates = {std::max(narrow, 0.12 * start.radius), std::max(narrow, 0.07 * start.radius), narrow};
  for (const double gate : gates) {
    seen = points_seen(scene, out.cylinder, gate);
    const SolidCylinder before = out.cylinder;
    const auto fit =
        levenberg_marquardt<7>(before, PelletProblem{scene, seen, before}, {.max_iterations = 12, .sigma = 1.0});
    if (fit.usable() || fit.status == LevenbergMarquardtStatus::MaxIterations) out.cylinder = fit.x;
    end = PelletProblem{scene, seen, out.cylinder}.equations(out.cylinder);
  }
  const Matrix3d R = out.cylinder.frame.transpose();
  double sum = 0;
  for (const SurfacePoint& s : seen) {
    if (s.edge) {
      ++out.edges;
      continue;
    }
    const double d = out.cylinder.distance(R * (s.point - out.cylinder.centre));
    sum += d * d;
    ++(s.surface == PelletSurface::Side ? out.side : out.face);
  }
  out.rms = std::sqrt(sum / std::max(1, out.side + out.face));
  const double inflation = std::max(1.0, out.rms / std::max(scene.noise, 1e-5));
  if (const auto covariance = end.covariance(inflation * inflation)) out.covariance = *covariance;
  out.verdict = judge(scene, out.cylinder);
  return out;
}

}  // namespace kr5::picking
