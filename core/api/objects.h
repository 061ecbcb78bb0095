// The things in a map, found by jobs.
#ifndef STRATA_CORE_API_OBJECTS_H_
#define STRATA_CORE_API_OBJECTS_H_

#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/api/call.h"
#include "core/world/things/entity.h"
#include "core/world/things/inferred.h"
#include "core/world/things/kind.h"

namespace strata::api {

// Thread-safe.
class Objects {
 public:
  virtual ~Objects() = default;

  // The entities that the last job `objects` found and the query takes, by id: each to `sink`,
  // whose error ends the call. Returns how they came about; their epoch may be older than the
  // map's. Scans that were deleted since are left out, and what they alone saw; kinds that were are
  // none, and others have the names that they have now. NOT_FOUND where no job has found any, and
  // for a kind that does not exist; ABORTED where another one found others meanwhile; DATA_LOSS
  // naming the entity that is damaged.
  virtual absl::StatusOr<EntitiesInfo> ListEntities(
      const Call& call,
      absl::string_view map,
      const EntityQuery& query,
      absl::FunctionRef<absl::Status(const Entity&)> sink) = 0;

  // The kinds of a map: those of its library by id, then those that the last job `objects` found
  // and nobody has named. ABORTED as of ListEntities; DATA_LOSS naming the kind that is damaged.
  virtual absl::StatusOr<std::vector<KindInfo>> ListKinds(const Call& call,
                                                          absl::string_view map) = 0;
  // `kind`, here and below: its name, or first digits of its id (KindCalled). NOT_FOUND,
  // INVALID_ARGUMENT where several begin so; otherwise as ListKinds.
  virtual absl::StatusOr<ThingKind> GetKind(const Call& call,
                                            absl::string_view map,
                                            absl::string_view kind) = 0;
  // Gives it a name; one that a job found is in the library from then on. Its entities are not
  // counted. NOT_FOUND; INVALID_ARGUMENT for a bad name; ALREADY_EXISTS where another kind has it;
  // RESOURCE_EXHAUSTED beyond kMaxKinds.
  virtual absl::StatusOr<KindInfo> RenameKind(const Call& call,
                                              absl::string_view map,
                                              absl::string_view kind,
                                              absl::string_view name) = 0;
  // Into the library; the next job `objects` looks for it. INVALID_ARGUMENT for bad names, and for
  // what ValidateKindShape() refuses; ALREADY_EXISTS where its name, or its shape, is there;
  // RESOURCE_EXHAUSTED beyond kMaxKinds, and where no class id is left.
  virtual absl::StatusOr<KindInfo> ImportKind(const Call& call,
                                              absl::string_view map,
                                              const NewKind& kind) = 0;
  // Out of the library; its entities are of none until the next job `objects`, which may find the
  // kind again, without a name. NOT_FOUND; FAILED_PRECONDITION for one that is not in the library.
  virtual absl::Status DeleteKind(const Call& call,
                                  absl::string_view map,
                                  absl::string_view kind) = 0;

  // What the last job `complete` inferred of the entities that the query takes, by id: each to
  // `sink`, whose error ends the call; of the query's region, those of which something was inferred
  // in it. Maps::Watch says when it may be another. Returns how it came about. Deleting a scan
  // takes with it all that was inferred of the kinds it had seen. NOT_FOUND where nothing was
  // inferred; ABORTED, DATA_LOSS as ListEntities.
  virtual absl::StatusOr<InferredInfo> ListInferred(
      const Call& call,
      absl::string_view map,
      const EntityQuery& query,
      absl::FunctionRef<absl::Status(const InferredPart&)> sink) = 0;
};

}  // namespace strata::api

#endif  // STRATA_CORE_API_OBJECTS_H_
