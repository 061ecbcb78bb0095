#include "core/completion/entity_codec.h"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/codec/blob.h"
#include "tests/core/codec/hostile.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

StoredEntity Car() {
  StoredEntity car;
  car.entity.id = 12;
  car.entity.class_id = 7;
  car.entity.box = {{100.25, -3.5, 0.75}, {4.2, 1.8, 1.5}, 1.25};
  car.entity.radius_m = 2.3;
  car.scans = {{4, 300}, {900, 45}};
  car.entity.points = 345;
  return car;
}

TEST(EntityCodecTest, ComesBack) {
  const StoredEntity car = Car();
  STRATA_ASSERT_OK_AND_ASSIGN(const StoredEntity back, DecodeEntity(EncodeEntity(car)));
  EXPECT_EQ(back.entity.id, 12U);
  EXPECT_EQ(back.entity.class_id, 7);
  EXPECT_EQ(back.entity.box, car.entity.box);
  EXPECT_EQ(back.entity.points, 345U);
  EXPECT_EQ(back.scans, car.scans);
  EXPECT_EQ(EncodeEntity(back), EncodeEntity(car));

  EntitiesInfo info;
  info.job = 3;
  info.epoch = 2;
  info.made = absl::FromUnixMicros(1'700'000'000'123'456);
  info.scans = 5;
  info.points = 70'000;
  info.entities = 12;
  info.reaches = {{1, 0.15}, {7, 0.4}};
  STRATA_ASSERT_OK_AND_ASSIGN(const EntitiesInfo head,
                              DecodeEntitiesInfo(EncodeEntitiesInfo(info)));
  EXPECT_EQ(head.reaches, info.reaches);
  EXPECT_EQ(EncodeEntitiesInfo(head), EncodeEntitiesInfo(info));
  testing::ExpectDamageIsDataLoss(EncodeEntitiesInfo(info), &DecodeEntitiesInfo, 5, 300);
}

TEST(EntityCodecTest, OfBeforeThereWereKindsIsRead) {
  StoredEntity car = Car();
  EntityKind& kind = car.entity.kind.emplace();
  kind.id = 0x123456789abc;
  kind.T_map_kind.translation() = Eigen::Vector3d(1.0, 2.0, 3.0);
  kind.residual_m = 0.02;
  kind.overlap = 0.9;
  STRATA_ASSERT_OK_AND_ASSIGN(const StoredEntity back, DecodeEntity(EncodeEntity(car)));
  ASSERT_TRUE(back.entity.kind.has_value());
  EXPECT_EQ(back.entity.kind->id, kind.id);
  EXPECT_TRUE(back.entity.kind->T_map_kind.isApprox(kind.T_map_kind));
  EXPECT_EQ(back.entity.kind->overlap, 0.9);
  EXPECT_EQ(EncodeEntity(back), EncodeEntity(car));

  const std::string without = EncodeEntity(Car());
  STRATA_ASSERT_OK_AND_ASSIGN(const absl::string_view body,
                              OpenBlob(BlobKind::kEntity, 2, without));
  const std::string first_version = SealBlob(BlobKind::kEntity, 1, body.substr(0, body.size() - 8));
  STRATA_ASSERT_OK_AND_ASSIGN(const StoredEntity old, DecodeEntity(first_version));
  EXPECT_EQ(old.entity.points, 345U);
  EXPECT_FALSE(old.entity.kind.has_value());
  car.entity.kind->overlap = 1.5;
  EXPECT_THAT(DecodeEntity(EncodeEntity(car)),
              StatusIs(absl::StatusCode::kDataLoss, HasSubstr("kind")));
}

TEST(EntityCodecTest, DamageIsDataLoss) {
  testing::ExpectDamageIsDataLoss(EncodeEntity(Car()), &DecodeEntity, 2, 300);
  const int accepted =
      testing::DecodeForgedBodies(BlobKind::kEntity, EncodeEntity(Car()), &DecodeEntity, 3, 2000);
  EXPECT_LT(accepted, 2000);
}

TEST(EntityCodecTest, WhatNoEntityIsIsFound) {
  const auto refused = [](const StoredEntity& stored) {
    EXPECT_THAT(DecodeEntity(EncodeEntity(stored)),
                StatusIs(absl::StatusCode::kDataLoss, HasSubstr("out of range")));
  };
  StoredEntity car = Car();
  car.entity.class_id = 0;
  refused(car);
  car = Car();
  car.entity.box.centre.x() = std::numeric_limits<double>::quiet_NaN();
  refused(car);
  car = Car();
  car.entity.box.size.z() = -1.0;
  refused(car);
}

}  // namespace
}  // namespace strata
