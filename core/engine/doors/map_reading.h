// What a call that only reads has of a map, whoever has the map: one that this engine has open, or
// the store of one that another engine has.
#ifndef STRATA_CORE_ENGINE_DOORS_MAP_READING_H_
#define STRATA_CORE_ENGINE_DOORS_MAP_READING_H_

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/engine/doors/map.h"
#include "core/engine/map/map_state.h"
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
  MapReading(std::string name, std::unique_ptr<MapStorage> store, absl::Status elsewhere)
      : name_(std::move(name)), store_(std::move(store)), elsewhere_(std::move(elsewhere)) {}

  const std::string& name() const { return map_ != nullptr ? map_->core().name() : name_; }
  // nullptr: another engine has it.
  Map* map() const { return map_.get(); }
  // nullptr: it is open here.
  MapStorage* store() const { return store_.get(); }
  // The store, for what is kept beyond the call.
  std::unique_ptr<MapStorage> TakeStore() { return std::move(store_); }
  // For what is served by the engine that has the map only.
  const absl::Status& elsewhere() const { return elsewhere_; }

  // Runs `body` on one state of the store, the newest, and returns once its tiles are what all
  // calls get: whoever is told that a scan is integrated finds it in the tiles.
  absl::Status Read(const Stop& stop, Body body) const;
  // The same without waiting for tiles.
  absl::Status ReadState(Body body) const;
  // The same where tiles are read: UNAVAILABLE while another engine makes them again.
  absl::Status ReadTiles(Body body) const;
  // Runs `body` on the newest state, with what changed after `since`.
  absl::Status ReadMap(std::uint64_t since, absl::FunctionRef<absl::Status(MapState&)> body) const;
  // The same where tiles are read, UNAVAILABLE as above, by a body that may take minutes and waits
  // for nobody.
  absl::Status ReadMapTiles(std::uint64_t since,
                            absl::FunctionRef<absl::Status(MapState&)> body) const;
  // As StorageReader::CopyTo().
  absl::Status CopyTo(const std::filesystem::path& file, const Stop& stop) const;

 private:
  absl::Status CheckTiles(const MapClock& clock) const;
  // One state of `reader`, inside its snapshot.
  absl::Status ReadStore(StorageReader& reader,
                         std::uint64_t since,
                         bool tiles,
                         absl::FunctionRef<absl::Status(MapState&)> body) const;

  std::shared_ptr<Map> map_;
  std::string name_;
  std::unique_ptr<MapStorage> store_;
  absl::Status elsewhere_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_MAP_READING_H_
