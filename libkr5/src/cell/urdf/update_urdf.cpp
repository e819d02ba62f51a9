// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/update_urdf.hpp>

#include <algorithm>
#include <optional>
#include <set>
#include <sstream>

#include <kr5/cell/arm_links.hpp>
#include <kr5/core/error.hpp>

#include "cell/check/diagnostic_collector.hpp"
#include "cell/urdf/arm_path.hpp"
#include "cell/urdf/elements.hpp"

namespace kr5::cell {
namespace {

using kinematics::Body;

constexpr double same = 1e-12;  // [m, rad, relative] what rounding leaves of no difference

bool alike(const Pose& a, const Pose& b) { return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff() <= same; }

constexpr const char* remedy = "; give the URDF from which the cell was imported, with the same base and tip";

bool alike(const Body& a, const Body& b) {
  const kinematics::Moments m = inertial_moments(a), n = inertial_moments(b);
  const auto close = [](const auto& x, const auto& y) {
    return (x - y).cwiseAbs().maxCoeff() <= same * (1e-3 + x.cwiseAbs().maxCoeff());
  };
  return std::abs(m.mass - n.mass) <= same * (1.0 + m.mass) && close(m.first, n.first) && close(m.second, n.second);
}

/// The document, with the white space between its elements.
class Document {
 public:
  explicit Document(std::string_view xml) {
    document_.load_buffer(xml.data(), xml.size(), pugi::parse_full | pugi::parse_ws_pcdata | pugi::parse_fragment);
  }

  pugi::xml_node element(const char* kind, const std::string& name) {
    return robot().find_child_by_attribute(kind, "name", name.c_str());
  }

  /// Child of an element, added as its last one, on a line of its own, where it is not there.
  static pugi::xml_node child(pugi::xml_node node, const char* name) {
    if (const pugi::xml_node found = node.child(name)) return found;
    const pugi::xml_node last = node.last_child();
    const std::string before = indentation(node.first_child()), after = indentation(last);
    if (last.type() == pugi::node_pcdata) node.remove_child(last);
    node.append_child(pugi::node_pcdata).set_value(before.c_str());
    const pugi::xml_node out = node.append_child(name);
    node.append_child(pugi::node_pcdata).set_value(after.c_str());
    return out;
  }

  pugi::xml_node append(const char* kind, const std::string& name) {
    pugi::xml_node out = robot().append_child(kind);
    out.append_attribute("name") = name.c_str();
    robot().append_child(pugi::node_pcdata).set_value("\n");
    return out;
  }

  std::string text() const {
    std::ostringstream out;
    document_.save(out, "", pugi::format_raw | (has_declaration() ? 0u : unsigned{pugi::format_no_declaration}));
    return out.str();
  }

 private:
  static std::string indentation(const pugi::xml_node& node) {
    return node.type() == pugi::node_pcdata ? node.value() : "";
  }
  pugi::xml_node robot() const { return document_.child("robot"); }
  bool has_declaration() const { return document_.first_child().type() == pugi::node_declaration; }

  pugi::xml_document document_;
};

class Updater {
 public:
  Updater(const UrdfModel& model, std::string_view xml, const Cell& cell, const UrdfOptions& options)
      : model_(model), cell_(cell), path_(find_arm_path(model, options)), document_(xml), arm_(arm_links(cell)) {
    require_names();
    place_links(arm_links(parse_urdf(xml, model.source, options).cell));
    place_tip();
  }

  UrdfUpdate run() {
    for (std::size_t i = 0; i < path_.joints.size(); ++i) {
      update_origin(*path_.joints[i], T_base_[i + 1]);
      update_friction(i);
      update_bodies(i + 1);
    }
    update_tip();
    update_tool();
    return {document_.text(), changes_};
  }

 private:
  void require_names() const {
    std::vector<std::string> names;
    for (const UrdfJoint* joint : path_.joints) names.push_back(joint->name);
    const std::vector<std::string>& wanted = cell_.robot.joint_names;
    if (wanted.empty() || names == wanted) return;
    model_.fail("the joints from " + path_.base + " to " + path_.tip + " are " + listed(names) +
                ", those of the cell are " + listed(wanted) + remedy);
  }

  void place_links(const ArmLinks& before) {
    std::vector<Pose> displaced;
    try {
      displaced = link_displacements(before, arm_);
    } catch (const InvalidArgument& e) {
      model_.fail(e.what() + std::string(remedy));
    }
    for (std::size_t i = 0; i < displaced.size(); ++i) {
      T_old_.push_back(path_.links.at(path_.joints[i]->child).T_base_link);
      const Pose now = displaced[i] * T_old_.back();
      T_base_.push_back(alike(now, T_old_.back()) ? T_old_.back() : now);
    }
  }

  /// Where the tip lies now, and with it what is behind a fixed joint to the tip.
  void place_tip() {
    T_base_tip_ = arm_.T_base_tip * (cell_.tool ? cell_.tool->T_flange_tool : Pose::Identity());
    if (alike(T_base_tip_, now(path_.tip))) T_base_tip_ = now(path_.tip);
    if (!model_.parent_of(path_.tip)->moves()) add_behind_tip(path_.tip);
  }

  void add_behind_tip(const std::string& link) {
    behind_tip_.insert(link);
    for (const UrdfJoint* joint : model_.children_of(link)) add_behind_tip(joint->child);
  }

  /// A link behind fixed joints goes with the one that carries it.
  Pose now(const std::string& link) const {
    const CarriedLink& at = path_.links.at(link);
    if (behind_tip_.contains(link))
      return T_base_tip_ * path_.links.at(path_.tip).T_base_link.inverse() * at.T_base_link;
    return T_base_[at.carrier] * T_old_[at.carrier].inverse() * at.T_base_link;
  }

  void update_origin(const UrdfJoint& joint, const Pose& T_base_child) {
    const Pose T = now(joint.parent).inverse() * T_base_child;
    if (alike(T, joint.T_parent_child)) return;
    pugi::xml_node origin = Document::child(document_.element("joint", joint.name), "origin");
    write_origin(origin, T);
    changes_.push_back("joint " + joint.name + ": origin");
  }

  void update_friction(std::size_t i) {
    if (!cell_.drives) return;
    const UrdfJoint& joint = *path_.joints[i];
    const auto put = [&](const char* name, double before, double value) {
      if (value == before) return;
      pugi::xml_node dynamics = Document::child(document_.element("joint", joint.name), "dynamics");
      write_attribute(dynamics, name, number_text(value));
      changes_.push_back("joint " + joint.name + ": " + name);
    };
    put("damping", joint.damping, arm_.links[i].viscous);
    put("friction", joint.friction, arm_.links[i].coulomb);
  }

  /// What a joint of the arm carries by itself, in the link that it moves.
  Body carried_body(std::size_t carrier) const {
    const ArmLink& link = arm_.links[carrier - 1];
    return transformed_body(T_base_[carrier].inverse() * link.T_base_link, link.body);
  }

  void update_bodies(std::size_t carrier) {
    const std::string& main = path_.joints[carrier - 1]->child;
    Body fixed;
    std::set<std::string> others;
    for (const auto& [name, at] : path_.links) {
      if (at.carrier != carrier || name == main || path_.of_tool.contains(name)) continue;
      if (model_.links.at(name).mass == 0.0) continue;
      fixed = merged_body(fixed, transformed_body(T_base_[carrier].inverse() * now(name), model_.links.at(name)));
      others.insert(name);
    }
    const Body before = merged_body(model_.links.at(main), fixed), whole = carried_body(carrier);
    if (alike(before, whole) || (cell_.robot.links.empty() && before.mass > 0.0)) return;
    const std::optional<Body> alone = body_without(whole, fixed);
    write(main, alone.value_or(whole));
    changes_.push_back("link " + main + ": inertial");
    if (!alone) remove_bodies(others, main);
  }

  void write(const std::string& name, const Body& body) {
    pugi::xml_node inertial = Document::child(document_.element("link", name), "inertial");
    write_body(inertial, body);
  }

  void update_tip() {
    const UrdfJoint& joint = *model_.parent_of(path_.tip);
    if (!joint.moves()) return update_origin(joint, T_base_tip_);
    if (alike(T_base_tip_, now(path_.tip))) return;
    if (model_.links.contains("tool_tip"))
      model_.fail("the tip " + path_.tip +
                  " is the last moving link, so that a tip elsewhere needs a link of its own, and there is a tool_tip "
                  "already; name it as the tip");
    document_.append("link", "tool_tip");
    fix("tool_tip", T_base_tip_);
  }

  /// Puts the tool into its link, or into a new one on the tip, where it had no mass: a force sensor bears it.
  void update_tool() {
    if (!cell_.tool) return;
    const Tool& tool = *cell_.tool;
    const Body wanted{tool.mass, tool.com, tool.inertia};
    const Pose T_base_sensor = arm_.T_base_tip * tool.T_flange_sensor;
    if (path_.tool.empty() && wanted.mass == 0.0) return;
    if (path_.tool.empty()) return add_payload(wanted, T_base_sensor);
    const Body whole = transformed_body(now(path_.tool).inverse() * T_base_sensor, wanted);
    Body others;
    for (const std::string& name : path_.of_tool)
      if (name != path_.tool)
        others = merged_body(others, transformed_body(now(path_.tool).inverse() * now(name), model_.links.at(name)));
    if (alike(merged_body(model_.links.at(path_.tool), others), whole)) return;
    const std::optional<Body> alone = body_without(whole, others);
    write(path_.tool, alone.value_or(whole));
    changes_.push_back("link " + path_.tool + ": inertial");
    if (!alone) remove_bodies(path_.of_tool, path_.tool);
  }

  void add_payload(const Body& body, const Pose& T_base_sensor) {
    if (model_.links.contains(payload_link))
      model_.fail(std::string("there is a link ") + payload_link + " already, which is not fixed to " + path_.tip +
                  "; rename it");
    document_.append("link", payload_link);
    write(payload_link, body);
    fix(payload_link, T_base_sensor);
  }

  /// Adds the fixed joint that holds a new link on the tip.
  void fix(const std::string& name, const Pose& T_base_link) {
    pugi::xml_node fixed = document_.append("joint", path_.tip + "-" + name);
    fixed.append_attribute("type") = "fixed";
    pugi::xml_node origin = fixed.append_child("origin");
    const Pose T_base_parent = model_.parent_of(path_.tip)->moves() ? now(path_.tip) : T_base_tip_;
    write_origin(origin, T_base_parent.inverse() * T_base_link);
    fixed.append_child("parent").append_attribute("link") = path_.tip.c_str();
    fixed.append_child("child").append_attribute("link") = name.c_str();
    changes_.push_back("link " + name + ": added, fixed to " + path_.tip);
  }

  void remove_bodies(const std::set<std::string>& names, const std::string& main) {
    for (const std::string& name : names) {
      if (name == main || model_.links.at(name).mass == 0.0) continue;
      document_.element("link", name).remove_child("inertial");
      changes_.push_back("link " + name + ": inertial removed, its mass is in that of " + main);
    }
  }

  const UrdfModel& model_;
  const Cell& cell_;
  ArmPath path_;
  Document document_;
  ArmLinks arm_;
  /// The base, then the link that each joint moves, at zero: now, and in the document.
  std::vector<Pose> T_base_ = {Pose::Identity()}, T_old_ = {Pose::Identity()};
  Pose T_base_tip_ = Pose::Identity();
  std::set<std::string> behind_tip_;
  std::vector<std::string> changes_;
};

}  // namespace

UrdfUpdate update_urdf(std::string_view xml, const std::string& source, const Cell& cell, const UrdfOptions& options) {
  const UrdfModel model = read_urdf(xml, source);
  return Updater(model, xml, cell, options).run();
}

}  // namespace kr5::cell
