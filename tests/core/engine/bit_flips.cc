#include "tests/core/engine/bit_flips.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <sqlite3.h>

#include "core/common/status.h"
#include "core/engine/engine.h"

namespace strata::testing {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kUnfinished = 8;
constexpr char kFileName[] = "yard.strata";

// Columns whose blobs are told apart by what they are of.
const std::vector<FlipKind>& ApartKinds() {
  static const auto* const kinds = new std::vector<FlipKind>{
      {"truth_chunk", "bytes", "upload IN (SELECT upload FROM truth_scan)"},
      {"truth_chunk", "bytes", "upload IN (SELECT upload FROM truth_upload)"},
      {"truth_label", "bytes", "origin = 1"},
      {"truth_label", "bytes", "origin = 2"},
      {"truth_label", "bytes", "origin = 3"},
      {"truth_pose", "pose", "epoch = (SELECT epoch FROM truth_map)"},
      {"truth_pose", "pose", "epoch < (SELECT epoch FROM truth_map)"},
      {"derived_surface_tile", "bytes", "level = 0"},
      {"derived_surface_tile", "bytes", "level > 0"},
  };
  return *kinds;
}

// A connection to a map's file, behind the engine's back.
class MapFile {
 public:
  explicit MapFile(const fs::path& directory) {
    sqlite3_open((directory / kFileName).c_str(), &connection_);
  }
  ~MapFile() { sqlite3_close(connection_); }
  MapFile(const MapFile&) = delete;
  MapFile& operator=(const MapFile&) = delete;

  // Of the first column of every row.
  std::vector<std::string> Ask(const std::string& sql) const {
    std::vector<std::string> answers;
    sqlite3_stmt* row = nullptr;
    sqlite3_prepare_v2(connection_, sql.c_str(), -1, &row, nullptr);
    while (sqlite3_step(row) == SQLITE_ROW) {
      const void* bytes = sqlite3_column_blob(row, 0);
      const int size = sqlite3_column_bytes(row, 0);
      answers.emplace_back(static_cast<const char*>(bytes), static_cast<std::size_t>(size));
    }
    sqlite3_finalize(row);
    return answers;
  }
  bool Run(const std::string& sql) const {
    return sqlite3_exec(connection_, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK;
  }

 private:
  sqlite3* connection_ = nullptr;
};

std::string Literal(const std::string& type, const std::string& bytes) {
  if (type == "integer" || type == "real") return bytes;
  std::string text = "x'";
  for (const char c : bytes)
    absl::StrAppend(&text, absl::Hex(static_cast<std::uint8_t>(c), absl::kZeroPad2));
  return type == "text" ? absl::StrCat("CAST(", text, "' AS TEXT)") : absl::StrCat(text, "'");
}

// The value with one bit flipped, as SQL; empty where that is no value.
std::string Flipped(const std::string& type, std::string value, std::mt19937_64& random) {
  if (type == "integer") {
    return absl::StrCat(std::stoll(value) ^ (std::int64_t{1} << (random() % 40)));
  }
  if (type == "real") {
    double number = std::stod(value);
    std::uint64_t bits = 0;
    std::memcpy(&bits, &number, sizeof(bits));
    bits ^= std::uint64_t{1} << (random() % 64);
    std::memcpy(&number, &bits, sizeof(bits));
    char text[40];
    std::snprintf(text, sizeof(text), "%.17e", number);
    return std::isfinite(number) ? text : "";
  }
  if (value.empty()) return "";
  const std::size_t at = random() % value.size();
  value[at] = static_cast<char>(value[at] ^ (1 << (random() % (type == "text" ? 5 : 8))));
  return Literal(type, value);
}

std::string AllOf(const FlipKind& kind) {
  return absl::StrCat(" FROM ", kind.table, kind.where.empty() ? "" : " WHERE ", kind.where);
}

// A condition that holds for one row.
std::string RowOf(const MapFile& file, const FlipKind& kind, std::uint64_t choice) {
  const std::string keys = absl::StrCat(
      "SELECT name FROM pragma_table_info('", kind.table, "') WHERE pk > 0 ORDER BY pk");
  const std::vector<std::string> count = file.Ask(absl::StrCat("SELECT count(*)", AllOf(kind)));
  if (count.empty() || count[0] == "0") return "";
  const std::uint64_t row = choice % std::stoull(count[0]);
  std::string condition;
  for (const std::string& key : file.Ask(keys)) {
    const std::vector<std::string> value =
        file.Ask(absl::StrCat("SELECT quote(", key, ")", AllOf(kind), " LIMIT 1 OFFSET ", row));
    absl::StrAppend(&condition, condition.empty() ? "" : " AND ", key, " = ", value.at(0));
  }
  return condition;
}

bool IsError(const std::string& answer) {
  for (const char* code : {"DATA_LOSS",
                           "UNAVAILABLE",
                           "RESOURCE_EXHAUSTED",
                           "FAILED_PRECONDITION",
                           "NOT_FOUND",
                           "UNIMPLEMENTED",
                           "INVALID_ARGUMENT",
                           "PERMISSION_DENIED",
                           "ALREADY_EXISTS",
                           "INTERNAL",
                           "OUT_OF_RANGE",
                           "ABORTED"}) {
    if (absl::StartsWith(answer, code)) return true;
  }
  return false;
}

// A list that ended with an error names nothing of what it has not told.
bool IsHidden(const std::string& thing, const WorldState& found) {
  static const std::vector<std::pair<std::string, std::string>> kLists = {
      {"scan ", "scans"},
      {"constraint ", "graph"},
      {"plane ", "graph"},
      {"profile ", "profiles"},
      {"class ", "classes"},
      {"classifier ", "classifiers"},
      {"epoch ", "epochs"},
      {"first epoch, ", "first epoch"}};
  for (const auto& [things, list] : kLists) {
    if (!absl::StartsWith(thing, things)) continue;
    const auto it = found.find(list);
    return it != found.end() && IsError(it->second);
  }
  return false;
}

struct Answers {
  std::string wrong;  // other than before, and no error
  bool told = false;  // some are errors
};

Answers Compare(const WorldState& sound, const WorldState& found) {
  Answers answers;
  const auto add = [&answers](const std::string& what) {
    absl::StrAppend(&answers.wrong, answers.wrong.empty() ? "" : "; ", what);
  };
  for (const auto& [name, value] : sound) {
    const auto it = found.find(name);
    if (it == found.end()) {
      if (!IsHidden(name, found)) add(absl::StrCat(name, " is gone"));
    } else if (it->second != value && IsError(it->second)) {
      answers.told = true;
    } else if (it->second != value) {
      add(absl::StrCat(name, " is '", it->second, "' instead of '", value, "'"));
    }
  }
  for (const auto& [name, value] : found) {
    if (sound.contains(name)) continue;
    answers.told = answers.told || IsError(value);
    if (!IsError(value)) add(absl::StrCat(name, " came: '", value, "'"));
  }
  return answers;
}

// Observe() and what only this asks for.
WorldState Survey(api::Database& database) {
  WorldState state = Observe(database);
  api::TileArea area;
  area.epoch = 1;
  const absl::Status before =
      database.tiles().Fetch({}, kHistoryMap, area, {}, [&](const api::TileUpdate& update) {
        state[absl::StrCat("first epoch, tile ", update.tile.key.ToString())] =
            update.kind == api::TileUpdate::Kind::kDamaged ? "DATA_LOSS: damaged"
                                                           : absl::StrCat(update.tile.bytes.size());
        return absl::OkStatus();
      });
  if (!before.ok()) state["first epoch"] = before.ToString();
  const auto epochs = database.maps().History({}, kHistoryMap);
  if (!epochs.ok()) state["epochs"] = epochs.status().ToString();
  for (const EpochInfo& epoch : epochs.value_or(std::vector<EpochInfo>())) {
    state[absl::StrCat("epoch ", epoch.epoch)] = epoch.reason;
  }
  const auto held = PointsHeld(database, kUnfinished);
  // Nothing was promised of it; less is as good.
  state["unfinished"] = held.ok() ? "" : held.status().ToString();
  return state;
}

std::string Reopen(const fs::path& directory,
                   std::unique_ptr<api::Database>& database,
                   absl::Duration prepare_after = absl::InfiniteDuration()) {
  database.reset();
  EngineOptions options = HistoryOptions(directory);
  options.prepare_after = prepare_after;
  auto opened = OpenEngine(options);
  if (!opened.ok()) return opened.status().ToString();
  database = *std::move(opened);
  return "";
}

// Until the map has nothing left to do at rest.
absl::Status Rest(api::Database& database) {
  while (true) {
    STRATA_ASSIGN_OR_RETURN(const MapStats stats, database.maps().Stats({}, kHistoryMap));
    if (stats.tiles_prepared == stats.tiles) return absl::OkStatus();
    absl::SleepFor(absl::Milliseconds(2));
  }
}

absl::Status LiveWithPoints(api::Database& database) {
  for (const HistoryStep& step : DiskHistory()) {
    STRATA_RETURN_IF_ERROR(Annotate(step.run(database, {}), step.name));
  }
  STRATA_RETURN_IF_ERROR(Settle(database));
  STRATA_RETURN_IF_ERROR(BreakOff(database, kUnfinished));
  STRATA_RETURN_IF_ERROR(
      database.jobs().Start({}, kHistoryMap, "optimize", {{"dry_run", "1"}}).status());
  return Settle(database);
}

absl::Status LiveWithoutPoints(api::Database& database) {
  MapParameters parameters = ParametersOfYard();
  parameters.keep_points = false;
  STRATA_RETURN_IF_ERROR(database.maps().Create({}, kHistoryMap, parameters).status());
  for (std::uint64_t i = 0; i < 3; ++i) STRATA_RETURN_IF_ERROR(UploadScan(database, i));
  return Settle(database);
}

}  // namespace

std::string FlipKind::name() const {
  return absl::StrCat(table, ".", column, where.empty() ? "" : " where ", where);
}

absl::StatusOr<BitFlips> BitFlips::Prepare(bool keep_points) {
  BitFlips flips;
  flips.directory_ = std::make_shared<TempDir>();
  const fs::path& directory = flips.directory_->path();
  {
    std::unique_ptr<api::Database> database;
    Reopen(directory, database);
    STRATA_RETURN_IF_ERROR(keep_points ? LiveWithPoints(*database) : LiveWithoutPoints(*database));
    Reopen(directory, database, absl::ZeroDuration());
    STRATA_RETURN_IF_ERROR(Settle(*database));
    STRATA_RETURN_IF_ERROR(Rest(*database));
    STRATA_RETURN_IF_ERROR(RunToEnd(*database, "verify"));
    flips.sound_ = Survey(*database);
  }
  const MapFile file(directory);
  for (const std::string& table :
       file.Ask("SELECT name FROM sqlite_schema WHERE type = 'table' AND (name GLOB 'truth_*' OR "
                "name GLOB 'derived_*') AND name NOT GLOB 'derived_footprint*' ORDER BY name")) {
    for (const std::string& column :
         file.Ask(absl::StrCat("SELECT name FROM pragma_table_info('", table, "')"))) {
      FlipKind kind{table, column, "", false};
      kind.blob = file.Ask(absl::StrCat("SELECT 1 FROM pragma_table_info('",
                                        table,
                                        "') WHERE name = '",
                                        column,
                                        "' AND type = 'BLOB'"))
                      .size() == 1;
      std::vector<FlipKind> apart;
      for (FlipKind each : ApartKinds()) {
        each.blob = true;
        if (each.table == table && each.column == column) apart.push_back(each);
      }
      if (apart.empty()) apart.push_back(kind);
      for (const FlipKind& each : apart) {
        if (file.Ask(absl::StrCat("SELECT count(*)", AllOf(each))) != std::vector<std::string>{"0"})
          flips.kinds_.push_back(each);
      }
    }
  }
  return flips;
}

void BitFlips::FlipIn(const FlipKind& kind, std::uint64_t seed, FlipResult& result) const {
  std::mt19937_64 random(seed);
  const TempDir directory;
  fs::copy_file(directory_->path() / kFileName, directory.path() / kFileName);
  std::string what;
  {
    const MapFile file(directory.path());
    const std::string row = RowOf(file, kind, random());
    const std::string where = absl::StrCat(" FROM ", kind.table, " WHERE ", row);
    const std::vector<std::string> type =
        file.Ask(absl::StrCat("SELECT typeof(", kind.column, ")", where));
    const std::vector<std::string> value = file.Ask(absl::StrCat("SELECT ", kind.column, where));
    if (type.empty() || value.empty()) return;
    const std::string flipped = Flipped(type[0], value[0], random);
    if (flipped.empty()) return;
    // A bit that breaks a constraint of the table breaks the file, which FlipAnywhere() is for.
    if (!file.Run(absl::StrCat(
            "UPDATE ", kind.table, " SET ", kind.column, " = ", flipped, " WHERE ", row))) {
      return;
    }
    what = absl::StrCat(kind.name(), ", seed ", seed, ", ", row);
  }
  Judge(what, &kind, directory.path(), result);
}

void BitFlips::FlipAnywhere(std::uint64_t seed, FlipResult& result) const {
  std::mt19937_64 random(seed);
  const TempDir directory;
  const fs::path file = directory.path() / kFileName;
  fs::copy_file(directory_->path() / kFileName, file);
  const auto at = static_cast<std::int64_t>(random() % fs::file_size(file));
  {
    std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
    stream.seekg(at);
    const int byte = stream.get();
    stream.seekp(at);
    stream.put(static_cast<char>(byte ^ (1 << (random() % 8))));
  }
  Judge(absl::StrCat("byte ", at, ", seed ", seed), nullptr, directory.path(), result);
}

void BitFlips::Judge(const std::string& what,
                     const FlipKind* kind,
                     const fs::path& directory,
                     FlipResult& result) const {
  ++result.trials;
  const auto violated = [&](const std::string& how) {
    result.violations.push_back(absl::StrCat(what, ": ", how));
  };
  std::unique_ptr<api::Database> database;
  if (const std::string error = Reopen(directory, database); !error.empty()) {
    return violated(absl::StrCat("no engine: ", error));
  }
  const absl::Status settled = Settle(*database);
  if (absl::IsDeadlineExceeded(settled)) return violated("hangs");
  if (!settled.ok() || !database->maps().Get({}, kHistoryMap).ok()) {
    ++result.refused;
    const bool says = absl::IsDataLoss(settled) || absl::IsFailedPrecondition(settled);
    if (!says || (kind != nullptr && kind->blob)) violated(settled.ToString());
    return;
  }
  // First, since it waits for derived data that are being made again.
  const absl::Status verified = RunToEnd(*database, "verify");
  const bool named = !verified.ok();
  const auto [wrong, told] = Compare(sound_, Survey(*database));
  if (!wrong.empty()) {
    ++result.wrong;
    result.wrong_answers.push_back(
        absl::StrCat(what, named ? " (verify names it): " : " (verify does not): ", wrong));
  } else if (told || named) {
    ++result.told;
  } else {
    ++result.same;
  }
  if (!named && (told || !wrong.empty())) ++result.unnamed;
  if (named && !absl::IsInternal(verified)) violated(verified.ToString());
  const absl::Status rebuilt = RunToEnd(*database, "rebuild");
  const bool mended = rebuilt.ok() && Difference(sound_, Survey(*database)).empty() &&
                      RunToEnd(*database, "verify").ok();
  if (mended) ++result.mended;
  if (kind == nullptr) return;
  if (kind->blob && !wrong.empty()) violated(absl::StrCat("wrong: ", wrong));
  if (kind->blob && told && !named) violated("verify does not name it");
  if (absl::StartsWith(kind->table, "derived_") && !mended) {
    violated(absl::StrCat("a rebuild does not mend it: ",
                          rebuilt.ToString(),
                          "; ",
                          Difference(sound_, Survey(*database))));
  }
}

}  // namespace strata::testing
