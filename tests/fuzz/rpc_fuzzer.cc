// Whatever is asked, a server answers with a status that blames the right one, and lives.
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <glog/logging.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include "core/engine/engine.h"
#include "server/server.h"
#include "tests/fuzz/require.h"
#include "tests/fuzz/rpc_script.h"
#include "tests/fuzz/small_world.h"
#include "tests/support/temp_dir.h"

namespace strata::fuzz {
namespace {

constexpr std::chrono::milliseconds kPatience{2000};
constexpr int kMostAnswers = 20;
constexpr int kScriptsPerWorld = 100;

// A server around a copy of the small world.
class World {
 public:
  explicit World(const SmallWorld& content) {
    content.CopyTo(directory_.path() / "maps");
    database_ = OpenEngine({.directory = directory_.path() / "maps",
                            .cache_bytes = std::size_t{16} << 20,
                            .max_maps = 4})
                    .value();
    server::ServerOptions options;
    options.listen = "127.0.0.1:0";
    server_ = server::Server::Start(*database_, options).value();
    grpc::ChannelArguments own;  // or all channels to one address share a connection
    own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    stub_ = std::make_unique<grpc::GenericStub>(
        grpc::CreateCustomChannel(server_->address(), grpc::InsecureChannelCredentials(), own));
  }

  // All but the held ones in turn, those at last: what each was answered, in their order.
  std::vector<grpc::Status> Say(const RpcScript& script);
  bool HasMap() { return database_->maps().Get({}, kWorld).ok(); }

 private:
  // A call whose requests have been sent.
  struct OpenCall {
    grpc::ClientContext context;
    std::unique_ptr<grpc::GenericClientAsyncReaderWriter> call;
  };

  std::unique_ptr<OpenCall> Open(const RpcCall& said);
  // Half-closes or cuts it, and reads what is answered.
  grpc::Status End(const RpcCall& said, OpenCall& open);
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

std::chrono::milliseconds PatienceFor(const RpcCall& call) {
  const std::string path = call.path();
  if (path == "/strata.v1.Jobs/Watch") return std::chrono::milliseconds(500);
  // These have no end of their own.
  const bool watch = path == "/strata.v1.Maps/Watch" || path == "/strata.v1.Planning/WatchPath";
  return watch ? std::chrono::milliseconds(20) : kPatience;
}

std::unique_ptr<World::OpenCall> World::Open(const RpcCall& said) {
  auto open = std::make_unique<OpenCall>();
  open->context.set_deadline(std::chrono::system_clock::now() + PatienceFor(said));
  open->call = stub_->PrepareCall(&open->context, said.path(), &queue_);
  open->call->StartCall(nullptr);
  bool alive = Done();
  for (const auto& request : said.requests) {
    if (!alive) break;
    open->call->Write(BufferOf(*request), nullptr);
    alive = Done();
  }
  return open;
}

grpc::Status World::End(const RpcCall& said, OpenCall& open) {
  if (said.cut) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));  // or nothing of it arrives
    open.context.TryCancel();
  } else {
    open.call->WritesDone(nullptr);
    Done();
  }
  grpc::ByteBuffer answer;
  int answers = 0;
  for (bool more = true; more && answers < kMostAnswers; ++answers) {
    open.call->Read(&answer, nullptr);
    more = Done();
  }
  if (answers == kMostAnswers) open.context.TryCancel();
  grpc::Status status;
  open.call->Finish(&status, nullptr);
  Done();
  return status;
}

std::vector<grpc::Status> World::Say(const RpcScript& script) {
  std::vector<grpc::Status> answers(script.size());
  std::map<std::size_t, std::unique_ptr<OpenCall>> held;
  for (std::size_t i = 0; i < script.size(); ++i) {
    std::unique_ptr<OpenCall> open = Open(script[i]);
    if (script[i].held) {
      held[i] = std::move(open);
    } else {
      answers[i] = End(script[i], *open);
    }
  }
  for (const auto& [i, open] : held) answers[i] = End(script[i], *open);
  return answers;
}

// How often each call was made and granted: what a run never reached can be seen at its end.
class Tally {
 public:
  ~Tally() {
    for (const auto& [path, counts] : counts_) {
      std::cerr << path << ": " << counts.first << " calls, " << counts.second << " granted\n";
    }
  }
  void Count(const RpcCall& call, const grpc::Status& status) {
    auto& [calls, granted] = counts_[call.path()];
    ++calls;
    granted += status.ok() ? 1 : 0;
  }

 private:
  std::map<std::string, std::pair<int, int>> counts_;
};

// Not a reason to trust a server less: what it says of others' faults and of being full.
bool Blameless(const grpc::Status& status, const RpcCall& call) {
  switch (status.error_code()) {
    case grpc::StatusCode::INTERNAL:
      // gRPC's own word for bytes that are no message, or not one message where one is expected.
      return !call.parseable || call.requests.size() != 1;
    case grpc::StatusCode::UNKNOWN:
    case grpc::StatusCode::DATA_LOSS:
    case grpc::StatusCode::UNAVAILABLE:
      return false;
    default:
      return true;
  }
}

void CheckAnswer(const RpcCall& call, const grpc::Status& status) {
  static Tally tally;
  tally.Count(call, status);
  if (Blameless(status, call)) return;
  std::cerr << call.path() << ": " << status.error_code() << ' ' << status.error_message() << '\n';
  for (const auto& request : call.requests) std::cerr << request->DebugString() << "--\n";
  Require(false, "the server's status blames the caller");
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
  using namespace strata::fuzz;
  static const auto* const content = [] {
    FLAGS_minloglevel = google::GLOG_ERROR;
    return new SmallWorld();
  }();
  static std::unique_ptr<World> world;
  static int scripts = 0;
  // A copy takes longer than a script, and changes of one script hardly hinder the next.
  if (world == nullptr || ++scripts % kScriptsPerWorld == 0 || !world->HasMap()) {
    world.reset();
    world = std::make_unique<World>(*content);
  }
  const RpcScript script = ReadScript(data, size);
  const std::vector<grpc::Status> answers = world->Say(script);
  for (std::size_t i = 0; i < script.size(); ++i) CheckAnswer(script[i], answers[i]);
  return 0;
}
