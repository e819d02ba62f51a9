// SPDX-License-Identifier: BSD-3-Clause
#include "gap/planning/static_proposals.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include <Eigen/Geometry>

#include <kr5/kinematics/inverse.hpp>
#include <kr5/robot/cycle.hpp>

#include "gap/planning/workspace.hpp"

namespace kr5::gap {
namespace {

using Move = std::function<Pose(const Pose&)>;

/// The rows of a table with every posture changed by what happens to the pose of the flange; rows whose posture the arm
/// cannot take are left out. Nothing, when those are more than half.
std::optional<io::Table> transform_postures(const Workspace& workspace, const io::Table& from, const Move& move) {
  const int n = workspace.cell.robot.joints(), first = from.find("q1");
  if (first < 0) return std::nullopt;
  const kinematics::DhChain arm = cell::nominal_chain(workspace.cell);
  kinematics::InverseOptions options;
  options.lower = workspace.low;
  options.upper = workspace.high;
  options.starts = 3;
  std::vector<Eigen::Index> kept;
  io::Table out = from;
  Eigen::VectorXd before, after;
  for (Eigen::Index i = 0; i < from.values.rows(); ++i) {
    const Eigen::VectorXd q = from.values.row(i).segment(first, n);
    if (before.size() == 0 || q != before) {  // many rows have one posture
      before = q;
      options.near = q;
      after = kinematics::inverse_kinematics(arm, move(arm.flange(q)), options).nearest().value_or(Eigen::VectorXd());
    }
    if (after.size() == 0) continue;
    out.values.row(i).segment(first, n) = after.transpose();
    kept.push_back(i);
  }
  if (2 * static_cast<Eigen::Index>(kept.size()) < from.values.rows()) return std::nullopt;
  out.values = Eigen::MatrixXd(out.values(kept, Eigen::all));
  return out;
}

Pose turned(const Eigen::Vector3d& axis, double angle) { return Pose(Eigen::AngleAxisd(angle, axis)); }

/// Runs of the path correction, one a command over time, `duration` [s] each.
Proposal correction_runs(const Family& family, cell::Kind kind, const std::string& what, double duration,
                         const std::vector<std::function<double(double)>>& commands) {
  const cell::Cell& c = family.recording.cell;
  const double cycle = c.servo->cycle > 0 ? c.servo->cycle : robot::usual_cycle;
  const auto rows = static_cast<Eigen::Index>(duration / cycle);
  Proposal out{{"next", kind, "next.csv", cell::Split::Fit, {{"run", "t", "zc"}, {}}, {}, {}}, what, 0.0, set_up};
  out.seconds += duration * static_cast<double>(commands.size());
  out.experiment.data.values.resize(rows * static_cast<Eigen::Index>(commands.size()), 3);
  double start = end_time_of(family.recording, kind) + set_up;
  for (std::size_t run = 0; run < commands.size(); ++run, start += duration)
    for (Eigen::Index i = 0; i < rows; ++i) {
      const double t = cycle * static_cast<double>(i);
      out.experiment.data.values.row(static_cast<Eigen::Index>(run) * rows + i) << static_cast<double>(run), start + t,
          commands[run](t);
    }
  return out;
}

std::string millimetres(double metres) { return two_digits(1e3 * metres) + " mm"; }

}  // namespace

std::vector<Proposal> view_proposals(const Family& family) {
  const cell::Experiment* e = recorded_experiment(family.recording, cell::Kind::Views);
  const auto T_flange_camera = cell::T_flange_camera(family.recording.cell);
  if (!e || !T_flange_camera) return {};
  const Workspace workspace(family);
  std::vector<Proposal> out;
  const auto add = [&](const std::string& what, const Move& in_camera) {
    Proposal p = repeat_experiment(family, *e, what);
    const auto table = transform_postures(workspace, p.experiment.data, [&](const Pose& T_base_flange) -> Pose {
      return T_base_flange * *T_flange_camera * in_camera(T_base_flange * *T_flange_camera) *
             T_flange_camera->inverse();
    });
    if (!table) return;
    p.experiment.data = *table;
    out.push_back(std::move(p));
  };
  const auto distance = [&](const Pose& T_base_camera) {
    const auto& board = family.recording.cell.board;
    return board ? std::clamp((T_base_camera.inverse() * board->T_base_target).translation().z(), 0.05, 5.0) : 0.5;
  };
  const auto shift = [](double z) { return Pose(Eigen::Translation3d(0, 0, z)); };
  add("look at the board from two thirds of the distance", [&](const Pose& T) { return shift(distance(T) / 3); });
  add("look at the board from one and a half times the distance",
      [&](const Pose& T) { return shift(-distance(T) / 2); });
  if (family.brief) return out;
  add("look at the board with the camera turned by 90 degrees about its axis",
      [&](const Pose&) { return turned(Eigen::Vector3d::UnitZ(), M_PI / 2); });
  for (const double angle : {0.35, -0.35})
    add(std::string("look at the board from ") + two_digits(std::abs(angle)) + " rad further " +
            (angle > 0 ? "to one side" : "to the other side"),
        [&, angle](const Pose& T) {
          return Pose(shift(distance(T)) * turned(Eigen::Vector3d::UnitX(), angle) * shift(-distance(T)));
        });
  return out;
}

std::vector<Proposal> scan_proposals(const Family& family) {
  const cell::Experiment* e = recorded_experiment(family.recording, cell::Kind::Scan);
  const auto T_flange_scanner = cell::T_flange_scanner(family.recording.cell);
  if (!e || !T_flange_scanner) return {};
  const Workspace workspace(family);
  std::vector<Proposal> out;
  for (const auto& [factor, words] :
       {std::pair{5.0, "scan at five times the speed"}, {0.2, "scan at a fifth of the speed"}}) {
    Proposal p = repeat_experiment(family, *e, words);
    if (const int speed = p.experiment.data.find("speed"); speed >= 0) p.experiment.data.values.col(speed) *= factor;
    out.push_back(std::move(p));
  }
  const auto add = [&](const std::string& what, const Pose& in_scanner) {
    Proposal p = repeat_experiment(family, *e, what);
    const auto table = transform_postures(workspace, p.experiment.data, [&](const Pose& T_base_flange) -> Pose {
      return T_base_flange * *T_flange_scanner * in_scanner * T_flange_scanner->inverse();
    });
    if (!table) return;
    p.experiment.data = *table;
    out.push_back(std::move(p));
  };
  for (const double z : {0.03, -0.03})
    add("scan from " + millimetres(std::abs(z)) + (z > 0 ? " nearer" : " farther"),
        Pose(Eigen::Translation3d(0, 0, z)));
  if (family.brief) return out;
  const Pose back(Eigen::Translation3d(0, 0, -0.19)), there(Eigen::Translation3d(0, 0, 0.19));
  add("scan tilted by 0.2 rad about the scanner's X", there * turned(Eigen::Vector3d::UnitX(), 0.2) * back);
  add("scan tilted by 0.2 rad about the scanner's Y", there * turned(Eigen::Vector3d::UnitY(), 0.2) * back);
  add("scan with the scanner turned by 90 degrees about its axis", turned(Eigen::Vector3d::UnitZ(), M_PI / 2));
  return out;
}

std::vector<Proposal> step_proposals(const Family& family) {
  if (!family.recording.cell.servo || !family.recording.cell.servo->tool) return {};
  const auto step = [](double height) { return [height](double t) { return t < 0.5 ? 0.0 : height; }; };
  std::vector<Proposal> out;
  for (const double height : {0.004, 0.03})
    out.push_back(correction_runs(family, cell::Kind::Step, "make steps of " + millimetres(height) + ", up and down",
                                  5.0, {step(height), step(-height)}));
  for (const double rate : {1.0, 6.0})
    out.push_back(
        correction_runs(family, cell::Kind::Step,
                        "let the path correction follow a sine of 5 mm at " + two_digits(rate / 2 / M_PI) + " Hz", 12.0,
                        {[rate](double t) { return 0.005 * std::sin(rate * t); }}));
  return out;
}

std::vector<Proposal> press_proposals(const Family& family) {
  const cell::Cell& c = family.recording.cell;
  if (!c.servo || !c.servo->tool || !c.contact) return {};
  const cell::Experiment* e = recorded_experiment(family.recording, cell::Kind::Press);
  const double deepest = e ? std::max(-e->data.values.col(e->data.find("zc")).minCoeff(), 1e-4) : 0.002;
  const auto ramp = [](double speed, double depth) {
    return [=](double t) { return std::max(0.002 - speed * t, -depth); };
  };
  std::vector<Proposal> out;
  for (const auto& [part, speed] : {std::pair{0.3, 0.001}, {1.0, 0.0005}, {1.0, 0.01}, {1.8, 0.002}}) {
    const double depth = part * deepest;
    out.push_back(correction_runs(
        family, cell::Kind::Press,
        "press to a command of " + millimetres(depth) + " below the bench at " + millimetres(speed) + "/s, and hold",
        (0.002 + depth) / speed + 3.0, {ramp(speed, depth)}));
  }
  out.push_back(correction_runs(
      family, cell::Kind::Press,
      "press and let the command swing about " + millimetres(0.6 * deepest) + " below the bench at 0.5 Hz", 12.0,
      {[deepest](double t) {
        return t < 2 ? 0.002 - 0.5 * t * (0.002 + 0.6 * deepest) : -deepest * (0.6 + 0.35 * std::sin(M_PI * (t - 2)));
      }}));
  return out;
}

std::vector<Proposal> profile_proposals(const Family& family) {
  const cell::Experiment* e = recorded_experiment(family.recording, cell::Kind::Profile);
  if (!e) return {};
  std::vector<Proposal> out;
  const auto add = [&](const std::string& what, const std::function<void(io::Table&)>& change) {
    out.push_back(repeat_experiment(family, *e, what));
    change(out.back().experiment.data);
  };
  const auto times = [](const char* column, double factor) {
    return [=](io::Table& t) {
      if (const int at = t.find(column); at >= 0) t.values.col(at) *= factor;
    };
  };
  add("roll the peg under twice the force", times("fc", 2.0));
  add("roll the peg under half the force", times("fc", 0.5));
  add("roll the peg at one and a half times the tilt", times("tilt", 1.5));
  if (family.brief) return out;
  add("roll the peg at 0.6 times the tilt", times("tilt", 0.6));
  add("roll the peg about points mirrored at the tube's X axis", times("cy", -1.0));
  add("roll the peg about points mirrored at the tube's Y axis", times("cx", -1.0));
  add("roll the peg about points half as far from the tube's axis", [&](io::Table& t) {
    times("cx", 0.5)(t);
    times("cy", 0.5)(t);
  });
  return out;
}

}  // namespace kr5::gap
