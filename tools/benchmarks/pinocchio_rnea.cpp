// SPDX-License-Identifier: BSD-3-Clause
// Inverse dynamics of a chain and its regressor by Pinocchio in C++, timed: reads the arm and its states from a text
// file that dynamics.py writes, prints processor seconds a call. A program of its own: the headers come from the PyPI
// wheel `pin`.
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <string>
#include <vector>

#include <pinocchio/algorithm/regressor.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#if __has_include(<pinocchio/multibody.hpp>)
#include <pinocchio/multibody.hpp>
#else  // before Pinocchio 4
#include <pinocchio/multibody/data.hpp>
#include <pinocchio/multibody/model.hpp>
#endif

namespace {

double processor_time() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

template <int Rows, int Cols>
Eigen::Matrix<double, Rows, Cols> read(std::istream& in) {
  Eigen::Matrix<double, Rows, Cols> out;
  for (int i = 0; i < Rows; ++i)
    for (int j = 0; j < Cols; ++j) in >> out(i, j);
  return out;
}

/// Joint by joint: its place in the joint before (4 x 4), then mass, centre of mass and inertia about it in that frame.
pinocchio::Model read_model(std::istream& in, int joints) {
  pinocchio::Model model;
  model.gravity.linear(read<3, 1>(in));
  pinocchio::JointIndex parent = 0;
  for (int i = 0; i < joints; ++i) {
    const Eigen::Matrix4d place = read<4, 4>(in);
    const pinocchio::SE3 at(place.topLeftCorner<3, 3>(), place.topRightCorner<3, 1>());
    parent = model.addJoint(parent, pinocchio::JointModelRZ(), at, "joint" + std::to_string(i + 1));
    double mass = 0.0;
    in >> mass;
    const Eigen::Vector3d com = read<3, 1>(in);
    model.appendBodyToJoint(parent, pinocchio::Inertia(mass, com, read<3, 3>(in)), pinocchio::SE3::Identity());
  }
  return model;
}

constexpr int repeats = 7;

/// Least processor time of a call over several runs [s].
template <class Call>
double min_time(int rows, Call&& call) {
  double least = 1e9;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    const double start = processor_time();
    for (std::size_t k = 0; k < static_cast<std::size_t>(rows); ++k) call(k);
    least = std::min(least, processor_time() - start);
  }
  return least / rows;
}

}  // namespace

int main(int count, char** words) {
  if (count != 2) {
    std::fputs("usage: pinocchio_rnea FILE\n", stderr);
    return 2;
  }
  std::ifstream in(words[1]);
  int joints = 0, rows = 0;
  in >> joints;
  const pinocchio::Model model = read_model(in, joints);
  in >> rows;
  Eigen::MatrixXd states(3 * joints, rows);
  for (int k = 0; k < rows; ++k)
    for (int i = 0; i < 3 * joints; ++i) in >> states(i, k);
  if (!in) {
    std::fputs("error: the file ends too soon\n", stderr);
    return 2;
  }
  pinocchio::Data data(model);
  std::vector<Eigen::VectorXd> q, v, a;
  for (int k = 0; k < rows; ++k) {
    q.emplace_back(states.col(k).head(joints));
    v.emplace_back(states.col(k).segment(joints, joints));
    a.emplace_back(states.col(k).tail(joints));
  }
  // The sums keep the compiler honest: of the torques of joint 1, and of what the mass of the last link does to it.
  double sum = 0.0, sum_of_regressor = 0.0;
  const double rnea = min_time(rows, [&](std::size_t k) { sum += pinocchio::rnea(model, data, q[k], v[k], a[k])[0]; });
  const double regressor = min_time(rows, [&](std::size_t k) {
    sum_of_regressor += pinocchio::computeJointTorqueRegressor(model, data, q[k], v[k], a[k])(0, 10 * (joints - 1));
  });
  std::printf("%.4g %.10g %.4g %.10g\n", rnea, sum / repeats, regressor, sum_of_regressor / repeats);
  return 0;
}
