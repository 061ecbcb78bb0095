#include "core/engine/doors/posegraph.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/common/status.h"
#include "core/engine/consistency/followed_robot.h"
#include "core/engine/doors/map_reading.h"
#include "core/engine/doors/scans.h"
#include "core/engine/ingest/edits.h"
#include "core/engine/map/scan_lookup.h"
#include "core/world/names.h"

namespace strata {
namespace {

absl::Status AddNodes(StorageReader& reader, api::PoseGraphState& state) {
  return ForEachScan(reader, ScanQuery(), state.epoch, [&](const PosedScan& posed) {
    const ScanInfo info = ToScanInfo(posed);
    state.nodes.push_back(
        {info.header.id, info.header.time, info.state, info.header.T_map_scan, info.T_map_scan});
  });
}

absl::StatusOr<ScanNumber> NumberOf(StorageReader& reader, const ScanId& id) {
  STRATA_ASSIGN_OR_RETURN(const PosedScan posed, GetScanById(reader, id, 0));
  return posed.scan.number;
}

// In the epoch that `lookup` names.
absl::Status LookUp(StorageReader& reader, const ScanId& id, api::PoseLookup& lookup) {
  STRATA_ASSIGN_OR_RETURN(const PosedScan posed, GetScanById(reader, id, lookup.epoch));
  const ScanInfo info = ToScanInfo(posed);
  lookup.T_map_scan = info.T_map_scan;
  lookup.known = info.state == ScanState::kIntegrated;
  if (info.state == ScanState::kFailed) {
    lookup.message = absl::StrCat("could not be integrated: ", info.message);
  } else if (!lookup.known) {
    STRATA_ASSIGN_OR_RETURN(const ScanTotals totals, reader.GetScanTotals());
    lookup.message = absl::StrCat("waits for integration, one of ", totals.pending, " scans");
  }
  return absl::OkStatus();
}

}  // namespace

// Each step is by the map as it is then, whoever has it: it may come here meanwhile, or go.
class EnginePoseGraph::Following final : public api::Tracking {
 public:
  Following(EnginePoseGraph& door, MapReading found, const api::Call& call, const TrackStart& start)
      : door_(door), found_(std::move(found)), call_(call), robot_(start) {}

  absl::StatusOr<TrackedPose> Step(const TrackStep& step) override {
    STRATA_RETURN_IF_ERROR(call_.stop.status());
    STRATA_ASSIGN_OR_RETURN(found_, door_.maps_.FindToRead(call_, found_.name()));
    if (Map* const map = found_.map(); map != nullptr) {
      return Step(step, map->core().info().parameters, map->surfaces(), map->localizer());
    }
    STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Elsewhere> elsewhere,
                            door_.FindElsewhere(call_, found_));
    return Step(step, elsewhere->parameters, elsewhere->surfaces, elsewhere->localizer);
  }

 private:
  absl::StatusOr<TrackedPose> Step(const TrackStep& step,
                                   const MapParameters& parameters,
                                   SurfacesAround& surfaces,
                                   Localizer& localizer) {
    TrackedPose pose;
    STRATA_RETURN_IF_ERROR(found_.ReadMapTiles(MapState::kNoChanges, [&](MapState& state) {
      return AssignTo(robot_.Step(step, {parameters, surfaces, localizer, state}, call_.stop),
                      pose);
    }));
    return pose;
  }

  EnginePoseGraph& door_;
  MapReading found_;  // keeps a map that is here in use between steps
  const api::Call call_;
  FollowedRobot robot_;
};

absl::StatusOr<api::PoseGraphState> EnginePoseGraph::Get(const api::Call& call,
                                                         absl::string_view map) {
  STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindToRead(call, map));
  api::PoseGraphState state;
  const auto read = [&](StorageReader& reader, const MapClock& clock) -> absl::Status {
    state.epoch = clock.epoch;
    STRATA_RETURN_IF_ERROR(AddNodes(reader, state));
    STRATA_ASSIGN_OR_RETURN(std::vector<ConstraintRecord> records,
                            reader.ListConstraints(clock.epoch));
    for (ConstraintRecord& record : records) {
      state.constraints.push_back(std::move(record.constraint));
    }
    STRATA_ASSIGN_OR_RETURN(std::vector<PlaneRecord> planes, reader.ListPlanes(clock.epoch));
    for (PlaneRecord& record : planes) state.planes.push_back(std::move(record.plane));
    return absl::OkStatus();
  };
  STRATA_RETURN_IF_ERROR(found.Read(call.stop, read));
  return state;
}

absl::Status EnginePoseGraph::SetPose(const api::Call& call,
                                      absl::string_view map,
                                      const ScanId& id,
                                      const Pose& T_map_scan) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const EngineMaps::Place place, maps_.FindToAdd(call.stop, map));
  STRATA_RETURN_IF_ERROR(ValidateName("trajectory name", id.trajectory));
  if (const absl::Status valid = ValidatePose(T_map_scan); !valid.ok()) {
    return Annotate(valid, absl::StrCat("scan ", id.ToString()));
  }
  // Here, too: to hear of it nobody waits behind what the worker is at.
  STRATA_RETURN_IF_ERROR(
      place.Read([&](StorageReader& reader) { return NumberOf(reader, id).status(); }));
  return maps_.Edit(call.stop, map, place, SettingPose(id, T_map_scan));
}

absl::StatusOr<Constraint> EnginePoseGraph::AddConstraint(const api::Call& call,
                                                          absl::string_view map,
                                                          const Constraint& constraint) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const EngineMaps::Place place, maps_.FindToAdd(call.stop, map));
  STRATA_RETURN_IF_ERROR(ValidateConstraint(constraint));
  ConstraintRecord record;
  record.constraint = constraint;
  record.constraint.origin = ConstraintOrigin::kPerson;
  STRATA_RETURN_IF_ERROR(place.Commit(call.stop, [&](StorageWriter& writer) -> absl::Status {
    if (!constraint.is_prior()) {
      STRATA_ASSIGN_OR_RETURN(record.scan_i, NumberOf(writer.reader(), constraint.i));
    }
    STRATA_ASSIGN_OR_RETURN(record.scan_j, NumberOf(writer.reader(), constraint.j));
    STRATA_ASSIGN_OR_RETURN(record.constraint.id, writer.PutConstraint(record));
    return absl::OkStatus();
  }));
  return record.constraint;
}

absl::Status EnginePoseGraph::RemoveConstraint(const api::Call& call,
                                               absl::string_view map,
                                               std::uint64_t id) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const EngineMaps::Place place, maps_.FindToAdd(call.stop, map));
  return place.Commit(call.stop, [&](StorageWriter& writer) -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(const MapClock clock, writer.reader().GetClock());
    STRATA_ASSIGN_OR_RETURN(const std::vector<PlaneRecord> planes,
                            writer.reader().ListPlanes(clock.epoch));
    for (const PlaneRecord& record : planes) {
      if (record.plane.id != id) continue;
      return absl::FailedPreconditionError(absl::StrCat(
          "constraint ", id, " is a plane, which the next job would find again; disable it"));
    }
    return writer.DeleteConstraint(id);
  });
}

absl::Status EnginePoseGraph::EnableConstraint(const api::Call& call,
                                               absl::string_view map,
                                               std::uint64_t id,
                                               bool enabled) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const EngineMaps::Place place, maps_.FindToAdd(call.stop, map));
  return place.Commit(call.stop,
                      [&](StorageWriter& writer) { return writer.EnableConstraint(id, enabled); });
}

absl::StatusOr<api::PoseLookup> EnginePoseGraph::LookupPose(const api::Call& call,
                                                            absl::string_view map,
                                                            const ScanId& id) {
  STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindToRead(call, map));
  STRATA_RETURN_IF_ERROR(ValidateName("trajectory name", id.trajectory));
  std::optional<Snapshots::Pin> pin;
  if (found.map() != nullptr) pin.emplace(found.map()->core().snapshots().PinCurrent());
  api::PoseLookup lookup;
  STRATA_RETURN_IF_ERROR(found.ReadState([&](StorageReader& reader, const MapClock& clock) {
    lookup.epoch = pin.has_value() ? pin->view().epoch : clock.epoch;
    return LookUp(reader, id, lookup);
  }));
  return lookup;
}

absl::StatusOr<std::shared_ptr<EnginePoseGraph::Elsewhere>> EnginePoseGraph::FindElsewhere(
    const api::Call& call, const MapReading& found) {
  const auto make = [&]() -> absl::StatusOr<std::shared_ptr<Elsewhere>> {
    // A store of its own, which outlives the call.
    STRATA_ASSIGN_OR_RETURN(MapReading own, maps_.FindToRead(call, found.name()));
    if (own.map() != nullptr)
      return absl::UnavailableError("the map was just opened here; ask again");
    std::unique_ptr<MapStorage> store = own.TakeStore();
    STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<StorageReader> reader, store->NewReader());
    STRATA_ASSIGN_OR_RETURN(const MapInfo info, reader->GetMapInfo());
    return std::make_shared<Elsewhere>(
        std::move(store), info.parameters, maps_.options(), maps_.caches());
  };
  return elsewhere_.Find(found.name(), found.store()->number(), make);
}

absl::StatusOr<LocalizeResult> EnginePoseGraph::Localize(const api::Call& call,
                                                         absl::string_view map,
                                                         const LocalizeQuery& query) {
  STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindToRead(call, map));
  if (found.map() != nullptr) return found.map()->localizer().Localize(query, call.stop);
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Elsewhere> elsewhere, FindElsewhere(call, found));
  return elsewhere->localizer.Localize(query, call.stop);
}

absl::StatusOr<std::unique_ptr<api::Tracking>> EnginePoseGraph::Track(const api::Call& call,
                                                                      absl::string_view map,
                                                                      const TrackStart& start) {
  STRATA_ASSIGN_OR_RETURN(MapReading found, maps_.FindToRead(call, map));
  STRATA_RETURN_IF_ERROR(ValidateTrackStart(start));
  return std::make_unique<Following>(*this, std::move(found), call, start);
}

}  // namespace strata
