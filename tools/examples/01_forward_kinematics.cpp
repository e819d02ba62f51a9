// SPDX-License-Identifier: BSD-3-Clause
// Where the tool tip of a cell stands, joint by joint.  01_forward_kinematics SHARE
#include <cstdio>

#include <kr5/cell/cell.hpp>

int main(int, char** argv) {
  const kr5::cell::Cell cell = kr5::cell::load_cell(std::string(argv[1]) + "/cells/kr5_arc.yaml");
  const Eigen::VectorXd q = (Eigen::VectorXd(6) << 0.1, -0.5, -3.2, 0.2, 0.4, 0.3).finished();
  for (const kr5::Pose& T : kr5::cell::nominal_chain(cell).link_poses(q))
    std::printf("link at %.2f %.2f %.2f mm\n", 1e3 * T(0, 3), 1e3 * T(1, 3), 1e3 * T(2, 3));
  const kr5::Pose T = kr5::cell::T_base_tool(cell, q);
  std::printf("tip at %.2f %.2f %.2f mm\n", 1e3 * T(0, 3), 1e3 * T(1, 3), 1e3 * T(2, 3));
}
