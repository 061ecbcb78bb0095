#include "server/door.h"

#include <cstddef>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/strip.h"
#include <grpc/grpc.h>
#include <grpc/grpc_security.h>
#include <grpc/slice.h>

#include "core/common/steady_time.h"
#include "proto/translate/status.h"
#include "server/access/method_rights.h"
#include "server/health.h"
#include "server/rpc/request.h"

namespace strata::server {
namespace {

constexpr absl::string_view kReflection = "/grpc.reflection.";

// As in "Maps.Get"; of another service's path nothing that is known.
std::string MethodOf(absl::string_view path) {
  if (!absl::ConsumePrefix(&path, "/strata.v1.")) return "";
  return absl::StrReplaceAll(path, {{"/", "."}});
}

absl::Status Unknown() { return absl::UnimplementedError("this server has no such service"); }

absl::Status TooFast() {
  return absl::ResourceExhaustedError("more calls have come in than can be dealt with; try later");
}

absl::string_view TextOf(const grpc_slice& slice) {
  return {reinterpret_cast<const char*>(GRPC_SLICE_START_PTR(slice)), GRPC_SLICE_LENGTH(slice)};
}

class Plain final : public grpc::ServerCredentials {
 public:
  explicit Plain(std::shared_ptr<Door> door)
      : credentials_(grpc_insecure_server_credentials_create()) {
    grpc_server_credentials_set_auth_metadata_processor(
        credentials_,
        {.process = &Process,
         .destroy = &Destroy,
         .state = new std::shared_ptr<Door>(std::move(door))});
  }
  ~Plain() override { grpc_server_credentials_release(credentials_); }
  // The door stands there already.
  void SetAuthMetadataProcessor(
      const std::shared_ptr<grpc::AuthMetadataProcessor>& /*processor*/) override {}

 private:
  int AddPortToServer(const std::string& address, grpc_server* server) override {
    return grpc_server_add_http2_port(server, address.c_str(), credentials_);
  }
  static void Process(void* door,
                      grpc_auth_context* /*context*/,
                      const grpc_metadata* metadata,
                      std::size_t count,
                      grpc_process_auth_metadata_done_cb done,
                      void* call) {
    absl::string_view path;
    absl::string_view authorization;
    for (std::size_t i = 0; i < count; ++i) {
      const absl::string_view key = TextOf(metadata[i].key);
      if (key == ":path") path = TextOf(metadata[i].value);
      if (key == kAuthorizationKey) authorization = TextOf(metadata[i].value);
    }
    const absl::Status status =
        (*static_cast<std::shared_ptr<Door>*>(door))->Judge(path, authorization, "");
    done(call,
         nullptr,
         0,
         nullptr,
         0,
         static_cast<grpc_status_code>(status.code()),
         status.ok() ? nullptr : std::string(status.message()).c_str());
  }
  static void Destroy(void* door) { delete static_cast<std::shared_ptr<Door>*>(door); }

  grpc_server_credentials* const credentials_;
};

}  // namespace

absl::Status Door::Judge(absl::string_view path,
                         absl::string_view authorization,
                         absl::string_view certificate_name) {
  const absl::Time now = SteadyNow();
  if (path == Health::kCheck || path == Health::kWatch) {
    return Take(runtime_.ArrivalsOf(path).Enter(path, lane_, now), now) ? absl::OkStatus()
                                                                        : TooFast();
  }
  const absl::StatusOr<Caller> caller =
      runtime_.access.Authenticate(authorization, certificate_name);
  const std::string method = MethodOf(path);
  if (caller.ok()) {
    if (method.empty() && !absl::StartsWith(path, kReflection)) return Unknown();
    const bool in = Take(runtime_.ArrivalsOf(path).Enter(caller->principal, lane_, now), now);
    return in ? absl::OkStatus() : TooFast();
  }
  const bool known_method = FindMethodRight(method) != nullptr;
  // Few, since what each may send is as much as the largest request.
  if (known_method && Take(runtime_.strangers.Hear(lane_, now), now)) return absl::OkStatus();
  if (known_method) runtime_.metrics.Ended(method, caller.status().code(), {}, 0, 0, kStranger);
  return caller.status();
}

bool Door::Take(const Arrival& arrival, absl::Time now) {
  for (const int lane : arrival.cut_lanes) connections_.Cut(lane, now);
  return arrival.in;
}

grpc::Status Door::Process(const InputMetadata& metadata,
                           grpc::AuthContext* context,
                           OutputMetadata* /*consumed*/,
                           OutputMetadata* /*response*/) {
  const auto value = [&metadata](const char* key) {
    const auto found = metadata.find(key);
    return found == metadata.end() ? absl::string_view()
                                   : absl::string_view(found->second.data(), found->second.size());
  };
  return translate::ToGrpcStatus(
      Judge(value(":path"), value(kAuthorizationKey), CertificateNameOf(*context)), "");
}

std::shared_ptr<grpc::ServerCredentials> PlainCredentials(std::shared_ptr<Door> door) {
  return std::make_shared<Plain>(std::move(door));
}

}  // namespace strata::server
