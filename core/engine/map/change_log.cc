#include "core/engine/map/change_log.h"

#include <algorithm>
#include <utility>

#include "absl/time/time.h"

#include "core/common/status.h"

namespace strata {

ChangeSet ChangesOf(const StoredChanges& stored, std::uint64_t last) {
  ChangeSet set;
  set.complete = stored.complete;
  set.last = last;
  for (const StoredChange& change : stored.changes) {
    if (change.inferred) {
      set.inferred = change.commit_sequence;
    } else if (change.scan.trajectory.empty()) {
      set.tiles[change.tile] = {change.tile, change.version, change.gone};
    } else {
      set.scans.insert(change.scan);
    }
  }
  return set;
}

void ChangeLog::Append(Change change) {
  changes_.push_back(std::move(change));
  if (changes_.size() <= kMaxChanges) return;
  floor_ = changes_.front().commit_sequence;
  changes_.pop_front();
}

void ChangeLog::Add(std::uint64_t commit_sequence,
                    const std::vector<ScanId>& scans,
                    const std::vector<api::TileChangeNotice>& tiles,
                    bool inferred) {
  absl::MutexLock lock(&mutex_);
  if (inferred) inferred_ = std::max(inferred_, commit_sequence);
  for (const ScanId& scan : scans) Append({commit_sequence, scan, {}});
  for (const api::TileChangeNotice& tile : tiles) Append({commit_sequence, {}, tile});
  last_ = std::max(last_, commit_sequence);
}

ChangeSet ChangeLog::Since(std::uint64_t commit_sequence) const {
  ChangeSet set;
  absl::MutexLock lock(&mutex_);
  set.last = last_;
  set.inferred = inferred_;
  set.complete = commit_sequence >= floor_;
  if (!set.complete) return set;
  const auto first = std::upper_bound(
      changes_.begin(),
      changes_.end(),
      commit_sequence,
      [](std::uint64_t at, const Change& change) { return at < change.commit_sequence; });
  for (auto it = first; it != changes_.end(); ++it) {
    if (it->scan.trajectory.empty()) {
      set.tiles[it->tile.key] = it->tile;
    } else {
      set.scans.insert(it->scan);
    }
  }
  return set;
}

std::uint64_t ChangeLog::last() const {
  absl::MutexLock lock(&mutex_);
  return last_;
}

std::uint64_t ChangeLog::inferred() const {
  absl::MutexLock lock(&mutex_);
  return inferred_;
}

absl::Status ChangeLog::Await(std::uint64_t commit_sequence, const Stop& stop) const {
  constexpr absl::Duration kPoll = absl::Milliseconds(50);
  absl::MutexLock lock(&mutex_);
  const auto newer = [this, commit_sequence]() ABSL_SHARED_LOCKS_REQUIRED(mutex_) {
    return !closed_.ok() || last_ > commit_sequence;
  };
  while (!mutex_.AwaitWithTimeout(absl::Condition(&newer), kPoll)) {
    STRATA_RETURN_IF_ERROR(stop.status());
  }
  return last_ > commit_sequence ? absl::OkStatus() : closed_;
}

void ChangeLog::Close(const absl::Status& why) {
  absl::MutexLock lock(&mutex_);
  if (closed_.ok()) closed_ = why;
}

}  // namespace strata
