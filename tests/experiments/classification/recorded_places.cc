// Places of a recorded building (thesis 9.4.4, Fig. 9.6: 92.2, 89.8 and 95.5 % of the cells of such
// a map right by NN, AMN and iAMN): Freiburg's building 079, its two halves drawn apart by
// fr079_places.txt. Learned on either half and asked about the other; and as maps are named, by
// what was learned from drawn storeys alone.
//
//   recorded_places
//
// Ends with 1 if what must hold does not, with 77 where the recording is absent.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <numbers>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <bzlib.h>

#include "core/classification/evaluation.h"
#include "core/classification/places/place_features.h"
#include "core/classification/places/place_model.h"
#include "core/common/stop.h"
#include "tests/experiments/classification/classification_cases.h"
#include "tests/experiments/classification/place_methods.h"
#include "tests/support/data_dir.h"
#include "tests/support/paths.h"

namespace strata {
namespace {

using Eigen::Vector2d;
using testing::Method;
using testing::Wing;

constexpr double kCellM = 0.1;
constexpr double kFarthestM = 12.0;  // ends of beams beyond are not drawn
constexpr double kShortOfEndM = 0.25;
constexpr double kHitShare = 0.12;  // of what met a cell: then something stands there
constexpr double kRadiusM = 0.2;
constexpr int kLeastPasses = 3;
// What must hold of all cells together, and beside the thesis.
constexpr double kLeast = 0.9;
constexpr double kBesideThesis = 0.01;

int failures = 0;
void Expect(bool holds, const std::string& what) {
  std::printf("%s: %s\n", holds ? "holds" : "FAILS", what.c_str());
  failures += holds ? 0 : 1;
}

template <typename T>
T Checked(absl::StatusOr<T> result) {
  if (result.ok()) return *std::move(result);
  std::fprintf(stderr, "%s\n", result.status().ToString().c_str());
  std::exit(2);
}

// --- What was recorded, and what we drew over it -----------------------------------------------

struct Area {
  PlaceKind kind;
  std::vector<Vector2d> corners;

  bool Contains(const Vector2d& p) const {
    bool inside = false;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Vector2d& a = corners[i];
      const Vector2d& b = corners[(i + 1) % corners.size()];
      if ((a.y() > p.y()) == (b.y() > p.y())) continue;
      if (p.x() < a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x())) inside = !inside;
    }
    return inside;
  }
};

struct Drawing {
  std::vector<Area> areas;
  std::vector<std::size_t> scans;
  double split_x_m = 0.0;

  // Doorways lie over rooms and corridors.
  std::optional<PlaceKind> KindAt(const Vector2d& p) const {
    std::optional<PlaceKind> kind;
    for (const Area& area : areas) {
      if (area.Contains(p)) kind = std::max(area.kind, kind.value_or(area.kind));
    }
    return kind;
  }
};

Drawing ReadDrawing(const std::filesystem::path& file) {
  const std::map<std::string, PlaceKind> kinds = {{"room", PlaceKind::kRoom},
                                                  {"corridor", PlaceKind::kCorridor},
                                                  {"doorway", PlaceKind::kDoorway}};
  Drawing drawing;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string what;
    words >> what;
    const std::vector<double> numbers{std::istream_iterator<double>(words), {}};
    if (what == "split") drawing.split_x_m = numbers.at(0);
    if (what == "scan") {
      for (const double n : numbers) drawing.scans.push_back(static_cast<std::size_t>(n));
    }
    if (!kinds.contains(what)) continue;
    Area& area = drawing.areas.emplace_back(Area{kinds.at(what), {}});
    for (std::size_t i = 0; i + 1 < numbers.size(); i += 2) {
      area.corners.emplace_back(numbers[i], numbers[i + 1]);
    }
  }
  return drawing;
}

std::string Unzipped(const std::filesystem::path& file) {
  std::string text;
  BZFILE* in = BZ2_bzopen(file.c_str(), "rb");
  std::vector<char> buffer(1 << 20);
  for (int n = 0; in != nullptr && (n = BZ2_bzread(in, buffer.data(), 1 << 20)) > 0;) {
    text.append(buffer.data(), static_cast<std::size_t>(n));
  }
  if (in != nullptr) BZ2_bzclose(in);
  return text;
}

// Of every FLASER line: half a turn of beams from the right [m].
std::vector<std::vector<double>> ReadRanges(const std::string& text) {
  std::vector<std::vector<double>> scans;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with("FLASER ")) continue;
    std::istringstream words(line.substr(7));
    std::size_t count = 0;
    words >> count;
    std::vector<double>& ranges = scans.emplace_back(std::min<std::size_t>(count, 10000));
    for (double& range : ranges) words >> range;
  }
  return scans;
}

struct PlanarPose {
  Vector2d at;
  double heading_rad;
};

std::vector<PlanarPose> ReadPoses(const std::filesystem::path& file) {
  std::map<int, PlanarPose> poses;  // by number
  std::ifstream in(file);
  int number = 0;
  PlanarPose pose;
  while (in >> number >> pose.at.x() >> pose.at.y() >> pose.heading_rad) poses[number] = pose;
  std::vector<PlanarPose> sorted;
  for (const auto& [n, p] : poses) sorted.push_back(p);
  return sorted;
}

// --- The building as a floor's grid ------------------------------------------------------------

// How often beams ended in cells and went through them.
class Beams {
 public:
  static constexpr int kColumns = 440, kRows = 216;   // whole blocks
  static constexpr int kBlockX = -33, kBlockY = -13;  // of the first column and row

  void Add(const PlanarPose& pose, const std::vector<double>& ranges) {
    for (std::size_t i = 0; i < ranges.size(); ++i) {
      const double angle =
          pose.heading_rad +
          std::numbers::pi * (static_cast<double>(i) / static_cast<double>(ranges.size()) - 0.5);
      const Vector2d along(std::cos(angle), std::sin(angle));
      if (ranges[i] > 30.0) continue;  // nothing came back
      const double end = std::min(ranges[i], kFarthestM) - kShortOfEndM;
      for (double r = 0.0; r < end; r += 0.5 * kCellM) Count(passes_, pose.at + r * along, 0.5);
      if (ranges[i] < kFarthestM) Count(hits_, pose.at + ranges[i] * along, 1.0);
    }
  }

  std::vector<FloorBlock> Blocks() const {
    std::vector<FloorBlock> blocks;
    for (int y = 0; y < kRows / kFloorBlockCells; ++y) {
      for (int x = 0; x < kColumns / kFloorBlockCells; ++x) {
        FloorBlock block = {kBlockX + x, kBlockY + y, 0, 0, 0};
        for (int cell = 0; cell < kFloorBlockCells * kFloorBlockCells; ++cell) {
          const int column = x * kFloorBlockCells + cell % kFloorBlockCells;
          const int row = y * kFloorBlockCells + cell / kFloorBlockCells;
          const std::uint64_t bit = std::uint64_t{1} << cell;
          if (Stands(column, row)) {
            block.occupied |= bit;
          } else if (Seen(column, row)) {
            (Clear(column, row) ? block.free : block.ground) |= bit;
          }
        }
        blocks.push_back(block);
      }
    }
    return blocks;
  }

 private:
  static std::size_t At(int column, int row) {
    return static_cast<std::size_t>(row) * kColumns + static_cast<std::size_t>(column);
  }
  static void Count(std::vector<double>& cells, const Vector2d& p, double by) {
    const int column = static_cast<int>(std::floor(p.x() / kCellM)) - kBlockX * kFloorBlockCells;
    const int row = static_cast<int>(std::floor(p.y() / kCellM)) - kBlockY * kFloorBlockCells;
    if (std::min(column, row) < 0 || column >= kColumns || row >= kRows) return;
    cells[At(column, row)] += by;
  }
  bool Stands(int column, int row) const {
    const double hits = hits_[At(column, row)];
    return hits > 1.0 && hits > kHitShare * (hits + passes_[At(column, row)]);
  }
  bool Seen(int column, int row) const {
    return hits_[At(column, row)] + passes_[At(column, row)] >= kLeastPasses;
  }
  bool Clear(int column, int row) const {
    const int reach = static_cast<int>(kRadiusM / kCellM);
    for (int dy = -reach; dy <= reach; ++dy) {
      for (int dx = -reach; dx <= reach; ++dx) {
        const int x = column + dx;
        const int y = row + dy;
        if (std::hypot(dx, dy) * kCellM > kRadiusM) continue;
        if (std::min(x, y) < 0 || x >= kColumns || y >= kRows || Stands(x, y) || !Seen(x, y)) {
          return false;
        }
      }
    }
    return true;
  }

  std::vector<double> hits_ = std::vector<double>(std::size_t{kColumns} * kRows, 0.0);
  std::vector<double> passes_ = hits_;
};

// --- Halves, and what is said of them ----------------------------------------------------------

// The labelled cells of one half, all features.
Wing HalfOf(const FreeSpace& space,
            const PlaceSamples& samples,
            const FeatureMatrix& features,
            const Drawing& drawing,
            bool west) {
  std::vector<std::uint32_t> number(samples.size(), PlaceSamples::kNone);
  std::vector<std::uint32_t> rows;
  Wing wing;
  wing.data.classes = std::size(kPlaceKinds);
  for (std::uint32_t i = 0; i < samples.size(); ++i) {
    const Vector2d p =
        space.min_m() + kCellM * (samples.cell(i).cast<double>() + Vector2d(0.5, 0.5));
    const std::optional<PlaceKind> kind = drawing.KindAt(p);
    if (!kind.has_value() || (p.x() < drawing.split_x_m) != west) continue;
    number[i] = static_cast<std::uint32_t>(rows.size());
    rows.push_back(i);
    wing.data.labels.push_back(static_cast<ClassIndex>(static_cast<int>(*kind) - 1));
  }
  wing.data.features = features(rows, Eigen::all);
  for (const NetworkEdge& edge : samples.Edges()) {
    if (std::max(number[edge.i], number[edge.j]) == PlaceSamples::kNone) continue;
    wing.edges.push_back({number[edge.i], number[edge.j]});
  }
  return wing;
}

ConfusionMatrix Learned(Wing training, Wing test, Method method) {
  const testing::FeatureChoice choice = testing::ChooseFeatures(training, testing::kPlaceFeatures);
  for (Wing* wing : {&training, &test}) testing::Apply(choice, *wing);
  ConfusionMatrix matrix(test.data.classes);
  matrix.Add(test.data.labels, testing::LabelPlaces(training, test, method));
  return matrix;
}

void JudgeHalves(const Wing& west, const Wing& east) {
  const double thesis[] = {
      testing::kThesisPlaces.nearest, testing::kThesisPlaces.amn, testing::kThesisPlaces.iamn};
  std::printf("\n| learned on | NN | AMN | iAMN |\n|---|---|---|---|\n");
  ConfusionMatrix both[] = {ConfusionMatrix(3), ConfusionMatrix(3), ConfusionMatrix(3)};
  for (const bool on_west : {true, false}) {
    std::printf("| the %s |", on_west ? "west" : "east");
    for (const Method method : {testing::kNearest, testing::kAmn, testing::kInstanceAmn}) {
      const ConfusionMatrix matrix =
          on_west ? Learned(west, east, method) : Learned(east, west, method);
      std::printf(" %.1f |", 100.0 * matrix.Accuracy());
      both[method].Add(matrix);
    }
    std::printf("\n");
  }
  std::printf("| both | %.1f | %.1f | %.1f |\n",
              100.0 * both[0].Accuracy(),
              100.0 * both[1].Accuracy(),
              100.0 * both[2].Accuracy());
  std::printf("| thesis | %.1f | %.1f | %.1f |\n\n",
              100.0 * thesis[0],
              100.0 * thesis[1],
              100.0 * thesis[2]);
  for (const Method method : {testing::kNearest, testing::kAmn, testing::kInstanceAmn}) {
    Expect(both[method].Accuracy() >= thesis[method] - kBesideThesis,
           std::string(testing::kMethodNames[method]) +
               " has nine of ten right, and is within a hundredth of the thesis or ahead");
  }
  // Told, not held: in the thesis it is so.
  const bool order =
      both[2].Accuracy() > both[0].Accuracy() && both[0].Accuracy() > both[1].Accuracy();
  std::printf("the thesis' order, iAMN ahead of NN ahead of AMN, %s\n",
              order ? "comes out" : "does not come out");
}

// As maps are named.
void JudgeMaps(const FreeSpace& space, const PlaceSamples& samples, const Drawing& drawing) {
  const std::vector<PlaceKind> kinds =
      Checked(NamePlaces(LearnedPlaceModel(), space, samples, Stop()));
  ConfusionMatrix matrix(std::size(kPlaceKinds));
  for (std::uint32_t i = 0; i < samples.size(); ++i) {
    const Vector2d p =
        space.min_m() + kCellM * (samples.cell(i).cast<double>() + Vector2d(0.5, 0.5));
    const std::optional<PlaceKind> kind = drawing.KindAt(p);
    if (!kind.has_value()) continue;
    matrix.Add(static_cast<ClassIndex>(static_cast<int>(*kind) - 1),
               static_cast<ClassIndex>(static_cast<int>(kinds[i]) - 1));
  }
  std::printf("\nby what was learned from drawn storeys: %.1f %%", 100.0 * matrix.Accuracy());
  for (ClassIndex k = 0; k < std::size(kPlaceKinds); ++k) {
    std::printf("; %s found %.1f %%, right %.1f %%",
                std::string(ToString(kPlaceKinds[k])).c_str(),
                100.0 * matrix.Recall(k).value_or(0.0),
                100.0 * matrix.Precision(k).value_or(0.0));
  }
  std::printf("\n");
  Expect(matrix.Accuracy() >= kLeast, "nine cells of ten are right by drawn storeys");
}

int Main() {
  const auto recording = testing::FindData("radish_carmen_2d");
  const auto graphs = testing::FindData("posegraphs");
  if (!recording.has_value() || !graphs.has_value()) {
    std::printf(
        "no recorded data: set STRATA_DATA to a folder that holds radish_carmen_2d and "
        "posegraphs\n");
    return 77;
  }
  const Drawing drawing =
      ReadDrawing(std::filesystem::path(testing::SourcePath("tests/experiments")) /
                  "classification/fr079_places.txt");
  const std::vector<std::vector<double>> ranges =
      ReadRanges(Unzipped(*recording / "fr079.clf.bz2"));
  const std::vector<PlanarPose> poses = ReadPoses(*graphs / "reference/FR079_P_toro.graph.opt.txt");
  if (drawing.scans.empty() || drawing.scans.size() != poses.size() ||
      ranges.size() <= drawing.scans.back()) {
    std::fprintf(stderr, "%zu poses, %zu scans\n", poses.size(), ranges.size());
    return 2;
  }
  Beams beams;
  for (std::size_t i = 0; i < poses.size(); ++i) beams.Add(poses[i], ranges[drawing.scans[i]]);
  const FreeSpace space = Checked(OpenSpace(beams.Blocks(), kCellM));
  const PlaceSamples samples = Checked(PlaceSamples::Of(space));
  const FeatureMatrix features = Checked(PlaceFeatures(space, samples, {}, Stop()));
  const Wing west = HalfOf(space, samples, features, drawing, true);
  const Wing east = HalfOf(space, samples, features, drawing, false);
  std::printf("%zu cells in the west, %zu in the east; %zu of %u are what nobody could say\n",
              west.data.size(),
              east.data.size(),
              samples.size() - west.data.size() - east.data.size(),
              samples.size());
  JudgeHalves(west, east);
  JudgeMaps(space, samples, drawing);
  return failures == 0 ? 0 : 1;
}

}  // namespace
}  // namespace strata

int main() { return strata::Main(); }
