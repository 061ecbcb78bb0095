#include "client/formats/scan_folder.h"

#include <algorithm>
#include <filesystem>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

#include "core/common/status.h"

namespace strata {
namespace {

namespace fs = std::filesystem;

// What lies in a folder; folders below it are not looked into.
struct Contents {
  std::vector<fs::path> scans;
  std::vector<fs::path> unread;  // see WhyNotRead()
  std::vector<fs::path> folders;
};

bool IsScanOfFolder(const fs::path& path, ScanFormat format) {
  const ScanFormat named = ScanFormatOfName(path);
  if (format != ScanFormat::kAuto) return named == format;
  // Folders of scans also hold read-me and pose files.
  return named != ScanFormat::kAuto && absl::AsciiStrToLower(path.extension().string()) != ".txt";
}

bool IsPoseFile(const fs::path& path) {
  const std::string name = absl::AsciiStrToLower(path.filename().string());
  if (!absl::StartsWith(name, "pose")) return false;
  for (const char* ending : {".txt", ".tum", ".csv", ".kitti"}) {
    if (absl::EndsWith(name, ending)) return true;
  }
  return false;
}

absl::StatusOr<std::vector<fs::path>> EntriesOf(const fs::path& folder) {
  std::vector<fs::path> entries;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    entries.push_back(it->path());
  }
  if (error) return absl::UnavailableError(absl::StrCat(folder.string(), ": ", error.message()));
  std::sort(entries.begin(), entries.end());
  return entries;
}

absl::StatusOr<Contents> ContentsOf(const fs::path& folder, ScanFormat format) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<fs::path> entries, EntriesOf(folder));
  Contents contents;
  for (const fs::path& path : entries) {
    std::error_code ignored;
    // Neither a link to nothing nor what cannot be read is passed over: reading it will say so.
    if (fs::is_directory(path, ignored)) {
      contents.folders.push_back(path);
    } else if (IsScanOfFolder(path, format) && !IsPoseFile(path)) {
      contents.scans.push_back(path);
    } else if (!WhyNotRead(path).empty()) {
      contents.unread.push_back(path);
    }
  }
  return contents;
}

// "7 files (.bt .laz) are not read".
std::string Unread(const std::vector<fs::path>& files) {
  std::set<std::string> endings;
  for (const fs::path& file : files) {
    endings.insert(absl::AsciiStrToLower(file.extension().string()));
  }
  return absl::StrCat(files.size(), " files (", absl::StrJoin(endings, " "), ") are not read");
}

absl::Status NoScans(const fs::path& folder, ScanFormat format, const Contents& contents) {
  const std::string where = folder.string();
  if (!contents.unread.empty()) {
    return absl::NotFoundError(absl::StrCat(
        where, ": ", Unread(contents.unread), "; ", WhyNotRead(contents.unread.front())));
  }
  if (format != ScanFormat::kAuto) {
    return absl::NotFoundError(
        absl::StrCat(where, ": no scan of format ", ScanFormatName(format), " by its ending"));
  }
  return absl::NotFoundError(
      absl::StrCat(where,
                   ": no scan by its ending (.pcd .ply .bin .vtk .3d .las .laz .ptx .e57 .pcap "
                   ".xyz .csv .asc .pts) "
                   "here or one folder below; say --format xyz for points in .txt files"));
}

// One look one level down.
absl::StatusOr<Contents> ContentsBelow(const fs::path& folder,
                                       ScanFormat format,
                                       const Contents& own) {
  std::vector<std::pair<std::string, Contents>> found;
  for (const fs::path& below : own.folders) {
    const absl::StatusOr<Contents> contents = ContentsOf(below, format);
    if (!contents.ok() || contents->scans.empty()) continue;
    if (below.filename() == "scans") return contents;
    found.emplace_back(below.string(), *contents);
  }
  if (found.empty()) return NoScans(folder, format, own);
  if (found.size() == 1) return found.front().second;
  return absl::InvalidArgumentError(absl::StrCat(
      folder.string(),
      ": scans lie in ",
      absl::StrJoin(
          found, ", ", [](std::string* out, const auto& named) { out->append(named.first); }),
      "; name one of these folders"));
}

}  // namespace

absl::StatusOr<std::vector<fs::path>> ScansAt(const fs::path& path,
                                              ScanFormat format,
                                              const std::function<void(const std::string&)>& tell) {
  std::error_code error;
  if (!fs::exists(path, error)) {
    return absl::NotFoundError(absl::StrCat(path.string(), ": no such file or folder"));
  }
  if (!fs::is_directory(path, error)) {
    const std::string unread = format == ScanFormat::kAuto ? WhyNotRead(path) : "";
    if (unread.empty()) return std::vector<fs::path>{path};
    return absl::InvalidArgumentError(absl::StrCat(path.string(), ": ", unread));
  }
  STRATA_ASSIGN_OR_RETURN(Contents contents, ContentsOf(path, format));
  if (contents.scans.empty()) {
    STRATA_ASSIGN_OR_RETURN(contents, ContentsBelow(path, format, contents));
  }
  if (!contents.unread.empty() && tell) {
    tell(absl::StrCat("warning: ", path.string(), ": ", Unread(contents.unread), ": left out"));
  }
  return std::move(contents.scans);
}

std::vector<fs::path> PoseFilesIn(const fs::path& folder) {
  std::vector<fs::path> files;
  const absl::StatusOr<std::vector<fs::path>> entries = EntriesOf(folder);
  if (!entries.ok()) return files;
  std::error_code error;
  for (const fs::path& path : *entries) {
    if (IsPoseFile(path) && fs::is_regular_file(path, error)) files.push_back(path);
  }
  return files;
}

}  // namespace strata
