// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/profile_features.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/core/levenberg_marquardt.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/uncertainty/confidence.hpp>

namespace kr5::calibration {
namespace {

constexpr double farthest_point = 5.0;   // coordinate of a point that is no mistake of units [m]
constexpr double min_noise = 1e-7;       // of profiles without noise [m]
constexpr double inlier_sigmas = 4.0;    // of a point that shows a feature
constexpr double steepest_cosine = 0.3;  // between ray and normal on an arc; beyond, ranges are unreliable
constexpr double min_arc = 0.2;          // radius of an arc over that of the sphere; below, the section is too small
constexpr double smallest_radius = 1e-3, largest_radius = 0.2;  // of a sphere of unknown radius [m]
constexpr double min_height = 3e-4;                             // of a tip above the surface [m]
constexpr std::size_t flank_points = 4;                         // at least, on either side of a tip
constexpr int fit_rounds = 4;

/// The measured points of a profile.
struct ProfilePoints {
  Eigen::VectorXd x, z;
  std::vector<int> number;  ///< In the profile.
  Eigen::Index size() const { return x.size(); }
};

using ProfileIndices = std::vector<Eigen::Index>;

ProfilePoints measured_points(const LineProfile& profile) {
  require(profile.x.size() == profile.z.size(), "profile: found " + std::to_string(profile.x.size()) + " x and " +
                                                    std::to_string(profile.z.size()) + " z, expected as many");
  ProfilePoints out;
  for (Eigen::Index k = 0; k < profile.x.size(); ++k) {
    const double x = profile.x[k], z = profile.z[k];
    require(!std::isinf(x) && !std::isinf(z), "profile: point " + std::to_string(k) + " is infinite");
    if (std::isnan(x) || std::isnan(z)) continue;
    require(std::abs(x) < farthest_point && std::abs(z) < farthest_point,
            "profile: point " + std::to_string(k) + " lies " + std::to_string(std::max(std::abs(x), std::abs(z))) +
                " m from the scanner; is it in millimetres?");
    out.number.push_back(static_cast<int>(k));
  }
  std::sort(out.number.begin(), out.number.end(), [&](int a, int b) { return profile.x[a] < profile.x[b]; });
  out.x.resize(static_cast<Eigen::Index>(out.number.size())), out.z.resize(out.x.size());
  for (Eigen::Index k = 0; k < out.size(); ++k) {
    out.x[k] = profile.x[out.number[static_cast<std::size_t>(k)]];
    out.z[k] = profile.z[out.number[static_cast<std::size_t>(k)]];
  }
  return out;
}

double neighbour_noise(const ProfilePoints& points) { return std::max(difference_noise(points.z), min_noise); }

/// Calls `try_at(i, h)` for triples i - h, i, i + h of neighbouring points, at every scale.
template <class Try>
void each_triple(Eigen::Index n, Try&& try_at) {
  for (Eigen::Index h = 2; 2 * h < n; h += std::max<Eigen::Index>(1, h / 3))
    for (Eigen::Index i = h; i + h < n; i += std::max<Eigen::Index>(1, std::max(n / 150, h / 6))) try_at(i, h);
}

ProfileIndices all_points(const ProfilePoints& points) {
  ProfileIndices out;
  for (Eigen::Index k = 0; k < points.size(); ++k) out.push_back(k);
  return out;
}

/// z = slope (x - middle) + height, by least squares of z.
struct FittedLine {
  double slope = 0.0, height = 0.0, middle = 0.0, spread = 0.0, sigma = 0.0;
  ProfileIndices used;
  double at(double x) const { return height + slope * (x - middle); }
  double variance_at(double x) const {
    const double n = static_cast<double>(used.size()), off = (x - middle) / std::max(spread, 1e-12);
    return sigma * sigma * (1 + off * off) / n;
  }
  double cosine() const { return 1 / std::hypot(1.0, slope); }
};

FittedLine least_squares_line(const ProfilePoints& points, const ProfileIndices& used) {
  FittedLine out;
  out.used = used;
  const auto n = static_cast<double>(used.size());
  for (const Eigen::Index k : used) out.middle += points.x[k] / n, out.height += points.z[k] / n;
  double xx = 0.0, xz = 0.0, squares = 0.0;
  for (const Eigen::Index k : used) {
    const double x = points.x[k] - out.middle;
    xx += x * x, xz += x * (points.z[k] - out.height);
  }
  out.slope = xx > 0 ? xz / xx : 0.0;
  out.spread = std::sqrt(xx / n);
  for (const Eigen::Index k : used) squares += std::pow(points.z[k] - out.at(points.x[k]), 2);
  out.sigma = std::max(std::sqrt(squares / std::max(1.0, n - 2)), min_noise);
  return out;
}

/// The line that most of the points `among` show; no points where there is none.
FittedLine most_shown_line(const ProfilePoints& points, const ProfileIndices& among, double noise) {
  const auto n = static_cast<Eigen::Index>(among.size());
  const auto point = [&](Eigen::Index i) { return among[static_cast<std::size_t>(i)]; };
  ProfileIndices best;
  const auto on_line = [&](double slope, double height, double middle, double limit) {
    ProfileIndices out;
    for (const Eigen::Index k : among)
      if (std::abs(points.z[k] - height - slope * (points.x[k] - middle)) < limit) out.push_back(k);
    return out;
  };
  const auto try_pair = [&](Eigen::Index i, Eigen::Index h) {
    const Eigen::Index a = point(i - h), b = point(i + h);
    const double run = points.x[b] - points.x[a];
    if (!(run > 0)) return;
    ProfileIndices found = on_line((points.z[b] - points.z[a]) / run, points.z[a], points.x[a], inlier_sigmas * noise);
    if (found.size() > best.size()) best = std::move(found);
  };
  each_triple(n, try_pair);
  if (best.size() < 3) return {};
  FittedLine line = least_squares_line(points, best);
  for (int round = 0; round < fit_rounds; ++round) {
    const ProfileIndices found =
        on_line(line.slope, line.height, line.middle, inlier_sigmas * std::max(noise, std::min(line.sigma, 2 * noise)));
    if (found.size() < 3) return {};
    line = least_squares_line(points, found);
  }
  return line;
}

/// Variance of a range: known, or estimated on `dof` degrees of freedom and then inflated for so many numbers.
double range_variance(const ProfileFeatureOptions& options, double estimated, double numbers, double dof) {
  if (options.sigma > 0) return options.sigma * options.sigma;
  return estimated * estimated * uncertainty::covariance_inflation(numbers, std::max(dof, 1.0));
}

/// Share of the points between the ends of a feature that lie off it.
double share_off(const ProfileIndices& used) {
  const auto [low, high] = std::minmax_element(used.begin(), used.end());
  return 1 - static_cast<double>(used.size()) / static_cast<double>(*high - *low + 1);
}

void write_used(const ProfilePoints& points, const ProfileIndices& used, ProfileFeature& out) {
  for (const Eigen::Index k : used) out.used.push_back(points.number[static_cast<std::size_t>(k)]);
  std::sort(out.used.begin(), out.used.end());
  out.fit.status = FitStatus::Converged;
  out.fit.iterations = 1;
  out.fit.message = std::to_string(used.size()) + " points";
}

void find_plane_line(const ProfilePoints& points, double noise, const ProfileFeatureOptions& options,
                     ProfileFeature& out) {
  const FittedLine line = most_shown_line(points, all_points(points), noise);
  if (static_cast<int>(line.used.size()) < options.min_points || share_off(line.used) > options.max_share_off) {
    out.fit.message = "the profile shows no flat surface of " + std::to_string(options.min_points) + " points";
    return;
  }
  // At one standard deviation of x from the middle the two heights are independent.
  out.points.resize(2, 2);
  out.points << line.middle - line.spread, line.middle + line.spread, line.at(line.middle - line.spread),
      line.at(line.middle + line.spread);
  out.sigma = options.sigma > 0 ? options.sigma : line.sigma;
  const auto count = static_cast<double>(line.used.size());
  const double variance = range_variance(options, line.sigma, 2, count - 2) * std::pow(line.cosine(), 2) * 2 / count;
  out.covariance = variance * Eigen::Matrix2d::Identity();
  write_used(points, line.used, out);
}

using PlaneCircle = Eigen::Vector3d;  // x, z of the centre, radius

std::optional<PlaneCircle> circle_through(const ProfilePoints& points, Eigen::Index i, Eigen::Index h) {
  const Eigen::Vector2d a(points.x[i - h], points.z[i - h]), b(points.x[i], points.z[i]),
      c(points.x[i + h], points.z[i + h]);
  const Eigen::Vector2d u = b - a, v = c - a;
  const double cross = 2 * (u.x() * v.y() - u.y() * v.x());
  if (std::abs(cross) < 1e-14) return std::nullopt;
  const double uu = u.squaredNorm(), vv = v.squaredNorm();
  const Eigen::Vector2d centre(a.x() + (v.y() * uu - u.y() * vv) / cross, a.y() + (u.x() * vv - v.x() * uu) / cross);
  return PlaneCircle(centre.x(), centre.y(), (a - centre).norm());
}

/// Points on the side of a circle that faces the scanner, where the ray is not too oblique.
ProfileIndices on_circle(const ProfilePoints& points, const PlaneCircle& circle, double noise) {
  ProfileIndices out;
  for (Eigen::Index k = 0; k < points.size(); ++k) {
    const double x = points.x[k] - circle[0], z = circle[1] - points.z[k], distance = std::hypot(x, z);
    if (z > steepest_cosine * distance && std::abs(distance - circle[2]) < inlier_sigmas * noise) out.push_back(k);
  }
  return out;
}

/// Least squares of the ranges of the points on a circle.
struct CircleProblem {
  const ProfilePoints& points;
  const ProfileIndices& used;

  NormalEquations<3> equations(const Eigen::Vector3d& c) const {
    NormalEquations<3> out;
    for (const Eigen::Index k : used) {
      const double x = points.x[k] - c[0], z = points.z[k] - c[1], distance = std::hypot(x, z);
      // A range moves the distance by the cosine between ray and normal.
      const double cosine = std::max(std::abs(z) / distance, steepest_cosine / 2);
      out.add(Eigen::Vector3d(-x / distance, -z / distance, -1.0) / cosine, (distance - c[2]) / cosine);
    }
    return out;
  }
};

void find_sphere_arc(const ProfilePoints& points, double noise, const ProfileFeatureOptions& options,
                     ProfileFeature& out) {
  const double most = options.radius > 0 ? options.radius * (1 + options.radius_tolerance) : largest_radius;
  const double least = options.radius > 0 ? options.radius * min_arc : smallest_radius;
  ProfileIndices best;
  PlaneCircle circle = PlaneCircle::Zero();
  each_triple(points.size(), [&](Eigen::Index i, Eigen::Index h) {
    const std::optional<PlaneCircle> found = circle_through(points, i, h);
    if (!found || (*found)[2] > most || (*found)[2] < least || (*found)[1] < points.z[i]) return;
    ProfileIndices used = on_circle(points, *found, noise);
    if (used.size() > best.size() && share_off(used) <= options.max_share_off) best = std::move(used), circle = *found;
  });
  const std::string nothing = "the profile shows no arc of a sphere";
  for (int round = 0; round < fit_rounds && static_cast<int>(best.size()) >= options.min_points; ++round) {
    circle = levenberg_marquardt<3>(circle, CircleProblem{points, best}).x;
    best = on_circle(points, circle, noise);
  }
  if (static_cast<int>(best.size()) < options.min_points) {
    out.fit.message = nothing + " of " + std::to_string(options.min_points) + " points";
    return;
  }
  const auto fitted = levenberg_marquardt<3>(circle, CircleProblem{points, best});
  out.sigma = options.sigma > 0 ? options.sigma : std::max(std::sqrt(fitted.equations.variance()), min_noise);
  const auto covariance =
      fitted.equations.covariance(range_variance(options, out.sigma, 3, static_cast<double>(best.size()) - 3));
  if (!fitted.usable() || !covariance || fitted.x[2] > most || fitted.x[2] < least ||
      share_off(best) > options.max_share_off) {
    out.fit.message = nothing + (options.radius > 0 ? " of that radius" : "");
    return;
  }
  out.points = fitted.x.head<2>();
  out.radius = fitted.x[2];
  out.covariance = *covariance;
  write_used(points, best, out);
}

/// The run of neighbouring points that rises highest from the surface, without single ones.
ProfileIndices raised_points(const ProfilePoints& points, const FittedLine& surface, double noise) {
  const double limit = std::max(min_height, 6 * noise);
  ProfileIndices best, run;
  double highest = 0.0, height = 0.0;
  for (Eigen::Index k = 0; k <= points.size(); ++k) {
    const double above = k < points.size() ? (surface.at(points.x[k]) - points.z[k]) * surface.cosine() : 0.0;
    if (above > limit) {
      run.push_back(k), height = std::max(height, above);
      continue;
    }
    if (run.size() >= 3 && height > highest) best = run, highest = height;
    run.clear(), height = 0.0;
  }
  return best;
}

/// The tip where its flanks meet.
bool tip_between_flanks(const ProfilePoints& points, const FittedLine& left, const FittedLine& right, Eigen::Index top,
                        double spacing, ProfileFeature& out) {
  const double turn = left.slope - right.slope;
  if (!(left.slope < 0 && right.slope > 0)) return false;
  const double x = (right.at(0) - left.at(0)) / turn, z = left.at(x);
  if (std::abs(x - points.x[top]) > 3 * spacing) return false;
  out.points = Eigen::Vector2d(x, z);
  // x = (c2 - c1) / (m1 - m2) and z on both lines: derivatives by the heights of the lines at the tip.
  Eigen::Matrix2d J;
  J << -1 / turn, 1 / turn, -right.slope / turn, left.slope / turn;
  out.covariance = J * Eigen::Vector2d(left.variance_at(x), right.variance_at(x)).asDiagonal() * J.transpose();
  ProfileIndices used = left.used;
  used.insert(used.end(), right.used.begin(), right.used.end());
  write_used(points, used, out);
  return true;
}

/// The tip at the end of the only flank that the rays reach: between its last point and the next.
bool tip_on_one_flank(const ProfilePoints& points, const FittedLine& flank, bool falls_to_the_right, double spacing,
                      ProfileFeature& out) {
  const Eigen::Index last = falls_to_the_right ? *std::max_element(flank.used.begin(), flank.used.end())
                                               : *std::min_element(flank.used.begin(), flank.used.end());
  const double x = points.x[last] + (falls_to_the_right ? 0.5 : -0.5) * spacing;
  out.points = Eigen::Vector2d(x, flank.at(x));
  const Eigen::Vector2d along(1.0, flank.slope);
  out.covariance = spacing * spacing / 12 * along * along.transpose();
  out.covariance(1, 1) += flank.variance_at(x);
  out.covariance(0, 0) += flank.variance_at(x);
  write_used(points, flank.used, out);
  return true;
}

/// The tip by its flanks; false where the points show none.
bool tip_from_flanks(const ProfilePoints& points, const ProfileIndices& raised, Eigen::Index top, double noise,
                     const ProfileFeatureOptions& options, ProfileFeature& out) {
  ProfileIndices sides[2];
  for (const Eigen::Index k : raised)
    if (k != top) sides[k > top].push_back(k);
  // The highest point belongs to either flank; to the only one where the other is out of reach of the rays.
  for (int side = 0; side < 2; ++side)
    if (sides[1 - side].size() <= 1) sides[side].insert(side == 0 ? sides[side].end() : sides[side].begin(), top);
  const double spacing = (points.x[raised.back()] - points.x[raised.front()]) /
                         static_cast<double>(std::max<std::size_t>(1, raised.size() - 1));
  FittedLine flank[2];
  bool shown[2];
  for (int side = 0; side < 2; ++side) {
    if (sides[side].size() > flank_points) flank[side] = most_shown_line(points, sides[side], noise);
    shown[side] = flank[side].used.size() >= flank_points && share_off(flank[side].used) < 0.3;
  }
  const double dof = static_cast<double>(flank[0].used.size() + flank[1].used.size()) - 4;
  const double both = std::hypot(flank[0].sigma, flank[1].sigma) / std::sqrt(2.0);
  for (FittedLine& line : flank)
    line.sigma = std::sqrt(range_variance(options, shown[0] && shown[1] ? both : line.sigma, 2, dof));
  if (shown[0] && shown[1]) return tip_between_flanks(points, flank[0], flank[1], top, spacing, out);
  for (int side = 0; side < 2; ++side)
    if (shown[side] && sides[1 - side].size() <= 2)
      return tip_on_one_flank(points, flank[side], side == 0, spacing, out);
  return false;
}

void find_pointed_tip(const ProfilePoints& points, double noise, const ProfileFeatureOptions& options,
                      ProfileFeature& out) {
  out.sigma = noise;
  const FittedLine surface = most_shown_line(points, all_points(points), noise);
  if (static_cast<int>(surface.used.size()) < options.min_points) {
    out.fit.message = "the profile shows no flat surface about a tip";
    return;
  }
  const ProfileIndices raised = raised_points(points, surface, noise);
  if (raised.empty()) {
    out.fit.message = "no point of the profile lies nearer to the scanner than the surface: the tip is not in it";
    return;
  }
  const Eigen::Index top = *std::min_element(raised.begin(), raised.end(), [&](Eigen::Index a, Eigen::Index b) {
    return points.z[a] - surface.at(points.x[a]) < points.z[b] - surface.at(points.x[b]);
  });
  if (tip_from_flanks(points, raised, top, noise, options, out)) return;
  const double spacing =
      (points.x[points.size() - 1] - points.x[0]) / static_cast<double>(std::max<Eigen::Index>(1, points.size() - 1));
  out.points = Eigen::Vector2d(points.x[top], points.z[top]);
  // The tip lies anywhere between two points, and higher than either by about as much.
  out.covariance = Eigen::Vector2d(spacing * spacing / 12, noise * noise + spacing * spacing / 4).asDiagonal();
  write_used(points, {top}, out);
}

}  // namespace

void ProfileFeatureOptions::validate() const {
  require(radius >= 0 && std::isfinite(radius), "radius must not be negative [m]; 0 means unknown");
  require(radius < 1.0, "radius: found " + std::to_string(radius) + " m, expected below 1 m; is it in millimetres?");
  require(radius_tolerance >= 0 && radius_tolerance < 1, "radius_tolerance must lie in [0, 1) [-]");
  require(sigma >= 0 && std::isfinite(sigma), "sigma must not be negative [m]; 0 means estimated");
  require(min_points >= 4, "min_points must be at least 4");
  require(max_share_off >= 0 && max_share_off < 1, "max_share_off must lie in [0, 1) [-]");
}

ProfileFeature find_profile_feature(const LineProfile& profile, ScanTargetKind kind,
                                    const ProfileFeatureOptions& options) {
  options.validate();
  const ProfilePoints points = measured_points(profile);
  ProfileFeature out;
  out.kind = kind;
  if (points.size() < options.min_points) {
    out.fit.message = "found " + std::to_string(points.size()) + " measured points, expected at least " +
                      std::to_string(options.min_points);
    return out;
  }
  const double noise = options.sigma > 0 ? options.sigma : neighbour_noise(points);
  switch (kind) {
    case ScanTargetKind::Tip:
      find_pointed_tip(points, noise, options, out);
      break;
    case ScanTargetKind::Sphere:
      find_sphere_arc(points, noise, options, out);
      break;
    case ScanTargetKind::Plane:
      find_plane_line(points, noise, options, out);
      break;
  }
  return out;
}

}  // namespace kr5::calibration
