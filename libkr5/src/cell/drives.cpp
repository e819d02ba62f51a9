// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/drives.hpp>

#include <algorithm>

#include <kr5/io/format.hpp>

namespace kr5::cell {
namespace {

using io::Node;
using io::Reader;

/// `{natural_frequency: [45, 50], damping_ratio: 0.8, delay: 0.0}`: a number holds for every joint.
template <typename Loop>
bool read_columns(Reader& reader, const Node& node, const std::string& field, std::vector<Loop>& joints) {
  std::size_t count = 1;
  for (const auto& [key, entry] : node.entries)
    if (entry.kind == Node::Kind::Sequence) count = std::max(count, entry.items.size());
  joints.assign(count, {});
  for (std::size_t i = 0; i < count; ++i) {
    Node one = node;
    for (auto& [key, entry] : one.entries) {
      if (entry.kind != Node::Kind::Sequence) continue;
      if (entry.items.size() != count)
        return reader.report(entry, Reader::join(field, key), "one number, or a list of " + std::to_string(count)),
               false;
      entry = Node(entry.items[i]);
    }
    if (!reader.read(one, count == 1 ? field : field + "[" + std::to_string(i) + "]", joints[i])) return false;
  }
  return true;
}

}  // namespace

Drives unit_drives(int joints) {
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(joints);
  return {Eigen::MatrixXd::Identity(joints, joints), zero, Eigen::VectorXd::Ones(joints), {zero, zero}};
}

bool Servo::from_node(Reader& reader, const Node& node, const std::string& field) {
  Node rest = node;
  bool good = true;
  const auto take_columns = [&](const char* key, auto& loops) {
    const Node* entry = node.find(key);
    if (!entry || entry->kind != Node::Kind::Map) return;
    std::erase_if(rest.entries, [&](const auto& e) { return e.first == key; });
    good = read_columns(reader, *entry, Reader::join(field, key), loops) && good;
  };
  std::vector<SecondOrder> of_joints;
  std::vector<TorqueServo> of_torques;
  take_columns("joint", of_joints);
  take_columns("torque", of_torques);
  good = reader.read_fields(rest, field, *this) && good;
  if (!of_joints.empty()) joint = std::move(of_joints);
  if (!of_torques.empty()) torque = std::move(of_torques);
  return good;
}

Node Servo::to_node() const {
  Node node = io::detail::short_map(*this);
  for (auto& [key, entry] : node.entries) {
    if (key == "joint" && joint.size() == 1) entry = io::to_short_node(joint[0]);
    if (key == "torque" && torque.size() == 1) entry = io::to_short_node(torque[0]);
  }
  return node;
}

}  // namespace kr5::cell
