// SPDX-License-Identifier: BSD-3-Clause
#include "term_choice.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include <kr5/uncertainty/confidence.hpp>

#include "column_algebra.hpp"
#include "friction_terms.hpp"

namespace kr5::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Sums of squares and products of one block of time, each joint over its standard deviation.
struct BlockSums {
  MatrixXd A;  ///< Of the parameters of the model so far.
  VectorXd b;
  double torques = 0.0;
  MatrixXd across, own;  ///< Of these with the columns on offer, and of the latter among themselves.
  VectorXd right;
};

/// A way to add one term to a joint.
struct Offer {
  JointTerms terms;
  std::vector<Index> columns;  ///< Of those on offer.
  VectorXd errors;             ///< Squared errors of each block when it is left out; empty: links imitate the term.
};

/// Parameters that the other blocks give, for the model so far and for the columns on offer beside it.
class LeftOutBlock {
 public:
  LeftOutBlock(const BlockSums& all, const BlockSums& out) : out_(out), across_(all.across - out.across) {
    const MatrixXd A = all.A - out.A;
    scale_ = A.diagonal().cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
    MatrixXd scaled = scale_.asDiagonal() * A * scale_.asDiagonal();
    scaled.diagonal().array() += 1e-10;  // columns that the other blocks do not tell
    const Eigen::LDLT<MatrixXd> factors(scaled);
    beta_ = scale_.cwiseProduct(factors.solve(scale_.cwiseProduct(all.b - out.b)));
    imitated_ = scale_.asDiagonal() * factors.solve(MatrixXd(scale_.asDiagonal() * across_));
    own_ = all.own - out.own;
    left_ = own_ - across_.transpose() * imitated_;
    right_ = all.right - out.right - across_.transpose() * beta_;
  }

  double error() const { return squared_error(beta_, {}, {}); }

  /// Squared error with these columns; negative where the model so far imitates them.
  double error_with(const std::vector<Index>& columns) const {
    constexpr double told = 1e-4;  // part of a squared column that must be left beside the others [-]
    const MatrixXd S = left_(columns, columns);
    if ((S.diagonal().array() <= told * own_(columns, columns).diagonal().array()).any()) return -1.0;
    const VectorXd gamma = S.ldlt().solve(right_(columns));
    return squared_error(beta_ - imitated_(Eigen::all, columns) * gamma, columns, gamma);
  }

 private:
  double squared_error(const VectorXd& beta, const std::vector<Index>& columns, const VectorXd& gamma) const {
    double out = out_.torques - 2 * beta.dot(out_.b) + beta.dot(out_.A * beta);
    if (!columns.empty())
      out += 2 * gamma.dot(out_.across(Eigen::all, columns).transpose() * beta - out_.right(columns)) +
             gamma.dot(out_.own(columns, columns) * gamma);
    return std::max(out, 0.0);
  }

  const BlockSums& out_;
  MatrixXd across_, imitated_, own_, left_;
  VectorXd scale_, beta_, right_;
};

/// The rows of all joints, to which columns of chosen terms are added.
class TermSearch {
 public:
  TermSearch(const JointRows& rows, const VectorXd& sigma, int blocks)
      : positions_(column_positions(rows.regressors, rows.columns)), tau_(rows.tau), columns_(rows.size()) {
    weights_ = sigma.cwiseAbs2().cwiseInverse();
    for (const JointRegressor& r : rows.regressors) X_.push_back(r.X);
    for (int k = 0; k <= blocks; ++k) starts_.push_back(rows.samples() * k / blocks);
  }

  Index blocks() const { return static_cast<Index>(starts_.size()) - 1; }

  /// Adds columns to the rows of a joint.
  void add(int joint, const MatrixXd& columns) {
    const auto i = static_cast<std::size_t>(joint);
    MatrixXd X(X_[i].rows(), X_[i].cols() + columns.cols());
    X << X_[i], columns;
    X_[i] = std::move(X);
    for (Index c = 0; c < columns.cols(); ++c) positions_[i].push_back(static_cast<int>(columns_++));
  }

  /// Squared errors of the blocks left out: of the model so far, and of each offer, whose columns are in `on_offer`.
  VectorXd judge(int joint, const MatrixXd& on_offer, std::vector<Offer>& offers) const {
    std::vector<BlockSums> parts;
    for (Index k = 0; k < blocks(); ++k) parts.push_back(sums(k, joint, on_offer));
    BlockSums all = parts.front();
    for (std::size_t k = 1; k < parts.size(); ++k) {
      all.A += parts[k].A, all.b += parts[k].b, all.across += parts[k].across;
      all.own += parts[k].own, all.right += parts[k].right;
    }
    VectorXd out(blocks());
    for (Offer& offer : offers) offer.errors.resize(blocks());
    for (Index k = 0; k < blocks(); ++k) {
      const LeftOutBlock left(all, parts[static_cast<std::size_t>(k)]);
      out[k] = left.error();
      for (Offer& offer : offers) offer.errors[k] = left.error_with(offer.columns);
    }
    std::erase_if(offers, [](const Offer& o) { return o.columns.empty() || o.errors.minCoeff() < 0; });
    return out;
  }

 private:
  BlockSums sums(Index block, int joint, const MatrixXd& on_offer) const {
    const Index first = starts_[static_cast<std::size_t>(block)],
                count = starts_[static_cast<std::size_t>(block) + 1] - first;
    BlockSums out{MatrixXd::Zero(columns_, columns_),
                  VectorXd::Zero(columns_),
                  0.0,
                  MatrixXd::Zero(columns_, on_offer.cols()),
                  {},
                  {}};
    for (std::size_t i = 0; i < X_.size(); ++i) {
      const double w = weights_[static_cast<Index>(i)];
      const MatrixXd X = X_[i].middleRows(first, count);
      const VectorXd tau = tau_.col(static_cast<Index>(i)).segment(first, count);
      out.A(positions_[i], positions_[i]) += w * X.transpose() * X;
      out.b(positions_[i]) += w * X.transpose() * tau;
      out.torques += w * tau.squaredNorm();
      if (static_cast<int>(i) != joint) continue;
      const MatrixXd C = on_offer.middleRows(first, count);
      out.across(positions_[i], Eigen::all) = w * X.transpose() * C;
      out.own = w * C.transpose() * C;
      out.right = w * C.transpose() * tau;
    }
    return out;
  }

  std::vector<MatrixXd> X_;
  std::vector<std::vector<int>> positions_;
  MatrixXd tau_;
  VectorXd weights_;
  Index columns_;
  std::vector<Index> starts_;
};

/// All ways to add one term to a joint, and their columns side by side.
struct Offers {
  std::vector<Offer> all;
  MatrixXd columns;
  int kinds = 0;  ///< Terms on offer, of which some come in several shapes.
};

Offers offers_of(const JointTerms& now, const JointSignals& signals) {
  Offers out;
  out.columns.resize(signals.t.size(), 0);
  for (const FrictionTerm& offered : friction_term_table()) {
    const std::vector<JointTerms> shapes = offered.offers(now, signals);
    out.kinds += shapes.empty() ? 0 : 1;
    for (const JointTerms& terms : shapes) {
      out.all.push_back({terms, {}, {}});
      for (const FrictionTerm& term : friction_term_table()) {
        if (!term.present(terms) || term.present(now)) continue;
        out.all.back().columns.push_back(out.columns.cols());
        out.columns.conservativeResize(Eigen::NoChange, out.columns.cols() + 1);
        out.columns.rightCols<1>() = term.column(terms, signals);
      }
    }
  }
  return out;
}

/// Of the mean of values.
double standard_error(const VectorXd& values) {
  const auto count = static_cast<double>(values.size());
  return std::sqrt((values.array() - values.mean()).square().sum() / (count - 1) / count);
}

/// The offer with the least error, or one with fewer columns whose error is within a standard error of it.
const Offer& best_offer(const std::vector<Offer>& all) {
  const auto less = [](const Offer& a, const Offer& b) { return a.errors.sum() < b.errors.sum(); };
  const Offer& least = *std::min_element(all.begin(), all.end(), less);
  const Offer* out = &least;
  for (const Offer& other : all) {
    const VectorXd loss = other.errors - least.errors;
    const bool simpler = other.columns.size() < out->columns.size() ||
                         (other.columns.size() == out->columns.size() && less(other, *out));
    if (simpler && loss.mean() <= standard_error(loss)) out = &other;
  }
  return *out;
}

}  // namespace

std::vector<JointTerms> choose_friction_terms(const DynamicsModel& model, const JointMotion& motion,
                                              const JointRows& rows, const VectorXd& sigma, const MatrixXd& load,
                                              int blocks, double least_speed) {
  constexpr double false_choice = 0.05;  // probability that a joint without further terms gets one, at most
  constexpr double worth = 0.01;  // of what is left of the joint, which a term must gain beside its standard error
  std::vector<JointTerms> chosen = model.terms;
  chosen.resize(static_cast<std::size_t>(model.joints()));
  TermSearch search(rows, sigma, blocks);
  for (int i = 0; i < model.joints(); ++i) {
    JointTerms& now = chosen[static_cast<std::size_t>(i)];
    JointSignals signals = joint_signals(motion, load, i);
    signals.least_speed = least_speed * root_mean_square(motion.qd.col(i));
    const Eigen::ArrayXd used = moving_samples(motion.qd.col(i), least_speed);
    while (true) {
      Offers offers = offers_of(now, signals);
      offers.columns.array().colwise() *= used;
      const VectorXd errors = search.judge(i, offers.columns, offers.all);
      if (offers.all.empty()) break;
      const Offer best = best_offer(offers.all);
      const VectorXd gain = errors - best.errors;
      const double sure = uncertainty::student_factor(blocks - 1, 1 - 2 * false_choice / offers.kinds);
      if (!(gain.mean() > sure * standard_error(gain)) || !(gain.sum() > worth * errors.sum() / model.joints())) break;
      now = best.terms;
      search.add(i, offers.columns(Eigen::all, best.columns));
    }
  }
  return chosen;
}

}  // namespace kr5::identification
