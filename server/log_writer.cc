#include "server/log_writer.h"

#include <algorithm>
#include <cerrno>
#include <climits>
#include <utility>

#include "absl/strings/str_cat.h"
#include <grpc/support/log.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/common/log_line.h"
#include "core/common/steady_time.h"
#include "core/common/this_thread.h"

namespace strata::server {
namespace {

constexpr absl::Duration kFarewell = absl::Seconds(1);
constexpr int kPollMs = 50;

void LogOfGrpc(gpr_log_func_args* args) {
  const LogLine line = std::move(LogLine("grpc").Add("message", args->message));
  switch (args->severity) {
    case GPR_LOG_SEVERITY_ERROR:
      LOG(ERROR) << line;
      break;
    default:
      LOG(INFO) << line;
  }
}

// Neither stderr nor files of glog's own.
void KeepFromGlog() {
  FLAGS_logtostderr = false;
  FLAGS_alsologtostderr = false;
  FLAGS_stderrthreshold = google::GLOG_FATAL;
  for (int severity = 0; severity < google::NUM_SEVERITIES; ++severity) {
    google::SetLogDestination(severity, "");
  }
}

}  // namespace

LogWriter::LogWriter(int fd) : fd_(fd), progressed_(SteadyNow()), thread_([this] { Loop(); }) {
  KeepFromGlog();
  google::AddLogSink(this);
  gpr_set_log_function(&LogOfGrpc);
}

LogWriter::~LogWriter() {
  gpr_set_log_function(nullptr);  // gRPC's own
  google::RemoveLogSink(this);
  FLAGS_logtostderr = true;
  {
    absl::MutexLock lock(&mutex_);
    closing_ = true;
    end_by_ = SteadyNow() + kFarewell;
  }
  thread_.join();
}

absl::Duration LogWriter::stuck() const {
  absl::MutexLock lock(&mutex_);
  return writing_ ? SteadyNow() - progressed_ : absl::ZeroDuration();
}

std::uint64_t LogWriter::dropped() const {
  absl::MutexLock lock(&mutex_);
  return dropped_;
}

void LogWriter::send(google::LogSeverity severity,
                     const char* /*full_filename*/,
                     const char* base_filename,
                     int line,
                     const google::LogMessageTime& time,
                     const char* message,
                     std::size_t message_len) {
  std::string text = ToString(severity, base_filename, line, time, message, message_len);
  text += '\n';
  absl::MutexLock lock(&mutex_);
  if (bytes_ + text.size() > kMostBytes) {
    ++dropped_;
    return;
  }
  bytes_ += text.size();
  lines_.push_back(std::move(text));
}

void LogWriter::Loop() {
  NameThisThread("log");
  while (true) {
    std::string text;
    {
      absl::MutexLock lock(&mutex_);
      writing_ = false;
      mutex_.Await(absl::Condition(this, &LogWriter::HasWork));
      if (lines_.empty()) return;
      writing_ = true;
      progressed_ = SteadyNow();
      if (dropped_ > dropped_told_) {
        const LogLine told = std::move(LogLine("log").Add("dropped", dropped_ - dropped_told_));
        text = absl::StrCat(told.text(), "\n");
        dropped_told_ = dropped_;
      }
      text += lines_.front();
      lines_.pop_front();
    }
    Write(text);
    absl::MutexLock lock(&mutex_);
    bytes_ -= std::min(bytes_, text.size());
    if (closing_ && SteadyNow() >= end_by_) return;
  }
}

bool LogWriter::ShouldEnd() const {
  absl::MutexLock lock(&mutex_);
  return closing_ && SteadyNow() >= end_by_;
}

bool LogWriter::Writable() {
  pollfd waited{.fd = fd_, .events = POLLOUT, .revents = 0};
  return poll(&waited, 1, kPollMs) > 0;
}

// A pipe that takes anything takes PIPE_BUF bytes without making the writer wait. The descriptor is
// not made non-blocking: others, a shell perhaps, write to it, too.
void LogWriter::Write(absl::string_view text) {
  while (!text.empty()) {
    if (!Writable()) {
      if (ShouldEnd()) return;
      continue;
    }
    const std::size_t size = std::min<std::size_t>(text.size(), PIPE_BUF);
    ssize_t written = ::send(fd_, text.data(), size, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (written < 0 && errno == ENOTSOCK) written = ::write(fd_, text.data(), size);
    if (written < 0) {
      if ((errno == EAGAIN || errno == EINTR) && !ShouldEnd()) continue;
      return;  // nobody reads it any more
    }
    text.remove_prefix(static_cast<std::size_t>(written));
    absl::MutexLock lock(&mutex_);
    progressed_ = SteadyNow();
  }
}

}  // namespace strata::server
