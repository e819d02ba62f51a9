// SPDX-License-Identifier: BSD-3-Clause
// An own calibration from mixed measurements: a tracker sees a ball on the arm, and a camera on the flange sees a
// board.  12_cell_fit SHARE
#include <cmath>
#include <cstdio>

#include <kr5/cell/cell.hpp>
#include <kr5/fit/measurements/pixels.hpp>
#include <kr5/fit/measurements/position.hpp>
#include <kr5/fit/problem.hpp>

using namespace kr5;

int main(int, char** argv) {
  const auto nominal = cell::nominal_chain(cell::load_cell(std::string(argv[1]) + "/cells/kr5_arc.yaml"));
  auto truth = nominal;
  truth.joints[1].a += 0.8e-3;                    // what will be found [m]
  truth.joints[2].theta_offset += 2e-3;           // [rad]
  const Eigen::Vector3d ball(0.05, -0.02, 0.12);  // on the flange [m]
  const Pose T_tracker_base = to_pose((Vector6() << 2, 1, 0.5, 0, 0, 1).finished());
  const Pose T_flange_camera = to_pose((Vector6() << 0.1, 0, 0.05, 0, 0, 0.3).finished());
  Pinhole lens;
  lens.width = 1280, lens.height = 960, lens.fx = lens.fy = 1000, lens.cx = 640, lens.cy = 480;
  Eigen::Matrix3Xd board(3, 4);  // [m]
  board << 0, 0.2, 0.2, 0, 0, 0, 0.15, 0.15, 0, 0, 0, 0;

  fit::Problem fit;
  const fit::FitBlock arm = fit.add_arm("arm", nominal), base = fit.add_pose("base", T_tracker_base),
                      tip = fit.add_point("ball", Eigen::Vector3d::Zero()), camera = fit.add_camera("lens", lens),
                      hand_eye = fit.add_pose("hand_eye", T_flange_camera);
  Eigen::VectorXd spread(30);  // of b, theta_offset, a, alpha, beta of each joint about nominal [m or rad]
  for (int k = 0; k < 30; ++k) spread[k] = k % 5 == 0 || k % 5 == 2 ? 1e-3 : 2e-3;
  fit.set_prior(arm, spread);
  fit.hold(camera);
  for (int j = 0; j < 6; ++j) fit.hold(arm, 5 * j + (j == 1 ? 0 : 4));  // between near-parallel axes beta replaces b

  for (int k = 0; k < 40; ++k) {
    Eigen::VectorXd q(6);
    for (int j = 0; j < 6; ++j) q[j] = 1.2 * std::sin((3 + j) * k + j);
    const Eigen::Vector3d noise(std::sin(7.0 * k), std::sin(11.0 * k), std::sin(13.0 * k));
    const Eigen::Vector3d seen = T_tracker_base * truth.flange(q) * ball + 1e-4 * noise;
    fit.add(fit::PositionMeasurement(fit::PoseChain().then(base).then_arm(arm, q), tip, seen, 1e-4));

    // The board stands half a metre before the camera, wherever that is: a pose of its own for every view, which the
    // tracker measures, too.
    const Pose T_camera_board = to_pose((Vector6() << -0.1, -0.07, 0.5, 0.2 * noise).finished());
    const Pose T_tracker_board = T_tracker_base * truth.flange(q) * T_flange_camera * T_camera_board;
    Eigen::Matrix2Xd pixels(2, 4);
    for (int i = 0; i < 4; ++i) pixels.col(i) = lens.project(T_camera_board * Eigen::Vector3d(board.col(i)));
    fit.add(fit::PixelMeasurement(
        fit::PoseChain().then_inverse(hand_eye).then_inverse_arm(arm, q).then_inverse(base).then(T_tracker_board),
        camera, board, pixels, 0.2));
  }

  const fit::Solution result = fit.solve();
  std::printf("%s, %d residuals, %zu parameters\n", result.fit.usable() ? "usable" : "not usable", result.residuals,
              result.coordinates.size());
  const Eigen::VectorXd change = fit.change(arm);
  const std::vector<int> places = result.places(arm);
  for (const int k : {7, 11}) {
    const auto at = static_cast<std::size_t>(places[static_cast<std::size_t>(k)]);
    const auto row = static_cast<Eigen::Index>(at);
    std::printf("%s: %+.2f +- %.2f, 1e-3\n", result.coordinates[at].c_str(), 1e3 * change[k],
                1e3 * std::sqrt(result.covariance(row, row)));
  }
  const Eigen::VectorXd found = fit.values(tip);
  std::printf("ball: %.1f %.1f %.1f mm\n", 1e3 * found[0], 1e3 * found[1], 1e3 * found[2]);
}
