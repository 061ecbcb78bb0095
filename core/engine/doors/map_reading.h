// What a call that only reads has of a map, whoever has the map: one that this engine has open, or
// the store of one that another engine has.
#ifndef STRATA_CORE_ENGINE_DOORS_MAP_READING_H_
#define STRATA_CORE_ENGINE_DOORS_MAP_READING_H_

#include <memory>
#include <utility>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/engine/doors/map.h"
#include "core/storage/storage.h"

namespace strata {

// For bodies that read one thing.
template <typename T>
absl::Status AssignTo(absl::StatusOr<T> read, T& to) {
  if (read.ok()) to = *std::move(read);
  return read.status();
}

// For one call; one thread at a time.
class MapReading {
 public:
  using Body = absl::FunctionRef<absl::Status(StorageReader&, const MapClock&)>;

  explicit MapReading(std::shared_ptr<Map> map) : map_(std::move(map)) {}
  // `elsewhere`: why it is not open here.
  MapReading(std::unique_ptr<MapStorage> store, absl::Status elsewhere)
      : store_(std::move(store)), elsewhere_(std::move(elsewhere)) {}

  // nullptr: another engine has it.
  Map* map() const { return map_.get(); }
  // For what is served by the engine that has the map only.
  const absl::Status& elsewhere() const { return elsewhere_; }

  // Runs `body` on one state of the store, the newest, and returns once its tiles are what all
  // calls get: whoever is told that a scan is integrated finds it in the tiles.
  absl::Status Read(const Stop& stop, Body body) const;
  // The same without waiting for tiles.
  absl::Status ReadState(Body body) const;
  // The same where tiles are read: UNAVAILABLE while another engine makes them again.
  absl::Status ReadTiles(Body body) const;

 private:
  std::shared_ptr<Map> map_;
  std::unique_ptr<MapStorage> store_;
  absl::Status elsewhere_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_MAP_READING_H_
