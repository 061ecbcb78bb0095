#include "core/engine/jobs/job_handlers.h"

#include <cstdint>

#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/engine/consistency/optimize.h"
#include "core/engine/consistency/revert.h"
#include "core/engine/ingest/integrator.h"
#include "core/engine/jobs/job_changes.h"
#include "core/engine/labels/classifier_store.h"
#include "core/engine/labels/classify.h"
#include "core/engine/labels/fade.h"
#include "core/engine/labels/train.h"
#include "core/engine/models/plane_models.h"
#include "core/engine/objects/completion.h"
#include "core/engine/objects/entities.h"
#include "core/engine/repair/rebuild.h"
#include "core/world/job_kinds.h"

namespace strata {
namespace {

absl::Status NeedsNothing(StorageReader&, const JobArguments&) { return absl::OkStatus(); }

absl::Status NeedsPoints(StorageReader& reader, const JobArguments&) {
  STRATA_ASSIGN_OR_RETURN(const MapInfo info, reader.GetMapInfo());
  if (info.parameters.keep_points) return absl::OkStatus();
  return absl::FailedPreconditionError(
      "the map drops points, and the job looks at them and along the rays to them");
}

absl::Status NeedsPointsAndClass(StorageReader& reader, const JobArguments& arguments) {
  STRATA_ASSIGN_OR_RETURN(const MapInfo info, reader.GetMapInfo());
  if (info.parameters.keep_points) return CheckObjectsJob(reader, arguments);
  return absl::FailedPreconditionError(
      "the map drops points after their integration, and objects are found in points; make a map "
      "that keeps them (map create without --drop-points) and import the scans again");
}

absl::Status NeedsClassifier(StorageReader& reader, const JobArguments& arguments) {
  return FindClassifier(reader, arguments.Text("model")).status();
}

absl::Status NeedsFreeName(StorageReader& reader, const JobArguments& arguments) {
  STRATA_ASSIGN_OR_RETURN(const TrainSettings settings, ParseTrainSettings(arguments));
  if (settings.name.empty()) return absl::OkStatus();
  if (absl::IsNotFound(FindClassifier(reader, settings.name).status())) return absl::OkStatus();
  return absl::AlreadyExistsError(
      absl::StrCat("classifier ", settings.name, " exists; choose another name, or delete it"));
}

// On the worker's thread, between its batches.
absl::Status RunOnWorker(const JobRun& run, Worker::Command command) {
  return run.worker->Execute(
      run.context.stop(), command, absl::StrCat("job ", run.job.id, " (", run.job.kind, ")"));
}

absl::Status RunRebuild(const JobRun& run) {
  const int threads = ThreadsOf(run.arguments, run.core.options());
  return RunOnWorker(
      run, [&](Integrator& integrator) { return RunRebuildJob(integrator, threads, run.context); });
}

absl::Status RunVerify(const JobRun& run) {
  if (run.worker == nullptr) {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, run.core.Reader());
    STRATA_ASSIGN_OR_RETURN(const MapClock clock, reader->GetClock());
    if (!clock.derived_complete) return absl::UnavailableError("its tiles are being made again");
  } else {
    // A map whose tiles are not usable makes them before it takes commands.
    STRATA_RETURN_IF_ERROR(RunOnWorker(run, [](Integrator&) { return absl::OkStatus(); }));
  }
  return RunVerifyJob(run.core, ThreadsOf(run.arguments, run.core.options()), run.context);
}

absl::Status RunOptimize(const JobRun& run) {
  return RunOptimizeJob(run.core, run.worker, run.job, run.arguments, run.context);
}

absl::Status RunRevert(const JobRun& run) {
  const auto epoch = static_cast<std::uint64_t>(run.arguments.Whole("epoch"));
  return RunOnWorker(run, [&](Integrator& integrator) {
    return RunRevertJob(integrator, run.job, epoch, run.context);
  });
}

absl::Status RunTrain(const JobRun& run) {
  return RunTrainJob(run.core, run.job, run.arguments, run.context);
}

absl::Status RunClassify(const JobRun& run) {
  return RunClassifyJob(run.core, *run.worker, run.arguments.Text("model"), run.context);
}

absl::Status RunEvaluate(const JobRun& run) {
  return RunEvaluateJob(run.core, run.arguments.Text("model"), run.context);
}

absl::Status RunPlanes(const JobRun& run) {
  return RunPlanesJob(run.core, run.job, run.arguments, run.context);
}

absl::Status RunObjects(const JobRun& run) {
  return RunObjectsJob(run.core, run.job, run.arguments, run.context);
}

absl::Status RunComplete(const JobRun& run) {
  return RunCompleteJob(run.core, run.job, run.arguments, run.context);
}

absl::Status RunFade(const JobRun& run) {
  return RunFadeJob(run.core, *run.worker, run.arguments, run.context);
}

}  // namespace

const std::vector<JobHandler>& JobHandlers() {
  static const auto* const handlers = new std::vector<JobHandler>{
      {kRebuildJob, NeedsNothing, RunRebuild},
      {kVerifyJob, NeedsNothing, RunVerify, /*anywhere=*/true},
      {kOptimizeJob, NeedsNothing, RunOptimize, /*anywhere=*/true},
      {kRevertJob, NeedsNothing, RunRevert},
      {kTrainJob, NeedsFreeName, RunTrain, /*anywhere=*/true},
      {kClassifyJob, NeedsClassifier, RunClassify},
      {kEvaluateJob, NeedsClassifier, RunEvaluate, /*anywhere=*/true},
      {kFadeJob, NeedsPoints, RunFade},
      {kPlanesJob, NeedsPoints, RunPlanes, /*anywhere=*/true},
      {kObjectsJob, NeedsPointsAndClass, RunObjects, /*anywhere=*/true},
      {kCompleteJob, NeedsPoints, RunComplete, /*anywhere=*/true},
  };
  return *handlers;
}

bool RunsAnywhere(absl::string_view kind) {
  const absl::StatusOr<const JobHandler*> handler = FindJobHandler(kind);
  return handler.ok() && (*handler)->anywhere;
}

bool RunsAnywhere(const JobInfo& job) { return RunsAnywhere(job.kind) && !IsAccepted(job); }

absl::Status RunHandler(MapCore& core, Worker* worker, const JobInfo& job, JobContext& context) {
  STRATA_ASSIGN_OR_RETURN(const JobHandler* const handler, FindJobHandler(job.kind));
  JobParameters parameters = job.parameters;
  // Of no kind.
  parameters.erase(kAccepted);
  parameters.erase(kRunBy);
  STRATA_ASSIGN_OR_RETURN(const JobArguments arguments, ReadJobArguments(job.kind, parameters));
  return handler->run({core, worker, job, arguments, context});
}

absl::StatusOr<const JobHandler*> FindJobHandler(absl::string_view kind) {
  for (const JobHandler& handler : JobHandlers()) {
    if (handler.kind == kind) return &handler;
  }
  return absl::InvalidArgumentError(
      absl::StrCat("job kind '", kind.substr(0, 100), "' is unknown"));
}

}  // namespace strata
