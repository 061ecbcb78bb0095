#include "server/metrics/engine_metrics.h"

#include <string>

#include "absl/time/time.h"

namespace strata::server {
namespace {

using prometheus::MetricType;

void AddJobs(MetricFamilies& families, const EngineNumbers& numbers) {
  std::vector<MetricRow> rows;
  for (const MapNumbers& map : numbers.maps) {
    for (const auto& [job, count] : map.jobs) {
      rows.push_back(
          {{{"map", map.map}, {"kind", job.first}, {"state", std::string(ToString(job.second))}},
           static_cast<double>(count)});
    }
  }
  AddFamily(families, MetricType::Gauge, "strata_jobs", "Jobs by map, kind and state", rows);
}

// On one store no map has two servers that say so, but for seconds after one was frozen.
void AddOwners(MetricFamilies& families, const EngineNumbers& numbers) {
  std::vector<MetricRow> rows;
  for (const MapNumbers& map : numbers.maps) {
    if (!map.owner.empty()) rows.push_back({{{"map", map.map}, {"owner", map.owner}}, 1.0});
  }
  AddFamily(families,
            MetricType::Gauge,
            "strata_map_owner",
            "1 for each map in a database that this server has open; others on the database wait",
            rows);
  AddFamily(families,
            MetricType::Counter,
            "strata_maps_lost_total",
            "Maps that another server on the database took while they were open here",
            {{{}, static_cast<double>(numbers.maps_lost)}});
}

}  // namespace

void AddEngine(MetricFamilies& families, const EngineNumbers& numbers) {
  const auto add = [&](const char* name, const char* help, auto value) {
    std::vector<MetricRow> rows;
    for (const MapNumbers& map : numbers.maps) {
      rows.push_back({{{"map", map.map}}, static_cast<double>(value(map))});
    }
    AddFamily(families, MetricType::Gauge, name, help, rows);
  };
  using Map = const MapNumbers&;
  AddFamily(families,
            MetricType::Gauge,
            "strata_maps_not_opened",
            "Map files that could not be opened",
            {{{}, static_cast<double>(numbers.maps_not_opened)}});
  add("strata_map_file_bytes", "Map file with its journal", [](Map m) { return m.file_bytes; });
  add("strata_map_journal_bytes", "Journal of the map file", [](Map m) { return m.journal_bytes; });
  const auto add_time = [&](const char* name, const char* help, absl::Time MapNumbers::*time) {
    add(name, help, [time](Map m) {
      return m.*time == absl::InfinitePast() ? 0.0
                                             : absl::ToDoubleSeconds(m.*time - absl::UnixEpoch());
    });
  };
  add_time("strata_map_verified_timestamp_seconds",
           "When a verify last found all sound; 0: never",
           &MapNumbers::verified);
  add_time("strata_map_backed_up_timestamp_seconds",
           "When a backup was last whole; 0: not since the server began",
           &MapNumbers::backed_up);
  add("strata_map_scans", "Acknowledged scans", [](Map m) { return m.scans; });
  add("strata_map_scans_pending", "Scans acknowledged, not joined yet", [](Map m) {
    return m.scans_pending;
  });
  add("strata_map_pending_age_seconds",
      "For how long the oldest of them waits, since the server began at most; 0: none does",
      [](Map m) { return absl::ToDoubleSeconds(m.pending_age); });
  add("strata_map_scans_failed", "Scans that could not be joined", [](Map m) {
    return m.scans_failed;
  });
  add("strata_map_tiles", "Tiles of level of detail 0", [](Map m) { return m.tiles; });
  add("strata_map_queue_bytes", "Points that wait for the disk", [](Map m) {
    return m.queued_bytes;
  });
  const auto add_counter = [&](const char* name, const char* help, auto value) {
    add(name, help, value);
    families.back().type = MetricType::Counter;
  };
  add_counter("strata_commits_total", "Commits", [](Map m) { return m.commits; });
  add_counter("strata_commit_parts_total",
              "Uploads and other works in them; by commits, the size of a batch",
              [](Map m) { return m.commit_parts; });
  add_counter("strata_commit_seconds_total", "Time that commits took", [](Map m) {
    return absl::ToDoubleSeconds(m.commit_time);
  });
  AddJobs(families, numbers);
  AddOwners(families, numbers);
}

}  // namespace strata::server
