// Writes the map of tests/core/engine/old_maps with whatever version of Strata it is built against;
// see make.sh there.
//   make_old_map DIRECTORY: DIRECTORY/old.strata, and on the standard output what the version says
//   of it.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "absl/time/clock.h"

#include "core/engine/engine.h"
#include "core/geometry/pose.h"

namespace strata {
namespace {

constexpr char kMap[] = "old";

template <typename Result>
auto Require(Result result) {
  if (!result.ok()) {
    std::cerr << result.status() << std::endl;
    std::exit(1);
  }
  return *std::move(result);
}
void RequireOk(const absl::Status& status) {
  if (status.ok()) return;
  std::cerr << status << std::endl;
  std::exit(1);
}

// A floor of 6 × 6 m with a wall at its end, slightly rough and the same everywhere.
PointCloud Corner(std::uint32_t seed) {
  PointCloud cloud;
  for (int i = 0; i < 30; ++i) {
    for (int j = 0; j < 30; ++j) {
      seed = seed * 1664525U + 1013904223U;
      const float rough = static_cast<float>(seed >> 24U) / 256.0F * 0.02F;
      const float x = -3.0F + 0.2F * static_cast<float>(i);
      const float y = -3.0F + 0.2F * static_cast<float>(j);
      const bool wall = i == 29;
      cloud.points.emplace_back(x, y, wall ? 0.1F * static_cast<float>(j) - 1.0F : rough - 1.0F);
      cloud.intensity.push_back(rough);
      cloud.label.push_back(wall ? 2 : 1);
    }
  }
  return cloud;
}

void UploadCorner(api::Database& db, std::uint64_t sequence) {
  const PointCloud cloud = Corner(static_cast<std::uint32_t>(sequence));
  ScanHeader header;
  header.id = {"run", sequence};
  header.time = absl::FromUnixMillis(1'000 * static_cast<std::int64_t>(sequence));
  header.T_map_scan =
      MakePose(Eigen::Quaterniond::Identity(), {2.0 * static_cast<double>(sequence), 0.0, 1.0});
  header.alignment = Alignment::kOff;
  header.point_count = cloud.size();
  header.has_intensity = true;
  header.has_label = true;
  const std::unique_ptr<api::ScanUpload> upload = Require(db.scans().Upload({}, kMap, header));
  RequireOk(upload->Write(cloud));
  Require(upload->Finish());
}

MapStats Settled(api::Database& db) {
  while (true) {
    const MapStats stats = Require(db.maps().Stats({}, kMap));
    if (stats.scans_pending == 0) return stats;
    absl::SleepFor(absl::Milliseconds(20));
  }
}

void Run(api::Database& db, const std::string& kind) {
  const JobInfo job = Require(db.jobs().Start({}, kMap, kind, {}));
  RequireOk(db.jobs().Watch({}, kMap, job.id, [](const JobInfo&) { return absl::OkStatus(); }));
  std::cout << kind << ": " << Require(db.jobs().Get({}, kMap, job.id)).message << std::endl;
}

void Make(const std::string& directory) {
  EngineOptions options;
  options.directory = directory;
  const std::unique_ptr<api::Database> db = Require(OpenEngine(options));
  MapParameters parameters;
  parameters.mls.cell_size_m = 0.2;
  Require(db->maps().Create({}, kMap, parameters));
  for (const std::uint64_t sequence : {1, 2, 3}) UploadCorner(*db, sequence);
  Settled(*db);
  RequireOk(db->posegraph().SetPose(
      {}, kMap, {"run", 2}, MakePose(Eigen::Quaterniond::Identity(), {4.0, 0.5, 1.1})));
#ifdef OLD_MAP_HAS_CONSTRAINTS
  Constraint constraint;
  constraint.i = {"run", 1};
  constraint.j = {"run", 3};
  constraint.T_i_j = MakePose(Eigen::Quaterniond::Identity(), {4.0, 0.0, 0.0});
  constraint.note = "measured";
  Require(db->posegraph().AddConstraint({}, kMap, constraint));
#endif
  RobotProfile cart;
  cart.radius_m = 0.5;
  RequireOk(db->planning().SetProfile({}, kMap, "cart", cart));
#ifdef OLD_MAP_HAS_CLASSES
  MapClass wall;
  wall.id = 2;
  wall.name = "wall";
  RequireOk(db->maps().SetClass({}, kMap, wall));
#endif
  UploadCorner(*db, 4);
  Settled(*db);
  RequireOk(db->scans().Delete({}, kMap, {"run", 4}));
  Run(*db, "verify");
  const MapStats stats = Settled(*db);
  std::cout << "scans " << stats.scans << ", points " << stats.points << ", patches "
            << stats.patches << ", epoch " << stats.epoch << ", digest " << stats.content_digest
            << std::endl;
}

}  // namespace
}  // namespace strata

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  strata::Make(argv[1]);
  return 0;
}
