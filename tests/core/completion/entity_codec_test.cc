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
