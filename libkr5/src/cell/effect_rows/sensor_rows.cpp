// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "cell/effect_rows.hpp"
#include "cell/effect_rows/row_parts.hpp"

namespace kr5::cell {

using namespace rows;

namespace {

/// A mount on the flange, in the nominal tool tip.
std::optional<EffectValue> at_tip(const Cell& cell, const std::optional<Pose>& T_flange_x) {
  if (!T_flange_x) return std::nullopt;
  const Pose T_tool_flange = cell.tool ? cell.tool->T_flange_tool.inverse() : Pose::Identity();
  return EffectValue(Pose(T_tool_flange * *T_flange_x));
}

}  // namespace

std::vector<Effect> sensor_rows() {
  using enum EffectTarget;
  return {
      {.id = "ft_bias",
       .target = WrenchComponent,
       .label = "offset of the force sensor",
       .description = "sensor offset",
       .shows_in = in_wrench,
       .remedy = "Tare the sensor before each run.",
       .parameters = {{.name = "bias",
                       .unit = "N or N m",
                       .lower = -1e4,
                       .upper = 1e4,
                       .description = "added to the component",
                       .size = [](const EffectSite& at) { return 5 * typical::wrench_noise(at.cell, at.index); }}}},
      {.id = "ft_drift",
       .target = WrenchComponent,
       .label = "drift of the force sensor",
       .description = "sensor offset drifts with time",
       .shows_in = in_wrench + ", growing with time",
       .remedy = "Let the sensor warm up; tare it more often.",
       .parameters = {{.name = "rate",
                       .unit = "N/s or N m/s",
                       .lower = -100,
                       .upper = 100,
                       .description = "of the component over t",
                       .size =
                           [](const EffectSite& at) {
                             return 5 * typical::wrench_noise(at.cell, at.index) / std::max(at.last_time, 1.0);
                           }}}},
      {.id = "ft_gain",
       .target = WrenchComponent,
       .label = "scale of the force sensor",
       .description = "sensor scale differs",
       .shows_in = in_wrench + ", in proportion to the load",
       .remedy = "Calibrate the sensor with a known weight.",
       .parameters = {{.name = "gain",
                       .unit = "-",
                       .off = {1.0},
                       .lower = -100,
                       .upper = 100,
                       .description = "factor on the component, 1 nominal; negative: reversed sign",
                       .size = constant(typical::scale),
                       .range =
                           [](const EffectSite&) {
                             return ValueRange{0.0, 100.0};
                           }}}},
      {.id = "ft_crosstalk",
       .target = WrenchComponent,
       .label = "crosstalk of the force sensor",
       .description = "one component leaks into another: component += gain source",
       .shows_in = in_wrench + ", in proportion to another one",
       .remedy = "Set the sensor's calibration matrix; check its mounting screws.",
       .parameters = {{.name = "source",
                       .kind = EffectValueKind::Whole,
                       .unit = "-",
                       .upper = 5,
                       .description = "wrench component that leaks in, fx to tz",
                       .coordinate = CoordinateKind::Choice,
                       .choices =
                           [](const EffectSite& at) {
                             std::vector<EffectChoice> out;
                             for (int i = 0; i < 6; ++i)
                               if (i != at.index) out.push_back({i, "from " + target_name(WrenchComponent, i)});
                             return out;
                           },
                       .refers_to = WrenchComponent},
                      {.name = "gain",
                       .unit = "-, m or 1/m",
                       .lower = -100,
                       .upper = 100,
                       .description = "gain of the crosstalk",
                       .size =
                           [](const EffectSite& at) {
                             return typical::scale * typical::wrench_noise(at.cell, at.index) /
                                    typical::wrench_noise(at.cell, at.choice);
                           }}}},
      {.id = "ft_lag",
       .target = ForceTorque,
       .label = "filter of the force sensor",
       .description = "sensor filter lag",
       .shows_in = "the whole wrench where it changes fast",
       .remedy = "Look up the filter of the sensor, or set its time constant in the cell.",
       .parameters = {{.name = "time_constant",
                       .unit = "s",
                       .upper = 10,
                       .description = "of the filter",
                       .size = constant(typical::half_cycle),
                       .signature_at = at({2.0, 8.0}),
                       .step = 0.1}}},
      {.id = "camera_focal",
       .target = Camera,
       .label = "focal length",
       .description = "focal length differs",
       .shows_in = "u and v of views: growing with the distance from the middle of the image",
       .remedy = "Calibrate the camera again with `kr5 calibrate camera`.",
       .parameters = {{.name = "fx",
                       .unit = "px",
                       .lower = 1,
                       .upper = 1e6,
                       .required = false,
                       .description = "along x",
                       .nominal = [](const EffectSite& at) { return at.cell.camera->fx; },
                       .size = [](const EffectSite& at) { return 2e-3 * at.cell.camera->fx; }},
                      {.name = "fy",
                       .unit = "px",
                       .lower = 1,
                       .upper = 1e6,
                       .required = false,
                       .description = "along y",
                       .nominal = [](const EffectSite& at) { return at.cell.camera->fy; },
                       .size = [](const EffectSite& at) { return 2e-3 * at.cell.camera->fy; }}}},
      {.id = "lens_distortion",
       .target = Camera,
       .label = "lens distortion",
       .description = "distortion differs",
       .shows_in = "u and v of views: largest near the corners of the image",
       .remedy = "Calibrate the camera again with `kr5 calibrate camera`.",
       .parameters = {{.name = "k1",
                       .unit = "-",
                       .lower = -10,
                       .upper = 10,
                       .required = false,
                       .description = "radial, rho",
                       .nominal = [](const EffectSite& at) { return at.cell.camera->pinhole().k1; },
                       .size = constant(0.01)},
                      {.name = "k2",
                       .unit = "-",
                       .lower = -100,
                       .upper = 100,
                       .required = false,
                       .description = "radial, rho^2",
                       .nominal = [](const EffectSite& at) { return at.cell.camera->pinhole().k2; },
                       .size = constant(0.02)}}},
      {.id = "hand_eye",
       .target = Camera,
       .label = "camera mount",
       .description = "camera mount differs",
       .shows_in = "u and v of views",
       .remedy = "Calibrate the pose of the camera with `kr5 calibrate hand-eye`; check whether it is loose.",
       .parameters = {{.name = "T_E_C",
                       .kind = EffectValueKind::Pose,
                       .unit = "m, rad",
                       .lower = -inf,
                       .upper = inf,
                       .description = "camera in the nominal tool tip",
                       .coordinate = CoordinateKind::Mount,
                       .nominal = [](const EffectSite& at) { return at_tip(at.cell, T_flange_camera(at.cell)); },
                       .size = constant(typical::length)}},
       .needs = {"camera on the arm", [](const Cell& cell) { return T_flange_camera(cell).has_value(); }}},
      {.id = "laser_mount",
       .target = Laser,
       .label = "scanner mount",
       .description = "scanner mount differs",
       .shows_in = "z of scans",
       .remedy = "Calibrate the pose of the scanner; check whether it is loose.",
       .parameters = {{.name = "T_E_L",
                       .kind = EffectValueKind::Pose,
                       .unit = "m, rad",
                       .lower = -inf,
                       .upper = inf,
                       .description = "scanner in the nominal tool tip",
                       .coordinate = CoordinateKind::Mount,
                       .nominal = [](const EffectSite& at) { return at_tip(at.cell, T_flange_scanner(at.cell)); },
                       .size = constant(typical::length)}},
       .needs = {"line scanner on the arm", [](const Cell& cell) { return T_flange_scanner(cell).has_value(); }}},
      {.id = "laser_bias",
       .target = Laser,
       .label = "range error of the scanner",
       .description = "range error that grows away from the best stand-off, bias ((z - stand_off) / bias_distance)^2",
       .shows_in = "z of scans: grows away from the best stand-off",
       .remedy = "Scan at the stand-off that the manufacturer specifies.",
       .parameters = {{.name = "bias",
                       .unit = "m",
                       .lower = -0.1,
                       .upper = 0.1,
                       .description = "range error at bias_distance from the best stand-off",
                       .size = constant(2e-4)}}},
      {.id = "laser_lag",
       .target = Laser,
       .label = "late profiles",
       .description = "profile is late relative to the robot position",
       .shows_in = "z of scans on slopes: in proportion to the scanning speed",
       .remedy = "Trigger the scanner by the robot's position, or set the lag.",
       .parameters = {{.name = "lag",
                       .unit = "s",
                       .lower = -1,
                       .upper = 1,
                       .description = "the profile was taken speed lag further back along Y",
                       .size = constant(typical::half_cycle)}}},
  };
}

}  // namespace kr5::cell
