// A sample of tests/experiments/hostile_clients.py: what hostile clients send, and the server that
// is as it was afterwards.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iostream>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "client/sdk/client.h"
#include "core/common/host_port.h"
#include "strata/v1/maps.grpc.pb.h"
#include "strata/v1/scans.grpc.pb.h"
#include "tests/integration/stratad_process.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

using ::testing::AnyOf;

constexpr char kMap[] = "world";
constexpr char kPreface[] = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
constexpr std::uint32_t kSeed = 1;

// A connection that says whatever it likes.
class Peer {
 public:
  explicit Peer(std::uint16_t port) : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0;
  }
  ~Peer() {
    if (socket_ >= 0) close(socket_);
  }
  Peer(Peer&& other) noexcept
      : socket_(std::exchange(other.socket_, -1)), connected_(other.connected_) {}
  Peer& operator=(Peer&&) = delete;

  bool connected() const { return connected_; }
  void Say(const std::string& bytes) const {
    send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }

 private:
  int socket_;
  bool connected_ = false;
};

class HostileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    STRATA_ASSERT_OK_AND_ASSIGN(const HostPort address, ParseHostPort(stratad_.Address()));
    port_ = static_cast<std::uint16_t>(address.port);
    channel_ = grpc::CreateChannel(stratad_.Address(), grpc::InsecureChannelCredentials());
    scans_ = v1::Scans::NewStub(channel_);
    ClientOptions options;
    options.target = stratad_.Address();
    STRATA_ASSERT_OK_AND_ASSIGN(db_, Connect(options));
    STRATA_ASSERT_OK(db_->maps().Create({}, kMap, {}));
  }

  // The server answers, a good client's scan goes in, and memory is what a server takes.
  void TearDown() override {
    ScanHeader header;
    header.id = {"good", 1};
    header.point_count = 3;
    PointCloud cloud;
    cloud.points = {{1.0F, 0.0F, 0.0F}, {2.0F, 0.0F, 0.0F}, {3.0F, 0.0F, 0.0F}};
    STRATA_ASSERT_OK_AND_ASSIGN(const auto upload, db_->scans().Upload({}, kMap, header));
    STRATA_ASSERT_OK(upload->Write(cloud));
    STRATA_ASSERT_OK(upload->Finish());
    STRATA_ASSERT_OK_AND_ASSIGN(const MapStats stats, db_->maps().Stats({}, kMap));
    EXPECT_EQ(stats.scans, 1U);
    EXPECT_EQ(Health(), std::string("\x08\x01"));  // SERVING
    EXPECT_LT(PeakMegabytes(), 256.0);
    db_.reset();
    stratad_.Signal(SIGTERM);
    EXPECT_EQ(stratad_.Wait(), 0);
  }

  // What the upload of these messages is answered.
  grpc::Status Upload(const std::vector<v1::UploadScanRequest>& messages) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(20));
    v1::UploadScanResponse answer;
    const auto stream = scans_->Upload(&context, &answer);
    for (const v1::UploadScanRequest& message : messages) {
      if (!stream->Write(message)) break;
    }
    stream->WritesDone();
    return stream->Finish();
  }
  static v1::UploadScanRequest Start(std::uint64_t points) {
    v1::UploadScanRequest message;
    message.mutable_start()->set_map(kMap);
    v1::ScanHeader& header = *message.mutable_start()->mutable_header();
    header.mutable_id()->set_trajectory("bad");
    header.mutable_id()->set_sequence(1);
    header.set_point_count(points);
    return message;
  }
  static v1::UploadScanRequest Chunk(const std::vector<float>& numbers) {
    v1::UploadScanRequest message;
    std::string bytes(numbers.size() * sizeof(float), '\0');
    std::memcpy(bytes.data(), numbers.data(), bytes.size());
    message.mutable_chunk()->set_xyz(bytes);
    return message;
  }

  std::uint16_t port() const { return port_; }
  const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }
  v1::Scans::Stub& scans() { return *scans_; }

 private:
  // The serialized answer of grpc.health.v1.
  std::string Health() {
    grpc::GenericStub stub(channel_);
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(20));
    grpc::CompletionQueue queue;
    const grpc::Slice empty;
    const grpc::ByteBuffer nothing(&empty, 1);
    const auto call =
        stub.PrepareUnaryCall(&context, "/grpc.health.v1.Health/Check", nothing, &queue);
    call->StartCall();
    grpc::ByteBuffer answer;
    grpc::Status status;
    call->Finish(&answer, &status, this);
    void* tag = nullptr;
    bool ok = false;
    queue.Next(&tag, &ok);
    EXPECT_TRUE(status.ok()) << status.error_message();
    std::vector<grpc::Slice> slices;
    answer.Dump(&slices).ok();
    std::string bytes;
    for (const grpc::Slice& slice : slices) bytes.append(slice.begin(), slice.end());
    return bytes;
  }
  double PeakMegabytes() const {
    std::ifstream status(absl::StrCat("/proc/", stratad_.pid(), "/status"));
    std::string word;
    double kilobytes = 0.0;
    while (status >> word && word != "VmHWM:") {
    }
    status >> kilobytes;
    return kilobytes / 1024.0;
  }

  const TempDir directory_;
  StratadProcess stratad_{
      {"--data", directory_.path().string(), "--listen", "127.0.0.1:0", "--upload-idle", "1"}};
  std::uint16_t port_ = 0;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::Scans::Stub> scans_;
  std::unique_ptr<api::Database> db_;
};

TEST_F(HostileTest, GarbageAndStrangersProtocols) {
  std::cout << "seed " << kSeed << std::endl;
  std::mt19937 random(kSeed);
  for (int i = 0; i < 100; ++i) {
    const Peer peer(port());
    if (i % 2 == 0) peer.Say(kPreface);
    std::string bytes(1 + random() % 4000, '\0');
    std::generate(bytes.begin(), bytes.end(), [&] { return static_cast<char>(random()); });
    peer.Say(i % 10 == 1 ? "GET / HTTP/1.1\r\nHost: x\r\n\r\n" : bytes);
  }
}

TEST_F(HostileTest, HundredsOfConnectionsThatSayLittle) {
  std::vector<Peer> peers;
  for (int i = 0; i < 500; ++i) {
    peers.emplace_back(port());
    ASSERT_TRUE(peers.back().connected()) << i;
    if (i % 2 == 0) peers.back().Say(kPreface);
  }
}

TEST_F(HostileTest, ScansThatAreNotWhatTheyClaim) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const auto code = [this](const std::vector<v1::UploadScanRequest>& messages) {
    return Upload(messages).error_code();
  };
  for (const std::uint64_t points : {std::uint64_t{1'000'000'000}, UINT64_MAX}) {
    const grpc::Status status = Upload({Start(points), Chunk({1, 0, 0})});
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_EQ(status.error_details().find("retry_delay_ms"), std::string::npos);
  }
  EXPECT_EQ(code({Start(90'000'000), Chunk({1, 0, 0})}), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(code({Chunk({1, 0, 0}), Start(1)}), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(code({Start(2), Start(2)}), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(code({Start(1), Chunk({1, 0, 0}), Chunk({1, 0, 0})}),
            grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(code({}), grpc::StatusCode::INVALID_ARGUMENT);
  for (const float number : {kNan, std::numeric_limits<float>::infinity(), 1e30F}) {
    EXPECT_EQ(code({Start(1), Chunk({number, 0, 0})}), grpc::StatusCode::INVALID_ARGUMENT);
  }
  v1::UploadScanRequest wrong = Start(1);
  wrong.mutable_start()->mutable_header()->set_content_hash(std::string(32, '0'));
  EXPECT_EQ(code({wrong, Chunk({1, 0, 0})}), grpc::StatusCode::INVALID_ARGUMENT);
  v1::UploadScanRequest far = Start(1);
  far.mutable_start()->mutable_header()->mutable_pose()->mutable_translation()->set_x(1e300);
  EXPECT_EQ(code({far, Chunk({1, 0, 0})}), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(HostileTest, MessagesAndHeadersAboveTheLimits) {
  EXPECT_EQ(Upload({Start(1'000'000), Chunk(std::vector<float>(3'000'000))}).error_code(),
            grpc::StatusCode::RESOURCE_EXHAUSTED);
  const auto maps = v1::Maps::NewStub(channel());
  for (const std::string& name :
       {std::string("../../etc/passwd"), std::string("a\0b", 3), std::string(1'000'000, 'x')}) {
    grpc::ClientContext context;
    v1::CreateMapRequest request;
    request.set_name(name);
    v1::CreateMapResponse answer;
    const grpc::Status status = maps->Create(&context, request, &answer);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_LT(status.error_message().size(), 1100U);
  }
  for (const std::size_t size : {std::size_t{20'000}, std::size_t{2'000'000}}) {
    grpc::ClientContext context;
    context.AddMetadata("x-big", std::string(size, 'a'));
    v1::ListMapsResponse answer;
    EXPECT_THAT(maps->List(&context, {}, &answer).error_code(),
                AnyOf(grpc::StatusCode::RESOURCE_EXHAUSTED,
                      grpc::StatusCode::UNAVAILABLE,
                      grpc::StatusCode::INTERNAL));
  }
}

TEST_F(HostileTest, StreamsThatFallSilentEnd) {
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientWriter<v1::UploadScanRequest>>> streams;
  std::vector<v1::UploadScanResponse> answers(100);
  for (v1::UploadScanResponse& answer : answers) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    streams.push_back(scans().Upload(contexts.back().get(), &answer));
    if (streams.size() % 2 == 0) streams.back()->Write(Start(5));
  }
  for (const auto& stream : streams) {
    EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  }
}

}  // namespace
}  // namespace strata::testing
