// The kinds that a map knows: its library, and what the last job "objects" found.
#ifndef STRATA_CORE_ENGINE_OBJECTS_KIND_LIBRARY_H_
#define STRATA_CORE_ENGINE_OBJECTS_KIND_LIBRARY_H_

#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/common/stop.h"
#include "core/engine/map/map_core.h"
#include "core/engine/map/map_state.h"
#include "core/storage/storage.h"
#include "core/world/things/kind.h"

namespace strata {

// Without entities counted: the library by id, then those found. DATA_LOSS naming the damaged one.
absl::StatusOr<std::vector<KindInfo>> KindsIn(StorageReader& reader);
// The library with its shapes.
absl::StatusOr<std::vector<ThingKind>> LoadLibrary(MapCore& core, const Stop& stop);
// Whether the library is made of the same shapes as it was; names do not count.
absl::StatusOr<bool> IsLibrary(StorageReader& reader, const std::vector<ThingKind>& library);

// As of api::Objects; entities are not counted.
absl::StatusOr<ThingKind> ReadKind(const MapState& state, absl::string_view kind);
absl::StatusOr<KindInfo> RenameKind(MapCore& core,
                                    absl::string_view kind,
                                    absl::string_view name,
                                    const Stop& stop);
absl::StatusOr<KindInfo> ImportKind(MapCore& core, const NewKind& kind, const Stop& stop);
absl::Status DeleteKind(MapCore& core, absl::string_view kind, const Stop& stop);

// DATA_LOSS naming the first kind whose shape is damaged, or is not that of its id.
absl::Status CheckKinds(MapCore& core, const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_OBJECTS_KIND_LIBRARY_H_
