#include "core/engine/doors/local_map_upload.h"

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
#include "core/engine/ingest/scan_draft.h"
#include "core/engine/map/map_core.h"
#include "core/engine/scans/scan_source.h"
#include "core/engine/tiles/mls_tiles.h"
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

absl::Status CheckSize(absl::string_view bytes) {
  if (bytes.size() <= api::kMaxLocalMapBytes) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat(
      "local map of ", bytes.size(), " bytes; at most ", api::kMaxLocalMapBytes, ", split it"));
}

// Reads the local map tile by tile: of what hostile bytes become only one is held at a time. The
// box around its surfaces in the scan frame.
absl::StatusOr<Eigen::AlignedBox3f> BoxOf(absl::string_view bytes,
                                          const MlsParameters& parameters) {
  constexpr double kMaxCoordinateM = 1e6;
  Eigen::AlignedBox3d box;
  std::size_t tiles = 0;
  const absl::Status visited =
      VisitLocalMap(bytes, kUploadedLocalMap, [&](const MlsTile& tile) -> absl::Status {
        if (++tiles > kMaxScanTiles) {
          return absl::InvalidArgumentError(
              absl::StrCat("local map of more than ", kMaxScanTiles, " tiles; split it"));
        }
        if (tile.key.level != 0) {
          return absl::InvalidArgumentError(absl::StrCat(
              "local map: a tile of level ", tile.key.level, "; its tiles have level 0"));
        }
        box.extend(BoxOf(tile, parameters.cell_size_m));
        return absl::OkStatus();
      });
  if (absl::IsDataLoss(visited)) return absl::InvalidArgumentError(visited.message());
  STRATA_RETURN_IF_ERROR(visited);
  if (!box.isEmpty() && box.min().cwiseMin(-box.max()).minCoeff() < -kMaxCoordinateM) {
    return absl::InvalidArgumentError("local map: reaches beyond ±1e6 m");
  }
  Eigen::AlignedBox3f rounded;
  if (!box.isEmpty()) rounded.extend(box.min().cast<float>()).extend(box.max().cast<float>());
  return rounded;
}

std::string ContentHashOf(const ScanHeader& header, absl::string_view bytes) {
  ContentHasher all;
  all.Add(ScanHasher().Digest(header));
  all.Add(bytes);
  return all.HexDigest();
}

absl::StatusOr<ScanRecord> RecordOf(const MlsParameters& of_map,
                                    const ScanHeader& header,
                                    const MlsParameters& parameters,
                                    absl::string_view bytes) {
  STRATA_RETURN_IF_ERROR(CheckHeader(header));
  STRATA_RETURN_IF_ERROR(CheckParameters(of_map, parameters));
  STRATA_RETURN_IF_ERROR(CheckSize(bytes));
  ScanRecord record;
  record.header = header;
  record.upload = MapCore::NextUpload();
  record.content_hash = ContentHashOf(header, bytes);
  STRATA_ASSIGN_OR_RETURN(record.box_scan, BoxOf(bytes, parameters));
  if (!header.content_hash.empty() && header.content_hash != record.content_hash) {
    return absl::InvalidArgumentError(absl::StrCat("content_hash of what arrived is ",
                                                   record.content_hash,
                                                   ", but the header announced ",
                                                   header.content_hash));
  }
  return record;
}

absl::StatusOr<ScanAck> Commit(StorageWriter& writer,
                               ScanRecord record,
                               absl::string_view bytes,
                               ScanDraft::CheckRoom check_room) {
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, writer.reader().GetClock());
  STRATA_ASSIGN_OR_RETURN(const std::optional<PosedScan> present,
                          writer.reader().FindScan(record.header.id, clock.epoch));
  if (present.has_value()) {
    if (present->scan.content_hash != record.content_hash) {
      return absl::AlreadyExistsError("exists with other content");
    }
    return ScanAck{record.header.id, present->scan.number, true, record.content_hash};
  }
  STRATA_RETURN_IF_ERROR(check_room());
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
  STRATA_ASSIGN_OR_RETURN(const ScanRecord record,
                          RecordOf(map.core().info().parameters.mls, header, parameters, bytes));
  const auto check_room = [&map] { return map.CheckRoomForPending(); };
  ScanAck ack;
  STRATA_RETURN_IF_ERROR(map.core().writer().Run(
      Durability::kFull,
      bytes.size(),
      call.stop,
      [&](StorageWriter& writer) -> absl::Status {
        STRATA_ASSIGN_OR_RETURN(ack, Commit(writer, record, bytes, check_room));
        return absl::OkStatus();
      },
      [&] {
        if (ack.already_present) return;
        map.core().changes().Add(ack.commit_sequence, {ack.id}, {});
        map.ScanCommitted(ack.commit_sequence);
      }));
  return ack;
}

absl::StatusOr<ScanAck> UploadLocalMapBeside(MapStorage& store,
                                             const ScanHeader& header,
                                             const MlsParameters& parameters,
                                             absl::string_view bytes) {
  StorageWriter& writer = store.writer();
  STRATA_ASSIGN_OR_RETURN(const MapInfo info, writer.reader().GetMapInfo());
  STRATA_ASSIGN_OR_RETURN(const ScanRecord record,
                          RecordOf(info.parameters.mls, header, parameters, bytes));
  const auto has_room = [] { return absl::OkStatus(); };  // PutScan() asks
  ScanAck ack;
  STRATA_RETURN_IF_ERROR(writer.Commit(Durability::kFull, [&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(ack, Commit(writer, record, bytes, has_room));
    return absl::OkStatus();
  }));
  return ack;
}

}  // namespace strata
