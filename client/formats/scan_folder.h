// Where the scans and the poses of a data set lie.
#ifndef STRATA_CLIENT_FORMATS_SCAN_FOLDER_H_
#define STRATA_CLIENT_FORMATS_SCAN_FOLDER_H_

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

#include "client/formats/scan_reader.h"

namespace strata {

// The scans that `path` stands for, in no order: itself, if it is a file; of a folder the files
// whose name has the format's ending, with kAuto any ending that ScanFormatOfName knows but .txt.
// A folder without any stands for the one folder in it that has some, or for the one called
// "scans". `tell`, if set, is told which points are left out because their format is not read.
//
// NOT_FOUND, naming what is there and what to do; INVALID_ARGUMENT if several folders have scans,
// or the file is of a format that is not read.
absl::StatusOr<std::vector<std::filesystem::path>> ScansAt(
    const std::filesystem::path& path,
    ScanFormat format,
    const std::function<void(const std::string&)>& tell);

// Files whose names say that they hold poses ("poses_initial.txt", "pose.csv", "poses.tum") in a
// folder, by name.
std::vector<std::filesystem::path> PoseFilesIn(const std::filesystem::path& folder);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_SCAN_FOLDER_H_
