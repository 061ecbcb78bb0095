// Durable background work.
#ifndef STRATA_CORE_WORLD_JOB_H_
#define STRATA_CORE_WORLD_JOB_H_

#include <cstdint>
#include <map>
#include <string>

#include "absl/strings/string_view.h"
#include "absl/time/time.h"

namespace strata {

enum class JobState : std::uint8_t {  // stored
  kQueued = 1,
  kRunning = 2,
  kSucceeded = 3,
  kFailed = 4,
  kCancelled = 5,
  kProposed =
      6,  // what a dry run, or an optimize that nothing speaks for, found waits for a person
};

// As clients and metrics say it: "queued", "running" …; "unknown" for a number that is no state.
absl::string_view ToString(JobState state);

// Nothing more happens by itself.
inline bool IsFinal(JobState state) { return state >= JobState::kSucceeded; }

using JobParameters = std::map<std::string, std::string>;

struct JobInfo {
  std::uint64_t id = 0;  // unique in the map
  std::string kind;      // see job_kinds.h
  JobParameters parameters;
  JobState state = JobState::kQueued;
  double progress = 0.0;                  // in [0, 1]
  std::string phase;                      // what it does now, for people
  std::string message;                    // result in one line, or why it failed
  std::map<std::string, double> metrics;  // numbers of the result, such as "tiles_checked"
  absl::Time created;
  absl::Time updated;
};

}  // namespace strata

#endif  // STRATA_CORE_WORLD_JOB_H_
