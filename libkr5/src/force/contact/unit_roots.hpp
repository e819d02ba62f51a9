// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

/// @file
/// Real roots of small polynomials, safe against every degeneracy: between two roots of the derivative a polynomial is
/// monotone, so that a bracket either holds one root or none.

namespace kr5::force {

/// Up to N roots, ascending.
template <int N>
struct Roots {
  std::array<double, N> at{};
  int count = 0;
  void add(double t) noexcept {
    if (count < N) at[static_cast<std::size_t>(count++)] = t;
  }
};

template <int N>
double evaluate(const std::array<double, N + 1>& a, double t, double* slope) noexcept {
  double value = a[N], d = 0;
  for (int i = N - 1; i >= 0; --i) {
    d = d * t + value;
    value = value * t + a[static_cast<std::size_t>(i)];
  }
  *slope = d;
  return value;
}

/// The root in [low, high], at whose ends the polynomial has opposite signs: Newton's steps, halving where they leave
/// the bracket or do not shrink.
template <int N>
double bracketed_root(const std::array<double, N + 1>& a, double low, double high, bool rising) noexcept {
  double t = 0.5 * (low + high), last = high - low, slope = 0;
  for (int i = 0; i < 100; ++i) {
    const double value = evaluate<N>(a, t, &slope);
    if (value == 0) return t;
    ((value < 0) == rising ? low : high) = t;
    double step = slope == 0 ? last : -value / slope;
    if (!(t + step > low && t + step < high) || std::abs(step) > 0.5 * last) {
      step = 0.5 * (low + high) - t;
      if (t + step == low || t + step == high) return t + step;
    }
    last = std::abs(step);
    t += step;
    if (last < 1e-16) return t;
  }
  return t;
}

/// Roots of sum a_i t^i in [0, 1].
template <int N>
Roots<N> unit_roots(const std::array<double, N + 1>& a) noexcept {
  Roots<N> roots;
  if constexpr (N == 1) {
    const double t = -a[0] / a[1];
    if (t >= 0 && t <= 1) roots.add(t);
  } else {
    std::array<double, N> derivative;
    for (std::size_t i = 0; i < N; ++i) derivative[i] = static_cast<double>(i + 1) * a[i + 1];
    Roots<N - 1> turns = unit_roots<N - 1>(derivative);
    double low = 0, at_low = a[0], slope = 0;
    for (int i = 0; i <= turns.count; ++i) {
      const double high = i < turns.count ? turns.at[static_cast<std::size_t>(i)] : 1.0;
      const double at_high = evaluate<N>(a, high, &slope);
      if (at_low == 0)
        roots.add(low);
      else if ((at_low < 0) != (at_high < 0) && at_high != 0)
        roots.add(bracketed_root<N>(a, low, high, at_low < 0));
      low = high;
      at_low = at_high;
    }
    if (at_low == 0) roots.add(1.0);
  }
  return roots;
}

/// Least x > 0 in (0, pi] with c0 + c1 cos x + c2 cos 2x + s1 sin x + s2 sin 2x = 0, NaN when there is none; by
/// t = tan(x/2), for t beyond 1 by its inverse.
inline double first_angle(double c0, double c1, double c2, double s1, double s2) noexcept {
  const std::array<double, 5> a = {c0 + c1 + c2, 2 * s1 + 4 * s2, 2 * c0 - 6 * c2, 2 * s1 - 4 * s2, c0 - c1 + c2};
  const Roots<4> near = unit_roots<4>(a);
  if (near.count > 0) return 2 * std::atan(near.at[0]);
  const Roots<4> far = unit_roots<4>({a[4], a[3], a[2], a[1], a[0]});
  if (far.count > 0) return M_PI - 2 * std::atan(far.at[static_cast<std::size_t>(far.count - 1)]);
  return std::nan("");
}

}  // namespace kr5::force
