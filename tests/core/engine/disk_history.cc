#include "tests/core/engine/disk_history.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "core/cloud/cloud_slice.h"
#include "core/codec/surface_tile_codec.h"
#include "core/common/checksum.h"
#include "core/common/status.h"
#include "core/world/scan_hash.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/patience.h"
#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"

namespace strata::testing {
namespace {

constexpr std::uint64_t kYardScans = 7;
constexpr std::uint64_t kYardWithCrate = 2;  // scans before it was taken away
constexpr std::uint64_t kDeleted = 6;
constexpr std::uint64_t kMoved = 4;
constexpr std::uint16_t kGround = 1;
constexpr std::uint16_t kStructure = 2;
constexpr char kNote[] = "by tape";

Scene Yard(bool crate) {
  Scene scene;
  scene.SetTerrain(Eigen::AlignedBox2d(Eigen::Vector2d(-12.0, -12.0), Eigen::Vector2d(12.0, 12.0)),
                   1.0,
                   [](double, double) { return 0.0; });
  scene.Add(Box({-10.0, 8.0, 0.0}, {10.0, 8.2, 2.0}));
  if (crate) scene.Add(Box({0.0, 3.0, 0.0}, {1.5, 4.5, 1.2}));
  scene.Build();
  return scene;
}

Pose StopOf(std::uint64_t i) {
  Pose T_map_scan = PoseAt(-3.0 + 0.8 * static_cast<double>(i), 0.0);
  T_map_scan.translation().z() = 2.2;
  return T_map_scan;
}

PointCloud CloudOf(std::uint64_t i) {
  static const Scene* const with = new Scene(Yard(true));
  static const Scene* const without = new Scene(Yard(false));
  SensorOptions sensor;
  sensor.rings = 24;
  sensor.columns = 90;
  return SimulateScan(i < kYardWithCrate ? *with : *without, sensor, StopOf(i), i);
}

ScanHeader HeaderOfScan(std::uint64_t i, const PointCloud& cloud) {
  ScanHeader header = HeaderOf({"robot", i}, cloud, StopOf(i));
  header.content_hash = ContentHashOf(header, cloud);
  return header;
}

// Writes what the upload lacks, up to point `end`.
absl::Status WriteUpTo(api::ScanUpload& upload, const PointCloud& cloud, std::size_t end) {
  constexpr std::size_t kPiece = 1000;
  for (std::size_t begin = upload.points_held(); begin < end; begin += kPiece) {
    STRATA_RETURN_IF_ERROR(upload.Write(SliceOf(cloud, begin, std::min(end, begin + kPiece))));
  }
  return absl::OkStatus();
}

absl::Status CreateMap(api::Database& database) {
  const absl::Status created = database.maps().Create({}, kHistoryMap, ParametersOfYard()).status();
  // Whole, where it failed before.
  return absl::IsAlreadyExists(created) ? database.maps().Stats({}, kHistoryMap).status() : created;
}

absl::Status MoveScan(api::Database& database, const Hopeless& hopeless) {
  STRATA_RETURN_IF_ERROR(Settle(database, hopeless));
  return database.posegraph().SetPose(
      {}, kHistoryMap, {"robot", kMoved}, StopOf(kMoved) * PoseAt(0.2, -0.1, 0.03));
}

absl::Status LabelScan(api::Database& database) {
  std::vector<std::uint16_t> labels;
  for (const Eigen::Vector3f& p : CloudOf(1).points) {
    labels.push_back(p.z() < -2.0F ? kGround : kStructure);
  }
  return database.scans().SetLabels(
      {}, kHistoryMap, {"robot", 1}, labels, api::LabelMode::kReplace);
}

absl::Status DeleteScan(api::Database& database) {
  const absl::Status deleted = database.scans().Delete({}, kHistoryMap, {"robot", kDeleted});
  return absl::IsNotFound(deleted) ? absl::OkStatus() : deleted;
}

absl::Status ChangeProfile(api::Database& database) {
  RobotProfile profile;
  profile.radius_m = 0.45;
  return database.planning().SetProfile({}, kHistoryMap, api::kDefaultProfile, profile);
}

absl::Status NameGround(api::Database& database) {
  return database.maps().SetClass({}, kHistoryMap, {kGround, "ground", {120, 90, 60}});
}

absl::Status NameStructure(api::Database& database) {
  return database.maps().SetClass({}, kHistoryMap, {kStructure, "structure", {90, 90, 90}});
}

absl::Status Constrain(api::Database& database) {
  STRATA_ASSIGN_OR_RETURN(const api::PoseGraphState graph,
                          database.posegraph().Get({}, kHistoryMap));
  for (const Constraint& constraint : graph.constraints) {
    if (constraint.note == kNote) return absl::OkStatus();
  }
  Constraint constraint;
  constraint.i = {"robot", 2};
  constraint.j = {"robot", kMoved};
  constraint.T_i_j = StopOf(2).inverse() * StopOf(kMoved);
  constraint.information = Matrix6d::Identity() * 1e4;
  constraint.note = kNote;
  return database.posegraph().AddConstraint({}, kHistoryMap, constraint).status();
}

// Once, however often it is tried.
absl::Status RunOnce(api::Database& database,
                     const std::string& kind,
                     const JobParameters& parameters,
                     const Hopeless& hopeless) {
  STRATA_RETURN_IF_ERROR(Settle(database, hopeless));
  STRATA_ASSIGN_OR_RETURN(const std::vector<JobInfo> jobs, database.jobs().List({}, kHistoryMap));
  for (const JobInfo& job : jobs) {
    if (job.kind == kind && job.state == JobState::kSucceeded) return absl::OkStatus();
  }
  return RunToEnd(database, kind, parameters, hopeless);
}

absl::Status BackUpMap(api::Database& database) {
  ContentHasher hasher;
  std::uint64_t bytes = 0;
  std::uint64_t total_bytes = 0;
  std::string hash;
  STRATA_RETURN_IF_ERROR(
      database.maps().Backup({}, kHistoryMap, [&](const api::BackupPiece& piece) {
        hasher.Add(piece.bytes);
        bytes += piece.bytes.size();
        total_bytes = piece.total_bytes;
        hash = piece.content_hash;
        return absl::OkStatus();
      }));
  if (bytes == total_bytes && bytes > 0 && hash == hasher.HexDigest()) return absl::OkStatus();
  return absl::InternalError("a backup that is not whole was delivered as one");
}

absl::Status WatchMap(api::Database& database) {
  std::size_t scans = 0;
  bool whole = false;
  api::WatchOptions options;
  options.once = true;
  STRATA_RETURN_IF_ERROR(
      database.maps().Watch({}, kHistoryMap, options, [&](const api::MapUpdate& update) {
        whole = whole || update.whole;
        scans += update.scans.size();
        return absl::OkStatus();
      }));
  if (whole && scans == kYardScans - 1) return absl::OkStatus();
  return absl::InternalError(absl::StrCat("a watch tells of ", scans, " scans"));
}

using Run = std::function<absl::Status(api::Database&)>;

HistoryStep Step(std::string name, Run run, bool changes = true) {
  return {
      std::move(name),
      [run = std::move(run)](api::Database& database, const Hopeless&) { return run(database); },
      changes,
      false};
}

HistoryStep UploadStep(std::uint64_t i) {
  return Step(absl::StrCat("upload ", i),
              [i](api::Database& database) { return UploadScan(database, i); });
}

HistoryStep JobStep(const std::string& kind,
                    const JobParameters& parameters,
                    bool gradual = false) {
  return {kind,
          [=](api::Database& database, const Hopeless& hopeless) {
            return RunOnce(database, kind, parameters, hopeless);
          },
          true,
          gradual};
}

template <typename T>
std::string Hashed(const std::vector<T>& values) {
  return absl::StrFormat(
      "%016x",
      Checksum64({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)}));
}

std::string Described(const Pose& pose) {
  std::string text;
  for (int i = 0; i < 12; ++i) absl::StrAppendFormat(&text, " %.7f", pose.matrix()(i % 3, i / 3));
  return text;
}

std::string ValueOf(const absl::Status& status, const std::string& value) {
  return status.ok() ? value : status.ToString();
}

std::string PointsOf(api::Database& database, const ScanId& id) {
  std::vector<Eigen::Vector3f> points;
  std::vector<std::uint16_t> labels;
  const absl::Status read =
      database.scans().GetPoints({}, kHistoryMap, id, [&](const PointCloud& piece) {
        points.insert(points.end(), piece.points.begin(), piece.points.end());
        labels.insert(labels.end(), piece.label.begin(), piece.label.end());
        return absl::OkStatus();
      });
  return ValueOf(read,
                 absl::StrCat(points.size(),
                              " points ",
                              Hashed(points),
                              ", ",
                              labels.size(),
                              " labels ",
                              Hashed(labels)));
}

void ObserveScans(api::Database& database, WorldState& state) {
  std::vector<ScanInfo> scans;
  const absl::Status listed = database.scans().List({}, kHistoryMap, {}, [&](const ScanInfo& scan) {
    scans.push_back(scan);
    return absl::OkStatus();
  });
  if (!listed.ok()) state["scans"] = listed.ToString();
  for (const ScanInfo& scan : scans) {
    const ScanId& id = scan.header.id;
    const std::string name = absl::StrCat("scan ", id.ToString());
    state[absl::StrCat(name, " row")] = absl::StrCat("state ",
                                                     static_cast<int>(scan.state),
                                                     " ",
                                                     scan.message,
                                                     " ",
                                                     scan.content_hash,
                                                     " ",
                                                     scan.faded_points,
                                                     " faded ",
                                                     scan.person_labels);
    state[absl::StrCat(name, " points")] = PointsOf(database, id);
    const auto faded = database.scans().GetFaded({}, kHistoryMap, id);
    state[absl::StrCat(name, " faded")] = ValueOf(faded.status(), faded.ok() ? Hashed(*faded) : "");
    const auto pose = database.posegraph().LookupPose({}, kHistoryMap, id);
    state[absl::StrCat(name, " pose")] =
        ValueOf(pose.status(), pose.ok() ? Described(pose->T_map_scan) : "");
  }
}

void ObserveKnowledge(api::Database& database, WorldState& state) {
  const auto profiles = database.planning().ListProfiles({}, kHistoryMap);
  if (!profiles.ok()) state["profiles"] = profiles.status().ToString();
  for (const auto& [name, p] : profiles.value_or(std::map<std::string, RobotProfile>())) {
    state[absl::StrCat("profile ", name)] = absl::StrCat(p.radius_m,
                                                         " ",
                                                         p.height_m,
                                                         " ",
                                                         p.max_step_m,
                                                         " ",
                                                         p.max_slope_rad,
                                                         " ",
                                                         p.max_gap_m,
                                                         " ",
                                                         p.max_roughness_m);
  }
  const auto classes = database.maps().ListClasses({}, kHistoryMap);
  if (!classes.ok()) state["classes"] = classes.status().ToString();
  for (const MapClass& c : classes.value_or(std::vector<MapClass>())) {
    state[absl::StrCat("class ", c.id)] =
        absl::StrCat(c.name, " ", c.colour.r, " ", c.colour.g, " ", c.colour.b);
  }
  const auto classifiers = database.classifiers().List({}, kHistoryMap);
  if (!classifiers.ok()) state["classifiers"] = classifiers.status().ToString();
  for (const ClassifierInfo& info : classifiers.value_or(std::vector<ClassifierInfo>())) {
    ContentHasher hasher;
    const absl::Status exported =
        database.classifiers().Export({}, kHistoryMap, info.name, [&](absl::string_view piece) {
          hasher.Add(piece);
          return absl::OkStatus();
        });
    state[absl::StrCat("classifier ", info.name)] = ValueOf(exported, hasher.HexDigest());
  }
}

void ObserveGraph(api::Database& database, WorldState& state) {
  const auto graph = database.posegraph().Get({}, kHistoryMap);
  if (!graph.ok()) {
    state["graph"] = graph.status().ToString();
    return;
  }
  for (const Constraint& c : graph->constraints) {
    const std::string ends = absl::StrCat(c.i.ToString(), " ", c.j.ToString(), " ", c.note);
    state[absl::StrCat("constraint ", ends)] =
        absl::StrCat(Described(c.T_i_j), " ", c.information.sum(), " ", c.enabled);
  }
  for (const GlobalPlane& p : graph->planes) {
    std::string supports;
    for (const PlaneSupport& s : p.supports) {
      absl::StrAppend(&supports, " ", s.scan.ToString(), " ", s.weight, " ", s.rms_m);
    }
    state[absl::StrFormat(
        "plane %.4f %.4f %.4f", p.plane.normal.x(), p.plane.normal.y(), p.plane.distance)] =
        supports;
  }
}

// What the tile shows; its version is one of many that it might have.
std::string Shown(const std::string& bytes) {
  absl::StatusOr<SurfaceTile> tile = DecodeSurfaceTile(bytes);
  if (!tile.ok()) return tile.status().ToString();
  tile->version = 0;
  return absl::StrFormat("%016x", Checksum64(EncodeSurfaceTile(*tile).value()));
}

void ObserveTiles(api::Database& database, WorldState& state) {
  for (int level = 0; level <= kMaxLevel; ++level) {
    api::TileArea area;
    area.level = level;
    const absl::Status fetched =
        database.tiles().Fetch({}, kHistoryMap, area, {}, [&](const api::TileUpdate& update) {
          const bool damaged = update.kind == api::TileUpdate::Kind::kDamaged;
          state[absl::StrCat("tile ", update.tile.key.ToString())] =
              damaged ? "DATA_LOSS: damaged" : Shown(update.tile.bytes);
          return absl::OkStatus();
        });
    if (!fetched.ok()) state[absl::StrCat("tiles of level ", level)] = fetched.ToString();
  }
}

}  // namespace

const std::vector<HistoryStep>& DiskHistory() {
  static const auto* const history = new std::vector<HistoryStep>{
      Step("create", CreateMap),
      UploadStep(0),
      Step(
          "break off",
          [](api::Database& database) { return BreakOff(database, kYardWithCrate - 1); },
          false),
      UploadStep(1),
      UploadStep(2),
      UploadStep(3),
      {"integrate", Settle, false, false},
      UploadStep(4),
      UploadStep(5),
      UploadStep(6),
      {"move", MoveScan, true, false},
      Step("label", LabelScan),
      Step("delete", DeleteScan),
      Step("profile", ChangeProfile),
      Step("name ground", NameGround),
      Step("name structure", NameStructure),
      Step("constrain", Constrain),
      JobStep("train", {{"name", "yard"}, {"method", "bayes"}, {"reduce", "random=300"}}),
      JobStep("classify", {{"model", "yard"}}, true),
      JobStep("optimize", {{"closures", "0"}}),
      JobStep("fade", {{"scans", "2"}, {"rays", "1"}}, true),
      Step("backup", BackUpMap, false),
      Step("watch", WatchMap, false),
  };
  return *history;
}

WorldState Observe(api::Database& database) {
  WorldState state;
  const auto stats = database.maps().Stats({}, kHistoryMap);
  if (absl::IsNotFound(stats.status())) return state;
  state["content"] = ValueOf(
      stats.status(),
      stats.ok()
          ? absl::StrCat(
                stats->scans, " ", stats->points, " ", stats->patches, " ", stats->content_digest)
          : "");
  ObserveScans(database, state);
  ObserveKnowledge(database, state);
  ObserveGraph(database, state);
  ObserveTiles(database, state);
  return state;
}

std::string Difference(const WorldState& expected, const WorldState& found) {
  std::string text;
  const auto add = [&text](const std::string& what) {
    absl::StrAppend(&text, text.empty() ? "" : "; ", what);
  };
  for (const auto& [name, value] : expected) {
    const auto it = found.find(name);
    if (it == found.end()) {
      add(absl::StrCat(name, " is gone"));
    } else if (it->second != value) {
      add(absl::StrCat(name, " is '", it->second, "' instead of '", value, "'"));
    }
  }
  for (const auto& [name, value] : found) {
    if (!expected.contains(name)) add(absl::StrCat(name, " came: '", value, "'"));
  }
  return text;
}

absl::Status Settle(api::Database& database, const Hopeless& hopeless) {
  const absl::Time deadline = absl::Now() + kPatience;
  while (true) {
    STRATA_ASSIGN_OR_RETURN(const MapStats stats, database.maps().Stats({}, kHistoryMap));
    STRATA_ASSIGN_OR_RETURN(const std::vector<JobInfo> jobs, database.jobs().List({}, kHistoryMap));
    const bool jobs_ended = std::all_of(
        jobs.begin(), jobs.end(), [](const JobInfo& job) { return IsFinal(job.state); });
    if (stats.scans_pending == 0 && jobs_ended) return absl::OkStatus();
    if (hopeless && hopeless()) return absl::UnavailableError("waiting is in vain");
    if (absl::Now() > deadline) return absl::DeadlineExceededError("the map does not settle");
    absl::SleepFor(absl::Milliseconds(1));
  }
}

absl::Status RunToEnd(api::Database& database,
                      const std::string& kind,
                      const JobParameters& parameters,
                      const Hopeless& hopeless) {
  STRATA_ASSIGN_OR_RETURN(const JobInfo job,
                          database.jobs().Start({}, kHistoryMap, kind, parameters));
  STRATA_RETURN_IF_ERROR(Settle(database, hopeless));
  STRATA_ASSIGN_OR_RETURN(const JobInfo ended, database.jobs().Get({}, kHistoryMap, job.id));
  if (ended.state == JobState::kSucceeded) return absl::OkStatus();
  return absl::InternalError(absl::StrCat("job ", kind, ": ", ended.message));
}

absl::Status CheckSound(api::Database& database) {
  STRATA_RETURN_IF_ERROR(RunToEnd(database, "verify"));
  const WorldState before = Observe(database);
  STRATA_RETURN_IF_ERROR(RunToEnd(database, "rebuild"));
  const std::string changed = Difference(before, Observe(database));
  return changed.empty() ? absl::OkStatus() : absl::InternalError("rebuild: " + changed);
}

absl::StatusOr<std::string> FreshDigest(api::Database& database) {
  constexpr char kFresh[] = "fresh";
  STRATA_RETURN_IF_ERROR(database.maps().Create({}, kFresh, ParametersOfYard()).status());
  std::vector<ScanInfo> scans;
  STRATA_RETURN_IF_ERROR(database.scans().List({}, kHistoryMap, {}, [&](const ScanInfo& scan) {
    scans.push_back(scan);
    return absl::OkStatus();
  }));
  for (const ScanInfo& scan : scans) {
    STRATA_ASSIGN_OR_RETURN(const std::vector<std::uint16_t> faded,
                            database.scans().GetFaded({}, kHistoryMap, scan.header.id));
    PointCloud lasting;
    std::size_t k = 0;
    STRATA_RETURN_IF_ERROR(
        database.scans().GetPoints({}, kHistoryMap, scan.header.id, [&](const PointCloud& piece) {
          for (std::size_t i = 0; i < piece.size(); ++i, ++k) {
            if (!faded.empty() && faded[k] != 0) continue;
            lasting.points.push_back(piece.points[i]);
            if (!piece.label.empty()) lasting.label.push_back(piece.label[i]);
          }
          return absl::OkStatus();
        }));
    const ScanHeader header = HeaderOf(scan.header.id, lasting, scan.T_map_scan);
    STRATA_RETURN_IF_ERROR(Upload(database, header, lasting, 2000, kFresh).status());
  }
  const std::string digest = WaitIntegrated(database, kFresh).content_digest;
  STRATA_RETURN_IF_ERROR(database.maps().Delete({}, kFresh));
  return digest;
}

bool IsTroubleOfDisk(const absl::Status& status) {
  return absl::IsUnavailable(status) || absl::IsResourceExhausted(status);
}

MapParameters ParametersOfYard() {
  MapParameters parameters;
  parameters.mls.cell_size_m = 0.2;
  return parameters;
}

absl::Status UploadScan(api::Database& database, std::uint64_t i) {
  const PointCloud cloud = CloudOf(i);
  STRATA_ASSIGN_OR_RETURN(const auto upload,
                          database.scans().Upload({}, kHistoryMap, HeaderOfScan(i, cloud)));
  if (upload->points_held() < cloud.size()) {
    STRATA_RETURN_IF_ERROR(WriteUpTo(*upload, cloud, cloud.size()));
  }
  return upload->Finish().status();
}

absl::Status BreakOff(api::Database& database, std::uint64_t i) {
  const PointCloud cloud = CloudOf(i);
  STRATA_ASSIGN_OR_RETURN(const auto upload,
                          database.scans().Upload({}, kHistoryMap, HeaderOfScan(i, cloud)));
  return WriteUpTo(*upload, cloud, cloud.size() / 2);
}

absl::StatusOr<std::uint64_t> PointsHeld(api::Database& database, std::uint64_t i) {
  STRATA_ASSIGN_OR_RETURN(const auto upload,
                          database.scans().Upload({}, kHistoryMap, HeaderOfScan(i, CloudOf(i))));
  return upload->points_held();
}

EngineOptions HistoryOptions(const std::filesystem::path& directory) {
  EngineOptions options;
  options.directory = directory;
  options.worker_threads = 1;
  options.prepare_after = absl::Milliseconds(5);  // beside all else
  return options;
}

}  // namespace strata::testing
