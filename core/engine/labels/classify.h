// The job "classify": a classifier labels the scans of a map.
#ifndef STRATA_CORE_ENGINE_LABELS_CLASSIFY_H_
#define STRATA_CORE_ENGINE_LABELS_CLASSIFY_H_

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

#include "core/engine/ingest/worker.h"
#include "core/engine/map/job_context.h"
#include "core/engine/map/map_core.h"

namespace strata {

// The classifier `model` labels every scan that it has not labelled yet, in commit
// order, and goes on until there is none: also those that come in meanwhile. Each scan is one
// transaction, its labels and the tiles that count them, so a job that ended in between goes on
// where it stopped when it is started again. What it says depends on the classifier and on the
// uploaded scan only. Scans without points, and damaged ones, are left out and counted.
absl::Status RunClassifyJob(MapCore& core,
                            Worker& worker,
                            absl::string_view model,
                            JobContext& context);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_LABELS_CLASSIFY_H_
