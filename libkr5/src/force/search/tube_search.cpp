// SPDX-License-Identifier: BSD-3-Clause
#include "force/search/tube_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>

namespace kr5::force {
namespace {

constexpr double nowhere = std::numeric_limits<double>::infinity();
constexpr double rounding = 1e-10;  // what a fit to exact heights may leave [m]
constexpr double row_noise = 5e-5;  // of a height, beside which the prior compliance counts [m]

}  // namespace

TubeSearch::TubeSearch(const PegTube& bodies, int max_iterations, double compliance_std)
    : bodies_(bodies),
      compliance_std_(compliance_std),
      optimizer_({.max_iterations = max_iterations, .min_sigma = rounding, .initial_damping = 1e-3}) {}

void TubeSearch::begin(std::span<const ProfileRow> rows, const Eigen::Vector2d& about) noexcept {
  rows_ = rows;
  about_ = about;
  looked_ = refined_ = started_ = 0;
  best_ = now_ = Solution();
  best_.normal.cost = nowhere;
}

/// Derivative of what a row is expected to show, by the place.
Eigen::Vector4d TubeSearch::slope_of(const PegRest& rest, const ProfileRow& row) const noexcept {
  return {-rest.by_centre.x(), -rest.by_centre.y(), 1.0, compliance_std_ > 0 ? -row.force : 0.0};
}

NormalEquations<4> TubeSearch::at(const Place& place) const noexcept {
  NormalEquations<4> out;
  for (const ProfileRow& row : rows_) {
    const PegRest rest = rest_peg_on_tube(bodies_, row.tilt, row.azimuth, row.centre - place.head<2>());
    const double error = row.height + place[3] * row.force - place.z() - rest.height;
    if (std::isnan(error)) {
      out.cost = nowhere;
      return out;
    }
    out.add(-slope_of(rest, row), error);
  }
  const double weight = compliance_std_ > 0 ? row_noise / compliance_std_ : 1.0;
  out.add({0, 0, 0, weight}, weight * place[3]);
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
  const Eigen::Matrix4d information = best_.normal.information.selfadjointView<Eigen::Lower>();
  return information.inverse() * sum;
}

/// From all round, near and far: the profile of a place and that of its mirror image differ by little only.
TubeSearch::Place TubeSearch::start(int number) const noexcept {
  constexpr std::array<double, distances> parts = {0.2, 0.5, 0.85, 1.2};
  const double distance = parts[static_cast<std::size_t>(number / directions)] * bodies_.outer_radius;
  const double azimuth = 2 * M_PI * (number % directions) / directions;
  return {about_.x() + distance * std::cos(azimuth), about_.y() + distance * std::sin(azimuth), 0.0, 0.0};
}

/// How well a start does with the face and the compliance that suit it best; the best ones are kept.
void TubeSearch::look() noexcept {
  Solution found;
  found.place = start(looked_++);
  found.normal = at(found.place);
  if (!std::isfinite(found.normal.cost)) return;
  const Eigen::Matrix2d A = found.normal.information.bottomRightCorner<2, 2>().selfadjointView<Eigen::Lower>();
  const Eigen::Vector2d gradient = found.normal.gradient.tail<2>(), suits = -A.inverse() * gradient;
  found.place.tail<2>() = suits;
  found.normal.cost += gradient.dot(suits);
  if (started_ == kept && starts_.back().normal.cost <= found.normal.cost) return;
  int k = started_ < kept ? started_++ : kept - 1;
  for (; k > 0 && starts_[static_cast<std::size_t>(k - 1)].normal.cost > found.normal.cost; --k)
    starts_[static_cast<std::size_t>(k)] = starts_[static_cast<std::size_t>(k - 1)];
  starts_[static_cast<std::size_t>(k)] = found;
}

void TubeSearch::next() noexcept {
  now_ = starts_[static_cast<std::size_t>(refined_)];
  now_.normal = at(now_.place);
  optimizer_.begin(now_.normal);
}

/// One step of the search from the present start.
void TubeSearch::refine() noexcept {
  const Place place = now_.place + optimizer_.step();
  const NormalEquations<4> moved = at(place);
  if (!optimizer_.accept(moved.cost)) return;
  now_.place = place;
  now_.normal = moved;
  optimizer_.update(moved);
}

/// Keeps what the search from the present start led to, if it is the best.
void TubeSearch::finish() noexcept {
  const LevenbergMarquardtStatus status = optimizer_.status();
  if (status == LevenbergMarquardtStatus::Converged) now_.place += optimizer_.step();
  now_.converged = status == LevenbergMarquardtStatus::Converged || status == LevenbergMarquardtStatus::NoDecrease;
  const int spent = best_.iterations + optimizer_.iterations();
  if (now_.normal.cost < best_.normal.cost) best_ = now_;
  best_.iterations = spent;
  if (++refined_ < started_) next();
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
    if (optimizer_.running())
      refine();
    else
      finish();
  }
  return looked_ == all && refined_ >= started_;
}

}  // namespace kr5::force
