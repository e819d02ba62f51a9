// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>

#include <kr5/force/peg_on_tube.hpp>
#include <kr5/predict/wrench.hpp>

#include "kinds.hpp"
#include "peg_slide.hpp"

namespace kr5::sim {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using predict::Given;
using predict::Run;
using predict::Shown;

constexpr double settling = 0.05;  // before the first row of a run [s]

PegPosture between(const PegPosture& a, const PegPosture& b, double part) {
  const auto mix = [part](double x, double y) { return x + part * (y - x); };
  return {mix(a.tilt, b.tilt), mix(a.alpha, b.alpha), mix(a.cx, b.cx), mix(a.cy, b.cy), mix(a.held, b.held)};
}

void settle(PegSlide& peg, double rest, const PegPosture& at, double step) {
  peg.place(rest - at.held / peg.stiffness(), 0.0);
  for (int i = 0; i < static_cast<int>(settling / step); ++i) peg.advance(at, at.held, step);
}

/// The rows of one profile, and where the peg would rest in each.
struct Rolls {
  std::vector<PegPosture> rows;
  VectorXd t, rest;
};

void roll(PegSlide& peg, const Run& run, const Rolls& given, double longest, VectorXd& z, Eigen::MatrixXd& wrench) {
  bool carried = false;
  for (Index k = run.first; k < run.last; ++k) {
    const PegPosture& now = given.rows[static_cast<std::size_t>(k)];
    if (!std::isfinite(given.rest[k])) {  // nothing carries the peg here
      carried = false;
      z[k] = std::numeric_limits<double>::quiet_NaN();
      continue;
    }
    if (!carried) {
      settle(peg, given.rest[k], now, longest);
      carried = true;
    } else {
      const PegPosture& before = given.rows[static_cast<std::size_t>(k - 1)];
      const double duration = given.t[k] - given.t[k - 1];
      const auto steps = static_cast<int>(std::ceil(duration / longest - 1e-6));
      for (int i = 1; i <= steps; ++i) {
        const PegPosture at = between(before, now, static_cast<double>(i) / steps);
        peg.advance(at, at.held, duration / steps);
      }
    }
    z[k] = peg.reading(now.held);
    wrench.row(k) = peg.wrench();
  }
}

}  // namespace

Shown profile(const cell::Cell& cell, const Given& given, const DartSimulatorOptions& options) {
  given.need(cell.contact.has_value(), "contact");
  given.need(cell.peg.has_value(), "peg");
  given.need(cell.tube.has_value(), "tube");
  given.need(cell.tool.has_value(), "tool");
  PegSlide peg(cell, PegSlide::FrictionBy::Formats, options.contact);
  if (options.step > peg.longest_step())
    given.fail("step: the stable bound of this contact is " + std::to_string(1e3 * peg.longest_step()) + " ms");
  const auto tilt = given["tilt"], alpha = given["alpha"], held = given["fc"], cx = given["cx"], cy = given["cy"];
  const force::PegTube bodies{peg.shape().peg_radius, peg.shape().inner_radius, peg.shape().outer_radius};
  Rolls rows{{}, given["t"], VectorXd(given.rows())};
  for (Index k = 0; k < given.rows(); ++k) {
    rows.rows.push_back({tilt[k], alpha[k], cx[k], cy[k], held[k]});
    rows.rest[k] = force::resting_height(bodies, peg.tube(), tilt[k], alpha[k], peg.centre(rows.rows.back()));
  }
  VectorXd z(given.rows());
  Eigen::MatrixXd wrench = Eigen::MatrixXd::Constant(given.rows(), 6, std::numeric_limits<double>::quiet_NaN());
  const double step = options.step > 0.0 ? options.step : peg.longest_step();
  for (const Run& run : given.runs()) roll(peg, run, rows, step, z, wrench);
  predict::sense(cell.effects, rows.t, given.runs(), wrench);
  Shown out(given.rows());
  out.add("z", z);
  out.add_wrench(wrench);
  return out;
}

}  // namespace kr5::sim
