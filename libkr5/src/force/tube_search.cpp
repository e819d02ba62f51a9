// SPDX-License-Identifier: BSD-3-Clause
#include "tube_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>

namespace kr5::force {
namespace {

constexpr double nowhere = std::numeric_limits<double>::infinity();
constexpr double fine = 1e-10;      // steps below a tenth of a nanometre end a search [m]
constexpr double row_noise = 5e-5;  // of a height, beside which the softness is believed before [m]

}  // namespace

void TubeSearch::begin(std::span<const ProfileRow> rows, const Eigen::Vector2d& about) noexcept {
  rows_ = rows;
  about_ = about;
  looked_ = refined_ = started_ = 0;
  best_ = now_ = Solution{};
  best_.normal.cost = nowhere;
}

/// Derivative of what a row is expected to show, by the place.
Eigen::Vector4d TubeSearch::slope_of(const PegRest& rest, const ProfileRow& row) const noexcept {
  return {-rest.by_centre.x(), -rest.by_centre.y(), 1.0, softness_ > 0 ? -row.force : 0.0};
}

TubeSearch::Normal TubeSearch::at(const Place& place) const noexcept {
  Normal out;
  for (const ProfileRow& row : rows_) {
    const PegRest rest = rest_peg_on_tube(bodies_, row.tilt, row.azimuth, row.centre - place.head<2>());
    const double error = row.height + place[3] * row.force - place.z() - rest.height;
    if (std::isnan(error)) {
      out.cost = nowhere;
      return out;
    }
    const Eigen::Vector4d slope = slope_of(rest, row);
    out.A += slope * slope.transpose();
    out.b += slope * error;
    out.cost += error * error;
  }
  const double weight = softness_ > 0 ? row_noise / softness_ : 1.0, before = weight * place[3];
  out.A(3, 3) += weight * weight;
  out.b[3] -= weight * before;
  out.cost += before * before;
  return out;
}

Eigen::Matrix<double, 4, 2> TubeSearch::by_tilt() const noexcept {
  Eigen::Matrix<double, 4, 2> sum = Eigen::Matrix<double, 4, 2>::Zero();
  const Place& place = best_.place;
  for (const ProfileRow& row : rows_) {
    const PegRest rest = rest_peg_on_tube(bodies_, row.tilt, row.azimuth, row.centre - place.head<2>());
    const double s = std::sin(row.azimuth), c = std::cos(row.azimuth);
    const Eigen::RowVector2d higher =
        rest.by_tilt * Eigen::RowVector2d(-s, c) - rest.by_alpha / row.tilt * Eigen::RowVector2d(c, s);
    sum += slope_of(rest, row) * higher;
  }
  return best_.normal.A.inverse() * sum;
}

/// From all round, near and far: the profile of a place and that of its mirror image differ by little only.
TubeSearch::Place TubeSearch::start(int number) const noexcept {
  constexpr std::array<double, distances> parts = {0.2, 0.5, 0.85, 1.2};
  const double distance = parts[static_cast<std::size_t>(number / directions)] * bodies_.outer_radius;
  const double azimuth = 2 * M_PI * (number % directions) / directions;
  return {about_.x() + distance * std::cos(azimuth), about_.y() + distance * std::sin(azimuth), 0.0, 0.0};
}

/// How well a start does with the face and the softness that suit it best; the best ones are kept.
void TubeSearch::look() noexcept {
  Solution found;
  found.place = start(looked_++);
  found.normal = at(found.place);
  if (!std::isfinite(found.normal.cost)) return;
  const Eigen::Vector2d b = found.normal.b.tail<2>(), suits = found.normal.A.bottomRightCorner<2, 2>().inverse() * b;
  found.place.tail<2>() = suits;
  found.normal.cost -= b.dot(suits);
  if (started_ == kept && starts_.back().normal.cost <= found.normal.cost) return;
  int k = started_ < kept ? started_++ : kept - 1;
  for (; k > 0 && starts_[static_cast<std::size_t>(k - 1)].normal.cost > found.normal.cost; --k)
    starts_[static_cast<std::size_t>(k)] = starts_[static_cast<std::size_t>(k - 1)];
  starts_[static_cast<std::size_t>(k)] = found;
}

void TubeSearch::next() noexcept {
  now_ = starts_[static_cast<std::size_t>(refined_)];
  now_.normal = at(now_.place);
  now_.iterations = 0;
  damping_ = 1e-3;
}

/// One step of Levenberg and Marquardt.
void TubeSearch::refine() noexcept {
  Eigen::Matrix4d A = now_.normal.A;
  A.diagonal() *= 1 + damping_;
  A.diagonal().array() += 1e-12;
  const Eigen::Vector4d step = A.inverse() * now_.normal.b;
  const Normal moved = at(now_.place + step);
  ++now_.iterations;
  now_.converged = !(step.head<3>().norm() >= fine);
  if (moved.cost <= now_.normal.cost) {
    now_.place += step;
    now_.normal = moved;
    damping_ = std::max(damping_ / 5, 1e-9);
  } else {
    damping_ *= 8;
    now_.converged = now_.converged || damping_ > 1e8;
  }
}

bool TubeSearch::advance(int evaluations) noexcept {
  constexpr int all = directions * distances;
  for (int i = 0; i < evaluations; ++i) {
    if (looked_ < all) {
      look();
      if (looked_ == all && started_ > 0) next();
      continue;
    }
    if (refined_ >= started_) return true;
    refine();
    if (!now_.converged && now_.iterations < max_iterations_) continue;
    const int spent = best_.iterations + now_.iterations;
    if (now_.normal.cost < best_.normal.cost) best_ = now_;
    best_.iterations = spent;
    if (++refined_ < started_) next();
  }
  return looked_ == all && refined_ >= started_;
}

}  // namespace kr5::force
