// The server of the map: sends it what waits, and hears from it where the robot was.
#ifndef STRATA_CLIENT_ROS2_SERVER_LINK_H_
#define STRATA_CLIENT_ROS2_SERVER_LINK_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "client/cli/terminal/server_options.h"
#include "client/ros2/talk.h"
#include "client/sdk/client.h"
#include "client/sdk/spool.h"
#include "core/api/call.h"
#include "core/api/database.h"
#include "core/api/maps.h"
#include "core/geometry/pose.h"

namespace strata::ros2 {

// How long a server that failed is left alone. Jittered backoff is for fleets that call; this is
// one robot that asks whether it is back.
inline constexpr absl::Duration kRetryAfter = absl::Seconds(1);

// What is said while no server answers, of scans that wait if there are any.
std::string NobodyAnswers(const std::string& server, bool scans);

struct LinkOptions {
  cli::ServerOptions server;
  ClientOptions client;
  std::string map, trajectory;
};

// What moves an uploaded pose of the robot, or where its odometry puts it, to where the map has it:
// by its newest scan that is in the map, taken then. The identity until there is one.
struct Correction {
  std::int64_t stamp_ns = 0;
  Pose T_now_uploaded = Pose::Identity();
};

// A thread that waits for the server for as long as it takes. Thread-safe.
class ServerLink {
 public:
  // All outlive it. Without a spool nothing is sent.
  ServerLink(const LinkOptions& options, Spool* spool, Talk& talk);
  // Ends it within the time of one message; what was not sent stays in the spool.
  ~ServerLink();
  ServerLink(const ServerLink&) = delete;
  ServerLink& operator=(const ServerLink&) = delete;

  // Null until the server has answered once; from then on it stays.
  api::Database* database() const;
  // For calls of others, too.
  const api::Call& call() const { return call_; }
  // Ends all calls but those that send what waits.
  void EndCalls() const { call_.stop.Request(); }
  Correction correction() const;
  // Grows with every change of the map's tiles, and of what is inferred; 0 until they are known.
  std::uint64_t changes() const;

 private:
  void Loop();
  absl::Status Connected();
  absl::Status Take(const api::MapUpdate& update);
  std::string WhyWaiting(const absl::Status& status) const;
  void Pause();

  const LinkOptions options_;
  Spool* const spool_;
  Talk& talk_;
  const api::Call call_;
  mutable absl::Mutex mutex_;
  std::unique_ptr<api::Database> database_ ABSL_GUARDED_BY(mutex_);
  Correction correction_ ABSL_GUARDED_BY(mutex_);
  std::uint64_t changes_ ABSL_GUARDED_BY(mutex_) = 0;
  std::optional<std::uint64_t> newest_;  // scan of the robot that is in the map; of the thread
  std::unique_ptr<SpoolSender> sender_;  // of the thread
  std::thread thread_;
};

}  // namespace strata::ros2

#endif  // STRATA_CLIENT_ROS2_SERVER_LINK_H_
