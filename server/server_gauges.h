// What the server around an engine measures at the moment when Prometheus asks.
#ifndef STRATA_SERVER_SERVER_GAUGES_H_
#define STRATA_SERVER_SERVER_GAUGES_H_

#include "core/engine/map/numbers.h"
#include "server/metrics/metrics.h"
#include "server/readiness.h"
#include "server/rpc/connections.h"
#include "server/rpc/listener.h"
#include "server/rpc/runtime.h"
#include "server/tls.h"
#include "server/web/web_server.h"

namespace strata::server {

// Calls under way, what they hold, the tokens they come with and the threads they run on.
void AddCalls(MetricFamilies& families, Runtime& runtime);
// When the certificate expires; 0: it is not valid now, or not to be read.
void AddCertificate(MetricFamilies& families, const TlsFiles& files);
// Connections that were not let in or cut, and what keeps the server from its work.
void AddDoor(MetricFamilies& families,
             const Listener& listener,
             const Connections& connections,
             const Readiness& readiness);
void AddWeb(MetricFamilies& families, const web::WebServer& web);
void AddDisk(MetricFamilies& families, const EngineHealth& health);

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVER_GAUGES_H_
