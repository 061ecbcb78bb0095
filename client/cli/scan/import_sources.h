// What strata scan import brings into a map: files found, named, and told from what is there.
#ifndef STRATA_CLIENT_CLI_SCAN_IMPORT_SOURCES_H_
#define STRATA_CLIENT_CLI_SCAN_IMPORT_SOURCES_H_

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"

#include "client/cli/scan/scan_uploader.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/output.h"
#include "core/world/scan.h"

namespace strata::cli {

// Options of the command.
struct ImportOptions {
  std::string map;
  std::vector<std::string> paths;
  std::string format = "auto";
  std::string poses;
  std::string pose_format = "auto";
  std::string trajectory;
  std::string align = "on";
  std::string classes;  // as ReadLabelClasses(); empty: labels are ids of the map's classes
  bool without_labels = false;
  bool level = false;
  bool wait = false;
  std::string spool;  // a directory, if scans go there first
  bool as_local_maps = false;
};

struct ImportSources {
  std::size_t files = 0;
  std::vector<UploadSource> missing;  // in the map
  std::vector<ScanId> there;
  std::vector<std::pair<std::string, std::string>> errors;  // file, and why it cannot be uploaded
  std::optional<double> level_rad;                          // with --level
};

// The folder's name, or that of the folder around one that is only called "scans", in the letters
// that names may have.
std::string TrajectoryOf(const std::string& path);

// What the paths have and the map lacks. Warns where the map has other scans under the same
// numbers. REQUIRES: the trajectory has a name, here and below.
absl::StatusOr<ImportSources> FindImportSources(Context& context, const ImportOptions& options);
// All that the paths have, whatever a map has; labels stay as the files have them.
absl::StatusOr<ImportSources> FindImportSources(Output& output, const ImportOptions& options);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_SCAN_IMPORT_SOURCES_H_
