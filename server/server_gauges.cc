#include "server/server_gauges.h"

#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "server/access/access.h"
#include "server/rpc/executor.h"

namespace strata::server {
namespace {

void AddUnderWay(MetricFamilies& families, const Runtime& runtime) {
  constexpr auto kGauge = prometheus::MetricType::Gauge;
  const auto row = [](const CallGate& gate) {
    return MetricRow{{{"what", std::string(gate.what())}}, static_cast<double>(gate.under_way())};
  };
  AddFamily(families,
            kGauge,
            "strata_under_way",
            "Calls and watches under way",
            {row(runtime.calls), row(runtime.watches)});
  AddFamily(families,
            kGauge,
            "strata_clients",
            "Clients that have calls under way or had some lately",
            {{{}, static_cast<double>(runtime.clients.clients())}});
  AddFamily(families,
            kGauge,
            "strata_call_bytes",
            "Memory booked for calls under way; at most --call-memory",
            {{{}, static_cast<double>(runtime.clients.held_bytes())}});
}

void AddAccess(MetricFamilies& families, Access& access) {
  AddFamily(families,
            prometheus::MetricType::Gauge,
            "strata_tokens_unread_seconds",
            "For how long the token file cannot be read; what it said before holds meanwhile",
            {{{}, absl::ToDoubleSeconds(access.TokensUnread())}});
}

void AddPools(MetricFamilies& families, const Runtime& runtime) {
  std::vector<MetricRow> rows;
  for (const Executor* pool : {&runtime.queries, &runtime.streams, &runtime.uploads}) {
    const ExecutorNumbers numbers = pool->numbers();
    const auto add = [&](const char* state, std::size_t count) {
      rows.push_back({{{"pool", pool->name()}, {"state", state}}, static_cast<double>(count)});
    };
    add("running", numbers.running);
    add("blocked", numbers.blocked);
    add("queued", numbers.queued);
  }
  AddFamily(families,
            prometheus::MetricType::Gauge,
            "strata_pool_tasks",
            "Steps of calls that run, wait for a map or a reader, or wait for a thread",
            rows);
}

}  // namespace

void AddCalls(MetricFamilies& families, Runtime& runtime) {
  AddUnderWay(families, runtime);
  AddAccess(families, runtime.access);
  AddPools(families, runtime);
}

void AddWeb(MetricFamilies& families, const web::WebServer& web) {
  AddFamily(families,
            prometheus::MetricType::Gauge,
            "strata_web_connections",
            "Connections of --web",
            {{{}, static_cast<double>(web.connections())}});
  AddFamily(families,
            prometheus::MetricType::Counter,
            "strata_web_refused_connections_total",
            "Connections of --web that were ended for want of room",
            {{{}, static_cast<double>(web.refused())}});
}

void AddDisk(MetricFamilies& families, const EngineHealth& health) {
  constexpr auto kGauge = prometheus::MetricType::Gauge;
  AddFamily(families,
            kGauge,
            "strata_disk_free_bytes",
            "Free for the server where the maps are",
            {{{}, static_cast<double>(health.disk_free_bytes)}});
}

void AddCertificate(MetricFamilies& families, const TlsFiles& files) {
  if (!files.enabled()) return;
  const absl::StatusOr<TlsCertificate> certificate = CheckTls(files, absl::Now());
  const double expires =
      certificate.ok() ? absl::ToDoubleSeconds(certificate->expires - absl::UnixEpoch()) : 0.0;
  AddFamily(families,
            prometheus::MetricType::Gauge,
            "strata_certificate_expiry_timestamp_seconds",
            "When the server's certificate expires",
            {{{}, expires}});
}

void AddDoor(MetricFamilies& families,
             const Listener& listener,
             const Connections& connections,
             const Readiness& readiness) {
  AddFamily(families,
            prometheus::MetricType::Counter,
            "strata_connections_refused_total",
            "Connections that were closed because files ran short",
            {{{}, static_cast<double>(listener.refused())}});
  AddFamily(families,
            prometheus::MetricType::Counter,
            "strata_connections_cut_total",
            "Connections that were ended because hundreds of calls a second were refused",
            {{{}, static_cast<double>(connections.cut())}});
  std::vector<MetricRow> rows;
  for (const auto& [cause, why] : readiness.state()) {
    rows.push_back({{{"cause", cause}}, why.empty() ? 1.0 : 0.0});
  }
  AddFamily(families,
            prometheus::MetricType::Gauge,
            "strata_ready",
            "0: this keeps the server from its work; the log says why",
            rows);
}

}  // namespace strata::server
