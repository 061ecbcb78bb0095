#include "core/completion/kinds.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/completion/kind_codec.h"
#include "tests/core/completion/planted_things.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::PlantedClass;
using ::strata::testing::PlantedClasses;
using ::strata::testing::PlantedOptions;
using ::strata::testing::PlantedThing;
using ::strata::testing::PlantThings;
using ::strata::testing::StatusIs;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

std::vector<FoundEntity> EntitiesOf(const std::vector<PlantedThing>& things) {
  std::vector<FoundEntity> entities;
  for (const PlantedThing& thing : things) entities.push_back(thing.entity);
  return entities;
}

SortedKinds Sort(const std::vector<FoundEntity>& entities,
                 const std::vector<ThingKind>& library = {}) {
  auto sorted =
      SortIntoKinds(entities, library, {}, Stop(), [](double) { return absl::OkStatus(); });
  STRATA_EXPECT_OK(sorted);
  return sorted.ok() ? *std::move(sorted) : SortedKinds();
}

// How many things are not in the kind that most of theirs are in, or share one with another kind.
std::size_t WronglySorted(const std::vector<PlantedThing>& things, const SortedKinds& sorted) {
  std::map<std::pair<std::uint16_t, std::size_t>, std::map<std::uint64_t, std::size_t>> ids;
  for (std::size_t i = 0; i < things.size(); ++i) {
    const auto& kind = sorted.of_entity[i];
    if (kind.has_value()) ++ids[{things[i].class_id, things[i].kind}][kind->id];
  }
  std::size_t right = 0;
  std::set<std::uint64_t> taken;
  for (const auto& [planted, counts] : ids) {
    const auto most =
        std::max_element(counts.begin(), counts.end(), [](const auto& a, const auto& b) {
          return a.second < b.second;
        });
    if (taken.insert(most->first).second) right += most->second;
  }
  return things.size() - right;
}

class PlantedKindsTest : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(PlantedKindsTest, AreFoundAsTheyWerePlanted) {
  SCOPED_TRACE(GetParam());
  const std::vector<PlantedThing> things = PlantThings(PlantedClasses(), {}, GetParam());
  const SortedKinds sorted = Sort(EntitiesOf(things));
  EXPECT_EQ(WronglySorted(things, sorted), 0U);
  EXPECT_THAT(sorted.found, SizeIs(8));
  for (std::size_t i = 0; i < things.size(); ++i) {
    if (sorted.of_entity[i].has_value()) continue;
    ADD_FAILURE() << "class " << things[i].class_id << " kind " << things[i].kind
                  << (things[i].partial ? " seen in part" : "") << " has none";
  }
}

TEST(KindsTest, WhatLiesFlatIsOfNone) {
  // Lines that a scanner draws on the ground.
  std::mt19937_64 random(20);
  std::uniform_real_distribution<double> shake(-0.01, 0.01);
  std::vector<FoundEntity> entities;
  for (int i = 0; i < 4; ++i) {
    std::vector<Eigen::Vector3d> points;
    for (int k = 0; k < 400; ++k) {
      points.emplace_back(
          20.0 * i + 0.1 * (k % 80), 0.3 * (k / 80) + shake(random), 0.3 * shake(random));
    }
    entities.push_back(testing::EntityOf(1, points));
  }
  SortedKinds sorted = Sort(entities);
  EXPECT_THAT(sorted.found, IsEmpty());
  for (const auto& kind : sorted.of_entity) EXPECT_FALSE(kind.has_value());
  // Upright they are fences.
  for (FoundEntity& entity : entities) {
    for (Eigen::Vector3d& p : entity.voxels) std::swap(p.y(), p.z());
    entity = testing::EntityOf(1, entity.voxels);
  }
  EXPECT_THAT(Sort(entities).found, SizeIs(1));
}

// Where one thing of a kind stands is where the kind's other things say it does: the kind's frame,
// moved to each, is the planted one moved by the same.
TEST_P(PlantedKindsTest, StandWhereTheyWerePlanted) {
  SCOPED_TRACE(GetParam());
  std::vector<PlantedClass> vans = {{3, {PlantedClasses()[0].kinds[1]}}};
  const std::vector<PlantedThing> things =
      PlantThings(vans, {.of_each = 4, .partial = 1}, GetParam());
  const SortedKinds sorted = Sort(EntitiesOf(things));
  ASSERT_THAT(sorted.found, SizeIs(1));
  std::vector<Pose> offsets;
  for (std::size_t i = 0; i < things.size(); ++i) {
    ASSERT_TRUE(sorted.of_entity[i].has_value());
    offsets.push_back(things[i].T_map_kind.inverse() * sorted.of_entity[i]->T_map_kind);
  }
  for (const Pose& offset : offsets) {
    const Pose apart = offsets.front().inverse() * offset;
    EXPECT_LT(apart.translation().norm(), 0.05);
    EXPECT_LT(RotationAngleRad(apart), 0.03);
  }
}

TEST_P(PlantedKindsTest, AreRecognisedByALibraryInAnotherMap) {
  SCOPED_TRACE(GetParam());
  const std::vector<PlantedThing> here = PlantThings(PlantedClasses(), {}, GetParam());
  const std::vector<ThingKind> library = Sort(EntitiesOf(here)).found;
  const std::vector<PlantedThing> there =
      PlantThings(PlantedClasses(), {.of_each = 2, .partial = 1}, GetParam() + 1000);
  const SortedKinds sorted = Sort(EntitiesOf(there), library);
  EXPECT_EQ(WronglySorted(there, sorted), 0U);
  EXPECT_THAT(sorted.found, IsEmpty());
  std::set<std::uint64_t> known;
  for (const ThingKind& kind : library) known.insert(kind.info.id);
  for (const auto& kind : sorted.of_entity) {
    EXPECT_TRUE(kind.has_value() && known.count(kind->id) == 1);
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, PlantedKindsTest, ::testing::Range<std::uint64_t>(1, 9));

TEST(KindsTest, AThingThatIsLikeNoOtherHasNone) {
  const std::vector<PlantedThing> things =
      PlantThings(PlantedClasses(), {.of_each = 1, .partial = 0}, 3);
  const SortedKinds sorted = Sort(EntitiesOf(things));
  EXPECT_THAT(sorted.found, IsEmpty());
  for (const auto& kind : sorted.of_entity) EXPECT_FALSE(kind.has_value());
}

// A tree stands before the middle of a window: what is to the right of it looks like a small one.
TEST(KindsTest, PiecesOfOneThingAreOfItsKindAndInItsPlace) {
  const auto box = [](double x0, double y0, double z0, double x1, double y1, double z1) {
    return Eigen::AlignedBox3d(Eigen::Vector3d(x0, y0, z0), Eigen::Vector3d(x1, y1, z1));
  };
  const testing::Solid large = {box(-0.95, -0.1, 0.0, 0.95, 0.1, 1.5),
                                box(-1.0, -0.25, 0.0, 1.0, -0.1, 0.1)};
  const testing::Solid small = {box(-0.3, -0.1, 0.0, 0.3, 0.1, 0.5),
                                box(-0.35, -0.25, 0.0, 0.35, -0.1, 0.1)};
  std::mt19937_64 random(7);
  PlantedOptions options;
  options.noise_m = 0.005;
  std::vector<FoundEntity> entities;
  const auto put = [&](const testing::Solid& solid, const Eigen::Vector3d& at, const auto& sees) {
    std::vector<Eigen::Vector3d> points;
    for (const Eigen::Vector3d& p : testing::SeenOf(solid, /*partial=*/false, options, random)) {
      if (sees(p)) points.push_back(p + at);
    }
    entities.push_back(testing::EntityOf(1, points));
  };
  const auto all = [](const Eigen::Vector3d&) { return true; };
  for (int k = 0; k < 4; ++k) {
    put(large, {3.0 * k, 0.0, 2.0}, all);
    put(small, {3.0 * k, 0.0, 0.5}, all);
  }
  const Eigen::Vector3d hidden(12.0, 0.0, 2.0);
  put(large, hidden, [](const Eigen::Vector3d& p) { return p.x() < 0.1; });
  put(large, hidden, [](const Eigen::Vector3d& p) { return p.x() > 0.4 && p.z() < 0.5; });
  const SortedKinds sorted = Sort(entities);
  EXPECT_THAT(sorted.found, SizeIs(2));
  ASSERT_TRUE(sorted.of_entity[0] && sorted.of_entity[8] && sorted.of_entity[9]);
  EXPECT_EQ(sorted.of_entity[8]->id, sorted.of_entity[0]->id);
  EXPECT_EQ(sorted.of_entity[9]->id, sorted.of_entity[0]->id);
  EXPECT_LT((sorted.of_entity[8]->T_map_kind.translation() -
             sorted.of_entity[9]->T_map_kind.translation())
                .norm(),
            0.1);
}

TEST(KindsTest, OrderOfPointsDoesNotMatterAndTheSameComesOutAgain) {
  const std::vector<PlantedThing> things = PlantThings(PlantedClasses(), {.of_each = 2}, 5);
  std::vector<FoundEntity> entities = EntitiesOf(things);
  const SortedKinds first = Sort(entities);
  std::mt19937_64 random(9);
  for (FoundEntity& entity : entities) {
    std::shuffle(entity.voxels.begin(), entity.voxels.end(), random);
  }
  const SortedKinds second = Sort(entities);
  ASSERT_EQ(first.found.size(), second.found.size());
  for (std::size_t i = 0; i < first.found.size(); ++i) {
    EXPECT_EQ(first.found[i].info.id, second.found[i].info.id);
    EXPECT_EQ(EncodeKindShape(first.found[i].shape), EncodeKindShape(second.found[i].shape));
  }
  for (std::size_t i = 0; i < entities.size(); ++i) {
    ASSERT_EQ(first.of_entity[i].has_value(), second.of_entity[i].has_value());
    if (!first.of_entity[i].has_value()) continue;
    EXPECT_EQ(first.of_entity[i]->T_map_kind.matrix(), second.of_entity[i]->T_map_kind.matrix());
  }
}

TEST(KindsTest, KindsOfAnotherClassAreNotTaken) {
  std::vector<PlantedThing> things = PlantThings(PlantedClasses(), {.of_each = 2, .partial = 0}, 6);
  std::vector<ThingKind> library = Sort(EntitiesOf(things)).found;
  for (ThingKind& kind : library) kind.info.class_id = 99;
  const SortedKinds sorted = Sort(EntitiesOf(things), library);
  EXPECT_THAT(sorted.found, SizeIs(8));
}

TEST(KindsTest, ItStopsWhenAsked) {
  const std::vector<PlantedThing> things = PlantThings(PlantedClasses(), {.of_each = 2}, 5);
  int calls = 0;
  const auto sorted =
      SortIntoKinds(EntitiesOf(things), {}, {}, Stop(), [&calls](double done) -> absl::Status {
        EXPECT_LE(done, 1.0);
        return ++calls < 3 ? absl::OkStatus() : absl::CancelledError("enough");
      });
  EXPECT_THAT(sorted, StatusIs(absl::StatusCode::kCancelled, HasSubstr("enough")));
  EXPECT_EQ(calls, 3);
  EXPECT_THAT(KindOptions{.tolerance_m = 0.0}.Validate(),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("tolerance_m")));
}

// Blocks put together at random: no two alike. Bounded work for each.
TEST(KindsTest, ManyThingsThatAreUnlikeTakeSecondsEach) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> edge(0.3, 1.5);
  std::uniform_real_distribution<double> place(-0.8, 0.8);
  std::vector<FoundEntity> entities;
  for (int i = 0; i < 300; ++i) {
    testing::Solid solid;
    for (int block = 0; block < 3; ++block) {
      Eigen::Vector3d low, size;
      for (double& x : low) x = place(random);
      for (double& x : size) x = edge(random);
      low.z() = std::max(0.0, low.z());
      solid.emplace_back(low, low + size);
    }
    entities.push_back(testing::EntityOf(3, testing::SeenOf(solid, false, {}, random)));
  }
  const SortedKinds sorted = Sort(entities);
  std::size_t kinds = 0;
  for (const auto& kind : sorted.of_entity) kinds += kind.has_value() ? 1 : 0;
  EXPECT_LE(kinds, 15U);  // by chance
}

}  // namespace
}  // namespace strata
