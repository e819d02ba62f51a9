#include <catch2/catch.hpp>

#include "predict/world.hpp"

namespace cell_effects_test {

using namespace kr5;
using namespace kr5::test;
using cell::Kind;
using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

VectorXd reading(const World& w, Kind kind, Index row) {
  VectorXd q(6);
  for (int i = 0; i < 6; ++i) q[i] = w.of(kind).data.column("q" + std::to_string(i + 1))[row];
  return q;
}

Pose pose_of(const io::Table& shown, Index row) {
  const VectorXd v = shown.values.row(row).transpose();
  Pose T = Pose::Identity();
  T.translation() = v.head<3>();
  T.linear() = Eigen::Quaterniond(v[3], v[4], v[5], v[6]).toRotationMatrix();
  return T;
}

/// Each pose shown must be that of `truth(reading, t)`.
template <class Truth>
void check_poses(const World& w, Truth truth) {
  const io::Table shown = w.show(Kind::Poses);
  const VectorXd t = w.of(Kind::Poses).data.column("t");
  for (Index row = 0; row < shown.values.rows(); ++row)
    CHECK(pose_of(shown, row).isApprox(truth(reading(w, Kind::Poses, row), t[row]), 1e-12));
}

VectorXd difference(const World& before, const World& after, Kind kind, const std::string& column) {
  return after.show(kind, column) - before.show(kind, column);
}

double largest(const VectorXd& v) { return v.cwiseAbs().maxCoeff(); }

}  // namespace

TEST_CASE("a payload adds its weight at its lever arm") {
  const World w;
  const World loaded = w.with("payload", "tool", {{"mass", 0.5}, {"com", numbers({0.02, -0.01, 0.1})}});
  for (const Kind kind : {Kind::Press, Kind::Profile}) {
    CHECK(largest((difference(w, loaded, kind, "fz").array() - 0.5 * 9.81).matrix()) < 1e-9);
    CHECK(largest((difference(w, loaded, kind, "tx").array() + 0.01 * 0.5 * 9.81).matrix()) < 1e-9);
    CHECK(largest((difference(w, loaded, kind, "ty").array() + 0.02 * 0.5 * 9.81).matrix()) < 1e-9);
  }
  // At rest in the first row of a motion, where the tool points down but for the posture's own angle.
  CHECK(difference(w, loaded, Kind::Motion, "fz")[0] == Approx(0.5 * 9.81).epsilon(0.01));
}

TEST_CASE("a tilted base turns every pose about the base, and the weight with it") {
  const World w;
  const World tilted = w.with("base_tilt", "base", {{"roll", 0.02}, {"pitch", -0.03}});
  const Pose tilt(Eigen::AngleAxisd(-0.03, Vector3d::UnitY()) * Eigen::AngleAxisd(0.02, Vector3d::UnitX()));
  check_poses(tilted, [&](const VectorXd& q, double) { return tilt * cell::T_base_tool(w.cell, q); });
  const auto force = [](const World& of) {
    return Vector3d(of.show(Kind::Motion, "fx")[0], of.show(Kind::Motion, "fy")[0], of.show(Kind::Motion, "fz")[0]);
  };
  CHECK(force(tilted).norm() == Approx(force(w).norm()).epsilon(1e-9));
  CHECK(std::acos(force(tilted).normalized().dot(force(w).normalized())) ==
        Approx(std::hypot(0.02, 0.03)).epsilon(0.01));
}

TEST_CASE("an encoder offset turns the joint and not its reading") {
  const World w;
  const World off = w.with("encoder_offset", "joint3", {{"offset", 0.004}});
  CHECK(off.show(Kind::Motion, "q3") == w.show(Kind::Motion, "q3"));
  check_poses(off, [&](VectorXd q, double) {
    q[2] += 0.004;
    return cell::T_base_tool(w.cell, q);
  });
}

TEST_CASE("a wrong length or twist of a link is that of the chain") {
  World w;
  World truth = w;
  truth.cell.robot.dh[3].b = 0.625;
  truth.cell.robot.dh[1].a = 0.597;
  truth.cell.robot.dh[0].alpha = 1.575;
  const World off = w.with("link_length", "joint4", {{"b", 0.625}})
                        .with("link_length", "joint2", {{"a", 0.597}})
                        .with("link_twist", "joint1", {{"alpha", 1.575}});
  for (const Kind kind : {Kind::Motion, Kind::Poses, Kind::Views, Kind::Scan})
    CHECK((off.show(kind).values - truth.show(kind).values).cwiseAbs().maxCoeff() == 0.0);
}

TEST_CASE("a transmission error is periodic in the joint angle") {
  const World w;
  const World off = w.with("transmission_error", "joint2", {{"amplitude", 0.002}, {"cycles", 5.0}, {"phase", 0.4}});
  CHECK(off.show(Kind::Motion, "q2") == w.show(Kind::Motion, "q2"));
  check_poses(off, [&](VectorXd q, double) {
    q[1] += 0.002 * std::sin(5.0 * q[1] + 0.4);
    return cell::T_base_tool(w.cell, q);
  });
}

TEST_CASE("a tool offset moves the tip along its own axes, and not camera nor scanner") {
  const World w;
  const Vector3d offset(0.001, -0.002, 0.003);
  const World off = w.with("tool_offset", "tool", {{"offset", VectorXd(offset)}});
  check_poses(off, [&](const VectorXd& q, double) {
    Pose T = cell::T_base_tool(w.cell, q);
    return Pose(T.translate(offset));
  });
  CHECK(largest(difference(w, off, Kind::Views, "u")) == 0.0);
  CHECK(largest(difference(w, off, Kind::Scan, "z")) == 0.0);
}

TEST_CASE("links grow as the session goes on") {
  const World w;
  const World grown = w.with("thermal_growth", "links", {{"growth", 0.001}, {"time_constant", 250.0}});
  check_poses(grown, [&](const VectorXd& q, double t) {
    cell::Cell warm = w.cell;
    for (auto& row : warm.robot.dh) {
      row.a *= 1 + 0.001 * (1 - std::exp(-t / 250.0));
      row.b *= 1 + 0.001 * (1 - std::exp(-t / 250.0));
    }
    return cell::T_base_tool(warm, q);
  });
}

TEST_CASE("the path correction answers slower, overshoots less, or answers later") {
  const World w;
  const VectorXd z = w.show(Kind::Step, "z");
  const VectorXd slow = w.with("tool_servo", "servo", {{"natural_frequency", 2.0}}).show(Kind::Step, "z");
  const auto half = [](const VectorXd& x) {
    Index k = 0;
    while (x[k] < 0.005) ++k;
    return static_cast<double>(k);
  };
  CHECK(half(slow) - 22 == Approx((half(z) - 22) * w.cell.servo->tool->natural_frequency / 2.0).margin(1.5));
  const double damping = 0.5, overshoot = std::exp(-M_PI * damping / std::sqrt(1 - damping * damping));
  const VectorXd lively = w.with("tool_damping", "servo", {{"damping_ratio", damping}}).show(Kind::Step, "z");
  CHECK(lively.head(300).maxCoeff() == Approx(0.01 * (1 + overshoot)).epsilon(1e-3));
  const VectorXd late = w.with("tool_delay", "servo", {{"delay", 0.024 + 3 * 0.012}}).show(Kind::Step, "z");
  CHECK(late.segment(3, 297) == z.segment(0, 297));
}

TEST_CASE("bias, drift, scale and crosstalk of the force sensor act on their component") {
  const World w;
  const VectorXd t = w.of(Kind::Press).data.column("t"), fz = w.show(Kind::Press, "fz"), tx = w.show(Kind::Press, "tx");
  const auto after = [&](const char* id, const char* target, const Parameters& p) {
    return w.with(id, target, p).show(Kind::Press, target);
  };
  CHECK(largest((after("ft_bias", "fz", {{"bias", 2.0}}) - fz).array().matrix() - VectorXd::Constant(600, 2.0)) < 1e-9);
  CHECK(largest(after("ft_drift", "fz", {{"rate", 0.3}}) - fz - 0.3 * t) < 1e-9);
  CHECK(largest(after("ft_gain", "fz", {{"gain", 1.2}}) - 1.2 * fz) < 1e-9);
  CHECK(largest(after("ft_crosstalk", "tx", {{"source", 2.0}, {"gain", 0.02}}) - tx - 0.02 * fz) < 1e-9);
}

TEST_CASE("a lagging sensor follows a jump by one minus 1/e in its time constant") {
  const World w;
  const VectorXd fz = w.show(Kind::Press, "fz"),
                 late = w.with("ft_lag", "force_torque", {{"time_constant", 0.06}}).show(Kind::Press, "fz");
  const double part = 1 - std::exp(-0.012 / 0.06);
  for (Index k = 1; k < 300; ++k) CHECK(late[k] - late[k - 1] == Approx(part * (fz[k] - late[k - 1])).margin(1e-9));
  CHECK(late[300] == fz[300]);  // a new run begins anew
}

TEST_CASE("the camera is as its effects say") {
  const World w;
  const cell::Camera& c = *w.cell.camera;
  const World other = w.with("camera_focal", "camera", {{"fx", 1.01 * c.fx}, {"fy", 0.99 * c.fy}});
  CHECK(largest((other.show(Kind::Views, "u").array() - c.cx).matrix() -
                1.01 * (w.show(Kind::Views, "u").array() - c.cx).matrix()) < 1e-9);
  CHECK(largest((other.show(Kind::Views, "v").array() - c.cy).matrix() -
                0.99 * (w.show(Kind::Views, "v").array() - c.cy).matrix()) < 1e-9);
  World lens = w, moved = w;
  lens.cell.camera->distortion.values[0] = -0.19;
  lens.cell.camera->distortion.values[1] = 0.02;
  CHECK(w.with("lens_distortion", "camera", {{"k1", -0.19}, {"k2", 0.02}}).show(Kind::Views).values ==
        lens.show(Kind::Views).values);
  moved.cell.camera->T_tool_camera = *c.T_tool_camera * from_xyzrpy(0.01 * Vector6::Ones());
  CHECK(w.with("hand_eye", "camera", {{"T_E_C", *moved.cell.camera->T_tool_camera}}).show(Kind::Views).values ==
        moved.show(Kind::Views).values);
}

TEST_CASE("the scanner is as its effects say") {
  const World w;
  World moved = w;
  moved.cell.laser->T_tool_scanner = *w.cell.laser->T_tool_scanner * from_xyzrpy(0.002 * Vector6::Ones());
  CHECK(w.with("laser_mount", "laser", {{"T_E_L", *moved.cell.laser->T_tool_scanner}}).show(Kind::Scan).values ==
        moved.show(Kind::Scan).values);
  const VectorXd z = w.show(Kind::Scan, "z");
  const VectorXd bias = w.with("laser_bias", "laser", {{"bias", 0.001}}).show(Kind::Scan, "z") - z;
  CHECK(largest(bias - 0.001 * ((z.array() - 0.19) / 0.05).square().matrix()) < 1e-12);
  World back = w;  // 20 ms at 10 mm/s
  Pose T = *w.cell.laser->T_tool_scanner;
  back.cell.laser->T_tool_scanner = T.translate(Vector3d(0, -0.0002, 0));
  CHECK(largest(w.with("laser_lag", "laser", {{"lag", 0.02}}).show(Kind::Scan, "z") - back.show(Kind::Scan, "z")) <
        1e-12);
}

TEST_CASE("contact is as stiff, as hardening and as rough as its effects say") {
  World w;
  w.cell.contact->damping = 0.0;
  const double k = w.cell.contact->stiffness;
  const VectorXd depth = (-w.show(Kind::Press, "z")).cwiseMax(0.0), fz = w.show(Kind::Press, "fz");
  const double weight = w.cell.tool->mass * 9.81;
  REQUIRE(depth.maxCoeff() > 5e-4);
  const auto force = [&](const World& of) { return VectorXd(-(of.show(Kind::Press, "fz").array() - weight).matrix()); };
  CHECK(largest(force(w) - k * depth) < 1e-9);
  CHECK(largest(force(w.with("contact_stiffness", "contact", {{"stiffness", 2 * k}})) - 2 * k * depth) < 1e-9);
  const World hard = w.with("contact_hardening", "contact", {{"hardening", 0.5}});
  CHECK(largest(force(hard) - k * depth.cwiseProduct((1 + 500 * depth.array()).matrix())) < 1e-9);
  const World soft = w.with("gripper_compliance", "gripper", {{"axial", 1 / k}});
  CHECK(largest(force(soft) - k / 2 * depth) < 1e-9);
  const VectorXd held = w.of(Kind::Profile).data.column("fc");
  CHECK(largest(difference(w, soft, Kind::Profile, "z") + held / k) < 1e-12);
  const VectorXd p = held / k + w.show(Kind::Profile, "z") - hard.show(Kind::Profile, "z") - held / k;
  const VectorXd depth_hard = held / k - p.cwiseAbs();
  CHECK(largest(k * depth_hard.cwiseProduct((1 + 500 * depth_hard.array()).matrix()) - held) < 1e-9);
}

TEST_CASE("friction pulls the peg along its roll, and a soft gripper gives way to it") {
  const World w;
  const io::Table& given = w.of(Kind::Profile).data;
  const VectorXd f = 0.3 * given.column("fc"), alpha = given.column("alpha");
  const World rough = w.with("contact_friction", "contact", {{"friction", 0.3}});
  CHECK(largest(rough.show(Kind::Profile, "fx") - f.cwiseProduct(alpha.array().sin().matrix())) < 1e-9);
  CHECK(largest(rough.show(Kind::Profile, "fy") - f.cwiseProduct(alpha.array().cos().matrix())) < 1e-9);
  const World soft = rough.with("gripper_compliance", "gripper", {{"lateral", 1e-5}});
  World moved = rough;
  io::Table& shifted = moved.of(Kind::Profile).data;
  shifted.values.col(shifted.find("cx")) += 1e-5 * f.cwiseProduct(alpha.array().sin().matrix());
  shifted.values.col(shifted.find("cy")) -= 1e-5 * f.cwiseProduct(alpha.array().cos().matrix());
  CHECK(largest(soft.show(Kind::Profile, "z") - moved.show(Kind::Profile, "z")) < 1e-12);
}

TEST_CASE("the tube is where, and as wide, as its effects say") {
  const World w;
  const VectorXd z = w.show(Kind::Profile, "z");
  const auto shown = [&](const char* id, const Parameters& p) {
    return w.with(id, "tube", p).show(Kind::Profile, "z");
  };
  CHECK(largest((shown("tube_shift", {{"shift", numbers({0, 0, 0.002})}}) - z).array().matrix() -
                VectorXd::Constant(z.size(), 0.002)) < 1e-12);
  World moved = w;  // the tube by +1 mm is the peg by -1 mm
  moved.of(Kind::Profile).data.values.col(4).array() -= 0.001;
  CHECK(largest(shown("tube_shift", {{"shift", numbers({0.001, 0, 0})}}) - moved.show(Kind::Profile, "z")) < 1e-12);
  World wide = w;
  wide.cell.tube->inner_radius = 0.0100;
  CHECK(shown("tube_radius", {{"inner_radius", 0.0100}}) == wide.show(Kind::Profile, "z"));
  // Tilted about X, the top face rises towards +Y: by about as much as the tilt times where the peg rests.
  const VectorXd rise = shown("tube_tilt", {{"tilt", numbers({0.01, 0.0})}}) - z;
  CHECK(rise.minCoeff() > -0.01 * 0.0135);
  CHECK(rise.maxCoeff() < 0.01 * 0.0135);
  CHECK(rise.maxCoeff() - rise.minCoeff() > 0.01 * 0.004);
}

}  // namespace cell_effects_test
