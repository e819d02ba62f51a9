// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/sensors.hpp>

#include <algorithm>

#include <kr5/io/format.hpp>

namespace kr5::cell {

using io::Node;
using io::Reader;

bool Distortion::from_node(Reader& reader, const Node& node, const std::string& field) {
  if (node.kind == Node::Kind::Sequence) {
    if (node.items.size() != 5)
      return reader.report(node, field, "k1 k2 p1 p2 k3, or {model: ..., values: [...]} for other lenses"), false;
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
  reader.report(list ? *list : node, Reader::join(field, "values"),
                "the " + std::to_string(places.size()) + " values of " + std::string(name_of(model)) + wanted);
  return false;
}

Node Distortion::to_node() const {
  if (model == LensModel::Brown5) return io::to_node(values);
  Node node;
  node["model"] = io::to_node(model);
  node["values"] = io::to_node(values);
  node.flow = true;
  return node;
}

bool Camera::from_node(Reader& reader, const Node& node, const std::string& field) {
  Node body = node;
  for (auto& [key, entry] : body.entries) {
    if (key != "mount") continue;
    if (entry.kind != Node::Kind::Scalar || (entry.scalar != "flange" && entry.scalar != "base"))
      return reader.report(entry, Reader::join(field, key), "one of flange | base"), false;
    entry.scalar = name_of(entry.scalar == "flange" ? Mount::EyeInHand : Mount::EyeToHand);
  }
  return reader.read_fields(body, field, *this);
}

Node Camera::to_node() const {
  Node node = io::detail::short_map(*this);
  for (auto& [key, entry] : node.entries)
    if (key == "mount") entry.scalar = mount == Mount::EyeInHand ? "flange" : "base";
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

namespace {

/// Whether a lens model frees every coefficient that is not zero.
bool holds(LensModel model, const Pinhole::Parameters& all) {
  constexpr int intrinsics = 4;
  const std::vector<int> places = lens_parameters(model);
  for (int i = intrinsics; i < Pinhole::parameter_count; ++i)
    if (all[i] != 0.0 && std::find(places.begin(), places.end(), i) == places.end()) return false;
  return true;
}

}  // namespace

void Camera::set_pinhole(const Pinhole& lens) {
  width = lens.width, height = lens.height;
  fx = lens.fx, fy = lens.fy, cx = lens.cx, cy = lens.cy;
  const Pinhole::Parameters all = lens.parameters();
  if (!holds(distortion.model, all))
    for (const auto& [model, name] : enum_names(LensModel{}))
      if (holds(model, all)) {
        distortion.model = model;
        break;
      }
  distortion.values.clear();
  for (const int place : lens_parameters(distortion.model)) distortion.values.push_back(all[place]);
}

}  // namespace kr5::cell
