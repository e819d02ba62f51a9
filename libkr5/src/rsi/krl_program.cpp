// SPDX-License-Identifier: BSD-3-Clause
#include "rsi/krl_program.hpp"

#include <algorithm>
#include <utility>

#include <kr5/rsi/cycles.hpp>

#include "rsi/number_text.hpp"
#include "rsi/wire_units.hpp"

namespace kr5::rsi {
namespace {

std::string head(const ProgramOptions& options) {
  return "&ACCESS RVP\n&REL 1\n&PARAM EDITMASK = *\nDEF " + options.name +
         "( )\n; Written by kr5: the computer at the other end of the sensor interface corrects the path.\n";
}

std::string initialisation(bool interrupt) {
  return std::string("\n;FOLD INI\n  ;FOLD BASISTECH INI\n") +
         (interrupt ? "    GLOBAL INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO IR_STOPM ( )\n    INTERRUPT ON 3\n" : "") +
         "    BAS (#INITMOV,0 )\n  ;ENDFOLD (BASISTECH INI)\n;ENDFOLD (INI)\n\n";
}

/// The motion to where the program starts; to where the arm stands, that makes the block coincidence.
std::string start_motion(const TelegramLayout& layout, const ProgramOptions& options) {
  std::string out = "PTP $AXIS_ACT\n";
  if (options.start.empty()) return out;
  Eigen::VectorXd axes = Eigen::Map<const Eigen::VectorXd>(options.start.data(), 6);
  if (layout.axes) axes = layout.axes->sign.head(6).cwiseProduct(axes - layout.axes->zero.head(6));
  out += "PTP {";
  for (Eigen::Index i = 0; i < axes.size(); ++i)
    out += (i ? ", A" : "A") + std::to_string(i + 1) + " " + number_text(axes[i] / degree);
  return out + "}\n";
}

/// A call whose answer stops the program unless it is good.
std::string checked(const std::string& variable, const std::string& call, const std::string& good) {
  return variable + " = " + call + "\nIF (" + variable + " <> " + good + ") THEN\n  HALT\nENDIF\n";
}

std::string mode_name(const ProgramOptions& options, double cycle) {
  const bool relative = options.mode == robot::CommandMode::Relative;
  return std::string(relative ? "#RELATIVE" : "#ABSOLUTE") + (cycle > 0.008 ? ",#IPO" : "");
}

/// Links the channels of a meaning to the inputs of an object.
std::string links(const TelegramLayout& layout, Meaning meaning, const std::string& object, int inputs,
                  std::vector<std::string>& wired) {
  std::string out;
  for (const TelegramElement& e : layout.receive) {
    if (!e.index) continue;
    const TelegramField field = telegram_fields({e}).front();
    if (field.meaning != meaning || field.component >= inputs) continue;
    out += checked("err",
                   "ST_NEWLINK(hEthernet," + std::to_string(*e.index) + "," + object + "," +
                       std::to_string(field.component + 1) + ")",
                   "#RSIOK");
    wired.push_back(e.tag);
  }
  return out;
}

std::string parameter(const std::string& object, int number, double value) {
  return checked("err", "ST_SETPARAM(" + object + "," + std::to_string(number) + "," + number_text(value) + ")",
                 "#RSIOK");
}

/// Object of the axis corrections: its first parameter is the mode, then lower and upper limits of twelve axes each.
std::string axis_object(const TelegramLayout& layout, const ProgramOptions& options, std::vector<std::string>& wired) {
  const std::string wires = links(layout, Meaning::AxisCorrection, "hAxis", 6, wired);
  if (wires.empty()) return {};
  std::string out = "\n; Corrections of the axes\n" + checked("err", "ST_AXISCORR(hAxis,container)", "#RSIOK") + wires;
  out += parameter("hAxis", 1, options.mode == robot::CommandMode::Relative ? 1 : 0);
  for (int axis = 0; axis < 6; ++axis) {
    out += parameter("hAxis", 2 + axis, -options.axis_limit / degree);
    out += parameter("hAxis", 14 + axis, options.axis_limit / degree);
  }
  return out;
}

std::string path_object(const TelegramLayout& layout, std::vector<std::string>& wired) {
  const std::string wires = links(layout, Meaning::CartesianCorrection, "hPath", 6, wired);
  if (wires.empty()) return {};
  return "\n; Corrections of the path\n" + checked("err", "ST_PATHCORR(hPath,container)", "#RSIOK") + wires;
}

}  // namespace

std::string krl_program(const TelegramLayout& layout, const ProgramOptions& options) {
  const double cycle = options.cycle.value_or(short_cycle);
  std::string out = head(options) + "DECL INT ret\n";
  const bool iiqka = layout.controller == Controller::Iiqka;
  if (!iiqka) out += "DECL INT CONTID\n";
  out += initialisation(!iiqka) + start_motion(layout, options) + "\n; The sensor interface\n";
  const std::string flow = options.name + (layout.controller == Controller::Krc4Rsi3 ? ".rsi" : "");
  if (iiqka) {
    out += checked("ret", "RSI_LOAD(\"" + flow + "\")", "RSIOK") +
           checked("ret", "RSI_ACTIVATE(\"" + flow + "\")", "RSIOK") +
           checked("ret", "RSI_PROCESS_ON(" + mode_name(options, cycle) + ")", "RSIOK");
  } else {
    out += checked("ret", "RSI_CREATE(\"" + flow + "\",CONTID,TRUE)", "RSIOK") +
           checked("ret", "RSI_ON(" + mode_name(options, cycle) + ")", "RSIOK");
  }
  out += "\n; Guided by the computer until a stop\nRSI_MOVECORR()\n\n";
  return out + checked("ret", iiqka ? "RSI_PROCESS_OFF()" : "RSI_OFF()", "RSIOK") + "END\n";
}

std::string krl_program_rsi2(const TelegramLayout& layout, const ProgramOptions& options,
                             std::vector<std::string>& unwired) {
  std::vector<std::string> wired;
  const std::string file = options.name + ".xml";
  std::string out = head(options) + "DECL RSIERR err\nINT hEthernet, hAxis, hPath, container\nCHAR file[" +
                    std::to_string(file.size() + 1) + "]\n" + initialisation(true) + "file[] = \"" + file +
                    "\"\ncontainer = 0\n" + start_motion(layout, options) + "\n; The connection\n" +
                    checked("err", "ST_ETHERNET(hEthernet,container,file[])", "#RSIOK");
  out += axis_object(layout, options, wired);
  const std::string path = path_object(layout, wired);
  const bool tool = options.frame == robot::CommandFrame::Tool;
  const std::string mode = options.mode == robot::CommandMode::Relative ? "1" : "0";
  out += path + "\n; Guided by the computer until a stop\n" +
         checked("err", path.empty() ? "ST_ON()" : "ST_ON1(" + std::string(tool ? "#TCP" : "#BASE") + "," + mode + ")",
                 "#RSIOK") +
         "ST_SKIPSENS()\n\n" + checked("err", "ST_OFF()", "#RSIOK") + "END\n";
  for (const auto* list : {&layout.send, &layout.receive})
    for (const TelegramElement& e : *list)
      if (e.index && std::ranges::find(wired, e.tag) == wired.end()) unwired.push_back(e.tag);
  return out;
}

}  // namespace kr5::rsi
