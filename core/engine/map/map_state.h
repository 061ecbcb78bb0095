// One state of a map, for a call that reads it: of a map that is open here, or of the store of one
// that another engine has.
#ifndef STRATA_CORE_ENGINE_MAP_MAP_STATE_H_
#define STRATA_CORE_ENGINE_MAP_MAP_STATE_H_

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/engine/map/change_log.h"
#include "core/engine/map/map_core.h"
#include "core/engine/map/reader_pool.h"
#include "core/engine/map/snapshots.h"
#include "core/mls/tile_key.h"
#include "core/storage/storage.h"

namespace strata {

// The tiles of view() can be read, and poses of its epoch, for as long as this lives. One thread at
// a time.
class MapState {
 public:
  // Nobody who asks for changes after it is told any.
  static constexpr std::uint64_t kNoChanges = std::numeric_limits<std::uint64_t>::max();

  // A reader on loan, for reads only.
  class Loan {
   public:
    explicit Loan(StorageReader& reader) : reader_(&reader) {}
    explicit Loan(ReaderPool::Lease lease) : lease_(std::move(lease)), reader_(&**lease_) {}
    explicit Loan(std::unique_ptr<StorageReader> own) : own_(std::move(own)), reader_(own_.get()) {}
    StorageReader* operator->() const { return reader_; }
    StorageReader& operator*() const { return *reader_; }

   private:
    std::optional<ReaderPool::Lease> lease_;
    std::unique_ptr<StorageReader> own_;
    StorageReader* reader_;
  };

  // The newest of a map that is open here, which must outlive this, with what changed after
  // `since`.
  explicit MapState(MapCore& core, std::uint64_t since = kNoChanges)
      : core_(&core), now_(core.ChangesSince(since)) {}
  // That of `reader`, inside its Snapshot(): of a map that another engine has.
  MapState(StorageReader& reader, const MapClock& clock, ChangeSet changes)
      : reader_(&reader),
        view_{clock.epoch, clock.tile_version},
        now_(std::move(changes), std::nullopt) {}
  MapState(MapState&&) = delete;

  bool open_here() const { return core_ != nullptr; }
  const MapView& view() const { return core_ != nullptr ? now_.second->view() : view_; }
  // Changes of which those that this state shows are the last.
  const ChangeSet& changes() const { return now_.first; }
  absl::StatusOr<Loan> Reader() const;
  // All that `body` reads is of one state of scans, this one or a newer one. Holds no loan.
  absl::Status Snapshot(absl::FunctionRef<absl::Status(StorageReader&)> body) const;
  // As MapCore::NoteUnreadable(), which is for whoever has the map.
  void NoteUnreadable(const TileKey& key) const;

 private:
  MapCore* core_ = nullptr;
  StorageReader* reader_ = nullptr;
  MapView view_;
  std::pair<ChangeSet, std::optional<Snapshots::Pin>> now_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MAP_MAP_STATE_H_
