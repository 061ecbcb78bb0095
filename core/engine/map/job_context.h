// What connects work with the job that it is done for.
#ifndef STRATA_CORE_ENGINE_MAP_JOB_CONTEXT_H_
#define STRATA_CORE_ENGINE_MAP_JOB_CONTEXT_H_

#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

#include "core/common/stop.h"
#include "core/engine/map/engine_options.h"
#include "core/world/job_arguments.h"

namespace strata {

// What a running job tells and learns. Used by the job's thread.
class JobContext {
 public:
  virtual ~JobContext() = default;
  // Asks whether to go on; reports how far it is (in [0, 1]) and what it does now.
  virtual absl::Status Progress(double progress, absl::string_view phase) = 0;
  virtual const Stop& stop() const = 0;
  // Numbers and a line of the result.
  virtual void SetMetric(const std::string& name, double value) = 0;
  virtual void SetMessage(std::string message) = 0;
  // The job will end as proposed instead of succeeded.
  virtual void SetProposed() = 0;
  // The job will wait for who has the map to apply its proposal.
  virtual void SetAccepted() = 0;
};

// The parameter "threads", or else what the engine has a map use.
inline int ThreadsOf(const JobArguments& arguments, const EngineOptions& options) {
  return arguments.Has("threads") ? static_cast<int>(arguments.Whole("threads"))
                                  : options.worker_threads;
}

// A parameter that no kind has, set on a job as it is stored that runs and is to end.
inline constexpr char kToldToEnd[] = "told_to_end";

// For work that nobody follows.
class SilentContext final : public JobContext {
 public:
  explicit SilentContext(Stop stop) : stop_(std::move(stop)) {}
  absl::Status Progress(double, absl::string_view) override { return stop_.status(); }
  const Stop& stop() const override { return stop_; }
  void SetMetric(const std::string&, double) override {}
  void SetMessage(std::string) override {}
  void SetProposed() override {}
  void SetAccepted() override {}

 private:
  const Stop stop_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MAP_JOB_CONTEXT_H_
