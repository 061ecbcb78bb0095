#include "client/formats/path_file.h"

#include <string>
#include <vector>

#include "client/formats/file_bytes.h"
#include "client/formats/geometry_writer.h"
#include "client/formats/ply_reader.h"
#include "core/common/status.h"

namespace strata {

absl::Status WritePath(const std::string& path, const std::vector<Eigen::Vector3d>& waypoints) {
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, PlyBytes(PathGeometry(waypoints)));
  return WriteFileBytes(path, bytes);
}

absl::StatusOr<std::vector<Eigen::Vector3d>> ReadPath(const std::string& path) {
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, ReadFileBytes(path));
  const absl::StatusOr<PointCloud> cloud = ReadPly(bytes);
  if (!cloud.ok()) return Annotate(cloud.status(), path);
  return GeometryOf(*cloud).vertices;
}

}  // namespace strata
