// Scans out of files: one door for every format people already have.
#ifndef STRATA_CLIENT_FORMATS_SCAN_READER_H_
#define STRATA_CLIENT_FORMATS_SCAN_READER_H_

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "client/formats/survey/station.h"
#include "core/cloud/point_cloud.h"

namespace strata {

enum class ScanFormat : std::uint8_t {
  kAuto,
  k3dtk,
  kPcd,
  kPly,
  kKitti,
  kNuscenes,
  kVtk,
  kXyz,
  kOakland,
  kLas,
  kPtx,
  kE57,
  kVelodyne
};

// "auto", "3dtk", "pcd", "ply", "kitti", "nuscenes", "vtk", "xyz", "oakland", "las", "ptx", "e57",
// "velodyne"; INVALID_ARGUMENT listing them otherwise.
absl::StatusOr<ScanFormat> ParseScanFormat(absl::string_view name);
absl::string_view ScanFormatName(ScanFormat format);

// The format of a file by its name: .pcd, .ply, .bin (KITTI), .pcd.bin (nuScenes), .3d (3DTK),
// .vtk, .las, .laz (LAS, too), .ptx, .e57, .pcap and .pcapng (Velodyne), and .xyz…, .txt, .csv,
// .asc, .pts (text), and of those .xyz_label_conf (Oakland); kAuto for any other.
ScanFormat ScanFormatOfName(const std::filesystem::path& path);

// What a file is that holds points and is not read, by its ending (.mcap, .bt, …), and what
// makes of it one that is; empty for any other file.
std::string WhyNotRead(const std::filesystem::path& path);

// Whether files of a format may hold several scans: PTX, E57 and packets of a Velodyne; and whether
// each of them has its pose: not those.
bool HoldsStations(ScanFormat format);
bool StationsHavePoses(ScanFormat format);

// The scans of such a file in its order; their errors name no file. Memory does not grow with the
// file. NOT_FOUND, UNAVAILABLE, INVALID_ARGUMENT as ReadScan.
absl::StatusOr<std::vector<Station>> ListStations(const std::filesystem::path& path,
                                                  ScanFormat format);

// The cloud of a file, in metres, z up; kAuto goes by the first bytes (PCD, PLY, VTK, LAS, E57
// and pcap say what they are), else by the name. Points that are not finite are left out, but kept
// as NaN in organised clouds; so are returns of range 0, at (0, 0, 0) or where the sensor stood,
// which are counted in `at_sensor` if it is not null. Far coordinates keep their precision by
// PointCloud::origin. Passes ValidateCloud. NOT_FOUND; UNAVAILABLE if it cannot be read;
// INVALID_ARGUMENT with file, line or byte and what was expected, or if no point is left or the
// file holds several scans. Memory is bounded by about 20 times the file's size, of LAZ by what its
// points take as LAS, of which a byte holds 200 at most.
absl::StatusOr<PointCloud> ReadScan(const std::filesystem::path& path,
                                    ScanFormat format = ScanFormat::kAuto,
                                    std::size_t* at_sensor = nullptr);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_SCAN_READER_H_
