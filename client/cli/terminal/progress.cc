#include "client/cli/terminal/progress.h"

#include <algorithm>
#include <cstdint>
#include <ostream>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include <unistd.h>

#include "core/common/steady_time.h"

namespace strata::cli {

Progress::Progress(std::ostream& talk, bool terminal, std::string what)
    : talk_(talk),
      terminal_(terminal),
      what_(std::move(what)),
      start_(SteadyNow()),
      last_(start_) {}

bool Progress::Due() {
  const absl::Time now = SteadyNow();
  if (now - last_ < (terminal_ ? absl::Milliseconds(100) : absl::Seconds(5))) {
    return false;
  }
  last_ = now;
  return true;
}

std::string Progress::TimeLeft(double share) const {
  if (share < 0.01 || share >= 1.0) return "";  // too little is done to tell
  const absl::Duration left = (SteadyNow() - start_) * ((1.0 - share) / share);
  return absl::StrCat(", ", absl::FormatDuration(absl::Ceil(left, absl::Seconds(1))), " left");
}

void Progress::Update(std::uint64_t done, std::uint64_t total, std::uint64_t points) {
  if (!Due()) {
    return;
  }
  const double seconds = absl::ToDoubleSeconds(SteadyNow() - start_);
  const double share = total == 0 ? 0.0 : static_cast<double>(done) / static_cast<double>(total);
  std::string line = absl::StrCat(what_, ": ", done, " of ", total);
  if (points > 0) {
    absl::StrAppend(
        &line, absl::StrFormat(", %.2g M points/s", static_cast<double>(points) / seconds * 1e-6));
  }
  Print(line + TimeLeft(share));
}

void Progress::Update(double share, const std::string& phase) {
  if (!Due()) {
    return;
  }
  Print(absl::StrFormat("%s: %.0f %% %s%s", what_, 100.0 * share, phase, TimeLeft(share)));
}

void Progress::Print(const std::string& line) {
  if (!terminal_) {
    talk_ << line << std::endl;
    return;
  }
  const std::string blank(shown_ - std::min(shown_, line.size()), ' ');
  talk_ << '\r' << line << blank << std::flush;
  shown_ = line.size();
}

void Progress::Clear() {
  if (shown_ == 0) {
    return;
  }
  talk_ << '\r' << std::string(shown_, ' ') << '\r' << std::flush;
  shown_ = 0;
}

bool TalksToTerminal() { return isatty(STDERR_FILENO) == 1; }

}  // namespace strata::cli
