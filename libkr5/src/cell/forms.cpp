// SPDX-License-Identifier: BSD-3-Clause
// Parts of a cell that a file may write in more ways than one.
#include <kr5/cell/drives.hpp>
#include <kr5/cell/sensors.hpp>
#include <kr5/cell/target.hpp>
#include <kr5/io/form.hpp>

namespace kr5::cell {
namespace {

using io::Node;
using io::Reader;

/// `{natural_frequency: [45, 50], damping_ratio: 0.8, delay: 0.0}`: a number holds for every joint.
bool read_columns(Reader& reader, const Node& node, const std::string& field, std::vector<SecondOrder>& joints) {
  std::size_t count = 1;
  for (const auto& [key, entry] : node.entries)
    if (entry.kind == Node::Kind::Sequence) count = std::max(count, entry.items.size());
  joints.assign(count, {});
  for (std::size_t i = 0; i < count; ++i) {
    Node one = node;
    for (auto& [key, entry] : one.entries) {
      if (entry.kind != Node::Kind::Sequence) continue;
      if (entry.items.size() != count)
        return reader.problem(entry, Reader::join(field, key), "one number, or a list of " + std::to_string(count)),
               false;
      entry = Node(entry.items[i]);
    }
    if (!reader.read(one, count == 1 ? field : field + "[" + std::to_string(i) + "]", joints[i])) return false;
  }
  return true;
}

}  // namespace

bool Servo::read_form(Reader& reader, const Node& node, const std::string& field) {
  const Node* entry = node.find("joint");
  if (!entry || entry->kind != Node::Kind::Map) return reader.read_fields(node, field, *this);
  Node rest = node;
  std::erase_if(rest.entries, [](const auto& e) { return e.first == "joint"; });
  const bool good = reader.read_fields(rest, field, *this);
  return read_columns(reader, *entry, Reader::join(field, "joint"), joint) && good;
}

Node Servo::write_form() const {
  Node node = io::detail::short_map(*this);
  for (auto& [key, entry] : node.entries)
    if (key == "joint" && joint.size() == 1) entry = io::to_short_node(joint[0]);
  return node;
}

bool Distortion::read_form(Reader& reader, const Node& node, const std::string& field) {
  if (node.kind == Node::Kind::Sequence) {
    if (node.items.size() != 5)
      return reader.problem(node, field, "k1 k2 p1 p2 k3, or {model: ..., values: [...]} for other lenses"), false;
    model = LensModel::Brown5;
    return reader.read(node, field, values);
  }
  if (!reader.read_fields(node, field, *this)) return false;
  const std::vector<int> places = lens_parameters(model);
  if (values.size() == places.size()) return true;
  std::string wanted;
  for (const int i : places)
    wanted += (wanted.empty() ? ": " : " ") + std::string(Pinhole::parameter_names[std::size_t(i)]);
  const Node* list = node.find("values");
  reader.problem(list ? *list : node, Reader::join(field, "values"),
                 "the " + std::to_string(places.size()) + " values of " + std::string(name_of(model)) + wanted);
  return false;
}

Node Distortion::write_form() const {
  if (model == LensModel::Brown5) return io::to_node(values);
  Node node;
  node["model"] = io::to_node(model);
  node["values"] = io::to_node(values);
  node.flow = true;
  return node;
}

Pinhole Camera::pinhole() const {
  Pinhole p{.width = width, .height = height, .fx = fx, .fy = fy, .cx = cx, .cy = cy};
  const std::vector<int> places = lens_parameters(distortion.model);
  Pinhole::Parameters all = p.parameters();
  for (std::size_t i = 0; i < places.size(); ++i) all[places[i]] = distortion.values.at(i);
  p.set_parameters(all);
  return p;
}

Target Board::target() const {
  Target out;
  out.kind = TargetKind::TagGrid;
  out.rows = rows;
  out.cols = cols;
  out.size = marker;
  out.gap = gap;
  out.family = family;
  out.first_id = first_id;
  out.T_B_W = T_B_W;
  return out;
}

}  // namespace kr5::cell
