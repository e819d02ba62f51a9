// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/gap/diagnosis.hpp>
#include <kr5/io/json.hpp>
#include <kr5/io/node.hpp>

namespace kr5::gap {
namespace {

using io::Node;

Node text(std::string_view value) { return Node::make_scalar(std::string(value), true); }

template <class Values, class Convert>
Node list(const Values& values, const Convert& convert) {
  Node out;
  out.kind = Node::Kind::Sequence;
  for (const auto& value : values) out.items.push_back(convert(value));
  return out;
}

Node numbers(const std::vector<double>& values) {
  Node out = list(values, [](double x) { return Node::make_scalar(x); });
  out.flow = true;
  return out;
}

/// A number, a list, or the rows of a matrix.
Node value_of(const std::vector<double>& values) {
  if (values.size() == 1) return Node::make_scalar(values.front());
  if (values.size() != 16) return numbers(values);
  const std::vector<int> rows = {0, 4, 8, 12};
  return list(rows, [&](int row) { return numbers({values.begin() + row, values.begin() + row + 4}); });
}

Node map() {
  Node out;
  out.kind = Node::Kind::Map;
  return out;
}

Node dependences(const std::vector<Dependence>& all) {
  return list(all, [](const Dependence& d) {
    Node out = map();
    out["variable"] = text(d.variable);
    out["how"] = text(d.how);
    out["evidence"] = Node::make_scalar(d.evidence);
    return out;
  });
}

/// Adds the name that a joint has in the robot's description, where it has one.
void add_joint(Node& out, const cell::Robot& robot, const std::string& target) {
  for (std::size_t i = 0; i < robot.joint_names.size(); ++i)
    if (target == "joint" + std::to_string(i + 1)) out["joint"] = text(robot.joint_names[i]);
}

Node place(const ColumnExcess& p, const cell::Robot& robot, bool with_share) {
  Node out = map();
  out["experiment"] = text(p.experiment);
  out["column"] = text(p.column);
  if (with_share) out["target"] = text(p.target);
  add_joint(out, robot, p.target);
  out["gap"] = Node::make_scalar(p.gap);
  if (with_share) out["share"] = Node::make_scalar(p.share);
  out["depends_on"] = dependences(p.depends_on);
  return out;
}

Node cause(const Cause& c, const cell::Robot& robot) {
  Node out = map();
  out["effect"] = text(c.effect);
  out["target"] = text(c.target);
  add_joint(out, robot, c.target);
  out["probability"] = Node::make_scalar(c.probability);
  Node parameters = map();
  for (const ParameterEstimate& p : c.parameters) {
    Node& entry = parameters[p.name] = map();
    entry["value"] = value_of(p.value);
    entry["std"] = value_of(p.std);
    entry["unit"] = text(p.unit);
  }
  out["parameters"] = parameters;
  out["gap_closed"] = Node::make_scalar(c.explained_fraction);
  out["tied_with"] = list(c.tied_with, [&](const EffectName& e) {
    Node name = map();
    name["effect"] = text(e.effect);
    name["target"] = text(e.target);
    add_joint(name, robot, e.target);
    return name;
  });
  return out;
}

Node reduction(const GapReduction& s) {
  Node out = map();
  out["before"] = Node::make_scalar(s.before);
  out["after"] = Node::make_scalar(s.after);
  out["floor"] = Node::make_scalar(s.floor);
  out["before_ci"] = numbers({s.before_ci.low, s.before_ci.high});
  out["after_ci"] = numbers({s.after_ci.low, s.after_ci.high});
  Node columns = map();
  for (const ColumnReduction& c : s.columns) columns[c.column] = numbers({c.before, c.after});
  out["columns"] = columns;
  return out;
}

}  // namespace

std::string to_json(const Diagnosis& d) {
  Node out = map();
  out["format"] = text("kr5-gap/1");
  out["verdict"] = text(kr5::name_of(d.verdict));
  out["where"] = list(d.where, [&](const ColumnExcess& p) { return place(p, d.cell.robot, true); });
  out["causes"] = list(d.causes, [&](const Cause& c) { return cause(c, d.cell.robot); });
  out["unexplained"] = list(d.unexplained, [&](const ColumnExcess& p) { return place(p, d.cell.robot, false); });
  out["shrink"] = reduction(d.reduction);
  Node& next = out["next_experiment"] = map();
  next["separates"] = list(d.next_experiment.separates, [](const std::string& s) { return text(s); });
  next["do"] = text(d.next_experiment.what);
  out["nearest"] = list(d.nearest, [&](const NearestEffect& e) {
    Node entry = map();
    entry["effect"] = text(e.effect);
    entry["target"] = text(e.target);
    add_joint(entry, d.cell.robot, e.target);
    entry["gap"] = Node::make_scalar(e.gap);
    entry["reason"] = text(e.reason);
    return entry;
  });
  out["not_tried"] = list(d.not_tried, [](const UntriedEffect& e) {
    Node entry = map();
    entry["effect"] = text(e.effect);
    entry["targets"] = list(e.targets, [](const std::string& target) { return text(target); });
    entry["reason"] = text(e.reason);
    return entry;
  });
  out["scatter"] = Node::make_scalar(d.scatter);
  if (!d.scope.empty()) out["scope"] = list(d.scope, [](const std::string& s) { return text(s); });
  out["warnings"] = list(d.warnings, [](const std::string& s) { return text(s); });
  return io::to_json(out);
}

}  // namespace kr5::gap
