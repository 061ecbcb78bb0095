// What nobody saw of the things in a map: the job "complete", and what the store keeps of it.
#ifndef STRATA_CORE_ENGINE_OBJECTS_COMPLETION_H_
#define STRATA_CORE_ENGINE_OBJECTS_COMPLETION_H_

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/engine/map/job_context.h"
#include "core/engine/map/map_core.h"
#include "core/engine/map/map_state.h"
#include "core/world/job.h"
#include "core/world/job_arguments.h"
#include "core/world/things/entity.h"
#include "core/world/things/inferred.h"

namespace strata {

// Builds the prototype of each kind that the map's entities are of, from all of them and what the
// library has, and keeps what it adds to each
// of them in place of what was inferred before, in one commit. FAILED_PRECONDITION where no entity
// has a kind, or the entities stand on the poses of an older epoch; NOT_FOUND where there are none.
// Same scans, labels, poses, entities and arguments, same points.
absl::Status RunCompleteJob(MapCore& core,
                            const JobInfo& job,
                            const JobArguments& arguments,
                            JobContext& context);

// Gives what was inferred of each entity that the query takes to `sink`, by id, one at a time in
// memory; its region is that of what was inferred, not of the entity's box. Returns how it came
// about. Deleting a scan takes with it all that was inferred of the kinds it had seen. NOT_FOUND
// naming the job where nothing was inferred; ABORTED where another job inferred or found others
// meanwhile; DATA_LOSS naming the entity that is damaged.
absl::StatusOr<InferredInfo> ReadInferred(
    const MapState& state,
    const EntityQuery& query,
    const Stop& stop,
    absl::FunctionRef<absl::Status(const InferredPart&)> sink);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_OBJECTS_COMPLETION_H_
