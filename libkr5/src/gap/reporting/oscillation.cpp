// SPDX-License-Identifier: BSD-3-Clause
#include "gap/reporting/oscillation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/LU>

#include <kr5/core/statistics.hpp>
#include <kr5/uncertainty/confidence.hpp>

namespace kr5::gap {
namespace {

constexpr double main_part = 0.6;       // of the excess
constexpr double fewest_periods = 3.0;  // fewer are a drift
constexpr double fewest_rows = 4.0;     // a period
constexpr double steps_per_line = 4.0;  // of frequency, per 1 / duration
constexpr Eigen::Index min_rows = 16;

/// The rows of an experiment that count, and a wave at one frequency after the other.
struct Wave {
  Eigen::ArrayXd t, r;            ///< Time [s], residual.
  Eigen::ArrayXd c, s;            ///< Cosine and sine at the frequency.
  Eigen::ArrayXd c_step, s_step;  ///< From it to the next one, by addition.
  double step = 0.0;              ///< Median interval [s].

  double duration() const { return t.maxCoeff() - t.minCoeff(); }

  void start(double frequency, double increment) {
    const auto phase = [&](double f) -> Eigen::ArrayXd { return 2 * std::numbers::pi * f * (t - t(0)); };
    c = phase(frequency).cos(), s = phase(frequency).sin();
    c_step = phase(increment).cos(), s_step = phase(increment).sin();
  }

  void advance() {
    const Eigen::ArrayXd turned = c * c_step - s * s_step;
    s = s * c_step + c * s_step;
    c = turned;
  }

  /// What a sine and a cosine take from the sum of squares.
  double explained() const {
    Eigen::Matrix2d A;
    A << c.square().sum(), (c * s).sum(), (c * s).sum(), s.square().sum();
    const Eigen::Vector2d b((c * r).sum(), (s * r).sum());
    return A.determinant() > 1e-9 * A.trace() * A.trace() ? b.dot(A.inverse() * b) : 0.0;
  }
};

/// The wave of a block; without rows, where it has no time.
Wave wave_of(const ComparisonData& data, const Block& block, const Eigen::VectorXd& counted) {
  const io::Table& table = data.experiment(block).data;
  if (table.find("t") < 0) return {};
  const Eigen::VectorXd times = table.column("t");
  std::vector<double> t, r, steps;
  for (Eigen::Index i = 0; i < block.rows; ++i) {
    if (i > 0) steps.push_back(times(i) - times(i - 1));
    if (data.use(block.first + i) == 0.0) continue;
    t.push_back(times(i));
    r.push_back(counted(block.first + i));
  }
  const auto size = static_cast<Eigen::Index>(t.size());
  if (size < min_rows) return {};
  Wave out;
  out.t = Eigen::Map<Eigen::ArrayXd>(t.data(), size);
  out.r = Eigen::Map<Eigen::ArrayXd>(r.data(), size);
  out.step = median(std::move(steps));
  return out;
}

/// The frequency that explains most, each wave with a phase of its own, and how many were tried.
struct Peak {
  double frequency = 0.0;  ///< [Hz]
  double explained = 0.0;
  double tried = 0.0;
};

/// Looks between the frequencies that were tried.
void refine(std::vector<Wave>& waves, double step, Peak& peak) {
  constexpr int parts = 10;
  const double middle = peak.frequency;
  for (int k = -parts; k <= parts; ++k) {
    const double f = middle + k * step / parts;
    double taken = 0.0;
    for (Wave& wave : waves) {
      wave.start(f, 0.0);
      taken += wave.explained();
    }
    if (taken <= peak.explained) continue;
    peak.explained = taken;
    peak.frequency = f;
  }
}

Peak highest_peak(std::vector<Wave>& waves) {
  const Wave& longest = *std::ranges::max_element(waves, {}, [](const Wave& w) { return w.duration(); });
  const double first = fewest_periods / longest.duration(), last = 1.0 / (fewest_rows * longest.step);
  const double step = 1.0 / (steps_per_line * longest.duration());
  for (Wave& wave : waves) wave.start(first, step);
  Peak out;
  for (double f = first; f <= last; f += step, ++out.tried) {
    double taken = 0.0;
    for (Wave& wave : waves) {
      taken += wave.explained();
      wave.advance();
    }
    if (taken <= out.explained) continue;
    out.explained = taken;
    out.frequency = f;
  }
  refine(waves, step, out);
  return out;
}

}  // namespace

std::optional<Dependence> main_oscillation(const ComparisonData& data, const Group& group,
                                           const Eigen::VectorXd& counted, double level) {
  std::vector<Wave> waves;
  double excess = 0.0;
  for (const int b : group.all) {
    Wave wave = wave_of(data, data.blocks[b], counted);
    if (wave.t.size() == 0 || !(wave.step > 0.0) || !(wave.duration() > 0.0)) continue;
    excess += wave.r.square().sum() - static_cast<double>(wave.r.size());
    waves.push_back(std::move(wave));
  }
  if (waves.empty()) return {};
  const Peak peak = highest_peak(waves);
  const double share = peak.explained / std::max(excess, 1e-9), dof = 2.0 * static_cast<double>(waves.size());
  const double p = std::min(1.0, peak.tried * (1.0 - uncertainty::chi_square_cdf(peak.explained, dof)));
  if (share < main_part || p > level) return {};
  Dependence out{{VariableKind::Column, 0, "t"}, Shape::Oscillates};
  out.period = 1.0 / peak.frequency;
  out.evidence = 1.0 - p;
  out.share = std::min(share, 1.0);
  return out;
}

}  // namespace kr5::gap
