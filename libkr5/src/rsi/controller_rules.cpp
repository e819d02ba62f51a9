// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/controller_rules.hpp>

#include <cmath>
#include <string>
#include <utility>

#include <kr5/core/error.hpp>

namespace kr5::rsi {

void ControllerRules::validate() const {
  require(cycle >= 0.001 && cycle <= 0.1, "cycle: must lie between 1 and 100 ms [s]");
  require(answer_time > 0 && answer_time <= cycle, "answer_time: must be positive and within the cycle [s]");
  require(max_late >= 1 && max_late <= 100'000, "max_late: must lie between 1 and 100000 cycles");
  require(!max_late_share || (*max_late_share > 0 && *max_late_share <= 1),
          "max_late_share: must be above 0 and at most 1 [-]");
  require(late_window >= 1 && late_window <= 100'000, "late_window: must lie between 1 and 100000 cycles");
  for (const auto& [value, name] :
       {std::pair{axis_limit, "axis_limit"}, std::pair{external_limit, "external_limit"},
        std::pair{translation_limit, "translation_limit"}, std::pair{rotation_limit, "rotation_limit"},
        std::pair{axis_per_cycle.value_or(1), "axis_per_cycle"},
        std::pair{translation_per_cycle.value_or(1), "translation_per_cycle"},
        std::pair{rotation_per_cycle.value_or(1), "rotation_per_cycle"},
        std::pair{idle_limit.value_or(1), "idle_limit"}})
    require(value > 0 && std::isfinite(value), std::string(name) + ": must be positive");
}

ControllerRules usual_rules(Controller controller) {
  ControllerRules out;
  if (controller != Controller::Krc2) return out;
  out.cycle = krc2_cycle;
  out.answer_time = 0.010;
  out.max_late = 10;
  out.max_late_share = 0.1;
  out.sends_while_stopped = false;
  out.greets = true;
  return out;
}

}  // namespace kr5::rsi
