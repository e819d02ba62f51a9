// SPDX-License-Identifier: BSD-3-Clause
// Which parameter of an arm moves its flange most, at a pose.  07_sensitivity SHARE
#include <cmath>
#include <cstdio>

#include <kr5/cell/cell.hpp>
#include <kr5/kinematics/deviated_arm.hpp>
#include <kr5/uncertainty/sobol.hpp>

using namespace kr5;

int main(int, char** argv) {
  const cell::Cell cell = cell::load_cell(std::string(argv[1]) + "/cells/kr5_arc_printed.yaml");
  const double degree = std::acos(-1.0) / 180;
  kinematics::DeviatedArm arm{.nominal = cell::nominal_chain(cell), .parameters = {}, .q = {}};
  arm.parameters = kinematics::joint_parameters(arm.nominal);
  arm.q = (Eigen::VectorXd(6) << 0, 70, 12, 0, 0, 0).finished() * degree;
  std::vector<uncertainty::UncertainInput> inputs;
  for (const kinematics::JointParameter& p : arm.parameters)
    inputs.push_back({.name = p.label(), .sigma = p.is_length() ? 1e-3 : degree});

  const auto model = [&](const uncertainty::Rows& x) { return arm.errors(x); };
  const auto result = uncertainty::sobol_indices(model, inputs, {.samples = 4096, .resolution = 1e-12});
  for (int axis = 0; axis < 3; ++axis) {
    std::printf("%c varies by %.1f mm:", "XYZ"[axis], 1e3 * std::sqrt(result.variance[axis]));
    for (std::size_t k = 0; k < inputs.size(); ++k)
      if (const double index = result.total(static_cast<Eigen::Index>(k), axis); index > 0.1)
        std::printf(" %s %.2f", inputs[k].name.c_str(), index);
    std::printf("\n");
  }
}
