// SPDX-License-Identifier: BSD-3-Clause
#include "scrambled_sobol.hpp"

#include <bit>

#include <boost/random/sobol.hpp>

#include <kr5/core/random.hpp>

namespace kr5::uncertainty {

ScrambledSobol::ScrambledSobol(Eigen::Index dimension, int replicates, std::uint64_t seed)
    : dimension_(dimension), scrambles_(static_cast<std::size_t>(dimension * replicates)) {
  Random random(seed);
  for (Scramble& scramble : scrambles_) {
    for (int k = 0; k < bits; ++k) {
      const std::uint32_t diagonal = std::uint32_t{1} << (bits - 1 - k);
      const std::uint32_t above = ~(diagonal - 1) & ~diagonal;  // bits that weigh more
      scramble.rows[k] = (static_cast<std::uint32_t>(random.engine()()) & above) | diagonal;
    }
    scramble.shift = random.engine()();
  }
}

double ScrambledSobol::Scramble::apply(std::uint64_t x) const {
  const auto top = static_cast<std::uint32_t>(x >> bits);
  std::uint32_t out = 0;
  for (const std::uint32_t row : rows) out = (out << 1) | static_cast<std::uint32_t>(std::popcount(top & row) & 1);
  const std::uint64_t shifted = (static_cast<std::uint64_t>(out) << bits) ^ shift;
  constexpr double scale = 1.0 / 9007199254740992.0;  // of the 53 bits that a number has
  return (static_cast<double>(shifted >> 11) + 0.5) * scale;
}

void ScrambledSobol::points(int replicate, std::int64_t first, Eigen::Ref<Eigen::MatrixXd> out) const {
  boost::random::sobol sequence(static_cast<std::size_t>(dimension_));  // without its first point, the origin
  if (first > 1) sequence.seed(static_cast<std::uint64_t>(first - 1));
  const Scramble* scramble = scrambles_.data() + replicate * dimension_;
  for (Eigen::Index i = 0; i < out.rows(); ++i)
    for (Eigen::Index k = 0; k < dimension_; ++k) out(i, k) = scramble[k].apply(first + i == 0 ? 0 : sequence());
}

}  // namespace kr5::uncertainty
