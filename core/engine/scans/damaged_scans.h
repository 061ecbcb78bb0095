// Scans whose stored data cannot be read, which a job goes on without.
//
// Such a scan keeps its place relative to its neighbours, but its points are lost: it is in no tile
// that is made again, and stays in the others until it is deleted. So every job that leaves one out
// names it.
#ifndef STRATA_CORE_ENGINE_SCANS_DAMAGED_SCANS_H_
#define STRATA_CORE_ENGINE_SCANS_DAMAGED_SCANS_H_

#include <map>
#include <set>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"

#include "core/engine/map/job_context.h"
#include "core/storage/storage.h"

namespace strata {

// Thread-safe.
class DamagedScans {
 public:
  // Whether `status` says that data of this scan are damaged; it is left out then. `name`: the
  // scan's id, or what its row is called where the id cannot be trusted.
  bool LeaveOut(ScanNumber scan, const std::string& name, const absl::Status& status);

  // The same, of a scan that was deleted while the job ran: it is left out, and no damage.
  bool LeaveOut(StorageReader& reader,
                ScanNumber scan,
                const std::string& name,
                const absl::Status& status);

  std::set<ScanNumber> Scans() const;  // deleted ones, too
  // Metrics: `left_out`, how many, and `left_out.<name>` for each.
  void SetMetrics(JobContext& context) const;
  // For people, to append to a message: the first names, what is wrong with them, and the cure;
  // empty if there is none.
  std::string Message() const;

 private:
  struct Damage {
    std::string name;
    std::string what;
  };
  mutable absl::Mutex mutex_;
  std::map<ScanNumber, Damage> scans_ ABSL_GUARDED_BY(mutex_);
  std::set<ScanNumber> deleted_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_SCANS_DAMAGED_SCANS_H_
