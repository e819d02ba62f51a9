// SPDX-License-Identifier: BSD-3-Clause
#include "scene_rows.hpp"

namespace kr5::sim {

io::Table RowTable::table() const {
  io::Table out{columns_,
                Eigen::MatrixXd(static_cast<Eigen::Index>(rows_.size()), static_cast<Eigen::Index>(columns_.size()))};
  for (std::size_t k = 0; k < rows_.size(); ++k)
    out.values.row(static_cast<Eigen::Index>(k)) =
        Eigen::Map<const Eigen::RowVectorXd>(rows_[k].data(), out.values.cols());
  return out;
}

}  // namespace kr5::sim
