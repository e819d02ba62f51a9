// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/picking/grasp.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>

#include "length_text.hpp"
#include "ray_grid.hpp"
#include "share_text.hpp"
#include "solid_cylinder.hpp"

namespace kr5::picking {

using Eigen::Matrix3d;
using Eigen::Vector3d;

void GraspOptions::validate() const {
  require(cup_radius > 0 && std::isfinite(cup_radius), "cup_radius must be positive [m]");
  require(!gripper.empty(), "gripper: at least one part is needed");
  for (const GripperPart& part : gripper)
    require(part.radius > 0 && part.start >= 0 && part.end > part.start,
            "gripper: a part needs a positive radius, and an end above its start [m]");
  require(clearance >= 0, "clearance must not be negative [m]");
  require(neighbour_clearance >= 0, "neighbour_clearance must not be negative [m]");
  require(min_exposed >= 0 && min_exposed <= 1, "min_exposed must lie between 0 and 1 [-]");
  require(min_sealed >= 0 && min_sealed <= 1, "min_sealed must lie between 0 and 1 [-]");
  require(max_lean > 0 && max_lean < std::numbers::pi / 2, "max_lean must lie between 0 and pi/2 [rad]");
  require(max_tilt >= 0 && max_tilt < 1, "max_tilt must lie between 0 and 1 [rad]");
  require(max_position_std > 0, "max_position_std must be positive [m]");
}

namespace {

/// Where a cup may sit, and how the gripper stands there.
struct Approach {
  Vector3d tip, outwards, normal;
  bool on_face = false;
  double lean = 0.0;  ///< From the vertical [rad].
};

/// What moves along the axis of the gripper sweeps a longer cylinder: the last part, as far as above the rim.
GraspOptions reaching_out(GraspOptions options, const Bin& bin) {
  GripperPart& last = options.gripper.back();
  last.end = std::max(last.end, 1.2 * bin.size.z() / std::cos(std::min(options.max_lean, 1.4)));
  return options;
}

class Planner {
 public:
  Planner(const std::vector<Pellet>& pellets, const Cloud& cloud, const Bin& bin, const GraspOptions& options)
      : pellets_(pellets),
        bin_(bin),
        options_(reaching_out(options, bin)),
        up_(bin.T_base_bin.linear().col(2)),
        rays_(cloud, up_, std::max(options.cup_radius / 4, 1e-4)) {
    for (const Pellet& p : pellets) solids_.push_back(solid_of(p));
  }

  Grasp judge(int number) const {
    Grasp out;
    out.pellet = number;
    const Pellet& pellet = pellets_[static_cast<std::size_t>(number)];
    for (std::size_t k = 0; k < solids_.size(); ++k) {
      if (static_cast<int>(k) == number) continue;
      if (lies_on(solids_[k], solids_[static_cast<std::size_t>(number)])) out.covered_by.push_back(static_cast<int>(k));
      out.neighbours += touch(solids_[k], solids_[static_cast<std::size_t>(number)]);
    }
    best_approach(number, out);
    if (pellet.exposed < options_.min_exposed) {
      out.finding = GraspFinding::Hidden;
      out.reason = share_text(pellet.exposed) + " of it show, " + share_text(options_.min_exposed) + " are needed";
    } else if (out.graspable() && !out.covered_by.empty()) {
      out.finding = GraspFinding::Covered;
      out.reason = out.covered_by.size() == 1 ? "another cylinder lies on it"
                                              : std::to_string(out.covered_by.size()) + " cylinders lie on it";
    } else if (out.graspable()) {
      const Matrix3d across =
          Matrix3d::Identity() - out.T_base_gripper.linear().col(2) * out.T_base_gripper.linear().col(2).transpose();
      const Matrix3d covariance =
          across * pellet.frame * pellet.covariance.topLeftCorner<3, 3>() * pellet.frame.transpose() * across;
      const double std_across = std::sqrt(symmetric_eigen(covariance).values[2]);
      if (std_across > options_.max_position_std) {
        out.finding = GraspFinding::Uncertain;
        out.reason = "its place is uncertain by " + millimetres(std_across) + " (standard deviation); " +
                     millimetres(options_.max_position_std) + " are allowed";
      }
    }
    return out;
  }

 private:
  static bool touch(const SolidCylinder& a, const SolidCylinder& b) {
    const double reach = a.bounding_radius() + b.bounding_radius();
    if ((a.centre - b.centre).norm() > reach) return false;
    return b.distance_to_side_of(a) < 0.1 * b.radius;
  }

  /// Whether a vertical line leaves `below` and meets `above` higher up, over more than a sliver.
  bool lies_on(const SolidCylinder& above, const SolidCylinder& below) const {
    const Vector3d apart = above.centre - below.centre;
    if (apart.dot(up_) <= 0 ||
        (apart - up_ * apart.dot(up_)).norm() > above.bounding_radius() + below.bounding_radius())
      return false;
    const Vector3d e = above.frame.transpose() * up_, f = below.frame.transpose() * up_;
    const Matrix3d level = axes_about(up_);
    int met = 0, all = 0;
    const double reach = below.bounding_radius();
    for (int i = -6; i <= 6; ++i)
      for (int k = -6; k <= 6; ++k) {
        const Vector3d p = below.centre + level.leftCols<2>() * Eigen::Vector2d(i, k) * (reach / 6);
        const auto own = below.chord(below.local(p), f);
        if (!own.hits()) continue;
        ++all;
        const auto other = above.chord(above.local(p), e);
        met += other.hits() && other.in > own.out - 0.1 * below.radius;
      }
    return met > 0.08 * all;
  }

  void best_approach(int number, Grasp& out) const {
    const SolidCylinder& own = solids_[static_cast<std::size_t>(number)];
    GraspFinding nearest_to_good = GraspFinding::Leaning;
    double min_lean = std::numeric_limits<double>::infinity();
    double best_seal = 0;
    const auto rank = [](GraspFinding f) {  // how far a candidate came
      return f == GraspFinding::Leaning       ? 0
             : f == GraspFinding::SmallPatch  ? 1
             : f == GraspFinding::TouchesPile ? 2
                                              : 3;
    };
    for (const Approach& a : approaches(own)) {
      GraspFinding finding = GraspFinding::Graspable;
      double clearance = 0, seal = 0;
      if (a.lean > options_.max_lean) {
        finding = GraspFinding::Leaning;
      } else if (a.lean >= min_lean) {
        continue;
      } else if (seal = sealed(own, a); seal < options_.min_sealed) {
        finding = GraspFinding::SmallPatch;
        best_seal = std::max(best_seal, seal);
      } else if (clearance = gripper_clearance({a.tip, a.outwards}, options_.gripper, bin_);
                 clearance < options_.clearance) {
        finding = GraspFinding::TouchesBin;
      } else if (touches_pile(own, a)) {
        finding = GraspFinding::TouchesPile;
      }
      if (finding != GraspFinding::Graspable) {
        if (min_lean == std::numeric_limits<double>::infinity() && rank(finding) > rank(nearest_to_good))
          nearest_to_good = finding;
        continue;
      }
      min_lean = a.lean;
      out.finding = finding;
      out.clearance = clearance;
      out.sealed = seal;
      out.on_face = a.on_face;
      out.T_base_gripper = pose_of(a, own);
    }
    if (min_lean < std::numeric_limits<double>::infinity()) {
      out.reason = out.on_face ? "by its end face" : "by its side";
      return;
    }
    out.finding = nearest_to_good;
    out.reason = reason_of(nearest_to_good, best_seal);
  }

  std::string reason_of(GraspFinding finding, double seal) const {
    if (finding == GraspFinding::Leaning)
      return "its free surface leans more than " +
             std::to_string(static_cast<int>(std::lround(options_.max_lean * 180 / std::numbers::pi))) +
             " degrees from the vertical";
    if (finding == GraspFinding::SmallPatch)
      return "no free place for a cup of radius " + millimetres(options_.cup_radius) + ": at most " + share_text(seal) +
             " of the surface under it were measured";
    if (finding == GraspFinding::TouchesBin)
      return "the gripper would come nearer to the bin than " + millimetres(options_.clearance);
    return "the gripper would touch what lies beside it";
  }

  /// Places on the ends and along the side that face upwards, each with the normal and directions about it.
  std::vector<Approach> approaches(const SolidCylinder& c) const {
    std::vector<Approach> out;
    for (const double end : {1.0, -1.0}) {
      const Vector3d normal = end * c.axis();
      if (normal.dot(up_) > 0.1) add(out, c.centre + normal * (c.height / 2), normal, true);
    }
    const double free = c.height / 2 - options_.cup_radius;
    for (int k = 0; k < 36; ++k) {
      const double angle = 2 * std::numbers::pi * k / 36;
      const Vector3d normal = c.frame * Vector3d(std::cos(angle), std::sin(angle), 0);
      if (normal.dot(up_) < 0.1) continue;
      for (const double along : {0.0, 0.5, -0.5, 1.0, -1.0})
        if (free > 0 || along == 0.0)
          add(out, c.centre + normal * c.radius + c.axis() * (along * std::max(free, 0.0)), normal, false);
    }
    std::stable_sort(out.begin(), out.end(), [](const Approach& a, const Approach& b) { return a.lean < b.lean; });
    return out;
  }

  void add(std::vector<Approach>& out, const Vector3d& tip, const Vector3d& normal, bool on_face) const {
    const auto lean = [&](const Vector3d& d) { return std::acos(std::clamp(d.dot(up_), -1.0, 1.0)); };
    out.push_back({tip, normal, normal, on_face, lean(normal)});
    if (options_.max_tilt == 0) return;
    const Matrix3d about = axes_about(normal);
    for (int k = 0; k < 8; ++k) {
      const double angle = 2 * std::numbers::pi * k / 8;
      const Vector3d tilted =
          about * Vector3d(std::sin(options_.max_tilt) * std::cos(angle), std::sin(options_.max_tilt) * std::sin(angle),
                           std::cos(options_.max_tilt));
      out.push_back({tip, tilted, normal, on_face, lean(tilted)});
    }
  }

  /// Share of the surface under the cup on which rays end, of those that should.
  double sealed(const SolidCylinder& c, const Approach& a) const {
    int on = 0;
    rays_.near(a.tip, options_.cup_radius, [&](const RayGrid::Ray& ray) {
      const Vector3d from = ray.point - a.tip;
      const double across = (from - a.normal * a.normal.dot(from)).norm();
      on += across < options_.cup_radius && std::abs(c.distance(c.local(ray.point))) < 0.08 * c.radius;
    });
    const double facing = -a.normal.dot(rays_.direction_at(a.tip));
    if (facing < 0.1) return 0.0;
    const double expected =
        std::numbers::pi * options_.cup_radius * options_.cup_radius * facing / (rays_.pitch() * rays_.pitch());
    return std::min(1.0, on / std::max(expected, 1.0));
  }

  bool touches_pile(const SolidCylinder& own, const Approach& a) const {
    int inside = 0;
    for (const GripperPart& part : options_.gripper) {
      const double reach = part.radius + options_.neighbour_clearance;
      const double top = std::min(part.end, part.start + 2 * bin_.size.z());
      const Vector3d middle = a.tip + a.outwards * ((part.start + top) / 2);
      rays_.near(middle, std::hypot(reach, (top - part.start) / 2), [&](const RayGrid::Ray& ray) {
        const Vector3d from = ray.point - a.tip;
        const double along = a.outwards.dot(from);
        if (along < part.start || along > part.end || (from - along * a.outwards).squaredNorm() > reach * reach) return;
        inside += own.distance(own.local(ray.point)) > 0.1 * own.radius;
      });
    }
    return inside > 2;
  }

  static Pose pose_of(const Approach& a, const SolidCylinder& c) {
    Pose out = Pose::Identity();
    const Vector3d z = -a.outwards;
    Vector3d x = c.axis() - z * z.dot(c.axis());
    if (x.norm() < 0.3) x = c.frame.col(0) - z * z.dot(c.frame.col(0));
    out.linear().col(0) = x.normalized();
    out.linear().col(2) = z;
    out.linear().col(1) = z.cross(out.linear().col(0));
    out.translation() = a.tip;
    return out;
  }

  const std::vector<Pellet>& pellets_;
  const Bin& bin_;
  GraspOptions options_;
  Vector3d up_;
  RayGrid rays_;
  std::vector<SolidCylinder> solids_;
};

}  // namespace

std::vector<Grasp> plan_picks(const std::vector<Pellet>& pellets, const Cloud& cloud, const Bin& bin,
                              const GraspOptions& options) {
  cloud.validate();
  bin.validate();
  options.validate();
  Bin heaped = bin;  // what stands above the rim is in the way, too
  for (const Pellet& p : pellets)
    heaped.size.z() = std::max(heaped.size.z(), bin.size.z() + 5 * std::hypot(p.radius, p.height / 2));
  const Planner planner(pellets, crop(cloud, heaped, -0.01, -0.01), bin, options);
  std::vector<Grasp> out;
  for (std::size_t i = 0; i < pellets.size(); ++i) out.push_back(planner.judge(static_cast<int>(i)));
  const Vector3d up = bin.T_base_bin.linear().col(2);
  const auto height = [&](const Grasp& g) { return up.dot(pellets[static_cast<std::size_t>(g.pellet)].centre); };
  std::stable_sort(out.begin(), out.end(), [&](const Grasp& a, const Grasp& b) {
    if (a.graspable() != b.graspable()) return a.graspable();
    if (a.covered_by.size() != b.covered_by.size()) return a.covered_by.size() < b.covered_by.size();
    if (a.neighbours != b.neighbours) return a.neighbours < b.neighbours;
    return height(a) > height(b);
  });
  return out;
}

}  // namespace kr5::picking
