// SPDX-License-Identifier: BSD-3-Clause
#include "changed_pixels.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace kr5::picking {

using Eigen::Index;

namespace {

/// Lower envelope of parabolas: min over j of (i - j)^2 + f(j).
void transform_line(Eigen::VectorXd& f) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  std::vector<Index> at;      // apices of the envelope
  std::vector<double> start;  // from where each is lowest
  for (Index j = 0; j < f.size(); ++j) {
    if (f[j] == infinity) continue;
    double from = -infinity;
    while (!at.empty()) {
      const auto a = static_cast<double>(at.back()), b = static_cast<double>(j);
      from = (f[j] + b * b - f[at.back()] - a * a) / (2 * (b - a));
      if (from > start.back()) break;
      at.pop_back();
      start.pop_back();
      from = -infinity;
    }
    at.push_back(j);
    start.push_back(from);
  }
  if (at.empty()) return;
  Eigen::VectorXd out(f.size());
  std::size_t k = 0;
  for (Index i = 0; i < f.size(); ++i) {
    while (k + 1 < at.size() && start[k + 1] <= static_cast<double>(i)) ++k;
    const auto d = static_cast<double>(i - at[k]);
    out[i] = d * d + f[at[k]];
  }
  f = out;
}

}  // namespace

Eigen::MatrixXd distance_to(const PixelMask& mask) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Eigen::MatrixXd out = Eigen::MatrixXd::NullaryExpr(mask.rows(), mask.cols(),
                                                     [&](Index r, Index c) { return mask(r, c) ? 0.0 : infinity; });
  Eigen::VectorXd line;
  for (Index c = 0; c < out.cols(); ++c) {
    line = out.col(c);
    transform_line(line);
    out.col(c) = line;
  }
  for (Index r = 0; r < out.rows(); ++r) {
    line = out.row(r).transpose();
    transform_line(line);
    out.row(r) = line.transpose();
  }
  return out.cwiseSqrt();
}

std::vector<ChangeRegion> keep_regions(PixelMask& mask, const Eigen::MatrixXd& size_of_change, int min_pixels) {
  PixelMask open = mask;
  std::vector<ChangeRegion> out;
  std::vector<std::pair<Index, Index>> pixels;
  for (Index column = 0; column < mask.cols(); ++column)
    for (Index row = 0; row < mask.rows(); ++row) {
      if (!open(row, column)) continue;
      pixels.assign(1, {row, column});
      open(row, column) = false;
      ChangeRegion region{.left = static_cast<int>(column),
                          .top = static_cast<int>(row),
                          .right = static_cast<int>(column),
                          .bottom = static_cast<int>(row)};
      for (std::size_t i = 0; i < pixels.size(); ++i) {
        const auto [r, c] = pixels[i];
        region.left = std::min(region.left, static_cast<int>(c)),
        region.right = std::max(region.right, static_cast<int>(c));
        region.top = std::min(region.top, static_cast<int>(r)),
        region.bottom = std::max(region.bottom, static_cast<int>(r));
        region.mean_change += size_of_change(r, c);
        for (Index y = std::max<Index>(r - 1, 0); y <= std::min<Index>(r + 1, mask.rows() - 1); ++y)
          for (Index x = std::max<Index>(c - 1, 0); x <= std::min<Index>(c + 1, mask.cols() - 1); ++x)
            if (open(y, x)) {
              open(y, x) = false;
              pixels.emplace_back(y, x);
            }
      }
      region.pixels = static_cast<int>(pixels.size());
      region.mean_change /= region.pixels;
      if (region.pixels >= min_pixels)
        out.push_back(region);
      else
        for (const auto& [r, c] : pixels) mask(r, c) = false;
    }
  std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.pixels > b.pixels; });
  return out;
}

}  // namespace kr5::picking
