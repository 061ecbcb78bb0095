#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "strata/v1/scans.grpc.pb.h"
#include "tests/server/scan_sink.h"
#include "tests/server/served_mock.h"

namespace strata::server {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using Code = absl::StatusCode;

class IngestTest : public ServedMock {
 protected:
  void SetUp() override {
    Serve();
    stub_ = v1::Scans::NewStub(channel_);
    stream_ = stub_->Ingest(&context_);
  }

  bool Send(const v1::ScanStart& start) {
    v1::IngestScansRequest message;
    *message.mutable_start() = start;
    return stream_->Write(message);
  }
  bool Send(const v1::PointChunk& chunk) {
    v1::IngestScansRequest message;
    *message.mutable_chunk() = chunk;
    return stream_->Write(message);
  }
  // The next answer: "1 ok", "2 INVALID_ARGUMENT", or "end".
  std::string Next() {
    v1::IngestScansResponse answer;
    if (!stream_->Read(&answer)) return "end";
    last_error_ = answer.error().message();
    const auto code = static_cast<Code>(answer.error().code());
    if (answer.has_accepted()) {
      return absl::StrCat(answer.id().sequence(), " from ", answer.accepted().points_held());
    }
    return absl::StrCat(
        answer.id().sequence(), " ", answer.has_ack() ? "ok" : absl::StatusCodeToString(code));
  }
  void EndSending() {
    if (!sending_ended_) stream_->WritesDone();
    sending_ended_ = true;
  }
  absl::Status End() {
    EndSending();
    v1::IngestScansResponse answer;
    while (stream_->Read(&answer)) {
    }
    return translate::FromGrpcStatus(stream_->Finish());
  }

  ScanSink sink_{db_};
  std::unique_ptr<v1::Scans::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::IngestScansRequest, v1::IngestScansResponse>>
      stream_;
  std::string last_error_;
  bool sending_ended_ = false;
};

TEST_F(IngestTest, AnswersScansWhileTheStreamGoesOn) {
  ASSERT_TRUE(Send(StartOf(1, 5)));
  ASSERT_TRUE(Send(Points(5)));
  EXPECT_EQ(Next(), "1 ok");
  ASSERT_TRUE(Send(StartOf(2, 0)));
  EXPECT_EQ(Next(), "2 ok");
  EXPECT_THAT(End(), IsOk());
  EXPECT_THAT(sink_.committed(), ElementsAre("run/1: 5", "run/2: 0"));
}

TEST_F(IngestTest, ManyScansAreCommittedAndAnsweredInOrder) {
  constexpr int kScans = 200;  // more than may wait for their answers
  std::thread sender([this] {
    for (int i = 1; i <= kScans; ++i) {
      ASSERT_TRUE(Send(StartOf(static_cast<std::uint64_t>(i), 3)));
      ASSERT_TRUE(Send(Points(2)));
      ASSERT_TRUE(Send(Points(1)));
    }
    EndSending();
  });
  for (int i = 1; i <= kScans; ++i) EXPECT_EQ(Next(), absl::StrCat(i, " ok"));
  EXPECT_EQ(Next(), "end");
  sender.join();
  EXPECT_THAT(End(), IsOk());
  const std::vector<std::string> committed = sink_.committed();
  ASSERT_THAT(committed, SizeIs(kScans));
  EXPECT_EQ(committed[122], "run/123: 3");
}

TEST_F(IngestTest, TellsWhereToGoOn) {
  v1::ScanStart start = StartOf(1, 9);
  start.mutable_header()->set_content_hash(std::string(32, 'a'));
  start.set_resume(true);
  ASSERT_TRUE(Send(start));
  EXPECT_EQ(Next(), "1 from 4");
  ASSERT_TRUE(Send(Points(5)));
  EXPECT_EQ(Next(), "1 ok");
  start.mutable_header()->set_point_count(3);  // is there
  ASSERT_TRUE(Send(start));
  EXPECT_EQ(Next(), "1 from 3");
  EXPECT_EQ(Next(), "1 ok");
  start.set_resume(false);  // one that does not ask sends it all the same
  ASSERT_TRUE(Send(start));
  ASSERT_TRUE(Send(Points(3)));
  EXPECT_EQ(Next(), "1 ok");
  start.mutable_header()->clear_content_hash();
  start.set_resume(true);
  ASSERT_TRUE(Send(start));
  EXPECT_EQ(Next(), "1 from 0");
  ASSERT_TRUE(Send(Points(3)));
  EXPECT_EQ(Next(), "1 ok");
  EXPECT_THAT(End(), IsOk());
  EXPECT_THAT(sink_.committed(), ElementsAre("run/1: 5", "run/1: 0", "run/1: 0", "run/1: 3"));
}

TEST_F(IngestTest, AScansErrorIsItsOwn) {
  sink_.Refuse(4);
  v1::PointChunk bad = Points(1);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  bad.mutable_xyz()->replace(0, 4, reinterpret_cast<const char*>(&nan), 4);
  v1::ScanStart nowhere = StartOf(3, 1);
  nowhere.set_map("nowhere");

  ASSERT_TRUE(Send(StartOf(1, 1)));
  ASSERT_TRUE(Send(Points(1)));
  ASSERT_TRUE(Send(StartOf(2, 3)));
  ASSERT_TRUE(Send(bad));
  ASSERT_TRUE(Send(Points(2)));  // the rest of scan 2: passed over
  ASSERT_TRUE(Send(nowhere));
  ASSERT_TRUE(Send(Points(1)));
  ASSERT_TRUE(Send(StartOf(4, 1)));
  ASSERT_TRUE(Send(Points(1)));
  ASSERT_TRUE(Send(StartOf(5, 1)));
  ASSERT_TRUE(Send(Points(1)));
  EXPECT_EQ(Next(), "1 ok");
  EXPECT_EQ(Next(), "2 INVALID_ARGUMENT");
  EXPECT_THAT(last_error_, HasSubstr("scan run/2: point 0 (nan"));
  EXPECT_EQ(Next(), "3 NOT_FOUND");
  EXPECT_EQ(Next(), "4 ALREADY_EXISTS");
  EXPECT_EQ(Next(), "5 ok");
  EXPECT_THAT(End(), IsOk());
  EXPECT_THAT(sink_.committed(), ElementsAre("run/1: 1", "run/5: 1"));
}

TEST_F(IngestTest, AnIncompleteScanIsAnErrorOfThatScan) {
  ASSERT_TRUE(Send(StartOf(1, 5)));
  ASSERT_TRUE(Send(Points(3)));
  ASSERT_TRUE(Send(StartOf(2, 1)));
  EXPECT_EQ(Next(), "1 INVALID_ARGUMENT");
  EXPECT_THAT(last_error_, HasSubstr("3 points arrived, the header announced 5"));
  EndSending();
  EXPECT_EQ(Next(), "2 INVALID_ARGUMENT");
  EXPECT_THAT(End(), IsOk());
  EXPECT_THAT(sink_.committed(), IsEmpty());
}

TEST_F(IngestTest, AChunkWithoutAScanEndsTheStream) {
  Send(Points(1));
  EXPECT_THAT(End(), StatusIs(Code::kInvalidArgument, HasSubstr("send its start")));
}

TEST_F(IngestTest, AClientThatGoesAwayLeavesNoHalfScan) {
  ASSERT_TRUE(Send(StartOf(1, 5)));
  ASSERT_TRUE(Send(Points(5)));
  EXPECT_EQ(Next(), "1 ok");
  ASSERT_TRUE(Send(StartOf(2, 5)));
  ASSERT_TRUE(Send(Points(4)));
  ASSERT_TRUE(Send(StartOf(3, 5)));
  EXPECT_EQ(Next(), "2 INVALID_ARGUMENT");
  context_.TryCancel();
  EXPECT_THAT(End(), StatusIs(Code::kCancelled, ::testing::_));
  sink_.AwaitAbandoned();
  EXPECT_THAT(sink_.committed(), ElementsAre("run/1: 5"));
}

}  // namespace
}  // namespace strata::server
