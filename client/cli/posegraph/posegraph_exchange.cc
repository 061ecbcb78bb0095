#include "client/cli/posegraph/posegraph_exchange.h"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <variant>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

#include "client/formats/graph_file.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

constexpr char kMapItself[] = "map";

// Vertex numbers and the words behind them, out of the comments.
std::map<std::uint64_t, std::string> NamesIn(absl::string_view text) {
  std::map<std::uint64_t, std::string> names;
  for (const absl::string_view line : absl::StrSplit(text, '\n')) {
    if (line.empty() || line.front() != '#') continue;
    const std::vector<std::string> words =
        absl::StrSplit(line.substr(1), absl::ByAnyChar(" \t\r"), absl::SkipEmpty());
    std::uint64_t vertex = 0;
    if (words.size() == 2 && absl::SimpleAtoi(words[0], &vertex)) names[vertex] = words[1];
  }
  return names;
}

// The scan of each node; an empty trajectory is the map.
absl::StatusOr<std::vector<ScanId>> ScansOf(const GraphFile& file, absl::string_view text) {
  const std::map<std::uint64_t, std::string> names = NamesIn(text);
  std::vector<ScanId> scans;
  for (const std::uint64_t vertex : file.ids) {
    const auto name = names.find(vertex);
    if (name == names.end()) {
      return absl::InvalidArgumentError(absl::StrCat("vertex ",
                                                     vertex,
                                                     " belongs to no scan; add a line '# ",
                                                     vertex,
                                                     " TRAJECTORY/SEQUENCE'"));
    }
    ScanId& id = scans.emplace_back();
    if (name->second == kMapItself) continue;
    STRATA_RETURN_IF_ERROR(Annotate(ParseScanId(name->second, id), absl::StrCat("# ", vertex)));
  }
  return scans;
}

Constraint ConstraintOf(const RelativePoseTerm& term, const std::vector<ScanId>& scans) {
  Constraint constraint;
  constraint.i = scans[term.i];
  constraint.j = scans[term.j];
  constraint.T_i_j = term.T_i_j;
  constraint.information = term.information;
  constraint.origin = ConstraintOrigin::kPerson;
  return constraint;
}

}  // namespace

ExportedGraph ExportGraph(const api::PoseGraphState& state) {
  GraphFile file;
  file.has_poses = true;
  PoseGraphProblem graph;
  std::map<ScanId, std::size_t> nodes;
  std::string names;
  const auto add = [&](const ScanId& id, const std::string& name, const Pose& pose) {
    const std::size_t node = nodes.size();
    nodes.emplace(id, node);
    file.ids.push_back(node);
    graph.T_map_scan.push_back(pose);
    absl::StrAppend(&names, "# ", node, " ", name, "\n");
  };
  for (const PoseNode& node : state.nodes) add(node.id, node.id.ToString(), node.T_map_scan);
  ExportedGraph exported;
  exported.left_out = state.planes.size();
  for (const Constraint& constraint : state.constraints) {
    if (!constraint.enabled || !nodes.contains(constraint.j)) {
      ++exported.left_out;
      continue;
    }
    if (constraint.is_prior() && !nodes.contains(constraint.i)) {
      add(constraint.i, kMapItself, Pose::Identity());
      graph.fixed.assign(nodes.size(), false);
      graph.fixed.back() = true;
    }
    const auto i = nodes.find(constraint.i);
    if (i == nodes.end()) {
      ++exported.left_out;
      continue;
    }
    graph.relative.push_back(
        {i->second, nodes.at(constraint.j), constraint.T_i_j, constraint.information, false});
  }
  exported.vertices = nodes.size();
  exported.edges = graph.relative.size();
  file.graph = std::move(graph);
  exported.text = absl::StrCat(names, G2oText(file));
  return exported;
}

absl::StatusOr<ImportedGraph> ParseGraphImport(absl::string_view text) {
  const absl::StatusOr<GraphFile> parsed = ParseGraph(text);
  if (!parsed.ok()) return parsed.status();
  const GraphFile& file = *parsed;
  const auto* const graph = std::get_if<PoseGraphProblem>(&file.graph);
  if (graph == nullptr) {
    return absl::InvalidArgumentError(
        "the graph is planar; that of a map has VERTEX_SE3:QUAT and EDGE_SE3:QUAT");
  }
  STRATA_ASSIGN_OR_RETURN(const std::vector<ScanId> scans, ScansOf(file, text));
  ImportedGraph imported;
  imported.warning = ClippedWarning(file);
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (scans[i].trajectory.empty() || !file.has_poses) continue;
    if (!imported.poses.emplace(scans[i], graph->T_map_scan[i]).second) {
      return absl::InvalidArgumentError(absl::StrCat(
          "vertex ", file.ids[i], ": scan ", scans[i].ToString(), " has a vertex already"));
    }
  }
  for (const RelativePoseTerm& term : graph->relative) {
    if (scans[term.j].trajectory.empty()) {
      return absl::InvalidArgumentError(absl::StrCat("edge ",
                                                     file.ids[term.i],
                                                     " ",
                                                     file.ids[term.j],
                                                     ": a prior goes from the map to its scan"));
    }
    imported.constraints.push_back(ConstraintOf(term, scans));
  }
  return imported;
}

bool SaysTheSame(const Constraint& a, const Constraint& b) {
  constexpr double kRounding = 1e-9;
  return a.i == b.i && a.j == b.j && a.T_i_j.isApprox(b.T_i_j, kRounding) &&
         a.information.isApprox(b.information, kRounding);
}

}  // namespace strata::cli
