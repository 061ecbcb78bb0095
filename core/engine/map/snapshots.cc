#include "core/engine/map/snapshots.h"

#include <algorithm>
#include <cstdint>

#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "core/common/blocking.h"
#include "core/common/status.h"

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

absl::Status Snapshots::AwaitPublished(std::uint64_t tile_version, const Stop& stop) const {
  constexpr absl::Duration kPoll = absl::Milliseconds(50);
  const BlockingScope blocking;
  absl::MutexLock lock(&mutex_);
  const auto published = [this, tile_version]() ABSL_SHARED_LOCKS_REQUIRED(mutex_) {
    return !closed_.ok() || current_.tile_version >= tile_version;
  };
  while (!mutex_.AwaitWithTimeout(absl::Condition(&published), kPoll)) {
    STRATA_RETURN_IF_ERROR(stop.status());
  }
  return current_.tile_version >= tile_version ? absl::OkStatus() : closed_;
}

void Snapshots::Close(const absl::Status& why) {
  absl::MutexLock lock(&mutex_);
  if (closed_.ok()) closed_ = why;
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
