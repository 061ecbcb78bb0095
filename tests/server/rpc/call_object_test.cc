#include "server/rpc/call_object.h"

#include <gtest/gtest.h>

#include "strata/v1/jobs.pb.h"
#include "strata/v1/maps.pb.h"
#include "strata/v1/planning.pb.h"
#include "strata/v1/scans.pb.h"

namespace strata::server {
namespace {

TEST(CallObjectTest, NamesWhatACallIsAbout) {
  v1::DeleteScanRequest scan;
  scan.set_map("campus");
  scan.mutable_id()->set_trajectory("run");
  scan.mutable_id()->set_sequence(7);
  EXPECT_EQ(ObjectNamedIn(scan), "run/7");
  v1::UploadScanRequest upload;
  *upload.mutable_start()->mutable_header()->mutable_id() = scan.id();
  EXPECT_EQ(ObjectNamedIn(upload), "run/7");
  v1::CancelJobRequest job;
  job.set_id(3);
  EXPECT_EQ(ObjectNamedIn(job), "3");
  v1::StartJobRequest begun;
  begun.set_kind("rebuild");
  EXPECT_EQ(ObjectNamedIn(begun), "rebuild");
  v1::SetProfileRequest profile;
  profile.set_name("crawler");
  EXPECT_EQ(ObjectNamedIn(profile), "crawler");
}

TEST(CallObjectTest, AMapIsNoObjectOfItself) {
  v1::GetMapRequest map;
  map.set_name("campus");
  EXPECT_EQ(ObjectNamedIn(map), "");
  EXPECT_EQ(ObjectNamedIn(v1::PlanPathRequest()), "");
  v1::UploadScanRequest chunk;
  chunk.mutable_chunk()->set_xyz("123");
  EXPECT_EQ(ObjectNamedIn(chunk), "");
}

}  // namespace
}  // namespace strata::server
