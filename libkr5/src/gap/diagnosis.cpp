// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/gap/diagnosis.hpp>

#include <kr5/gap/notes.hpp>
#include <kr5/gap/sentences.hpp>
#include <kr5/io/fields.hpp>
#include <kr5/io/json.hpp>

#include "gap/diagnosis_reader.hpp"

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

/// The fields of a struct, and the sentence made of them.
template <class T>
Node with_text(const T& value, const std::string& said) {
  Node out = io::to_node(value);
  out["text"] = text(said);
  return out;
}

Node dependences(const std::vector<Dependence>& all, const std::string& kind) {
  return list(all, [&](const Dependence& d) { return with_text(d, dependence_text(d, kind)); });
}

using JointNames = std::vector<std::string>;

/// Adds the name that a joint has in the robot's description, where it has one.
void add_joint(Node& out, const JointNames& joints, const std::string& target) {
  for (std::size_t i = 0; i < joints.size(); ++i)
    if (target == "joint" + std::to_string(i + 1) && !joints[i].empty()) out["joint"] = text(joints[i]);
}

Node place(const ColumnExcess& p, const JointNames& joints) {
  Node out = map();
  out["experiment"] = text(p.experiment);
  out["column"] = text(p.column);
  out["target"] = text(p.target);
  add_joint(out, joints, p.target);
  out["gap"] = Node::make_scalar(p.gap);
  out["share"] = Node::make_scalar(p.share);
  out["depends_on"] = dependences(p.depends_on, p.experiment);
  return out;
}

Node cause(const Cause& c, const JointNames& joints) {
  Node out = map();
  out["effect"] = text(c.effect);
  out["target"] = text(c.target);
  add_joint(out, joints, c.target);
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
    add_joint(name, joints, e.target);
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

/// What a recording itself is like, and how far the search went.
void add_findings(Node& out, const Diagnosis& d) {
  out["scope"] = list(d.scope, [](const ScopeLimit& limit) { return with_text(limit, limit_text(limit)); });
  out["noise"] = io::to_node(d.noise);
  out["clock_faults"] =
      list(d.clock_faults, [](const ClockFault& fault) { return with_text(fault, fault_text(fault)); });
  out["spikes"] = io::to_node(d.spikes);
  out["outliers"] = io::to_node(d.outliers);
  out["coarse"] = io::to_node(d.coarse);
  out["left_out"] = list(d.left_out, [](const LeftOut& part) { return with_text(part, left_out_text(part)); });
  out["missing_splits"] = io::to_node(d.missing_splits);
  out["excused"] = io::to_node(d.excused);
  out["clock_reset"] = io::to_node(d.clock_reset);
  out["effects_limit"] = io::to_node(d.effects_limit);
  out["sets_limit"] = io::to_node(d.sets_limit);
  out["joint_names"] = io::to_node(d.joint_names);
  out["notes"] = list(d.notes, text);
}

}  // namespace

std::string to_json(const Diagnosis& d) {
  const JointNames& joints = d.joint_names;
  Node out = map();
  out["format"] = text("kr5-gap/2");
  out["verdict"] = text(kr5::name_of(d.verdict));
  out["text"] = text(verdict_text(d));
  out["warnings"] = list(warnings(d), text);
  out["where"] = list(d.where, [&](const ColumnExcess& p) { return place(p, joints); });
  out["causes"] = list(d.causes, [&](const Cause& c) { return cause(c, joints); });
  out["unexplained"] = list(d.unexplained, [&](const ColumnExcess& p) { return place(p, joints); });
  out["shrink"] = reduction(d.reduction);
  out["next_experiment"] = with_text(d.next_experiment, experiment_text(d.next_experiment));
  out["nearest"] = list(d.nearest, [&](const NearestEffect& e) {
    Node entry = with_text(e, reason_text(e));
    add_joint(entry, joints, e.target);
    return entry;
  });
  out["not_tried"] = list(d.not_tried, [](const UntriedEffect& e) { return with_text(e, reason_text(e)); });
  out["nuisance_std"] = Node::make_scalar(d.nuisance_std);
  add_findings(out, d);
  return io::to_json(out);
}

Diagnosis diagnosis_from_json(const std::string& text, const std::string& source) {
  return read_diagnosis(io::parse_yaml(text, source), source);
}

}  // namespace kr5::gap
