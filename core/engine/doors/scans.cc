#include "core/engine/doors/scans.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/common/status.h"
#include "core/engine/doors/local_map_upload.h"
#include "core/engine/doors/map_reading.h"
#include "core/engine/doors/upload.h"
#include "core/engine/ingest/edits.h"
#include "core/engine/ingest/upload_beside.h"
#include "core/engine/map/scan_lookup.h"
#include "core/engine/scans/scan_labels.h"
#include "core/engine/scans/scan_source.h"
#include "core/world/map_class.h"
#include "core/world/names.h"

namespace strata {
namespace {

constexpr std::uint32_t kPageScans = 256;

absl::Status CheckId(const ScanId& id) { return ValidateName("trajectory name", id.trajectory); }

absl::StatusOr<PosedScan> FindScan(const MapReading& map, const Stop& stop, const ScanId& id) {
  STRATA_RETURN_IF_ERROR(CheckId(id));
  PosedScan posed;
  STRATA_RETURN_IF_ERROR(
      map.Read(stop, [&](StorageReader& reader, const MapClock& clock) -> absl::Status {
        STRATA_ASSIGN_OR_RETURN(posed, GetScanById(reader, id, clock.epoch));
        return absl::OkStatus();
      }));
  return posed;
}

// Who edits a scan that is not there does not wait behind what the worker is at to hear of it.
absl::Status CheckThere(const EngineMaps::Place& place, const ScanId& id) {
  STRATA_RETURN_IF_ERROR(CheckId(id));
  return place.Read([&](StorageReader& reader) { return GetScanById(reader, id, 0).status(); });
}

absl::StatusOr<ScanQuery> ToQuery(const api::ScanFilter& filter) {
  ScanQuery query;
  if (filter.trajectory.has_value()) {
    STRATA_RETURN_IF_ERROR(ValidateName("trajectory name", *filter.trajectory));
  }
  if (filter.box.has_value() &&
      !(filter.box->min().allFinite() && filter.box->max().allFinite() && !filter.box->isEmpty())) {
    return absl::InvalidArgumentError("box: not finite, or its minimum is beyond its maximum");
  }
  query.trajectory = filter.trajectory;
  query.state = filter.state;
  query.from = filter.from;
  query.until = filter.until;
  query.box = filter.box;
  query.limit = kPageScans;
  return query;
}

absl::StatusOr<PointCloud> ReadPiece(const MapReading& map,
                                     const ScanRecord& scan,
                                     std::uint32_t ordinal,
                                     ScanLabels& labels) {
  PointCloud piece;
  STRATA_RETURN_IF_ERROR(map.ReadState([&](StorageReader& reader, const MapClock&) -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(piece, ReadPoints(reader, scan, ordinal));
    return labels.Apply(reader, piece);
  }));
  piece.sensor_origin = scan.header.sensor_origin;
  return piece;
}

absl::Status WithoutPoints(const MapReading& map, absl::string_view what) {
  MapInfo info;
  STRATA_RETURN_IF_ERROR(map.ReadState(
      [&](StorageReader& reader, const MapClock&) { return AssignTo(reader.GetMapInfo(), info); }));
  return absl::FailedPreconditionError(absl::StrCat(
      what,
      info.parameters.keep_points ? ": it was sent as a local map, without points"
                                  : ": the map drops points once a scan is integrated"));
}

}  // namespace

ScanInfo ToScanInfo(const PosedScan& posed) {
  ScanInfo info;
  info.header = posed.scan.header;
  info.state = posed.scan.state;
  info.T_map_scan = posed.pose.has_value() ? posed.pose->T_map_scan : info.header.T_map_scan;
  info.commit_sequence = posed.scan.number;
  info.point_bytes = posed.scan.point_bytes;
  info.content_hash = posed.scan.content_hash;
  info.message = posed.scan.message;
  if (posed.pose.has_value()) info.alignment = posed.pose->report;
  info.person_labels = posed.scan.person_labels;
  info.label_model = posed.scan.label_model;
  info.faded_points = posed.scan.faded_points;
  return info;
}

absl::StatusOr<std::unique_ptr<api::ScanUpload>> EngineScans::Upload(const api::Call& call,
                                                                     absl::string_view map,
                                                                     const ScanHeader& header) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(EngineMaps::Place found, maps_.FindToAdd(call.stop, map));
  STRATA_RETURN_IF_ERROR(ValidateScanHeader(header));
  const std::uint64_t most = maps_.options().max_points_per_scan;
  if (header.point_count > most) {
    return absl::InvalidArgumentError(absl::StrCat("scan ",
                                                   header.id.ToString(),
                                                   ": ",
                                                   header.point_count,
                                                   " points; at most ",
                                                   most,
                                                   ", split it"));
  }
  if (found.map != nullptr) return EngineUpload::Begin(std::move(found.map), call, header);
  return UploadBeside::Begin(std::move(found.store), call, header);
}

absl::StatusOr<ScanAck> EngineScans::UploadLocalMap(const api::Call& call,
                                                    absl::string_view map,
                                                    const ScanHeader& header,
                                                    const MlsParameters& parameters,
                                                    absl::string_view local_map) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const EngineMaps::Place found, maps_.FindToAdd(call.stop, map));
  STRATA_RETURN_IF_ERROR(ValidateScanHeader(header));
  absl::StatusOr<ScanAck> ack =
      found.map != nullptr ? strata::UploadLocalMap(*found.map, call, header, parameters, local_map)
                           : UploadLocalMapBeside(*found.store, header, parameters, local_map);
  if (ack.ok()) return ack;
  return Annotate(ack.status(), absl::StrCat("scan ", header.id.ToString()));
}

absl::StatusOr<UploadState> EngineScans::GetUploadState(const api::Call& call,
                                                        absl::string_view map,
                                                        absl::string_view trajectory) {
  STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindToRead(call, map));
  STRATA_RETURN_IF_ERROR(ValidateName("trajectory name", trajectory));
  UploadState state;
  STRATA_RETURN_IF_ERROR(found.ReadState([&](StorageReader& reader, const MapClock&) {
    return AssignTo(reader.GetUploadState(trajectory), state);
  }));
  return state;
}

absl::StatusOr<ScanInfo> EngineScans::Get(const api::Call& call,
                                          absl::string_view map,
                                          const ScanId& id) {
  STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindToRead(call, map));
  STRATA_ASSIGN_OR_RETURN(const PosedScan scan, FindScan(found, call.stop, id));
  return ToScanInfo(scan);
}

absl::Status EngineScans::List(const api::Call& call,
                               absl::string_view map,
                               const api::ScanFilter& filter,
                               absl::FunctionRef<absl::Status(const ScanInfo&)> sink) {
  STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindToRead(call, map));
  STRATA_ASSIGN_OR_RETURN(ScanQuery query, ToQuery(filter));
  std::optional<Snapshots::Pin> pin;
  if (found.map() != nullptr) pin.emplace(found.map()->core().snapshots().PinCurrent());
  std::uint64_t epoch = pin.has_value() ? pin->view().epoch : 0;
  absl::Status damaged;  // the first that cannot be read; it hides no other
  while (true) {
    STRATA_RETURN_IF_ERROR(call.stop.status());
    std::vector<PosedScan> page;
    STRATA_RETURN_IF_ERROR(
        found.Read(call.stop, [&](StorageReader& reader, const MapClock& clock) -> absl::Status {
          if (epoch == 0) epoch = clock.epoch;
          absl::StatusOr<std::vector<PosedScan>> read = reader.ListScans(query, epoch);
          if (absl::IsDataLoss(read.status()) && !query.skip_damaged) {
            damaged = read.status();
            query.skip_damaged = true;
            read = reader.ListScans(query, epoch);
          }
          STRATA_ASSIGN_OR_RETURN(page, std::move(read));
          return absl::OkStatus();
        }));
    for (PosedScan& posed : page) {
      // It came into the map in a later epoch than the one listed, in which it waits.
      if (posed.scan.state == ScanState::kIntegrated && !posed.pose.has_value()) {
        posed.scan.state = ScanState::kPending;
      }
      STRATA_RETURN_IF_ERROR(sink(ToScanInfo(posed)));
    }
    if (page.size() < query.limit) return damaged;
    query.after = page.back().scan.number;
  }
}

absl::Status EngineScans::GetPoints(const api::Call& call,
                                    absl::string_view map,
                                    const ScanId& id,
                                    absl::FunctionRef<absl::Status(const PointCloud&)> sink) {
  STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindToRead(call, map));
  STRATA_ASSIGN_OR_RETURN(PosedScan posed, FindScan(found, call.stop, id));
  const std::string what = absl::StrCat("scan ", id.ToString());
  if (!posed.scan.has_points) return WithoutPoints(found, what);
  std::optional<ScanLabels> labels;  // all as of one moment, however long the points take
  STRATA_RETURN_IF_ERROR(
      found.ReadState([&](StorageReader& reader, const MapClock& clock) -> absl::Status {
        STRATA_ASSIGN_OR_RETURN(posed, reader.GetScan(posed.scan.number, clock.epoch));
        labels.emplace(posed.scan, LabelView());
        return Annotate(labels->Hold(reader), what);
      }));
  for (std::uint32_t ordinal = 0; ordinal < posed.scan.chunks; ++ordinal) {
    STRATA_RETURN_IF_ERROR(call.stop.status());
    const absl::StatusOr<PointCloud> piece = ReadPiece(found, posed.scan, ordinal, *labels);
    if (!piece.ok()) {
      // Deleted or dropped while we were reading?
      STRATA_ASSIGN_OR_RETURN(const PosedScan now, FindScan(found, call.stop, id));
      if (now.scan.number != posed.scan.number) {
        return absl::AbortedError(
            absl::StrCat(what, " was deleted and sent anew meanwhile; ask again"));
      }
      if (!now.scan.has_points)
        return absl::FailedPreconditionError(absl::StrCat(what, ": points dropped"));
      return Annotate(piece.status(), absl::StrCat(what, ", piece ", ordinal));
    }
    STRATA_RETURN_IF_ERROR(sink(*piece));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<std::uint16_t>> EngineScans::GetFaded(const api::Call& call,
                                                                 absl::string_view map,
                                                                 const ScanId& id) {
  STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindToRead(call, map));
  STRATA_ASSIGN_OR_RETURN(const PosedScan posed, FindScan(found, call.stop, id));
  std::vector<std::uint16_t> faded;
  if (posed.scan.faded_points == 0) return faded;
  const absl::Status read = found.ReadState([&](StorageReader& reader, const MapClock&) {
    return AssignTo(ReadLabels(reader, posed.scan, LabelOrigin::kFaded), faded);
  });
  if (!read.ok()) return Annotate(read, absl::StrCat("scan ", id.ToString()));
  return faded;
}

absl::Status EngineScans::SetLabels(const api::Call& call,
                                    absl::string_view map,
                                    const ScanId& id,
                                    const std::vector<std::uint16_t>& labels,
                                    api::LabelMode mode) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const EngineMaps::Place place, maps_.FindToAdd(call.stop, map));
  STRATA_RETURN_IF_ERROR(CheckId(id));
  STRATA_RETURN_IF_ERROR(Annotate(ValidateLabels(labels), absl::StrCat("scan ", id.ToString())));
  STRATA_RETURN_IF_ERROR(CheckThere(place, id));
  return maps_.Edit(
      call.stop, map, place, SettingLabels(id, labels, mode == api::LabelMode::kUpdate));
}

absl::Status EngineScans::Delete(const api::Call& call, absl::string_view map, const ScanId& id) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const EngineMaps::Place place, maps_.FindToAdd(call.stop, map));
  STRATA_RETURN_IF_ERROR(CheckThere(place, id));
  return maps_.Edit(call.stop, map, place, DeletingScan(id));
}

}  // namespace strata
