// The plane model of a map: the job "planes" that finds it, and what the store keeps of it.
#ifndef STRATA_CORE_ENGINE_MODELS_PLANE_MODELS_H_
#define STRATA_CORE_ENGINE_MODELS_PLANE_MODELS_H_

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/engine/map/job_context.h"
#include "core/engine/map/map_core.h"
#include "core/engine/map/map_state.h"
#include "core/world/job.h"
#include "core/world/job_arguments.h"
#include "core/world/plane_model.h"

namespace strata {

// Finds the planes of all integrated scans as the current epoch has them, and keeps them in place
// of those of before, in one commit. Scans without points, and damaged ones, are left out and
// counted; with colour=1 those without colours, too. FAILED_PRECONDITION where that leaves none. A
// region without points is an empty model, and the job's message says so. Memory grows with the
// surface, and with kMostSquarePoints. Same scans, poses and arguments, same planes.
absl::Status RunPlanesJob(MapCore& core,
                          const JobInfo& job,
                          const JobArguments& arguments,
                          JobContext& context);

// Gives each plane of the model to `sink`, by falling area, a plane at a time in memory; returns
// how it came about. NOT_FOUND naming the job where there is none; ABORTED where another one took
// its place meanwhile; DATA_LOSS naming the plane that is damaged.
absl::StatusOr<PlaneModelInfo> ReadPlaneModel(
    const MapState& state,
    const Stop& stop,
    absl::FunctionRef<absl::Status(const ModelPlane&)> sink);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MODELS_PLANE_MODELS_H_
