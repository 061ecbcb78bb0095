// strata posegraph export|import
#include <algorithm>
#include <cstddef>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

#include "client/cli/posegraph/posegraph_exchange.h"
#include "client/cli/posegraph/posegraph_files.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/formats/file_bytes.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

struct ExchangeOptions {
  std::string map;
  std::string file;
  bool poses = false;
  bool may_be_false = false;
};

absl::Status Export(Context& context, const ExchangeOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const api::PoseGraphState state,
                          context.database.posegraph().Get(context.call, options.map));
  const ExportedGraph graph = ExportGraph(state);
  STRATA_RETURN_IF_ERROR(WriteFileBytes(options.file, graph.text));
  context.output.Object({{"file", options.file},
                         {"epoch", state.epoch},
                         {"vertices", graph.vertices},
                         {"edges", graph.edges},
                         {"left_out", graph.left_out}});
  return absl::OkStatus();
}

// NOT_FOUND naming the first scan of `graph` that the map has not.
absl::Status CheckScans(const ImportedGraph& graph, const api::PoseGraphState& state) {
  std::set<ScanId> known = {ScanId()};  // the map itself
  for (const PoseNode& node : state.nodes) known.insert(node.id);
  const auto check = [&known](const ScanId& id) {
    return known.contains(id) ? absl::OkStatus()
                              : absl::NotFoundError(absl::StrCat(
                                    "scan ", id.ToString(), " is not in the map; nothing changed"));
  };
  for (const auto& [id, pose] : graph.poses) STRATA_RETURN_IF_ERROR(check(id));
  for (const Constraint& constraint : graph.constraints) {
    STRATA_RETURN_IF_ERROR(check(constraint.i));
    STRATA_RETURN_IF_ERROR(check(constraint.j));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::size_t> AddNew(Context& context,
                                   const ExchangeOptions& options,
                                   const ImportedGraph& graph,
                                   const api::PoseGraphState& state) {
  std::size_t added = 0;
  for (Constraint constraint : graph.constraints) {
    const bool known = std::any_of(
        state.constraints.begin(), state.constraints.end(), [&](const Constraint& present) {
          return SaysTheSame(present, constraint);
        });
    if (known) continue;
    constraint.note = absl::StrCat("imported from ", options.file.substr(0, 500));
    constraint.may_be_false = options.may_be_false && !constraint.is_prior();
    STRATA_RETURN_IF_ERROR(
        context.database.posegraph().AddConstraint(context.call, options.map, constraint).status());
    ++added;
  }
  return added;
}

absl::StatusOr<std::size_t> SetPoses(Context& context,
                                     const ExchangeOptions& options,
                                     const ImportedGraph& graph,
                                     const api::PoseGraphState& state) {
  constexpr double kSameM = 1e-9;
  std::size_t set = 0;
  for (const PoseNode& node : state.nodes) {
    const auto pose = graph.poses.find(node.id);
    if (pose == graph.poses.end() || node.T_map_scan.isApprox(pose->second, kSameM)) continue;
    STRATA_RETURN_IF_ERROR(
        context.database.posegraph().SetPose(context.call, options.map, node.id, pose->second));
    ++set;
  }
  return set;
}

absl::Status Import(Context& context, const ExchangeOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const std::string text, ReadFileBytes(options.file));
  absl::StatusOr<ImportedGraph> graph = ParseGraphImport(text);
  if (!graph.ok()) return Annotate(graph.status(), options.file);
  if (!graph->warning.empty()) context.output.Talk("warning: " + graph->warning);
  STRATA_ASSIGN_OR_RETURN(const api::PoseGraphState state,
                          context.database.posegraph().Get(context.call, options.map));
  STRATA_RETURN_IF_ERROR(CheckScans(*graph, state));
  STRATA_ASSIGN_OR_RETURN(const std::size_t added, AddNew(context, options, *graph, state));
  std::size_t set = 0;
  if (options.poses) {
    STRATA_ASSIGN_OR_RETURN(set, SetPoses(context, options, *graph, state));
  }
  context.output.Object({{"file", options.file},
                         {"constraints_added", added},
                         {"constraints_present", graph->constraints.size() - added},
                         {"poses_set", set}});
  return absl::OkStatus();
}

}  // namespace

void AddPosegraphExchange(Commands& commands, CLI::App* noun) {
  auto options = std::make_shared<ExchangeOptions>();
  CLI::App* write =
      commands.Verb(noun,
                    "export",
                    "Write poses and constraints as g2o, with the scans' names in comments",
                    "strata posegraph export campus --out campus.g2o",
                    [options](Context& context) { return Export(context, *options); });
  AddMapName(write, options->map);
  write->add_option("--out", options->file, "The file to write")->type_name("FILE.g2o")->required();
  CLI::App* read = commands.Verb(
      noun,
      "import",
      "Add the edges of a g2o file as constraints set by hand, but those that are there already; a "
      "line '# VERTEX TRAJECTORY/SEQUENCE' says which scan a vertex is, '# VERTEX map' makes "
      "priors",
      "strata posegraph import campus campus.g2o --poses",
      [options](Context& context) { return Import(context, *options); });
  AddMapName(read, options->map);
  read->add_option("FILE", options->file, "The file to read")->type_name("FILE.g2o")->required();
  read->add_flag("--poses", options->poses, "Move the scans to the vertices too, as pose set does");
  read->add_flag("--may-be-false",
                 options->may_be_false,
                 "Optimize may reject edges of two scans that everything else contradicts");
}

}  // namespace strata::cli
