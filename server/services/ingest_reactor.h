// Scans.Ingest: many scans on one stream, both ways.
#ifndef STRATA_SERVER_SERVICES_INGEST_REACTOR_H_
#define STRATA_SERVER_SERVICES_INGEST_REACTOR_H_

#include <cstdint>
#include <deque>
#include <optional>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"

#include "core/world/scan.h"
#include "server/rpc/request.h"
#include "server/rpc/runtime.h"
#include "server/rpc/sealed.h"
#include "server/services/scan_receiver.h"
#include "strata/v1/scans.grpc.pb.h"

namespace strata::server {

// Three chains that each have at most one step under way: reading (a message is taken before the
// next is read), committing (in the order sent, so that the last committed sequence tells where to
// resume) and writing answers. Reading pauses while kMaxUnanswered scans wait for their answers.
// Lives from the call's arrival to its end; owns itself.
class IngestReactor final
    : public grpc::ServerBidiReactor<Sealed<v1::IngestScansRequest>, v1::IngestScansResponse> {
 public:
  using In = v1::IngestScansRequest;
  using Out = v1::IngestScansResponse;

  IngestReactor(Runtime& runtime, grpc::CallbackServerContext& context);

 private:
  // A scan that has ended: complete, or refused with an error.
  struct Ended {
    v1::ScanId id;
    std::optional<ScanReceiver> scan;
    absl::Status error;
  };

  void Read();
  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override { request_.Cancel(); }
  void OnDone() override;

  // Reading, on an upload thread. An error ends the stream.
  void Take();
  absl::Status TakeMessage();
  // `allowed`: whether the caller may write to the scan's map; if not, the scan is answered so.
  void Begin(const v1::ScanStart& start, const absl::Status& allowed);
  // Tells the client where the points of the scan begun are to go on.
  void Accept(std::uint64_t points_held);
  absl::Status Add(const v1::PointChunk& chunk, const absl::Status& allowed);
  // The scan under way will not be completed.
  void AbandonIncomplete();
  void EndScan(const absl::Status& error);
  void EndReading(const absl::Status& status);

  // Committing, on an upload thread.
  void Commit();
  v1::IngestScansResponse Answer(Ended& ended);

  // Each decides under the mutex what may start now; none blocks. A chain's step ends with them:
  // once the mutex is free, the stream may be gone.
  void StartCommitIfIdle() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void StartWriteIfIdle() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void StartReadIfRoom() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool Done() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void FinishIfDone() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  Runtime& runtime_;
  Request request_;
  Booking in_memory_;

  // Touched by the reading chain alone.
  Sealed<In> message_;
  v1::ScanId current_id_;
  std::optional<ScanReceiver> current_;
  bool passing_over_ = false;  // the rest of a refused scan
  ExpectedMessage expected_;

  absl::Mutex mutex_;
  bool reading_ ABSL_GUARDED_BY(mutex_) = true;
  bool reading_ended_ ABSL_GUARDED_BY(mutex_) = false;
  absl::Status stream_status_ ABSL_GUARDED_BY(mutex_);
  bool committing_ ABSL_GUARDED_BY(mutex_) = false;
  std::deque<Ended> ended_ ABSL_GUARDED_BY(mutex_);
  bool writing_ ABSL_GUARDED_BY(mutex_) = false;
  std::deque<v1::IngestScansResponse> answers_ ABSL_GUARDED_BY(mutex_);  // front is being written
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_INGEST_REACTOR_H_
