// A robot of ROS 2, played by Fast DDS, publishes clouds for minutes; the server is killed
// meanwhile. Is every keyframe in the map as the import of a recording would bring it, and what
// does strata-ros2 need?
//
//   ros2_campaign [--seconds 600] [--hertz 20] [--points 130000] [--kills 2] [--best-effort]
//
// Prints what came of it, and exits 1 where a keyframe is missing, is another than that of the
// recording, or where strata-ros2 held more than 150 MB.
#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <CLI/CLI.hpp>

#include "client/sdk/client.h"
#include "core/common/steady_time.h"
#include "core/geometry/pose.h"
#include "tests/integration/stratad_process.h"
#include "tests/support/bag_writer.h"
#include "tests/support/paths.h"
#include "tests/support/ros2/fast_node.h"
#include "tests/support/ros2/ros_cdr.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/worlds.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

constexpr double kMostMegabytes = 150.0;
constexpr double kEveryM = 0.5;
constexpr double kSpeedMps = 0.5;
constexpr double kHeightM = 1.2;
constexpr int kViews = 200;        // of the yard, along the robot's way
constexpr double kWayM = 20.0;     // there and back
constexpr int kPosesPerCloud = 4;  // none with the stamp of a cloud
constexpr std::int64_t kSecondNs = 1'000'000'000;
constexpr std::int64_t kStartNs = 1'790'000'000 * kSecondNs;
constexpr std::size_t kCloudsPerBag = 50;

struct CampaignOptions {
  int seconds = 600;
  int hertz = 20;
  int points = 130'000;
  int kills = 2;
  bool best_effort = false;
};

// Where the robot is: there and back along x.
Pose PlaceAt(double way_m) {
  const double along = std::fmod(way_m, 2.0 * kWayM);
  const double x = -kWayM / 2.0 + (along < kWayM ? along : 2.0 * kWayM - along);
  return MakePose(Eigen::Quaterniond::Identity(), {x, 0.0, 0.0});
}

// Every cloud is another one: its intensity counts.
class CloudSource {
 public:
  explicit CloudSource(const CampaignOptions& options) : options_(options) {
    const Scene scene = YardScene();
    SensorOptions sensor;
    sensor.rings = 128;
    sensor.columns = 2 * options.points / sensor.rings;
    sensor.elevation_min_rad = -0.6;
    sensor.elevation_max_rad = 0.1;
    for (int view = 0; view < kViews; ++view) {
      Pose T = PlaceAt(view * kWayM / kViews);
      T.translation().z() += kHeightM;
      const PointCloud cloud = SimulateScan(scene, sensor, T, static_cast<std::uint64_t>(view) + 1);
      std::string data;
      for (int i = 0; i < options.points; ++i) {
        const std::size_t from =
            static_cast<std::size_t>(i) * cloud.size() / static_cast<std::size_t>(options.points);
        const Eigen::Vector3f& p = cloud.points[from];
        const std::array<float, 4> point = {p.x(), p.y(), p.z(), 0.0F};
        data.append(reinterpret_cast<const char*>(point.data()), sizeof(point));
      }
      views_.push_back(std::move(data));
    }
  }

  std::int64_t StampOf(std::size_t cloud) const {
    return kStartNs + static_cast<std::int64_t>(cloud) * kSecondNs / options_.hertz;
  }
  double WayAt(std::int64_t stamp_ns) const {
    return kSpeedMps * 1e-9 * static_cast<double>(stamp_ns - kStartNs);
  }
  std::string Cloud(std::size_t number) const {
    const std::int64_t stamp_ns = StampOf(number);
    const double x = PlaceAt(WayAt(stamp_ns)).translation().x();
    const auto view = static_cast<std::size_t>(
        std::clamp(std::lround((x + kWayM / 2.0) * kViews / kWayM), 0L, kViews - 1L));
    std::string data = views_[view];
    for (std::size_t i = 0; i < data.size(); i += 16) {
      const auto intensity = static_cast<float>(number + i / 16);
      std::memcpy(data.data() + i + 12, &intensity, sizeof(intensity));
    }
    return CloudCdr({stamp_ns, "lidar"}, data);
  }
  // Those between this cloud and the next, and the one before the first.
  std::vector<std::pair<std::int64_t, std::string>> Poses(std::size_t cloud) const {
    std::vector<std::pair<std::int64_t, std::string>> poses;
    for (int i = cloud == 0 ? -1 : 0; i < kPosesPerCloud; ++i) {
      const std::int64_t stamp_ns =
          StampOf(cloud) + (2 * i + 1) * kSecondNs / options_.hertz / (2 * kPosesPerCloud);
      poses.emplace_back(stamp_ns,
                         OdometryCdr({stamp_ns, "odom"}, "base_link", PlaceAt(WayAt(stamp_ns))));
    }
    return poses;
  }

 private:
  const CampaignOptions options_;
  std::vector<std::string> views_;
};

std::string Mounting() {
  return TransformCdr(
      {0, "base_link"}, "lidar", MakePose(Eigen::Quaterniond::Identity(), {0.0, 0.0, kHeightM}));
}

// A process's memory [MB]: "VmHWM", "VmRSS".
double MemoryOf(pid_t pid, const std::string& what) {
  std::ifstream status(absl::StrCat("/proc/", pid, "/status"));
  for (std::string line; std::getline(status, line);) {
    if (line.compare(0, what.size(), what) == 0) {
      return std::strtod(line.c_str() + what.size() + 1, nullptr) / 1024.0;
    }
  }
  return 0.0;
}

double CpuSecondsOf(pid_t pid) {
  std::ifstream stat(absl::StrCat("/proc/", pid, "/stat"));
  std::string word;
  double ticks = 0.0;
  for (int i = 1; i <= 15 && stat >> word; ++i) {
    if (i >= 14) ticks += std::strtod(word.c_str(), nullptr);
  }
  return ticks / static_cast<double>(sysconf(_SC_CLK_TCK));
}

// Paths that come for goals, and how long that takes.
class GoalAsker {
 public:
  explicit GoalAsker(FastNode& node)
      : writer_(node.Advertise("/goal_pose", "geometry_msgs/PoseStamped", {})) {
    node.Subscribe("/strata/plan", "nav_msgs/Path", {}, [this](const std::string& cdr) {
      const std::lock_guard lock(mutex_);
      if (!asked_.has_value() || ReadPath(cdr).poses.empty()) return;
      took_ms_.push_back(absl::ToDoubleMilliseconds(SteadyNow() - *asked_));
      asked_.reset();
    });
  }
  void Ask() {
    const std::lock_guard lock(mutex_);
    ++goals_;
    asked_ = SteadyNow();
    writer_.Write(PoseCdr({0, "map"}, MakePose(Eigen::Quaterniond::Identity(), {9.0, -3.0, 0.0})));
  }
  std::string Text() {
    const std::lock_guard lock(mutex_);
    if (took_ms_.empty()) return absl::StrFormat("none of %d", goals_);
    std::sort(took_ms_.begin(), took_ms_.end());
    return absl::StrFormat("%d of %d; median %.0f ms, worst %.0f ms",
                           took_ms_.size(),
                           goals_,
                           took_ms_[took_ms_.size() / 2],
                           took_ms_.back());
  }

 private:
  FastNode::Writer writer_;
  std::mutex mutex_;
  int goals_ = 0;
  std::optional<absl::Time> asked_;
  std::vector<double> took_ms_;
};

struct Kept {
  ScanInfo info;
  PointCloud points;
};

class Campaign {
 public:
  explicit Campaign(const CampaignOptions& options)
      : options_(options), source_(options), node_(domain_.number()) {
    setenv("ROS_LOCALHOST_ONLY", "1", 1);
  }

  int Run() {
    StartServer();
    Strata({"map", "create", "live"});
    Strata({"map", "create", "filed"});
    StartBridge();
    auto clouds = node_.Advertise(
        "/points", "sensor_msgs/PointCloud2", {.reliable = !options_.best_effort, .depth = 100});
    auto poses = node_.Advertise("/odom", "nav_msgs/Odometry", {.depth = 1000});
    auto mounting =
        node_.Advertise("/tf_static", "tf2_msgs/TFMessage", {.transient_local = true, .depth = 1});
    GoalAsker goals(node_);
    mounting.Write(Mounting());
    while (clouds.readers() == 0 || poses.readers() == 0 || mounting.readers() == 0) {
      absl::SleepFor(absl::Milliseconds(20));
    }
    Drive(clouds, poses, goals);
    FindKeyframes();
    AwaitServer();
    const std::string summary = EndBridge();
    const std::size_t wrong = CountWrong();
    std::printf("clouds sent       %zu of %d points at %d Hz, latest %.0f ms late\n",
                sent_,
                options_.points,
                options_.hertz,
                latest_ms_);
    std::printf("server killed     %d times, away %.0f s each\n", options_.kills, kAwayS);
    std::printf("keyframes         %zu expected, %zu missing or other than the recording's\n",
                keyframes_.size(),
                wrong);
    std::printf("paths for goals   %s\n", goals.Text().c_str());
    std::printf("strata-ros2       %.0f MB at most (bound %.0f), %.1f %% of a processor\n",
                memory_mb_,
                kMostMegabytes,
                cpu_percent_);
    std::printf("%s", summary.c_str());
    return wrong == 0 && memory_mb_ <= kMostMegabytes ? 0 : 1;
  }

 private:
  static constexpr double kAwayS = 15.0;
  static constexpr int kAskEveryS = 5;

  std::string Path(const std::string& name) const { return (directory_.path() / name).string(); }

  void StartServer() {
    server_.reset();
    server_ = std::make_unique<StratadProcess>(std::vector<std::string>{
        "--data", Path("maps"), "--listen", address_, "--optimize-every", "0"});
    address_ = server_->Address();
  }
  void StartBridge() {
    bridge_ =
        std::make_unique<ChildProcess>(Ros2Program(),
                                       std::vector<std::string>{"live",
                                                                "--server",
                                                                address_,
                                                                "--spool",
                                                                Path("spool"),
                                                                "--domain",
                                                                absl::StrCat(domain_.number()),
                                                                "--trajectory",
                                                                "robot",
                                                                "--every",
                                                                absl::StrCat(kEveryM, "m")});
  }
  std::string EndBridge() {
    memory_mb_ = MemoryOf(bridge_->pid(), "VmHWM");
    cpu_percent_ = 100.0 * CpuSecondsOf(bridge_->pid()) / options_.seconds;
    bridge_->Signal(SIGTERM);
    std::string text;
    for (std::string line = bridge_->ReadLine(); !line.empty(); line = bridge_->ReadLine()) {
      text += line + "\n";
    }
    bridge_->Wait();
    return text;
  }
  // `strata` with the server, which must take it.
  void Strata(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--server", address_, "--output", "json"});
    ChildProcess strata(StrataProgram(), arguments);
    while (!strata.ReadLine().empty()) continue;
    if (strata.Wait() != 0) throw std::runtime_error("strata " + arguments[0] + " failed");
  }

  void Drive(FastNode::Writer& clouds, FastNode::Writer& poses, GoalAsker& goals) {
    const absl::Time begun = SteadyNow();
    const auto count = static_cast<std::size_t>(options_.seconds) * options_.hertz;
    std::optional<double> kept_m;
    std::optional<absl::Time> back;  // when the server comes back
    int killed = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const absl::Time due = begun + absl::Nanoseconds(source_.StampOf(i) - source_.StampOf(0));
      absl::SleepFor(due - SteadyNow());
      latest_ms_ = std::max(latest_ms_, absl::ToDoubleMilliseconds(SteadyNow() - due));
      const std::string cloud = source_.Cloud(i);
      while (!clouds.Write(cloud)) continue;
      ++sent_;
      for (const auto& [stamp_ns, cdr] : source_.Poses(i)) {
        while (!poses.Write(cdr)) continue;
      }
      if (killed < options_.kills && i == (killed + 1) * count / (options_.kills + 1)) {
        server_->Signal(SIGKILL);
        ++killed;
        back = SteadyNow() + absl::Seconds(kAwayS);
      }
      if (back.has_value() && SteadyNow() > *back) {
        back.reset();
        StartServer();
      }
      const auto second = static_cast<int>(i) / options_.hertz;
      if (static_cast<int>(i) % options_.hertz == 0 && second % kAskEveryS == 0 && second > 20 &&
          !back.has_value()) {
        goals.Ask();
      }
      if (i % (static_cast<std::size_t>(options_.hertz) * 30) == 0) {
        std::fprintf(
            stderr, "%d s: strata-ros2 has %.0f MB\n", second, MemoryOf(bridge_->pid(), "VmRSS"));
      }
    }
    if (back.has_value()) StartServer();
  }

  // Those that an import chooses of all clouds, whose points do not matter here.
  void FindKeyframes() {
    std::vector<BagEntry> entries = {
        {"/tf_static", "tf2_msgs/msg/TFMessage", kStartNs, Mounting()}};
    const std::string point(16, '\x3f');
    for (std::size_t i = 0; i < sent_; ++i) {
      for (const auto& [stamp_ns, cdr] : source_.Poses(i)) {
        entries.push_back({"/odom", "nav_msgs/msg/Odometry", stamp_ns, cdr});
      }
      const std::int64_t stamp_ns = source_.StampOf(i);
      entries.push_back({"/points",
                         "sensor_msgs/msg/PointCloud2",
                         stamp_ns,
                         CloudCdr({stamp_ns, "lidar"}, point)});
    }
    std::ofstream(Path("part.mcap"), std::ios::binary) << McapBytes(entries);
    Strata({"map", "create", "heads"});
    Strata({"scan",
            "import",
            "heads",
            Path("part.mcap"),
            "--every",
            absl::StrCat(kEveryM, "m"),
            "--align",
            "off"});
    const auto listed = Database()->scans().List({}, "heads", {}, [this](const ScanInfo& info) {
      keyframes_.push_back(info.header.id.sequence);  // the number of its cloud
      return absl::OkStatus();
    });
    if (!listed.ok()) throw std::runtime_error(std::string(listed.message()));
    std::sort(keyframes_.begin(), keyframes_.end());
  }

  std::map<std::int64_t, Kept> ScansOf(api::Database& database,
                                       const std::string& map,
                                       std::int64_t from_ns,
                                       std::int64_t until_ns) const {
    std::map<std::int64_t, Kept> scans;
    api::ScanFilter filter;
    filter.from = absl::FromUnixNanos(from_ns);
    filter.until = absl::FromUnixNanos(until_ns);
    const absl::Status listed = database.scans().List({}, map, filter, [&](const ScanInfo& info) {
      Kept& kept = scans[absl::ToUnixNanos(info.header.time)];
      kept.info = info;
      return database.scans().GetPoints({}, map, info.header.id, [&kept](const PointCloud& piece) {
        kept.points.points.insert(
            kept.points.points.end(), piece.points.begin(), piece.points.end());
        kept.points.intensity.insert(
            kept.points.intensity.end(), piece.intensity.begin(), piece.intensity.end());
        return absl::OkStatus();
      });
    });
    if (!listed.ok()) throw std::runtime_error(std::string(listed.message()));
    return scans;
  }

  std::unique_ptr<api::Database> Database() const {
    ClientOptions client;
    client.target = address_;
    auto database = Connect(client);
    if (!database.ok()) throw std::runtime_error(std::string(database.status().message()));
    return *std::move(database);
  }

  // Until all keyframes have come, or none comes any more.
  void AwaitServer() const {
    const auto database = Database();
    std::uint64_t scans = 0;
    absl::Time moved = SteadyNow();
    while (scans < keyframes_.size() && SteadyNow() - moved < absl::Seconds(30)) {
      const auto stats = database->maps().Stats({}, "live");
      if (stats.ok() && stats->scans != scans) {
        scans = stats->scans;
        moved = SteadyNow();
      }
      absl::SleepFor(absl::Milliseconds(200));
    }
    absl::SleepFor(absl::Seconds(1));  // the acknowledgement of the last
  }

  // Keyframes that the map has not, or otherwise than the import of a recording brings them.
  std::size_t CountWrong() const {
    const auto database = Database();
    std::size_t wrong = 0;
    for (std::size_t first = 0; first < keyframes_.size(); first += kCloudsPerBag) {
      const std::size_t last = std::min(first + kCloudsPerBag, keyframes_.size()) - 1;
      WriteBag(first, last);
      Strata({"scan",
              "import",
              "filed",
              Path("part.mcap"),
              "--every",
              "0m",
              "--align",
              "off",
              "--trajectory",
              absl::StrCat("part", first)});
      const std::int64_t from_ns = source_.StampOf(keyframes_[first]);
      const std::int64_t until_ns = source_.StampOf(keyframes_[last]) + 1000;
      const auto live = ScansOf(*database, "live", from_ns, until_ns);
      const auto filed = ScansOf(*database, "filed", from_ns, until_ns);
      if (live.size() > filed.size()) wrong += live.size() - filed.size();
      wrong += last - first + 1 - filed.size();
      for (const auto& [time, expected] : filed) {
        const auto found = live.find(time);
        const bool same = found != live.end() &&
                          found->second.info.header.T_map_scan.matrix() ==
                              expected.info.header.T_map_scan.matrix() &&
                          found->second.points.points == expected.points.points &&
                          found->second.points.intensity == expected.points.intensity;
        if (!same) ++wrong;
      }
    }
    return wrong;
  }

  void WriteBag(std::size_t first, std::size_t last) const {
    std::vector<BagEntry> entries = {
        {"/tf_static", "tf2_msgs/msg/TFMessage", kStartNs, Mounting()}};
    const std::size_t begin = std::max<std::size_t>(keyframes_[first], 1) - 1;
    for (std::size_t i = begin; i <= keyframes_[last]; ++i) {
      for (const auto& [stamp_ns, cdr] : source_.Poses(i)) {
        entries.push_back({"/odom", "nav_msgs/msg/Odometry", stamp_ns, cdr});
      }
      if (std::binary_search(keyframes_.begin() + first, keyframes_.begin() + last + 1, i)) {
        entries.push_back(
            {"/points", "sensor_msgs/msg/PointCloud2", source_.StampOf(i), source_.Cloud(i)});
      }
    }
    std::ofstream(Path("part.mcap"), std::ios::binary) << McapBytes(entries);
  }

  const CampaignOptions options_;
  const TempDir directory_;
  const TestDomain domain_;
  const CloudSource source_;
  FastNode node_;
  std::string address_ = "127.0.0.1:0";
  std::unique_ptr<StratadProcess> server_;
  std::unique_ptr<ChildProcess> bridge_;
  std::vector<std::size_t> keyframes_;  // clouds
  std::size_t sent_ = 0;
  double latest_ms_ = 0.0, memory_mb_ = 0.0, cpu_percent_ = 0.0;
};

}  // namespace
}  // namespace strata::testing

int main(int argc, char** argv) {
  strata::testing::CampaignOptions options;
  CLI::App app("A robot of ROS 2 for minutes");
  app.add_option("--seconds", options.seconds)->capture_default_str();
  app.add_option("--hertz", options.hertz)->capture_default_str();
  app.add_option("--points", options.points)->capture_default_str();
  app.add_option("--kills", options.kills)->capture_default_str();
  app.add_flag("--best-effort", options.best_effort, "Clouds as most drivers send them");
  CLI11_PARSE(app, argc, argv);
  try {
    return strata::testing::Campaign(options).Run();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 2;
  }
}
