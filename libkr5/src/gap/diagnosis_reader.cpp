// SPDX-License-Identifier: BSD-3-Clause
#include "gap/diagnosis_reader.hpp"

#include <algorithm>
#include <limits>
#include <string_view>

#include <kr5/core/error.hpp>
#include <kr5/io/fields.hpp>

#include "gap/wording/number_text.hpp"

namespace kr5::gap {
namespace {

using io::Node;

/// Takes the sentences out, and the names of joints beside targets, which are there for people.
void strip(Node& node) {
  const bool of_target = node.find("target") || node.find("column");
  const bool named = of_target && !node.find("kind");  // a variable has a kind, and the number of a joint
  std::erase_if(node.entries,
                [&](const auto& entry) { return entry.first == "text" || (named && entry.first == "joint"); });
  for (auto& [key, value] : node.entries) strip(value);
  for (Node& item : node.items) strip(item);
}

class DiagnosisReader {
 public:
  DiagnosisReader(const Node& document, const std::string& source) : reader_(source), document_(document) {}

  Diagnosis run() {
    const Node* format = document_.find("format");
    old_ = format && format->scalar == "kr5-gap/1";
    if (!old_ && !(format && format->scalar == "kr5-gap/2"))
      reader_.report(format ? *format : document_, "format", "kr5-gap/2 or kr5-gap/1");
    reader_.finish();
    if (old_) take_joint_names(document_);
    Node plain = document_;
    strip(plain);
    read_found(plain);
    if (old_)
      read_sentences(plain);
    else
      read_findings(plain);
    reader_.finish();
    return std::move(out_);
  }

 private:
  template <class T>
  void take(const Node& map, const std::string& field, const char* key, T& value, bool required = false) {
    if (const Node* found = map.find(key))
      reader_.read(*found, io::Reader::join(field, key), value);
    else if (required)
      reader_.report_missing(map, io::Reader::join(field, key));
  }

  /// A number; what JSON calls null is none.
  void take_number(const Node& map, const std::string& field, const char* key, double& value) {
    if (const Node* found = map.find(key)) value = number(*found, io::Reader::join(field, key));
  }

  double number(const Node& node, const std::string& field) {
    double out = std::numeric_limits<double>::quiet_NaN();
    if (node.kind != Node::Kind::Null) reader_.read(node, field, out);
    return out;
  }

  /// A number, a list, or the rows of a matrix.
  std::vector<double> numbers(const Node& node, const std::string& field) {
    if (node.kind != Node::Kind::Sequence) return {number(node, field)};
    std::vector<double> out;
    for (const Node& item : node.items) {
      const std::vector<double> more = numbers(item, field);
      out.insert(out.end(), more.begin(), more.end());
    }
    return out;
  }

  /// Each item of a list, with its field.
  template <class Read>
  void each(const Node& map, const std::string& field, const char* key, const Read& read, bool required = false) {
    const Node* found = map.find(key);
    const std::string name = io::Reader::join(field, key);
    if (!found) {
      if (required) reader_.report_missing(map, name);
      return;
    }
    if (found->kind != Node::Kind::Sequence) return reader_.report(*found, name, "a list");
    for (std::size_t k = 0; k < found->items.size(); ++k) {
      const std::string item = name + "[" + std::to_string(k) + "]";
      if (found->items[k].kind == Node::Kind::Map || found->items[k].kind == Node::Kind::Scalar)
        read(found->items[k], item);
      else
        reader_.report(found->items[k], item, "a map of name: value");
    }
  }

  /// Names of joints, which files of format 1 have beside their targets alone.
  void take_joint_names(const Node& node) {
    const Node *target = node.find("target"), *name = node.find("joint");
    if (target && name)
      if (const auto [word, joint] = split_number(target->scalar); word == "joint" && joint > 0) {
        constexpr int most = 1000;
        out_.joint_names.resize(std::max<std::size_t>(out_.joint_names.size(), std::min(joint, most)));
        out_.joint_names[static_cast<std::size_t>(std::min(joint, most)) - 1] = name->scalar;
      }
    for (const auto& [key, value] : node.entries) take_joint_names(value);
    for (const Node& item : node.items) take_joint_names(item);
  }

  void read_found(const Node& in) {
    take(in, "", "verdict", out_.verdict, true);
    each(
        in, "", "where", [&](const Node& n, const std::string& f) { read_place(n, f, out_.where.emplace_back()); },
        true);
    each(
        in, "", "causes", [&](const Node& n, const std::string& f) { read_cause(n, f); }, true);
    each(
        in, "", "unexplained",
        [&](const Node& n, const std::string& f) { read_place(n, f, out_.unexplained.emplace_back()); }, true);
    if (const Node* found = in.find("shrink")) read_reduction(*found);
    take_number(in, "", in.find("nuisance_std") ? "nuisance_std" : "scatter", out_.nuisance_std);
    take_number(in, "", "seconds", out_.seconds);
  }

  void read_place(const Node& in, const std::string& field, ColumnExcess& out) {
    take(in, field, "experiment", out.experiment, true);
    take(in, field, "column", out.column, true);
    take(in, field, "target", out.target);
    take_number(in, field, "gap", out.gap);
    take_number(in, field, "share", out.share);
    if (out.target.empty()) out.target = target_of(out);
    each(in, field, "depends_on", [&](const Node& n, const std::string& f) {
      Dependence& d = out.depends_on.emplace_back();
      if (old_)
        read_old_dependence(n, f, d);
      else
        reader_.read(n, f, d);
    });
  }

  static std::string target_of(const ColumnExcess& place) {
    for (const auto& [kind, name] : enum_names(cell::Kind{}))
      if (name == place.experiment) try {
          return cell::find_column(kind, place.column).target;
        } catch (const InvalidArgument&) {
          return "";
        }
    return "";
  }

  void read_old_dependence(const Node& in, const std::string& field, Dependence& out) {
    std::string variable;
    take(in, field, "variable", variable, true);
    take(in, field, "how", out.note, true);
    take_number(in, field, "evidence", out.evidence);
    out.variable = find_variable(variable);
    out.shape = Shape::Described;
  }

  void read_cause(const Node& in, const std::string& field) {
    Cause& out = out_.causes.emplace_back();
    take(in, field, "effect", out.effect, true);
    take(in, field, "target", out.target, true);
    take_number(in, field, "probability", out.probability);
    take_number(in, field, "gap_closed", out.explained_fraction);
    take(in, field, "tied_with", out.tied_with);
    const Node* parameters = in.find("parameters");
    if (!parameters) return;
    const std::string of = io::Reader::join(field, "parameters");
    if (parameters->kind != Node::Kind::Map) return reader_.report(*parameters, of, "a map of name: value");
    for (const auto& [name, entry] : parameters->entries) {
      ParameterEstimate& p = out.parameters.emplace_back();
      const std::string own = io::Reader::join(of, name);
      p.name = name;
      take(entry, own, "unit", p.unit);
      for (const auto& [key, values] : {std::pair{"value", &p.value}, {"std", &p.std}})
        if (const Node* found = entry.find(key))
          *values = numbers(*found, io::Reader::join(own, key));
        else
          reader_.report_missing(entry, io::Reader::join(own, key));
    }
  }

  void read_reduction(const Node& in) {
    GapReduction& out = out_.reduction;
    take_number(in, "shrink", "before", out.before);
    take_number(in, "shrink", "after", out.after);
    take_number(in, "shrink", "floor", out.floor);
    for (const auto& [key, interval] : {std::pair{"before_ci", &out.before_ci}, {"after_ci", &out.after_ci}})
      if (const Node* found = in.find(key))
        if (const std::vector<double> ends = numbers(*found, std::string("shrink.") + key); ends.size() == 2)
          *interval = {ends[0], ends[1]};
    if (const Node* columns = in.find("columns"))
      for (const auto& [name, pair] : columns->entries) {
        const std::vector<double> gaps = numbers(pair, "shrink.columns." + name);
        if (gaps.size() == 2)
          out.columns.push_back({name, gaps[0], gaps[1]});
        else
          reader_.report(pair, "shrink.columns." + name, "two numbers, before and after");
      }
  }

  void read_findings(const Node& in) {
    take(in, "", "next_experiment", out_.next_experiment);
    each(in, "", "nearest",
         [&](const Node& n, const std::string& f) { reader_.read(n, f, out_.nearest.emplace_back()); });
    take(in, "", "not_tried", out_.not_tried);
    take(in, "", "scope", out_.scope);
    take(in, "", "noise", out_.noise);
    take(in, "", "clock_faults", out_.clock_faults);
    take(in, "", "spikes", out_.spikes);
    take(in, "", "outliers", out_.outliers);
    take(in, "", "coarse", out_.coarse);
    take(in, "", "left_out", out_.left_out);
    take(in, "", "missing_splits", out_.missing_splits);
    take(in, "", "excused", out_.excused);
    take(in, "", "clock_reset", out_.clock_reset);
    take(in, "", "effects_limit", out_.effects_limit);
    take(in, "", "sets_limit", out_.sets_limit);
    take(in, "", "joint_names", out_.joint_names);
    take(in, "", "notes", out_.notes);
  }

  /// What format 1 says in sentences is kept as it stands.
  void read_sentences(const Node& in) {
    take(in, "", "warnings", out_.notes);
    std::vector<std::string> scope, separates;
    take(in, "", "scope", scope);
    for (const std::string& limit : scope) out_.scope.push_back({ScopeReason::Described, {}, "", 0, limit});
    if (const Node* next = in.find("next_experiment")) {
      take(*next, "next_experiment", "separates", separates);
      take(*next, "next_experiment", "do", out_.next_experiment.what);
    }
    for (const std::string& name : separates) {  // the effect and its target
      const std::size_t space = std::min(name.find(' '), name.size());
      out_.next_experiment.separates.push_back({name.substr(0, space), name.substr(std::min(space + 1, name.size()))});
    }
    each(in, "", "nearest", [&](const Node& n, const std::string& f) {
      NearestEffect& e = out_.nearest.emplace_back();
      e.reason = NotBlamed::Described;
      take(n, f, "effect", e.effect, true);
      take(n, f, "target", e.target, true);
      take(n, f, "reason", e.note);
      take_number(n, f, "gap", e.gap);
    });
    each(in, "", "not_tried", [&](const Node& n, const std::string& f) {
      UntriedEffect& e = out_.not_tried.emplace_back();
      e.reason = NotTried::Described;
      take(n, f, "effect", e.effect, true);
      take(n, f, "targets", e.targets);
      take(n, f, "reason", e.note);
    });
  }

  io::Reader reader_;
  const Node& document_;
  bool old_ = false;  ///< Format 1.
  Diagnosis out_;
};

}  // namespace

Diagnosis read_diagnosis(const io::Node& document, const std::string& source) {
  return DiagnosisReader(document, source).run();
}

}  // namespace kr5::gap
