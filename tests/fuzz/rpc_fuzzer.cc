// Whatever is asked, a server answers with a status that blames the right one, and lives.
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iostream>
#include <memory>
#include <random>
#include <string>

#include "absl/strings/str_cat.h"
#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include "core/engine/engine.h"
#include "server/server.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/fuzz/require.h"
#include "tests/fuzz/rpc_script.h"
#include "tests/support/temp_dir.h"

namespace strata::fuzz {
namespace {

constexpr std::chrono::milliseconds kPatience{2000};
constexpr int kMostAnswers = 20;
constexpr std::size_t kMostMaps = 4;

// A server around a small world, for the life of the process.
class World {
 public:
  World() {
    FLAGS_minloglevel = google::GLOG_ERROR;
    database_ =
        OpenEngine({.directory = directory_.path(), .cache_bytes = std::size_t{16} << 20}).value();
    Require(database_->maps().Create({}, "world", testing::SmallMap()).ok(), "a map is made");
    for (std::uint64_t i = 1; i <= 3; ++i) {
      const PointCloud cloud = testing::MakeRoom(i, 500);
      const ScanHeader header = testing::HeaderOf({"world", i}, cloud, testing::RoomPose(i));
      Require(testing::Upload(*database_, header, cloud, 500, "world").ok(), "a scan is taken");
    }
    server_ = server::Server::Start(*database_, {.listen = "127.0.0.1:0"}).value();
    stub_ = std::make_unique<grpc::GenericStub>(
        grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials()));
  }

  grpc::Status Say(const RpcScript& script);
  // Maps that a fuzzer made would be open files and threads.
  void DeleteOtherMaps();

 private:
  // Waits for what was just started; false at the end of the stream.
  bool Done() {
    void* tag = nullptr;
    bool ok = false;
    Require(queue_.Next(&tag, &ok), "the queue lives");
    return ok;
  }

  testing::TempDir directory_;
  std::unique_ptr<api::Database> database_;
  std::unique_ptr<server::Server> server_;
  std::unique_ptr<grpc::GenericStub> stub_;
  grpc::CompletionQueue queue_;
};

grpc::ByteBuffer BufferOf(const google::protobuf::Message& message) {
  const grpc::Slice slice(message.SerializePartialAsString());
  return grpc::ByteBuffer(&slice, 1);
}

grpc::Status World::Say(const RpcScript& script) {
  grpc::ClientContext context;
  // A watch has no end of its own.
  const bool watch = script.method->name().compare(0, 5, "Watch") == 0;
  context.set_deadline(std::chrono::system_clock::now() +
                       (watch ? std::chrono::milliseconds(20) : kPatience));
  const auto call = stub_->PrepareCall(&context, script.path(), &queue_);
  call->StartCall(nullptr);
  bool open = Done();
  for (const auto& request : script.requests) {
    if (!open) break;
    call->Write(BufferOf(*request), nullptr);
    open = Done();
  }
  call->WritesDone(nullptr);
  Done();
  grpc::ByteBuffer answer;
  for (int i = 0; i < kMostAnswers; ++i) {
    call->Read(&answer, nullptr);
    if (!Done()) break;
  }
  context.TryCancel();
  grpc::Status status;
  call->Finish(&status, nullptr);
  Done();
  return status;
}

void World::DeleteOtherMaps() {
  const auto maps = database_->maps().List({});
  Require(maps.ok(), "the maps are listed");
  if (maps->size() <= kMostMaps) return;
  for (const MapInfo& map : *maps) {
    if (map.name != "world") database_->maps().Delete({}, map.name).IgnoreError();
  }
}

// Not a reason to trust a server less: what it says of others' faults and of being full.
bool Blameless(const grpc::Status& status, const RpcScript& script) {
  switch (status.error_code()) {
    case grpc::StatusCode::INTERNAL:
      // gRPC's own word for bytes that are no message, or not one message where one is expected.
      return !script.parseable || script.requests.size() != 1;
    case grpc::StatusCode::UNKNOWN:
    case grpc::StatusCode::DATA_LOSS:
    case grpc::StatusCode::UNAVAILABLE:
      return false;
    default:
      return true;
  }
}

}  // namespace
}  // namespace strata::fuzz

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data,
                                               std::size_t size,
                                               std::size_t max_size,
                                               unsigned int seed) {
  std::minstd_rand random(seed);
  strata::fuzz::RpcScript script = strata::fuzz::ReadScript(data, size);
  for (int i = 0; i < 1 + static_cast<int>(seed % 4); ++i) {
    strata::fuzz::MutateScript(script, random);
  }
  const std::string bytes = strata::fuzz::WriteScript(script, max_size);
  std::memcpy(data, bytes.data(), bytes.size());
  return bytes.size();
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static auto* const world = new strata::fuzz::World();
  const strata::fuzz::RpcScript script = strata::fuzz::ReadScript(data, size);
  const grpc::Status status = world->Say(script);
  if (!strata::fuzz::Blameless(status, script)) {
    std::cerr << script.path() << ": " << status.error_message() << '\n';
    for (const auto& request : script.requests) std::cerr << request->DebugString() << "--\n";
    strata::fuzz::Require(false, "the server's status blames the caller");
  }
  world->DeleteOtherMaps();
  return 0;
}
