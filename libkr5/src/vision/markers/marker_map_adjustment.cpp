// SPDX-License-Identifier: BSD-3-Clause
#include "vision/markers/marker_map_adjustment.hpp"

#include <string>

#include <kr5/fit/measurements/pixels.hpp>
#include <kr5/fit/problem.hpp>

namespace kr5::vision {

MapSolution adjust_map(const MapProblem& p, MapState& state, int max_iterations) {
  fit::Problem fit;
  const fit::FitBlock camera = fit.add_camera("camera", p.camera);
  fit.hold(camera);
  std::vector<fit::FitBlock> markers, images;
  for (const Pose& T : state.T_map_marker)
    markers.push_back(fit.add_pose("marker" + std::to_string(markers.size()), T));
  fit.hold(markers[static_cast<std::size_t>(p.reference)]);
  for (const Pose& T : state.T_camera_map)
    images.push_back(fit.add_nuisance_pose("image" + std::to_string(images.size()), T));
  std::vector<fit::FitMeasurement> seen;
  for (const IndexedSighting& s : p.sightings)
    seen.push_back(fit.add(fit::PixelMeasurement(fit::PoseChain()
                                                     .then(images[static_cast<std::size_t>(s.image)])
                                                     .then(markers[static_cast<std::size_t>(s.marker)]),
                                                 camera, p.square, s.corners, 1.0)));
  const fit::Solution result = fit.solve({.max_iterations = max_iterations, .cost_tolerance = 1e-10});
  MapSolution out{.cost = result.cost,
                  .squares{},
                  .covariance{},
                  .determined = result.unidentifiable.empty() && result.fit.status != FitStatus::Degenerate,
                  .iterations = result.fit.iterations,
                  .converged = result.fit.status == FitStatus::Converged};
  for (const fit::FitMeasurement sighting : seen) out.squares.push_back(fit.residuals(sighting).squaredNorm());
  for (std::size_t m = 0; m < markers.size(); ++m) {
    state.T_map_marker[m] = fit.pose(markers[m]);
    const int place = result.places(markers[m])[0];
    out.covariance.push_back(place < 0 ? Matrix6(Matrix6::Zero())
                                       : Matrix6(result.covariance.block<6, 6>(place, place)));
  }
  for (std::size_t i = 0; i < images.size(); ++i) state.T_camera_map[i] = fit.pose(images[i]);
  return out;
}

}  // namespace kr5::vision
