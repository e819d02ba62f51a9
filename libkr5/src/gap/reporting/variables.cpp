// SPDX-License-Identifier: BSD-3-Clause
#include "gap/reporting/variables.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "gap/reporting/structure.hpp"

namespace kr5::gap {
namespace {

constexpr std::array<const char*, 6> labels = {"marker", "corner", "pose", "view", "line", "run"};

/// Central differences of a column over time; 0 where a run begins or ends.
Eigen::VectorXd rate(const Eigen::VectorXd& x, const cell::Experiment& e) {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(x.size());
  const int at = e.data.find("t");
  const Eigen::VectorXd run = runs(e);
  for (Eigen::Index i = 1; at >= 0 && i + 1 < x.size(); ++i)
    if (run(i - 1) == run(i) && run(i + 1) == run(i))
      out(i) = (x(i + 1) - x(i - 1)) / std::max(e.data.values(i + 1, at) - e.data.values(i - 1, at), 1e-6);
  return out;
}

/// A column of each experiment of a group, changed by `map`, one after the other.
template <class Map>
Eigen::VectorXd stacked(const ComparisonData& data, const Group& group, const std::string& column, const Map& map) {
  std::vector<double> out;
  for (const int b : group.all) {
    const cell::Experiment& e = data.experiment(data.blocks[b]);
    const int at = e.data.find(column);
    if (at < 0) return {};
    const Eigen::VectorXd values = map(e.data.values.col(at), e);
    out.insert(out.end(), values.begin(), values.end());
  }
  return Eigen::Map<const Eigen::VectorXd>(out.data(), static_cast<Eigen::Index>(out.size()));
}

Eigen::VectorXd plain(const Eigen::VectorXd& x, const cell::Experiment&) { return x; }
Eigen::VectorXd acceleration(const Eigen::VectorXd& x, const cell::Experiment& e) { return rate(rate(x, e), e); }

Eigen::VectorXd predicted(const ComparisonData& data, const Group& group, const Eigen::VectorXd& counted) {
  std::vector<double> out;
  for (const int b : group.all) {
    const Block& block = data.blocks[b];
    const io::Table& table = data.experiment(block).data;
    const int at = table.find(block.column);
    if (at < 0) return {};
    // Rounded: where the prediction stands still, the last digits of the difference would be those of the residual.
    const double grain = 1e-3 * block.sigma;
    for (Eigen::Index i = 0; i < block.rows; ++i)
      out.push_back(grain * std::round((table.values(i, at) / block.sigma - counted(block.first + i)) * 1e3));
  }
  return Eigen::Map<const Eigen::VectorXd>(out.data(), static_cast<Eigen::Index>(out.size()));
}

void add_motion(const ComparisonData& data, const Group& group, std::vector<VariableValues>& out) {
  using enum VariableKind;
  const int own = cell::find_column(group.kind, group.column).joint + 1;  // 0: none
  for (int j = 1; j <= data.recording->cell.robot.joints(); ++j) {
    const std::string command = "qc" + std::to_string(j);
    const Eigen::VectorXd position = stacked(data, group, command, plain), qd = stacked(data, group, command, rate);
    if (position.size() == 0) continue;
    const Eigen::VectorXd sign = qd.unaryExpr([](double v) { return v > 1e-4 ? 1.0 : v < -1e-4 ? -1.0 : 0.0; });
    const bool turns = j == own;
    out.push_back({{JointPosition, j}, "rad", position, turns ? sign : Eigen::VectorXd()});
    out.push_back({{JointVelocity, j}, "rad/s", qd});
    out.push_back({{JointAcceleration, j}, "rad/s2", stacked(data, group, command, acceleration)});
    if (turns) out.push_back({{JointSpeed, j}, "rad/s", qd.cwiseAbs(), sign});
  }
}

}  // namespace

std::vector<VariableValues> variables(const ComparisonData& data, const Group& group, const Eigen::VectorXd& counted) {
  std::vector<VariableValues> out;
  const cell::Experiment& first = data.experiment(data.blocks[group.all.front()]);
  const auto columns = cell::columns(group.kind, data.recording->cell.robot.joints());
  for (const cell::Column& column : columns) {
    const bool label = std::find(labels.begin(), labels.end(), column.name) != labels.end();
    const bool image = column.name == "u" || column.name == "v";
    if (label || first.data.find(column.name) < 0 || (column.role != cell::Role::Given && !image)) continue;
    if (group.kind == cell::Kind::Motion && column.name != "t") continue;
    out.push_back({{VariableKind::Column, 0, column.name}, column.unit, stacked(data, group, column.name, plain)});
  }
  if (group.kind == cell::Kind::Motion) add_motion(data, group, out);
  if (group.kind == cell::Kind::Step || group.kind == cell::Kind::Press)
    out.push_back({{VariableKind::PathVelocity}, "m/s", stacked(data, group, "zc", rate)});
  if (group.kind != cell::Kind::Poses && group.kind != cell::Kind::Views)
    out.push_back({{VariableKind::Prediction, 0, group.column}, "", predicted(data, group, counted)});
  // What hardly changes is no variable: its bins would sort by rounding.
  std::erase_if(out, [](const VariableValues& v) {
    return v.values.size() == 0 ||
           v.values.maxCoeff() - v.values.minCoeff() < 1e-6 * (1.0 + v.values.cwiseAbs().maxCoeff());
  });
  return out;
}

Eigen::VectorXd velocity(const cell::Experiment& experiment, int joint) {
  const int at = experiment.data.find("qc" + std::to_string(joint + 1));
  return at < 0 ? Eigen::VectorXd() : rate(experiment.data.values.col(at), experiment);
}

}  // namespace kr5::gap
