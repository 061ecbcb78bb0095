// The announced scans of a map that are not whole yet: who sends them, and what stays for a while
// of those whose stream ended.
#ifndef STRATA_CORE_ENGINE_INGEST_UNFINISHED_UPLOADS_H_
#define STRATA_CORE_ENGINE_INGEST_UNFINISHED_UPLOADS_H_

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "core/engine/ingest/scan_intake.h"
#include "core/engine/map/map_core.h"
#include "core/storage/records.h"
#include "core/world/scan.h"

namespace strata {

// Thread-safe.
class UnfinishedUploads {
 public:
  // Finds what earlier runs left, and drops what is too old.
  static absl::StatusOr<std::unique_ptr<UnfinishedUploads>> Open(MapCore& core);

  // Where the points of this scan go: with an announced hash the intake of an earlier stream of it,
  // if there is one, under way or not. Of the same scan is what has the same whole header.
  std::shared_ptr<ScanIntake> Find(const ScanHeader& header);
  // A stream that holds `intake` has ended.
  void Release(std::shared_ptr<ScanIntake> intake, std::uint64_t ticket);

 private:
  using Key = std::pair<ScanId, std::string>;  // with the announced hash

  explicit UnfinishedUploads(MapCore& core) : core_(core) {}
  std::shared_ptr<ScanIntake> FindAnnounced(const ScanHeader& header)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Keeps it for its client, in place of an earlier one of the same scan.
  void Park(const UnfinishedUpload& upload) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // nullopt: there is none.
  std::optional<UnfinishedUpload> TakeParked(const Key& key) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // What has stayed too long, and the oldest beyond the bounds: nobody finds it any more.
  std::vector<std::uint64_t> TakeStale(absl::Time now) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Drops it from the store. Waits for the writer, so without the lock.
  void Abandon(const std::vector<std::uint64_t>& uploads);

  MapCore& core_;
  absl::Mutex mutex_;
  // With the encoded header: a hash may be claimed with headers that it does not belong to.
  std::map<std::pair<Key, std::string>, std::weak_ptr<ScanIntake>> active_ ABSL_GUARDED_BY(mutex_);
  std::map<Key, UnfinishedUpload> parked_ ABSL_GUARDED_BY(mutex_);       // no stream has them
  std::set<std::pair<absl::Time, Key>> by_age_ ABSL_GUARDED_BY(mutex_);  // of parked_
  std::uint64_t parked_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_INGEST_UNFINISHED_UPLOADS_H_
