#include "core/completion/kind_codec.h"

#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/codec/blob.h"
#include "core/codec/bytes.h"
#include "tests/core/codec/hostile.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::HasSubstr;
using Code = absl::StatusCode;

NewKind Crate() {
  NewKind kind{"crate_small", "crate", {}};
  for (int i = 0; i < 40; ++i) {
    kind.shape.points.emplace_back(0.1F * static_cast<float>(i % 7), 0.25F, 0.5F);
  }
  kind.shape.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  kind.shape.triangles = {{0, 1, 2}};
  return kind;
}

KindInfo CrateInfo() {
  KindInfo info;
  info.id = KindIdOf(Crate().shape);
  info.class_id = 7;
  info.origin = KindOrigin::kNamed;
  info.made = absl::FromUnixMicros(1'700'000'000'123'456);
  info.size = {1.0, 0.5, 0.25};
  info.points = 40;
  info.triangles = 1;
  return info;
}

TEST(KindCodecTest, ComesBack) {
  const NewKind crate = Crate();
  STRATA_ASSERT_OK_AND_ASSIGN(const NewKind file, DecodeKindFile(EncodeKindFile(crate)));
  EXPECT_EQ(file.name, crate.name);
  EXPECT_EQ(file.class_name, crate.class_name);
  EXPECT_EQ(file.shape, crate.shape);
  STRATA_ASSERT_OK_AND_ASSIGN(const KindShape shape, DecodeKindShape(EncodeKindShape(crate.shape)));
  EXPECT_EQ(shape, crate.shape);
  EXPECT_EQ(KindIdOf(shape), KindIdOf(crate.shape));
  const KindInfo info = CrateInfo();
  STRATA_ASSERT_OK_AND_ASSIGN(const KindInfo head, DecodeKindInfo(EncodeKindInfo(info)));
  EXPECT_EQ(head.id, info.id);
  EXPECT_EQ(head.made, info.made);
  EXPECT_EQ(head.size, info.size);
  EXPECT_EQ(EncodeKindInfo(head), EncodeKindInfo(info));
}

TEST(KindCodecTest, TheLargestIsLessThanARow) {
  KindShape shape;
  shape.points.resize(kMaxKindPoints, Eigen::Vector3f::Zero());
  shape.vertices.resize(kMaxKindVertices, Eigen::Vector3f::Zero());
  shape.triangles.resize(kMaxKindTriangles, {0, 1, 2});
  const std::string bytes = EncodeKindShape(shape);
  EXPECT_LE(bytes.size(), std::size_t{1} << 20);
  STRATA_EXPECT_OK(DecodeKindShape(bytes));
}

TEST(KindCodecTest, DamageIsDataLoss) {
  testing::ExpectDamageIsDataLoss(EncodeKindFile(Crate()), &DecodeKindFile, 2, 300);
  testing::ExpectDamageIsDataLoss(EncodeKindInfo(CrateInfo()), &DecodeKindInfo, 3, 300);
  testing::DecodeForgedBodies(
      BlobKind::kKindFile, EncodeKindFile(Crate()), &DecodeKindFile, 3, 2000);
  testing::DecodeForgedBodies(
      BlobKind::kKindShape, EncodeKindShape(Crate().shape), &DecodeKindShape, 4, 2000);
}

TEST(KindCodecTest, NothingIsAllocatedForWhatIsNotThere) {
  std::string body;
  PutFixed(body, std::uint32_t{0xFFFFFFFF});
  EXPECT_THAT(DecodeKindShape(SealBlob(BlobKind::kKindShape, 1, body)),
              StatusIs(Code::kDataLoss, HasSubstr("too large")));
  body.clear();
  PutFixed(body, static_cast<std::uint32_t>(kMaxKindPoints));
  EXPECT_THAT(DecodeKindShape(SealBlob(BlobKind::kKindShape, 1, body)),
              StatusIs(Code::kDataLoss, HasSubstr("cut short")));
}

TEST(KindCodecTest, HostileShapesAreNamed) {
  const auto refused = [](const NewKind& kind, const char* why) {
    EXPECT_THAT(ValidateKindShape(kind.shape), StatusIs(Code::kInvalidArgument, HasSubstr(why)));
    EXPECT_THAT(DecodeKindFile(EncodeKindFile(kind)), StatusIs(Code::kDataLoss, HasSubstr(why)));
  };
  NewKind kind = Crate();
  kind.shape.points[17].y() = std::numeric_limits<float>::quiet_NaN();
  refused(kind, "point 17");
  kind = Crate();
  kind.shape.vertices[1].x() = 1e30F;
  refused(kind, "vertex 1");
  kind = Crate();
  kind.shape.triangles[0][2] = 3;
  refused(kind, "triangle 0 has vertex 3 of 3");
  kind = Crate();
  kind.shape.points.resize(3);
  refused(kind, "3 points");
  kind = Crate();
  kind.class_name = "no class";
  EXPECT_THAT(DecodeKindFile(EncodeKindFile(kind)), StatusIs(Code::kDataLoss, HasSubstr("names")));
}

TEST(KindCodecTest, KindsAreCalledByNameOrByDigits) {
  KindInfo golf = CrateInfo();
  golf.id = 0xabcdef012345;
  golf.name = "golf";
  KindInfo other = golf;
  other.id = 0xabcdee000000;
  other.name = "";
  const std::vector<KindInfo> kinds = {golf, other};
  EXPECT_EQ(KindCalled(kinds, "golf")->id, golf.id);
  EXPECT_EQ(KindCalled(kinds, "abcdee")->id, other.id);
  EXPECT_EQ(KindCalled(kinds, KindIdText(golf.id))->id, golf.id);
  EXPECT_THAT(KindCalled(kinds, "abcd"), StatusIs(Code::kInvalidArgument, HasSubstr("2 kinds")));
  EXPECT_THAT(KindCalled(kinds, "abc"), StatusIs(Code::kNotFound, HasSubstr("kind list")));
  EXPECT_THAT(KindCalled(kinds, ""), StatusIs(Code::kNotFound, HasSubstr("kind list")));
}

}  // namespace
}  // namespace strata
