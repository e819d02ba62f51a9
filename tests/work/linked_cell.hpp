#pragma once

#include <filesystem>
#include <string>

#include <unistd.h>

#include <kr5/work/linked_options.hpp>

namespace kr5::test {

/// A cell with a few pellets.
inline sim::WorkCell small_cell(std::uint64_t seed, int pellets = 3) {
  sim::WorkCellOptions out;
  out.pour.pellets = pellets;
  out.pour.seed = static_cast<int>(seed);
  out.seed = seed;
  return sim::WorkCell(cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml"), out);
}

/// A journal that is not there yet.
inline std::filesystem::path new_journal(const std::string& name) {
  const auto out =
      std::filesystem::temp_directory_path() / ("kr5_linked_" + std::to_string(getpid()) + "_" + name + ".db");
  std::filesystem::remove(out);
  return out;
}

/// Pellets that were let go come to rest.
inline void let_rest(sim::WorkCell& cell) {
  for (int k = 0; k < 250; ++k) {
    cell.read();
    cell.send({});
  }
}

}  // namespace kr5::test
