// strata map merge
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "client/cli/map/map_files.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/json.h"
#include "client/cli/terminal/names.h"
#include "client/cli/terminal/progress.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

namespace fs = std::filesystem;

struct MergeOptions {
  std::string map;
  std::vector<std::string> sources;
  bool rename_clashes = false;
};

// A directory of the command's own, gone with it.
class PrivateDirectory {
 public:
  PrivateDirectory() {
    std::error_code error;
    std::string pattern = (fs::temp_directory_path(error) / "strata-merge-XXXXXX").string();
    if (::mkdtemp(pattern.data()) != nullptr) path_ = pattern;
  }
  ~PrivateDirectory() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  PrivateDirectory(const PrivateDirectory&) = delete;
  PrivateDirectory& operator=(const PrivateDirectory&) = delete;
  const fs::path& path() const { return path_; }  // empty if it could not be made

 private:
  fs::path path_;
};

// A map that is merged: of the command's database, or a file of its own.
struct Source {
  std::string text;
  std::unique_ptr<PrivateDirectory> directory;
  std::unique_ptr<api::Database> own;
  api::Database* database = nullptr;
  std::string map;
  MapInfo info;
  std::vector<ScanInfo> scans;                 // integrated ones
  std::map<std::string, std::string> renamed;  // trajectories
};

constexpr char kSourceName[] = "source";

bool IsFile(const std::string& text) {
  return absl::EndsWith(text, ".strata") || absl::StrContains(text, '/');
}

// On a copy: opening a map may change its file.
absl::Status OpenFile(Context& context, const std::string& file, Source& source) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) {
    return absl::NotFoundError(absl::StrCat(file, ": no such file"));
  }
  if (fs::exists(file + "-wal", error)) {
    return absl::FailedPreconditionError(absl::StrCat(
        file, " is in use or was not closed; name its map, or a file that map backup wrote"));
  }
  source.directory = std::make_unique<PrivateDirectory>();
  const fs::path& directory = source.directory->path();
  const bool copied = !directory.empty() &&
                      fs::copy_file(file, directory / absl::StrCat(kSourceName, ".strata"), error);
  if (!copied) {
    return absl::UnavailableError(
        absl::StrCat(file, ": cannot be copied into TMPDIR: ", error.message()));
  }
  STRATA_ASSIGN_OR_RETURN(source.own, context.open_directory(directory.string()));
  source.database = source.own.get();
  source.map = kSourceName;
  return absl::OkStatus();
}

absl::Status ReadScans(Context& context, Source& source) {
  std::uint64_t pending = 0;
  STRATA_RETURN_IF_ERROR(
      source.database->scans().List(context.call, source.map, {}, [&](const ScanInfo& scan) {
        pending += scan.state == ScanState::kPending ? 1 : 0;
        if (scan.state == ScanState::kIntegrated) source.scans.push_back(scan);
        return absl::OkStatus();
      }));
  if (pending == 0) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat(source.text, ": ", pending, " scans wait for integration; try again later"));
}

absl::StatusOr<Source> Open(Context& context, const std::string& text) {
  Source source;
  source.text = text;
  source.database = &context.database;
  source.map = text;
  if (IsFile(text)) STRATA_RETURN_IF_ERROR(OpenFile(context, text, source));
  STRATA_ASSIGN_OR_RETURN(source.info, source.database->maps().Get(context.call, source.map));
  if (!source.info.parameters.keep_points) {
    return absl::FailedPreconditionError(
        absl::StrCat(text, " dropped the points of its scans; it cannot be merged"));
  }
  STRATA_RETURN_IF_ERROR(ReadScans(context, source));
  return source;
}

// Which of what decides what scans become differ.
absl::Status CheckParameters(const Source& a, const Source& b) {
  const MapParameters& p = a.info.parameters;
  const MapParameters& q = b.info.parameters;
  std::vector<std::string> differing;
  if (p.mls.cell_size_m != q.mls.cell_size_m) differing.emplace_back("cell size");
  if (p.mls.gap_size_m != q.mls.gap_size_m) differing.emplace_back("gap size");
  if (p.mls.thickness_m != q.mls.thickness_m) differing.emplace_back("thickness");
  if (!(p.sensor == q.sensor)) differing.emplace_back("sensor");
  if (p.origin != q.origin) differing.emplace_back("origin");
  if (differing.empty()) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat(a.text,
                                                    " and ",
                                                    b.text,
                                                    " cannot be merged: they differ in ",
                                                    absl::StrJoin(differing, ", ")));
}

// Trajectories of one name are two, unless the user says how to tell them apart.
absl::Status TellTrajectoriesApart(std::vector<Source>& sources, bool rename) {
  std::map<std::string, const Source*> taken;
  for (Source& source : sources) {
    std::set<std::string> names;
    for (const ScanInfo& scan : source.scans) names.insert(scan.header.id.trajectory);
    for (const std::string& name : names) {
      std::string merged = name;
      if (rename && taken.contains(name)) {
        merged = absl::StrCat(fs::path(source.text).stem().string(), "-", name);
      }
      const auto [there, added] = taken.emplace(merged, &source);
      if (!added) {
        return absl::AlreadyExistsError(absl::StrCat("trajectory ",
                                                     merged,
                                                     " is in ",
                                                     there->second->text,
                                                     " and in ",
                                                     source.text,
                                                     rename ? ""
                                                            : "; --rename-clashes tells them "
                                                              "apart"));
      }
      source.renamed[name] = merged;
    }
  }
  return absl::OkStatus();
}

class Merger {
 public:
  Merger(Context& context, const std::string& map, const std::vector<Source>& sources)
      : context_(context),
        map_(map),
        sources_(sources),
        progress_(context.output.talk(), TalksToTerminal(), "merge") {
    for (const Source& source : sources) total_ += source.scans.size();
  }

  absl::Status Run() {
    for (const Source& source : sources_) {
      STRATA_RETURN_IF_ERROR(CopyTables(source));
    }
    for (const Source& source : sources_) {
      for (const ScanInfo& scan : source.scans) {
        STRATA_RETURN_IF_ERROR(Copy(source, scan));
        points_ += scan.header.point_count;
        progress_.Update(++done_, total_, points_);
      }
    }
    STRATA_RETURN_IF_ERROR(AwaitIntegration());
    for (const Source& source : sources_) STRATA_RETURN_IF_ERROR(CopyConstraints(source));
    progress_.Clear();
    return absl::OkStatus();
  }
  std::uint64_t constraints() const { return constraints_; }

 private:
  ScanId Renamed(const Source& source, const ScanId& id) const {
    return {source.renamed.at(id.trajectory), id.sequence};
  }

  // Classes and profiles; the first map's default profile is the new map's.
  absl::Status CopyTables(const Source& source) {
    STRATA_ASSIGN_OR_RETURN(const std::vector<MapClass> classes,
                            source.database->maps().ListClasses(context_.call, source.map));
    for (const MapClass& map_class : classes) {
      const auto [there, added] = classes_.emplace(map_class.id, map_class.name);
      if (!added && there->second != map_class.name) {
        return absl::FailedPreconditionError(absl::StrCat("class ",
                                                          map_class.id,
                                                          " is ",
                                                          there->second,
                                                          " in one map and ",
                                                          map_class.name,
                                                          " in ",
                                                          source.text));
      }
      if (!added) continue;
      const absl::Status set = context_.database.maps().SetClass(context_.call, map_, map_class);
      if (!set.ok()) return Annotate(set, source.text);
    }
    STRATA_ASSIGN_OR_RETURN(const auto profiles,
                            source.database->planning().ListProfiles(context_.call, source.map));
    for (const auto& [name, profile] : profiles) {
      const auto [there, added] = profiles_.emplace(name, profile);
      if (!added && !(there->second == profile) && name != api::kDefaultProfile) {
        return absl::FailedPreconditionError(
            absl::StrCat("profile ", name, " of ", source.text, " is another than before"));
      }
      if (!added || name == api::kDefaultProfile) continue;
      STRATA_RETURN_IF_ERROR(
          context_.database.planning().SetProfile(context_.call, map_, name, profile));
    }
    return absl::OkStatus();
  }

  // A full server is asked again as often as it takes.
  absl::Status Copy(const Source& source, const ScanInfo& scan) {
    while (true) {
      const absl::Status copied = CopyOnce(source, scan);
      if (copied.ok()) return copied;
      if (!absl::IsResourceExhausted(copied)) {
        return Annotate(copied, absl::StrCat("scan ", scan.header.id.ToString()));
      }
      STRATA_RETURN_IF_ERROR(context_.call.stop.status());
      absl::SleepFor(absl::Milliseconds(100));
    }
  }

  absl::Status CopyOnce(const Source& source, const ScanInfo& scan) {
    ScanHeader header = scan.header;
    header.id = Renamed(source, header.id);
    header.T_map_scan = scan.T_map_scan;
    header.content_hash.clear();
    header.alignment = Alignment::kOff;
    header.has_label = header.has_label || scan.person_labels || scan.label_model != 0;
    STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<api::ScanUpload> upload,
                            context_.database.scans().Upload(context_.call, map_, header));
    STRATA_RETURN_IF_ERROR(source.database->scans().GetPoints(
        context_.call, source.map, scan.header.id, [&](const PointCloud& piece) {
          return upload->Write(piece);
        }));
    return upload->Finish().status();
  }

  absl::Status AwaitIntegration() {
    while (true) {
      STRATA_ASSIGN_OR_RETURN(const MapStats stats,
                              context_.database.maps().Stats(context_.call, map_));
      if (stats.scans_failed > 0) {
        return absl::InternalError(
            absl::StrCat(stats.scans_failed, " scans could not be taken into the new map"));
      }
      if (stats.scans_pending == 0) return absl::OkStatus();
      STRATA_RETURN_IF_ERROR(context_.call.stop.status());
      absl::SleepFor(absl::Milliseconds(50));
    }
  }

  // Those that a person added; jobs find theirs again.
  absl::Status CopyConstraints(const Source& source) {
    STRATA_ASSIGN_OR_RETURN(const api::PoseGraphState graph,
                            source.database->posegraph().Get(context_.call, source.map));
    std::set<ScanId> copied;
    for (const ScanInfo& scan : source.scans) copied.insert(scan.header.id);
    for (Constraint constraint : graph.constraints) {
      if (constraint.origin != ConstraintOrigin::kPerson || !copied.contains(constraint.j) ||
          !(constraint.is_prior() || copied.contains(constraint.i))) {
        continue;
      }
      if (!constraint.is_prior()) constraint.i = Renamed(source, constraint.i);
      constraint.j = Renamed(source, constraint.j);
      STRATA_RETURN_IF_ERROR(
          context_.database.posegraph().AddConstraint(context_.call, map_, constraint).status());
      ++constraints_;
    }
    return absl::OkStatus();
  }

  Context& context_;
  const std::string& map_;
  const std::vector<Source>& sources_;
  Progress progress_;
  std::uint64_t done_ = 0;
  std::uint64_t total_ = 0;
  std::uint64_t points_ = 0;
  std::uint64_t constraints_ = 0;
  std::map<int, std::string> classes_;
  std::map<std::string, RobotProfile> profiles_;
};

absl::Status Merge(Context& context, const MergeOptions& options) {
  std::vector<Source> sources;
  for (const std::string& text : options.sources) {
    STRATA_ASSIGN_OR_RETURN(Source source, Open(context, text));
    sources.push_back(std::move(source));
    STRATA_RETURN_IF_ERROR(CheckParameters(sources.front(), sources.back()));
  }
  STRATA_RETURN_IF_ERROR(TellTrajectoriesApart(sources, options.rename_clashes));
  STRATA_RETURN_IF_ERROR(context.database.maps()
                             .Create(context.call, options.map, sources.front().info.parameters)
                             .status());
  Merger merger(context, options.map, sources);
  if (const absl::Status merged = merger.Run(); !merged.ok()) {
    const absl::Status removed = context.database.maps().Delete({}, options.map);
    return removed.ok() ? merged
                        : Annotate(merged, absl::StrCat(options.map, " is incomplete; delete it"));
  }
  STRATA_ASSIGN_OR_RETURN(const MapInfo info,
                          context.database.maps().Get(context.call, options.map));
  STRATA_ASSIGN_OR_RETURN(const MapStats stats,
                          context.database.maps().Stats(context.call, options.map));
  Json json = ToJson(info, stats);
  json["constraints"] = merger.constraints();
  context.output.Object(json);
  return absl::OkStatus();
}

}  // namespace

void AddMapMerge(Commands& commands, CLI::App* noun) {
  auto options = std::make_shared<MergeOptions>();
  CLI::App* merge = commands.Verb(
      noun,
      "merge",
      "Make a map of the scans of several at their present poses, with the labels that count, "
      "classes, profiles and the constraints that people added; points that faded are in it again",
      "strata map merge all campus forest.strata",
      [options](Context& context) { return Merge(context, *options); });
  AddMapName(merge, options->map);
  TakesName(merge
                ->add_option(
                    "SOURCE",
                    options->sources,
                    "Maps, and files of maps that nobody has open (with a / or ending in .strata), "
                    "as map backup writes them; of equal parameters")
                ->type_name("MAP|FILE.strata")
                ->expected(1, 1000)
                ->required(),
            kMapNames);
  merge->add_flag("--rename-clashes",
                  options->rename_clashes,
                  "A trajectory whose name another map has already gets its own map's in front");
}

}  // namespace strata::cli
