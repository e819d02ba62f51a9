// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/picking/pcl_peers.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include <pcl/features/normal_3d.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>
#include <pcl/segmentation/sac_segmentation.h>

#include <kr5/core/error.hpp>

namespace kr5::picking {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

void PclCylinderOptions::validate() const {
  require(min_radius > 0 && max_radius > min_radius && std::isfinite(max_radius),
          "max_radius must be more than min_radius, and both positive [m]");
  require(threshold > 0 && std::isfinite(threshold), "threshold must be positive [m]");
  require(normal_weight >= 0 && normal_weight < 1, "normal_weight must be 0 or more and less than 1 [-]");
  require(iterations > 0, "iterations must be positive");
  require(neighbours >= 3, "neighbours must be 3 or more");
  require(voxel > 0 && std::isfinite(voxel), "voxel must be positive [m]");
  require(min_points >= 3, "min_points must be 3 or more");
}

namespace {

using PeerPoints = pcl::PointCloud<pcl::PointXYZ>;
using PeerNormals = pcl::PointCloud<pcl::Normal>;

PeerPoints::Ptr shifted_points(const Matrix3Xd& points, const Vector3d& shift) {
  auto out = std::make_shared<PeerPoints>();
  out->reserve(static_cast<std::size_t>(points.cols()));
  for (const auto& column : points.colwise()) {
    const Eigen::Vector3f p = (column - shift).cast<float>();
    out->push_back({p.x(), p.y(), p.z()});
  }
  return out;
}

PeerNormals::Ptr estimated_normals(const PeerPoints::Ptr& points, int neighbours) {
  auto out = std::make_shared<PeerNormals>();
  pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
  estimation.setInputCloud(points);
  estimation.setSearchMethod(std::make_shared<pcl::search::KdTree<pcl::PointXYZ>>());
  estimation.setKSearch(std::min(neighbours, static_cast<int>(points->size())));
  estimation.compute(*out);
  return out;
}

/// Middle and length of the points of a model.
PclCylinder cylinder_of(const pcl::ModelCoefficients& model, const PeerPoints& points, const pcl::Indices& rows) {
  PclCylinder out;
  if (model.values.size() != 7 || rows.empty()) return out;
  const Eigen::Map<const Eigen::Matrix<float, 7, 1>> v(model.values.data());
  out.found = v.allFinite();
  out.axis = v.segment<3>(3).cast<double>().normalized();
  out.radius = v[6];
  out.points = static_cast<int>(rows.size());
  const Vector3d point = v.head<3>().cast<double>();
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const auto row : rows) {
    const Vector3d p = points[static_cast<std::size_t>(row)].getVector3fMap().cast<double>();
    low = std::min(low, out.axis.dot(p - point));
    high = std::max(high, out.axis.dot(p - point));
  }
  out.point = point + (low + high) / 2 * out.axis;
  out.height = high - low;
  return out;
}

using PeerSegmentation = pcl::SACSegmentationFromNormals<pcl::PointXYZ, pcl::Normal>;

void prepare(PeerSegmentation& segmentation, const PclCylinderOptions& options) {
  segmentation.setOptimizeCoefficients(true);
  segmentation.setModelType(pcl::SACMODEL_CYLINDER);
  segmentation.setMethodType(pcl::SAC_RANSAC);
  segmentation.setNormalDistanceWeight(options.normal_weight);
  segmentation.setMaxIterations(options.iterations);
  segmentation.setDistanceThreshold(options.threshold);
  segmentation.setRadiusLimits(options.min_radius, options.max_radius);
}

/// The rows of the greatest connected part.
pcl::Indices max_cluster(const PeerPoints::Ptr& points, const pcl::Indices& rows, double gap) {
  pcl::EuclideanClusterExtraction<pcl::PointXYZ> extraction;
  extraction.setInputCloud(points);
  extraction.setIndices(std::make_shared<pcl::Indices>(rows));
  extraction.setClusterTolerance(gap);
  std::vector<pcl::PointIndices> clusters;
  extraction.extract(clusters);  // greatest first
  return clusters.empty() ? pcl::Indices() : clusters.front().indices;
}

}  // namespace

PclCylinder pcl_cylinder(const Matrix3Xd& points, const PclCylinderOptions& options) {
  options.validate();
  require(points.allFinite(), "points: some are not finite; leave them out");
  if (points.cols() < 3) return {};
  const Vector3d shift = points.rowwise().mean();  // PCL computes in single precision
  const PeerPoints::Ptr cloud = shifted_points(points, shift);
  PeerSegmentation segmentation;
  prepare(segmentation, options);
  segmentation.setInputCloud(cloud);
  segmentation.setInputNormals(estimated_normals(cloud, options.neighbours));
  pcl::PointIndices inliers;
  pcl::ModelCoefficients model;
  segmentation.segment(inliers, model);
  PclCylinder out = cylinder_of(model, *cloud, inliers.indices);
  out.point += shift;
  return out;
}

std::vector<PclCylinder> pcl_find_cylinders(const Cloud& cloud, const Bin& bin, const PclCylinderOptions& options) {
  options.validate();
  const Cloud inside = crop(cloud, bin, 0.25 * options.min_radius, 0.25 * options.min_radius);
  std::vector<PclCylinder> out;
  if (inside.points.cols() < options.min_points) return out;
  const Vector3d shift = inside.points.rowwise().mean();
  const PeerPoints::Ptr points = std::make_shared<PeerPoints>();
  pcl::VoxelGrid<pcl::PointXYZ> grid;
  grid.setInputCloud(shifted_points(inside.points, shift));
  grid.setLeafSize(Eigen::Vector4f::Constant(static_cast<float>(options.voxel)));
  grid.filter(*points);
  const PeerNormals::Ptr normals = estimated_normals(points, options.neighbours);
  const auto left = std::make_shared<pcl::Indices>(points->size());
  for (std::size_t i = 0; i < left->size(); ++i) (*left)[i] = static_cast<pcl::index_t>(i);
  while (static_cast<int>(left->size()) >= options.min_points) {
    PeerSegmentation segmentation;
    prepare(segmentation, options);
    segmentation.setInputCloud(points);
    segmentation.setInputNormals(normals);
    segmentation.setIndices(left);
    pcl::PointIndices inliers;
    pcl::ModelCoefficients model;
    segmentation.segment(inliers, model);
    const pcl::Indices own = max_cluster(points, inliers.indices, 2.5 * options.voxel);
    if (static_cast<int>(own.size()) < options.min_points) break;
    PclCylinder found = cylinder_of(model, *points, own);
    found.point += shift;
    out.push_back(found);
    pcl::Indices taken = own;
    std::sort(taken.begin(), taken.end());
    std::erase_if(*left, [&](const auto row) { return std::binary_search(taken.begin(), taken.end(), row); });
  }
  return out;
}

}  // namespace kr5::picking
