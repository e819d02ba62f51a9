#pragma once

#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <kr5/cell/effect.hpp>
#include <kr5/cell/recording.hpp>
#include <kr5/core/random.hpp>
#include <kr5/predict/fast_simulator.hpp>

/// @file
/// A short protocol on the KR5 cell, recorded by the fast simulator and noise.

namespace protocol {

using namespace kr5;

inline cell::Cell nominal() {
  cell::Cell c = cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml");
  c.effects = {};
  return c;
}

/// The nominal cell with one effect.
inline cell::Cell carrying(const std::string& effect, const std::string& target, const std::string& parameter,
                           double value) {
  cell::Cell c = nominal();
  cell::set_effect(c, effect, target, parameter, cell::EffectValue(value));
  return c;
}

/// What was recorded of one kind.
inline cell::Recording only(cell::Recording r, cell::Kind kind) {
  std::erase_if(r.experiments, [&](const cell::Experiment& e) { return e.kind != kind; });
  return r;
}

/// Rows of the given columns of a kind.
struct Rows {
  std::vector<std::string> names;
  std::vector<std::vector<double>> rows;

  cell::Experiment experiment(const std::string& name, cell::Kind kind, cell::Split split) const {
    cell::Experiment e;
    e.name = name, e.kind = kind, e.file = name + ".csv", e.split = split;
    e.data.columns = names;
    e.data.values.resize(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(names.size()));
    for (std::size_t i = 0; i < rows.size(); ++i)
      for (std::size_t j = 0; j < names.size(); ++j)
        e.data.values(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = rows[i][j];
    return e;
  }
};

inline std::vector<std::string> joints(std::vector<std::string> before, const std::string& letters,
                                       const std::vector<std::string>& after = {}) {
  for (int j = 1; j <= 6; ++j) before.push_back(letters + std::to_string(j));
  before.insert(before.end(), after.begin(), after.end());
  return before;
}

/// Sums of sines in every joint, slow and fast, at rest in the beginning.
inline Rows motion(Random& random, double t0, int count, double speed) {
  constexpr double middle[] = {0.0, 0.02, -2.75, 0.0, -0.3, 1.571}, width[] = {1.2, 0.7, 0.6, 1.5, 1.0, 1.8};
  double rate[6][2], phase[6][2];
  for (int j = 0; j < 6; ++j)
    for (int k = 0; k < 2; ++k) {
      rate[j][k] = speed * random.uniform(0.4, 1.6);
      phase[j][k] = random.uniform(0.0, 6.28);
    }
  Rows out{joints({"t"}, "qc"), {}};
  for (int i = 0; i < count; ++i) {
    const double t = 0.012 * i, grow = 1 - std::exp(-t * t);
    std::vector<double> row = {t0 + t};
    for (int j = 0; j < 6; ++j) {
      double q = middle[j];
      for (int k = 0; k < 2; ++k) q += 0.5 * grow * width[j] * std::sin(rate[j][k] * t + phase[j][k]);
      row.push_back(q);
    }
    out.rows.push_back(row);
  }
  return out;
}

/// Postures about a middle.
inline std::vector<double> posture(Random& random, const std::vector<double>& middle, double width) {
  std::vector<double> q;
  for (const double m : middle) q.push_back(m + width * random.uniform(-1.0, 1.0));
  return q;
}

inline Rows poses(Random& random, int count) {
  Rows out{joints({"pose", "t"}, "q"), {}};
  for (int i = 0; i < count; ++i) {
    std::vector<double> row = {static_cast<double>(i), 30.0 * i};
    for (const double q : posture(random, {0.6, 0.0, -2.5, 0.0, 0.0, 0.5}, 0.8)) row.push_back(q);
    out.rows.push_back(row);
  }
  return out;
}

inline Rows views(Random& random, int count) {
  Rows out{joints({"view", "t"}, "q", {"marker", "corner"}), {}};
  for (int i = 0; i < count; ++i) {
    const std::vector<double> q = posture(random, {0.1457, -0.2069, -3.5369, -0.1841, 0.3608, 2.8425}, 0.08);
    for (int marker = 0; marker < 35; marker += 4)
      for (int corner = 0; corner < 4; ++corner) {
        std::vector<double> row = {static_cast<double>(i), 20.0 * i};
        row.insert(row.end(), q.begin(), q.end());
        row.push_back(marker);
        row.push_back(corner);
        out.rows.push_back(row);
      }
  }
  return out;
}

inline Rows scan(Random& random, int lines) {
  Rows out{joints({"line", "t", "speed"}, "q", {"x"}), {}};
  for (int i = 0; i < lines; ++i) {
    const std::vector<double> q = posture(random, {0.2126, 0.1947, -2.6322, 0.0843, -0.3349, 2.0727}, 0.01);
    for (int k = 0; k < 60; ++k) {
      std::vector<double> row = {static_cast<double>(i), 0.1 * i, i % 2 ? 0.01 : 0.05};
      row.insert(row.end(), q.begin(), q.end());
      row.push_back(-0.045 + 0.0015 * k);
      out.rows.push_back(row);
    }
  }
  return out;
}

/// Steps of the path correction from `top` down to `bottom`, at another height each run.
inline Rows steps(int first_run, double t0, double top, double bottom) {
  Rows out{{"run", "t", "zc"}, {}};
  for (int run = 0; run < 2; ++run)
    for (int i = 0; i < 400; ++i)
      out.rows.push_back({static_cast<double>(first_run + run), t0 + 10.0 * run + 0.012 * i,
                          i < 20 || i > 250 ? top : bottom * (1.0 - 0.3 * run)});
  return out;
}

inline Rows profile(int first_run, double tilt) {
  Rows out{{"run", "t", "tilt", "alpha", "cx", "cy", "fc"}, {}};
  for (int run = 0; run < 2; ++run)
    for (int i = 0; i < 300; ++i)
      out.rows.push_back({static_cast<double>(first_run + run), 300.0 + 20 * run + 0.012 * i, tilt + 0.04 * run,
                          2 * M_PI * i / 300, -0.0075 + 0.0145 * run, -0.0072, 10.0 + 0.05 * i});
  return out;
}

/// Adds what the sensors of a cell show to an experiment, with noise.
inline void show(cell::Experiment& e, const cell::Cell& truth, Random& random) {
  const io::Table shown = predict::FastSimulator().predict(truth, e);
  const auto columns = cell::columns(e.kind, truth.robot.joints());
  for (Eigen::Index c = 0; c < shown.values.cols(); ++c) {
    const std::string& name = shown.columns[static_cast<std::size_t>(c)];
    double sigma = 0.0;
    for (const cell::Column& column : columns)
      if (column.name == name) sigma = truth.noise.of(column.noise, column.joint);
    if (name[0] == 'q' && e.kind == cell::Kind::Poses) sigma /= 2;  // a turn by w moves a unit quaternion by w/2
    e.data.columns.push_back(name);
    e.data.values.conservativeResize(Eigen::NoChange, e.data.values.cols() + 1);
    e.data.values.rightCols(1) = shown.values.col(c) + random.normal_vector(shown.values.rows(), sigma);
  }
  // What the camera did not see is in no recording.
  std::vector<Eigen::Index> seen;
  for (Eigen::Index i = 0; i < e.data.values.rows(); ++i)
    if (e.data.values.row(i).allFinite()) seen.push_back(i);
  e.data.values = Eigen::MatrixXd(e.data.values(seen, Eigen::all));
}

/// The table of an experiment with what a cell shows in the place of what was recorded.
inline io::Table computed(const cell::Cell& cell, const cell::Experiment& e) {
  io::Table out = e.data;
  const io::Table shown = predict::FastSimulator().predict(cell, e);
  for (std::size_t k = 0; k < shown.columns.size(); ++k)
    if (const int at = out.find(shown.columns[k]); at >= 0)
      out.values.col(at) = shown.values.col(static_cast<Eigen::Index>(k));
  return out;
}

/// What the sensors of a cell show, noise added, with the nominal cell beside it.
inline cell::Recording record(const cell::Cell& truth, Random& random) {
  using enum cell::Kind;
  using enum cell::Split;
  cell::Recording r;
  r.cell = nominal();
  r.experiments = {motion(random, 0.0, 1200, 2.0).experiment("motion-1", Motion, Fit),
                   motion(random, 20.0, 1500, 0.4).experiment("motion-2", Motion, Fit),
                   motion(random, 40.0, 900, 2.0).experiment("motion-3", Motion, Check),
                   poses(random, 50).experiment("poses-1", Poses, Fit),
                   poses(random, 20).experiment("poses-2", Poses, Check),
                   views(random, 12).experiment("views-1", Views, Fit),
                   views(random, 6).experiment("views-2", Views, Check),
                   scan(random, 30).experiment("scan-1", Scan, Fit),
                   scan(random, 12).experiment("scan-2", Scan, Check),
                   steps(0, 0.0, 0.0, 0.01).experiment("step-1", Step, Fit),
                   steps(2, 30.0, 0.0, -0.008).experiment("step-2", Step, Check),
                   steps(0, 50.0, 0.002, -0.002).experiment("press-1", Press, Fit),
                   steps(2, 80.0, 0.002, -0.003).experiment("press-2", Press, Check),
                   profile(0, 0.13).experiment("profile-1", Profile, Fit),
                   profile(2, 0.17).experiment("profile-2", Profile, Check)};
  for (cell::Experiment& e : r.experiments) show(e, truth, random);
  return r;
}

struct Draw {
  std::string effect, target;
  cell::Cell cell;
};

/// An effect of one number at random, of a size that shows.
inline Draw draw_effect(Random& random) {
  struct Row {
    const char *effect, *target, *parameter;
    double off, size;
  };
  static const std::vector<Row> rows = {{"coulomb_friction", "joint1", "coulomb", 34.0, 10.0},
                                        {"viscous_friction", "joint3", "viscous", 24.0, 10.0},
                                        {"load_friction", "joint2", "coefficient", 0.0, 0.03},
                                        {"joint_elasticity", "joint5", "stiffness", 3000.0, 500.0},
                                        {"torque_constant", "joint3", "torque_constant", 0.62, 0.03},
                                        {"rotor_inertia", "joint1", "rotor_inertia", 5.2e-4, 3e-4},
                                        {"link_mass", "joint3", "mass", 24.0, 4.0},
                                        {"encoder_offset", "joint2", "offset", 0.0, 1e-3},
                                        {"encoder_offset", "joint5", "offset", 0.0, 1e-3},
                                        {"link_twist", "joint3", "alpha", 1.5707963267948966, 1e-3},
                                        {"current_delay", "drives", "delay", 0.0, 0.01},
                                        {"joint_delay", "drives", "delay", 0.012, 0.006},
                                        {"joint_servo", "joint2", "natural_frequency", 45.0, 6.0},
                                        {"tool_servo", "servo", "natural_frequency", 3.064, 0.5},
                                        {"tool_damping", "servo", "damping_ratio", 0.7492, 0.1},
                                        {"ft_bias", "tz", "bias", 0.0, 0.05},
                                        {"ft_drift", "fx", "rate", 0.0, 0.01},
                                        {"ft_gain", "fz", "gain", 1.0, 0.05},
                                        {"ft_lag", "force_torque", "time_constant", 0.0, 0.05},
                                        {"laser_bias", "laser", "bias", 0.0, 4e-4},
                                        {"laser_lag", "laser", "lag", 0.0, 0.01},
                                        {"contact_hardening", "contact", "hardening", 0.0, 0.2},
                                        {"contact_friction", "contact", "friction", 0.18, 0.06},
                                        {"tube_radius", "tube", "inner_radius", 0.0097, 2e-4}};
  const Row& row = rows[static_cast<std::size_t>(random.integer(static_cast<int>(rows.size())))];
  Draw out{row.effect, row.target, nominal()};
  cell::set_effect(out.cell, row.effect, row.target, row.parameter,
                   cell::EffectValue(row.off + row.size * random.uniform(0.8, 1.6)));
  return out;
}

/// Adds to a column of every experiment of a kind, in units of its own.
inline void change(cell::Recording& r, cell::Kind kind, const std::string& column,
                   const std::function<double(const cell::Experiment&, Eigen::Index)>& by) {
  for (cell::Experiment& e : r.experiments) {
    const int at = e.data.find(column);
    if (e.kind != kind || at < 0) continue;
    const cell::Experiment before = e;
    for (Eigen::Index i = 0; i < e.data.values.rows(); ++i) e.data.values(i, at) += by(before, i);
  }
}

inline double value(const cell::Experiment& e, const std::string& column, Eigen::Index row) {
  return e.data.values(row, e.data.find(column));
}

/// Speed of a command at a row.
inline double speed(const cell::Experiment& e, const std::string& column, Eigen::Index row) {
  const Eigen::Index last = e.data.values.rows() - 1, a = std::max<Eigen::Index>(row - 1, 0),
                     b = std::min(row + 1, last);
  return (value(e, column, b) - value(e, column, a)) / (0.012 * static_cast<double>(b - a));
}

/// Columns of a kind that show what they ought to have shown `delay` [s] before.
inline void late(cell::Recording& r, cell::Kind kind, const std::vector<std::string>& columns, double delay) {
  for (cell::Experiment& e : r.experiments)
    for (const std::string& column : columns)
      if (const int at = e.data.find(column); e.kind == kind && at >= 0) {
        const auto rows = static_cast<Eigen::Index>(std::lround(delay / 0.012));
        const Eigen::VectorXd before = e.data.values.col(at);
        e.data.values.col(at).tail(before.size() - rows) = before.head(before.size() - rows);
      }
}

/// Adds spikes of 12 to 60 times the noise to a share of all measured values but orientations; how many.
inline int add_spikes(cell::Recording& r, double share, Random& random) {
  int out = 0;
  for (cell::Experiment& e : r.experiments)
    for (const cell::Column& column : cell::columns(e.kind, r.cell.robot.joints())) {
      const int at = e.data.find(column.name);
      const double sigma = r.cell.noise.of(column.noise, column.joint);
      if (at < 0 || sigma <= 0 || column.role != cell::Role::Predicted || column.group == "orientation") continue;
      for (double& value : e.data.values.col(at)) {
        if (random.uniform(0.0, 1.0) >= share) continue;
        value += sigma * random.uniform(12.0, 60.0) * (random.uniform(0.0, 1.0) < 0.5 ? 1 : -1);
        ++out;
      }
    }
  return out;
}

using Change = std::pair<std::string, std::function<void(cell::Recording&)>>;

/// Adds to the current of a joint what a formula makes of its position and speed, which follow the commands late.
inline void add_friction(cell::Recording& r, int joint, const std::function<double(double q, double v)>& by) {
  const std::string number = std::to_string(joint);
  for (cell::Experiment& e : r.experiments) {
    const int at = e.data.find("i" + number);
    if (e.kind != cell::Kind::Motion || at < 0) continue;
    const Eigen::VectorXd q = predict::FastSimulator().predict(r.cell, e).column("q" + number);
    for (Eigen::Index k = 1; k + 1 < q.size(); ++k) e.data.values(k, at) += by(q[k], (q[k + 1] - q[k - 1]) / 0.024);
  }
}

/// Friction that is added to the currents by its own formula, not by the library.
struct AddedFriction {
  std::string effect, target;
  std::function<void(cell::Recording&)> add;
};
inline std::vector<AddedFriction> added_frictions() {
  return {{"angle_friction", "joint1",
           [](auto& r) {
             add_friction(r, 1, [](double q, double v) { return 0.3 * std::tanh(v / 0.002) * std::sin(3 * q); });
           }},
          {"quadratic_drag", "joint3",
           [](auto& r) { add_friction(r, 3, [](double, double v) { return 0.5 * v * std::abs(v); }); }}};
}

/// Effects that real cells carry and that the catalogue lacks.
inline std::vector<Change> unknown_effects() {
  using enum cell::Kind;
  return {{"friction of a bearing that is rough about one angle",
           [](auto& r) {
             change(r, Motion, "i1", [](const auto& e, auto i) {
               const double away = (value(e, "qc1", i) - 0.1) / 0.06;
               return 0.6 * std::tanh(speed(e, "qc1", i) / 0.01) * std::exp(-away * away);
             });
           }},
          {"hum of the supply on a current",
           [](auto& r) {
             change(r, Motion, "i3", [](const auto& e, auto i) { return 0.3 * std::sin(33.0 * value(e, "t", i)); });
           }},
          {"a current sensor that is off by a constant",
           [](auto& r) { change(r, Motion, "i2", [](const auto&, auto) { return 0.15; }); }},
          {"ringing of the force sensor",
           [](auto& r) {
             change(r, Motion, "fx", [](const auto& e, auto i) { return 0.6 * std::sin(40.0 * value(e, "t", i)); });
           }},
          {"a lens whose centre moves with time",
           [](auto& r) {
             change(r, Views, "u", [](const auto& e, auto i) { return 0.5 * std::sin(value(e, "t", i) / 30); });
           }},
          {"a scanner whose scale follows the width of its line",
           [](auto& r) {
             change(r, Scan, "z",
                    [](const auto& e, auto i) { return 3e-4 * std::abs(std::sin(60 * value(e, "x", i))); });
           }},
          {"a contact that sticks on the way up",
           [](auto& r) {
             change(r, Press, "fz", [](const auto& e, auto i) {
               return value(e, "zc", i) < 0 ? 1.5 * std::sin(12 * value(e, "t", i)) : 0.0;
             });
           }},
          {"a tube that is oval", [](auto& r) {
             change(r, Profile, "z", [](const auto& e, auto i) { return 6e-5 * std::cos(4 * value(e, "alpha", i)); });
           }}};
}

}  // namespace protocol
