// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/picking/patches.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <unordered_map>

#include <pcl/features/normal_3d.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/region_growing.h>

#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>

namespace kr5::picking {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

void PatchOptions::validate() const {
  require(spacing > 0 && std::isfinite(spacing), "spacing must be positive [m]");
  require(normal_radius >= spacing && std::isfinite(normal_radius), "normal_radius must be the spacing or more [m]");
  require(smoothness > 0 && smoothness < 1.5, "smoothness must lie between 0 and 1.5 [rad]");
  require(max_curvature > 0 && max_curvature <= 1.0 / 3, "max_curvature must lie between 0 and 1/3 [-]");
  require(flat_limit > 0 && flat_limit < 1, "flat_limit must lie between 0 and 1 [-]");
  require(max_area > 0, "max_area must be positive [m^2]");
  require(min_points >= 3, "min_points must be 3 or more");
}

PatchOptions PatchOptions::for_radius(double radius, double pitch) {
  require(radius > 0 && std::isfinite(radius), "radius must be positive [m]");
  require(pitch >= 0 && std::isfinite(pitch), "pitch must not be negative [m]");
  PatchOptions out;
  const double scale = radius / 0.008;
  out.max_area *= scale * scale;
  out.spacing = std::max(out.spacing * scale, 0.8 * pitch);
  out.normal_radius = std::max(out.normal_radius * scale, 1.8 * pitch);  // a dozen neighbours
  return out;
}

namespace {

using Points = pcl::PointCloud<pcl::PointXYZ>;

/// One point of each cube of the side `spacing`, the one nearest to its centre: measured points, for means of a curved
/// surface lie inside it. The numbers of the rows.
std::vector<int> uniform_sample(const Points& cloud, double spacing) {
  const auto scale = static_cast<float>(1 / spacing);
  struct Nearest {
    int row;
    float distance;
  };
  std::unordered_map<std::int64_t, Nearest> cubes;
  cubes.reserve(cloud.size() / 2);
  for (std::size_t row = 0; row < cloud.size(); ++row) {
    const Eigen::Array3f p = cloud[row].getArray3fMap() * scale, cube = p.floor();
    const auto number = [&](int k) { return static_cast<std::int64_t>(cube[k]) & 0x1fffff; };
    const Nearest here{static_cast<int>(row), (p - cube - 0.5F).square().sum()};
    const auto [place, added] = cubes.try_emplace(number(0) << 42 | number(1) << 21 | number(2), here);
    if (!added && here.distance < place->second.distance) place->second = here;
  }
  std::vector<int> out;
  out.reserve(cubes.size());
  for (const auto& [cube, nearest] : cubes) out.push_back(nearest.row);
  std::sort(out.begin(), out.end());
  return out;
}

/// The sample without lone points, with normals towards the sensor.
struct Surface {
  Points::Ptr points = std::make_shared<Points>();
  pcl::PointCloud<pcl::Normal>::Ptr normals = std::make_shared<pcl::PointCloud<pcl::Normal>>();
  std::vector<int> columns;
};

Surface surface_of(const Cloud& cloud, const std::vector<int>& finite, const Vector3d& shift, const Vector3d& up,
                   const PatchOptions& options) {
  const auto all = std::make_shared<Points>();
  all->reserve(finite.size());
  for (const int i : finite) {
    const Eigen::Vector3f p = (cloud.points.col(i) - shift).cast<float>();
    all->push_back({p.x(), p.y(), p.z()});
  }
  const auto dense = std::make_shared<Points>();  // twice as dense as the sample: what normals are made of
  const std::vector<int> dense_rows = uniform_sample(*all, options.spacing / 2);
  for (const int row : dense_rows) dense->push_back((*all)[static_cast<std::size_t>(row)]);
  pcl::search::KdTree<pcl::PointXYZ> tree(false);
  tree.setInputCloud(dense);
  Surface out;
  pcl::Indices neighbours;
  std::vector<float> distances;
  for (const int row : uniform_sample(*all, options.spacing)) {
    const pcl::PointXYZ& p = (*all)[static_cast<std::size_t>(row)];
    tree.radiusSearch(p, options.normal_radius, neighbours, distances);
    if (neighbours.size() < 6) continue;  // a lone point
    Eigen::Vector4f plane;
    float curvature = 0;
    if (!pcl::computePointNormal(*dense, neighbours, plane, curvature)) continue;
    const int column = finite[static_cast<std::size_t>(row)];
    Vector3d normal = plane.head<3>().cast<double>();
    const Index origin = cloud.origins.cols() > 1 ? column : 0;
    const Vector3d to_sensor =
        cloud.origins.cols() > 0 ? Vector3d(cloud.origins.col(origin) - cloud.points.col(column)) : up;
    if (normal.dot(to_sensor) < 0) normal = -normal;
    pcl::Normal n(static_cast<float>(normal.x()), static_cast<float>(normal.y()), static_cast<float>(normal.z()));
    n.curvature = curvature;
    out.points->push_back(p);
    out.normals->push_back(n);
    out.columns.push_back(column);
  }
  return out;
}

Patch patch_of(const pcl::PointIndices& cluster, const Surface& surface, const Cloud& cloud,
               const PatchOptions& options) {
  Patch out;
  Matrix3d scatter = Matrix3d::Zero();
  Vector3d normals = Vector3d::Zero(), sum = Vector3d::Zero();
  for (const auto index : cluster.indices) {
    const auto row = static_cast<std::size_t>(index);
    const Vector3d n = (*surface.normals)[row].getNormalVector3fMap().cast<double>();
    scatter += n * n.transpose();
    normals += n;
    sum += cloud.points.col(surface.columns[row]);
    out.points.push_back(surface.columns[row]);
  }
  const auto count = static_cast<double>(cluster.indices.size());
  out.centroid = sum / count;
  out.normal = normals.normalized();
  const SymmetricEigen eigen = symmetric_eigen(Matrix3d(scatter / count));  // eigenvalues rise
  const Vector3d l = eigen.values;
  if (l[1] < options.flat_limit * l[2]) {
    out.kind = PatchKind::Flat;
    out.axis = out.normal;
  } else {
    out.kind = l[0] < 0.5 * l[1] ? PatchKind::Curved : PatchKind::Mixed;
    out.axis = eigen.vectors.col(0);
  }
  return out;
}

/// Region growing over all points, or over some.
std::vector<pcl::PointIndices> grown(const Surface& surface, const pcl::PointIndices::Ptr& of, double smoothness,
                                     double curvature, const PatchOptions& options) {
  pcl::RegionGrowing<pcl::PointXYZ, pcl::Normal> growing;
  growing.setMinClusterSize(options.min_points);
  growing.setSearchMethod(std::make_shared<pcl::search::KdTree<pcl::PointXYZ>>(false));
  growing.setNumberOfNeighbours(8);
  growing.setInputCloud(surface.points);
  growing.setInputNormals(surface.normals);
  if (of) growing.setIndices(of);
  growing.setSmoothnessThreshold(static_cast<float>(smoothness));
  growing.setCurvatureThreshold(static_cast<float>(curvature));
  std::vector<pcl::PointIndices> out;
  growing.extract(out);
  return out;
}

/// Level parts of a patch that is more than one surface: an end face beside the side of a neighbour of nearly its
/// height joins it without an edge.
std::vector<pcl::PointIndices> flat_parts(pcl::PointIndices cluster, const Surface& surface,
                                          const PatchOptions& options) {
  constexpr float cosine = 0.9945F;  // 6 degrees
  const auto thickness = static_cast<float>(0.25 * options.spacing);
  const auto reach = static_cast<float>(2 * options.normal_radius);
  std::vector<pcl::PointIndices> out;
  pcl::Indices& left = cluster.indices;
  for (int part = 0; part < 6 && static_cast<int>(left.size()) > 4 * options.min_points; ++part) {
    pcl::PointIndices best;
    for (std::size_t seed = 0; seed < left.size(); seed += 3) {
      const auto at = static_cast<std::size_t>(left[seed]);
      if ((*surface.normals)[at].curvature > 0.5F * static_cast<float>(options.flat_limit)) continue;
      const Eigen::Vector3f p = (*surface.points)[at].getVector3fMap(),
                            n = (*surface.normals)[at].getNormalVector3fMap();
      pcl::PointIndices like;
      for (const auto index : left) {
        const auto i = static_cast<std::size_t>(index);
        const Eigen::Vector3f from = (*surface.points)[i].getVector3fMap() - p;
        if (n.dot((*surface.normals)[i].getNormalVector3fMap()) > cosine && std::abs(n.dot(from)) < thickness &&
            from.squaredNorm() < reach * reach)
          like.indices.push_back(index);
      }
      if (like.indices.size() > best.indices.size()) best = std::move(like);
    }
    if (static_cast<int>(best.indices.size()) < 3 * options.min_points) break;
    std::erase_if(
        left, [&](const auto index) { return std::binary_search(best.indices.begin(), best.indices.end(), index); });
    out.push_back(std::move(best));
  }
  return out;
}

}  // namespace

std::vector<Patch> find_patches(const Cloud& cloud, const Vector3d& up, const PatchOptions& options) {
  cloud.validate();
  options.validate();
  require(up.allFinite() && up.norm() > 0, "up must be a direction");
  std::vector<int> finite;
  for (Index i = 0; i < cloud.points.cols(); ++i)
    if (cloud.points.col(i).allFinite()) finite.push_back(static_cast<int>(i));
  std::vector<Patch> out;
  if (finite.empty()) return out;
  const Surface surface = surface_of(cloud, finite, cloud.points.col(finite.front()), up, options);
  if (surface.points->size() < static_cast<std::size_t>(options.min_points)) return out;
  for (const pcl::PointIndices& cluster : grown(surface, nullptr, options.smoothness, options.max_curvature, options)) {
    out.push_back(patch_of(cluster, surface, cloud, options));
    const double area = static_cast<double>(cluster.indices.size()) * options.spacing * options.spacing;
    if (area < options.max_area) continue;
    const auto part = std::make_shared<pcl::PointIndices>(cluster);
    std::sort(part->indices.begin(), part->indices.end());
    for (const pcl::PointIndices& piece :
         grown(surface, part, options.smoothness / 2, options.max_curvature / 2, options))
      if (piece.indices.size() < cluster.indices.size()) out.push_back(patch_of(piece, surface, cloud, options));
    if (area > 60 * options.max_area) continue;  // a sheet or a floor, of which parts tell nothing
    for (const pcl::PointIndices& piece : flat_parts(*part, surface, options))
      out.push_back(patch_of(piece, surface, cloud, options));
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const Patch& a, const Patch& b) { return a.points.size() > b.points.size(); });
  return out;
}

}  // namespace kr5::picking
