#include "client/sdk/client.h"

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/time/clock.h"
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

#include "client/sdk/connection.h"
#include "client/sdk/remote_classifiers.h"
#include "client/sdk/remote_jobs.h"
#include "client/sdk/remote_maps.h"
#include "client/sdk/remote_planning.h"
#include "client/sdk/remote_posegraph.h"
#include "client/sdk/remote_scans.h"
#include "client/sdk/remote_tiles.h"
#include "core/common/status.h"

namespace strata {
namespace {

// Answers are bounded by their requests, the largest is a column of many levels at 10,000 places.
constexpr int kMaxReceiveBytes = 64 << 20;
// A server that comes back is found again within a second.
constexpr int kMaxReconnectMs = 1000;

class RemoteDatabase final : public api::Database {
 public:
  RemoteDatabase(std::shared_ptr<grpc::Channel> channel, const ClientOptions& options)
      : connection_(std::move(channel), options) {}

  api::Maps& maps() override { return maps_; }
  api::Scans& scans() override { return scans_; }
  api::Tiles& tiles() override { return tiles_; }
  api::Planning& planning() override { return planning_; }
  api::Jobs& jobs() override { return jobs_; }
  api::PoseGraph& posegraph() override { return posegraph_; }
  api::Classifiers& classifiers() override { return classifiers_; }

 private:
  sdk::Connection connection_;
  sdk::RemoteMaps maps_{connection_};
  sdk::RemoteScans scans_{connection_};
  sdk::RemoteTiles tiles_{connection_};
  sdk::RemotePlanning planning_{connection_};
  sdk::RemoteJobs jobs_{connection_};
  sdk::RemotePoseGraph posegraph_{connection_};
  sdk::RemoteClassifiers classifiers_{connection_};
};

}  // namespace

absl::Status ClientOptions::Validate() const {
  std::vector<std::string> faults;
  if (target.empty()) faults.emplace_back("target is empty; write HOST:PORT");
  if (!(connect_timeout > absl::ZeroDuration())) {
    faults.emplace_back("connect_timeout is not positive");
  }
  if (backoff.max_attempts < 0 || backoff.max_attempts > 100) {
    faults.push_back(
        absl::StrCat("backoff.max_attempts = ", backoff.max_attempts, " is not in [0, 100]"));
  }
  if (!(backoff.initial > absl::ZeroDuration()) || !(backoff.max >= backoff.initial)) {
    faults.emplace_back("backoff.initial is not positive, or above backoff.max");
  }
  if (faults.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("client: ", absl::StrJoin(faults, "; ")));
}

absl::StatusOr<std::unique_ptr<api::Database>> Connect(const ClientOptions& options) {
  STRATA_RETURN_IF_ERROR(options.Validate());
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxReceiveBytes);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, kMaxReconnectMs);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, kMaxReconnectMs / 10);
  arguments.SetUserAgentPrefix("strata");
  auto channel =
      grpc::CreateCustomChannel(options.target, grpc::InsecureChannelCredentials(), arguments);
  if (!channel->WaitForConnected(absl::ToChronoTime(absl::Now() + options.connect_timeout))) {
    return absl::UnavailableError(absl::StrCat("no server answers at ",
                                               options.target,
                                               " within ",
                                               absl::FormatDuration(options.connect_timeout),
                                               "; is stratad running there?"));
  }
  return std::make_unique<RemoteDatabase>(std::move(channel), options);
}

}  // namespace strata
