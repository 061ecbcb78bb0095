// strata classifier train, evaluate and apply on bare files, as their users run them.
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "client/formats/file_bytes.h"
#include "client/formats/geometry_writer.h"
#include "client/formats/scan_reader.h"
#include "core/classification/classifier_codec.h"
#include "core/common/random.h"
#include "tests/client/cli/run_strata.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr char kClasses[] = "floor=11,12;wall=40";

// A noisy floor of two labels with a wall across it, and a few points of a label that is no class.
PointCloud Yard(std::uint64_t seed) {
  SplitMix64 random(seed);
  const auto in = [&random](double low, double high) {
    return low + (high - low) * random.Below(1U << 20) / (1 << 20);
  };
  PointCloud cloud;
  const auto add = [&cloud](double x, double y, double z, std::uint16_t label) {
    cloud.points.emplace_back(Eigen::Vector3d(x, y, z).cast<float>());
    cloud.label.push_back(label);
  };
  const double wall = in(2.0, 6.0);
  for (int k = 0; k < 1500; ++k) {
    const double x = in(0.0, 8.0);
    add(x, in(0.0, 6.0), in(-0.01, 0.01), x < 4.0 ? 11 : 12);
  }
  for (int k = 0; k < 900; ++k) add(wall + in(-0.01, 0.01), in(0.0, 6.0), in(0.3, 2.5), 40);
  for (int k = 0; k < 20; ++k) add(in(0, 8), in(0, 6), in(3, 4), 99);
  return cloud;
}

class ClassifierFilesTest : public ::testing::Test {
 protected:
  std::string Path(const std::string& name) const { return (dir_.path() / name).string(); }
  std::string WriteYard(std::uint64_t seed) const {
    const std::string path = Path("yard" + std::to_string(seed) + ".ply");
    STRATA_EXPECT_OK(WriteFileBytes(path, *PlyBytes(GeometryOf(Yard(seed)))));
    return path;
  }
  json Train(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments = {"classifier",
                                          "train",
                                          "--out",
                                          model_,
                                          "--output",
                                          "json",
                                          "--data",
                                          WriteYard(1),
                                          WriteYard(2)};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Ran ran = RunStrata(arguments);
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    return ran.exit_code == 0 ? json::parse(ran.out) : json();
  }

  testing::TempDir dir_;
  std::string model_ = Path("yard.model");
};

TEST_F(ClassifierFilesTest, TrainsEvaluatesAndLabels) {
  const json trained = Train({"--classes", kClasses, "--method", "bayes", "--folds", "2"});
  EXPECT_EQ(trained["method"], "bayes");
  EXPECT_EQ(trained["points_seen"], 4800);
  EXPECT_EQ(trained["classes"], json::parse(R"([{"id":1,"name":"floor","points":3000},
                            {"id":2,"name":"wall","points":1800}])"));
  EXPECT_EQ(trained["validation"]["points"], 4800);
  EXPECT_GT(trained["validation"]["accuracy"], 0.95);

  const Ran ran = RunStrata({"classifier",
                             "evaluate",
                             model_,
                             "--data",
                             WriteYard(3),
                             "--classes",
                             kClasses,
                             "--picture",
                             Path("confusion.png"),
                             "--output",
                             "json"});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const json scores = json::parse(ran.out);
  EXPECT_GT(scores["accuracy"], 0.95);
  EXPECT_GT(scores["mean_iou"], 0.9);
  ASSERT_THAT(scores["per_class"], SizeIs(2));
  EXPECT_EQ(scores["per_class"][1]["name"], "wall");
  EXPECT_EQ(scores["per_class"][1]["support"], 900);
  // The numbers are those of the confusion.
  const auto count = [&](int truth, int given) {
    return scores["confusion"][truth][given].get<double>();
  };
  EXPECT_EQ(count(0, 0) + count(0, 1), 1500);
  EXPECT_DOUBLE_EQ(scores["accuracy"], (count(0, 0) + count(1, 1)) / 2400);
  EXPECT_DOUBLE_EQ(scores["per_class"][1]["recall"], count(1, 1) / 900);
  EXPECT_DOUBLE_EQ(scores["per_class"][1]["iou"], count(1, 1) / (900 + count(0, 1)));
  EXPECT_GT(std::filesystem::file_size(Path("confusion.png")), 500U);

  for (const std::string ending : {"ply", "pcd"}) {
    const std::string out = Path("labelled." + ending);
    const Ran applied =
        RunStrata({"classifier", "apply", model_, "--data", WriteYard(3), "--out", out});
    ASSERT_EQ(applied.exit_code, 0) << applied.err;
    STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud labelled, ReadScan(out));
    const PointCloud yard = Yard(3);
    ASSERT_EQ(labelled.points, yard.points);
    double right = 0;
    for (std::size_t i = 0; i < 2400; ++i) {
      right += labelled.label[i] == (yard.label[i] == 40 ? 2 : 1) ? 1 : 0;
    }
    EXPECT_DOUBLE_EQ(right / 2400, scores["accuracy"]);
  }
}

TEST_F(ClassifierFilesTest, WithoutClassesEveryLabelIsOne) {
  const json trained = Train({"--method", "knn", "--reduce", "random=300"});
  ASSERT_THAT(trained["classes"], SizeIs(4));
  EXPECT_EQ(trained["classes"][3]["name"], "99");
  EXPECT_EQ(trained["points_kept"], 600);
  const Ran ran = RunStrata({"classifier", "evaluate", model_, "--data", WriteYard(3)});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("CLASS  PRECISION"));
  EXPECT_THAT(ran.out, HasSubstr("over 2420 points"));
}

TEST_F(ClassifierFilesTest, SetReachesEveryNumberOfFeaturesAndNetworks) {
  Train({"--set", "voxel_m=0.3", "--set", "feature_neighbours=8", "--set", "network_degree=2"});
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string bytes, ReadFileBytes(model_));
  STRATA_ASSERT_OK_AND_ASSIGN(const Classifier classifier, DecodeClassifier(bytes));
  EXPECT_EQ(classifier.features.voxel_m, 0.3);
  EXPECT_EQ(classifier.features.neighbours, 8);
  EXPECT_EQ(classifier.network.max_degree, 2);
  const auto refused = [this](const std::string& set, const std::string& message) {
    const Ran ran =
        RunStrata({"classifier", "train", "--data", WriteYard(1), "--out", model_, "--set", set});
    EXPECT_EQ(ran.exit_code, 2);
    EXPECT_THAT(ran.err, HasSubstr(message));
  };
  refused("voxel_m=11", "voxel_m = '11' is not in [0.01, 10]");
  refused("voxels=0.2", "'voxels' is unknown; train takes name method");
  refused("folds=3", "use --folds for folds");
  EXPECT_THAT(RunStrata({"classifier", "train", "--help"}).out,
              HasSubstr("  spin_radius_m=0..100  spin: radius [m]"));
}

TEST_F(ClassifierFilesTest, ErrorsNameTheFileAndTheCure) {
  Train({"--classes", kClasses, "--method", "bayes"});
  const auto expect = [](const std::vector<std::string>& arguments, const std::string& message) {
    const Ran ran = RunStrata(arguments);
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_THAT(ran.err, HasSubstr(message));
  };
  const std::string bare = Path("bare.xyz");
  STRATA_ASSERT_OK(WriteFileBytes(bare, "1 2 3\n4 5 6\n"));
  const std::string yard = WriteYard(1);
  expect({"classifier", "train", "--data", bare, "--out", model_},
         "bare.xyz: points have no label");
  expect({"classifier", "train", "--data", yard, "--classes", "sky=7;floor=11", "--out", model_},
         "no point is labelled sky");
  expect(
      {"classifier", "train", "--data", yard, "--folds", "2", "--method", "bayes", "--out", model_},
      "folds 2 is not in [2, 1]");
  expect({"classifier", "evaluate", yard, "--data", yard}, "yard1.ply: ");
  expect({"classifier", "evaluate", model_, "--data", yard}, "--classes says which labels");
  expect({"classifier", "evaluate", model_, "--data", yard, "--classes", "sky=11"},
         "class sky is none of the classifier's: floor, wall");
  expect({"classifier", "apply", model_, "--data", yard, "--out", Path("labelled.las")},
         "written as .ply or .pcd");
  for (const char* verb : {"train", "evaluate", "apply"}) {
    const Ran help = RunStrata({"classifier", verb, "--help"});
    EXPECT_EQ(help.exit_code, 0);
    EXPECT_THAT(help.out, HasSubstr(std::string("Example:\n  strata classifier ") + verb));
  }
  EXPECT_EQ(
      RunStrata({"classifier", "train", "--data", yard, "--method", "forest", "--out", model_})
          .exit_code,
      2);
}

}  // namespace
}  // namespace strata::cli
