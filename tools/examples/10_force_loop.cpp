// SPDX-License-Identifier: BSD-3-Clause
// A force loop from a step and ten readings of a contact: servo, stiffness, gain.  10_force_loop SHARE
#include <algorithm>
#include <cmath>
#include <cstdio>

#include <kr5/identification/contact_stiffness.hpp>
#include <kr5/identification/force_loop_design.hpp>
#include <kr5/identification/servo.hpp>

using namespace kr5;

int main() {
  // A step of 24 mm, read every 12 ms; its response as a critically damped servo of 4 rad/s, 30 ms late, would show it.
  identification::ServoLog log;
  log.t = Eigen::VectorXd::LinSpaced(400, 0.0, 399 * 0.012);
  log.command = Eigen::VectorXd::Constant(400, 0.024);
  log.command[0] = 0.0;
  const Eigen::ArrayXd since = 4.0 * (log.t.array() - 0.042).max(0.0);
  const Eigen::ArrayXd ripple = 1e-5 * (50 * log.t.array()).sin();
  log.response = 0.024 * (1 - (1 + since) * (-since).exp()) + ripple;
  const auto servo = identification::identify_servo(log);
  std::printf("servo: %.2f rad/s, damping %.3f, delay %.1f ms\n", servo.servo.natural_frequency,
              servo.servo.damping_ratio, 1e3 * servo.servo.delay);

  identification::ContactLog press;
  press.depth = Eigen::VectorXd::LinSpaced(10, -0.2e-3, 0.7e-3);
  press.force.resize(10);
  for (int i = 0; i < 10; ++i) press.force[i] = 23.38e3 * std::max(press.depth[i], 0.0) + (i % 2 ? 0.1 : -0.1);
  const auto contact = identification::identify_contact_stiffness(press);
  std::printf("contact: %.2f N/mm, from %d readings\n", 1e-3 * contact.stiffness, contact.contact_readings);

  const identification::ForceLoopPlant plant{
      .servo = servo.servo, .servo_gain = servo.gain, .stiffness = contact.stiffness};
  const auto design = identification::design_force_loop(plant, {.stiffness = contact.stiffness});
  std::printf("gain below %.3f mm/N; at 0.005 mm/N: compensator %.2f, overshoot %.1f %%\n",
              1e3 * design.nominal.gain_limit, design.compensator, 100 * design.nominal.overshoot);
}
