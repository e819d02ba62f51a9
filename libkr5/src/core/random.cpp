// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/core/random.hpp>

#include <locale>
#include <sstream>

#include <kr5/core/error.hpp>

namespace kr5 {

std::string Random::state() const {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << engine_ << ' ' << normal_;
  return out.str();
}

void Random::restore(const std::string& state) {
  std::istringstream in(state);
  in.imbue(std::locale::classic());
  std::mt19937_64 engine;
  std::normal_distribution<double> normal;
  in >> engine >> normal;
  require(!in.fail() && (in >> std::ws).eof(), "random state: is no state of a random generator");
  engine_ = engine;
  normal_ = normal;
}

}  // namespace kr5
