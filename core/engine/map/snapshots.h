// Which states of a map are being read, so that nothing they need is collected.
#ifndef STRATA_CORE_ENGINE_MAP_SNAPSHOTS_H_
#define STRATA_CORE_ENGINE_MAP_SNAPSHOTS_H_

#include <cstdint>
#include <set>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"

#include "core/common/stop.h"

namespace strata {

// One state of poses and tiles: poses of `epoch`, tiles of `tile_version` and older.
struct MapView {
  std::uint64_t epoch = 0;
  std::uint64_t tile_version = 0;
  friend bool operator==(const MapView&, const MapView&) = default;
};

// Thread-safe.
class Snapshots {
 public:
  // Keeps a view readable for as long as it lives. Costs no transaction and no connection.
  class Pin {
   public:
    Pin(Snapshots& owner, MapView view) : owner_(&owner), view_(view) {}
    ~Pin() {
      if (owner_ != nullptr) owner_->Release(view_);
    }
    Pin(Pin&& other) noexcept : owner_(std::exchange(other.owner_, nullptr)), view_(other.view_) {}
    Pin& operator=(Pin&&) = delete;
    const MapView& view() const { return view_; }

   private:
    Snapshots* owner_;
    MapView view_;
  };

  explicit Snapshots(MapView current) : current_(current) {}

  MapView current() const;
  Pin PinCurrent();
  // Called after the commit that made `view` the current one.
  void Publish(MapView view);
  // Returns once tiles of `tile_version`, which must be committed, are what readers get: whoever
  // saw a commit in the store must not find older tiles afterwards. CANCELLED, DEADLINE_EXCEEDED by
  // `stop`; the status of Close().
  absl::Status AwaitPublished(std::uint64_t tile_version, const Stop& stop) const;
  // Nothing more is published: whoever waits for it, or will, gets `why`.
  void Close(const absl::Status& why);
  // Oldest tile version that somebody reads or may begin to read.
  std::uint64_t Floor() const;

 private:
  void Release(const MapView& view);

  mutable absl::Mutex mutex_;
  MapView current_ ABSL_GUARDED_BY(mutex_);
  std::multiset<std::uint64_t> pinned_ ABSL_GUARDED_BY(mutex_);
  absl::Status closed_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MAP_SNAPSHOTS_H_
