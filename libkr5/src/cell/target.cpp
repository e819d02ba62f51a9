// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/target.hpp>

namespace kr5::cell {

Target Board::target() const {
  Target out;
  out.kind = TargetKind::TagGrid;
  out.rows = rows;
  out.cols = cols;
  out.size = marker;
  out.gap = gap;
  out.family = family;
  out.first_id = first_id;
  out.T_base_target = T_base_target;
  return out;
}

}  // namespace kr5::cell
