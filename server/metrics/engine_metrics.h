// Numbers of the maps for Prometheus.
#ifndef STRATA_SERVER_METRICS_ENGINE_METRICS_H_
#define STRATA_SERVER_METRICS_ENGINE_METRICS_H_

#include "core/engine/map/numbers.h"
#include "server/metrics/metrics.h"

namespace strata::server {

// One series a map; deleting a map ends its series.
void AddEngine(MetricFamilies& families, const EngineNumbers& numbers);

}  // namespace strata::server

#endif  // STRATA_SERVER_METRICS_ENGINE_METRICS_H_
