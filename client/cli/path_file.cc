#include "client/cli/path_file.h"

#include <fstream>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

#include "client/formats/scan_reader.h"
#include "core/common/status.h"

namespace strata::cli {

absl::Status WritePath(const std::string& path, const std::vector<Eigen::Vector3d>& waypoints) {
  const std::size_t edges = waypoints.empty() ? 0 : waypoints.size() - 1;
  std::string text = absl::StrCat("ply\nformat ascii 1.0\nelement vertex ",
                                  waypoints.size(),
                                  "\nproperty double x\nproperty double y\nproperty double z\n"
                                  "element edge ",
                                  edges,
                                  "\nproperty int vertex1\nproperty int vertex2\nend_header\n");
  for (const Eigen::Vector3d& p : waypoints) {
    absl::StrAppendFormat(&text, "%.6f %.6f %.6f\n", p.x(), p.y(), p.z());
  }
  for (std::size_t i = 0; i < edges; ++i) {
    absl::StrAppend(&text, i, " ", i + 1, "\n");
  }
  std::ofstream file(path);
  file << text;
  file.close();
  if (!file) {
    return absl::UnavailableError(absl::StrCat(path, ": cannot be written"));
  }
  return absl::OkStatus();
}

}  // namespace strata::cli
