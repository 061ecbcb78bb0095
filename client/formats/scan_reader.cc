#include "client/formats/scan_reader.h"

#include <filesystem>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "client/formats/file_bytes.h"
#include "client/formats/pcd_reader.h"
#include "client/formats/plain_readers.h"
#include "client/formats/ply_reader.h"
#include "client/formats/vtk_reader.h"
#include "core/common/status.h"

namespace strata {
namespace {

struct NamedFormat {
  absl::string_view name;
  ScanFormat format;
};

constexpr NamedFormat kFormats[] = {
    {"auto", ScanFormat::kAuto},
    {"3dtk", ScanFormat::k3dtk},
    {"pcd", ScanFormat::kPcd},
    {"ply", ScanFormat::kPly},
    {"kitti", ScanFormat::kKitti},
    {"vtk", ScanFormat::kVtk},
    {"xyz", ScanFormat::kXyz},
    {"oakland", ScanFormat::kOakland},
};

constexpr NamedFormat kEndings[] = {
    {".3d", ScanFormat::k3dtk},
    {".pcd", ScanFormat::kPcd},
    {".ply", ScanFormat::kPly},
    {".bin", ScanFormat::kKitti},
    {".vtk", ScanFormat::kVtk},
    {".xyz_label_conf", ScanFormat::kOakland},
    {".txt", ScanFormat::kXyz},
    {".csv", ScanFormat::kXyz},
    {".asc", ScanFormat::kXyz},
    {".pts", ScanFormat::kXyz},
};

ScanFormat FormatOfBytes(absl::string_view bytes) {
  const absl::string_view start = bytes.substr(0, 64);
  if (absl::StartsWith(start, "ply\n") || absl::StartsWith(start, "ply\r")) return ScanFormat::kPly;
  if (absl::StartsWith(start, "# vtk DataFile")) return ScanFormat::kVtk;
  if (absl::StartsWith(start, "# .PCD") || absl::StartsWith(start, "VERSION ")) {
    return ScanFormat::kPcd;
  }
  return ScanFormat::kAuto;
}

absl::StatusOr<PointCloud> Parse(absl::string_view bytes, ScanFormat format) {
  switch (format) {
    case ScanFormat::k3dtk:
      return Read3dtk(bytes);
    case ScanFormat::kPcd:
      return ReadPcd(bytes);
    case ScanFormat::kPly:
      return ReadPly(bytes);
    case ScanFormat::kKitti:
      return ReadKitti(bytes);
    case ScanFormat::kVtk:
      return ReadVtk(bytes);
    case ScanFormat::kXyz:
      return ReadXyz(bytes);
    case ScanFormat::kOakland:
      return ReadOakland(bytes);
    case ScanFormat::kAuto:
      break;
  }
  return absl::InvalidArgumentError(
      "unknown format; say which of 3dtk, pcd, ply, kitti, vtk, xyz, oakland");
}

}  // namespace

absl::StatusOr<ScanFormat> ParseScanFormat(absl::string_view name) {
  for (const NamedFormat& named : kFormats) {
    if (named.name == name) return named.format;
  }
  return absl::InvalidArgumentError(
      absl::StrCat("scan format '",
                   name.substr(0, 40),
                   "' is none of auto, 3dtk, pcd, ply, kitti, vtk, xyz, oakland"));
}

absl::string_view ScanFormatName(ScanFormat format) {
  for (const NamedFormat& named : kFormats) {
    if (named.format == format) return named.name;
  }
  return "unknown";
}

ScanFormat ScanFormatOfName(const std::filesystem::path& path) {
  const std::string ending = absl::AsciiStrToLower(path.extension().string());
  for (const NamedFormat& named : kEndings) {
    if (named.name == ending) return named.format;
  }
  return absl::StartsWith(ending, ".xyz") ? ScanFormat::kXyz : ScanFormat::kAuto;
}

absl::StatusOr<PointCloud> ReadScan(const std::filesystem::path& path, ScanFormat format) {
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, ReadFileBytes(path));
  if (bytes.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(path.string(), ": the file is empty; expected a scan"));
  }
  if (format == ScanFormat::kAuto) format = FormatOfBytes(bytes);
  if (format == ScanFormat::kAuto) format = ScanFormatOfName(path);
  absl::StatusOr<PointCloud> cloud = Parse(bytes, format);
  if (!cloud.ok()) return Annotate(cloud.status(), path.string());
  return cloud;
}

}  // namespace strata
