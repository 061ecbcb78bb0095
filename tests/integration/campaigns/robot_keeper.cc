#include "tests/integration/campaigns/robot_keeper.h"

#include <csignal>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/time/clock.h"

#include "tests/integration/marked_yard.h"
#include "tests/support/paths.h"

namespace strata::testing {

RobotKeeper::RobotKeeper(const RobotOptions& options)
    : options_(options), thread_([this] { Loop(); }) {}

std::vector<std::string> RobotKeeper::Arguments() const {
  const std::uint64_t last = added_.empty() ? 0 : added_.rbegin()->first.sequence;
  std::vector<std::string> arguments = {"--spool",
                                        options_.spool.string(),
                                        "--server",
                                        options_.server,
                                        absl::StrCat("--robot=", options_.number),
                                        absl::StrCat("--first=", last + 1),
                                        absl::StrCat("--period-ms=", options_.period_ms),
                                        absl::StrCat("--columns=", options_.columns)};
  if (retiring_) arguments.push_back(absl::StrCat("--last=", last));
  if (options_.align) arguments.emplace_back("--align");
  return arguments;
}

void RobotKeeper::Loop() {
  while (true) {
    ChildProcess* process = nullptr;
    {
      absl::MutexLock lock(&mutex_);
      process_ =
          std::make_unique<ChildProcess>(BuiltPath("tests/integration/spool_robot"), Arguments());
      process = process_.get();
    }
    // Its stdout ends when it does.
    for (std::string line = process->ReadLine(); !line.empty(); line = process->ReadLine()) {
      Heed(line);
    }
    absl::MutexLock lock(&mutex_);
    const int end = process_->Wait();
    process_.reset();
    if (end == 0) return;
    if (end != -SIGKILL && end != -SIGTERM) {  // it may not have come to listen to SIGTERM
      ++failures_;
      absl::SleepFor(absl::Milliseconds(100));
    }
  }
}

void RobotKeeper::Heed(const std::string& line) {
  const std::vector<std::string> words = absl::StrSplit(line, ' ');
  std::uint64_t sequence = 0;
  // The last line of a robot that was killed may be cut.
  if (words.size() < 2 || !absl::SimpleAtoi(words[1], &sequence)) return;
  const ScanId id = YardScan(options_.number, sequence);
  absl::MutexLock lock(&mutex_);
  if (words[0] == "added" && words.size() == 3) added_.emplace(id, words[2]);
  if (words[0] == "acked") acknowledged_.insert(id);
}

void RobotKeeper::Kill() {
  absl::MutexLock lock(&mutex_);
  if (process_ != nullptr) process_->Signal(SIGKILL);
}

void RobotKeeper::Retire() {
  {
    absl::MutexLock lock(&mutex_);
    retiring_ = true;
    if (process_ != nullptr) process_->Signal(SIGTERM);
  }
  if (thread_.joinable()) thread_.join();
}

std::map<ScanId, std::string> RobotKeeper::Added() const {
  absl::MutexLock lock(&mutex_);
  return added_;
}

std::set<ScanId> RobotKeeper::Acknowledged() const {
  absl::MutexLock lock(&mutex_);
  return acknowledged_;
}

}  // namespace strata::testing
