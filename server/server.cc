#include "server/server.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/time/clock.h"
#include <glog/logging.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/resource_quota.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>

#include "core/common/host_port.h"
#include "core/common/log_line.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/engine/map/numbers.h"
#include "server/access/grant_table.h"
#include "server/door.h"
#include "server/health.h"
#include "server/metrics/engine_metrics.h"
#include "server/metrics/metrics.h"
#include "server/readiness.h"
#include "server/reflection.h"
#include "server/rpc/connections.h"
#include "server/rpc/listener.h"
#include "server/rpc/runtime.h"
#include "server/server_gauges.h"
#include "server/services/classifiers_service.h"
#include "server/services/jobs_service.h"
#include "server/services/maps_service.h"
#include "server/services/models_service.h"
#include "server/services/planning_service.h"
#include "server/services/posegraph_service.h"
#include "server/services/scans_service.h"
#include "server/services/tiles_service.h"
#include "server/web/web_server.h"
#include "strata/v1/classifiers.grpc.pb.h"
#include "strata/v1/jobs.grpc.pb.h"
#include "strata/v1/maps.grpc.pb.h"
#include "strata/v1/models.grpc.pb.h"
#include "strata/v1/objects.grpc.pb.h"
#include "strata/v1/planning.grpc.pb.h"
#include "strata/v1/posegraph.grpc.pb.h"
#include "strata/v1/scans.grpc.pb.h"
#include "strata/v1/tiles.grpc.pb.h"

namespace strata::server {
namespace {

// A robot that left the network is noticed after about this long.
constexpr int kKeepaliveMs = 30'000;
// Clients that ping more often are sent away.
constexpr int kMinPingIntervalMs = 10'000;
constexpr int kMaxMetadataBytes = 16 << 10;
constexpr int kHandshakeMs = 10'000;
// At a time: all calls that begin in it are made before the first of them is judged.
constexpr int kReadBytes = 8 << 10;
// Memory of all connections together: some 40 KB each, and the messages on their way. Where it is
// used up, new connections are refused.
constexpr std::size_t kTransportBytes = std::size_t{36} << 20;
// A connection without calls; a client that comes again connects again by itself.
constexpr int kIdleConnectionMs = 10 * 60 * 1000;
// Connections of one lane are cut together. gRPC copies all lanes' names for each connection: with
// 256 of them ten thousand connections took half a core for ten seconds.
constexpr int kLanes = 32;
constexpr absl::Duration kReadinessInterval = absl::Seconds(1);
// After the last connection that was refused, or the last commit that failed.
constexpr absl::Duration kRecently = absl::Seconds(10);
// With less room on the disk than both nothing may be committed soon.
constexpr std::uint64_t kLeastDiskBytes = std::uint64_t{64} << 20;
constexpr std::uint64_t kLeastDiskShare = 20;  // of which the disk holds one

RuntimeOptions RuntimeOptionsOf(const ServerOptions& options) {
  return {.query_threads = options.query_threads,
          .stream_threads = options.stream_threads,
          .upload_threads = options.upload_threads,
          .max_query_time = options.max_query_time,
          .max_calls = options.max_calls,
          .max_watches = options.max_watches,
          .slow_reader_timeout = options.slow_reader_timeout,
          .slow_sender_timeout = options.slow_sender_timeout,
          .client = options.client,
          .strangers = {},
          .max_call_bytes = options.max_call_bytes};
}

class GrpcServer final : public Server {
 public:
  GrpcServer(api::Database& database,
             std::unique_ptr<GrantTable> grants,
             const ServerOptions& options)
      : options_(options), runtime_(database, std::move(grants), RuntimeOptionsOf(options)) {}
  ~GrpcServer() override { GrpcServer::Shutdown(); }

  absl::Status Listen(HostPort address);
  const std::string& address() const override { return address_; }
  std::string web_url() const override { return web_ == nullptr ? "" : web_->url(); }
  // After Listen().
  absl::Status OpenWeb();
  absl::Status OpenMetrics();
  void WatchReadiness(std::vector<ReadinessCheck> checks);
  void Shutdown() override;

 private:
  // A lane each: how connections are made, and what becomes of calls before their requests are
  // read.
  std::vector<std::shared_ptr<grpc::ServerCredentials>> Credentials();
  std::vector<grpc::Service*> Services() {
    return {&maps_,
            &scans_,
            &tiles_,
            &planning_,
            &jobs_,
            &posegraph_,
            &classifiers_,
            &models_,
            &objects_,
            &health_};
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
  ModelsService models_{runtime_};
  ObjectsService objects_{runtime_};
  Health health_{runtime_};
  std::string address_;
  std::unique_ptr<Listener> listener_;
  Connections connections_{kLanes};
  std::vector<std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor>>
      acceptors_;  // a lane
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<Readiness> readiness_;
  std::unique_ptr<web::WebServer> web_;
  std::unique_ptr<MetricsEndpoint> metrics_;
};

// Full names of the contract's services.
std::vector<std::string> ContractServices() {
  return {v1::Maps::service_full_name(),
          v1::Scans::service_full_name(),
          v1::Tiles::service_full_name(),
          v1::Planning::service_full_name(),
          v1::Jobs::service_full_name(),
          v1::PoseGraph::service_full_name(),
          v1::Classifiers::service_full_name(),
          v1::Models::service_full_name(),
          v1::Objects::service_full_name()};
}

void SetReady(Health& health, bool ready) {
  for (const std::string& service : ContractServices()) health.Set(service, ready);
}

std::string WhyNoDisk(const EngineHealth& health) {
  const std::uint64_t least = std::min(kLeastDiskBytes, health.disk_bytes / kLeastDiskShare);
  if (health.disk_free_bytes >= least) return "";
  return absl::StrCat(health.disk_free_bytes >> 20, " MiB are free where the maps are");
}

// Checks of the database and of the door.
std::vector<ReadinessCheck> OwnChecks(api::Database& db, const Listener& listener) {
  return {{"disk", [&db] { return WhyNoDisk(HealthOf(db)); }},
          {"maps",
           [&db] {
             const EngineHealth health = HealthOf(db);
             std::vector<std::string> faults = health.maps_taken_away;
             if (!health.maps_not_opened.empty()) {
               faults.push_back(
                   absl::StrCat("not opened: ", absl::StrJoin(health.maps_not_opened, ", ")));
             }
             return absl::StrJoin(faults, "; ");
           }},
          {"commits", [&db] { return absl::StrJoin(HealthOf(db).maps_not_written, "; "); }},
          {"listener", [&listener] {
             return listener.since_refused() > kRecently
                        ? ""
                        : absl::StrCat("connections are refused, ", listener.refused(), " so far");
           }}};
}

// What a connection may cost before its first call, and what one costs that is forgotten.
void LimitConnections(grpc::ServerBuilder& builder, const ServerOptions& options) {
  builder.SetMaxReceiveMessageSize(options.max_message_bytes);
  builder.SetMaxSendMessageSize(-1);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS,
                             kMinPingIntervalMs);
  builder.AddChannelArgument(GRPC_ARG_MAX_METADATA_SIZE, kMaxMetadataBytes);
  builder.AddChannelArgument(GRPC_ARG_TCP_MAX_READ_CHUNK_SIZE, kReadBytes);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS,
                             options.client.max_calls + options.client.max_watches);
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, kHandshakeMs);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS, kIdleConnectionMs);
  // gRPC unpacks a request before anybody is asked who sent it: 4 MiB may become 4 GiB.
  for (const grpc_compression_algorithm packed : {GRPC_COMPRESS_DEFLATE, GRPC_COMPRESS_GZIP}) {
    builder.SetCompressionAlgorithmSupportStatus(packed, false);
  }
  builder.SetResourceQuota(grpc::ResourceQuota("connections").Resize(kTransportBytes));
}

std::vector<std::shared_ptr<grpc::ServerCredentials>> GrpcServer::Credentials() {
  std::vector<std::shared_ptr<grpc::ServerCredentials>> lanes;
  if (options_.tls.enabled()) lanes = TlsCredentials(options_.tls, kLanes);
  for (int lane = 0; lane < kLanes; ++lane) {
    auto door = std::make_shared<Door>(runtime_, connections_, lane);
    if (options_.tls.enabled()) {
      lanes[static_cast<std::size_t>(lane)]->SetAuthMetadataProcessor(std::move(door));
    } else {
      lanes.push_back(PlainCredentials(std::move(door)));
    }
  }
  return lanes;
}

absl::Status GrpcServer::Listen(HostPort address) {
  STRATA_ASSIGN_OR_RETURN(listener_, Listener::Open(address));
  grpc::ServerBuilder builder;
  for (const auto& credentials : Credentials()) {
    acceptors_.push_back(builder.experimental().AddExternalConnectionAcceptor(
        grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD, credentials));
  }
  LimitConnections(builder, options_);
  const bool guarded = options_.token_file.empty() || options_.tls.enabled();
  if (!guarded) LeaveOutReflection(builder);
  health_.Set("liveness", true);
  for (grpc::Service* service : Services()) builder.RegisterService(service);
  server_ = builder.BuildAndStart();
  if (server_ == nullptr) return absl::UnavailableError("gRPC's server does not start");
  listener_->Accept([this](int fd) {
    grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters connection;
    connection.fd = fd;
    const std::optional<int> lane = connections_.Add(fd, SteadyNow());
    if (!lane.has_value()) return false;
    acceptors_[static_cast<std::size_t>(*lane)]->HandleNewConnection(&connection);
    return true;
  });
  address.port = listener_->port();
  address_ = address.ToString();
  return absl::OkStatus();
}

void GrpcServer::WatchReadiness(std::vector<ReadinessCheck> checks) {
  for (ReadinessCheck& own : OwnChecks(runtime_.db, *listener_)) checks.push_back(std::move(own));
  readiness_ = std::make_unique<Readiness>(
      std::move(checks), kReadinessInterval, [this](bool ready) { SetReady(health_, ready); });
}

absl::Status GrpcServer::OpenWeb() {
  if (options_.web_listen.empty()) return absl::OkStatus();
  STRATA_ASSIGN_OR_RETURN(const HostPort listen, ParseHostPort(options_.web_listen));
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  STRATA_ASSIGN_OR_RETURN(
      web_,
      web::WebServer::Open(
          {.listen = listen,
           .names = options_.web_names,
           .viewer = options_.web_viewer,
           .tls = options_.tls,
           .max_body_bytes = static_cast<std::size_t>(options_.max_message_bytes),
           .max_bodies_bytes = options_.max_call_bytes,
           .max_connections = static_cast<std::size_t>(options_.max_calls + options_.max_watches),
           .slow_sender_timeout = options_.slow_sender_timeout,
           .slow_reader_timeout = options_.slow_reader_timeout,
           .services = ContractServices(),
           .known =
               [this](absl::string_view authorization) {
                 return runtime_.access.Authenticate(authorization, "").status();
               }},
          server_->InProcessChannel(arguments)));
  LOG(INFO) << LogLine("web").Add("listen", web_->url());
  return absl::OkStatus();
}

absl::Status GrpcServer::OpenMetrics() {
  if (options_.metrics_listen.empty()) return absl::OkStatus();
  const auto gauges = [this, started = SteadyNow()](MetricFamilies& families) {
    AddProcess(families, started);
    AddCalls(families, runtime_);
    AddCertificate(families, options_.tls);
    AddDoor(families, *listener_, connections_, *readiness_);
    if (web_ != nullptr) AddWeb(families, *web_);
    AddEngine(families, NumbersOf(runtime_.db));
    AddDisk(families, HealthOf(runtime_.db));
  };
  STRATA_ASSIGN_OR_RETURN(metrics_,
                          MetricsEndpoint::Open(options_.metrics_listen, runtime_.metrics, gauges));
  LOG(INFO) << LogLine("metrics").Add("listen", metrics_->address());
  return absl::OkStatus();
}

void GrpcServer::Shutdown() {
  if (server_ == nullptr || runtime_.shutting_down.exchange(true)) return;
  metrics_.reset();  // it looks at the database
  readiness_.reset();
  health_.Shutdown();
  if (web_ != nullptr) web_->StopAccepting();
  // gRPC's own draining would also wait for clients that keep an idle connection.
  const absl::Time drained = SteadyNow() + options_.drain_timeout;
  runtime_.calls.AwaitEmpty(options_.drain_timeout);
  runtime_.watches.AwaitEmpty(drained - SteadyNow());
  listener_->Close();
  if (web_ != nullptr) web_->Close();
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
  check("client.max_calls", client.max_calls, 1, 1'000'000);
  check("client.max_watches", client.max_watches, 1, 1'000'000);
  check("max_message_bytes", max_message_bytes, 64 << 10, 64 << 20);
  const auto check_bytes = [this, &faults](const char* name, std::size_t value) {
    constexpr std::size_t kMost = std::size_t{1} << 40;
    const auto least = static_cast<std::size_t>(max_message_bytes);
    if (value >= least && value <= kMost) return;
    faults.push_back(
        absl::StrCat(name, " = ", value, " is not in [max_message_bytes = ", least, ", 2^40]"));
  };
  check_bytes("client.max_bytes", client.max_bytes);
  check_bytes("max_call_bytes", max_call_bytes);
  if (!(client.calls_per_second >= 0.0 && client.calls_per_second <= 1e6)) {
    faults.emplace_back("client.calls_per_second is not in [0, 1000000]");
  }
  if (!(client.burst >= 1.0 && client.burst <= 1e6)) {
    faults.emplace_back("client.burst is not in [1, 1000000]");
  }
  if (tls.certificate.empty() != tls.key.empty()) {
    faults.emplace_back("of the TLS certificate and its key only one is given");
  }
  if (!tls.client_ca.empty() && !tls.enabled()) {
    faults.emplace_back("client certificates need a TLS certificate and its key");
  }
  if (!(max_query_time > absl::ZeroDuration())) {
    faults.emplace_back("max_query_time is not positive");
  }
  if (!(slow_reader_timeout > absl::ZeroDuration())) {
    faults.emplace_back("slow_reader_timeout is not positive");
  }
  if (!(slow_sender_timeout > absl::ZeroDuration())) {
    faults.emplace_back("slow_sender_timeout is not positive");
  }
  if (!(drain_timeout >= absl::ZeroDuration())) faults.emplace_back("drain_timeout is negative");
  if (faults.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("server: ", absl::StrJoin(faults, "; ")));
}

namespace {

// Of an address that gRPC or HTTP is to be offered at.
absl::Status CheckListener(const ServerOptions& options, const std::string& listen) {
  STRATA_ASSIGN_OR_RETURN(const HostPort address, ParseHostPort(listen));
  if (address.loopback() || options.insecure) return absl::OkStatus();
  const auto refused = [&address](absl::string_view why) {
    return absl::FailedPreconditionError(
        absl::StrCat("will not listen on ", address.ToString(), ": ", why));
  };
  const bool asks = !options.token_file.empty() || !options.tls.client_ca.empty();
  if (!asks) {
    return refused(
        "anyone who reaches it could read and change every map; give --tls-cert, --tls-key and "
        "--tokens (or --tls-client-ca), or use a loopback address or --insecure");
  }
  if (!options.tls.enabled()) {
    return refused(
        "tokens and maps would cross the network in plain text; give --tls-cert and --tls-key, or "
        "use a loopback address or --insecure");
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckExposure(const ServerOptions& options) {
  STRATA_RETURN_IF_ERROR(options.Validate());
  if (!options.metrics_listen.empty()) {
    STRATA_ASSIGN_OR_RETURN(const HostPort metrics, ParseHostPort(options.metrics_listen));
    if (!metrics.loopback() && !options.insecure) {
      return absl::FailedPreconditionError(absl::StrCat(
          "will not serve metrics on ",
          metrics.ToString(),
          ": they are for anybody and name the maps; use a loopback address or --insecure"));
    }
  }
  STRATA_RETURN_IF_ERROR(CheckListener(options, options.listen));
  return options.web_listen.empty() ? absl::OkStatus() : CheckListener(options, options.web_listen);
}

absl::StatusOr<std::unique_ptr<Server>> Server::Start(api::Database& database,
                                                      const ServerOptions& options,
                                                      std::vector<ReadinessCheck> checks) {
  STRATA_RETURN_IF_ERROR(CheckExposure(options));
  STRATA_ASSIGN_OR_RETURN(const HostPort address, ParseHostPort(options.listen));
  if (options.tls.enabled()) STRATA_RETURN_IF_ERROR(CheckTls(options.tls, absl::Now()).status());
  std::unique_ptr<GrantTable> grants;
  if (!options.token_file.empty()) {
    STRATA_ASSIGN_OR_RETURN(grants, GrantTable::Open(options.token_file));
  }
  // Process-wide and idempotent; it must precede the builder.
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  auto server = std::make_unique<GrpcServer>(database, std::move(grants), options);
  STRATA_RETURN_IF_ERROR(server->Listen(address));
  server->WatchReadiness(std::move(checks));
  STRATA_RETURN_IF_ERROR(server->OpenWeb());
  STRATA_RETURN_IF_ERROR(server->OpenMetrics());
  return server;
}

}  // namespace strata::server
