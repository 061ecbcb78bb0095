// Paths as PLY files: vertices in order, joined by edges.
#ifndef STRATA_CLIENT_FORMATS_PATH_FILE_H_
#define STRATA_CLIENT_FORMATS_PATH_FILE_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Core>

namespace strata {

// FAILED_PRECONDITION if the file cannot be written.
absl::Status WritePath(const std::string& path, const std::vector<Eigen::Vector3d>& waypoints);

// The vertices of any PLY file in their order. INVALID_ARGUMENT or NOT_FOUND naming the file.
absl::StatusOr<std::vector<Eigen::Vector3d>> ReadPath(const std::string& path);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_PATH_FILE_H_
