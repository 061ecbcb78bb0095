// A call of one of this server's own services, by the channel within the process.
#ifndef STRATA_SERVER_WEB_CALL_H_
#define STRATA_SERVER_WEB_CALL_H_

#include <functional>
#include <memory>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include <grpcpp/client_context.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/client_callback.h>
#include <grpcpp/support/status.h>

#include "server/web/exchange.h"

namespace strata::server::web {

// Calls that have begun and not ended. Thread-safe.
class CallCount {
 public:
  void Begin() {
    absl::MutexLock lock(&mutex_);
    ++count_;
  }
  void End() {
    absl::MutexLock lock(&mutex_);
    --count_;
  }
  int count() const {
    absl::MutexLock lock(&mutex_);
    return count_;
  }
  void AwaitNone() const {
    absl::MutexLock lock(&mutex_);
    mutex_.Await(absl::Condition(
        +[](const int* count) { return *count == 0; }, &count_));
  }

 private:
  mutable absl::Mutex mutex_;
  int count_ ABSL_GUARDED_BY(mutex_) = 0;
};

// What a call takes with it.
struct CallHead {
  std::string path;           // "/strata.v1.Maps/Get"
  std::string authorization;  // empty: none
  std::string request_id;     // empty: the server makes one
  std::string peer;           // whose call it is
  absl::Duration timeout = absl::InfiniteDuration();
};

// Told on gRPC's threads, one at a time.
struct CallEvents {
  // A message; the next comes after ReadNext().
  std::function<void(std::string bytes)> on_message;
  // Once and last. `request_id` as the server's log has it; may be empty.
  std::function<void(const grpc::Status& status, const std::string& request_id)> on_end;
};

// Brings one message and takes any number, one by one: the service is held back by whoever does not
// ask for the next. Keeps itself alive until its end. Thread-safe.
class OutgoingCall final : public Exchange,
                           public std::enable_shared_from_this<OutgoingCall>,
                           private grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  // `stub` and `count` must outlive the call. The values of `head` are printable ASCII, or gRPC
  // aborts.
  static std::shared_ptr<OutgoingCall> Make(CallCount& count,
                                            const CallHead& head,
                                            absl::string_view request,
                                            CallEvents events);
  // Once. Asks for the first message, too.
  void Start(grpc::GenericStub& stub);
  // After a message that has come.
  void ReadNext();
  void Cancel() override;

 private:
  OutgoingCall(CallCount& count,
               const CallHead& head,
               absl::string_view request,
               CallEvents events);

  void OnReadDone(bool ok) override;
  void OnDone(const grpc::Status& status) override;

  CallCount& count_;
  const std::string path_;
  CallEvents events_;  // until OnDone(), since they hold what holds the call
  grpc::ClientContext context_;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer answer_;
  absl::Mutex mutex_;
  bool reading_ ABSL_GUARDED_BY(mutex_) = true;
  bool cancelled_ ABSL_GUARDED_BY(mutex_) = false;
  bool ended_ ABSL_GUARDED_BY(mutex_) = false;
  std::shared_ptr<OutgoingCall> self_;  // until OnDone()
};

}  // namespace strata::server::web

#endif  // STRATA_SERVER_WEB_CALL_H_
