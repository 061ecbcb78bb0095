#include "server/metrics/metrics.h"

#include <exception>
#include <fstream>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include <prometheus/exposer.h>
#include <unistd.h>

#include "core/common/host_port.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"

namespace strata::server {
namespace {

// From a lookup in memory to a search in a large map [s].
const prometheus::Histogram::BucketBoundaries& SecondsBounds() {
  static const auto* const bounds = new prometheus::Histogram::BucketBoundaries{
      0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 120.0};
  return *bounds;
}

template <typename Builder>
auto& Family(Builder builder, prometheus::Registry& registry, const char* name, const char* help) {
  return builder.Name(name).Help(help).Register(registry);
}

double ResidentBytes() {
  std::ifstream file("/proc/self/statm");
  double total = 0.0;
  double resident = 0.0;
  file >> total >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

class LookedUp final : public prometheus::Collectable {
 public:
  explicit LookedUp(Gauges gauges) : gauges_(std::move(gauges)) {}
  MetricFamilies Collect() const override {
    MetricFamilies families;
    if (gauges_) gauges_(families);
    return families;
  }

 private:
  const Gauges gauges_;
};

class HttpEndpoint final : public MetricsEndpoint {
 public:
  HttpEndpoint(HostPort address, const CallMetrics& calls, Gauges gauges)
      : looked_up_(std::make_shared<LookedUp>(std::move(gauges))), exposer_(address.ToString()) {
    exposer_.RegisterCollectable(calls.registry());
    exposer_.RegisterCollectable(looked_up_);
    address.port = exposer_.GetListeningPorts().at(0);
    address_ = address.ToString();
  }
  const std::string& address() const override { return address_; }

 private:
  const std::shared_ptr<LookedUp> looked_up_;
  prometheus::Exposer exposer_;
  std::string address_;
};

}  // namespace

CallMetrics::CallMetrics()
    : calls_(Family(prometheus::BuildCounter(),
                    *registry_,
                    "strata_calls_total",
                    "Calls that ended, by method and canonical code")),
      rejected_(
          Family(prometheus::BuildCounter(),
                 *registry_,
                 "strata_calls_rejected_total",
                 "Calls that were refused, by reason: STRANGER (nobody knows who calls), ACCESS, "
                 "CLIENT_LIMIT, …")),
      received_(Family(prometheus::BuildCounter(),
                       *registry_,
                       "strata_received_bytes_total",
                       "Bytes of requests, before TLS")),
      sent_(Family(prometheus::BuildCounter(),
                   *registry_,
                   "strata_sent_bytes_total",
                   "Bytes of answers, before TLS")),
      seconds_(Family(prometheus::BuildHistogram(),
                      *registry_,
                      "strata_call_seconds",
                      "From a call's arrival to its end; of streams and watches their whole life")),
      acknowledged_(Family(prometheus::BuildHistogram(),
                           *registry_,
                           "strata_acknowledge_seconds",
                           "From a scan's last point to its being durable")
                        .Add({}, SecondsBounds())) {}

void CallMetrics::Acknowledged(absl::Duration duration) {
  acknowledged_.Observe(absl::ToDoubleSeconds(duration));
}

CallMetrics::Method& CallMetrics::Of(absl::string_view method) {
  const auto found = methods_.find(method);
  if (found != methods_.end()) return found->second;
  const std::string name(method);
  Method made{seconds_.Add({{"method", name}}, SecondsBounds()),
              received_.Add({{"method", name}}),
              sent_.Add({{"method", name}}),
              {}};
  return methods_.emplace(name, std::move(made)).first->second;
}

void CallMetrics::Ended(absl::string_view method,
                        absl::StatusCode code,
                        absl::Duration duration,
                        std::size_t bytes_received,
                        std::size_t bytes_sent,
                        absl::string_view reason) {
  absl::MutexLock lock(&mutex_);
  Method& numbers = Of(method);
  numbers.seconds.Observe(absl::ToDoubleSeconds(duration));
  numbers.received.Increment(static_cast<double>(bytes_received));
  numbers.sent.Increment(static_cast<double>(bytes_sent));
  prometheus::Counter*& ended = numbers.ended[code];
  if (ended == nullptr) {
    ended =
        &calls_.Add({{"method", std::string(method)}, {"code", absl::StatusCodeToString(code)}});
  }
  ended->Increment();
  if (!reason.empty()) rejected_.Add({{"reason", std::string(reason)}}).Increment();
}

void AddFamily(MetricFamilies& families,
               prometheus::MetricType type,
               const std::string& name,
               const std::string& help,
               const std::vector<MetricRow>& rows) {
  prometheus::MetricFamily family;
  family.name = name;
  family.help = help;
  family.type = type;
  for (const auto& [labels, value] : rows) {
    prometheus::ClientMetric metric;
    for (const auto& [key, label] : labels) metric.label.push_back({key, label});
    metric.gauge.value = value;
    metric.counter.value = value;
    family.metric.push_back(std::move(metric));
  }
  families.push_back(std::move(family));
}

void AddProcess(MetricFamilies& families, absl::Time started) {
  constexpr auto kGauge = prometheus::MetricType::Gauge;
  AddFamily(families,
            kGauge,
            "strata_uptime_seconds",
            "Since the server began to listen",
            {{{}, absl::ToDoubleSeconds(SteadyNow() - started)}});
  AddFamily(families,
            kGauge,
            "strata_resident_bytes",
            "Memory of the process that is in RAM",
            {{{}, ResidentBytes()}});
  AddFamily(families,
            kGauge,
            "strata_build_info",
            "1; the version is a label",
            {{{{"version", STRATA_VERSION}}, 1.0}});
}

absl::StatusOr<std::unique_ptr<MetricsEndpoint>> MetricsEndpoint::Open(const std::string& address,
                                                                       const CallMetrics& calls,
                                                                       Gauges gauges) {
  STRATA_ASSIGN_OR_RETURN(const HostPort parsed, ParseHostPort(address));
  try {
    return std::make_unique<HttpEndpoint>(parsed, calls, std::move(gauges));
  } catch (const std::exception& e) {  // of CivetWeb
    return absl::UnavailableError(
        absl::StrCat("cannot serve metrics on ", address, ": ", e.what(), "; is the port in use?"));
  }
}

}  // namespace strata::server
