// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/link_observations.hpp>

#include <iterator>
#include <utility>

namespace kr5::rsi {

void LinkObservations::append(LinkObservations later) {
  std::vector<Exchange> all = std::move(exchanges);
  all.insert(all.end(), std::make_move_iterator(later.exchanges.begin()),
             std::make_move_iterator(later.exchanges.end()));
  *this = std::move(later);
  exchanges = std::move(all);
}

}  // namespace kr5::rsi
