#include "core/engine/doors/jobs.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/engine/consistency/revert.h"
#include "core/engine/doors/map_reading.h"
#include "core/engine/jobs/job_beside.h"
#include "core/engine/jobs/job_handlers.h"
#include "core/world/job_arguments.h"
#include "core/world/job_kinds.h"

namespace strata {
namespace {

// Of a map that another engine has: as it last wrote them.
absl::StatusOr<std::vector<JobInfo>> StoredJobs(const MapReading& map) {
  std::vector<JobInfo> jobs;
  STRATA_RETURN_IF_ERROR(map.ReadState(
      [&](StorageReader& reader, const MapClock&) { return AssignTo(reader.ListJobs(), jobs); }));
  return jobs;
}

absl::StatusOr<JobInfo> StoredJob(const MapReading& map, std::uint64_t id) {
  std::optional<JobInfo> job;
  STRATA_RETURN_IF_ERROR(map.ReadState(
      [&](StorageReader& reader, const MapClock&) { return AssignTo(reader.FindJob(id), job); }));
  if (job.has_value()) return *std::move(job);
  return absl::NotFoundError(absl::StrCat("job ", id, " does not exist"));
}

absl::Status Pause(absl::Duration pause, const Stop& stop) {
  constexpr absl::Duration kPoll = absl::Milliseconds(50);
  const absl::Time end = SteadyNow() + pause;
  while (SteadyNow() < end) {
    STRATA_RETURN_IF_ERROR(stop.status());
    absl::SleepFor(std::min(kPoll, end - SteadyNow()));
  }
  return stop.status();
}

}  // namespace

absl::StatusOr<JobInfo> EngineJobs::Start(const api::Call& call,
                                          absl::string_view map,
                                          absl::string_view kind,
                                          const std::map<std::string, std::string>& parameters) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const EngineMaps::Place place, maps_.FindToAdd(call.stop, map));
  STRATA_RETURN_IF_ERROR(maps_.CheckWorked(kind));
  if (place.map == nullptr) return StartJobBeside(*place.store, kind, parameters);
  Map& found = *place.map;
  STRATA_ASSIGN_OR_RETURN(const JobArguments arguments, ReadJobArguments(kind, parameters));
  STRATA_ASSIGN_OR_RETURN(const JobHandler* const handler, FindJobHandler(kind));
  {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, found.core().Reader());
    STRATA_RETURN_IF_ERROR(handler->check(*reader, arguments));
  }
  STRATA_ASSIGN_OR_RETURN(JobInfo info,
                          found.jobs().Start(call.stop, call.principal, kind, parameters));
  found.JobQueued();
  return info;
}

// What another engine has just queued or decided is not known here before the next look at the
// store.
absl::StatusOr<JobInfo> EngineJobs::Find(Map& map, std::uint64_t id) {
  absl::StatusOr<JobInfo> job = map.jobs().Get(id);
  const bool over = job.ok() && IsFinal(job->state) && job->state != JobState::kProposed;
  if (over || !maps_.IsShared()) return job;
  STRATA_RETURN_IF_ERROR(map.TakeInJobs(id));
  return map.jobs().Get(id);
}

absl::StatusOr<JobInfo> EngineJobs::Get(const api::Call& call,
                                        absl::string_view map,
                                        std::uint64_t id) {
  STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindToRead(call, map));
  if (found.map() != nullptr) return Find(*found.map(), id);
  return StoredJob(found, id);
}

absl::StatusOr<std::vector<JobInfo>> EngineJobs::List(const api::Call& call,
                                                      absl::string_view map) {
  STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindToRead(call, map));
  if (found.map() == nullptr) return StoredJobs(found);
  if (maps_.IsShared()) STRATA_RETURN_IF_ERROR(found.map()->TakeInJobs());
  return found.map()->jobs().List();
}

absl::StatusOr<JobInfo> EngineJobs::Cancel(const api::Call& call,
                                           absl::string_view map,
                                           std::uint64_t id) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const EngineMaps::Place place, maps_.FindToAdd(call.stop, map));
  if (place.map == nullptr) return CancelJobBeside(*place.store, id);
  STRATA_RETURN_IF_ERROR(Find(*place.map, id).status());
  return place.map->jobs().Cancel(id);
}

absl::StatusOr<JobInfo> EngineJobs::Accept(const api::Call& call,
                                           absl::string_view map,
                                           std::uint64_t id) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const EngineMaps::Place place, maps_.FindToAdd(call.stop, map));
  if (place.map == nullptr) return AcceptJobBeside(*place.store, id);
  STRATA_ASSIGN_OR_RETURN(JobInfo info, place.map->jobs().Accept(id));
  place.map->JobQueued();
  return info;
}

absl::StatusOr<JobInfo> EngineJobs::Revert(const api::Call& call,
                                           absl::string_view map,
                                           std::uint64_t id) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const EngineMaps::Place place, maps_.FindToAdd(call.stop, map));
  if (place.map == nullptr) return RevertJobBeside(*place.store, id);
  Map& found = *place.map;
  STRATA_ASSIGN_OR_RETURN(const JobInfo job, Find(found, id));
  if (job.state == JobState::kProposed) return found.jobs().Discard(id);
  STRATA_RETURN_IF_ERROR(CheckNoneReverts(found.jobs().List()));
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t epoch,
                          EpochBefore(job, found.core().snapshots().current().epoch));
  STRATA_ASSIGN_OR_RETURN(
      JobInfo revert,
      found.jobs().Start(call.stop, call.principal, kRevertJob, {{"epoch", absl::StrCat(epoch)}}));
  found.JobQueued();
  return revert;
}

absl::Status EngineJobs::Watch(const api::Call& call,
                               absl::string_view map,
                               std::uint64_t id,
                               absl::FunctionRef<absl::Status(const JobInfo&)> sink) {
  absl::Time told = absl::InfinitePast();
  while (true) {
    STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindToRead(call, map));
    if (found.map() != nullptr) {
      STRATA_RETURN_IF_ERROR(Find(*found.map(), id).status());
      return found.map()->jobs().Watch(call.stop, id, sink);
    }
    STRATA_ASSIGN_OR_RETURN(const JobInfo job, StoredJob(found, id));
    if (job.updated != told) STRATA_RETURN_IF_ERROR(sink(job));
    if (IsFinal(job.state)) return absl::OkStatus();
    told = job.updated;
    STRATA_RETURN_IF_ERROR(Pause(api::kWatchLag, call.stop));
  }
}

}  // namespace strata
