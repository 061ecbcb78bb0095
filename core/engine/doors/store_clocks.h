// Where maps that other engines have stand, for those who watch them.
#ifndef STRATA_CORE_ENGINE_DOORS_STORE_CLOCKS_H_
#define STRATA_CORE_ENGINE_DOORS_STORE_CLOCKS_H_

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "core/api/maps.h"
#include "core/common/stop.h"
#include "core/engine/map/map_stores.h"
#include "core/storage/records.h"

namespace strata {

// The store is asked by whoever finds what is known too old, for all maps that somebody watches at
// once: so many watchers there are, it is one statement each time, and none where nobody watches.
// Thread-safe.
class StoreClocks {
 public:
  // `stores` must outlive it.
  explicit StoreClocks(const MapStores& stores) : stores_(stores) {}

  // Where the map stands, or stood `lag` ago at most. NOT_FOUND; errors of the store.
  absl::StatusOr<MapClock> ClockOf(const std::string& name, absl::Duration lag, const Stop& stop);
  // Returns once the map is not at that commit and epoch any more, api::kWatchLag later at most, or
  // is not there. CANCELLED, DEADLINE_EXCEEDED; errors of the store.
  absl::Status Await(const std::string& name,
                     std::uint64_t commit_sequence,
                     std::uint64_t epoch,
                     const Stop& stop);

 private:
  struct Entry {
    absl::Time asked = absl::InfinitePast();
    absl::Time looked = absl::InfinitePast();  // when the look began that found this
    absl::StatusOr<MapClock> clock = absl::UnknownError("");
  };

  // Those that are watched, with `name`; forgets others.
  std::vector<std::string> Watched(absl::Time now) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Look(const std::vector<std::string>& names) ABSL_LOCKS_EXCLUDED(mutex_);
  bool IsFree() const ABSL_SHARED_LOCKS_REQUIRED(mutex_) { return !looking_; }

  const MapStores& stores_;
  absl::Mutex mutex_;
  std::map<std::string, Entry> entries_ ABSL_GUARDED_BY(mutex_);
  bool looking_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_STORE_CLOCKS_H_
