// The pose graph of a map as a g2o file and back. Vertices are numbered in commit order; comments
// "# VERTEX TRAJECTORY/SEQUENCE" keep which scan each one is. A prior is an edge from a fixed
// vertex "map" at the identity.
#ifndef STRATA_CLIENT_CLI_POSEGRAPH_POSEGRAPH_EXCHANGE_H_
#define STRATA_CLIENT_CLI_POSEGRAPH_POSEGRAPH_EXCHANGE_H_

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/api/posegraph.h"

namespace strata::cli {

struct ExportedGraph {
  std::string text;
  std::size_t vertices = 0;
  std::size_t edges = 0;
  std::size_t left_out = 0;  // constraints that are switched off, and planes, which g2o has none of
};

ExportedGraph ExportGraph(const api::PoseGraphState& state);

struct ImportedGraph {
  std::map<ScanId, Pose> poses;         // T_map_scan
  std::vector<Constraint> constraints;  // in the file's order
  std::string warning;                  // what was mended; empty: nothing
};

// INVALID_ARGUMENT as ReadGraph, and for a planar graph, a vertex without the name of its scan, a
// scan that comes twice and an edge towards the map.
absl::StatusOr<ImportedGraph> ParseGraphImport(absl::string_view text);

// True if both say the same of the same scans, up to the rounding of a file.
bool SaysTheSame(const Constraint& a, const Constraint& b);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_POSEGRAPH_POSEGRAPH_EXCHANGE_H_
