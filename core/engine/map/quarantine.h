// Work that the process dies of, again and again: it is told apart from the rest and put aside, so
// that the rest goes on.
#ifndef STRATA_CORE_ENGINE_MAP_QUARANTINE_H_
#define STRATA_CORE_ENGINE_MAP_QUARANTINE_H_

#include <cstdint>
#include <map>
#include <memory>
#include <set>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"

#include "core/engine/map/map_core.h"
#include "core/storage/storage.h"
#include "core/world/job.h"

namespace strata {

// So often the process may die while the same work is under way, but for what killed it from
// outside (EngineOptions::killed_from_outside).
inline constexpr std::uint32_t kMostDeaths = 2;
// The same where others may have the map: whoever takes it over from one that does not answer can
// not tell whether that one has died, of what, or is frozen, cut off or being moved.
inline constexpr std::uint32_t kMostDeathsOfMany = 10;

// Messages of scans and jobs in quarantine begin so.
inline constexpr absl::string_view kQuarantined = "quarantined: ";
bool IsQuarantined(const JobInfo& job);

// Puts a scan or job aside, or takes it back: it waits again. Inside a commit. `why` completes the
// message. NOT_FOUND; FAILED_PRECONDITION for what has ended, or is not in quarantine.
absl::Status Hold(StorageWriter& writer,
                  const WorkId& work,
                  absl::string_view why,
                  std::uint32_t deaths = kMostDeaths);
absl::Status Release(StorageWriter& writer, const WorkId& work);

// What is under way is written down before it begins; what a start finds written down was under way
// when the process died. Scans of one batch then run alone, so that the next death says which it
// is. With kMostDeaths work is put aside: a scan or job fails, a rebuild or a look is not begun.
// Thread-safe.
class Quarantine {
 public:
  // Counts what the last process died of. `died`: whether one may have; not where this one has had
  // the map open before.
  static absl::StatusOr<std::unique_ptr<Quarantine>> Open(MapCore& core, bool died = true);

  // How many of the scans that wait may be integrated together now, at most `most`: they are under
  // way from now on, those of the last call no longer.
  absl::StatusOr<int> BeginScans(int most);
  // They ended without an end of the process, if not well. Where that cannot be written down, they
  // count if the process is killed now.
  void EndScans();
  // Puts the scan aside whose turn it is.
  absl::Status HoldNextScan(absl::string_view why);

  // Other work begins or has ended; with a writer, inside a commit.
  absl::Status Begin(StorageWriter& writer, const WorkId& work) const;
  absl::Status End(StorageWriter& writer, const WorkId& work);
  // It ended without an end of the process, and will begin again.
  absl::Status Pause(StorageWriter& writer, const WorkId& work) const;
  absl::Status Begin(const WorkId& work);
  absl::Status End(const WorkId& work);
  absl::Status Pause(const WorkId& work);
  // Whether the process, if it died now, would have died of `work`. From the worker's thread, with
  // no scan under way.
  absl::StatusOr<bool> NothingElseUnderWay(const WorkId& work);

  // The process died while it was under way.
  bool IsSuspect(const WorkId& work) const { return DeathsOf(work) > 0; }
  bool IsHeld(const WorkId& work) const { return DeathsOf(work) >= most_deaths_; }
  // A scan that the process may have died of has not had its turn yet.
  absl::StatusOr<bool> SuspectScanWaits() const;

 private:
  explicit Quarantine(MapCore& core)
      : core_(core), most_deaths_(core.options().store.empty() ? kMostDeaths : kMostDeathsOfMany) {}
  absl::Status CountDeaths(StorageWriter& writer, bool process_died);
  std::uint32_t DeathsOf(const WorkId& work) const;
  absl::Status PutScansUnderWay(std::set<WorkId> scans);

  MapCore& core_;
  const std::uint32_t most_deaths_;
  mutable absl::Mutex mutex_;
  std::map<WorkId, std::uint32_t> deaths_ ABSL_GUARDED_BY(mutex_);
  std::set<WorkId> scans_under_way_;  // the worker's
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MAP_QUARANTINE_H_
