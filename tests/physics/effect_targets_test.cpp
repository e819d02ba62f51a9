// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/effect_targets.hpp>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>

namespace effect_targets_test {

using namespace kr5;
using Catch::Contains;

namespace {

cell::Cell arc() { return cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml"); }

}  // namespace

TEST_CASE("an effect on a part that the cell does not have is named with what is missing") {
  cell::Cell cell = arc();
  physics::check_effect_targets(cell);

  cell.effects.set("encoder_offset", "joint9", "offset", 1e-3);
  CHECK_THROWS_WITH(physics::check_effect_targets(cell),
                    Contains("effects.encoder_offset.joint9: the cell has only joint1 to joint6"));

  cell = arc();
  cell::set_effect(cell, "camera_focal", "camera", "fx", 1500.0);
  cell.camera.reset();
  CHECK_THROWS_WITH(physics::check_effect_targets(cell),
                    Contains("effects.camera_focal.camera: the cell has no camera"));

  cell = arc();
  cell::set_effect(cell, "tube_radius", "tube", "inner_radius", 0.0098);
  cell.tube.reset();
  CHECK_THROWS_WITH(physics::check_effect_targets(cell), Contains("effects.tube_radius.tube: the cell has no tube"));

  cell = arc();
  cell::set_effect(cell, "ft_bias", "fx", "bias", 1.0);
  cell.tool.reset();
  CHECK_THROWS_WITH(physics::check_effect_targets(cell), Contains("effects.ft_bias.fx: the cell has no tool"));
}

}  // namespace effect_targets_test
