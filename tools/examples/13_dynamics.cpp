// SPDX-License-Identifier: BSD-3-Clause
// Dynamics of an arm from a log of positions and torques: check, smooth, identify, predict.  13_dynamics SHARE
#include <cmath>
#include <cstdio>
#include <string>

#include <kr5/cell/cell.hpp>
#include <kr5/identification/dynamics.hpp>
#include <kr5/identification/excitation.hpp>
#include <kr5/identification/log_conditioning.hpp>

using namespace kr5;

int main(int, char** argv) {
  const auto cell = cell::load_cell(std::string(argv[1]) + "/cells/kr5_arc.yaml");
  const Eigen::Index n = cell.robot.joints(), samples = 2500;

  // A log as a controller writes it, every 12 ms; here the motion of each joint is two sines within its limits.
  identification::JointMotion states;
  states.t = Eigen::VectorXd::LinSpaced(samples, 0.0, 0.012 * static_cast<double>(samples - 1));
  const Eigen::VectorXd middle = 0.5 * (cell.robot.limits->lower + cell.robot.limits->upper);
  states.q = middle.transpose().replicate(samples, 1);
  states.qd = states.qdd = states.tau = Eigen::MatrixXd::Zero(samples, n);
  for (Eigen::Index joint = 0; joint < n; ++joint) {
    const auto j = static_cast<double>(joint);
    for (const auto& [amplitude, w] : {std::pair{0.5, 0.9 + 0.23 * j}, std::pair{0.25, 2.6 + 0.31 * j}}) {
      const Eigen::ArrayXd angle = w * states.t.array();
      states.q.col(joint).array() += amplitude * angle.sin();
      states.qd.col(joint).array() += amplitude * w * angle.cos();
      states.qdd.col(joint).array() -= amplitude * w * w * angle.sin();
    }
  }
  identification::JointLog log;
  log.t = states.t;
  log.q = states.q;
  log.tau = identification::nominal_torques(cell, states);

  const auto conditioned = identification::condition_log(log, {.smooth_torques = false});
  std::printf("%d findings about the log\n", static_cast<int>(conditioned.findings.size()));
  identification::DynamicsModel model;
  model.chain = cell::nominal_chain(cell);
  model.gravity = cell.robot.gravity;
  model.structure = cell.drives->structure;
  const auto found = identification::identify_dynamics(conditioned.motion, model);
  std::printf("%d base parameters of %d, usable: %s\n", found.base.size(),
              static_cast<int>(found.base.parameters.size()), found.fit.usable() ? "yes" : "no");
  std::printf("torques held out predicted within 2 %%: %s\n", found.held_out.total < 0.02 ? "yes" : "no");
  std::printf("friction of joint 3: %.1f N m, in the cell %.1f N m\n", found.parameter("fc3")->first,
              cell.drives->friction.coulomb[2]);

  // Torques of joint 2 with the wrong sign: the log is refused, and the column named.
  log.tau.col(1) *= -1.0;
  const auto refused = identification::condition_log(log);
  std::printf("usable: %s; %s: %s\n", refused.usable() ? "yes" : "no", refused.findings.front().column.c_str(),
              std::string(name_of(refused.findings.front().fault)).c_str());
}
