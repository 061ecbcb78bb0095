// The log on its way to stderr.
#ifndef STRATA_SERVER_LOG_WRITER_H_
#define STRATA_SERVER_LOG_WRITER_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include <glog/logging.h>

namespace strata::server {

// Takes glog's lines, and gRPC's, and writes them on a thread of its own: who logs never waits for
// whoever reads the log. Lines for which there is no room are dropped, and their number is logged
// once there is some. FATAL goes to stderr directly. One at a time in a process; thread-safe.
class LogWriter final : public google::LogSink {
 public:
  // Bytes that may wait.
  static constexpr std::size_t kMostBytes = std::size_t{4} << 20;

  // After google::InitGoogleLogging(). `fd` stays the caller's.
  explicit LogWriter(int fd);
  // Writes what waits, for a second at most where nobody reads it; glog writes to stderr again.
  ~LogWriter() override;
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;

  // For how long nothing of what waits could be written; zero: the log is read.
  absl::Duration stuck() const;
  std::uint64_t dropped() const;

  using google::LogSink::send;
  void send(google::LogSeverity severity,
            const char* full_filename,
            const char* base_filename,
            int line,
            const google::LogMessageTime& time,
            const char* message,
            std::size_t message_len) override;

 private:
  void Loop();
  // Writes `text` as far as it can before it should end.
  void Write(absl::string_view text);
  // Whether the descriptor takes something now; waits a little for it.
  bool Writable();
  bool ShouldEnd() const;
  bool HasWork() const ABSL_SHARED_LOCKS_REQUIRED(mutex_) { return closing_ || !lines_.empty(); }

  const int fd_;
  mutable absl::Mutex mutex_;
  std::deque<std::string> lines_ ABSL_GUARDED_BY(mutex_);
  std::size_t bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  std::uint64_t dropped_ ABSL_GUARDED_BY(mutex_) = 0;
  std::uint64_t dropped_told_ ABSL_GUARDED_BY(mutex_) = 0;
  bool writing_ ABSL_GUARDED_BY(mutex_) = false;
  absl::Time progressed_ ABSL_GUARDED_BY(mutex_);  // when something was written, or began to wait
  bool closing_ ABSL_GUARDED_BY(mutex_) = false;
  absl::Time end_by_ ABSL_GUARDED_BY(mutex_);
  std::thread thread_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_LOG_WRITER_H_
