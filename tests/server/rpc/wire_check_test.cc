#include "server/rpc/wire_check.h"

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/message.h>
#include <gtest/gtest.h>

#include "strata/v1/bounds.pb.h"
#include "strata/v1/classifiers.pb.h"
#include "strata/v1/jobs.pb.h"
#include "strata/v1/maps.pb.h"
#include "strata/v1/planning.pb.h"
#include "strata/v1/posegraph.pb.h"
#include "strata/v1/scans.pb.h"
#include "strata/v1/tiles.pb.h"
#include "tests/support/status_matchers.h"

namespace strata::server {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::FileDescriptor;
using google::protobuf::Message;
using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::HasSubstr;
using Code = absl::StatusCode;

absl::StatusOr<std::size_t> Check(const Descriptor& type, const std::string& bytes) {
  google::protobuf::io::ArrayInputStream stream(bytes.data(), static_cast<int>(bytes.size()));
  return ParsedBytes(type, stream);
}
template <typename MessageType>
absl::StatusOr<std::size_t> Check(const std::string& bytes) {
  return Check(*MessageType::descriptor(), bytes);
}
// Whether `message` takes no more than was foreseen, and not much less.
void ExpectForeseen(const Message& message) {
  STRATA_ASSERT_OK_AND_ASSIGN(const std::size_t bytes,
                              Check(*message.GetDescriptor(), message.SerializeAsString()));
  EXPECT_GE(bytes, message.SpaceUsedLong());
  EXPECT_LE(bytes, 5 * message.SpaceUsedLong() + 1000);
}

// Every field that is repeated in `type` or in what it holds.
void AddRepeated(const Descriptor& type,
                 std::set<const Descriptor*>& seen,
                 std::vector<const FieldDescriptor*>& fields) {
  if (!seen.insert(&type).second) return;
  for (int i = 0; i < type.field_count(); ++i) {
    const FieldDescriptor& field = *type.field(i);
    if (field.is_repeated()) fields.push_back(&field);
    if (field.message_type() != nullptr) AddRepeated(*field.message_type(), seen, fields);
  }
}

TEST(WireCheckTest, EveryRepeatedFieldOfARequestHasABound) {
  std::vector<const FieldDescriptor*> fields;
  std::set<const Descriptor*> seen;
  for (const Descriptor* of_file : {v1::ImportClassifierRequest::descriptor(),
                                    v1::StartJobRequest::descriptor(),
                                    v1::CreateMapRequest::descriptor(),
                                    v1::PlanPathRequest::descriptor(),
                                    v1::SetPoseRequest::descriptor(),
                                    v1::UploadScanRequest::descriptor(),
                                    v1::FetchTilesRequest::descriptor()}) {
    const FileDescriptor& file = *of_file->file();
    ASSERT_EQ(file.service_count(), 1);
    for (int i = 0; i < file.service(0)->method_count(); ++i) {
      AddRepeated(*file.service(0)->method(i)->input_type(), seen, fields);
    }
  }
  EXPECT_GE(fields.size(), 8U);
  for (const FieldDescriptor* field : fields) {
    EXPECT_GT(field->options().GetExtension(v1::max_items), 0U)
        << field->full_name() << ": how many may be in one request? (bounds.proto)";
  }
}

TEST(WireCheckTest, WhatAMessageTakesIsForeseen) {
  v1::FetchTilesRequest fetch;
  fetch.set_map("campus");
  for (int i = 0; i < 1000; ++i) {
    v1::HeldTile& held = *fetch.add_held();
    held.mutable_key()->set_x(i);
    held.set_version(static_cast<std::uint64_t>(i));
  }
  ExpectForeseen(fetch);
  v1::UploadScanRequest upload;
  upload.mutable_chunk()->set_xyz(std::string(480'000, 'x'));
  ExpectForeseen(upload);
  v1::StartJobRequest job;
  for (int i = 0; i < 50; ++i) (*job.mutable_parameters())[absl::StrCat("key", i)] = "value";
  ExpectForeseen(job);
  v1::AddConstraintRequest constraint;
  for (int i = 0; i < 36; ++i) constraint.mutable_constraint()->add_information(i);
  constraint.mutable_constraint()->mutable_i()->set_trajectory("run");
  ExpectForeseen(constraint);
  ExpectForeseen(v1::ListMapsRequest());
}

TEST(WireCheckTest, MoreItemsThanTheContractAllowsAreRefusedByName) {
  // Two bytes an item, of which some fifty become a hundred.
  std::string held;
  for (int i = 0; i <= 262'144; ++i) held += std::string("\x1A\x00", 2);
  EXPECT_THAT(Check<v1::FetchTilesRequest>(held),
              StatusIs(Code::kInvalidArgument, HasSubstr("held: 262145 or more; at most 262144")));
  // Also where they come in several messages that are merged.
  v1::CheckPathRequest check;
  for (int i = 0; i < 6000; ++i) check.mutable_known()->add_tiles();
  const std::string half = check.SerializeAsString();
  EXPECT_THAT(Check<v1::CheckPathRequest>(half), IsOk());
  EXPECT_THAT(Check<v1::CheckPathRequest>(half + half),
              StatusIs(Code::kInvalidArgument, HasSubstr("tiles: 10001 or more")));
  // And packed.
  v1::AddConstraintRequest constraint;
  for (int i = 0; i < 37; ++i) constraint.mutable_constraint()->add_information(i);
  EXPECT_THAT(Check<v1::AddConstraintRequest>(constraint.SerializeAsString()),
              StatusIs(Code::kInvalidArgument, HasSubstr("information: 37 or more")));
}

TEST(WireCheckTest, FieldsOfANewerClientAreTakenButNotAnyNumber) {
  const std::string varint("\x78\x01", 2);  // field 15
  std::string bytes;
  for (std::size_t i = 0; i < kMaxUnknownFields; ++i) bytes += varint;
  STRATA_ASSERT_OK_AND_ASSIGN(const std::size_t taken, Check<v1::GetMapRequest>(bytes));
  v1::GetMapRequest parsed;
  ASSERT_TRUE(parsed.ParseFromString(bytes));
  EXPECT_GE(taken, parsed.SpaceUsedLong());
  EXPECT_THAT(Check<v1::GetMapRequest>(bytes + varint),
              StatusIs(Code::kInvalidArgument, HasSubstr("does not know")));
}

TEST(WireCheckTest, WhatIsNoMessageIsRefused) {
  v1::SetPoseRequest in;
  in.set_map("campus");
  in.mutable_pose()->mutable_translation()->set_x(1.0);
  const std::string whole = in.SerializeAsString();
  EXPECT_THAT(Check<v1::SetPoseRequest>(whole), IsOk());
  for (std::size_t size = 1; size < whole.size(); ++size) {
    v1::SetPoseRequest parsed;
    const bool good = parsed.ParseFromString(whole.substr(0, size));
    EXPECT_EQ(Check<v1::SetPoseRequest>(whole.substr(0, size)).ok(), good) << size;
  }
  const std::string group("\x7B\x7C", 2);
  EXPECT_THAT(Check<v1::SetPoseRequest>(group), StatusIs(Code::kInvalidArgument, _));
  const std::string field_zero("\x02\x00", 2);
  EXPECT_THAT(Check<v1::SetPoseRequest>(field_zero), StatusIs(Code::kInvalidArgument, _));
}

}  // namespace
}  // namespace strata::server
