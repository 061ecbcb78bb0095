// The kinds that a map knows: its library, and what the last job "objects" found.
#ifndef STRATA_CORE_ENGINE_OBJECTS_KIND_LIBRARY_H_
#define STRATA_CORE_ENGINE_OBJECTS_KIND_LIBRARY_H_

#include <string>
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
// Inside a commit.
absl::StatusOr<KindInfo> RenameKind(StorageWriter& writer,
                                    absl::string_view kind,
                                    absl::string_view name);
absl::Status DeleteKind(StorageWriter& writer, absl::string_view kind);

// A kind on its way into a library.
struct ImportedKind {
  KindInfo info;  // its class once it is there
  std::string class_name;
  std::string shape;  // encoded
};
absl::StatusOr<ImportedKind> PrepareKind(const NewKind& kind);
// Inside a commit.
absl::Status PutImportedKind(StorageWriter& writer, ImportedKind& kind);

// DATA_LOSS naming the first kind whose shape is damaged, or is not that of its id.
absl::Status CheckKinds(MapCore& core, const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_OBJECTS_KIND_LIBRARY_H_
