// SPDX-License-Identifier: BSD-3-Clause
#include "gap/stages/stage_progress.hpp"

#include <algorithm>
#include <memory>
#include <mutex>
#include <utility>

namespace kr5::gap {

void tell(const DiagnoseOptions& options, const Step& step, double fraction) {
  if (options.progress) options.progress(step.name, step.from + (step.to - step.from) * fraction);
}

std::function<void(const std::string&, double)> never_falling(
    std::function<void(const std::string&, double)> listener) {
  if (!listener) return {};
  struct State {
    std::mutex telling;
    double done = 0.0;
  };
  return [listener = std::move(listener), state = std::make_shared<State>()](const std::string& stage, double done) {
    const std::lock_guard lock(state->telling);
    state->done = std::max(state->done, done);
    listener(stage, state->done);
  };
}

}  // namespace kr5::gap
