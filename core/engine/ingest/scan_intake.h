// The points of one scan on their way in: checked as they come, put to disk piece by piece, and
// made a scan in one durable commit. An intake is of one whole header, content hash included: what
// comes under another one is of another scan, even if it has the same id and claims the same hash.
#ifndef STRATA_CORE_ENGINE_INGEST_SCAN_INTAKE_H_
#define STRATA_CORE_ENGINE_INGEST_SCAN_INTAKE_H_

#include <cstdint>
#include <optional>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "core/cloud/point_cloud.h"
#include "core/common/stop.h"
#include "core/engine/ingest/scan_draft.h"
#include "core/engine/map/map_core.h"
#include "core/storage/records.h"
#include "core/world/scan.h"

namespace strata {

// One stream writes at a time: the one that came last. Thread-safe.
class ScanIntake {
 public:
  // OK if the map takes one more scan.
  using CheckRoom = ScanDraft::CheckRoom;

  // `header` must be valid.
  ScanIntake(MapCore& core, ScanHeader header, std::optional<UnfinishedUpload> parked)
      : core_(core), header_(std::move(header)), parked_(std::move(parked)) {}

  // Begins or goes on with the scan. Returns the ticket of the stream that writes from now on; what
  // earlier ones do is ABORTED.
  absl::StatusOr<std::uint64_t> Take();
  const ScanHeader& header() const { return header_; }
  // Points that need not be sent again.
  std::uint64_t points() const;
  absl::Status Write(std::uint64_t ticket, const Stop& stop, const PointCloud& chunk);
  // Makes it a scan; `check_room` is asked on the writer's thread unless the scan is there already,
  // and `committed` is called there once it is durable, whatever becomes of the caller.
  absl::StatusOr<ScanAck> Finish(std::uint64_t ticket,
                                 const Stop& stop,
                                 CheckRoom check_room,
                                 absl::FunctionRef<void(ScanNumber)> committed);
  // The stream has ended. Of an announced scan everything that came goes to disk; any other is
  // forgotten.
  void EndStream(std::uint64_t ticket);
  // What is on disk of an announced scan that is not whole.
  std::optional<UnfinishedUpload> Rest() const;

 private:
  absl::Status CheckTicket(std::uint64_t ticket) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Reads the pieces of parked_ back. If they are damaged or not of this header, begins anew.
  absl::Status Load() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void BeginAnew() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Sends the encoded pieces to disk.
  absl::Status StagePieces(const Stop& stop) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Abandon() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool announced() const { return !header_.content_hash.empty(); }
  UnfinishedUpload Unfinished() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  MapCore& core_;
  const ScanHeader header_;
  mutable absl::Mutex mutex_;
  std::optional<UnfinishedUpload> parked_ ABSL_GUARDED_BY(mutex_);  // not read back yet
  std::uint64_t ticket_ ABSL_GUARDED_BY(mutex_) = 0;
  bool dead_ ABSL_GUARDED_BY(mutex_) = false;               // finished, or refused for good
  std::optional<ScanDraft> draft_ ABSL_GUARDED_BY(mutex_);  // once a stream has begun
  absl::Time touched_ ABSL_GUARDED_BY(mutex_);              // when points last went to disk
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_INGEST_SCAN_INTAKE_H_
