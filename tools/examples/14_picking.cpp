// SPDX-License-Identifier: BSD-3-Clause
// Bin picking: poses of cylinders from a cloud, grasps clear of the walls, order.  14_picking SHARE
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include <kr5/core/fields.hpp>
#include <kr5/picking/grasp.hpp>
#include <kr5/picking/pellets.hpp>

using namespace kr5::picking;

int main() {
  // A bin of 120 x 120 mm as seen from above: two cylinders lie beside each other, one of
  // them on a shim of 2 mm, and one stands by the wall.
  Cloud cloud;
  cloud.points.resize(3, 200 * 200);
  for (int i = 0; i < 200; ++i)
    for (int k = 0; k < 200; ++k) {
      const double x = 0.0006 * i - 0.0597, y = 0.0006 * k - 0.0597;
      double z = 0;
      for (const auto& [centre, height] : {std::pair(-0.02, 0.008), std::pair(-0.003, 0.010)})
        if (std::abs(x - centre) < 0.008 && std::abs(y) < 0.0075)
          z = height + std::sqrt(0.008 * 0.008 - (x - centre) * (x - centre));
      if (std::hypot(x - 0.0515, y - 0.02) < 0.008) z = 0.016;
      cloud.points.col(200 * i + k) = Eigen::Vector3d(x, y, z);
    }
  Bin bin;
  bin.size = {0.12, 0.12, 0.08};

  const PelletResult found = find_pellets(cloud, bin);
  std::printf("the cloud is %s, %zu cylinders found\n", std::string(kr5::name_of(found.check.finding)).c_str(),
              found.pellets.size());
  const auto pellet_of = [&](const Grasp& g) { return found.pellets[static_cast<std::size_t>(g.pellet)]; };
  for (const Grasp& grasp : plan_picks(found.pellets, cloud, bin)) {
    const Pellet pellet = pellet_of(grasp);
    const Eigen::Vector3d c = 1000 * pellet.centre;
    std::printf("%s at %.0f %.0f %.0f mm: %s\n", pellet.axis.z() > 0.9 ? "standing" : "lying", c.x(), c.y(), c.z(),
                grasp.reason.c_str());
  }

  // A gripper as wide as this touches the wall beside the one that stands.
  GraspOptions wide;
  wide.gripper = {{.radius = 0.009, .start = 0.001, .end = 0.15}};
  wide.max_tilt = 0;
  for (const Grasp& grasp : plan_picks(found.pellets, cloud, bin, wide))
    if (pellet_of(grasp).axis.z() > 0.9)
      std::printf("with a wide gripper: %s\n", std::string(kr5::name_of(grasp.finding)).c_str());

  // In millimetres the cloud is refused.
  cloud.points *= 1000;
  std::printf("%s\n", std::string(kr5::name_of(find_pellets(cloud, bin).check.finding)).c_str());
}
