#include "core/engine/doors/jobs.h"

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/common/status.h"
#include "core/engine/consistency/optimize_settings.h"
#include "core/engine/consistency/revert.h"
#include "core/engine/labels/classifier_store.h"
#include "core/engine/labels/classify.h"
#include "core/engine/labels/fade.h"
#include "core/engine/labels/train.h"
#include "core/engine/map/job_parameters.h"
#include "core/engine/repair/rebuild.h"
#include "core/world/names.h"

namespace strata {
namespace {

absl::Status CheckThreads(absl::string_view kind, const JobParameters& parameters) {
  for (const auto& [name, value] : parameters) {
    int threads = 0;
    if (name != "threads") {
      return absl::InvalidArgumentError(
          absl::StrCat("job parameter '", name.substr(0, 100), "': ", kind, " takes threads only"));
    }
    if (!absl::SimpleAtoi(value, &threads) || threads < 1 || threads > 64) {
      return absl::InvalidArgumentError(
          absl::StrCat("job parameter threads = '", value.substr(0, 100), "' is not in [1, 64]"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckEpoch(const JobParameters& parameters) {
  std::uint64_t epoch = 0;
  if (parameters.size() == 1 && parameters.begin()->first == "epoch" &&
      absl::SimpleAtoi(parameters.begin()->second, &epoch) && epoch > 0) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(
      absl::StrCat(kRevertJob, " takes the parameter epoch only, as in epoch=1; see map history"));
}

absl::Status CheckModel(absl::string_view kind, const JobParameters& parameters) {
  std::string model;
  STRATA_RETURN_IF_ERROR(ReadJobParameters(kind,
                                           parameters,
                                           {{"model",
                                             {[&model](const std::string& text) {
                                                model = text;
                                                return ValidateName("", text).ok();
                                              },
                                              "the name of a classifier"}}}));
  if (!model.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(kind, " takes the parameter model, as in model=street; see classifier list"));
}

absl::Status CheckJob(absl::string_view kind, const JobParameters& parameters) {
  if (kind == kRebuildJob || kind == kVerifyJob) return CheckThreads(kind, parameters);
  if (kind == kRevertJob) return CheckEpoch(parameters);
  if (kind == kOptimizeJob) return ParseOptimizeSettings(parameters).status();
  if (kind == kTrainJob) return ParseTrainSettings(parameters).status();
  if (kind == kFadeJob) return ParseFadeSettings(parameters).status();
  if (kind == kClassifyJob || kind == kEvaluateJob) return CheckModel(kind, parameters);
  return absl::InvalidArgumentError(absl::StrCat("job kind '",
                                                 kind.substr(0, 100),
                                                 "': use ",
                                                 kRebuildJob,
                                                 ", ",
                                                 kVerifyJob,
                                                 ", ",
                                                 kOptimizeJob,
                                                 ", ",
                                                 kTrainJob,
                                                 ", ",
                                                 kClassifyJob,
                                                 ", ",
                                                 kEvaluateJob,
                                                 ", ",
                                                 kFadeJob,
                                                 " or ",
                                                 kRevertJob));
}

absl::Status CheckPointsKept(MapCore& core, absl::string_view kind) {
  if (kind != kFadeJob || core.info().parameters.keep_points) return absl::OkStatus();
  return absl::FailedPreconditionError(
      "fade: the map drops points; what has faded is told by the rays of scans");
}

// What a job needs that is not there, said before it waits for its turn.
absl::Status CheckClassifiers(MapCore& core,
                              absl::string_view kind,
                              const JobParameters& parameters) {
  if (kind != kTrainJob && kind != kClassifyJob && kind != kEvaluateJob) return absl::OkStatus();
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
  if (kind != kTrainJob) return FindClassifier(*reader, parameters.at("model")).status();
  const auto name = parameters.find("name");
  if (name == parameters.end() || absl::IsNotFound(FindClassifier(*reader, name->second).status()))
    return absl::OkStatus();
  return absl::AlreadyExistsError(
      absl::StrCat("classifier ", name->second, " exists; choose another name, or delete it"));
}

// The epoch before the one that `job` made, which must be the current one.
absl::StatusOr<std::uint64_t> EpochBefore(const JobInfo& job, std::uint64_t current) {
  const auto before = job.metrics.find("epoch_before");
  const auto made = job.metrics.find("epoch");
  if (job.state != JobState::kSucceeded || before == job.metrics.end() ||
      made == job.metrics.end() || made->second == before->second) {
    return absl::FailedPreconditionError(
        absl::StrCat("job ", job.id, " made no epoch that could be reverted"));
  }
  if (made->second != static_cast<double>(current)) {
    return absl::FailedPreconditionError(
        absl::StrCat("job ",
                     job.id,
                     " made epoch ",
                     made->second,
                     ", but the map is at ",
                     current,
                     " by now; name the epoch to go back to: map revert"));
  }
  return static_cast<std::uint64_t>(before->second);
}

}  // namespace

absl::StatusOr<JobInfo> EngineJobs::Start(const api::Call& call,
                                          absl::string_view map,
                                          absl::string_view kind,
                                          const std::map<std::string, std::string>& parameters) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(map));
  STRATA_RETURN_IF_ERROR(CheckJob(kind, parameters));
  STRATA_RETURN_IF_ERROR(CheckPointsKept(found->core(), kind));
  STRATA_RETURN_IF_ERROR(CheckClassifiers(found->core(), kind, parameters));
  STRATA_ASSIGN_OR_RETURN(JobInfo info,
                          found->jobs().Start(call.stop, call.principal, kind, parameters));
  found->JobQueued();
  return info;
}

absl::StatusOr<JobInfo> EngineJobs::Get(const api::Call& call,
                                        absl::string_view map,
                                        std::uint64_t id) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(map));
  return found->jobs().Get(id);
}

absl::StatusOr<std::vector<JobInfo>> EngineJobs::List(const api::Call& call,
                                                      absl::string_view map) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(map));
  return found->jobs().List();
}

absl::StatusOr<JobInfo> EngineJobs::Cancel(const api::Call& call,
                                           absl::string_view map,
                                           std::uint64_t id) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(map));
  return found->jobs().Cancel(id);
}

absl::StatusOr<JobInfo> EngineJobs::Accept(const api::Call& call,
                                           absl::string_view map,
                                           std::uint64_t id) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(map));
  STRATA_ASSIGN_OR_RETURN(JobInfo info, found->jobs().Accept(id));
  found->JobQueued();
  return info;
}

absl::StatusOr<JobInfo> EngineJobs::Revert(const api::Call& call,
                                           absl::string_view map,
                                           std::uint64_t id) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(map));
  STRATA_ASSIGN_OR_RETURN(const JobInfo job, found->jobs().Get(id));
  if (job.state == JobState::kProposed) return found->jobs().Discard(id);
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t epoch,
                          EpochBefore(job, found->core().snapshots().current().epoch));
  STRATA_ASSIGN_OR_RETURN(
      JobInfo revert,
      found->jobs().Start(call.stop, call.principal, kRevertJob, {{"epoch", absl::StrCat(epoch)}}));
  found->JobQueued();
  return revert;
}

absl::Status EngineJobs::Watch(const api::Call& call,
                               absl::string_view map,
                               std::uint64_t id,
                               absl::FunctionRef<absl::Status(const JobInfo&)> sink) {
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(map));
  return found->jobs().Watch(call.stop, id, sink);
}

}  // namespace strata
