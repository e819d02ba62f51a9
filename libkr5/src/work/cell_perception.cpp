// SPDX-License-Identifier: BSD-3-Clause
#include "work/cell_perception.hpp"

#include <functional>

#include <kr5/vision/render.hpp>
#include <kr5/work/arm_ways.hpp>
#include <kr5/work/look_at_places.hpp>
#include <kr5/work/plan_work.hpp>

namespace kr5::work {

picking::Cloud CellPerception::finish_scan(sim::ScanPlace place) {
  // The cell does not wait for the rays: the controller of an emulated arm keeps its cycle.
  const std::function<sim::BinScan()> see = cell_.with_cell([place](sim::WorkCell& c) { return c.end_scan(place); });
  const sim::BinScan scan = see();
  picking::Cloud cloud;
  cloud.points = scan.cloud().transpose();
  cloud.origins = scan.origins().transpose();
  return cloud;
}

job::ScanResult CellPerception::look_into_bin() {
  return plan_work(finish_scan(sim::ScanPlace::Bin), cell_.believed(), options_);
}

job::PlaceResult CellPerception::look_at(job::RequestKind kind) {
  if (kind == job::RequestKind::Station) return look_at_stand(finish_scan(sim::ScanPlace::Stand), options_);
  return look_at_tube(finish_scan(sim::ScanPlace::Tube), cell_.believed(), options_);
}

job::HoleResult CellPerception::look_for_tube(const Pose& T_base_flange) {
  const predict::CameraScene scene = cell_.with_cell([](const sim::WorkCell& c) { return c.picture(); });
  vision::RenderOptions render;
  render.oversampling = 4;
  render.noise = cell_.options().noise ? 1.0 : 0.0;
  render.seed = static_cast<int>(cell_.options().seed) + ++pictures_;
  const vision::Image picture = vision::render(scene.targets, scene.solids, scene.lens, render);
  return find_tube(picture, cell_.believed(), T_base_flange, options_);
}

void CellPerception::answer(const LookRequest& asked, JobCycle& to) {
  scan_.reset();
  hole_.reset();
  place_.reset();
  way_.reset();
  switch (asked.request.kind) {
    case job::RequestKind::None:
      return;
    case job::RequestKind::Sweep:
      return cell_.with_cell([](sim::WorkCell& c) { c.start_scan(); });
    case job::RequestKind::Scan:
      scan_ = look_into_bin();
      scan_->stamp = asked.request.stamp;
      to.deliver(*scan_);
      return;
    case job::RequestKind::Station:
    case job::RequestKind::Tube:
      place_ = look_at(asked.request.kind);
      place_->stamp = asked.request.stamp;
      to.deliver(*place_);
      return;
    case job::RequestKind::Hole:
      hole_ = look_for_tube(asked.T_base_flange);
      hole_->stamp = asked.request.stamp;
      to.deliver(*hole_);
      return;
    case job::RequestKind::Way:
      way_ = plan_way(asked.request, cell_.believed(), asked.joints, options_);
      to.deliver(*way_);
      return;
  }
}

}  // namespace kr5::work
