// The network by which maps name rooms, corridors and doorways, learned from drawn storeys:
//
//   learn_places [FILE]     judges a new one, and writes it to FILE:
//                           core/classification/places/learned_places.cc
//
// Of 184,148 samples in 48 storeys; some ten minutes of a processor. Prints how many cells of
// storeys that nothing was learned from are right, kind by kind. Ends with 1 if fewer than nine of
// ten are.
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

#include "core/classification/amn/amn_inference.h"
#include "core/classification/amn/amn_learning.h"
#include "core/classification/evaluation.h"
#include "core/classification/places/place_features.h"
#include "core/classification/places/place_model.h"
#include "core/common/stop.h"
#include "tests/experiments/classification/place_methods.h"
#include "tests/support/simulator/floor_plans.h"

namespace strata {
namespace {

using testing::Wing;

constexpr std::uint64_t kFirstTraining = 20001, kFirstTest = 30001;
constexpr int kStoreys = 48, kTestStoreys = 16;
constexpr double kCellsM[] = {0.1, 0.1, 0.05, 0.2};  // in turns
constexpr std::size_t kFeatures = 40;

template <typename T>
T Checked(absl::StatusOr<T> result) {
  if (result.ok()) return *std::move(result);
  std::fprintf(stderr, "%s\n", result.status().ToString().c_str());
  std::exit(2);
}

// The cells of several storeys, all features.
Wing Storeys(std::uint64_t first, int count, double cell_m = 0.0) {
  Wing all;
  all.data.classes = std::size(kPlaceKinds);
  for (int k = 0; k < count; ++k) {
    const testing::DrawnFloor floor = testing::DrawFloor(cell_m > 0.0 ? cell_m : kCellsM[k % 4],
                                                         first + static_cast<std::uint64_t>(k));
    const FreeSpace space = Checked(OpenSpace(floor.blocks, floor.cell_size_m));
    const PlaceSamples samples = Checked(PlaceSamples::Of(space));
    const FeatureMatrix features = Checked(PlaceFeatures(space, samples, {}, Stop()));
    const auto before = static_cast<std::uint32_t>(all.data.size());
    all.data.features.conservativeResize(before + features.rows(), features.cols());
    all.data.features.bottomRows(features.rows()) = features;
    const Eigen::Vector2i origin =
        (space.min_m() / space.cell_m()).array().round().matrix().cast<int>();
    for (std::uint32_t i = 0; i < samples.size(); ++i) {
      const Eigen::Vector2i cell = origin + samples.cell(i);
      all.data.labels.push_back(
          static_cast<ClassIndex>(static_cast<int>(*floor.KindAt(cell.x(), cell.y())) - 1));
    }
    for (const NetworkEdge& edge : samples.Edges()) {
      all.edges.push_back({before + edge.i, before + edge.j});
    }
  }
  return all;
}

PlaceModel Learn(Wing training) {
  const testing::FeatureChoice choice = testing::ChooseFeatures(training, kFeatures);
  testing::Apply(choice, training);
  const FeatureMatrix features = testing::WithConstant(training.data.features);
  const AmnLearning learned = Checked(
      LearnByCuttingPlanes({features, training.edges, training.data.labels, training.data.classes},
                           {.slack_weight = 1000.0, .tolerance = 3e-3, .max_iterations = 2000},
                           Stop()));
  std::fprintf(stderr, "%d cutting planes, %zu cells\n", learned.iterations, training.data.size());
  return {choice.columns, choice.mean, choice.deviation, learned.weights};
}

ConfusionMatrix Judge(const PlaceModel& model, const Wing& test) {
  FeatureMatrix features = test.data.features(Eigen::all, model.columns);
  features = StandardFeatures(model, std::move(features));
  const AmnLabels found =
      Checked(MaximizeScore(MakeAmnProblem(model.weights, features, test.edges), Stop()));
  ConfusionMatrix matrix(test.data.classes);
  matrix.Add(test.data.labels, found.labels);
  return matrix;
}

template <typename Values>
std::string Numbers(const Values& values, const char* format) {
  std::string text;
  for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(values.size()); ++i) {
    char number[40];
    std::snprintf(number, sizeof number, format, static_cast<double>(values[i]));
    text += std::string(i == 0 ? "" : ", ") + number;
  }
  return text;
}

std::string Source(const PlaceModel& model) {
  std::string weights;
  for (Eigen::Index k = 0; k < model.weights.node.rows(); ++k) {
    weights += "    {" + Numbers(Eigen::RowVectorXd(model.weights.node.row(k)), "%.9g") + "},\n";
  }
  return absl::StrCat(
      "// Written by tests/experiments/classification/learn_places.cc: learn_places FILE.\n"
      "#include <cstddef>\n#include <cstdint>\n#include <iterator>\n\n"
      "#include \"core/classification/places/place_model.h\"\n\n"
      "namespace strata {\nnamespace {\n\n"
      "constexpr int kPlaceColumns = ",
      model.columns.size(),
      ";\n"
      "constexpr std::uint32_t kPlaceColumn[kPlaceColumns] = {",
      Numbers(model.columns, "%.0f"),
      "};\n"
      "constexpr float kPlaceMean[kPlaceColumns] = {",
      Numbers(model.mean, "%#.9gF"),
      "};\n"
      "constexpr float kPlaceDeviation[kPlaceColumns] = {",
      Numbers(model.deviation, "%#.9gF"),
      "};\n"
      "constexpr double kPlaceNode[][kPlaceColumns + 1] = {\n",
      weights,
      "};\n"
      "constexpr double kPlaceEdge[] = {",
      Numbers(model.weights.edge, "%.9g"),
      "};\n\n"
      "PlaceModel LearnedModel() {\n"
      "  PlaceModel model;\n"
      "  model.columns.assign(kPlaceColumn, kPlaceColumn + kPlaceColumns);\n"
      "  model.mean = Eigen::Map<const Eigen::RowVectorXf>(kPlaceMean, kPlaceColumns);\n"
      "  model.deviation = Eigen::Map<const Eigen::RowVectorXf>(kPlaceDeviation, kPlaceColumns);\n"
      "  model.weights.node.resize(std::size(kPlaceNode), kPlaceColumns + 1);\n"
      "  for (std::size_t k = 0; k < std::size(kPlaceNode); ++k) {\n"
      "    model.weights.node.row(static_cast<Eigen::Index>(k)) =\n"
      "        Eigen::Map<const Eigen::RowVectorXd>(kPlaceNode[k], kPlaceColumns + 1);\n"
      "  }\n"
      "  model.weights.edge = Eigen::Map<const Eigen::VectorXd>(kPlaceEdge, "
      "std::size(kPlaceEdge));\n"
      "  return model;\n}\n\n"
      "}  // namespace\n\n"
      "const PlaceModel& LearnedPlaceModel() {\n"
      "  static const PlaceModel model = LearnedModel();\n"
      "  return model;\n}\n\n"
      "}  // namespace strata\n");
}

int Main(int argc, char** argv) {
  const PlaceModel model = Learn(Storeys(kFirstTraining, kStoreys));
  bool holds = true;
  for (const double cell_m : {0.05, 0.1, 0.2}) {
    const ConfusionMatrix matrix = Judge(model, Storeys(kFirstTest, kTestStoreys, cell_m));
    std::printf("cells of %.2f m: %.1f %% of cells right", cell_m, 100.0 * matrix.Accuracy());
    for (ClassIndex k = 0; k < std::size(kPlaceKinds); ++k) {
      std::printf("; %s found %.1f %%, right %.1f %%",
                  std::string(ToString(kPlaceKinds[k])).c_str(),
                  100.0 * matrix.Recall(k).value_or(0.0),
                  100.0 * matrix.Precision(k).value_or(0.0));
    }
    std::printf("\n");
    holds = holds && matrix.Accuracy() >= 0.9;
  }
  if (argc > 1) std::ofstream(argv[1]) << Source(model);
  std::printf("%s: nine cells of ten are right\n", holds ? "holds" : "FAILS");
  return holds ? 0 : 1;
}

}  // namespace
}  // namespace strata

int main(int argc, char** argv) { return strata::Main(argc, argv); }
