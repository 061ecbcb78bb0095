// Requests that are no requests, and requests that would take more memory than anybody may have.
#include <atomic>
#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/retry_delay.h"
#include "strata/v1/classifiers.grpc.pb.h"
#include "strata/v1/jobs.grpc.pb.h"
#include "strata/v1/maps.grpc.pb.h"
#include "strata/v1/planning.grpc.pb.h"
#include "strata/v1/scans.grpc.pb.h"
#include "strata/v1/tiles.grpc.pb.h"
#include "tests/server/new_grant.h"
#include "tests/server/raw_call.h"
#include "tests/server/scan_sink.h"
#include "tests/server/served_mock.h"
#include "tests/support/temp_dir.h"

namespace strata::server {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Return;
using Code = absl::StatusCode;

constexpr char kGarbage[] = "\x0A\xFF\xFF\xFF\xFF\x0F no message at all";
constexpr const char* kKinds[] = {"/strata.v1.Maps/Get",      // one request, one answer
                                  "/strata.v1.Tiles/Fetch",   // a stream of answers
                                  "/strata.v1.Maps/Watch",    // a watch
                                  "/strata.v1.Scans/Upload",  // a stream of requests
                                  "/strata.v1.Scans/Ingest",  // both
                                  "/strata.v1.Scans/SetLabels",
                                  "/strata.v1.PoseGraph/Localize",
                                  "/strata.v1.PoseGraph/Track"};

class HostileRequestTest : public ServedMock {
 protected:
  // Of whoever may do everything.
  std::string ServeWithToken(ServerOptions options = {}) {
    const auto [grant, token] = NewGrant("writer", {{kAllMaps, Right::kWrite}});
    AddToFile(file_, grant);
    options.token_file = file_;
    Serve(options);
    return "Bearer " + token;
  }
  absl::Status Say(const std::string& path,
                   const std::string& request,
                   const std::map<std::string, std::string>& metadata = {}) {
    return translate::FromGrpcStatus(CallRaw(channel_, path, request, metadata).status);
  }

  ScanSink sink_{db_};
  testing::TempDir dir_;
  const std::filesystem::path file_ = dir_.path() / "tokens.json";
};

TEST_F(HostileRequestTest, AStrangersBytesAreNotParsed) {
  const std::string token = ServeWithToken();
  for (const char* path : kKinds) {
    SCOPED_TRACE(path);
    EXPECT_THAT(Say(path, kGarbage), StatusIs(Code::kUnauthenticated, _));
    const absl::Status known = Say(path, kGarbage, {{"authorization", token}});
    EXPECT_THAT(known, StatusIs(Code::kInvalidArgument, HasSubstr("no message")));
    EXPECT_EQ(ReasonOf(known), "REQUEST");
  }
}

TEST_F(HostileRequestTest, BytesThatAreNoMessageAreNoHalfClose) {
  Serve();
  v1::UploadScanRequest start;
  *start.mutable_start() = StartOf(1, 1);
  v1::UploadScanRequest points;
  *points.mutable_chunk() = Points(1);
  // A string that is no UTF-8 is what only the parser finds.
  v1::UploadScanRequest bad = start;
  bad.mutable_start()->set_map("\xFF");
  const auto stub = v1::Scans::NewStub(channel_);
  grpc::ClientContext context;
  v1::UploadScanResponse out;
  const auto writer = stub->Upload(&context, &out);
  ASSERT_TRUE(writer->Write(start));
  ASSERT_TRUE(writer->Write(points));
  writer->Write(bad);
  EXPECT_THAT(translate::FromGrpcStatus(writer->Finish()), StatusIs(Code::kInvalidArgument, _));
  EXPECT_THAT(sink_.committed(), IsEmpty());
}

TEST_F(HostileRequestTest, MillionsOfEmptyItemsAreRefusedByNameAndBound) {
  Serve();
  std::string items;
  for (int i = 0; i < 2'000'000; ++i) items += std::string("\x1A\x00", 2);
  EXPECT_THAT(Say("/strata.v1.Tiles/Fetch", items),
              StatusIs(Code::kInvalidArgument, HasSubstr("held: 262145 or more; at most 262144")));
  v1::WatchPathRequest watch;
  for (int i = 0; i < 10'001; ++i) watch.add_waypoints();
  EXPECT_THAT(Say("/strata.v1.Planning/WatchPath", watch.SerializeAsString()),
              StatusIs(Code::kInvalidArgument, HasSubstr("waypoints: 10001 or more")));
  v1::SampleSurfacesRequest sample;
  for (int i = 0; i < 10'001; ++i) sample.add_places();
  EXPECT_THAT(Say("/strata.v1.Planning/SampleSurfaces", sample.SerializeAsString()),
              StatusIs(Code::kInvalidArgument, HasSubstr("places: 10001 or more")));
}

// A server where one client may hold 4 MiB.
class SmallBudgetTest : public HostileRequestTest {
 protected:
  static ServerOptions Options() {
    ServerOptions options;
    options.client.max_bytes = std::size_t{4} << 20;
    return options;
  }
};

TEST_F(SmallBudgetTest, WhatOneClientsOpenStreamsKeepIsBounded) {
  ON_CALL(db_.maps(), Get(_, _)).WillByDefault(Return(MapInfo()));
  Serve(Options());
  const auto stub = v1::Classifiers::NewStub(channel_);
  v1::ImportClassifierRequest start;
  start.mutable_start()->set_map("campus");
  v1::ImportClassifierRequest bytes;
  bytes.set_bytes(std::string(1 << 20, 'x'));
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientWriter<v1::ImportClassifierRequest>>> streams;
  std::vector<v1::ImportClassifierResponse> answers(8);
  for (v1::ImportClassifierResponse& answer : answers) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    streams.push_back(stub->Import(contexts.back().get(), &answer));
    streams.back()->Write(start);
    streams.back()->Write(bytes);
  }
  // None has said that it is at its end; those for which there is no room have ended all the same.
  // Which those are depends on whose bytes came first.
  std::vector<absl::Status> ended(streams.size());
  std::atomic<std::size_t> refused = 0;
  std::vector<std::thread> waiting;
  for (std::size_t i = 0; i < streams.size(); ++i) {
    waiting.emplace_back([&, i] {
      ended[i] = translate::FromGrpcStatus(streams[i]->Finish());
      ++refused;
    });
  }
  const absl::Time until = absl::Now() + absl::Seconds(50);  // before they end for being silent
  while (refused < 4 && absl::Now() < until) absl::SleepFor(absl::Milliseconds(1));
  EXPECT_GE(refused, 4U);
  for (const auto& context : contexts) context->TryCancel();
  for (std::thread& thread : waiting) thread.join();
  for (const absl::Status& status : ended) {
    if (status.code() == Code::kCancelled) continue;
    EXPECT_THAT(status, StatusIs(Code::kResourceExhausted, HasSubstr("bytes of memory")));
    EXPECT_NE(RetryDelayOf(status), std::nullopt);
  }
}

TEST_F(SmallBudgetTest, AnAnswerThatIsTooLargeIsRefused) {
  Serve(Options());
  std::vector<JobInfo> jobs(1);
  jobs[0].message = std::string(3 << 20, 'x');
  jobs[0].kind = "verify";
  ON_CALL(db_.jobs(), List(_, _)).WillByDefault(Return(jobs));
  const absl::Status status = Say("/strata.v1.Jobs/List", "");
  EXPECT_THAT(status, StatusIs(Code::kResourceExhausted, HasSubstr("--client-memory")));
  EXPECT_EQ(RetryDelayOf(status), std::nullopt);
  // Nothing stays booked.
  jobs[0].message = std::string(1 << 20, 'x');
  ON_CALL(db_.jobs(), List(_, _)).WillByDefault(Return(jobs));
  for (int i = 0; i < 10; ++i) {
    // gRPC tells a little later that the answer before was taken.
    absl::Status again = Say("/strata.v1.Jobs/List", "");
    while (RetryDelayOf(again).has_value()) {
      absl::SleepFor(*RetryDelayOf(again));
      again = Say("/strata.v1.Jobs/List", "");
    }
    EXPECT_THAT(again, IsOk());
  }
}

TEST_F(SmallBudgetTest, WhatAWatchKeepsForItsReaderIsBooked) {
  ON_CALL(db_.maps(), Watch(_, _, _, _)).WillByDefault([](auto&, auto, auto&, auto sink) {
    api::MapUpdate update;
    update.commit_sequence = 5;
    update.scans.resize(100'000);
    for (api::ScanChange& scan : update.scans) scan.id.trajectory = std::string(100, 'x');
    return sink(update);
  });
  Serve(Options());
  const auto stub = v1::Maps::NewStub(channel_);
  grpc::ClientContext context;
  const auto reader = stub->Watch(&context, {});
  v1::WatchMapResponse out;
  EXPECT_FALSE(reader->Read(&out));
  EXPECT_THAT(translate::FromGrpcStatus(reader->Finish()),
              StatusIs(Code::kResourceExhausted, HasSubstr("--client-memory")));
}

TEST_F(SmallBudgetTest, UploadsUnderWayAreBooked) {
  Serve(Options());
  const auto stub = v1::Scans::NewStub(channel_);
  v1::UploadScanRequest start;
  *start.mutable_start() = StartOf(1, 1'000'000);
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientWriter<v1::UploadScanRequest>>> streams;
  std::vector<v1::UploadScanResponse> answers(3);
  for (v1::UploadScanResponse& answer : answers) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    streams.push_back(stub->Upload(contexts.back().get(), &answer));
    streams.back()->Write(start);
    streams.back()->WaitForInitialMetadata();
  }
  EXPECT_THAT(translate::FromGrpcStatus(streams.back()->Finish()),
              StatusIs(Code::kResourceExhausted, HasSubstr("bytes of memory")));
  for (std::size_t i = 0; i < 2; ++i) {
    contexts[i]->TryCancel();
    streams[i]->Finish();
  }
}

}  // namespace
}  // namespace strata::server
