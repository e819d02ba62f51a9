// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <kr5/fit/pose_chain.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/kinematics/jacobian.hpp>

/// @file
/// What a Problem asks of a measurement. Each kind stands in `kr5/fit/measurements/`; an application may add its own.

namespace kr5::fit {

struct Block;

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// The blocks of a problem, of which a measurement says which it depends on.
class BlockUse {
 public:
  explicit BlockUse(const std::vector<Block>& all) : all_(&all) {}

  // Each throws InvalidArgument where the block is of another kind or what goes with it is of another size.
  void chain(const PoseChain& chain);
  void point(const FitPoint& point);
  void number(const FitNumber& number, const char* name);
  void camera(FitBlock camera);
  /// A block made by add_vector, of so many numbers.
  void vector(FitBlock vector, Eigen::Index size, const std::string& expected);

  /// What was named, each once.
  const std::vector<int>& blocks() const { return blocks_; }

 private:
  void use(FitBlock block);

  const std::vector<Block>* all_;
  std::vector<int> blocks_;
};

/// A chain at the present values.
struct ChainState {
  /// A factor of it: its pose, and how its own parameters perturb it from the right.
  struct Factor {
    Pose T = Pose::Identity();
    kinematics::Jacobian by_block;  ///< Empty: the identity, of a pose that is not inverse.
    kinematics::Jacobian by_terms;
  };

  Pose T = Pose::Identity();
  const PoseChain* chain = nullptr;
  std::vector<Factor> factors;
};

/// One evaluation of a measurement: present values, and where residuals and derivatives go.
class Evaluation {
 public:
  /// `values` and `jacobians` go by the measurement's `blocks`, in their order: by row, as many columns as the block
  /// has stored numbers, the coordinates first and then zeros; null where not wanted.
  Evaluation(const std::vector<Block>& all, const std::vector<int>& blocks, int rows, const double* const* values,
             double* residuals, double* const* jacobians)
      : all_(&all), blocks_(&blocks), rows_(rows), values_(values), residuals_(residuals), jacobians_(jacobians) {}

  /// Residuals that are asked for: all, or condensed ones.
  int rows() const { return rows_; }
  /// Whether any derivative is asked for.
  bool derivatives() const { return jacobians_ != nullptr; }

  const double* values(FitBlock block) const { return values_[place(block)]; }
  Eigen::Vector3d point(const FitPoint& point) const;
  double number(const FitNumber& number) const { return number.block.exists() ? *values(number.block) : number.value; }
  /// Without the size of its image.
  Pinhole camera(FitBlock block) const;
  /// Empty where a path has no pose.
  std::optional<ChainState> state(const PoseChain& chain) const;

  /// Residuals over their standard deviations, to be written.
  Eigen::Map<Eigen::VectorXd> residuals() const { return {residuals_, rows_}; }
  /// Whether the derivative by a block is asked for.
  bool wanted(FitBlock block) const { return jacobians_ && block.exists() && jacobians_[place(block)] != nullptr; }
  /// Derivative by a block, rows x coordinates, zero at first; call where it is wanted.
  Eigen::Map<RowMatrix, 0, Eigen::OuterStride<>> by(FitBlock block) const;
  template <class Derived>
  void add(FitBlock block, const Eigen::MatrixBase<Derived>& derivative) const {
    if (wanted(block)) by(block) += derivative;
  }
  /// Carries a derivative by the right perturbation of a whole chain to the blocks of the chain.
  void add(const ChainState& state, const Eigen::Matrix<double, Eigen::Dynamic, 6>& by_chain) const;

 private:
  std::size_t place(FitBlock block) const;
  std::optional<ChainState::Factor> factor_state(const PoseChain::Factor& factor) const;
  ChainState::Factor arm_state(const PoseChain::Factor& factor) const;
  std::optional<ChainState::Factor> path_state(const PoseChain::Factor& factor) const;

  const std::vector<Block>* all_;
  const std::vector<int>* blocks_;
  int rows_;
  const double* const* values_;
  double* residuals_;
  double* const* jacobians_;
};

/// A kind of measurement. Its constructor checks what it is made of, `declare` what it needs of the problem.
class Measurement {
 public:
  virtual ~Measurement() = default;

  /// Number of residuals.
  virtual int rows() const = 0;
  /// Names each block that the residuals depend on.
  virtual void declare(BlockUse& use) const = 0;
  /// Writes residuals over their standard deviations and adds their derivatives. False where the model does not exist,
  /// as behind a camera.
  virtual bool evaluate(const Evaluation& e) const = 0;

  /// Rows that say as much, as few as there are: the same sum of squares, gradient and information. `free` says whether
  /// a block has parameters to be fitted.
  virtual int condensed_rows(const std::function<bool(FitBlock)>& free) const;
  /// Gives it another covariance. @throws InvalidArgument for a kind that has none.
  virtual void set_covariance(const Eigen::MatrixXd& covariance);

 protected:
  Measurement() = default;
  Measurement(const Measurement&) = default;
  Measurement(Measurement&&) = default;
  Measurement& operator=(const Measurement&) = default;
  Measurement& operator=(Measurement&&) = default;
};

/// Derivative of T p by the right perturbation of T.
Eigen::Matrix<double, 3, 6> point_by_pose(const Pose& T, const Eigen::Vector3d& p);

}  // namespace kr5::fit
