// SPDX-License-Identifier: BSD-3-Clause
// Tool centre point from touches of one point.  04_tool SHARE
#include <cmath>
#include <cstdio>

#include <kr5/calibration/dataset.hpp>
#include <kr5/calibration/tool.hpp>

using namespace kr5;

int main(int, char** argv) {
  const auto data = calibration::load_pose_set(std::string(argv[1]) + "/data/touches/dataset.yaml");
  const auto result = calibration::calibrate_tool(data.poses());
  for (int i = 0; i < 3; ++i)
    std::printf("%c %.2f +- %.2f mm\n", "xyz"[i], 1e3 * result.tip[i], 1e3 * std::sqrt(result.covariance(i, i)));
  for (const std::string& warning : result.warnings) std::printf("%s\n", warning.c_str());
}
