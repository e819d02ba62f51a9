// SPDX-License-Identifier: BSD-3-Clause
#include "force/search/turn_profile.hpp"

#include <algorithm>
#include <cmath>

#include "force/search/azimuth.hpp"

namespace kr5::force {

void TurnProfile::clear() noexcept {
  bins_.fill(Bin{});
  count_ = 0;
}

void TurnProfile::add(const ProfileRow& row) noexcept {
  const int k = std::clamp(static_cast<int>(wrapped(row.azimuth) / (2 * M_PI) * bins), 0, bins - 1);
  Bin& bin = bins_[static_cast<std::size_t>(k)];
  ++bin.count;
  bin.ca += std::cos(row.azimuth);
  bin.sa += std::sin(row.azimuth);
  bin.sum.tilt += row.tilt;
  bin.sum.centre += row.centre;
  bin.sum.height += row.height;
  bin.sum.force += row.force;
  bin.sum.moment += row.moment;
}

void TurnProfile::finish() noexcept {
  count_ = 0;
  for (const Bin& bin : bins_) {
    if (bin.count == 0) continue;
    ProfileRow& out = rows_[static_cast<std::size_t>(count_++)];
    out = bin.sum;
    out.azimuth = wrapped(std::atan2(bin.sa, bin.ca));
    const double n = bin.count;
    out.tilt /= n, out.centre /= n, out.height /= n, out.force /= n, out.moment /= n;
  }
}

Eigen::Vector2d TurnProfile::centre() const noexcept {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const ProfileRow& r : rows()) sum += r.centre;
  return count_ > 0 ? Eigen::Vector2d(sum / count_) : sum;
}

std::optional<double> TurnProfile::minimum() const noexcept {
  if (count_ < 3) return std::nullopt;
  const auto found = rows();
  return std::min_element(found.begin(), found.end(),
                          [](const ProfileRow& a, const ProfileRow& b) { return a.height < b.height; })
      ->azimuth;
}

Eigen::Vector2d TurnProfile::line(int k, int from, int to) const noexcept {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (int i = from; i <= to; ++i) {
    const double x = std::remainder(row(k + i).azimuth - row(k).azimuth, 2 * M_PI), y = row(k + i).height;
    n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  const double slope = (n * sxy - sx * sy) / (n * sxx - sx * sx);
  return {(sy - slope * sx) / n, slope};
}

std::optional<double> TurnProfile::cusp() const noexcept {
  constexpr int least = 60;
  if (count_ < least) return std::nullopt;
  const int wide = count_ / 20;  // rows on either side, 18 degrees of a whole turn
  std::optional<double> azimuth;
  double sharpest = 0.0;
  for (int k = 0; k < count_; ++k) {
    const Eigen::Vector2d left = line(k, -wide, 0), right = line(k, 0, wide);
    if (left[1] >= 0 || right[1] <= 0 || right[1] - left[1] <= sharpest) continue;
    sharpest = right[1] - left[1];
    azimuth = wrapped(row(k).azimuth + std::clamp((left[0] - right[0]) / sharpest, -0.2, 0.2));
  }
  return azimuth;
}

}  // namespace kr5::force
