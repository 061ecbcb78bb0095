#include "client/formats/scan_reader.h"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <ios>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "client/formats/file_bytes.h"
#include "client/formats/packets/velodyne_reader.h"
#include "client/formats/parsing/range_zero.h"
#include "client/formats/pcd_reader.h"
#include "client/formats/plain_readers.h"
#include "client/formats/ply_reader.h"
#include "client/formats/survey/e57_reader.h"
#include "client/formats/survey/las_reader.h"
#include "client/formats/survey/ptx_reader.h"
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
    {"nuscenes", ScanFormat::kNuscenes},
    {"vtk", ScanFormat::kVtk},
    {"xyz", ScanFormat::kXyz},
    {"oakland", ScanFormat::kOakland},
    {"las", ScanFormat::kLas},
    {"ptx", ScanFormat::kPtx},
    {"e57", ScanFormat::kE57},
    {"velodyne", ScanFormat::kVelodyne},
};

constexpr NamedFormat kEndings[] = {
    {".3d", ScanFormat::k3dtk},
    {".pcd", ScanFormat::kPcd},
    {".ply", ScanFormat::kPly},
    {".bin", ScanFormat::kKitti},
    {".vtk", ScanFormat::kVtk},
    {".las", ScanFormat::kLas},
    {".laz", ScanFormat::kLas},
    {".ptx", ScanFormat::kPtx},
    {".e57", ScanFormat::kE57},
    {".pcap", ScanFormat::kVelodyne},
    {".pcapng", ScanFormat::kVelodyne},
    {".xyz_label_conf", ScanFormat::kOakland},
    {".txt", ScanFormat::kXyz},
    {".csv", ScanFormat::kXyz},
    {".asc", ScanFormat::kXyz},
    {".pts", ScanFormat::kXyz},
};

struct UnreadFormat {
  absl::string_view ending;
  absl::string_view what;  // it is, and the cure
};

constexpr absl::string_view kRosCure =
    "holds messages of many topics; 'strata scan import MAP FILE --topic T --poses-from T' takes "
    "its clouds, 'strata scan topics FILE' lists what there is";
constexpr absl::string_view kPacketsCure =
    "holds a sensor's packets, which are not read; the sensor's own program writes PCD or CSV";
constexpr absl::string_view kPackedCure = "is packed; unpack it first";

constexpr UnreadFormat kUnread[] = {
    {".bag", kRosCure},
    {".db3", kRosCure},
    {".mcap", kRosCure},
    {".rawlog", kPacketsCure},
    {".bt", "holds voxels of an OctoMap, no scan; convert it with octree2pointcloud to PCD"},
    {".ot", "holds voxels of an OctoMap, no scan; convert it with octree2pointcloud to PCD"},
    {".gz", kPackedCure},
    {".zip", kPackedCure},
};

std::string EndingOf(const std::filesystem::path& path) {
  return absl::AsciiStrToLower(path.extension().string());
}

ScanFormat FormatOfStart(absl::string_view start) {
  if (absl::StartsWith(start, "ply\n") || absl::StartsWith(start, "ply\r")) return ScanFormat::kPly;
  if (absl::StartsWith(start, "# vtk DataFile")) return ScanFormat::kVtk;
  if (absl::StartsWith(start, "# .PCD") || absl::StartsWith(start, "VERSION ")) {
    return ScanFormat::kPcd;
  }
  if (absl::StartsWith(start, "LASF")) return ScanFormat::kLas;
  if (absl::StartsWith(start, "ASTM-E57")) return ScanFormat::kE57;
  for (const absl::string_view packets :
       {"\xD4\xC3\xB2\xA1", "\xA1\xB2\xC3\xD4", "\x4D\x3C\xB2\xA1", "\x0A\x0D\x0D\x0A"}) {
    if (absl::StartsWith(start, packets)) return ScanFormat::kVelodyne;
  }
  return ScanFormat::kAuto;
}

// By its first bytes, else by its name.
ScanFormat FormatOfFile(const std::filesystem::path& path) {
  std::string start(64, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(file.gcount()));
  const ScanFormat format = FormatOfStart(start);
  return format == ScanFormat::kAuto ? ScanFormatOfName(path) : format;
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
    case ScanFormat::kNuscenes:
      return ReadNuscenes(bytes);
    case ScanFormat::kVtk:
      return ReadVtk(bytes);
    case ScanFormat::kXyz:
      return ReadXyz(bytes);
    case ScanFormat::kOakland:
      return ReadOakland(bytes);
    case ScanFormat::kLas:
    case ScanFormat::kPtx:
    case ScanFormat::kE57:
    case ScanFormat::kVelodyne:
    case ScanFormat::kAuto:
      break;
  }
  return absl::InvalidArgumentError(
      "unknown format; say which with --format: 3dtk, pcd, ply, kitti, nuscenes, vtk, xyz, "
      "oakland, las, ptx, e57, velodyne");
}

absl::StatusOr<PointCloud> ReadWhole(const std::filesystem::path& path, ScanFormat format) {
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, ReadFileBytes(path));
  if (bytes.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(path.string(), ": the file is empty; expected a scan"));
  }
  absl::StatusOr<PointCloud> cloud = Parse(bytes, format);
  if (!cloud.ok()) return Annotate(cloud.status(), path.string());
  return cloud;
}

absl::StatusOr<PointCloud> ReadInPieces(const std::filesystem::path& path) {
  absl::StatusOr<PointCloud> cloud = ReadLasFile(path);
  if (!cloud.ok()) return Annotate(cloud.status(), path.string());
  return cloud;
}

absl::StatusOr<PointCloud> ReadOnlyStation(const std::filesystem::path& path, ScanFormat format) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<Station> stations, ListStations(path, format));
  if (stations.size() != 1) {
    return absl::InvalidArgumentError(
        absl::StrCat(path.string(),
                     ": holds ",
                     stations.size(),
                     " scans and one is expected; 'strata scan import MAP FILE' takes them all, "
                     "'strata scan export' writes each"));
  }
  absl::StatusOr<PointCloud> cloud = stations.front().read();
  if (!cloud.ok()) return Annotate(cloud.status(), path.string());
  return cloud;
}

}  // namespace

absl::StatusOr<ScanFormat> ParseScanFormat(absl::string_view name) {
  for (const NamedFormat& named : kFormats) {
    if (named.name == name) return named.format;
  }
  return absl::InvalidArgumentError(
      absl::StrCat("scan format '",
                   name.substr(0, 40),
                   "' is none of auto, 3dtk, pcd, ply, kitti, nuscenes, vtk, xyz, oakland, las, "
                   "ptx, e57, velodyne"));
}

absl::string_view ScanFormatName(ScanFormat format) {
  for (const NamedFormat& named : kFormats) {
    if (named.format == format) return named.name;
  }
  return "unknown";
}

ScanFormat ScanFormatOfName(const std::filesystem::path& path) {
  const std::string ending = EndingOf(path);
  if (ending == ".bin" && EndingOf(path.stem()) == ".pcd") return ScanFormat::kNuscenes;
  for (const NamedFormat& named : kEndings) {
    if (named.name == ending) return named.format;
  }
  return absl::StartsWith(ending, ".xyz") ? ScanFormat::kXyz : ScanFormat::kAuto;
}

std::string WhyNotRead(const std::filesystem::path& path) {
  const std::string ending = EndingOf(path);
  for (const UnreadFormat& unread : kUnread) {
    if (unread.ending == ending) return absl::StrCat(ending, " ", unread.what);
  }
  return "";
}

bool HoldsStations(ScanFormat format) {
  return StationsHavePoses(format) || format == ScanFormat::kVelodyne;
}

bool StationsHavePoses(ScanFormat format) {
  return format == ScanFormat::kPtx || format == ScanFormat::kE57;
}

absl::StatusOr<std::vector<Station>> ListStations(const std::filesystem::path& path,
                                                  ScanFormat format) {
  STRATA_RETURN_IF_ERROR(CheckIsFile(path));
  if (!HoldsStations(format)) {
    return absl::InvalidArgumentError(
        absl::StrCat(path.string(), ": files of ", ScanFormatName(format), " hold one scan"));
  }
  absl::StatusOr<std::vector<Station>> stations = format == ScanFormat::kPtx ? ListPtxStations(path)
                                                  : format == ScanFormat::kE57
                                                      ? ListE57Stations(path)
                                                      : ListVelodyneStations(path);
  if (!stations.ok()) return Annotate(stations.status(), path.string());
  return stations;
}

absl::StatusOr<PointCloud> ReadScan(const std::filesystem::path& path,
                                    ScanFormat format,
                                    std::size_t* at_sensor) {
  STRATA_RETURN_IF_ERROR(CheckIsFile(path));
  if (format == ScanFormat::kAuto) format = FormatOfFile(path);
  const std::string unread = format == ScanFormat::kAuto ? WhyNotRead(path) : "";
  if (!unread.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(path.string(), ": ", unread));
  }
  absl::StatusOr<PointCloud> cloud = HoldsStations(format)        ? ReadOnlyStation(path, format)
                                     : format == ScanFormat::kLas ? ReadInPieces(path)
                                                                  : ReadWhole(path, format);
  if (!cloud.ok()) return cloud;
  cloud = WithoutRangeZero(*std::move(cloud), at_sensor);
  if (!cloud.ok()) return Annotate(cloud.status(), path.string());
  return cloud;
}

}  // namespace strata
