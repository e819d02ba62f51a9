// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace kr5::vision {

/// Normal distribution function and density from a table (error below 3e-6).
class NormalTable {
 public:
  static const NormalTable& get() {
    static const NormalTable table;
    return table;
  }
  template <class T>
  void operator()(T z, T& cdf, T& pdf) const {
    if (z <= -limit) return void((cdf = 0, pdf = 0));
    if (z >= limit) return void((cdf = 1, pdf = 0));
    const T position = (z + static_cast<T>(limit)) * per_unit;
    const auto i = static_cast<std::size_t>(position);
    const T t = position - static_cast<T>(i);
    cdf = static_cast<T>(cdf_[i]) + t * static_cast<T>(cdf_[i + 1] - cdf_[i]);
    pdf = static_cast<T>(pdf_[i]) + t * static_cast<T>(pdf_[i + 1] - pdf_[i]);
  }

 private:
  static constexpr int per_unit = 128;
  static constexpr double limit = 4.5;
  static constexpr std::size_t size = static_cast<std::size_t>(2 * limit * per_unit) + 2;
  std::array<double, size> cdf_, pdf_;

  NormalTable() {
    for (std::size_t i = 0; i < size; ++i) {
      const double z = static_cast<double>(i) / per_unit - limit;
      cdf_[i] = 0.5 * std::erfc(-z * M_SQRT1_2);
      pdf_[i] = std::exp(-z * z / 2) * 0.3989422804014327;
    }
  }
};

}  // namespace kr5::vision
