// SPDX-License-Identifier: BSD-3-Clause
#include "cell/urdf/arm_path.hpp"

#include <algorithm>

#include <kr5/cell/arm_links.hpp>
#include <kr5/io/diagnostic.hpp>

#include "cell/check/diagnostic_collector.hpp"
#include "cell/urdf/elements.hpp"

namespace kr5::cell {
namespace {

class PathFinder {
 public:
  PathFinder(const UrdfModel& model, const UrdfOptions& options) : model_(model) {
    out_.base = options.base.empty() ? root() : existing(options.base, "base");
    out_.tip = options.tip.empty() ? only_end() : existing(options.tip, "tip");
  }

  ArmPath run() {
    find_path();
    place(out_.base, Pose::Identity(), 0);
    find_tool();
    return std::move(out_);
  }

 private:
  std::string root() const {
    std::vector<std::string> roots;
    for (const auto& [name, body] : model_.links)
      if (!model_.parent_of(name)) roots.push_back(name);
    if (roots.size() != 1)
      model_.fail(roots.empty() ? "no link is the root"
                                : "several links are roots (" + listed(roots) + "); name the base");
    return roots[0];
  }

  std::string existing(const std::string& link, const char* what) const {
    if (model_.links.contains(link)) return link;
    std::vector<std::string> names;
    for (const auto& [name, body] : model_.links) names.push_back(name);
    const std::string near = io::nearest_name(link, names);
    model_.fail("there is no link \"" + link + "\" for the " + what +
                (near.empty() ? "; the links are " + listed(names) : "; is it " + near + "?"));
  }

  bool carries_joints(const std::string& link) const {
    const auto children = model_.children_of(link);
    return std::any_of(children.begin(), children.end(),
                       [&](const UrdfJoint* j) { return j->moves() || carries_joints(j->child); });
  }

  /// Whether a joint holds a payload, or a sensor beside the tip, behind which no tip is.
  bool is_payload(const UrdfJoint& joint) const {
    return !joint.moves() && (joint.child == payload_link || joint.child == sensor_link) &&
           model_.children_of(joint.child).empty();
  }

  /// Moving joints on the longest way from a link to an end.
  int longest_way(const std::string& link) const {
    int out = 0;
    for (const UrdfJoint* j : model_.children_of(link))
      out = std::max(out, longest_way(j->child) + (j->moves() ? 1 : 0));
    return out;
  }

  /// Ways on from a link: those to further joints, or else those to what is fixed.
  std::vector<const UrdfJoint*> ways_from(const std::string& link) const {
    std::vector<const UrdfJoint*> ways = model_.children_of(link);
    if (carries_joints(link))
      std::erase_if(ways, [&](const UrdfJoint* j) { return !j->moves() && !carries_joints(j->child); });
    std::erase_if(ways, [&](const UrdfJoint* j) { return is_payload(*j); });
    return ways;
  }

  /// Follows the moving joints, then the fixed links behind the last of them, as long as there is one way. Where
  /// several end without a joint, or as the fingers of a hand do, the link before them is the end of the arm.
  std::string only_end() {
    std::string at = out_.base;
    int joints = 0;
    while (true) {
      const std::vector<const UrdfJoint*> ways = ways_from(at);
      if (ways.empty()) return at;
      if (ways.size() > 1) {
        for (const UrdfJoint* j : ways) out_.ends.push_back(j->child);
        const int behind = longest_way(at);
        if (joints + behind == 0) model_.fail("no joint moves, so it holds no arm");
        if (arm_ends_before(joints, behind)) return at;
        model_.fail("behind link " + at + " the robot branches to " + listed(out_.ends) +
                    "; name the link that is the tip (--tip)");
      }
      joints += ways[0]->moves() ? 1 : 0;
      at = ways[0]->child;
    }
  }

  void find_path() {
    std::string at = out_.tip;
    for (std::size_t steps = 0; at != out_.base; ++steps) {
      out_.chain.insert(at);
      const UrdfJoint* joint = model_.parent_of(at);
      if (!joint || steps > model_.joints.size())
        model_.fail("the tip " + out_.tip + " is not connected to the base " + out_.base);
      if (joint->moves()) out_.joints.insert(out_.joints.begin(), joint);
      at = joint->parent;
    }
    if (out_.joints.empty()) model_.fail("no joint moves between " + out_.base + " and " + out_.tip);
    for (const UrdfJoint* joint : out_.joints) require_arm_joint(*joint);
  }

  void require_arm_joint(const UrdfJoint& joint) const {
    if (joint.type == "floating" || joint.type == "planar" || joint.type == "spherical")
      model_.fail("joint " + joint.name + " is " + joint.type +
                  "; an arm has revolute and prismatic joints, so name a base behind it (--base " + joint.child +
                  ") or a tip before it (--tip " + joint.parent + ")");
    if (joint.axis.isZero(0.0))
      model_.fail("<joint name=\"" + joint.name + "\">: found an axis of length 0, expected a direction");
    if (!joint.mimicked.empty())
      model_.fail("joint " + joint.name + " mimics another (" + joint.name + " = " +
                  number_text(joint.mimic_multiplier) + " " + joint.mimicked + " + " + number_text(joint.mimic_offset) +
                  "); the joints of an arm must be independent: remove its <mimic>, which makes it a joint with values "
                  "and torques of its own, or end the arm before it (--tip " +
                  joint.parent + ")");
  }

  void place(const std::string& link, const Pose& T, std::size_t carrier) {
    out_.links[link] = {T, carrier};
    for (const UrdfJoint* joint : model_.children_of(link)) {
      const bool next = carrier < out_.joints.size() && joint == out_.joints[carrier];
      if (joint->moves() && !next && carrier > 0) out_.held.push_back(joint->name);
      place(joint->child, T * joint->T_parent_child, carrier + next);
    }
  }

  /// Whether fixed joints alone connect a link to the last that the arm moves.
  bool is_held_by_flange(std::string link) const {
    while (link != out_.joints.back()->child) {
      const UrdfJoint* joint = model_.parent_of(link);
      if (!joint || joint->moves()) return false;
      link = joint->parent;
    }
    return true;
  }

  void find_tool() {
    for (const char* name : {sensor_link, payload_link}) {
      if (!is_held_by_flange(name)) continue;
      out_.tool = name;
      return add_to_tool(name);
    }
  }

  void add_to_tool(const std::string& link) {
    out_.of_tool.insert(link);
    for (const UrdfJoint* joint : model_.children_of(link)) add_to_tool(joint->child);
  }

  const UrdfModel& model_;
  ArmPath out_;
};

}  // namespace

ArmPath find_arm_path(const UrdfModel& model, const UrdfOptions& options) { return PathFinder(model, options).run(); }

}  // namespace kr5::cell
