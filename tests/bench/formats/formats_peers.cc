#include "tests/bench/formats/formats_peers.h"

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

namespace strata::bench {
namespace {

void Fill(const PointCloud& /*cloud*/, std::size_t /*i*/, pcl::PointXYZ& /*point*/) {}

void Fill(const PointCloud& cloud, std::size_t i, pcl::PointXYZI& point) {
  point.intensity = cloud.intensity[i];
}

void Fill(const PointCloud& cloud, std::size_t i, pcl::PointXYZRGB& point) {
  point.r = cloud.colour[i].r;
  point.g = cloud.colour[i].g;
  point.b = cloud.colour[i].b;
}

template <typename Point>
bool Write(const PointCloud& cloud, FileKind kind, const std::string& path) {
  pcl::PointCloud<Point> points;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    Point point;
    point.getVector3fMap() = cloud.points[i];
    Fill(cloud, i, point);
    points.push_back(point);
  }
  switch (kind) {
    case FileKind::kBinaryPcd:
      return pcl::PCDWriter().writeBinary(path, points) == 0;
    case FileKind::kCompressedPcd:
      return pcl::PCDWriter().writeBinaryCompressed(path, points) == 0;
    case FileKind::kAsciiPcd:
      return pcl::PCDWriter().writeASCII(path, points) == 0;
    case FileKind::kBinaryPly:
      return pcl::PLYWriter().write(path, points, /*binary=*/true) == 0;
  }
  return false;
}

}  // namespace

struct PclCloud::Cloud {
  pcl::PointCloud<pcl::PointXYZ> points;
};

PclCloud::PclCloud() : cloud_(std::make_unique<Cloud>()) {
  // The reader of PLY tells of every property that it passes over.
  pcl::console::setVerbosityLevel(pcl::console::L_ERROR);
}

PclCloud::~PclCloud() = default;

bool PclCloud::Read(const std::filesystem::path& path) {
  if (path.extension() == ".ply") {
    return pcl::PLYReader().read(path.string(), cloud_->points) == 0;
  }
  return pcl::PCDReader().read(path.string(), cloud_->points) == 0;
}

std::vector<Eigen::Vector3f> PclCloud::FinitePoints() const {
  std::vector<Eigen::Vector3f> points;
  for (const pcl::PointXYZ& point : cloud_->points) {
    if (point.getVector3fMap().allFinite()) points.emplace_back(point.getVector3fMap());
  }
  return points;
}

bool WriteWithPcl(const PointCloud& cloud, FileKind kind, const std::filesystem::path& path) {
  if (!cloud.intensity.empty()) return Write<pcl::PointXYZI>(cloud, kind, path.string());
  if (!cloud.colour.empty()) return Write<pcl::PointXYZRGB>(cloud, kind, path.string());
  return Write<pcl::PointXYZ>(cloud, kind, path.string());
}

}  // namespace strata::bench
