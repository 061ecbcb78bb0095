// The things in a map, found by jobs.
#ifndef STRATA_CORE_API_OBJECTS_H_
#define STRATA_CORE_API_OBJECTS_H_

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/api/call.h"
#include "core/world/entity.h"

namespace strata::api {

// Thread-safe.
class Objects {
 public:
  virtual ~Objects() = default;

  // The entities that the last job `objects` found and the query takes, by id: each to `sink`,
  // whose error ends the call. Returns how they came about; their epoch may be older than the
  // map's. Scans that were deleted since are left out, and what they alone saw. NOT_FOUND where no
  // job has found any; ABORTED where another one found others meanwhile; DATA_LOSS naming the
  // entity that is damaged.
  virtual absl::StatusOr<EntitiesInfo> ListEntities(
      const Call& call,
      absl::string_view map,
      const EntityQuery& query,
      absl::FunctionRef<absl::Status(const Entity&)> sink) = 0;
};

}  // namespace strata::api

#endif  // STRATA_CORE_API_OBJECTS_H_
