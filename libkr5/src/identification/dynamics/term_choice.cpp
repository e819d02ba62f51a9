// SPDX-License-Identifier: BSD-3-Clause
#include "identification/dynamics/term_choice.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include <Eigen/Cholesky>

#include <kr5/core/statistics.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "identification/dynamics/column_algebra.hpp"
#include "identification/dynamics/friction_terms.hpp"
#include "identification/log/runs.hpp"

namespace kr5::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Columns = std::vector<Index>;

/// Sums of squares and products of all columns, those on offer included.
struct NormalSums {
  MatrixXd A;
  VectorXd b;
  double torques = 0.0;

  explicit NormalSums(Index columns) : A(MatrixXd::Zero(columns, columns)), b(VectorXd::Zero(columns)) {}
  NormalSums& operator+=(const NormalSums& other) {
    A += other.A, b += other.b, torques += other.torques;
    return *this;
  }
  NormalSums operator-(const NormalSums& other) const {
    NormalSums out = *this;
    out.A -= other.A, out.b -= other.b, out.torques -= other.torques;
    return out;
  }
  double squared_error(const Columns& columns, const VectorXd& beta) const {
    return std::max(torques - 2 * beta.dot(b(columns)) + beta.dot(A(columns, columns) * beta), 0.0);
  }
};

/// The estimate of some columns from sums, to which others can be added.
class Estimate {
 public:
  /// @param now Columns of the model so far; @param more Columns that may be added.
  Estimate(const NormalSums& sums, const Columns& now, const Columns& more) : sums_(sums) {
    const MatrixXd A = sums.A(now, now);
    scale_ = A.diagonal().cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
    MatrixXd scaled = scale_.asDiagonal() * A * scale_.asDiagonal();
    scaled.diagonal().array() += 1e-10;  // columns that these rows do not tell
    const Eigen::LDLT<MatrixXd> factors(scaled);
    beta_ = scale_.cwiseProduct(factors.solve(scale_.cwiseProduct(sums.b(now))));
    if (more.empty()) return;
    first_ = more.front();
    imitated_ = scale_.asDiagonal() * factors.solve(MatrixXd(scale_.asDiagonal() * sums.A(now, more)));
    left_ = sums.A(more, more) - sums.A(more, now) * imitated_;
    right_ = sums.b(more) - sums.A(more, now) * beta_;
  }

  const VectorXd& beta() const { return beta_; }

  /// Parameters of added columns (ascending, of `more`); empty where the model so far imitates them.
  VectorXd added(const Columns& columns) const {
    constexpr double told = 1e-4;  // part of a squared column that must be left beside the others [-]
    const Columns at = places(columns);
    const MatrixXd S = left_(at, at);
    if ((S.diagonal().array() <= told * sums_.A(columns, columns).diagonal().array()).any()) return {};
    return S.ldlt().solve(right_(at));
  }
  /// Parameters of the model so far beside added ones.
  VectorXd beside(const Columns& columns, const VectorXd& gamma) const {
    return beta_ - imitated_(Eigen::all, places(columns)) * gamma;
  }

 private:
  Columns places(Columns columns) const {
    for (Index& c : columns) c -= first_;
    return columns;
  }

  const NormalSums& sums_;
  Index first_ = 0;
  VectorXd scale_, beta_, right_;
  MatrixXd imitated_, left_;
};

/// A way to add one term to a joint.
struct Offer {
  int joint = 0;
  std::size_t row = 0;  ///< Of the table of terms.
  JointTerms terms;
  Columns columns;
  VectorXd errors;      ///< Squared errors of each block when it is left out.
  double chance = 1.0;  ///< Of such parameters where there are none [-].
};

/// Columns joined by those of `added`.
Columns joined_columns(Columns columns, const Columns& added) {
  columns.insert(columns.end(), added.begin(), added.end());
  return columns;
}

VectorXd joined_values(const VectorXd& a, const VectorXd& b) {
  VectorXd out(a.size() + b.size());
  out << a, b;
  return out;
}

/// Probability of such parameters where they are zero, by those that are found when each block is left out
/// (delete-a-group jackknife with Hotelling's statistic). A term that matters in few blocks only stands out by this;
/// the gains of blocks, which differ by what moves in each, hide it.
/// @param without Parameters without each block, a column each.
double chance_of(const VectorXd& value, const MatrixXd& without) {
  const auto m = static_cast<double>(value.size()), blocks = static_cast<double>(without.cols());
  if (blocks <= m) return 1.0;
  const MatrixXd off = without.colwise() - without.rowwise().mean().eval();
  const MatrixXd covariance = (blocks - 1) / blocks * off * off.transpose();
  const double squared = value.dot(covariance.ldlt().solve(value));
  return 1 - uncertainty::fisher_cdf(squared * (blocks - m) / (m * (blocks - 1)), m, blocks - m);
}

/// By how much a speed changes from sample to sample at a reversal (median); 0 without reversals. Smoothing spreads the
/// step of dry friction over some three samples there: a friction of speeds that are crossed within them is not told,
/// and would be taken for that.
double reversal_step(const Eigen::ArrayXd& speed, const std::vector<physics::RowRange>& runs) {
  std::vector<double> steps;
  for (const physics::RowRange& run : runs)
    for (Index k = run.first + 1; k < run.last; ++k)
      if (speed[k - 1] * speed[k] < 0) steps.push_back(std::abs(speed[k] - speed[k - 1]));
  return steps.empty() ? 0.0 : median(std::move(steps));
}

/// Whether one of the levels is below zero by more than two standard deviations.
/// @param without Levels without each block, a column each.
bool surely_negative(const MatrixXd& without) {
  const auto blocks = static_cast<double>(without.cols());
  for (Index level = 0; level < without.rows(); ++level) {
    const double mean = without.row(level).mean();
    const double squares = (without.row(level).array() - mean).square().sum();
    if (mean < -2 * std::sqrt((blocks - 1) / blocks * squares)) return true;
  }
  return false;
}

/// All columns that the model has or may get, with the sums of every block of time.
class TermSearch {
 public:
  TermSearch(const DynamicsModel& model, const JointMotion& motion, const JointRows& rows, const MatrixXd& load,
             int blocks, double min_speed)
      : model_(model),
        regressor_(model),
        rows_(rows),
        signals_(static_cast<std::size_t>(model.joints())),
        columns_(rows.size()) {
    for (int i = 0; i < model.joints(); ++i) collect(motion, load, i, min_speed);
    products(motion, min_speed, blocks);
  }

  Index blocks() const { return static_cast<Index>(products_.size()); }
  int joints() const { return model_.joints(); }
  Index fixed() const { return rows_.size(); }

  /// Weighs the joints by the variance of their residuals.
  void weigh(const VectorXd& variance) {
    parts_.assign(products_.size(), NormalSums(columns_));
    for (std::size_t k = 0; k < products_.size(); ++k)
      for (std::size_t i = 0; i < positions_.size(); ++i) {
        const MatrixXd& P = products_[k][i];
        const Index p = P.cols() - 1;
        const double w = 1.0 / variance[static_cast<Index>(i)];
        parts_[k].A(positions_[i], positions_[i]) += w * P.topLeftCorner(p, p);
        parts_[k].b(positions_[i]) += w * P.col(p).head(p);
        parts_[k].torques += w * P(p, p);
      }
    all_.assign(1, NormalSums(columns_));
    for (const NormalSums& part : parts_) all_.front() += part;
  }

  /// Variance of the residuals of each joint under an estimate of some columns.
  VectorXd variances(const Columns& columns) const {
    VectorXd beta = VectorXd::Zero(columns_);
    beta(columns) = Estimate(all_.front(), columns, {}).beta();
    VectorXd out(joints());
    for (std::size_t i = 0; i < positions_.size(); ++i) {
      VectorXd signed_beta(static_cast<Index>(positions_[i].size()) + 1);
      signed_beta << -beta(positions_[i]), 1.0;
      double squares = 0.0, torques = 0.0;
      for (const auto& block : products_) {
        squares += signed_beta.dot(block[i] * signed_beta);
        torques += block[i](block[i].rows() - 1, block[i].cols() - 1);
      }
      constexpr double exact = 1e-12;  // part of the squared torque that is rounding
      const double used = std::max(rows_.used_rows(static_cast<Index>(i)), 1.0);
      out[static_cast<Index>(i)] = std::max({squares, exact * torques, 1e-300}) / used;
    }
    return out;
  }

  /// Ways to add one term to a joint.
  std::vector<Offer> offers(int joint, const JointTerms& now) const {
    std::vector<Offer> out;
    const std::vector<FrictionTerm>& table = friction_term_table();
    for (std::size_t offered = 0; offered < table.size(); ++offered) {
      if (table[offered].motor && !is_shared(model_.structure, joint)) continue;
      for (const JointTerms& terms : table[offered].offers(now, signals_of(table[offered], joint))) {
        Offer& one = out.emplace_back(Offer{joint, offered, terms, {}, {}});
        for (std::size_t row = 0; row < table.size(); ++row)
          if (table[row].present(terms) && !table[row].present(now))
            one.columns.push_back(places_.at(key(joint, row, terms)));
      }
    }
    return out;
  }

  /// Squared errors of the blocks left out, of the model so far and of each offer. Offers whose terms the model so far
  /// imitates are taken away.
  VectorXd judge(int joint, const Columns& now, std::vector<Offer>& offers) const {
    Columns more;
    for (Index c = first_offered_[static_cast<std::size_t>(joint)];
         c < first_offered_[static_cast<std::size_t>(joint) + 1]; ++c)
      more.push_back(c);
    const Estimate whole(all_.front(), now, more);
    std::vector<VectorXd> values;
    std::erase_if(offers, [&](const Offer& o) { return o.columns.empty() || whole.added(o.columns).size() == 0; });
    std::vector<MatrixXd> without, levels;
    for (Offer& offer : offers) {
      values.push_back(whole.added(offer.columns));
      without.emplace_back(values.back().size(), blocks());
      levels.emplace_back(2, blocks());
      offer.errors.resize(blocks());
    }
    VectorXd out(blocks());
    std::vector<char> imitated(offers.size(), 0);
    for (Index k = 0; k < blocks(); ++k) {
      const NormalSums& left_out = parts_[static_cast<std::size_t>(k)];
      const NormalSums others = all_.front() - left_out;
      const Estimate estimate(others, now, more);
      out[k] = left_out.squared_error(now, estimate.beta());
      for (std::size_t o = 0; o < offers.size(); ++o) {
        const Columns& added = offers[o].columns;
        const VectorXd gamma = estimate.added(added);
        imitated[o] = imitated[o] || gamma.size() == 0;
        if (imitated[o]) continue;
        without[o].col(k) = gamma;
        const VectorXd beside = estimate.beside(added, gamma);
        offers[o].errors[k] = left_out.squared_error(joined_columns(now, added), joined_values(beside, gamma));
        levels[o].col(k) = positive_levels(offers[o], now, beside, gamma);
      }
    }
    std::vector<Offer> told;
    for (std::size_t o = 0; o < offers.size(); ++o) {
      if (imitated[o] || surely_negative(levels[o])) continue;
      offers[o].chance = chance_of(values[o], without[o]);
      told.push_back(offers[o]);
    }
    offers = told;
    return out;
  }

 private:
  using Key = std::tuple<int, std::size_t, double>;

  static Key key(int joint, std::size_t row, const JointTerms& terms) {
    const auto shape = friction_term_table()[row].shape;
    return {joint, row, shape ? terms.*shape : 0.0};
  }

  /// What of a term on offer physics has above zero: the dry friction at speed and at rest beside a Stribeck term, the
  /// losses of friction by warming up; 0 for other terms.
  Eigen::Vector2d positive_levels(const Offer& offer, const Columns& now, const VectorXd& beta,
                                  const VectorXd& gamma) const {
    const FrictionTerm& term = friction_term_table()[offer.row];
    if (term.shape == &JointTerms::thermal_time_constant) return {gamma[0], gamma[gamma.size() - 1]};
    const bool of_motor = term.shape == &JointTerms::motor_stribeck_velocity;
    if (!of_motor && term.shape != &JointTerms::stribeck_velocity) return Eigen::Vector2d::Zero();
    const auto at = std::find(now.begin(), now.end(), column_of(of_motor ? "fcm" : "fc", offer.joint));
    const double coulomb = at == now.end() ? 0.0 : beta[at - now.begin()];
    return {coulomb, coulomb + gamma[0]};
  }

  /// Of a parameter of the model, or of a term on offer that has no shapes; -1 without.
  Index column_of(const std::string& name, int joint) const {
    const int parameter = regressor_.index(name + std::to_string(joint + 1));
    const auto at = std::find(rows_.columns.begin(), rows_.columns.end(), parameter);
    if (at != rows_.columns.end()) return at - rows_.columns.begin();
    for (const auto& [one, column] : places_)
      if (std::get<0>(one) == joint && friction_term_table()[std::get<1>(one)].name == name) return column;
    return -1;
  }

  struct Signals {
    JointSignals joint, motor;
  };

  const JointSignals& signals_of(const FrictionTerm& term, int joint) const {
    const Signals& s = signals_[static_cast<std::size_t>(joint)];
    return term.motor ? s.motor : s.joint;
  }

  /// Columns of every term that the joint may get.
  void collect(const JointMotion& motion, const MatrixXd& load, int joint, double min_speed) {
    Signals& s = signals_[static_cast<std::size_t>(joint)];
    s.joint = joint_signals(motion, load, joint);
    s.motor = motor_signals(model_.structure, motion, load, joint);
    for (JointSignals* one : {&s.joint, &s.motor})
      one->min_speed = std::max(min_speed * root_mean_square(one->speed.matrix()),
                                1.5 * reversal_step(one->speed, runs_of(motion.run_starts, motion.samples())));
    const JointTerms now = model_.terms.empty() ? JointTerms{} : model_.terms[static_cast<std::size_t>(joint)];
    first_offered_.push_back(columns_);
    const std::vector<FrictionTerm>& table = friction_term_table();
    for (const FrictionTerm& offered : table) {
      if (offered.motor && !is_shared(model_.structure, joint)) continue;
      for (const JointTerms& terms : offered.offers(now, signals_of(offered, joint)))
        for (std::size_t row = 0; row < table.size(); ++row)
          if (table[row].present(terms) && !table[row].present(now) &&
              places_.try_emplace(key(joint, row, terms), columns_).second) {
            offered_.push_back({joint, row, table[row].column(terms, signals_of(table[row], joint))});
            ++columns_;
          }
    }
    if (joint == joints() - 1) first_offered_.push_back(columns_);
  }

  /// Of [X | offered columns | tau] of each joint, in every block.
  void products(const JointMotion& motion, double min_speed, int blocks) {
    const auto fixed = column_positions(rows_.regressors, rows_.columns);
    products_.assign(static_cast<std::size_t>(blocks), {});
    for (int i = 0; i < joints(); ++i) {
      const MatrixXd& X = rows_.regressors[static_cast<std::size_t>(i)].X;
      Columns at(fixed[static_cast<std::size_t>(i)].begin(), fixed[static_cast<std::size_t>(i)].end());
      std::vector<std::size_t> own;
      std::vector<double> shares;
      for (std::size_t o = 0; o < offered_.size(); ++o) {
        const double share = friction_term_table()[offered_[o].row].share(model_.structure, offered_[o].joint, i);
        if (share == 0.0) continue;
        own.push_back(o), shares.push_back(share);
        at.push_back(rows_.size() + static_cast<Index>(o));
      }
      const Eigen::ArrayXd keep = moving_samples(motion, model_.structure, min_speed, i);
      MatrixXd all(X.rows(), static_cast<Index>(at.size()) + 1);
      all.leftCols(X.cols()) = X;
      for (std::size_t k = 0; k < own.size(); ++k)
        all.col(X.cols() + static_cast<Index>(k)) = shares[k] * (offered_[own[k]].values * keep).matrix();
      all.rightCols<1>() = rows_.tau.col(i);
      for (int k = 0; k < blocks; ++k) {
        const Index first = X.rows() * k / blocks, last = X.rows() * (k + 1) / blocks;
        MatrixXd P = MatrixXd::Zero(all.cols(), all.cols());
        P.selfadjointView<Eigen::Lower>().rankUpdate(all.middleRows(first, last - first).transpose());
        products_[static_cast<std::size_t>(k)].push_back(P.selfadjointView<Eigen::Lower>());
      }
      positions_.push_back(at);
    }
  }

  struct OfferedColumn {
    int joint;
    std::size_t row;
    Eigen::ArrayXd values;
  };

  const DynamicsModel& model_;
  const DynamicsRegressor regressor_;
  const JointRows& rows_;
  std::vector<Signals> signals_;
  Index columns_;  ///< Those of the model, then those on offer, joint by joint.
  Columns first_offered_;
  std::map<Key, Index> places_;
  std::vector<OfferedColumn> offered_;
  std::vector<Columns> positions_;               ///< Of the columns of each joint's products.
  std::vector<std::vector<MatrixXd>> products_;  ///< By block and joint.
  std::vector<NormalSums> parts_, all_;
};

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

/// Columns without those of `taken`.
Columns other_columns(Columns columns, const Columns& taken) {
  std::erase_if(columns, [&](Index c) { return std::find(taken.begin(), taken.end(), c) != taken.end(); });
  return columns;
}

/// Forward selection over all joints; what a later term makes needless is taken away again.
class TermChoice {
 public:
  TermChoice(const TermSearch& search, std::vector<JointTerms> terms) : search_(search), terms_(std::move(terms)) {
    for (Index c = 0; c < search.fixed(); ++c) now_.push_back(c);
  }

  const std::vector<JointTerms>& terms() const { return terms_; }
  const Columns& columns() const { return now_; }

  /// Adds the term that gains most: what another joint lacks is then not taken for a friction of this one.
  bool add() {
    std::vector<Offer> best;  // of each joint
    for (int i = 0; i < search_.joints(); ++i) {
      std::vector<Offer> offers = search_.offers(i, terms_[static_cast<std::size_t>(i)]);
      std::erase_if(offers, [&](const Offer& o) { return dropped_.contains({o.joint, o.row}); });
      const double limit = false_choice / static_cast<double>(std::max<std::size_t>(offers.size(), 1));
      const VectorXd errors = search_.judge(i, now_, offers);
      std::erase_if(offers, [&](const Offer& o) {
        return !(o.chance < limit) || !(errors.sum() - o.errors.sum() > worth * errors.sum() / search_.joints());
      });
      if (offers.empty()) continue;
      best.push_back(best_offer(offers));
      best.back().chance = limit;
    }
    if (best.empty()) return false;
    added_.push_back(*std::min_element(best.begin(), best.end(),
                                       [](const Offer& a, const Offer& b) { return a.errors.sum() < b.errors.sum(); }));
    terms_[static_cast<std::size_t>(added_.back().joint)] = added_.back().terms;
    now_ = joined_columns(now_, added_.back().columns);
    return true;
  }

  /// Takes away the earlier term that differs least from zero beside the others, unless it still does.
  bool drop() {
    auto least = added_.end();
    double chance = 0.0;
    for (auto one = added_.begin(); one + 1 < added_.end(); ++one) {
      std::vector<Offer> again = {*one};
      search_.judge(one->joint, other_columns(now_, one->columns), again);
      const double over = again.empty() ? std::numeric_limits<double>::infinity() : again.front().chance / one->chance;
      if (over > std::max(chance, 1.0)) least = one, chance = over;
    }
    if (least == added_.end()) return false;
    friction_term_table()[least->row].take_away(terms_[static_cast<std::size_t>(least->joint)]);
    now_ = other_columns(now_, least->columns);
    dropped_.insert({least->joint, least->row});
    added_.erase(least);
    return true;
  }

 private:
  static constexpr double false_choice = 0.05;  // probability that a joint without further terms gets one, at most
  static constexpr double worth = 0.01;         // of what is left of the joint, by which blocks left out must gain

  const TermSearch& search_;
  std::vector<JointTerms> terms_;
  Columns now_;
  std::vector<Offer> added_;  ///< `chance` is the limit that it had to pass.
  std::set<std::pair<int, std::size_t>> dropped_;
};

}  // namespace

std::vector<JointTerms> choose_friction_terms(const DynamicsModel& model, const JointMotion& motion,
                                              const JointRows& rows, const VectorXd& sigma, const MatrixXd& load,
                                              int blocks, double min_speed) {
  std::vector<JointTerms> terms = model.terms;
  terms.resize(static_cast<std::size_t>(model.joints()));
  TermSearch search(model, motion, rows, load, blocks, min_speed);
  search.weigh(sigma.cwiseAbs2());
  TermChoice choice(search, terms);
  while (choice.add()) {
    search.weigh(search.variances(choice.columns()));
    while (choice.drop()) search.weigh(search.variances(choice.columns()));
  }
  return choice.terms();
}

bool take_doubtful_term(const DynamicsModel& given, const BaseParameters& base, const JointFit& fit,
                        std::vector<JointTerms>& terms) {
  const std::vector<FrictionTerm>& table = friction_term_table();
  const FrictionTerm* most_doubtful = nullptr;
  JointTerms* of = nullptr;
  double least = 1.0;  // squared distance from zero over that at the edge of the 95 % region
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const JointTerms before = given.terms.empty() ? JointTerms{} : given.terms[i];
    for (const FrictionTerm& term : table) {
      if (!term.present(terms[i]) || term.present(before)) continue;
      Columns at;
      for (const FrictionTerm& other : table) {
        if (other.choice != term.choice || other.shape != term.shape) continue;
        const auto found =
            std::find(base.expressions.begin(), base.expressions.end(), other.name + std::to_string(i + 1));
        if (found != base.expressions.end()) at.push_back(found - base.expressions.begin());
      }
      if (at.empty()) continue;
      const auto m = static_cast<double>(at.size());
      const VectorXd value = fit.beta(at);
      const double squared = value.dot(MatrixXd(fit.covariance(at, at)).ldlt().solve(value));
      const double distance = squared / (m * uncertainty::fisher_quantile(0.95, m, fit.freedom));
      if (distance < least) least = distance, most_doubtful = &term, of = &terms[i];
    }
  }
  if (!most_doubtful) return false;
  most_doubtful->take_away(*of);
  return true;
}

}  // namespace kr5::identification
