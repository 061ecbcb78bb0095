// strata kind, on a database that the test decides on.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/objects/kind_files.h"
#include "client/formats/file_bytes.h"
#include "core/completion/kind_codec.h"
#include "tests/client/cli/commands_fixture.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::HasSubstr;
using Code = absl::StatusCode;

// A cube of 1 m, as text.
constexpr char kCubeObj[] =
    "v 5 5 2\nv 6 5 2\nv 6 6 2\nv 5 6 2\nv 5 5 3\nv 6 5 3\nv 6 6 3\nv 5 6 3\n"
    "f 1 2 3\nf 1 3 4\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\n"
    "f 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 5 8\n";

class KindCommandsTest : public CommandsTest {
 protected:
  void SetUp() override {
    golf_.info.id = 0xabcdef012345;
    golf_.info.name = "golf";
    golf_.info.class_id = 7;
    golf_.info.origin = KindOrigin::kNamed;
    golf_.info.size = {4.0, 2.0, 1.5};
    golf_.info.entities = 3;
    for (int i = 0; i < 30; ++i)
      golf_.shape.points.emplace_back(0.1F * static_cast<float>(i), 0, 0);
    ON_CALL(db_.objects(), ListKinds(_, _)).WillByDefault([&](auto&, auto) {
      return absl::StatusOr<std::vector<KindInfo>>({golf_.info});
    });
    ON_CALL(db_.objects(), GetKind(_, _, _)).WillByDefault([&](auto&, auto, auto) {
      return absl::StatusOr<ThingKind>(golf_);
    });
    ON_CALL(db_.objects(), RenameKind(_, _, _, _)).WillByDefault([&](auto&, auto, auto, auto name) {
      golf_.info.name = std::string(name);
      return absl::StatusOr<KindInfo>(golf_.info);
    });
    ON_CALL(db_.objects(), ImportKind(_, _, _))
        .WillByDefault([&](auto&, auto, const NewKind& kind) {
          imported_ = kind;
          return absl::StatusOr<KindInfo>(golf_.info);
        });
    ON_CALL(db_.maps(), ListClasses(_, _)).WillByDefault([](auto&, auto) {
      return absl::StatusOr<std::vector<MapClass>>({{7, "car", {200, 0, 0}}});
    });
  }

  ThingKind golf_;
  NewKind imported_;
  ::strata::testing::TempDir directory_;
};

TEST_F(KindCommandsTest, AreListedAndRenamed) {
  const Json all = RunJson({"kind", "list", "m"});
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(all[0]["id"], "abcdef012345");
  EXPECT_EQ(all[0]["class"], "car");
  EXPECT_EQ(all[0]["origin"], "named");
  EXPECT_EQ(all[0]["entities"], 3);
  EXPECT_THAT(RunText({"kind", "list", "m"}), HasSubstr("golf"));
  EXPECT_EQ(RunJson({"kind", "rename", "m", "abcd", "polo"})["name"], "polo");
  EXPECT_CALL(db_.objects(), DeleteKind(_, absl::string_view("m"), absl::string_view("polo")))
      .WillOnce(::testing::Return(absl::OkStatus()));
  EXPECT_EQ(RunJson({"kind", "delete", "m", "polo", "--yes"})["deleted"], "polo");
}

TEST_F(KindCommandsTest, GoFromMapToMapAsFiles) {
  const std::string file = (directory_.path() / "golf.kind").string();
  EXPECT_EQ(RunJson({"kind", "export", "m", "golf", file})["class"], "car");
  RunJson({"kind", "import", "m", file});
  EXPECT_EQ(imported_.name, "golf");
  EXPECT_EQ(imported_.class_name, "car");
  EXPECT_EQ(imported_.shape, golf_.shape);
  RunJson({"kind", "import", "m", file, "--name", "polo", "--class", "vehicle"});
  EXPECT_EQ(imported_.name, "polo");
  EXPECT_EQ(imported_.class_name, "vehicle");
  STRATA_ASSERT_OK_AND_ASSIGN(std::string bytes, ReadFileBytes(file));
  bytes[bytes.size() / 2] ^= 1;
  STRATA_ASSERT_OK(WriteFileBytes(file, bytes));
  EXPECT_THAT(Run({"kind", "import", "m", file}),
              StatusIs(Code::kInvalidArgument, HasSubstr("golf.kind")));
  EXPECT_THAT(Run({"kind", "export", "m", "golf", file + ".txt"}),
              StatusIs(Code::kInvalidArgument, HasSubstr(".kind")));
}

TEST_F(KindCommandsTest, AreWrittenAsMeshes) {
  ON_CALL(db_.objects(), ListEntities(_, _, _, _)).WillByDefault([](auto&, auto, auto&, auto) {
    return absl::StatusOr<EntitiesInfo>(absl::NotFoundError("no entities"));
  });
  ON_CALL(db_.maps(), Get(_, _)).WillByDefault([](auto&, auto) {
    return absl::StatusOr<MapInfo>(MapInfo());
  });
  golf_.shape.points.clear();
  for (int i = 0; i < 900; ++i) {
    golf_.shape.points.emplace_back(
        0.03F * static_cast<float>(i % 30), 0.03F * static_cast<float>(i / 30), 0.0F);
  }
  const std::string file = (directory_.path() / "golf.ply").string();
  const Json contour = RunJson({"kind", "export", "m", "golf", file});
  EXPECT_EQ(contour["method"], "contour");
  EXPECT_EQ(contour["closed"], true);
  EXPECT_GT(contour["area_m2"].get<double>(), 1.5);  // of both sides
  golf_.shape.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  golf_.shape.triangles = {{0, 1, 2}};
  const Json imported = RunJson({"kind", "export", "m", "golf", file});
  EXPECT_EQ(imported["method"], "imported");
  EXPECT_EQ(imported["triangles"], 1);
  EXPECT_THAT(Run({"kind", "export", "m", "golf", file + ".fbx"}),
              StatusIs(Code::kInvalidArgument, HasSubstr(".glb")));
}

TEST_F(KindCommandsTest, MeshesAreKinds) {
  const std::string file = (directory_.path() / "cube.obj").string();
  STRATA_ASSERT_OK(WriteFileBytes(file, kCubeObj));
  EXPECT_THAT(Run({"kind", "import", "m", file}),
              StatusIs(Code::kInvalidArgument, HasSubstr("--name")));
  RunJson({"kind", "import", "m", file, "--name", "cube", "--class", "crate", "--scale", "0.5"});
  EXPECT_EQ(imported_.name, "cube");
  EXPECT_EQ(imported_.shape.triangles.size(), 12U);
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : imported_.shape.points) box.extend(p);
  EXPECT_LT((box.sizes() - Eigen::Vector3f(0.5F, 0.5F, 0.5F)).norm(), 0.05F);
  EXPECT_NEAR(box.min().z(), 0.0F, 0.02F);
  EXPECT_NEAR(box.center().x(), 0.0F, 0.02F);
  const double of_each = 6.0 * 0.25 / static_cast<double>(imported_.shape.points.size());
  EXPECT_NEAR(of_each, 0.03 * 0.03, 1e-4);
  EXPECT_THAT(Run({"kind", "import", "m", file + "x"}),
              StatusIs(Code::kInvalidArgument, HasSubstr(".stl")));
}

}  // namespace
}  // namespace strata::cli
