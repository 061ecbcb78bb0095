// What scans arrive at in tests of the server's doors.
#ifndef STRATA_TESTS_SERVER_SCAN_SINK_H_
#define STRATA_TESTS_SERVER_SCAN_SINK_H_

#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"
#include "absl/synchronization/notification.h"

#include "core/world/scan.h"
#include "strata/v1/scans.pb.h"
#include "tests/support/mock_database.h"

namespace strata::server {

// Takes every upload of `db` (of an announced scan the first four points are there), notes which
// scans were committed and which abandoned. Thread-safe.
class ScanSink {
 public:
  explicit ScanSink(::strata::testing::MockDatabase& db);

  // "trajectory/sequence: points", in the order committed.
  std::vector<std::string> committed();
  // Blocks until a scan was let go without a commit.
  void AwaitAbandoned();
  // Finish() of this sequence number answers ALREADY_EXISTS.
  void Refuse(std::uint64_t sequence);

 private:
  class Upload;

  absl::Mutex mutex_;
  std::vector<std::string> committed_ ABSL_GUARDED_BY(mutex_);
  int abandoned_ ABSL_GUARDED_BY(mutex_) = 0;
  std::uint64_t refused_ ABSL_GUARDED_BY(mutex_) = 0;
};

// The start of scan run/`sequence` with so many points, and `points` of them.
v1::ScanStart StartOf(std::uint64_t sequence, std::uint64_t point_count);
v1::PointChunk Points(std::size_t points);

}  // namespace strata::server

#endif  // STRATA_TESTS_SERVER_SCAN_SINK_H_
