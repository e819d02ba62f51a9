// SPDX-License-Identifier: BSD-3-Clause
#include "gap/noise.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <Eigen/QR>

namespace kr5::gap {
namespace {

constexpr double mad_to_sigma = 1.4826;
constexpr double spike = 6.0;

double median(std::vector<double>& values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

bool in_order(cell::Kind kind) { return kind != cell::Kind::Poses && kind != cell::Kind::Views; }

/// The run each row belongs to.
Eigen::VectorXd runs(const cell::Experiment& e) {
  const std::string name = cell::run_column(e.kind);
  const int at = name.empty() ? -1 : e.data.find(name);
  if (at < 0) return Eigen::VectorXd::Zero(e.data.values.rows());
  return e.data.values.col(at);
}

/// 1 near the rim of a scanned sphere, where a ray moves far for a small cause.
Eigen::VectorXd edges(const cell::Experiment& e, const Eigen::VectorXd& r) {
  constexpr Eigen::Index near = 4;
  Eigen::VectorXd out = Eigen::VectorXd::Zero(r.size());
  const int sphere = e.data.find("sphere");
  if (sphere < 0) return out;
  for (Eigen::Index i = 1; i < r.size(); ++i)
    if (std::isnan(r(i)) || e.data.values(i, sphere) != e.data.values(i - 1, sphere))
      out.segment(std::max<Eigen::Index>(i - near, 0),
                  std::min(2 * near, r.size() - std::max<Eigen::Index>(i - near, 0)))
          .setOnes();
  return out;
}

/// |second differences| over sqrt(6): the size of one sample's noise, whatever is smooth.
std::vector<double> second_differences(const Eigen::VectorXd& r, const Eigen::VectorXd& run) {
  std::vector<double> out;
  for (Eigen::Index i = 1; i + 1 < r.size(); ++i) {
    if (run(i - 1) != run(i) || run(i + 1) != run(i)) continue;
    const double d = r(i - 1) - 2 * r(i) + r(i + 1);
    if (!std::isnan(d)) out.push_back(std::abs(d) / std::sqrt(6.0));
  }
  return out;
}

/// |c0 - c1 + c2 - c3| / 2 of the four corners of each marker.
std::vector<double> corner_differences(const cell::Experiment& e, const Eigen::VectorXd& r) {
  const int view = e.data.find("view"), marker = e.data.find("marker"), corner = e.data.find("corner");
  std::vector<double> out;
  for (Eigen::Index i = 0; i + 3 < r.size(); ++i) {
    bool square = true;
    for (int k = 0; k < 4; ++k)
      square &= e.data.values(i + k, corner) == k && e.data.values(i + k, view) == e.data.values(i, view) &&
                e.data.values(i + k, marker) == e.data.values(i, marker);
    const double d = square ? (r(i) - r(i + 1) + r(i + 2) - r(i + 3)) / 2 : 0.0;
    if (square && !std::isnan(d)) out.push_back(std::abs(d));
  }
  return out;
}

}  // namespace

int mark_spikes(Data& data, const Eigen::VectorXd& residual) {
  int found = 0;
  for (const Block& block : data.blocks) {
    if (!in_order(block.kind)) continue;
    const Eigen::VectorXd r = block.of(residual), run = runs(data.experiment(block));
    std::vector<double> differences = second_differences(r, run);
    const double limit = spike * mad_to_sigma * median(differences);
    const Eigen::VectorXd edge = edges(data.experiment(block), r);
    for (Eigen::Index i = 1; limit > 0 && i + 1 < r.size(); ++i) {
      if (edge(i) > 0) continue;
      const double before = r(i) - r(i - 1), after = r(i) - r(i + 1);
      const bool isolated = run(i - 1) == run(i) && run(i + 1) == run(i) && before * after > 0 &&
                            std::abs(before) > limit && std::abs(after) > limit;
      if (!isolated) continue;
      data.use(block.first + i) = 0.0;
      ++found;
    }
  }
  return found;
}

std::vector<NoiseScale> noise_scales(const Data& data, const Eigen::VectorXd& residual) {
  std::map<std::string, std::vector<double>> all;
  for (const Block& block : data.blocks) {
    std::vector<double> d;
    if (in_order(block.kind))
      d = second_differences(block.of(residual), runs(data.experiment(block)));
    else if (block.kind == cell::Kind::Views)
      d = corner_differences(data.experiment(block), block.of(residual));
    all[block.noise].insert(all[block.noise].end(), d.begin(), d.end());
  }
  std::vector<NoiseScale> out;
  for (auto& [key, differences] : all) {
    const double n = static_cast<double>(differences.size());
    if (n < 50) continue;
    const double ratio = mad_to_sigma * median(differences);
    out.push_back({key, ratio, 1.8 * ratio / std::sqrt(n), n});  // of a median of correlated differences
  }
  return out;
}

std::vector<NoiseScale> pose_noise_scales(const Data& data, const Eigen::VectorXd& residual,
                                          const std::vector<const Signature*>& signatures) {
  std::vector<NoiseScale> out;
  for (const std::string key : {"pose_position", "pose_rotation"}) {
    std::vector<const Block*> blocks;
    Eigen::Index rows = 0;
    for (const Block& block : data.blocks)
      if (block.noise == key && block.split == cell::Split::Fit) {
        blocks.push_back(&block);
        rows += block.rows;
      }
    std::vector<const Signature*> acting;
    for (const Signature* s : signatures)
      if (std::any_of(s->parts.begin(), s->parts.end(),
                      [&](const auto& part) { return data.blocks[part.first].noise == key; }))
        acting.push_back(s);
    if (blocks.empty() || acting.empty()) continue;
    Eigen::MatrixXd G = Eigen::MatrixXd::Zero(rows, static_cast<Eigen::Index>(acting.size()));
    Eigen::VectorXd r(rows);
    Eigen::Index at = 0;
    for (const Block* block : blocks) {
      r.segment(at, block->rows) = block->of(residual);
      for (std::size_t k = 0; k < acting.size(); ++k)
        for (const auto& [b, values] : acting[k]->parts)
          if (&data.blocks[b] == block)
            G.col(static_cast<Eigen::Index>(k)).segment(at, block->rows) = values.cast<double>();
      at += block->rows;
    }
    for (Eigen::Index k = 0; k < G.cols(); ++k) G.col(k) /= std::max(G.col(k).norm(), 1e-9);
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> qr;
    qr.setThreshold(1e-4);
    qr.compute(G);
    const double left = static_cast<double>(rows - qr.rank());
    if (left < 20) continue;
    const double ratio = (r - G * qr.solve(r)).norm() / std::sqrt(left);
    out.push_back({key, ratio, ratio / std::sqrt(2 * left), left});
  }
  return out;
}

bool wrong(const NoiseScale& scale) { return std::abs(scale.ratio - 1) > std::max(4 * scale.std, 1.0 / 12); }

void correct(Data& data, const std::vector<NoiseScale>& scales, Eigen::VectorXd& residual) {
  for (const NoiseScale& scale : scales)
    for (Block& block : data.blocks)
      if (wrong(scale) && block.noise == scale.key) {
        block.of(residual) /= scale.ratio;
        block.sigma *= scale.ratio;
      }
}

}  // namespace kr5::gap
