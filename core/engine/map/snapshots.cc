#include "core/engine/map/snapshots.h"

#include <algorithm>
#include <cstdint>

#include "absl/synchronization/mutex.h"

#include "core/common/blocking.h"

namespace strata {

MapView Snapshots::current() const {
  absl::MutexLock lock(&mutex_);
  return current_;
}

Snapshots::Pin Snapshots::PinCurrent() {
  absl::MutexLock lock(&mutex_);
  pinned_.insert(current_.tile_version);
  return Pin(*this, current_);
}

void Snapshots::Publish(MapView view) {
  absl::MutexLock lock(&mutex_);
  current_ = view;
}

void Snapshots::AwaitPublished(std::uint64_t tile_version) const {
  const BlockingScope blocking;
  absl::MutexLock lock(&mutex_);
  const auto published = [this, tile_version]() ABSL_SHARED_LOCKS_REQUIRED(mutex_) {
    return current_.tile_version >= tile_version;
  };
  mutex_.Await(absl::Condition(&published));
}

std::uint64_t Snapshots::Floor() const {
  absl::MutexLock lock(&mutex_);
  return pinned_.empty() ? current_.tile_version
                         : std::min(current_.tile_version, *pinned_.begin());
}

void Snapshots::Release(const MapView& view) {
  absl::MutexLock lock(&mutex_);
  pinned_.erase(pinned_.find(view.tile_version));
}

}  // namespace strata
