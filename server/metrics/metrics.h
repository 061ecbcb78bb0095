// Numbers of the server for Prometheus.
#ifndef STRATA_SERVER_METRICS_METRICS_H_
#define STRATA_SERVER_METRICS_METRICS_H_

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include <prometheus/collectable.h>
#include <prometheus/counter.h>
#include <prometheus/family.h>
#include <prometheus/histogram.h>
#include <prometheus/metric_family.h>
#include <prometheus/registry.h>

namespace strata::server {

// Counts what ended. Thread-safe; labels are words of ours (methods, codes, reasons), never of a
// client.
class CallMetrics {
 public:
  CallMetrics();

  // `method` as in "Maps.Create". `reason`: who refused the call (ErrorDetail::reason), empty if it
  // was not refused.
  void Ended(absl::string_view method,
             absl::StatusCode code,
             absl::Duration duration,
             std::size_t bytes_received,
             std::size_t bytes_sent,
             absl::string_view reason);

  // A scan was made durable, so long after its last point had come.
  void Acknowledged(absl::Duration duration);

  const std::shared_ptr<prometheus::Registry>& registry() const { return registry_; }

 private:
  struct Method {
    prometheus::Histogram& seconds;
    prometheus::Counter& received;
    prometheus::Counter& sent;
    std::map<absl::StatusCode, prometheus::Counter*> ended;  // found by labels once
  };
  Method& Of(absl::string_view method) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const std::shared_ptr<prometheus::Registry> registry_ = std::make_shared<prometheus::Registry>();
  prometheus::Family<prometheus::Counter>& calls_;
  prometheus::Family<prometheus::Counter>& rejected_;
  prometheus::Family<prometheus::Counter>& received_;
  prometheus::Family<prometheus::Counter>& sent_;
  prometheus::Family<prometheus::Histogram>& seconds_;
  prometheus::Histogram& acknowledged_;
  absl::Mutex mutex_;
  std::map<std::string, Method, std::less<>> methods_ ABSL_GUARDED_BY(mutex_);
};

using MetricFamilies = std::vector<prometheus::MetricFamily>;
// Adds to a scrape what is looked up at its time.
using Gauges = std::function<void(MetricFamilies&)>;

// One family of gauges or counters: rows of labels and a value.
using MetricRow = std::pair<std::map<std::string, std::string>, double>;
void AddFamily(MetricFamilies& families,
               prometheus::MetricType type,
               const std::string& name,
               const std::string& help,
               const std::vector<MetricRow>& rows);

// Resident memory, uptime and version of this process.
void AddProcess(MetricFamilies& families, absl::Time started);

// Serves HOST:PORT/metrics in plain text to anybody while it lives, on two threads.
class MetricsEndpoint {
 public:
  virtual ~MetricsEndpoint() = default;
  // With the true port.
  virtual const std::string& address() const = 0;

  // UNAVAILABLE if `address` (HOST:PORT) cannot be listened on.
  static absl::StatusOr<std::unique_ptr<MetricsEndpoint>> Open(const std::string& address,
                                                               const CallMetrics& calls,
                                                               Gauges gauges);
};

}  // namespace strata::server

#endif  // STRATA_SERVER_METRICS_METRICS_H_
