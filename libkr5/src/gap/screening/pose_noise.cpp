// SPDX-License-Identifier: BSD-3-Clause
#include "gap/screening/pose_noise.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/QR>

#include <kr5/core/error.hpp>

namespace kr5::gap {
namespace {

constexpr double far = 6.0;

/// Blocks of all poses, those to judge by too, and what the hypotheses can change in them.
struct PoseSet {
  std::vector<int> blocks;
  std::vector<int> experiments;
  Eigen::VectorXd r;
  Eigen::ArrayXd use;
  Eigen::MatrixXd G;
};

Eigen::VectorXd stack(const ComparisonData& data, const std::vector<int>& blocks, const Eigen::VectorXd& stacked) {
  Eigen::Index n = 0;
  for (const int b : blocks) n += data.blocks[b].rows;
  Eigen::VectorXd out(n);
  n = 0;
  for (const int b : blocks) {
    out.segment(n, data.blocks[b].rows) = data.blocks[b].rows_of(stacked);
    n += data.blocks[b].rows;
  }
  return out;
}

PoseSet poses_of(const ComparisonData& data, const Eigen::VectorXd& residual,
                 const std::vector<const Hypothesis*>& hypotheses) {
  PoseSet out;
  for (std::size_t b = 0; b < data.blocks.size(); ++b) {
    const Block& block = data.blocks[b];
    if (block.kind != cell::Kind::Poses) continue;
    out.blocks.push_back(static_cast<int>(b));
    if (out.experiments.empty() || out.experiments.back() != block.experiment)
      out.experiments.push_back(block.experiment);
  }
  out.r = stack(data, out.blocks, residual);
  out.use = Eigen::ArrayXd::Ones(out.r.size());
  std::vector<Eigen::VectorXd> columns;
  for (const Hypothesis* h : hypotheses)
    for (const Probe& probe : h->probes)
      for (const Eigen::VectorXd& x : probe.points) try {
          Setup setup = data.recording->cell;
          apply(setup, *h, x);
          columns.push_back(out.r - stack(data, out.blocks, residuals(data, setup, out.experiments, residual)));
        } catch (const InvalidArgument&) {
          continue;  // of a part the cell does not have
        }
  std::erase_if(columns, [](const Eigen::VectorXd& c) { return !c.allFinite() || c.norm() < 1e-6; });
  out.G.resize(out.r.size(), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k)
    out.G.col(static_cast<Eigen::Index>(k)) = columns[k] / columns[k].norm();
  return out;
}

/// What no combination of signatures takes away, and how much of each sample's noise they leave.
struct ProjectedResidual {
  Eigen::ArrayXd r, part;
};

ProjectedResidual left_of(const PoseSet& p) {
  ProjectedResidual out{p.use * p.r.array(), p.use};
  if (p.G.cols() == 0) return out;
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr;
  qr.setThreshold(1e-4);
  qr.compute(p.use.matrix().asDiagonal() * p.G);
  const Eigen::MatrixXd Q = qr.householderQ() * Eigen::MatrixXd::Identity(p.r.size(), qr.rank());
  out.r -= (Q * (Q.transpose() * out.r.matrix())).array();
  out.part -= Q.rowwise().squaredNorm().array();
  return out;
}

/// Marks the value that is farthest off, until none is far; returns how many.
int mark(PoseSet& p, ProjectedResidual& left) {
  constexpr double leverage = 0.1;  // samples that signatures can follow tell nothing
  for (int found = 0;; ++found) {
    left = left_of(p);
    const Eigen::ArrayXd size = (left.part > leverage).select(left.r.abs() / left.part.max(leverage).sqrt(), 0.0);
    std::vector<double> used;
    for (Eigen::Index i = 0; i < size.size(); ++i)
      if (left.part(i) > leverage) used.push_back(size(i));
    if (used.size() < 20 || found >= size.size() / 20) return found;
    Eigen::Index worst = 0;
    if (size.maxCoeff(&worst) <= far * std::max(mad_to_sigma * median(used), min_noise)) return found;
    p.use(worst) = 0.0;
  }
}

}  // namespace

std::vector<NoiseScale> pose_noise_scales(ComparisonData& data, const Eigen::VectorXd& residual,
                                          const std::vector<const Hypothesis*>& hypotheses, int& stray) {
  PoseSet p = poses_of(data, residual, hypotheses);
  if (p.blocks.empty() || !p.r.allFinite()) return {};
  ProjectedResidual left;
  stray += mark(p, left);
  std::vector<NoiseScale> out;
  for (const std::string key : {"pose_position", "pose_rotation"}) {
    double chi2 = 0.0, dof = 0.0;
    Eigen::Index at = 0;
    for (const int b : p.blocks) {
      const Block& block = data.blocks[b];
      data.use.segment(block.first, block.rows) *= p.use.segment(at, block.rows);
      if (block.noise == key) {
        chi2 += left.r.segment(at, block.rows).square().sum();
        dof += left.part.segment(at, block.rows).sum();
      }
      at += block.rows;
    }
    if (dof < 20) continue;
    const double ratio = std::sqrt(chi2 / dof);
    if (ratio < min_noise) continue;  // computed, or rounded: the declared noise is used
    out.push_back({key, std::nullopt, ratio, ratio / std::sqrt(2 * dof), dof});
  }
  return out;
}

}  // namespace kr5::gap
