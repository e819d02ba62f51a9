#include <cmath>
#include <iostream>

#include <kr5/calibration/hand_eye.hpp>
#include <kr5/core/error.hpp>

int main() {
  kr5::Pinhole camera{.width = 640, .height = 480, .fx = 500, .fy = 500, .cx = 320, .cy = 240};
  const double u = camera.project({0.1, 0.0, 1.0}).x();
  try {
    kr5::calibration::calibrate_hand_eye({}, camera);
  } catch (const kr5::InvalidArgument& e) {  // no views at all: the library was reached and said so
    std::cout << "u = " << u << "; " << e.what() << '\n';
    return std::abs(u - 370.0) < 1e-9 ? 0 : 1;
  }
  return 1;
}
