// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/controller_files.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <kr5/core/error.hpp>
#include <kr5/rsi/cycles.hpp>
#include <kr5/rsi/layout_file.hpp>

#include "rsi/krl_program.hpp"
#include "rsi/signal_flow.hpp"

namespace kr5::rsi {
namespace {

const std::string programs = "C:\\KRC\\ROBOTER\\KRC\\R1\\Program";
const std::string sensors = "C:\\KRC\\ROBOTER\\Config\\User\\Common\\SensorInterface";
const std::string initials = "C:\\KRC\\ROBOTER\\Init";

bool is_krl_name(const std::string& name) {
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  const auto inner = [&](char c) { return letter(c) || (c >= '0' && c <= '9'); };
  return !name.empty() && name.size() <= 24 && letter(name.front()) && std::ranges::all_of(name, inner);
}

void check_cycle(const TelegramLayout& layout, const ProgramOptions& options) {
  if (!options.cycle) return;
  const auto is = [&](double cycle) { return std::abs(*options.cycle - cycle) < 1e-6; };
  const bool slow = is(krc2_cycle), quick = is(short_cycle);
  require(slow || (quick && layout.controller != Controller::Krc2),
          "cycle: a KR C2 has 12 ms, the other controllers have 4 or 12 ms [s]");
}

}  // namespace

void ProgramOptions::validate() const {
  require(is_krl_name(name), "name: must be a letter and letters, digits and underscores, at most 24");
  require(start.empty() || start.size() == 6, "start: must be six joint values, or none [rad]");
  for (const double value : start) require(std::abs(value) < 7.0, "start: must lie within a turn [rad]");
  require(timeout >= 1 && timeout <= 10000, "timeout: must lie between 1 and 10000 answers");
  require(flag >= 0 && flag <= 999, "flag: must lie between 0 and 999");
  for (const auto& [value, what] :
       {std::pair{axis_limit, "axis_limit"}, {rotation_limit, "rotation_limit"}, {external_limit, "external_limit"}})
    require(value > 0 && value < 7.0, std::string(what) + ": must be positive and below a turn");
  require(translation_limit > 0 && translation_limit < 2.0, "translation_limit: must lie between 0 and 2 m [m]");
}

ControllerFiles controller_files(const TelegramLayout& layout, const ProgramOptions& options) {
  layout.validate();
  options.validate();
  check_cycle(layout, options);
  ControllerFiles out;
  if (layout.controller == Controller::Krc2) {
    const std::string program = krl_program_rsi2(layout, options, out.unwired);
    if (program.find("ST_PATHCORR") != program.npos) out.unconfirmed = {"ST_PATHCORR", "ST_ON1"};
    out.files = {{options.name + ".src", programs, program}, {options.name + ".xml", initials, layout_xml(layout)}};
    return out;
  }
  const std::string config = options.name + "_ethernet.xml";
  SignalFlow flow = signal_flow(layout, options, config);
  const bool rsi3 = layout.controller == Controller::Krc4Rsi3;
  out.files = {{options.name + ".src", programs, krl_program(layout, options)},
               {config, sensors, layout_xml(layout)},
               {options.name + (rsi3 ? ".rsi.xml" : ".rsix"), sensors,
                rsi3 ? signal_flow_rsi3(flow) : signal_flow_rsix(flow, layout.controller)}};
  out.unwired = std::move(flow.unwired);
  out.unconfirmed = std::move(flow.unconfirmed);
  return out;
}

}  // namespace kr5::rsi
