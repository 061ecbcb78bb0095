// Tiles a second through a server, beside a bare gRPC service that answers with equal messages from
// memory; and what Fetch sends after one tile in a hundred has changed.
//
//   tile_read_benchmark [SECONDS [REPEATS [smoke]]]
//
// Server, bare service (gRPC's callback API, no work, no log) and clients share this process and
// its processors; each client is a thread with a connection of its own that asks for the next tile
// when it has the one before. Exits 1 beyond a bound. Nothing else may run on the machine.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include <glog/logging.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/server_builder.h>

#include "core/engine/engine.h"
#include "server/server.h"
#include "strata/v1/tiles.grpc.pb.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

constexpr double kRateBound = 0.8;
constexpr double kFetchBound = 0.03;
constexpr char kMap[] = "world";
constexpr double kTileM = 25.6;
using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point begun) {
  return std::chrono::duration<double>(Clock::now() - begun).count();
}

void Require(bool good, const std::string& what) {
  if (good) return;
  std::fprintf(stderr, "tile_read_benchmark: %s\n", what.c_str());
  std::exit(1);
}

// Answers Get from memory, on gRPC's own threads.
class BareTiles final : public v1::Tiles::CallbackService {
 public:
  explicit BareTiles(std::map<std::string, v1::GetTileResponse> tiles) : tiles_(std::move(tiles)) {}

  grpc::ServerUnaryReactor* Get(grpc::CallbackServerContext* context,
                                const v1::GetTileRequest* in,
                                v1::GetTileResponse* out) override {
    *out = tiles_.at(in->key().SerializeAsString());
    grpc::ServerUnaryReactor* const reactor = context->DefaultReactor();
    reactor->Finish(grpc::Status::OK);
    return reactor;
  }

 private:
  std::map<std::string, v1::GetTileResponse> tiles_;
};

std::unique_ptr<v1::Tiles::Stub> NewStub(const std::string& address) {
  grpc::ChannelArguments own;
  own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL,
             1);  // else clients of a process share one connection
  return v1::Tiles::NewStub(
      grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), own));
}

// The ground of one tile, rough as ground is, seen from 2 m above its middle.
void UploadTile(api::Database& db, int x, int y, std::uint64_t sequence) {
  ScanHeader header;
  header.id = {absl::StrCat("tile_", x, "_", y), sequence};
  header.T_map_scan.translation() << (x + 0.5) * kTileM, (y + 0.5) * kTileM, 2.0;
  header.alignment = Alignment::kOff;
  PointCloud cloud;
  constexpr int kAcross = 180;
  for (int i = 0; i < kAcross; ++i) {
    for (int k = 0; k < kAcross; ++k) {
      const double u = (i + 0.5) / kAcross - 0.5;
      const double v = (k + 0.5) / kAcross - 0.5;
      const double z = 0.3 * std::sin(9.0 * u + x) * std::cos(7.0 * v + y) +
                       0.03 * std::sin(997.0 * (i + 3.7 * k));
      cloud.points.emplace_back(static_cast<float>(u * 0.99 * kTileM),
                                static_cast<float>(v * 0.99 * kTileM),
                                static_cast<float>(z - 2.0));
    }
  }
  header.point_count = cloud.size();
  const auto upload = db.scans().Upload({}, kMap, header);
  Require(upload.ok() && (*upload)->Write(cloud).ok() && (*upload)->Finish().ok(), "upload");
}

void AwaitIntegration(api::Database& db) {
  while (true) {
    const auto stats = db.maps().Stats({}, kMap);
    Require(stats.ok() && stats->scans_failed == 0, "a scan is not integrated");
    if (stats->scans_pending == 0) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

// A map at rest prepares its tiles for plans, some ten seconds of work that is another measurement.
void AwaitPreparation(api::Database& db, std::uint64_t tiles) {
  while (true) {
    const auto stats = db.maps().Stats({}, kMap);
    Require(stats.ok(), "no stats");
    if (stats->tiles_prepared >= tiles) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
}

struct Fetched {
  std::map<std::string, v1::EncodedTile> tiles;  // by serialised key
  std::uint64_t bytes = 0;                       // of all messages
};

// What is not in `held`.
Fetched Fetch(const std::string& address, const Fetched& held) {
  v1::FetchTilesRequest in;
  in.set_map(kMap);
  for (const auto& [_, tile] : held.tiles) {
    v1::HeldTile& holds = *in.add_held();
    *holds.mutable_key() = tile.key();
    holds.set_version(tile.version());
  }
  grpc::ClientContext context;
  const auto reader = NewStub(address)->Fetch(&context, in);
  Fetched fetched;
  for (v1::FetchTilesResponse answer; reader->Read(&answer);) {
    fetched.bytes += answer.ByteSizeLong();
    fetched.tiles[answer.tile().key().SerializeAsString()] = answer.tile();
  }
  Require(reader->Finish().ok(), "fetch");
  return fetched;
}

// Answers a second that `clients` get in `seconds`.
double Rate(const std::string& address, const Fetched& tiles, int clients, double seconds) {
  std::vector<v1::GetTileRequest> requests;
  for (const auto& [_, tile] : tiles.tiles) {
    requests.emplace_back().set_map(kMap);
    *requests.back().mutable_key() = tile.key();
  }
  std::atomic<bool> over = false;
  std::atomic<std::uint64_t> answers = 0;
  std::vector<std::thread> threads;
  const Clock::time_point begun = Clock::now();
  for (int client = 0; client < clients; ++client) {
    threads.emplace_back([&, client] {
      const auto stub = NewStub(address);
      v1::GetTileResponse out;
      std::uint64_t mine = 0;
      for (auto i = static_cast<std::size_t>(client) * 7; !over; ++i, ++mine) {
        grpc::ClientContext context;
        const grpc::Status status = stub->Get(&context, requests[i % requests.size()], &out);
        Require(status.ok(), status.error_message());
      }
      answers += mine;
    });
  }
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  over = true;
  const double took = SecondsSince(begun);
  for (std::thread& thread : threads) thread.join();
  return static_cast<double>(answers) / took;
}

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

bool MeasureGets(const std::string& address, const Fetched& tiles, double seconds, int repeats) {
  std::map<std::string, v1::GetTileResponse> answers;
  for (const auto& [key, tile] : tiles.tiles) *answers[key].mutable_tile() = tile;
  BareTiles service(std::move(answers));
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&service);
  const auto bare = builder.BuildAndStart();
  const std::string bare_address = absl::StrCat("127.0.0.1:", port);
  std::printf("clients  Get/s    bare/s   ratio\n");
  bool reached = true;
  for (const int clients : {1, 4, 16}) {
    std::vector<double> rates, bare_rates, ratios;
    for (int i = 0; i < repeats; ++i) {
      bare_rates.push_back(Rate(bare_address, tiles, clients, seconds));
      rates.push_back(Rate(address, tiles, clients, seconds));
      ratios.push_back(rates.back() / bare_rates.back());
    }
    std::printf(
        "%7d %7.0f %8.0f   %5.2f\n", clients, Median(rates), Median(bare_rates), Median(ratios));
    std::fflush(stdout);
    reached = reached && Median(ratios) >= kRateBound;
  }
  bare->Shutdown();
  return reached;
}

bool MeasureFetch(api::Database& db, const std::string& address, const Fetched& all, int across) {
  // A hundredth of the tiles, each within its own square: seen again.
  const int changed = across * across / 100;
  for (int i = 0; i < changed; ++i) UploadTile(db, 5 * i % across, i, 2);
  AwaitIntegration(db);
  const Fetched news = Fetch(address, all);
  const double share = static_cast<double>(news.bytes) / static_cast<double>(all.bytes);
  std::printf("%d of %zu tiles seen again: Fetch sends %zu tiles, %llu of %llu bytes (%.4f)\n",
              changed,
              all.tiles.size(),
              news.tiles.size(),
              static_cast<unsigned long long>(news.bytes),
              static_cast<unsigned long long>(all.bytes),
              share);
  return share <= kFetchBound;
}

int Main(int argc, char** argv) {
  const double seconds = argc > 1 ? std::atof(argv[1]) : 3.0;
  const int repeats = argc > 2 ? std::atoi(argv[2]) : 5;
  const bool smoke = argc > 3;         // time is held against nothing
  const int across = smoke ? 10 : 20;  // tiles of a square
  FLAGS_minloglevel = google::GLOG_WARNING;
  google::InitGoogleLogging(argv[0]);
  const testing::TempDir folder;
  EngineOptions options;
  options.directory = folder.path();
  const auto db = OpenEngine(options);
  Require(db.ok() && (*db)->maps().Create({}, kMap, {}).ok(), "no map");
  for (int y = 0; y < across; ++y) {
    for (int x = 0; x < across; ++x) UploadTile(**db, x, y, 1);
  }
  AwaitIntegration(**db);
  if (!smoke) AwaitPreparation(**db, static_cast<std::uint64_t>(across) * across);
  server::ServerOptions server_options;
  server_options.listen = "127.0.0.1:0";
  const auto server = server::Server::Start(**db, server_options);
  Require(server.ok(), server.status().ToString());
  const Fetched all = Fetch((*server)->address(), {});
  std::printf("%zu tiles of %.1f kB\n",
              all.tiles.size(),
              static_cast<double>(all.bytes) / 1e3 / static_cast<double>(all.tiles.size()));
  const bool fast = MeasureGets((*server)->address(), all, seconds, repeats);
  const bool small = MeasureFetch(**db, (*server)->address(), all, across);
  return (fast || smoke) && small ? 0 : 1;
}

}  // namespace
}  // namespace strata

int main(int argc, char** argv) { return strata::Main(argc, argv); }
