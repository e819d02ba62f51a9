#pragma once
#include <algorithm>
#include <cstdlib>

namespace kr5::test {

/// Every trial is asked for (KR5_FULL=1): rates are counted in earnest.
inline bool full() { return std::getenv("KR5_FULL") != nullptr; }

/// The sanitizers watch what the code does, and learn nothing from doing it more often.
#ifdef KR5_SANITIZED
inline constexpr bool sanitized = true;
#else
inline constexpr bool sanitized = false;
#endif

/// Trials that a rate is counted on: `all` in a full run, `part` in a short one, and an eighth of that under
/// sanitizers.
inline int trials(int all, int part) {
  if (sanitized) part = std::max(part / 8, 1);
  return full() ? all : part;
}

}  // namespace kr5::test
