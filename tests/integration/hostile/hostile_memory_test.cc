// What a server's memory is while hostile clients send what they may, and afterwards: that of one
// client who may do everything stays below 200 MB, that of those whom nobody knows below 100 MB.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <fstream>
#include <functional>
#include <iostream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include "core/codec/blob.h"
#include "core/codec/bytes.h"
#include "core/codec/columns.h"
#include "core/codec/mls_tile_codec.h"
#include "core/codec/occupancy.h"
#include "core/codec/tile_header.h"
#include "strata/v1/classifiers.grpc.pb.h"
#include "strata/v1/maps.grpc.pb.h"
#include "strata/v1/planning.grpc.pb.h"
#include "strata/v1/posegraph.grpc.pb.h"
#include "strata/v1/scans.grpc.pb.h"
#include "strata/v1/tiles.grpc.pb.h"
#include "tests/integration/stratad_process.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

constexpr char kMap[] = "world";
constexpr double kClientMegabytes = 200.0;
constexpr double kStrangersMegabytes = 100.0;
constexpr int kCalls = 40;
constexpr int kStrangersCalls = 200;

// A tile of a few hundred bytes that announces millions of patches and votes.
std::string BombTile() {
  constexpr int kColumns = 24;
  std::string codes(kTileCells * kTileCells / 4, '\0');
  codes[0] = 3;
  std::string rest;
  PutVarint(rest, kMaxTilePatches - 3);
  std::string body;
  PutTileHeader(body, TileKey{});
  PutColumn(body, codes);
  PutColumn(body, rest);
  PutFixed(body, std::uint8_t{1});
  PutVarint(body, kMaxTileVotes);
  for (int i = 0; i < kColumns; ++i) PutColumn(body, std::string(kMaxTileVotes, '\0'));
  PutVarint(body, 0);
  return SealBlob(BlobKind::kMlsTile, kMlsTileVersion, body);
}

class HostileMemoryTest : public ::testing::Test {
 protected:
  void SetUp() override { token_ = StratadProcess(NewToken()).ReadLine(); }
  void Serve() {
    stratad_ = std::make_unique<StratadProcess>(std::vector<std::string>{
        "--data", Path("maps"), "--listen", "127.0.0.1:0", "--tokens", Path("tokens.json")});
    const std::string address = stratad_->Address();
    ASSERT_TRUE(absl::SimpleAtoi(address.substr(address.rfind(':') + 1), &port_));
    for (int i = 0; i < 4; ++i) {
      grpc::ChannelArguments own;  // or all channels to one address share a connection
      own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
      own.SetMaxReceiveMessageSize(-1);
      own.SetMaxSendMessageSize(-1);
      channels_.push_back(
          grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), own));
    }
    v1::CreateMapRequest in;
    in.set_name(kMap);
    v1::CreateMapResponse out;
    const auto context = Context();
    const grpc::Status made = v1::Maps::NewStub(channels_[0])->Create(context.get(), in, &out);
    ASSERT_TRUE(made.ok()) << made.error_message();
    before_ = Megabytes("VmRSS:");
  }
  // After the attack, with all its calls ended.
  void ExpectBounded(double bound) {
    std::cout << "resident before " << before_ << " MB, at most " << Megabytes("VmHWM:")
              << " MB, after " << Megabytes("VmRSS:") << " MB" << std::endl;
    EXPECT_LE(Megabytes("VmHWM:") - before_, bound);
    // The server gives back what is free every ten seconds.
    for (int i = 0; i < 300 && Megabytes("VmRSS:") - before_ > bound / 4; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    EXPECT_LE(Megabytes("VmRSS:") - before_, bound / 4);
    stratad_->Signal(SIGTERM);
    EXPECT_EQ(stratad_->Wait(), 0);
  }

  std::unique_ptr<grpc::ClientContext> Context(bool known = true) const {
    auto context = std::make_unique<grpc::ClientContext>();
    context->set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
    if (known) context->AddMetadata("authorization", "Bearer " + token_);
    return context;
  }
  const std::shared_ptr<grpc::Channel>& Channel(int i) const { return channels_[i % 4]; }
  const std::string& token() const { return token_; }
  int port() const { return port_; }
  // Makes `call` so often, all at a time.
  static void AtOnce(int times, const std::function<void(int)>& call) {
    std::vector<std::thread> threads;
    for (int i = 0; i < times; ++i) threads.emplace_back([&call, i] { call(i); });
    for (std::thread& thread : threads) thread.join();
  }
  void SayAtOnce(const std::string& path, const std::string& bytes, bool known) {
    AtOnce(known ? kCalls : kStrangersCalls, [&](int i) {
      grpc::GenericStub stub(Channel(i));
      const auto context = Context(known);
      grpc::CompletionQueue queue;
      const grpc::Slice slice(bytes);
      const grpc::ByteBuffer request(&slice, 1);
      const auto call = stub.PrepareUnaryCall(context.get(), path, request, &queue);
      call->StartCall();
      grpc::ByteBuffer answer;
      grpc::Status status;
      call->Finish(&answer, &status, nullptr);
      void* tag = nullptr;
      bool ok = false;
      queue.Next(&tag, &ok);
    });
  }

 private:
  std::string Path(const std::string& name) const { return (directory_.path() / name).string(); }
  std::vector<std::string> NewToken() const {
    return {"token",
            "add",
            "mallory",
            "--tokens",
            Path("tokens.json"),
            "--right",
            "admin",
            "--all-maps"};
  }
  double Megabytes(const std::string& what) const {
    std::ifstream status(absl::StrCat("/proc/", stratad_->pid(), "/status"));
    std::string word;
    double kilobytes = 0.0;
    while (status >> word && word != what) {
    }
    status >> kilobytes;
    return kilobytes / 1024.0;
  }

  const TempDir directory_;
  std::string token_;
  std::unique_ptr<StratadProcess> stratad_;
  std::vector<std::shared_ptr<grpc::Channel>> channels_;
  double before_ = 0.0;
  int port_ = 0;
};

// HTTP/2 by hand (RFC 9113, RFC 7541).
std::string Frame(char kind, char flags, std::uint32_t stream, const std::string& payload) {
  std::string frame;
  for (const int shift : {16, 8, 0}) frame += static_cast<char>(payload.size() >> shift);
  frame += {kind, flags};
  for (const int shift : {24, 16, 8, 0}) frame += static_cast<char>(stream >> shift);
  return frame + payload;
}
std::string Header(const std::string& name, const std::string& value) {
  return absl::StrCat(std::string(1, '\x10'),
                      std::string(1, static_cast<char>(name.size())),
                      name,
                      std::string(1, static_cast<char>(value.size())),
                      value);
}

// Begins calls and resets them at once, as fast as the wire is, on one connection after another.
void BeginAndReset(int port, const std::string& path, const std::string& token) {
  constexpr auto kTime = std::chrono::seconds(6);
  constexpr int kTogether = 64;
  const std::string headers = absl::StrCat(Header(":method", "POST"),
                                           Header(":scheme", "http"),
                                           Header(":path", path),
                                           Header(":authority", "x"),
                                           Header("te", "trailers"),
                                           Header("content-type", "application/grpc"),
                                           Header("authorization", "Bearer " + token));
  const auto until = std::chrono::steady_clock::now() + kTime;
  while (std::chrono::steady_clock::now() < until) {
    const int peer = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in server = {};
    server.sin_family = AF_INET;
    server.sin_port = htons(static_cast<std::uint16_t>(port));
    server.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const timeval patience = {.tv_sec = 1, .tv_usec = 0};
    ::setsockopt(peer, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof(patience));
    ::connect(peer, reinterpret_cast<const sockaddr*>(&server), sizeof(server));
    std::string wire = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + Frame(4, 0, 0, "");
    std::uint32_t stream = 1;
    while (std::chrono::steady_clock::now() < until) {
      for (int i = 0; i < kTogether; ++i, stream += 2) {
        wire += Frame(1, 4, stream, headers) + Frame(3, 0, stream, std::string("\0\0\0\x08", 4));
      }
      if (::send(peer, wire.data(), wire.size(), MSG_NOSIGNAL) < 0) break;
      wire.clear();
      std::string told(1 << 16, '\0');
      while (::recv(peer, told.data(), told.size(), MSG_DONTWAIT) > 0) {
      }
    }
    ::close(peer);
  }
}

// Two bytes an item.
std::string EmptyItems(char tag, std::size_t bytes) {
  std::string items;
  while (items.size() < bytes) items += {tag, '\0'};
  return items;
}

TEST_F(HostileMemoryTest, StrangersWhoSendMillionsOfItems) {
  Serve();
  SayAtOnce("/strata.v1.Tiles/Fetch", EmptyItems('\x1A', 4'000'000), false);
  SayAtOnce("/strata.v1.Planning/SampleSurfaces", EmptyItems('\x12', 4'000'000), false);
  ExpectBounded(kStrangersMegabytes);
}

// What no service of the contract is asked about.
TEST_F(HostileMemoryTest, StrangersWhoAskForTheirHealth) {
  Serve();
  SayAtOnce("/grpc.health.v1.Health/Check", EmptyItems('\x1A', 4'000'000), false);
  SayAtOnce("/grpc.health.v1.Health/Watch", EmptyItems('\x1A', 4'000'000), false);
  SayAtOnce("/nobody.Knows/This", EmptyItems('\x1A', 4'000'000), false);
  ExpectBounded(kStrangersMegabytes);
}

TEST_F(HostileMemoryTest, AClientWhoSendsMillionsOfItems) {
  Serve();
  SayAtOnce("/strata.v1.Tiles/Fetch", EmptyItems('\x1A', 4'000'000), true);
  // As many as the contract allows.
  SayAtOnce("/strata.v1.Tiles/Fetch", EmptyItems('\x1A', 2 * 262'000), true);
  SayAtOnce("/strata.v1.Maps/Get", EmptyItems('\x7A', 4'000'000), true);
  ExpectBounded(kClientMegabytes);
}

TEST_F(HostileMemoryTest, AClientWhoResetsCallsAsFastAsTheyBegin) {
  Serve();
  AtOnce(8, [&](int /*i*/) { BeginAndReset(port(), "/strata.v1.Maps/List", token()); });
  ExpectBounded(kClientMegabytes);
}

TEST_F(HostileMemoryTest, AClientWhoResetsWatchesAsFastAsTheyBegin) {
  Serve();
  AtOnce(8, [&](int /*i*/) { BeginAndReset(port(), "/strata.v1.Maps/Watch", token()); });
  ExpectBounded(kClientMegabytes);
}

TEST_F(HostileMemoryTest, StrangersWhoResetCallsAsFastAsTheyBegin) {
  Serve();
  AtOnce(8, [&](int /*i*/) { BeginAndReset(port(), "/strata.v1.Maps/List", "none"); });
  ExpectBounded(kStrangersMegabytes);
}

TEST_F(HostileMemoryTest, StrangersWhoAskForTheirHealthAndReset) {
  Serve();
  AtOnce(8, [&](int /*i*/) { BeginAndReset(port(), "/grpc.health.v1.Health/Check", "none"); });
  ExpectBounded(kStrangersMegabytes);
}

TEST_F(HostileMemoryTest, AClientWhoWatchesManyLongPaths) {
  Serve();
  v1::WatchPathRequest in;
  in.set_map(kMap);
  for (int i = 0; i < 10'000; ++i) in.add_waypoints()->set_x(i % 2 == 0 ? -1.0 : 1.0);
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReader<v1::WatchPathResponse>>> watches;
  std::vector<std::unique_ptr<v1::Planning::Stub>> stubs;
  for (int i = 0; i < 4; ++i) stubs.push_back(v1::Planning::NewStub(Channel(i)));
  for (int i = 0; i < 500; ++i) {
    contexts.push_back(Context());
    watches.push_back(stubs[static_cast<std::size_t>(i) % 4]->WatchPath(contexts.back().get(), in));
  }
  v1::WatchPathResponse out;
  for (const auto& watch : watches) watch->Read(&out);
  for (std::size_t i = 0; i < watches.size(); ++i) {
    contexts[i]->TryCancel();
    watches[i]->Finish();
  }
  ExpectBounded(kClientMegabytes);
}

TEST_F(HostileMemoryTest, AClientWhoseLocalMapsExplode) {
  Serve();
  v1::UploadLocalMapRequest start;
  start.mutable_start()->set_map(kMap);
  start.mutable_start()->set_cell_size_m(0.1);
  start.mutable_start()->set_gap_size_m(1.0);
  start.mutable_start()->set_thickness_m(0.1);
  const std::string tile = BombTile();
  std::string bytes;
  PutFixed(bytes, static_cast<std::uint32_t>(tile.size()));
  v1::UploadLocalMapRequest local_map;
  local_map.set_local_map(bytes + tile);
  AtOnce(kCalls, [&](int i) {
    v1::UploadLocalMapRequest own = start;
    own.mutable_start()->mutable_header()->mutable_id()->set_trajectory(absl::StrCat("run", i));
    const auto context = Context();
    v1::UploadLocalMapResponse out;
    const auto stub = v1::Scans::NewStub(Channel(i));
    const auto stream = stub->UploadLocalMap(context.get(), &out);
    stream->Write(own);
    stream->Write(local_map);
    stream->WritesDone();
    const grpc::Status status = stream->Finish();
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << status.error_message();
  });
  ExpectBounded(kClientMegabytes);
}

TEST_F(HostileMemoryTest, AClientWhoseStreamsKeepMuch) {
  Serve();
  AtOnce(kCalls, [&](int i) {
    const auto context = Context();
    v1::ImportClassifierResponse out;
    const auto stub = v1::Classifiers::NewStub(Channel(i));
    const auto stream = stub->Import(context.get(), &out);
    v1::ImportClassifierRequest message;
    message.mutable_start()->set_map(kMap);
    message.mutable_start()->set_name(absl::StrCat("c", i));
    bool open = stream->Write(message);
    message.set_bytes(std::string(1 << 20, 'x'));
    for (int k = 0; k < 60 && open; ++k) open = stream->Write(message);
    context->TryCancel();
    stream->Finish();
  });
  AtOnce(kCalls, [&](int i) {
    const auto context = Context();
    v1::LocalizeResponse out;
    const auto stub = v1::PoseGraph::NewStub(Channel(i));
    const auto stream = stub->Localize(context.get(), &out);
    v1::LocalizeRequest message;
    message.mutable_start()->set_map(kMap);
    message.mutable_start()->set_point_count(2'000'000);
    bool open = stream->Write(message);
    message.mutable_chunk()->set_xyz(std::string(480'000, '\0'));
    for (int k = 0; k < 49 && open; ++k) open = stream->Write(message);
    context->TryCancel();
    stream->Finish();
  });
  ExpectBounded(kClientMegabytes);
}

}  // namespace
}  // namespace strata::testing
