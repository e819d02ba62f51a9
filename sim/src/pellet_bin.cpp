// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/pellet_bin.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/geometry/pose.hpp>

#include "cylinder_contact.hpp"
#include "pile_dynamics.hpp"

namespace kr5::sim {
namespace {

using Eigen::Vector3d;

void require_positive(double value, const char* field) {
  require(std::isfinite(value) && value > 0.0, std::string(field) + ": must be positive");
}

CylinderBody body_of(const Pellet& pellet) {
  return {pellet.T_bin_pellet.translation(), pellet.T_bin_pellet.linear(), pellet.radius, 0.5 * pellet.height};
}

/// Highest point of a pellet [m].
double top_of(const Pellet& pellet) {
  const double cosine = std::min(1.0, std::abs(pellet.T_bin_pellet.linear()(2, 2)));
  return pellet.T_bin_pellet.translation().z() + 0.5 * pellet.height * cosine +
         pellet.radius * std::sqrt(1.0 - cosine * cosine);
}

double top_of(const PileDynamics& pile, int count) {
  double top = 0.0;
  for (int i = 0; i < count; ++i) top = std::max(top, top_of(pile.pellet(i)));
  return top;
}

SettledPile result_of(const PileDynamics& pile, const BinShape& bin, int count) {
  SettledPile out{{bin, {}}, pile.state()};
  for (int i = 0; i < count; ++i) out.scene.pellets.push_back(pile.pellet(i));
  out.state.penetration = deepest_overlap(out.scene);
  return out;
}

/// The next layer of a pour: pellets on a grid that leaves each of them room to turn.
class Pour {
 public:
  Pour(const BinShape& bin, const PourOptions& options)
      : options_(options), random_(static_cast<std::uint64_t>(options.seed)) {
    spacing_ = 1.04 * std::hypot(2.0 * options.radius, options.height_max);
    const auto places = [&](double room) {
      return std::max(1, static_cast<int>(std::floor(std::min(options.width, room) / spacing_)));
    };
    across_ = places(bin.size.x()), along_ = places(bin.size.y());
  }

  int left() const { return options_.pellets - poured_; }
  double spacing() const { return spacing_; }

  void add_layer(PileDynamics& pile, double floor) {
    const double turn_x = random_.uniform(-0.5, 0.5),
                 turn_y = random_.uniform(-0.5, 0.5);  // of a stack of single pellets
    for (int k = 0; k < across_ * along_ && left() > 0; ++k, ++poured_) {
      Pellet pellet;
      pellet.radius = options_.radius;
      pellet.height = random_.uniform(options_.height_min, options_.height_max);
      const double x = place(k % across_, across_, turn_x), y = place(k / across_, along_, turn_y);
      pellet.T_bin_pellet.translation() = Vector3d(x, y, floor + 0.5 * spacing_);
      pellet.T_bin_pellet.linear() = rotation_from_z(random_.direction());
      pile.add(pellet);
    }
  }

 private:
  double place(int k, int count, double turn) const {
    const double free = count > 1 ? 0.0 : spacing_;
    return spacing_ * (k - 0.5 * (count - 1)) + turn * free * 0.25;
  }

  PourOptions options_;
  Random random_;
  double spacing_ = 0.0;
  int across_ = 1, along_ = 1, poured_ = 0;
};

void run_to_rest(PileDynamics& pile, double end, const std::function<void(double)>& tell) {
  const double start = pile.time();
  for (int k = 0; !pile.at_rest() && pile.time() < end; ++k) {
    pile.damp_since(start);
    pile.step();
    if (tell && k % 25 == 0) tell((pile.time() - start) / (end - start));
  }
}

}  // namespace

void BinShape::validate() const {
  require(size.allFinite() && size.minCoeff() > 0.0, "size: must be three positive lengths");
  require_positive(wall, "wall");
  require(is_rotation(T_base_bin.linear()) && T_base_bin.matrix().allFinite(), "T_base_bin: must be a rigid motion");
}

void PelletScene::validate() const {
  bin.validate();
  for (std::size_t i = 0; i < pellets.size(); ++i) {
    const std::string name = "pellets[" + std::to_string(i) + "]";
    const Pellet& p = pellets[i];
    require(std::isfinite(p.radius) && p.radius > 0.0, name + ".radius: must be positive");
    require(std::isfinite(p.height) && p.height > 0.0, name + ".height: must be positive");
    require(p.T_bin_pellet.matrix().allFinite() && is_rotation(p.T_bin_pellet.linear()),
            name + ".T_bin_pellet: must be a rigid motion");
  }
}

void PileOptions::validate() const {
  require_positive(density, "density");
  require(std::isfinite(friction) && friction >= 0.0, "friction: must not be negative");
  require(restitution >= 0.0 && restitution <= 1.0, "restitution: must be 0 to 1");
  require(step > 0.0 && step <= 0.005, "step: must be positive and at most 0.005 s");
  require_positive(timeout, "timeout");
}

void PourOptions::validate() const {
  require(pellets >= 1 && pellets <= 5000, "pellets: must be 1 to 5000");
  require_positive(radius, "radius");
  require_positive(height_min, "height_min");
  require(std::isfinite(height_max) && height_max >= height_min, "height_max: must be height_min or more");
  require_positive(width, "width");
}

void RemovalOptions::validate() const {
  require_positive(force, "force");
  require_positive(speed, "speed");
  require(std::isfinite(pull) && pull >= 0.0, "pull: must not be negative");
  require_positive(slip, "slip");
  require_positive(cup_radius, "cup_radius");
  require_positive(min_moved, "min_moved");
}

SettledPile pour_pellets(const BinShape& bin, const PourOptions& pour, const PileOptions& options,
                         const PileProgress& progress) {
  bin.validate(), pour.validate(), options.validate();
  Pour source(bin, pour);
  require(bin.size.head<2>().minCoeff() > source.spacing(),
          "size: must be longer than the diagonal of a pellet along X and Y");
  PileDynamics pile(bin, options);
  const auto tell = [&](double share) {
    if (progress) progress(std::clamp(share, 0.0, 1.0));
  };
  while (source.left() > 0) {
    const int lying = static_cast<int>(pile.bodies().size());
    source.add_layer(pile, std::max(top_of(pile, lying), 0.0) + 1e-3);
    const double fall = std::sqrt(2.0 * source.spacing() / 9.81);
    for (const double end = pile.time() + fall; pile.time() < end;) pile.step();
    tell(0.6 * (pour.pellets - source.left()) / pour.pellets);
  }
  run_to_rest(pile, pile.time() + options.timeout, [&](double share) { tell(0.6 + 0.4 * std::sqrt(share)); });
  tell(1.0);
  SettledPile out = result_of(pile, bin, pour.pellets);
  const double top = top_of(pile, pour.pellets);
  require(top <= bin.size.z(), "pellets: the pile of " + std::to_string(pour.pellets) + " is " + std::to_string(top) +
                                   " m high and the bin only " + std::to_string(bin.size.z()) +
                                   " m; choose fewer pellets, a larger bin, or a larger width of the pour");
  return out;
}

SettledPile settle(const PelletScene& scene, const PileOptions& options, const PileProgress& progress) {
  scene.validate(), options.validate();
  PileDynamics pile(scene.bin, options);
  for (const Pellet& pellet : scene.pellets) pile.add(pellet);
  run_to_rest(pile, options.timeout, progress);
  if (progress) progress(1.0);
  return result_of(pile, scene.bin, static_cast<int>(scene.pellets.size()));
}

namespace {

/// Pulls a body along and up; false when the suction cup lost it.
bool pull_out(PileDynamics& pile, int body, const Vector3d& along, double lift, const RemovalOptions& removal,
              double step) {
  Vector3d wanted = pile.bodies()[static_cast<std::size_t>(body)].shape.centre;
  const double end = wanted.z() + lift;
  double way = 0.0;
  while (wanted.z() < end) {
    const Vector3d direction = way < removal.pull ? along : Vector3d(Vector3d::UnitZ());
    pile.hold(body, removal.speed * direction, removal.force, 0.5 * removal.force * removal.cup_radius);
    pile.step();
    way += removal.speed * step;
    wanted += removal.speed * step * direction;
    if ((pile.bodies()[static_cast<std::size_t>(body)].shape.centre - wanted).norm() > removal.slip) return false;
  }
  return true;
}

/// What became of the pellets of `before`, of which number `pellet` was pulled.
void describe(const PileDynamics& pile, const PelletScene& before, int pellet, double min_moved, Removal& out) {
  const int count = static_cast<int>(before.pellets.size());
  out.shift = out.turn = Eigen::VectorXd::Zero(count);
  out.scene.bin = before.bin;
  for (int i = 0, now = 0; i < count; ++i) {
    if (out.removed && i == pellet) continue;
    const Pose& was = before.pellets[static_cast<std::size_t>(i)].T_bin_pellet;
    const Pellet after = pile.pellet(now++);
    const Vector3d a = was.linear().col(2), b = after.T_bin_pellet.linear().col(2);
    out.shift[i] = (after.T_bin_pellet.translation() - was.translation()).norm();
    out.turn[i] = std::atan2(a.cross(b).norm(), std::abs(a.dot(b)));
    if (out.shift[i] > min_moved) out.moved.push_back(i);
    out.scene.pellets.push_back(after);
  }
  out.state = pile.state();
  out.state.penetration = deepest_overlap(out.scene);
}

}  // namespace

Removal remove_pellet(const PelletScene& scene, int pellet, const Vector3d& approach, const RemovalOptions& removal,
                      const PileOptions& options) {
  scene.validate(), removal.validate(), options.validate();
  const int count = static_cast<int>(scene.pellets.size());
  require(pellet >= 0 && pellet < count, "pellet: must be 0 to " + std::to_string(count - 1));
  require(approach.allFinite() && approach.z() > 0.0, "approach: must point up, out of the bin");
  PileDynamics pile(scene.bin, options);
  for (const Pellet& p : scene.pellets) pile.add(p, true);
  pile.wake_neighbours(pellet, 1e-4);
  const CylinderBody start = body_of(scene.pellets[static_cast<std::size_t>(pellet)]);
  const double top = std::max(scene.bin.size.z(), top_of(pile, count));
  const double lift = top + 2.0 * start.reach() - start.centre.z();

  Removal out;
  out.removed = pull_out(pile, pellet, approach.normalized(), lift, removal, options.step);
  pile.release();
  if (out.removed) pile.remove(pellet);
  run_to_rest(pile, pile.time() + options.timeout, {});
  describe(pile, scene, pellet, removal.min_moved, out);
  return out;
}

double deepest_overlap(const PelletScene& scene) {
  constexpr double spacing = 5e-4;
  double deepest = 0.0;
  const double half_x = 0.5 * scene.bin.size.x(), half_y = 0.5 * scene.bin.size.y();
  for (std::size_t i = 0; i < scene.pellets.size(); ++i) {
    const Pellet& a = scene.pellets[i];
    const CylinderBody body = body_of(a);
    std::vector<CylinderBody> near;
    for (std::size_t j = 0; j < scene.pellets.size(); ++j) {
      const CylinderBody other = body_of(scene.pellets[j]);
      if (i != j && (other.centre - body.centre).norm() < other.reach() + body.reach()) near.push_back(other);
    }
    const int rings = static_cast<int>(std::ceil(a.height / spacing));
    const int around = static_cast<int>(std::ceil(2.0 * std::numbers::pi * a.radius / spacing));
    for (int r = 0; r <= rings; ++r)
      for (int k = 0; k < around; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / around;
        const Vector3d p = a.T_bin_pellet * Vector3d(a.radius * std::cos(angle), a.radius * std::sin(angle),
                                                     a.height * (static_cast<double>(r) / rings - 0.5));
        deepest = std::max({deepest, -p.z(), std::abs(p.x()) - half_x, std::abs(p.y()) - half_y});
        Vector3d unused;
        for (const CylinderBody& other : near)
          deepest = std::max(deepest, -cylinder_distance(other.rotation.transpose() * (p - other.centre), other.radius,
                                                         other.half, unused));
      }
  }
  return deepest;
}

}  // namespace kr5::sim
