// The jobs "train" and "evaluate".
#ifndef STRATA_CORE_ENGINE_LABELS_TRAIN_H_
#define STRATA_CORE_ENGINE_LABELS_TRAIN_H_

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/classification/classifier.h"
#include "core/engine/map/job_context.h"
#include "core/engine/map/map_core.h"
#include "core/world/job.h"
#include "core/world/job_arguments.h"

namespace strata {

// Parameters of kTrainJob by the same names, where bounds and defaults stand
// (core/world/job_kinds.h).
struct TrainSettings {
  std::string name;  // of the classifier; empty: the method's and the job's number
  TrainingOptions options;
  int folds = 0;  // of the validation over scans or regions, at most as many as there are; 0: none
  // > 0: scans taken in one square of this edge are left out together; 0: each scan alone.
  double region_m = 0.0;
};

// INVALID_ARGUMENT for a reduction out of its bounds.
absl::StatusOr<TrainSettings> ParseTrainSettings(const JobArguments& arguments);

// Learns from every point that a person labelled or that was uploaded with a label, scan by scan,
// and keeps the classifier. Its scores are those of the validation: points of a scan are judged by
// classifiers that have not seen the scan. FAILED_PRECONDITION where nothing is labelled. Repeated
// after a crash, it makes no second one.
absl::Status RunTrainJob(MapCore& core,
                         const JobInfo& job,
                         const JobArguments& arguments,
                         JobContext& context);

// How well the classifier `model` labels what people labelled: metrics accuracy,
// mean_iou, points, scans, and confusion.<class id>.<class id given>, where not 0. Points of
// classes that it does not know are not counted.
absl::Status RunEvaluateJob(MapCore& core, absl::string_view model, JobContext& context);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_LABELS_TRAIN_H_
