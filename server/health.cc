#include "server/health.h"

#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <google/protobuf/wrappers.pb.h>
#include <grpcpp/impl/codegen/proto_utils.h>  // what sends answers
#include <grpcpp/impl/codegen/server_callback_handlers.h>
#include <grpcpp/impl/rpc_method.h>
#include <grpcpp/impl/rpc_service_method.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/proto_buffer_reader.h>
#include <grpcpp/support/server_callback.h>

#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "proto/translate/status.h"
#include "server/rpc/request.h"
#include "server/rpc/sealed.h"

namespace strata::server {
namespace {

// Their bytes are those of HealthCheckRequest and HealthCheckResponse.
using Asked = google::protobuf::StringValue;
using Told = google::protobuf::Int32Value;

constexpr int kServing = 1;
constexpr int kNotServing = 2;
constexpr int kServiceUnknown = 3;

const char* PathOf(ClientLimits::Kind kind) {
  return kind == ClientLimits::Kind::kCall ? Health::kCheck : Health::kWatch;
}

// A watch counts among the calls until it is read.
ClientLimitOptions HostLimits(int max_requests, int max_watches) {
  ClientLimitOptions options;
  options.max_calls = max_requests;
  options.max_watches = max_watches;
  return options;
}

}  // namespace

// A check or a watch; lives from the call's arrival to its end, and owns itself.
class HealthReactor final : public grpc::ServerBidiReactor<Sealed<Asked>, Told> {
 public:
  using Kind = ClientLimits::Kind;

  HealthReactor(Health& health, grpc::CallbackServerContext& context, Kind kind)
      : health_(health), context_(context), kind_(kind), host_(HostOf(PeerOf(context))) {
    health_.runtime_.ArrivalsOf(PathOf(kind_)).Begin(PathOf(kind_), SteadyNow());
    const absl::Status entered = Enter();
    if (entered.ok()) {
      health_.readers_.Submit(host_, [this] { Read(); });
    } else {
      End(entered);
    }
  }
  ~HealthReactor() override {
    if (counted_.has_value()) health_.hosts_.Leave(host_, *counted_);
    health_.requests_.End();
    health_.requests_.Leave();
    health_.runtime_.ArrivalsOf(PathOf(kind_)).Leave(PathOf(kind_));
  }

  // Sends what it was not told yet. The mutex of `health` must be held.
  void Tell() {
    health_.mutex_.AssertHeld();
    const int state = health_.StateOf(service_);
    if (writing_ || state == out_.value()) return;
    out_.set_value(state);
    writing_ = true;
    StartWrite(&out_);
  }

 private:
  absl::Status Enter() {
    const bool room = health_.requests_.Enter();
    STRATA_RETURN_IF_ERROR(CountAs(Kind::kCall));
    if (room) return absl::OkStatus();
    return absl::ResourceExhaustedError("too many ask for health; try again later");
  }

  absl::Status CountAs(Kind kind) {
    STRATA_RETURN_IF_ERROR(health_.hosts_.Enter(host_, kind, SteadyNow()));
    if (counted_.has_value()) health_.hosts_.Leave(host_, *counted_);
    counted_ = kind;
    return absl::OkStatus();
  }

  // On a thread of its own, as long as the request is coming in.
  void Read() {
    StartRead(&sealed_);
    bool there = false;
    {
      absl::MutexLock lock(&mutex_);
      if (!mutex_.AwaitWithTimeout(absl::Condition(&read_), Health::kPatience)) {
        context_.TryCancel();
        mutex_.Await(absl::Condition(&read_));
      }
      there = read_ok_;
    }
    there = there && Open();
    sealed_.bytes.Clear();
    if (!there) {
      End(absl::InvalidArgumentError("this is no request for health"));
    } else if (kind_ == Kind::kCall) {
      Check();
    } else {
      Watch();
    }
  }
  bool Open() {
    constexpr std::size_t kMostBytes = 4096;  // what is parsed takes many times as much
    if (sealed_.bytes.Length() > kMostBytes) return false;
    Asked asked;
    grpc::ProtoBufferReader reader(&sealed_.bytes);
    if (!asked.ParseFromZeroCopyStream(&reader)) return false;
    service_ = asked.value();
    return true;
  }
  void OnReadDone(bool ok) override {
    absl::MutexLock lock(&mutex_);
    read_ = true;
    read_ok_ = ok;
  }

  void Check() {
    {
      absl::MutexLock lock(&health_.mutex_);
      out_.set_value(health_.StateOf(service_));
    }
    if (out_.value() == kServiceUnknown) {
      End(absl::NotFoundError("this server has no such service"));
    } else {
      StartWriteAndFinish(&out_, grpc::WriteOptions(), grpc::Status::OK);
    }
  }

  void Watch() {
    if (const absl::Status entered = CountAs(Kind::kWatch); !entered.ok()) return End(entered);
    {
      absl::MutexLock lock(&health_.mutex_);
      if (!gone_) {
        health_.watches_.insert(this);
        Tell();
        return;
      }
    }
    End(absl::CancelledError("the watcher has gone"));
  }
  void OnWriteDone(bool ok) override {
    if (kind_ == Kind::kCall) return;
    {
      absl::MutexLock lock(&health_.mutex_);
      writing_ = false;
      if (ok) {
        if (health_.watches_.count(this) == 1) Tell();
        return;
      }
    }
    OnCancel();
  }
  void OnCancel() override {
    {
      absl::MutexLock lock(&health_.mutex_);
      gone_ = true;
      if (health_.watches_.erase(this) == 0) return;
    }
    End(absl::CancelledError("the watcher has gone"));
  }
  void OnDone() override { delete this; }

  void End(const absl::Status& status) { Finish(translate::ToGrpcStatus(status, "")); }

  Health& health_;
  grpc::CallbackServerContext& context_;
  const Kind kind_;
  const std::string host_;
  std::optional<Kind> counted_;  // as what of its host
  absl::Mutex mutex_;
  bool read_ ABSL_GUARDED_BY(mutex_) = false;
  bool read_ok_ ABSL_GUARDED_BY(mutex_) = false;
  Sealed<Asked> sealed_;
  std::string service_;
  Told out_;  // told last, or being told
  bool writing_ ABSL_GUARDED_BY(health_.mutex_) = false;
  bool gone_ ABSL_GUARDED_BY(health_.mutex_) = false;
};

Health::Health(Runtime& runtime)
    : runtime_(runtime),
      hosts_(HostLimits(kHostRequests, kHostWatches), 0),
      requests_(kRequests, "health requests"),
      serving_({{"", true}}),
      readers_(kReads, "health") {
  using Handler = grpc::internal::CallbackBidiHandler<Sealed<Asked>, Told>;
  const auto add = [this](int index, ClientLimits::Kind kind) {
    AddMethod(new grpc::internal::RpcServiceMethod(
        PathOf(kind), grpc::internal::RpcMethod::BIDI_STREAMING, nullptr));
    MarkMethodCallback(index, new Handler([this, kind](grpc::CallbackServerContext* context) {
                         return new HealthReactor(*this, *context, kind);
                       }));
  };
  add(0, ClientLimits::Kind::kCall);
  add(1, ClientLimits::Kind::kWatch);
}

int Health::StateOf(const std::string& service) const {
  const auto found = serving_.find(service);
  if (found == serving_.end()) return kServiceUnknown;
  return found->second && !shut_down_ ? kServing : kNotServing;
}

void Health::TellAll() {
  for (HealthReactor* watch : watches_) watch->Tell();
}

void Health::Set(const std::string& service, bool serving) {
  absl::MutexLock lock(&mutex_);
  serving_[service] = serving;
  TellAll();
}

void Health::Shutdown() {
  absl::MutexLock lock(&mutex_);
  shut_down_ = true;
  TellAll();
}

}  // namespace strata::server
