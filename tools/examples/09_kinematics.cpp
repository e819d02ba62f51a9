// SPDX-License-Identifier: BSD-3-Clause
// True DH parameters of an arm from places of its tool that a tracker measured.  09_kinematics SHARE
#include <cmath>
#include <cstdio>

#include <kr5/calibration/kinematics.hpp>
#include <kr5/cell/cell.hpp>

using namespace kr5;

int main(int, char** argv) {
  const auto nominal = cell::nominal_chain(cell::load_cell(std::string(argv[1]) + "/cells/kr5_arc.yaml"));
  auto truth = nominal;
  truth.joints[1].a += 0.8e-3;                    // what the tracker will find [m]
  truth.joints[2].theta_offset += 2e-3;           // [rad]
  const Eigen::Vector3d ball(0.05, -0.02, 0.12);  // on the flange [m]

  std::vector<calibration::ArmPosture> postures(40);
  for (int k = 0; k < 40; ++k) {
    Eigen::VectorXd q(6);
    for (int j = 0; j < 6; ++j) q[j] = 1.2 * std::sin((3 + j) * k + j);
    const Eigen::Vector3d noise(std::sin(7.0 * k), std::sin(11.0 * k), std::sin(13.0 * k));
    postures[static_cast<std::size_t>(k)].q = q;
    postures[static_cast<std::size_t>(k)].points = truth.flange(q) * ball + 1e-4 * noise;
  }

  const auto result = calibration::calibrate_kinematics(nominal, postures);
  for (const auto& p : result.coordinates)
    if (p.name == "arm.joint2.a" || p.name == "arm.joint3.theta_offset")
      std::printf("%s %+.3f +- %.3f 1e-3 %s\n", p.name.c_str(), 1e3 * (p.value - p.nominal), 1e3 * p.std,
                  p.unit.c_str());
  std::printf("noise %.3f mm\n", 1e3 * result.sigma_position);
}
