#include <kr5/core/levenberg_marquardt.hpp>

#include <cstddef>
#include <limits>

#include <catch2/catch.hpp>

#include <kr5/core/random.hpp>

namespace levenberg_marquardt_test {

using namespace kr5;
using Status = LevenbergMarquardtStatus;

#ifndef KR5_SANITIZED
namespace {
long allocations = 0;
}
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
#endif

namespace {

/// Moré, Garbow and Hillstrom 1981, problem 1: minimum 0 at (1, 1).
struct Rosenbrock {
  template <int N = 2>
  NormalEquations<N> equations_of(const Eigen::Matrix<double, N, 1>& x) const {
    NormalEquations<N> out(2);
    out.add(Eigen::Vector2d(-20 * x[0], 10), 10 * (x[1] - x[0] * x[0]));
    out.add(Eigen::Vector2d(-1, 0), 1 - x[0]);
    return out;
  }
  NormalEquations<2> equations(const Eigen::Vector2d& x) const { return equations_of<2>(x); }
};

/// Line through points with noise: a0 + a1 t.
struct Line {
  Eigen::VectorXd t, y;

  explicit Line(double sigma) : t(Eigen::VectorXd::LinSpaced(50, 0, 1)), y(50) {
    Random random(1);
    for (Eigen::Index i = 0; i < 50; ++i) y[i] = 2 - 3 * t[i] + random.normal(sigma);
  }
  NormalEquations<2> equations(const Eigen::Vector2d& x) const {
    NormalEquations<2> out;
    for (Eigen::Index i = 0; i < t.size(); ++i) out.add({1, t[i]}, x[0] + x[1] * t[i] - y[i]);
    return out;
  }
  /// The normal equations of the whole problem, solved directly.
  Eigen::Vector2d solution() const {
    Eigen::MatrixX2d A(t.size(), 2);
    A << Eigen::VectorXd::Ones(t.size()), t;
    return (A.transpose() * A).inverse() * A.transpose() * y;
  }
  Eigen::Matrix2d inverse_information() const {
    Eigen::MatrixX2d A(t.size(), 2);
    A << Eigen::VectorXd::Ones(t.size()), t;
    return (A.transpose() * A).inverse();
  }
};

/// A pose of the plane by an angle: the state is no vector.
struct Turn {
  NormalEquations<1> equations(const Eigen::Rotation2Dd& R) const {
    NormalEquations<1> out;
    const Eigen::Vector2d seen = Eigen::Rotation2Dd(2.0) * Eigen::Vector2d::UnitX(), now = R * Eigen::Vector2d::UnitX();
    const Eigen::Vector2d by_angle(-now.y(), now.x());
    for (int k = 0; k < 2; ++k) out.add(Eigen::Matrix<double, 1, 1>(by_angle[k]), now[k] - seen[k]);
    return out;
  }
  Eigen::Rotation2Dd moved(const Eigen::Rotation2Dd& R, const Eigen::Matrix<double, 1, 1>& step) const {
    return R * Eigen::Rotation2Dd(step[0]);
  }
};

}  // namespace

TEST_CASE("Rosenbrock's valley is followed to its end, from the usual start and from afar") {
  for (const Eigen::Vector2d& start : {Eigen::Vector2d(-1.2, 1), Eigen::Vector2d(-12, 10), Eigen::Vector2d(6, -9)}) {
    const auto found = levenberg_marquardt<2>(start, Rosenbrock(), {.max_iterations = 300});
    CHECK(found.status == Status::Converged);
    CHECK((found.x - Eigen::Vector2d::Ones()).norm() < 1e-9);
  }
}

TEST_CASE("a linear problem is solved as by its normal equations, with the textbook covariance") {
  const Line line(0.1);
  const auto found = levenberg_marquardt<2>(Eigen::Vector2d(100, -50), line);
  REQUIRE(found.converged());
  const Eigen::Matrix2d inverse = line.inverse_information();
  const double sigma = std::sqrt((line.equations(line.solution()).cost) / 48);
  // The stopping rule: within a thousandth of a standard deviation.
  const Eigen::Vector2d off = found.x - line.solution();
  CHECK(std::sqrt(off.dot(inverse.inverse() * off)) < 1e-3 * sigma);
  CHECK(found.equations.covariance()->isApprox(sigma * sigma * inverse, 1e-6));
  CHECK(found.equations.covariance(1.0)->isApprox(inverse, 1e-9));
}

TEST_CASE("the stopping rule does not depend on units") {
  const Line line(0.1);
  struct Scaled {
    const Line& line;
    Eigen::Vector2d unit;
    NormalEquations<2> equations(const Eigen::Vector2d& x) const {
      const NormalEquations<2> at = line.equations(unit.cwiseProduct(x));
      NormalEquations<2> out;
      out.information =
          unit.asDiagonal() * Eigen::Matrix2d(at.information.selfadjointView<Eigen::Lower>()) * unit.asDiagonal();
      out.gradient = unit.cwiseProduct(at.gradient);
      out.cost = at.cost, out.count = at.count;
      return out;
    }
  } scaled{line, {1e6, 1e-6}};
  const auto plain = levenberg_marquardt<2>(Eigen::Vector2d(5, 5), line);
  const auto other = levenberg_marquardt<2>(Eigen::Vector2d(5e-6, 5e6), scaled);
  CHECK(other.iterations == plain.iterations);
  CHECK(scaled.unit.cwiseProduct(other.x).isApprox(plain.x, 1e-9));
}

TEST_CASE("a bounded minimum is that on the bound, and one inside is not disturbed") {
  struct Bounded : Rosenbrock {
    Box<2> box;
  } problem;
  problem.box = {{-2, -2}, {0.5, 2}};
  const auto found = levenberg_marquardt<2>(Eigen::Vector2d(-1.2, 1), problem, {.max_iterations = 100});
  CHECK(found.converged());
  CHECK(found.x[0] == 0.5);  // along x0 = 0.5 the least is at x1 = x0^2
  CHECK(found.x[1] == Approx(0.25).margin(1e-6));
  problem.box = {{-2, -2}, {2, 2}};
  CHECK((levenberg_marquardt<2>(Eigen::Vector2d(-1.2, 1), problem, {.max_iterations = 100}).x - Eigen::Vector2d::Ones())
            .norm() < 1e-9);
  problem.box = {{-2, 3}, {2, 3}};  // the second is held: 100 (3 - x0^2)^2 + (1 - x0)^2
  const auto held = levenberg_marquardt<2>(Eigen::Vector2d(1, 1), problem, {.max_iterations = 100});
  CHECK(held.x[1] == 3.0);
  CHECK(std::abs(-400 * held.x[0] * (3 - held.x[0] * held.x[0]) - 2 * (1 - held.x[0])) < 1e-3);
}

TEST_CASE("parameters that nothing determines stay, and the covariance says so") {
  struct Sum {  // only x0 + x1 is seen, x2 not at all
    NormalEquations<3> equations(const Eigen::Vector3d& x) const {
      NormalEquations<3> out;
      for (int i = 0; i < 5; ++i) out.add({1, 1, 0}, x[0] + x[1] - 4 + 0.01 * (i - 2));
      return out;
    }
  };
  const auto found = levenberg_marquardt<3>(Eigen::Vector3d(1, 0, 7), Sum());
  CHECK(found.converged());
  CHECK(found.x[0] + found.x[1] == Approx(4));
  CHECK(found.x[2] == 7);
  CHECK_FALSE(found.equations.covariance());
}

TEST_CASE("a model that does not exist at the start, or beside it, is not taken for a fit") {
  struct Root {  // sqrt(x) = 0.5, NaN for x < 0
    double start_scale = 1.0;
    NormalEquations<1> equations(const Eigen::Matrix<double, 1, 1>& x) const {
      NormalEquations<1> out;
      const double root = std::sqrt(x[0]);
      out.add(Eigen::Matrix<double, 1, 1>(0.5 / root), root - 0.5);
      return out;
    }
  };
  const auto at = [](double x) { return Eigen::Matrix<double, 1, 1>(x); };
  CHECK(levenberg_marquardt<1>(at(-1), Root()).status == Status::NotFinite);
  // From 4 the first full step leads to -2, where there is nothing: a shorter one is taken.
  const auto found = levenberg_marquardt<1>(at(4), Root());
  CHECK(found.converged());
  CHECK(found.x[0] == Approx(0.25));
  CHECK(levenberg_marquardt<1>(at(std::numeric_limits<double>::quiet_NaN()), Root()).status == Status::NotFinite);
}

TEST_CASE("without any step downhill it ends and says so") {
  struct Uphill {  // the derivative has the wrong sign
    NormalEquations<1> equations(const Eigen::Matrix<double, 1, 1>& x) const {
      NormalEquations<1> out;
      out.add(Eigen::Matrix<double, 1, 1>(-1.0), x[0]);
      return out;
    }
  };
  const auto found = levenberg_marquardt<1>(Eigen::Matrix<double, 1, 1>(3.0), Uphill());
  CHECK(found.status == Status::NoDecrease);
  CHECK(found.x[0] == 3.0);
  const auto stopped = levenberg_marquardt<2>(Eigen::Vector2d(-1.2, 1), Rosenbrock(), {.max_iterations = 3});
  CHECK(stopped.status == Status::MaxIterations);
  CHECK(stopped.iterations == 3);
}

TEST_CASE("Huber's loss keeps outliers from the fit") {
  struct Robust : Line {
    double scale = 1.0;
    using Line::Line;
    NormalEquations<2> equations(const Eigen::Vector2d& x) const {
      NormalEquations<2> out;
      for (Eigen::Index i = 0; i < t.size(); ++i) out.add_huber({1, t[i]}, x[0] + x[1] * t[i] - y[i], 3 * scale);
      return out;
    }
    bool reweigh(const Eigen::Vector2d&, const NormalEquations<2>&) { return std::exchange(scale, 0.1) != 0.1; }
  } line(0.1);
  const Eigen::Vector2d clean = line.solution();
  line.y[3] += 40, line.y[30] -= 25;
  const auto found = levenberg_marquardt<2>(Eigen::Vector2d(0, 0), line);
  CHECK(found.converged());
  const Eigen::Vector2d std = 0.1 * line.inverse_information().diagonal().cwiseSqrt();
  CHECK((found.x - clean).cwiseQuotient(std).cwiseAbs().maxCoeff() < 2);
  CHECK((line.solution() - clean).cwiseQuotient(std).cwiseAbs().maxCoeff() > 5);
}

TEST_CASE("a state that is no vector moves as the problem says") {
  const auto found = levenberg_marquardt<1>(Eigen::Rotation2Dd(0.1), Turn());
  CHECK(found.converged());
  CHECK(found.x.smallestPositiveAngle() == Approx(2.0));
}

TEST_CASE("any number of parameters goes the same way as a fixed one") {
  struct Dynamic {
    NormalEquations<Eigen::Dynamic> equations(const Eigen::VectorXd& x) const {
      return Rosenbrock().equations_of<Eigen::Dynamic>(x);
    }
  };
  const auto fixed = levenberg_marquardt<2>(Eigen::Vector2d(-1.2, 1), Rosenbrock());
  const auto dynamic = levenberg_marquardt<Eigen::Dynamic>(Eigen::VectorXd(Eigen::Vector2d(-1.2, 1)), Dynamic());
  CHECK(dynamic.iterations == fixed.iterations);
  CHECK(Eigen::Vector2d(dynamic.x).isApprox(fixed.x, 1e-12));
}

#ifndef KR5_SANITIZED
TEST_CASE("with a fixed number of parameters nothing allocates") {
  LevenbergMarquardt<2> optimizer;
  Eigen::Vector2d x(-1.2, 1);
  const Rosenbrock problem;
  const long before = allocations;
  optimizer.begin(problem.equations(x));
  while (optimizer.running()) {
    const NormalEquations<2> next = problem.equations(x + optimizer.step());
    if (!optimizer.accept(next.cost)) continue;
    x += optimizer.step();
    optimizer.update(next);
  }
  const long after = allocations;
  CHECK(after == before);
  CHECK(optimizer.status() == Status::Converged);
  static_assert(noexcept(optimizer.accept(0.0))&& noexcept(optimizer.update(problem.equations(x))) ==
                noexcept(problem.equations(x)));
}
#endif

TEST_CASE("options out of range are refused by name") {
  CHECK_THROWS_WITH(LevenbergMarquardt<2>({.max_iterations = -1}), Catch::Contains("max_iterations"));
  CHECK_THROWS_WITH(LevenbergMarquardt<2>({.tolerance = 0}), Catch::Contains("tolerance"));
  CHECK_THROWS_WITH(LevenbergMarquardt<2>({.sigma = -1}), Catch::Contains("sigma"));
  CHECK_THROWS_WITH(LevenbergMarquardt<2>({.min_sigma = 0}), Catch::Contains("min_sigma"));
  CHECK_THROWS_WITH(LevenbergMarquardt<2>({.initial_damping = -1}), Catch::Contains("initial_damping"));
}

}  // namespace levenberg_marquardt_test
