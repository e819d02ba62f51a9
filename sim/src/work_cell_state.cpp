// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/work_cell_state.hpp>

#include <kr5/core/error.hpp>

namespace kr5::sim {
namespace {

constexpr const char* state_format = "kr5-work-cell-state/1";

}  // namespace

void save_state(const WorkCellState& state, const std::filesystem::path& file) {
  io::Node document;
  document["format"] = io::Node::make_scalar(std::string(state_format));
  document["state"] = state.document;
  io::write_text(file, io::to_yaml(document));
}

WorkCellState load_state(const std::filesystem::path& file) {
  const io::Node document = io::load_yaml(file);
  const io::Node* const found = document.find("format");
  const io::Node* const state = document.find("state");
  if (!found || found->scalar != state_format || !state)
    throw IoError(file.string() + ": format: found " + (found ? found->scalar : std::string("none")) + ", expected " +
                  state_format + ", a file that save_state wrote");
  return {*state};
}

}  // namespace kr5::sim
