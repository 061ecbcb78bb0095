// A pose graph drawn over its map.
#ifndef STRATA_CLIENT_CLI_POSEGRAPH_GRAPH_OVERLAY_H_
#define STRATA_CLIENT_CLI_POSEGRAPH_GRAPH_OVERLAY_H_

#include "client/cli/picture/map_picture.h"
#include "core/api/posegraph.h"

namespace strata::cli {

// The way of each trajectory through its scans, by sequence number, in a colour of its own.
void AddTrajectories(const api::PoseGraphState& state, picture::Overlay& overlay);

// Each constraint as a line between its scans: thin from ingest, thick when a person or a job
// closed a loop, violet for a prior, coloured by its normalised residual where that is above 1,
// grey and dashed where it is switched off; and a short dark line from where it says that a scan is
// to where it is.
void AddConstraints(const api::PoseGraphState& state, picture::Overlay& overlay);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_POSEGRAPH_GRAPH_OVERLAY_H_
