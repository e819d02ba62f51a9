// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/bin_rays.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include <kr5/core/error.hpp>

namespace kr5::sim {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

constexpr double nearest_hit = 1e-9;  // so that a ray from a surface does not meet that surface [m]
constexpr int leaf_size = 2;

AlignedBox3d box_around(const Pellet& pellet) {
  const Vector3d axis = pellet.T_bin_pellet.linear().col(2);
  const Vector3d reach = 0.5 * pellet.height * axis.cwiseAbs() +
                         pellet.radius * (Vector3d::Ones() - axis.cwiseAbs2()).cwiseMax(0.0).cwiseSqrt();
  return {pellet.T_bin_pellet.translation() - reach, pellet.T_bin_pellet.translation() + reach};
}

/// Where a ray enters and leaves a box; it misses when the first is greater.
std::array<double, 2> span_in_box(const AlignedBox3d& box, const Vector3d& origin, const Vector3d& inverse) {
  double first = -std::numeric_limits<double>::infinity(), last = -first;
  for (int k = 0; k < 3; ++k) {
    const double one = (box.min()[k] - origin[k]) * inverse[k], two = (box.max()[k] - origin[k]) * inverse[k];
    first = std::max(first, std::min(one, two)), last = std::min(last, std::max(one, two));
  }
  return {first, last};
}

/// A direction without zeros, so that 0 times infinity does not come up.
Vector3d inverse_of(const Vector3d& direction) {
  return direction.unaryExpr([](double d) { return 1.0 / (std::abs(d) < 1e-300 ? std::copysign(1e-300, d) : d); });
}

void meet_box(const AlignedBox3d& box, int surface, const Vector3d& origin, const Vector3d& inverse, BinHit& best) {
  const auto [first, last] = span_in_box(box, origin, inverse);
  if (!(first <= last) || first <= nearest_hit || first >= best.distance) return;
  best.distance = first, best.surface = surface;
  for (int k = 0; k < 3; ++k) {
    const double side = inverse[k] > 0.0 ? box.min()[k] : box.max()[k];
    if ((side - origin[k]) * inverse[k] == first) best.normal = -std::copysign(1.0, inverse[k]) * Vector3d::Unit(k);
  }
}

/// Entry of a ray into a cylinder of axis Z about the origin; infinite: none.
double meet_cylinder(const Vector3d& o, const Vector3d& d, double radius, double half, Vector3d& normal) {
  constexpr double none = std::numeric_limits<double>::infinity();
  double first = -none, last = none;
  bool face = false;
  if (std::abs(d.z()) > 1e-15) {
    const double one = (half - o.z()) / d.z(), two = (-half - o.z()) / d.z();
    first = std::min(one, two), last = std::max(one, two), face = true;
  } else if (std::abs(o.z()) > half) {
    return none;
  }
  const double a = d.x() * d.x() + d.y() * d.y(), c = o.x() * o.x() + o.y() * o.y() - radius * radius;
  if (a > 1e-30) {
    const double b = o.x() * d.x() + o.y() * d.y(), root = b * b - a * c;
    if (root < 0.0) return none;
    const double q = -(b + std::copysign(std::sqrt(root), b));  // no difference of nearly equal numbers
    double one = q / a, two = q != 0.0 ? c / q : one;
    if (one > two) std::swap(one, two);
    if (one > first) first = one, face = false;
    last = std::min(last, two);
  } else if (c > 0.0) {
    return none;
  }
  if (!(first <= last) || first <= nearest_hit) return none;
  const Vector3d p = o + first * d;
  normal = face ? Vector3d(0.0, 0.0, d.z() > 0.0 ? -1.0 : 1.0) : Vector3d(p.x() / radius, p.y() / radius, 0.0);
  return first;
}

}  // namespace

BinRays::BinRays(const PelletScene& scene, std::vector<SolidInBin> solids) : solids_(std::move(solids)) {
  scene.validate();
  std::vector<AlignedBox3d> boxes;
  for (const Pellet& p : scene.pellets) {
    boxes.push_back(box_around(p));
    pellets_.push_back({p.T_bin_pellet.linear().transpose(), p.T_bin_pellet.translation(), p.radius, 0.5 * p.height});
  }
  order_.resize(boxes.size());
  std::iota(order_.begin(), order_.end(), 0);
  if (!boxes.empty()) build(0, static_cast<int>(boxes.size()), boxes);

  const double x = 0.5 * scene.bin.size.x(), y = 0.5 * scene.bin.size.y(), z = scene.bin.size.z(), t = scene.bin.wall;
  blocks_ = {{{Vector3d(-x - t, -y - t, -t), Vector3d(x + t, y + t, 0.0)}, BinFloor},
             {{Vector3d(x, -y - t, 0.0), Vector3d(x + t, y + t, z)}, BinWall},
             {{Vector3d(-x - t, -y - t, 0.0), Vector3d(-x, y + t, z)}, BinWall},
             {{Vector3d(-x, y, 0.0), Vector3d(x, y + t, z)}, BinWall},
             {{Vector3d(-x, -y - t, 0.0), Vector3d(x, -y, z)}, BinWall}};
}

int BinRays::build(int first, int count, const std::vector<AlignedBox3d>& boxes) {
  const int place = static_cast<int>(nodes_.size());
  nodes_.emplace_back();
  Node node;
  AlignedBox3d centres;
  for (int k = first; k < first + count; ++k) {
    const AlignedBox3d& box = boxes[static_cast<std::size_t>(order_[static_cast<std::size_t>(k)])];
    node.box.extend(box), centres.extend(box.center());
  }
  if (count <= leaf_size) {
    node.first = first, node.count = count;
  } else {
    Eigen::Index axis;
    centres.sizes().maxCoeff(&axis);
    const int half = count / 2;
    const auto begin = order_.begin() + first;
    std::nth_element(begin, begin + half, begin + count, [&](int a, int b) {
      return boxes[static_cast<std::size_t>(a)].center()[axis] < boxes[static_cast<std::size_t>(b)].center()[axis];
    });
    build(first, half, boxes);
    node.right = build(first + half, count - half, boxes);
  }
  nodes_[static_cast<std::size_t>(place)] = node;
  return place;
}

BinHit BinRays::meet(const Vector3d& origin, const Vector3d& direction, int pellet) const {
  const Round& round = pellets_[static_cast<std::size_t>(pellet)];
  BinHit hit;
  Vector3d normal;
  hit.distance = meet_cylinder(round.to_pellet * (origin - round.centre), round.to_pellet * direction, round.radius,
                               round.half, normal);
  if (!std::isfinite(hit.distance)) return hit;
  hit.surface = pellet, hit.normal = round.to_pellet.transpose() * normal;
  return hit;
}

void BinRays::meet_solids(const Vector3d& origin, const Vector3d& direction, BinHit& best) const {
  for (const SolidInBin& s : solids_) {
    const RayHit hit = s.solid.intersect(Ray{origin, direction}.in(s.T_bin_solid));
    if (!(hit.distance > nearest_hit) || hit.distance >= best.distance) continue;
    best = {hit.distance, s.T_bin_solid.linear() * hit.normal, BinWall};
  }
}

/// Visits the pellets whose boxes a ray enters nearer than `within`, which may shrink meanwhile, until told to stop.
void BinRays::each_pellet_near(const Vector3d& origin, const Vector3d& direction, const double& within,
                               auto&& visit) const {
  if (nodes_.empty()) return;
  const Vector3d inverse = inverse_of(direction);
  std::array<int, 64> stack;
  int depth = 0;
  stack[0] = 0;
  while (depth >= 0) {
    const int place = stack[static_cast<std::size_t>(depth--)];
    const Node& node = nodes_[static_cast<std::size_t>(place)];
    const auto [first, last] = span_in_box(node.box, origin, inverse);
    if (!(first <= last) || last < 0.0 || first >= within) continue;
    if (node.count == 0) {
      stack[static_cast<std::size_t>(++depth)] = node.right, stack[static_cast<std::size_t>(++depth)] = place + 1;
      continue;
    }
    for (int k = node.first; k < node.first + node.count; ++k)
      if (!visit(order_[static_cast<std::size_t>(k)])) return;
  }
}

BinHit BinRays::first_hit(const Vector3d& origin, const Vector3d& direction) const {
  BinHit best;
  const Vector3d inverse = inverse_of(direction);
  for (const Block& block : blocks_) meet_box(block.box, block.surface, origin, inverse, best);
  meet_solids(origin, direction, best);
  each_pellet_near(origin, direction, best.distance, [&](int pellet) {
    const BinHit hit = meet(origin, direction, pellet);
    if (hit.distance < best.distance) best = hit;
    return true;
  });
  return best;
}

void BinRays::all_pellets(const Vector3d& origin, const Vector3d& direction, std::vector<BinHit>& hits) const {
  hits.clear();
  each_pellet_near(origin, direction, std::numeric_limits<double>::infinity(), [&](int pellet) {
    const BinHit hit = meet(origin, direction, pellet);
    if (hit.surface != BinNothing) hits.push_back(hit);
    return true;
  });
}

bool BinRays::blocked(const Vector3d& origin, const Vector3d& direction, double distance) const {
  BinHit hit;
  hit.distance = distance;
  const Vector3d inverse = inverse_of(direction);
  for (const Block& block : blocks_) meet_box(block.box, block.surface, origin, inverse, hit);
  meet_solids(origin, direction, hit);
  bool stopped = hit.surface != BinNothing;
  if (!stopped)
    each_pellet_near(origin, direction, distance, [&](int pellet) {
      stopped = meet(origin, direction, pellet).distance < distance;
      return !stopped;
    });
  return stopped;
}

Eigen::VectorXd exposed_shares(const PelletScene& scene, double spacing) {
  scene.validate();
  require(spacing >= 2e-5 && spacing <= 2e-3, "spacing: must be 0.00002 to 0.002 m");
  AlignedBox3d all;
  std::vector<AlignedBox3d> boxes;
  for (const Pellet& p : scene.pellets) boxes.push_back(box_around(p)), all.extend(boxes.back());
  Eigen::VectorXd seen = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(boxes.size()));
  if (boxes.empty()) return seen;
  const Eigen::VectorXi cells = ((all.sizes() / spacing).array().ceil() + 1.0).matrix().cast<int>();
  Eigen::VectorXd alone = seen;
  Eigen::MatrixXd height = Eigen::MatrixXd::Constant(cells.x(), cells.y(), -std::numeric_limits<double>::infinity());
  Eigen::MatrixXi top = Eigen::MatrixXi::Constant(cells.x(), cells.y(), -1);
  for (int i = 0; i < seen.size(); ++i) {
    const Pellet& p = scene.pellets[static_cast<std::size_t>(i)];
    const AlignedBox3d& box = boxes[static_cast<std::size_t>(i)];
    const Eigen::Matrix3d to_pellet = p.T_bin_pellet.linear().transpose();
    const Eigen::Vector3i from = ((box.min() - all.min()) / spacing).cast<int>();
    const Eigen::Vector3i to = ((box.max() - all.min()) / spacing).cast<int>();
    for (int y = from.y(); y <= to.y(); ++y)
      for (int x = from.x(); x <= to.x(); ++x) {
        const Vector3d above = all.min() + Vector3d((x + 0.5) * spacing, (y + 0.5) * spacing, all.sizes().z() + 1.0);
        Vector3d normal;
        const double down = meet_cylinder(to_pellet * (above - p.T_bin_pellet.translation()), -to_pellet.col(2),
                                          p.radius, 0.5 * p.height, normal);
        if (!std::isfinite(down)) continue;
        alone[i] += 1.0;
        if (above.z() - down > height(x, y)) height(x, y) = above.z() - down, top(x, y) = i;
      }
  }
  for (Eigen::Index k = 0; k < top.size(); ++k)
    if (top.data()[k] >= 0) seen[top.data()[k]] += 1.0;
  return seen.cwiseQuotient(alone.cwiseMax(1.0));
}

}  // namespace kr5::sim
