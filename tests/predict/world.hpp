#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <kr5/cell/effect.hpp>
#include <kr5/cell/recording.hpp>
#include <kr5/core/random.hpp>
#include <kr5/predict/fast_simulator.hpp>

namespace kr5::test {

using Parameters = std::vector<std::pair<std::string, cell::EffectValue>>;

inline Eigen::VectorXd numbers(std::initializer_list<double> values) {
  return Eigen::Map<const Eigen::VectorXd>(values.begin(), static_cast<Eigen::Index>(values.size()));
}

/// A table of the columns that are given in an experiment.
inline cell::Experiment experiment(cell::Kind kind, const std::vector<std::string>& columns,
                                   const std::vector<Eigen::VectorXd>& rows) {
  cell::Experiment e;
  e.kind = kind;
  e.name = std::string(name_of(kind)) + "-1";
  e.file = e.name + ".csv";
  e.data.columns = columns;
  e.data.values.resize(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) e.data.values.row(static_cast<Eigen::Index>(i)) = rows[i].transpose();
  return e;
}

inline std::vector<std::string> joined(std::vector<std::string> first, const std::string& joint,
                                       const std::vector<std::string>& last) {
  for (int i = 1; i <= 6; ++i) first.push_back(joint + std::to_string(i));
  first.insert(first.end(), last.begin(), last.end());
  return first;
}

inline Eigen::VectorXd row(std::initializer_list<double> first, const Eigen::VectorXd& q,
                           std::initializer_list<double> last = {}) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(first.size() + last.size()) + q.size());
  out << numbers(first), q, numbers(last);
  return out;
}

/// All joints swing, from rest with the tool down.
inline cell::Experiment motion_experiment(int rows = 500) {
  const Eigen::VectorXd start = numbers({0.0, 0.02, -2.75, 0.0, -0.3, 1.571});
  const Eigen::VectorXd size = numbers({0.3, 0.15, 0.2, 0.4, 0.5, 0.6}), rate = numbers({2.0, 2.6, 3.1, 3.7, 4.1, 4.6});
  std::vector<Eigen::VectorXd> table;
  for (int k = 0; k < rows; ++k) {
    const double t = 0.012 * k;
    table.push_back(row({50.0 + t}, start + (size.array() * (1.0 - (rate.array() * t).cos())).matrix()));
  }
  return experiment(cell::Kind::Motion, joined({"t"}, "qc", {}), table);
}

inline cell::Experiment poses_experiment() {
  Random random(1);
  std::vector<Eigen::VectorXd> table;
  for (int k = 0; k < 8; ++k)
    table.push_back(
        row({double(k), 100.0 * k}, numbers({0.1, 0.2, -2.9, 0.3, -0.2, 0.5}) + random.normal_vector(6, 0.4)));
  return experiment(cell::Kind::Poses, joined({"pose", "t"}, "q", {}), table);
}

inline cell::Experiment views_experiment() {
  std::vector<Eigen::VectorXd> table;
  for (int k = 0; k < 4; ++k)
    for (int marker = 0; marker < 35; ++marker)
      for (int corner = 0; corner < 4; ++corner)
        table.push_back(row({double(k), 100.0 * k}, numbers({-0.03 + 0.02 * k, 0.177, -3.09, 0.08, 0.009, 2.747}),
                            {double(marker), double(corner)}));
  return experiment(cell::Kind::Views, joined({"view", "t"}, "q", {"marker", "corner"}), table);
}

inline cell::Experiment scan_experiment() {
  std::vector<Eigen::VectorXd> table;
  for (int k = 0; k < 6; ++k)
    for (double x = -0.045; x <= 0.045; x += 0.0015)
      table.push_back(row({double(k), 100.0 * k, 0.01},
                          numbers({0.2885, 0.13 + 0.01 * k, -2.6384, -0.0993, -0.4292, 2.4258}), {x}));
  return experiment(cell::Kind::Scan, joined({"line", "t", "speed"}, "q", {"x"}), table);
}

/// Two runs of steps of the path correction from `high` to `low`.
inline cell::Experiment path_experiment(cell::Kind kind, double high, double low) {
  std::vector<Eigen::VectorXd> table;
  for (int run = 0; run < 2; ++run)
    for (int k = 0; k < 300; ++k) table.push_back(numbers({double(run), 0.012 * k, k < 20 ? high : low}));
  return experiment(kind, {"run", "t", "zc"}, table);
}

inline cell::Experiment profile_experiment() {
  std::vector<Eigen::VectorXd> table;
  for (int k = 0; k < 400; ++k)
    table.push_back(
        numbers({0.0, 0.012 * k, 0.13, 2 * M_PI * k / 400, -0.0075, -0.0072, 10.0 + 2.0 * std::sin(0.1 * k)}));
  return experiment(cell::Kind::Profile, {"run", "t", "tilt", "alpha", "cx", "cy", "fc"}, table);
}

/// The sample cell and a short experiment of each kind.
struct World {
  cell::Cell cell = cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml");
  std::vector<cell::Experiment> experiments = {motion_experiment(),
                                               poses_experiment(),
                                               views_experiment(),
                                               scan_experiment(),
                                               path_experiment(cell::Kind::Step, 0.0, 0.01),
                                               path_experiment(cell::Kind::Press, 0.002, -0.001),
                                               profile_experiment()};

  World with(const std::string& effect, const std::string& target, const Parameters& parameters) const {
    World out = *this;
    for (const auto& [name, value] : parameters) cell::set_effect(out.cell, effect, target, name, value);
    return out;
  }
  const cell::Experiment& of(cell::Kind kind) const { return experiments[static_cast<std::size_t>(kind)]; }
  cell::Experiment& of(cell::Kind kind) { return experiments[static_cast<std::size_t>(kind)]; }
  io::Table show(cell::Kind kind) const { return predict::FastSimulator().predict(cell, of(kind)); }
  Eigen::VectorXd show(cell::Kind kind, const std::string& column) const { return show(kind).column(column); }
};

/// Speed and acceleration of rows 12 ms apart, by differences; the first and last two rows are 0.
inline Eigen::VectorXd rate_of(const Eigen::VectorXd& x) {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(x.size());
  for (Eigen::Index i = 2; i + 2 < x.size(); ++i)
    out[i] = (8 * (x[i + 1] - x[i - 1]) - (x[i + 2] - x[i - 2])) / (12 * 0.012);
  return out;
}

}  // namespace kr5::test
