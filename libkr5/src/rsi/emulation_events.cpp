// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/emulation_events.hpp>

namespace kr5::rsi {
namespace {

std::string axis_name(int axis) { return axis > 6 ? "E" + std::to_string(axis - 6) : "A" + std::to_string(axis); }

/// What the sensor interface itself finds.
std::string signal_flow_message(Controller controller, const std::string& object, const std::string& error) {
  if (controller == Controller::Krc2) return "SEN: RSI execution error - RSI stopped (" + error + ")";
  return "KSS29002 Signal flow (running): Object " + object + " returns error " + error;
}

}  // namespace

std::string stop_message(Controller controller, const ProgramStop& stop) {
  const bool old = controller == Controller::Krc2;
  const std::string timeout = old ? "ERX: Defined timeout limit was reached. Answer from server missed!" : "RSITimeout";
  switch (stop.reason) {
    case ProgramStopReason::None:
      return {};
    case ProgramStopReason::LateAnswers:
    case ProgramStopReason::Idle:
      return signal_flow_message(controller, "ETHERNET1", timeout);
    case ProgramStopReason::LateShare:
      return signal_flow_message(controller, "ETHERNET1", old ? "ERX: Share of late packages too high" : "RSITimeout");
    case ProgramStopReason::AxisLimit:
      return signal_flow_message(controller, "AXISCORR1",
                                 "correction of " + axis_name(stop.axis) + " beyond its limit");
    case ProgramStopReason::TranslationLimit:
      return signal_flow_message(controller, "POSCORR1", "translation beyond its limit");
    case ProgramStopReason::RotationLimit:
      return signal_flow_message(controller, "POSCORR1", "rotation beyond its limit");
    case ProgramStopReason::CycleLimit:
      return signal_flow_message(controller, stop.axis > 0 ? "AXISCORR1" : "POSCORR1", "change in one cycle too large");
    case ProgramStopReason::AxisSpeed:
      return "KSS01102 Command velocity " + axis_name(stop.axis);
    case ProgramStopReason::Unreachable:
      return "Work envelope exceeded";
    case ProgramStopReason::Asked:
      return "RSI_MOVECORR ended by the computer";
    case ProgramStopReason::Disconnected:
      return signal_flow_message(controller, "ETHERNET1", "connection closed by the computer");
  }
  return {};
}

}  // namespace kr5::rsi
