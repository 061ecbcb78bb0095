// How far long work is: one line that is rewritten on a terminal, a line every few seconds
// elsewhere.
#ifndef STRATA_CLIENT_CLI_TERMINAL_PROGRESS_H_
#define STRATA_CLIENT_CLI_TERMINAL_PROGRESS_H_

#include <cstdint>
#include <iosfwd>
#include <string>

#include "absl/time/time.h"

namespace strata::cli {

// Not thread-safe.
class Progress {
 public:
  Progress(std::ostream& talk, bool terminal, std::string what);
  ~Progress() { Clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // `done` of `total` items, and how many points that were (0: not shown). Prints at most ten times
  // a second on a terminal and every five seconds elsewhere.
  void Update(std::uint64_t done, std::uint64_t total, std::uint64_t points);
  // `share` in [0, 1] and what is done now.
  void Update(double share, const std::string& phase);
  // Takes the line off the terminal before other talk.
  void Clear();

 private:
  bool Due();
  void Print(const std::string& line);
  std::string TimeLeft(double share) const;

  std::ostream& talk_;
  const bool terminal_;
  const std::string what_;
  const absl::Time start_;
  absl::Time last_;
  std::size_t shown_ = 0;  // characters on the terminal's line
};

// True if stderr is a terminal.
bool TalksToTerminal();

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_TERMINAL_PROGRESS_H_
