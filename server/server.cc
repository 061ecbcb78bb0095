#include "server/server.h"

#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>

#include "core/common/status.h"
#include "server/listen_address.h"
#include "server/rpc/runtime.h"
#include "server/services/classifiers_service.h"
#include "server/services/jobs_service.h"
#include "server/services/maps_service.h"
#include "server/services/planning_service.h"
#include "server/services/posegraph_service.h"
#include "server/services/scans_service.h"
#include "server/services/tiles_service.h"

namespace strata::server {
namespace {

constexpr int kMaxReceiveBytes = 4 << 20;
// A robot that left the network is noticed after about this long.
constexpr int kKeepaliveMs = 30'000;

RuntimeOptions RuntimeOptionsOf(const ServerOptions& options) {
  return {.query_threads = options.query_threads,
          .stream_threads = options.stream_threads,
          .upload_threads = options.upload_threads,
          .max_calls = options.max_calls,
          .max_watches = options.max_watches,
          .slow_reader_timeout = options.slow_reader_timeout};
}

class GrpcServer final : public Server {
 public:
  GrpcServer(api::Database& database, const ServerOptions& options)
      : options_(options), runtime_(database, RuntimeOptionsOf(options)) {}
  ~GrpcServer() override { GrpcServer::Shutdown(); }

  absl::Status Listen(ListenAddress address);
  const std::string& address() const override { return address_; }
  void Shutdown() override;

 private:
  std::vector<grpc::Service*> Services() {
    return {&maps_, &scans_, &tiles_, &planning_, &jobs_, &posegraph_, &classifiers_};
  }

  const ServerOptions options_;
  Runtime runtime_;
  MapsService maps_{runtime_};
  ScansService scans_{runtime_};
  TilesService tiles_{runtime_};
  PlanningService planning_{runtime_};
  JobsService jobs_{runtime_};
  PoseGraphService posegraph_{runtime_};
  ClassifiersService classifiers_{runtime_};
  std::string address_;
  std::unique_ptr<grpc::Server> server_;
};

void SetServingForEach(grpc::HealthCheckServiceInterface& health) {
  for (const char* service : {v1::Maps::service_full_name(),
                              v1::Scans::service_full_name(),
                              v1::Tiles::service_full_name(),
                              v1::Planning::service_full_name(),
                              v1::Jobs::service_full_name(),
                              v1::PoseGraph::service_full_name(),
                              v1::Classifiers::service_full_name()}) {
    health.SetServingStatus(service, true);
  }
}

absl::Status GrpcServer::Listen(ListenAddress address) {
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort(address.ToString(), grpc::InsecureServerCredentials(), &port);
  builder.SetMaxReceiveMessageSize(kMaxReceiveBytes);
  builder.SetMaxSendMessageSize(-1);
  // A second server on the same port is an error, not a lottery.
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  for (grpc::Service* service : Services()) builder.RegisterService(service);
  server_ = builder.BuildAndStart();
  if (server_ == nullptr || port == 0) {
    return absl::UnavailableError(
        absl::StrCat("cannot listen on ", address.ToString(), "; is the port in use?"));
  }
  address.port = port;
  address_ = address.ToString();
  SetServingForEach(*server_->GetHealthCheckService());
  return absl::OkStatus();
}

void GrpcServer::Shutdown() {
  if (server_ == nullptr || runtime_.shutting_down.exchange(true)) return;
  server_->GetHealthCheckService()->SetServingStatus(false);
  // gRPC's own draining would also wait for clients that keep an idle connection.
  const absl::Time drained = absl::Now() + options_.drain_timeout;
  runtime_.calls.AwaitEmpty(options_.drain_timeout);
  runtime_.watches.AwaitEmpty(drained - absl::Now());
  server_->Shutdown(absl::ToChronoTime(absl::Now()));
  server_->Wait();
  // The last calls may still be giving back what they hold.
  runtime_.calls.AwaitEmpty(absl::InfiniteDuration());
  runtime_.watches.AwaitEmpty(absl::InfiniteDuration());
}

}  // namespace

absl::Status ServerOptions::Validate() const {
  std::vector<std::string> faults;
  const auto check = [&faults](const char* name, int value, int low, int high) {
    if (value >= low && value <= high) return;
    faults.push_back(absl::StrCat(name, " = ", value, " is not in [", low, ", ", high, "]"));
  };
  check("query_threads", query_threads, 1, 1000);
  check("stream_threads", stream_threads, 1, 1000);
  check("upload_threads", upload_threads, 1, 1000);
  check("max_calls", max_calls, 1, 1'000'000);
  check("max_watches", max_watches, 1, 1'000'000);
  if (!(slow_reader_timeout > absl::ZeroDuration())) {
    faults.emplace_back("slow_reader_timeout is not positive");
  }
  if (!(drain_timeout >= absl::ZeroDuration())) faults.emplace_back("drain_timeout is negative");
  if (faults.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("server: ", absl::StrJoin(faults, "; ")));
}

absl::StatusOr<std::unique_ptr<Server>> Server::Start(api::Database& database,
                                                      const ServerOptions& options) {
  STRATA_RETURN_IF_ERROR(options.Validate());
  STRATA_ASSIGN_OR_RETURN(const ListenAddress address, ParseListenAddress(options.listen));
  if (!address.loopback() && !options.insecure) {
    return absl::FailedPreconditionError(absl::StrCat(
        "will not listen on ",
        address.ToString(),
        ": anyone who reaches it could read and change every map, since TLS and tokens "
        "are not there yet; use a loopback address or --insecure"));
  }
  // Both are process-wide and idempotent; they must precede the builder.
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  auto server = std::make_unique<GrpcServer>(database, options);
  STRATA_RETURN_IF_ERROR(server->Listen(address));
  return server;
}

}  // namespace strata::server
