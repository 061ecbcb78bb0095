#include "core/engine/posegraph.h"

#include <memory>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/common/status.h"
#include "core/engine/scans.h"
#include "core/world/names.h"

namespace strata {
namespace {

absl::Status AddNodes(StorageReader& reader, api::PoseGraphState& state) {
  ScanQuery query;
  while (true) {
    STRATA_ASSIGN_OR_RETURN(const std::vector<PosedScan> page,
                            reader.ListScans(query, state.epoch));
    for (const PosedScan& posed : page) {
      const ScanInfo info = ToScanInfo(posed);
      state.nodes.push_back(
          {info.header.id, info.header.time, info.state, info.header.T_map_scan, info.T_map_scan});
    }
    if (page.size() < query.limit) return absl::OkStatus();
    query.after = page.back().scan.number;
  }
}

}  // namespace

absl::StatusOr<api::PoseGraphState> EnginePoseGraph::Get(const api::Call& call,
                                                         absl::string_view map) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(map));
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, found->core().Reader());
  api::PoseGraphState state;
  const absl::Status read = reader->Snapshot([&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(const MapClock clock, reader->GetClock());
    state.epoch = clock.epoch;
    STRATA_RETURN_IF_ERROR(AddNodes(*reader, state));
    STRATA_ASSIGN_OR_RETURN(std::vector<ConstraintRecord> records, reader->ListConstraints());
    for (ConstraintRecord& record : records) {
      state.constraints.push_back(std::move(record.constraint));
    }
    return absl::OkStatus();
  });
  STRATA_RETURN_IF_ERROR(read);
  return state;
}

absl::Status EnginePoseGraph::SetPose(const api::Call& call,
                                      absl::string_view map,
                                      const ScanId& id,
                                      const Pose& T_map_scan) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(map));
  STRATA_RETURN_IF_ERROR(ValidateName("trajectory name", id.trajectory));
  if (const absl::Status valid = ValidatePose(T_map_scan); !valid.ok()) {
    return Annotate(valid, absl::StrCat("scan ", id.ToString()));
  }
  return found->worker().Execute(
      call.stop, [&](Integrator& integrator) { return integrator.SetPose(id, T_map_scan); });
}

absl::StatusOr<Constraint> EnginePoseGraph::AddConstraint(const api::Call&,
                                                          absl::string_view,
                                                          const Constraint&) {
  return absl::UnimplementedError("add constraint");
}

absl::Status EnginePoseGraph::RemoveConstraint(const api::Call&, absl::string_view, std::uint64_t) {
  return absl::UnimplementedError("remove constraint");
}

absl::Status EnginePoseGraph::EnableConstraint(const api::Call&,
                                               absl::string_view,
                                               std::uint64_t,
                                               bool) {
  return absl::UnimplementedError("enable constraint");
}

absl::StatusOr<api::PoseLookup> EnginePoseGraph::LookupPose(const api::Call&,
                                                            absl::string_view,
                                                            const ScanId&) {
  return absl::UnimplementedError("lookup pose");
}

absl::StatusOr<LocalizeResult> EnginePoseGraph::Localize(const api::Call&,
                                                         absl::string_view,
                                                         const LocalizeQuery&) {
  return absl::UnimplementedError("localize");
}

}  // namespace strata
