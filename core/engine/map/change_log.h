// What changed lately in a map, for those who watch it.
#ifndef STRATA_CORE_ENGINE_MAP_CHANGE_LOG_H_
#define STRATA_CORE_ENGINE_MAP_CHANGE_LOG_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"

#include "core/api/maps.h"
#include "core/common/stop.h"
#include "core/storage/records.h"

namespace strata {

// Changes after some commit sequence, each thing once.
struct ChangeSet {
  bool complete = true;    // false: the log does not reach back so far; everything may have changed
  std::uint64_t last = 0;  // commit sequence of the newest one
  std::set<ScanId> scans;  // whose state or pose is another
  std::map<TileKey, api::TileChangeNotice> tiles;  // of level 0
  // Commit sequence of the newest change of what is inferred, perhaps none of this set; 0: the log
  // knows of none.
  std::uint64_t inferred = 0;
};

// What the store says that changed up to commit `last`.
ChangeSet ChangesOf(const StoredChanges& stored, std::uint64_t last);

// Thread-safe. Kept in memory only: after a restart it begins where the map stands.
class ChangeLog {
 public:
  explicit ChangeLog(std::uint64_t commit_sequence)
      : floor_(commit_sequence), last_(commit_sequence) {}

  // Called after the commit that took the number `commit_sequence`, which is larger than that of
  // every call before: whoever knows a number is told of later ones only.
  void Add(std::uint64_t commit_sequence,
           const std::vector<ScanId>& scans,
           const std::vector<api::TileChangeNotice>& tiles,
           bool inferred = false);
  ChangeSet Since(std::uint64_t commit_sequence) const;
  // The newest number.
  std::uint64_t last() const;
  // As ChangeSet::inferred: while it stays, what is inferred stays.
  std::uint64_t inferred() const;
  // Returns once there is something newer; CANCELLED, DEADLINE_EXCEEDED; the status of Close().
  absl::Status Await(std::uint64_t commit_sequence, const Stop& stop) const;
  // Nothing more comes: whoever waits for it, or will, gets `why`.
  void Close(const absl::Status& why);

 private:
  struct Change {
    std::uint64_t commit_sequence = 0;
    ScanId scan;  // empty trajectory: a tile
    api::TileChangeNotice tile;
  };
  static constexpr std::size_t kMaxChanges = 1 << 16;

  void Append(Change change) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  mutable absl::Mutex mutex_;
  std::deque<Change> changes_ ABSL_GUARDED_BY(mutex_);
  std::uint64_t floor_ ABSL_GUARDED_BY(mutex_);  // changes after it are all here
  std::uint64_t last_ ABSL_GUARDED_BY(mutex_);
  std::uint64_t inferred_ ABSL_GUARDED_BY(mutex_) = 0;
  absl::Status closed_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MAP_CHANGE_LOG_H_
