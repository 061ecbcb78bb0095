// Classes, labels and classifiers of a map from the command line, on a database in a temporary
// directory.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "client/formats/geometry_writer.h"
#include "client/formats/scan_reader.h"
#include "tests/client/cli/run_strata.h"
#include "tests/support/simulator/park.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

class ClassifierMapsTest : public ::testing::Test {
 protected:
  // A map of two labelled parks, t/0 and t/1, and one without labels, t/2.
  void SetUp() override {
    std::string poses;
    for (int i = 0; i < 3; ++i) {
      PointCloud park = testing::MakePark(static_cast<std::uint64_t>(i) + 1);
      if (i == 2) park.label.clear();
      Write("scans/scan" + std::to_string(i) + ".ply", *PlyBytes(GeometryOf(park)));
      poses += std::to_string(i) + " " + std::to_string(100 + i) + " " + std::to_string(10 * i) +
               " 0 0 0 0 0 1\n";
    }
    RunOk({"map", "create", "m"});
    RunOk({"scan",
           "import",
           "m",
           Path("scans"),
           "--poses",
           Write("poses.txt", poses),
           "--trajectory",
           "t",
           "--align",
           "off",
           "--wait"});
  }
  Ran Run(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--embedded", Path("maps"), "--output", "json"});
    return RunStrata(arguments);
  }
  json RunOk(const std::vector<std::string>& arguments) const {
    const Ran ran = Run(arguments);
    EXPECT_EQ(ran.exit_code, 0) << ::testing::PrintToString(arguments) << ran.err;
    return json::parse(ran.out, nullptr, false);
  }
  std::string Path(const std::string& name) const { return (dir_.path() / name).string(); }
  std::string Write(const std::string& name, const std::string& bytes) const {
    std::filesystem::create_directories(std::filesystem::path(Path(name)).parent_path());
    std::ofstream(Path(name), std::ios::binary) << bytes;
    return Path(name);
  }

  testing::TempDir dir_;
};

TEST_F(ClassifierMapsTest, TrainsClassifiesScoresAndTakesElsewhere) {
  const json classes =
      RunOk({"map", "classes", "m", "--set", "1=ground", "--set", "2=pole:#102030"});
  ASSERT_EQ(classes.size(), 2U);
  EXPECT_EQ(classes[1]["colour"], "#102030");
  const json trained = RunOk({"classifier",
                              "train",
                              "m",
                              "--method",
                              "bayes",
                              "--reduce",
                              "random=500",
                              "--name",
                              "park",
                              "--wait"});
  EXPECT_EQ(trained["state"], "succeeded");
  EXPECT_GT(trained["metrics"]["accuracy"], 0.9);
  EXPECT_EQ(RunOk({"classifier", "list", "m"})[0]["name"], "park");
  EXPECT_EQ(RunOk({"classifier", "show", "m", "park"})["parameters"]["reduce"], "random=500");
  RunOk({"job", "start", "m", "classify", "model=park", "--wait"});
  EXPECT_EQ(RunOk({"scan", "show", "m", "t/2"})["label_model"], 1);
  const json scores = RunOk({"classifier", "evaluate", "m", "park"});
  EXPECT_GT(scores["accuracy"], 0.9);
  EXPECT_EQ(scores["per_class"][0]["name"], "ground");
  EXPECT_EQ(scores["confusion"].size(), 2U);
  RunOk({"classifier", "export", "m", "park", "--out", Path("park.model")});
  EXPECT_GT(RunOk({"classifier",
                   "evaluate",
                   Path("park.model"),
                   "--data",
                   Path("scans/scan0.ply")})["accuracy"],
            0.9);
  RunOk({"map", "create", "n"});
  RunOk({"classifier", "import", "n", Path("park.model"), "--name", "other"});
  EXPECT_EQ(RunOk({"map", "classes", "n"})[1]["name"], "pole");
  RunOk({"classifier", "delete", "m", "park"});
  EXPECT_EQ(RunOk({"classifier", "list", "m"}).size(), 0U);
  RunOk({"map", "verify", "m"});
}

TEST_F(ClassifierMapsTest, ScansAreLabelledByBoxPolygonAndFile) {
  RunOk({"map", "classes", "m", "--set", "7=sky"});
  // t/2 lies at x = 20; points above 2 m are of poles.
  const json box =
      RunOk({"scan", "label", "m", "t/2", "--box", "16,-4,2,24,4,9", "--class", "sky"});
  EXPECT_GT(box["labelled"], 100);
  const json polygon = RunOk({"scan",
                              "label",
                              "m",
                              "t/2",
                              "--polygon",
                              "15,-5,25,-5,20,5",
                              "--z",
                              "-1,0.5",
                              "--class",
                              "3"});
  EXPECT_GT(polygon["labelled"], 300);
  EXPECT_LT(polygon["labelled"], 1500);
  EXPECT_EQ(RunOk({"scan", "show", "m", "t/2"})["person_labels"], true);
  RunOk({"scan", "export", "m", "t/2", "--format", "ply", "--out", Path("labelled.ply")});
  const json again = RunOk({"scan", "label", "m", "t/2", "--from", Path("labelled.ply")});
  EXPECT_EQ(again["labelled"], box["labelled"].get<int>() + polygon["labelled"].get<int>());
  const Ran other = Run({"scan", "label", "m", "t/2", "--from", Path("scans/scan2.ply")});
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.err, HasSubstr("no label"));
  EXPECT_EQ(Run({"scan", "label", "m", "t/2", "--class", "sky"}).exit_code, 2);
  const Ran unknown = Run({"scan", "label", "m", "t/2", "--box", "0,0,0,1,1,1", "--class", "sea"});
  EXPECT_THAT(unknown.err, HasSubstr("there is sky"));
  RunOk({"map", "verify", "m"});
}

// Files that people have call the ground 1200 and poles 1103, as Oakland does.
TEST_F(ClassifierMapsTest, ImportMapsLabelsOfFilesToClassesOfTheMap) {
  PointCloud park = testing::MakePark(9);
  for (std::uint16_t& label : park.label) label = label == testing::kParkGround ? 1200 : 1103;
  const std::string file = Write("elsewhere/scan9.ply", *PlyBytes(GeometryOf(park)));
  const auto import = [&](const std::string& map, const std::vector<std::string>& more) {
    std::vector<std::string> words = {"scan", "import", map, file, "--trajectory", "e", "--wait"};
    words.insert(words.end(), more.begin(), more.end());
    return Run(words);
  };
  const Ran refused = import("m", {});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, HasSubstr("label 1200 of point 0"));
  EXPECT_THAT(refused.err, HasSubstr("--classes"));
  // Named classes keep their ids, others are added.
  RunOk({"map", "classes", "m", "--set", "1=pole"});
  const Ran done = import("m", {"--classes", "ground=1200;pole=1103,1104"});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  const json classes = RunOk({"map", "classes", "m"});
  ASSERT_EQ(classes.size(), 2U);
  EXPECT_EQ(classes[0]["name"], "pole");
  EXPECT_EQ(classes[1]["id"], 2);
  EXPECT_EQ(classes[1]["name"], "ground");
  RunOk({"scan", "export", "m", "e/9", "--format", "ply", "--out", Path("back.ply")});
  const auto back = ReadScan(Path("back.ply"));
  ASSERT_TRUE(back.ok());
  ASSERT_EQ(back->label.size(), park.size());
  for (std::size_t i = 0; i < park.size(); ++i) {
    ASSERT_EQ(back->label[i], park.label[i] == 1200 ? 2 : 1);
  }
  RunOk({"map", "create", "bare"});
  EXPECT_EQ(import("bare", {"--no-labels"}).exit_code, 0);
  EXPECT_EQ(RunOk({"map", "classes", "bare"}).size(), 0U);
  EXPECT_EQ(import("bare", {"--no-labels", "--classes", "a=1"}).exit_code, 2);
}

}  // namespace
}  // namespace strata::cli
