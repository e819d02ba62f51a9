#pragma once
#include <algorithm>
#include <cstdlib>

namespace kr5::test {

/// Every trial is asked for (KR5_FULL=1): rates are counted in earnest.
inline bool full() { return std::getenv("KR5_FULL") != nullptr; }

/// Trials that a rate is counted on: `all` in a full run, `part` in a short one, and an eighth of that under
/// sanitizers, which watch what the code does and learn nothing from doing it more often.
inline int trials(int all, int part) {
#ifdef KR5_SANITIZED
  part = std::max(part / 8, 1);
#endif
  return full() ? all : part;
}

}  // namespace kr5::test
