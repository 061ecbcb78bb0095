// The things in a map: the job "objects" that finds them, and what the store keeps of them.
#ifndef STRATA_CORE_ENGINE_OBJECTS_ENTITIES_H_
#define STRATA_CORE_ENGINE_OBJECTS_ENTITIES_H_

#include <vector>

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
#include "core/world/things/kind.h"

namespace strata {

// What the job can be told before it is queued: NOT_FOUND for a class that the map does not have,
// listing those that it has.
absl::Status CheckObjectsJob(StorageReader& reader, const JobArguments& arguments);

// Finds the entities of all classified points of the integrated scans, as the current epoch has
// them, and keeps them in place of those of before, in one commit. Scans without points, and
// damaged ones, are left out and counted. Each is of a kind, if it is like another or one of the
// library (core/completion/kinds.h); a library that changes meanwhile is looked at again.
// FAILED_PRECONDITION where no point of the map has a class; a region without any, or without any
// of the class, is no entity, and the job's message says so. Same scans, labels, poses, library and
// arguments, same entities and kinds.
absl::Status RunObjectsJob(MapCore& core,
                           const JobInfo& job,
                           const JobArguments& arguments,
                           JobContext& context);

// Gives each entity that the query takes to `sink`, by id, one at a time in memory, with its kind
// as that is called now; returns how they came about. Scans that were deleted since are not among
// an entity's, nor what they alone saw. NOT_FOUND naming the job where there are none, and for a
// kind that does not exist; ABORTED where another one found others meanwhile; DATA_LOSS naming the
// entity that is damaged.
absl::StatusOr<EntitiesInfo> ReadEntities(const MapState& state,
                                          const EntityQuery& query,
                                          const Stop& stop,
                                          absl::FunctionRef<absl::Status(const Entity&)> sink);

// All kinds, with their entities counted; damaged entities are not. ABORTED as ReadEntities().
absl::StatusOr<std::vector<KindInfo>> CountKinds(const MapState& state, const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_OBJECTS_ENTITIES_H_
