#include "core/engine/local_map_upload.h"

#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Geometry>

#include "core/api/scans.h"
#include "core/codec/local_map_codec.h"
#include "core/common/checksum.h"
#include "core/common/status.h"
#include "core/engine/mls_tiles.h"
#include "core/engine/scan_source.h"
#include "core/storage/storage.h"
#include "core/world/scan_hash.h"

namespace strata {
namespace {

absl::Status CheckHeader(const ScanHeader& header) {
  if (header.point_count == 0 && header.rows == 0 && !header.has_intensity && !header.has_colour &&
      !header.has_label) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError("the header announces points, but a local map has none");
}

absl::Status CheckParameters(const MlsParameters& map, const MlsParameters& local_map) {
  if (map == local_map) return absl::OkStatus();
  const auto text = [](const MlsParameters& p) {
    return absl::StrCat("cell_size ",
                        p.cell_size_m,
                        " m, gap_size ",
                        p.gap_size_m,
                        " m, thickness ",
                        p.thickness_m,
                        " m");
  };
  return absl::InvalidArgumentError(
      absl::StrCat("local map of ", text(local_map), "; the map has ", text(map)));
}

// The box around its surfaces in the scan frame.
absl::StatusOr<Eigen::AlignedBox3f> BoxOf(const MlsMap& local_map) {
  constexpr double kMaxCoordinateM = 1e6;
  if (local_map.tiles.size() > kMaxScanTiles) {
    return absl::InvalidArgumentError(absl::StrCat(
        "local map of ", local_map.tiles.size(), " tiles; at most ", kMaxScanTiles, ", split it"));
  }
  Eigen::AlignedBox3d box;
  for (const MlsTile& tile : local_map.tiles) {
    if (tile.key.level != 0) {
      return absl::InvalidArgumentError(
          absl::StrCat("local map: a tile of level ", tile.key.level, "; its tiles have level 0"));
    }
    box.extend(MakeMlsTileRow(tile, 0, local_map.parameters.cell_size_m).box);
  }
  if (!box.isEmpty() && box.min().cwiseMin(-box.max()).minCoeff() < -kMaxCoordinateM) {
    return absl::InvalidArgumentError("local map: reaches beyond ±1e6 m");
  }
  Eigen::AlignedBox3f rounded;
  if (!box.isEmpty()) rounded.extend(box.min().cast<float>()).extend(box.max().cast<float>());
  return rounded;
}

absl::StatusOr<MlsMap> Decode(absl::string_view bytes, const MlsParameters& parameters) {
  if (bytes.size() > api::kMaxLocalMapBytes) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "local map of ", bytes.size(), " bytes; at most ", api::kMaxLocalMapBytes, ", split it"));
  }
  absl::StatusOr<MlsMap> local_map = DecodeLocalMap(bytes, parameters);
  if (!absl::IsDataLoss(local_map.status())) return local_map;
  return absl::InvalidArgumentError(local_map.status().message());
}

std::string ContentHashOf(const ScanHeader& header, absl::string_view bytes) {
  ContentHasher all;
  all.Add(ScanHasher().Digest(header));
  all.Add(bytes);
  return all.HexDigest();
}

absl::StatusOr<ScanAck> Commit(Map& map,
                               ScanRecord record,
                               absl::string_view bytes,
                               StorageWriter& writer) {
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, writer.reader().GetClock());
  STRATA_ASSIGN_OR_RETURN(const std::optional<PosedScan> present,
                          writer.reader().FindScan(record.header.id, clock.epoch));
  if (present.has_value()) {
    if (present->scan.content_hash != record.content_hash) {
      return absl::AlreadyExistsError("exists with other content");
    }
    return ScanAck{record.header.id, present->scan.number, true, record.content_hash};
  }
  STRATA_RETURN_IF_ERROR(map.CheckRoomForPending());
  STRATA_ASSIGN_OR_RETURN(record.number, writer.NextCommitSequence());
  STRATA_RETURN_IF_ERROR(writer.PutScan(record));
  STRATA_RETURN_IF_ERROR(writer.DropPoints(record.number, bytes));
  STRATA_RETURN_IF_ERROR(
      writer.SetFootprint(record.number, FootprintOf(record.box_scan, record.header.T_map_scan)));
  return ScanAck{record.header.id, record.number, false, record.content_hash};
}

}  // namespace

absl::StatusOr<ScanAck> UploadLocalMap(Map& map,
                                       const api::Call& call,
                                       const ScanHeader& header,
                                       const MlsParameters& parameters,
                                       absl::string_view bytes) {
  STRATA_RETURN_IF_ERROR(CheckHeader(header));
  STRATA_RETURN_IF_ERROR(CheckParameters(map.core().info().parameters.mls, parameters));
  STRATA_ASSIGN_OR_RETURN(const MlsMap local_map, Decode(bytes, parameters));
  ScanRecord record;
  record.header = header;
  record.upload = map.core().NextUpload();
  record.content_hash = ContentHashOf(header, bytes);
  STRATA_ASSIGN_OR_RETURN(record.box_scan, BoxOf(local_map));
  if (!header.content_hash.empty() && header.content_hash != record.content_hash) {
    return absl::InvalidArgumentError(absl::StrCat("content_hash of what arrived is ",
                                                   record.content_hash,
                                                   ", but the header announced ",
                                                   header.content_hash));
  }
  ScanAck ack;
  STRATA_RETURN_IF_ERROR(map.core().writer().Run(
      Durability::kFull,
      bytes.size(),
      call.stop,
      [&](StorageWriter& writer) -> absl::Status {
        STRATA_ASSIGN_OR_RETURN(ack, Commit(map, record, bytes, writer));
        return absl::OkStatus();
      },
      [&] {
        if (!ack.already_present) map.core().changes().Add(ack.commit_sequence, {ack.id}, {});
      }));
  if (!ack.already_present) map.ScanCommitted();
  return ack;
}

}  // namespace strata
