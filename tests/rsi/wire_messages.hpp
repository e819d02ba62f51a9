#pragma once

#include <stdexcept>
#include <string>

#include <kr5/io/node.hpp>
#include <kr5/rsi/layout_file.hpp>

#include "support/reference.hpp"

namespace kr5::test {

inline std::string wire_file(const std::string& name) { return reference("data/rsi_wire") / name; }

/// A telegram of published drivers, by its name.
inline std::string wire_message(const std::string& id) {
  static const io::Node all = io::load_yaml(wire_file("messages.json"));
  for (const io::Node& m : all.find("messages")->items)
    if (m.find("id")->scalar == id) return m.find("text")->scalar;
  throw std::runtime_error("no message " + id);
}

inline rsi::TelegramLayout wire_layout(const std::string& file) { return rsi::load_layout(wire_file(file)); }

/// That of the telegrams with program state and override of FZI's tests.
inline rsi::TelegramLayout fzi_test_layout() {
  rsi::TelegramLayout out = wire_layout("fzi_ros_rsi_ethernet.xml");
  std::erase_if(out.send, [](const rsi::TelegramElement& e) { return e.tag.starts_with("GearTorque"); });
  out.sensor_type = "TestSenType";
  return out;
}

}  // namespace kr5::test
