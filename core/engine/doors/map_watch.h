// Follows a map: the messages of api::Maps::Watch.
#ifndef STRATA_CORE_ENGINE_DOORS_MAP_WATCH_H_
#define STRATA_CORE_ENGINE_DOORS_MAP_WATCH_H_

#include <cstdint>
#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/api/maps.h"
#include "core/engine/map/map_state.h"
#include "core/storage/storage.h"

namespace strata {

// Makes the messages of one watcher, whoever has the map.
class MapWatcher {
 public:
  explicit MapWatcher(const api::WatchOptions& options)
      : options_(options), since_(options.since), epoch_(options.epoch) {}

  // What changed since the message before: `state` must be read with what changed after since().
  // nullopt if nothing did and it is not the first.
  absl::StatusOr<std::optional<api::MapUpdate>> Next(const MapState& state);
  // What the watcher has been told. The epoch is 0 where he knows none.
  std::uint64_t since() const { return since_; }
  std::uint64_t epoch() const { return epoch_; }
  // That nothing changed.
  api::MapUpdate Nothing() const;

 private:
  absl::Status Fill(StorageReader& reader, const MapState& state, api::MapUpdate& update) const;
  absl::Status CheckSince(StorageReader& reader, api::MapUpdate& update) const;
  absl::Status AddEverything(StorageReader& reader,
                             const MapState& state,
                             api::MapUpdate& update) const;
  bool Wanted(const ScanId& id) const {
    return options_.trajectory.empty() || id.trajectory == options_.trajectory;
  }

  const api::WatchOptions options_;
  std::uint64_t since_;
  std::uint64_t epoch_;
  bool first_ = true;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_MAP_WATCH_H_
