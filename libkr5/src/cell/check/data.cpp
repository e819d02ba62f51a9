// SPDX-License-Identifier: BSD-3-Clause
#include "cell/check/data.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include <kr5/core/statistics.hpp>

#include "cell/check/diagnostic_collector.hpp"

namespace kr5::cell {
namespace {

/// Looks at the columns of one experiment; each thing that is wrong is told once, at its first row, with their number.
class DataCheck {
 public:
  DataCheck(const Experiment& e, const Cell& cell, const std::string& file, const std::vector<int>& lines,
            std::vector<io::Diagnostic>& diagnostics)
      : e_(e), cell_(cell), file_(file), lines_(lines), diagnostics_(diagnostics) {}

  void run() {
    size();
    still();
    start();
    speed_noise();
    const Experiment all = with_lead_in(e_);
    DataCheck(all, cell_, file_, lines_, diagnostics_).form();
    joints();
    following();
    if (e_.kind == Kind::Poses) poses();
    if (e_.kind == Kind::Views) views();
    if (e_.kind == Kind::Scan) scan();
    lengths();
    angles();
    loads();
  }

 private:
  using Row = Eigen::Index;
  using Severity = io::Severity;

  Eigen::VectorXd column(const std::string& name) const {
    return e_.data.find(name) < 0 ? Eigen::VectorXd{} : e_.data.column(name);
  }
  /// Of a row behind the lead-in, which stands before it in the file.
  int line(Row row) const {
    row += e_.lead_in.values.rows();
    return lines_.empty() ? static_cast<int>(row) + 2 : lines_[static_cast<std::size_t>(row)];
  }

  /// What must hold of the rows of a lead-in, too, since they are simulated.
  void form() {
    for (const std::string& name : e_.data.columns) finite(name);
    for (const char* name : {"pose", "view", "line", "run", "marker"}) whole(name);
    time();
  }

  void report(Row row, const std::string& name, const std::string& found, const std::string& expected,
              Severity severity = Severity::Warning) {
    diagnostics_.push_back({file_, line(row), name, found, expected, severity});
  }

  /// `good(row)` of every row.
  void each_row(const std::string& name, const std::function<bool(Row)>& good, const std::string& expected,
                Severity severity = Severity::Warning) {
    const Eigen::VectorXd values = column(name);
    Row first = -1, count = 0;
    for (Row i = 0; i < values.size(); ++i) {
      if (good(i)) continue;
      if (count++ == 0) first = i;
    }
    if (count > 0)
      report(first, name,
             rounded_text(values[first]) + (count > 1 ? ", and " + std::to_string(count - 1) + " more rows" : ""),
             expected, severity);
  }
  /// |value| of every row.
  void within(const std::string& name, double most, const std::string& expected) {
    const Eigen::VectorXd values = column(name);
    each_row(
        name, [&](Row i) { return std::abs(values[i]) <= most; }, expected);
  }
  void whole(const std::string& name) {
    const Eigen::VectorXd values = column(name);
    each_row(
        name, [&](Row i) { return values[i] == std::round(values[i]) && values[i] >= 0; }, "a whole number from 0",
        Severity::Error);
  }

  /// Beyond this no number of a recording means anything, and squares of it overflow.
  void finite(const std::string& name) {
    constexpr double most = 1e12;
    const Eigen::VectorXd values = column(name);
    each_row(
        name, [&](Row i) { return std::abs(values[i]) <= most; }, "a magnitude of at most 1e12", Severity::Error);
  }

  void size() {
    constexpr Row least = 10;
    const Row rows = e_.data.values.rows();
    if (rows < least)
      report(0, "", std::to_string(rows) + (rows == 1 ? " row" : " rows"),
             "at least " + std::to_string(least) + " rows; fewer cannot confirm a simulation");
  }

  /// A motion in which nothing moves shows neither friction nor inertia.
  void still() {
    if (e_.kind != Kind::Motion || e_.data.values.rows() < 2) return;
    for (int j = 1; j <= cell_.robot.joints(); ++j) {
      const Eigen::VectorXd q = column("qc" + std::to_string(j));
      if (q.size() == 0 || q.maxCoeff() > q.minCoeff()) return;
    }
    report(0, "qc1", "the same value in every row, for every joint", "a motion; at rest only gravity shows");
  }

  void time() {
    const Eigen::VectorXd t = column("t"), run = column(run_column(e_.kind));
    const bool still = e_.kind == Kind::Poses || e_.kind == Kind::Views || e_.kind == Kind::Scan;
    const auto same_run = [&](Row i) { return i > 0 && (run.size() == 0 || run[i] == run[i - 1]); };
    if (still) {
      each_row(
          "t", [&](Row i) { return i == 0 || t[i] >= t[i - 1]; },
          "time that does not decrease [s]; are rows out of order?", Severity::Error);
      return;
    }
    each_row(
        "t", [&](Row i) { return !same_run(i) || t[i] > t[i - 1]; },
        "time that increases within a run [s]; are rows out of order or duplicated?", Severity::Error);
    // Commands to torque servos come at the rate of a log, not of the loop that closes in the servo.
    if (!cell_.servo || cell_.has_torque_servos() || e_.kind == Kind::Profile ||
        e_.joint_reference == JointReference::Measured)
      return;
    const double cycle = cell_.servo->cycle;
    each_row(
        "t",
        [&](Row i) { return !same_run(i) || t[i] <= t[i - 1] || std::abs(t[i] - t[i - 1] - cycle) <= 0.25 * cycle; },
        "a row every cycle of " + text_of(cycle) + " s; are rows missing, or is t in other units?");
  }

  /// Measured positions alone have speeds with noise, those of each joint.
  void speed_noise() {
    const Row found = e_.speed_noise.size();
    if (found == 0) return;
    if (e_.joint_reference != JointReference::Measured)
      report(0, "speed_noise", "speed_noise of commands, whose speeds are exact", "none, or joint_reference: measured",
             Severity::Error);
    if (found != cell_.robot.joints())
      report(0, "speed_noise", std::to_string(found) + " values",
             "one a joint, " + std::to_string(cell_.robot.joints()) + " [rad/s or m/s]", Severity::Error);
  }

  /// A simulation of commands begins at rest, and so must what it is compared with, or a lead-in goes before.
  void start() {
    constexpr double moving = 0.02, sure = 4.0;  // [rad/s or m/s]; standard deviations
    if (e_.kind != Kind::Motion || e_.joint_reference == JointReference::Measured || e_.lead_in.values.rows() > 0)
      return;
    for (int j = 1; j <= cell_.robot.joints(); ++j) {
      const std::string number = std::to_string(j);
      const bool measured = e_.data.find("q" + number) >= 0;
      const std::string name = (measured ? "q" : "qc") + number;
      const InitialSpeed found = initial_speed(column("t"), column(name));
      const double speed = std::abs(found.value), noise = measured ? cell_.noise.position * found.noise_gain : 0.0;
      if (speed <= moving + sure * noise) continue;
      // An arm that begins at rest under a command that already moves is still far slower than that.
      if (measured && speed < 0.5 * std::abs(initial_speed(column("t"), column("qc" + number)).value)) continue;
      report(0, name,
             "joint " + number + " moves at " + rounded_text(speed) + (slides(j - 1) ? " m/s" : " rad/s") +
                 " when the motion begins",
             "a motion that begins at rest, as its simulation does; cut the log where the arm rests, or give the "
             "experiment a lead_in");
      return;
    }
  }

  bool slides(int joint) const {
    return cell_.robot.dh[static_cast<std::size_t>(joint)].type == kinematics::JointType::Prismatic;
  }

  void joints() {
    constexpr double margin = 0.05;
    for (int j = 0; j < cell_.robot.joints(); ++j)
      for (const std::string stem : {"q", "qc"}) {
        const std::string name = stem + std::to_string(j + 1);
        if (!cell_.robot.limits) {
          within(name, slides(j) ? 2 * long_arm : many_turns,
                 slides(j) ? "a joint value in m; is it in mm?" : "a joint angle in rad; is it in degrees?");
          continue;
        }
        const double low = cell_.robot.limits->lower[j], high = cell_.robot.limits->upper[j];
        const Eigen::VectorXd q = column(name);
        const bool wide = q.size() > 0 && q.cwiseAbs().maxCoeff() > 4 * std::max(std::abs(low), std::abs(high));
        each_row(
            name, [&](Row i) { return q[i] >= low - margin && q[i] <= high + margin; },
            "a value within the limits " + rounded_text(low) + " to " + rounded_text(high) +
                (slides(j) ? " m" : " rad") +
                (wide ? "; is it in degrees or millimetres?" : "; is this a column of another joint, or a current?"));
      }
  }

  static double median_distance(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
    std::vector<double> d(static_cast<std::size_t>(a.size()));
    for (Row i = 0; i < a.size(); ++i) d[static_cast<std::size_t>(i)] = std::abs(a[i] - b[i]);
    return median(std::move(d));
  }

  /// A measured joint follows its own command, not that of another.
  void following() {
    constexpr double far = 0.1, clearly = 0.2;  // [rad or m], ratio
    const int n = cell_.robot.joints();
    for (int j = 1; e_.kind == Kind::Motion && j <= n; ++j) {
      const Eigen::VectorXd q = column("q" + std::to_string(j));
      if (q.size() == 0) return;
      const double own = median_distance(q, column("qc" + std::to_string(j)));
      if (own < far) continue;
      std::string hint = "a joint that follows its command qc" + std::to_string(j);
      bool follows_another = false;
      for (int k = 1; k <= n; ++k)
        if (k != j && median_distance(q, column("qc" + std::to_string(k))) < clearly * own) {
          hint += "; it follows qc" + std::to_string(k) + ", are columns swapped?";
          follows_another = true;
        }
      if (cell_.has_torque_servos() && !follows_another) continue;  // a soft servo hangs far below its command
      report(0, "q" + std::to_string(j), "a median distance of " + rounded_text(own) + " from the command", hint);
    }
  }

  Eigen::VectorXd joint_row(Row i) const {
    Eigen::VectorXd q(cell_.robot.joints());
    for (int j = 0; j < q.size(); ++j) q[j] = e_.data.values(i, e_.data.find("q" + std::to_string(j + 1)));
    return q;
  }

  void poses() {
    constexpr double near = 0.2, unit = 1e-3;  // [m]; a quaternion is printed with seven digits
    const Eigen::VectorXd x = column("x"), y = column("y"), z = column("z"), w = column("qw");
    std::vector<double> off;
    for (Row i = 0; i < x.size() && y.size() > 0 && z.size() > 0; ++i)
      off.push_back((T_base_tool(cell_, joint_row(i)).translation() - Eigen::Vector3d(x[i], y[i], z[i])).norm());
    const double typical = median(std::move(off));
    if (typical > near)
      report(0, "x", "a tool " + rounded_text(typical) + " m (median) from its position by the cell",
             "agreement within 0.2 m; are columns swapped, lengths in mm, angles in degrees, or is this another cell?");
    if (w.size() == 0) return;
    const Eigen::VectorXd a = column("qx"), b = column("qy"), c = column("qz");
    const auto norm = [&](Row i) { return std::sqrt(w[i] * w[i] + a[i] * a[i] + b[i] * b[i] + c[i] * c[i]); };
    each_row(
        "qw", [&](Row i) { return std::abs(norm(i) - 1) <= unit; }, "a unit quaternion qw qx qy qz", Severity::Error);
  }

  void views() {
    constexpr double margin = 2.0;  // [px]
    const Eigen::VectorXd marker = column("marker"), corner = column("corner"), u = column("u"), v = column("v");
    each_row(
        "corner", [&](Row i) { return corner[i] == 0 || corner[i] == 1 || corner[i] == 2 || corner[i] == 3; },
        "0, 1, 2 or 3", Severity::Error);
    if (cell_.board) {
      const int first = cell_.board->first_id, last = first + cell_.board->rows * cell_.board->cols - 1;
      each_row(
          "marker", [&](Row i) { return marker[i] >= first && marker[i] <= last; },
          "a marker of the board, " + std::to_string(first) + " to " + std::to_string(last), Severity::Error);
    }
    if (!cell_.camera || u.size() == 0 || v.size() == 0) return;
    const double w = cell_.camera->width, h = cell_.camera->height;
    const auto fits = [&](const Eigen::VectorXd& x, double size) {
      return x.minCoeff() >= -margin && x.maxCoeff() <= size + margin;
    };
    const std::string hint = fits(u, h) && fits(v, w) ? "; are u and v swapped?" : "";
    each_row(
        "u", [&](Row i) { return u[i] >= -margin && u[i] <= w + margin; },
        "a pixel of the image, 0 to " + text_of(w) + hint);
    each_row(
        "v", [&](Row i) { return v[i] >= -margin && v[i] <= h + margin; },
        "a pixel of the image, 0 to " + text_of(h) + hint);
  }

  void scan() {
    const Eigen::VectorXd sphere = column("sphere"), z = column("z");
    each_row(
        "sphere", [&](Row i) { return sphere[i] == 0 || sphere[i] == 1; }, "0 or 1: whether the ray met the sphere",
        Severity::Error);
    each_row(
        "z", [&](Row i) { return z[i] > 0; }, "a positive range [m]");
  }

  void lengths() {
    if (e_.kind == Kind::Poses) return;
    for (const char* name : {"x", "z", "zc", "cx", "cy"})
      within(name, 2.0, "a length in metres; is it in millimetres?");
  }

  void angles() {
    within("tilt", std::numbers::pi / 2, "an angle in rad; is it in degrees?");
    within("alpha", 4 * std::numbers::pi, "an angle in rad, within one turn; is it in degrees?");
    const Eigen::VectorXd force = column("fc");
    each_row(
        "fc", [&](Row i) { return force[i] >= 0; }, "a force that presses, not negative [N]", Severity::Error);
  }

  /// Currents and torques of a size that only another unit explains.
  void loads() {
    constexpr double most_current = 100.0, most_torque = 3000.0, most_sensed = 300.0;  // [A], [N m], [N m]
    for (int j = 0; j < cell_.robot.joints(); ++j) {
      const std::string number = std::to_string(j + 1);
      const bool known = cell_.robot.limits && cell_.robot.limits->effort.size() > j;
      const double effort = known ? cell_.robot.limits->effort[j] : most_torque;
      within("i" + number, most_current, "a motor current in A; is it in mA?");
      within("tau" + number, std::isfinite(effort) ? std::max(20 * effort, most_torque) : most_torque,
             slides(j) ? "a joint force in N; is it in mN?" : "a joint torque in N m; is it in N mm?");
    }
    for (const char* name : {"tx", "ty", "tz"}) within(name, most_sensed, "a torque in N m; is it in N mm?");
  }

  const Experiment& e_;
  const Cell& cell_;
  const std::string& file_;
  const std::vector<int>& lines_;
  std::vector<io::Diagnostic>& diagnostics_;
};

}  // namespace

void check_data(const Experiment& e, const Cell& cell, const std::string& file, const std::vector<int>& lines,
                std::vector<io::Diagnostic>& diagnostics) {
  DataCheck(e, cell, file, lines, diagnostics).run();
}

}  // namespace kr5::cell
