#include "client/sdk/client.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <fstream>
#include <iterator>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/time/clock.h"
#include <arpa/inet.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "client/sdk/answering.h"
#include "client/sdk/connection.h"
#include "client/sdk/remote_classifiers.h"
#include "client/sdk/remote_jobs.h"
#include "client/sdk/remote_maps.h"
#include "client/sdk/remote_models.h"
#include "client/sdk/remote_objects.h"
#include "client/sdk/remote_planning.h"
#include "client/sdk/remote_posegraph.h"
#include "client/sdk/remote_scans.h"
#include "client/sdk/remote_tiles.h"
#include "core/common/host_port.h"
#include "core/common/status.h"

namespace strata {
namespace {

// Answers are bounded by their requests, the largest is a column of many levels at 10,000 places.
constexpr int kMaxReceiveBytes = 64 << 20;
// A server that comes back is found again within a second.
constexpr int kMaxReconnectMs = 1000;
constexpr absl::Duration kShortestKeepalive = absl::Seconds(10);
constexpr absl::Duration kLongestKeepalive = absl::Hours(1);

std::vector<std::string> ServersOf(const std::string& target) {
  return absl::StrSplit(target, ',');
}

bool IsOnThisMachine(const std::string& server) {
  if (absl::StartsWith(server, "unix:")) return true;
  const absl::StatusOr<HostPort> address = ParseHostPort(server);
  return address.ok() && address->loopback();
}

bool OnThisMachine(const std::string& target) {
  const std::vector<std::string> servers = ServersOf(target);
  return std::all_of(servers.begin(), servers.end(), IsOnThisMachine);
}

// The first IPv4 address of a server, with its port.
absl::StatusOr<std::string> AddressOf(const std::string& server) {
  STRATA_ASSIGN_OR_RETURN(const HostPort named, ParseHostPort(server));
  addrinfo wanted{};
  wanted.ai_family = AF_INET;
  wanted.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (getaddrinfo(named.host.c_str(), nullptr, &wanted, &found) != 0 || found == nullptr) {
    return absl::UnavailableError(absl::StrCat("no IPv4 address is known of ", server));
  }
  std::array<char, INET_ADDRSTRLEN> text{};
  const auto* const address = reinterpret_cast<const sockaddr_in*>(found->ai_addr);
  inet_ntop(AF_INET, &address->sin_addr, text.data(), text.size());
  freeaddrinfo(found);
  return absl::StrCat(text.data(), ":", named.port);
}

// As gRPC takes it.
absl::StatusOr<std::string> ChannelTarget(const std::string& target) {
  const std::vector<std::string> servers = ServersOf(target);
  if (servers.size() == 1) return target;
  std::vector<std::string> addresses;
  for (const std::string& server : servers) {
    STRATA_ASSIGN_OR_RETURN(addresses.emplace_back(), AddressOf(server));
  }
  return absl::StrCat("ipv4:", absl::StrJoin(addresses, ","));
}

absl::StatusOr<std::string> ReadFile(const std::string& path) {
  if (path.empty()) return std::string();
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (!file.is_open() || file.bad()) {
    return absl::ErrnoToStatus(errno, absl::StrCat("cannot read ", path));
  }
  return bytes;
}

absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> CredentialsOf(const ClientTls& tls) {
  if (!tls.enabled()) return grpc::InsecureChannelCredentials();
  grpc::SslCredentialsOptions options;
  STRATA_ASSIGN_OR_RETURN(options.pem_root_certs, ReadFile(tls.ca_file));
  STRATA_ASSIGN_OR_RETURN(options.pem_cert_chain, ReadFile(tls.certificate_file));
  STRATA_ASSIGN_OR_RETURN(options.pem_private_key, ReadFile(tls.key_file));
  return grpc::SslCredentials(options);
}

grpc::ChannelArguments ArgumentsOf(const ClientOptions& options) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxReceiveBytes);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, kMaxReconnectMs);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, kMaxReconnectMs / 10);
  // Backoff repeats calls; beside it, gRPC 1.51's own way lost some made while a server ended.
  arguments.SetInt(GRPC_ARG_ENABLE_RETRIES, 0);
  const auto keepalive_ms = static_cast<int>(absl::ToInt64Milliseconds(options.keepalive));
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, keepalive_ms);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, keepalive_ms / 2);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);  // as many as a long call takes
  arguments.SetUserAgentPrefix("strata");
  const std::vector<std::string> servers = ServersOf(options.target);
  std::string server_name = options.tls.server_name;
  if (servers.size() > 1) {
    arguments.SetLoadBalancingPolicyName("round_robin");
    const absl::StatusOr<HostPort> first = ParseHostPort(servers.front());
    if (server_name.empty() && options.tls.enabled() && first.ok()) server_name = first->host;
  }
  if (!server_name.empty()) arguments.SetSslTargetNameOverride(server_name);
  return arguments;
}

// Of a server that one of `options.target` has named: it shows a certificate as that one does.
grpc::ChannelArguments ArgumentsOfNamed(const ClientOptions& options) {
  ClientOptions named = options;
  const absl::StatusOr<HostPort> first = ParseHostPort(options.target);
  if (named.tls.enabled() && named.tls.server_name.empty() && first.ok()) {
    named.tls.server_name = first->host;
  }
  return ArgumentsOf(named);
}

// Why no server answers: the first that it can be asked of.
std::string WhyNone(const ClientOptions& options) {
  for (const std::string& server : ServersOf(options.target)) {
    const absl::StatusOr<HostPort> address = ParseHostPort(server);
    if (address.ok()) return sdk::WhatAnswers(*address, options.tls.enabled());
  }
  return "is stratad running there?";
}

class RemoteDatabase final : public api::Database {
 public:
  RemoteDatabase(std::shared_ptr<grpc::Channel> channel,
                 const ClientOptions& options,
                 sdk::Connection::MakeChannel make_channel)
      : connection_(std::move(channel),
                    options,
                    static_cast<int>(ServersOf(options.target).size()),
                    std::move(make_channel)) {}

  api::Maps& maps() override { return maps_; }
  api::Scans& scans() override { return scans_; }
  api::Tiles& tiles() override { return tiles_; }
  api::Planning& planning() override { return planning_; }
  api::Jobs& jobs() override { return jobs_; }
  api::PoseGraph& posegraph() override { return posegraph_; }
  api::Classifiers& classifiers() override { return classifiers_; }
  api::Models& models() override { return models_; }
  api::Objects& objects() override { return objects_; }

 private:
  sdk::Connection connection_;
  sdk::RemoteMaps maps_{connection_};
  sdk::RemoteScans scans_{connection_};
  sdk::RemoteTiles tiles_{connection_};
  sdk::RemotePlanning planning_{connection_};
  sdk::RemoteJobs jobs_{connection_};
  sdk::RemotePoseGraph posegraph_{connection_};
  sdk::RemoteClassifiers classifiers_{connection_};
  sdk::RemoteModels models_{connection_};
  sdk::RemoteObjects objects_{connection_};
};

}  // namespace

absl::Status ClientOptions::Validate() const {
  std::vector<std::string> faults;
  if (target.empty()) faults.emplace_back("target is empty; write HOST:PORT");
  const std::vector<std::string> servers = ServersOf(target);
  if (servers.size() > 1) {
    for (const std::string& server : servers) {
      if (const absl::Status valid = ParseHostPort(server).status(); !valid.ok()) {
        faults.push_back(
            absl::StrCat("target: of several servers each is HOST:PORT, not ", server));
      }
    }
  }
  if (!(connect_timeout > absl::ZeroDuration())) {
    faults.emplace_back("connect_timeout is not positive");
  }
  if (keepalive < kShortestKeepalive || keepalive > kLongestKeepalive) {
    faults.push_back(absl::StrCat("keepalive = ",
                                  absl::FormatDuration(keepalive),
                                  " is not in [",
                                  absl::FormatDuration(kShortestKeepalive),
                                  ", ",
                                  absl::FormatDuration(kLongestKeepalive),
                                  "]"));
  }
  if (backoff.max_attempts < 0 || backoff.max_attempts > 100) {
    faults.push_back(
        absl::StrCat("backoff.max_attempts = ", backoff.max_attempts, " is not in [0, 100]"));
  }
  if (!(backoff.initial > absl::ZeroDuration()) || !(backoff.max >= backoff.initial)) {
    faults.emplace_back("backoff.initial is not positive, or above backoff.max");
  }
  if (tls.certificate_file.empty() != tls.key_file.empty()) {
    faults.emplace_back("of tls.certificate_file and tls.key_file only one is given");
  }
  if (!tls.enabled() && !(tls.certificate_file.empty() && tls.server_name.empty())) {
    faults.emplace_back("tls.certificate_file and tls.server_name need tls.ca_file");
  }
  if (!std::all_of(
          token.begin(), token.end(), [](unsigned char c) { return absl::ascii_isgraph(c); })) {
    faults.emplace_back("token holds what is no printable character");
  }
  if (faults.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("client: ", absl::StrJoin(faults, "; ")));
}

absl::StatusOr<std::unique_ptr<api::Database>> Connect(const ClientOptions& options) {
  STRATA_RETURN_IF_ERROR(options.Validate());
  if (!options.token.empty() && !options.tls.enabled() && !options.insecure &&
      !OnThisMachine(options.target)) {
    return absl::FailedPreconditionError(absl::StrCat(
        "the token would cross the network to ",
        options.target,
        " in plain text, for anyone to copy; connect with TLS (name the server's authority)"));
  }
  STRATA_ASSIGN_OR_RETURN(const auto credentials, CredentialsOf(options.tls));
  STRATA_ASSIGN_OR_RETURN(const std::string target, ChannelTarget(options.target));
  auto channel = grpc::CreateCustomChannel(target, credentials, ArgumentsOf(options));
  if (!channel->WaitForConnected(absl::ToChronoTime(absl::Now() + options.connect_timeout))) {
    return absl::UnavailableError(absl::StrCat("no server answers at ",
                                               options.target,
                                               " within ",
                                               absl::FormatDuration(options.connect_timeout),
                                               "; ",
                                               WhyNone(options)));
  }
  return std::make_unique<RemoteDatabase>(
      std::move(channel), options, [credentials, options](const std::string& address) {
        return grpc::CreateCustomChannel(address, credentials, ArgumentsOfNamed(options));
      });
}

}  // namespace strata
