// What the experiments on classification (thesis 9.3, 9.4) are run with. Fixed before the first
// result in the worlds of the tables was seen: a change here makes every table a new one.
#ifndef STRATA_TESTS_EXPERIMENTS_CLASSIFICATION_CLASSIFICATION_CASES_H_
#define STRATA_TESTS_EXPERIMENTS_CLASSIFICATION_CLASSIFICATION_CASES_H_

#include <array>
#include <cstdint>

namespace strata::testing {

// Every seed is a world of its own: other walls, objects, people and rooms, other noise. The tables
// are of the first ten; these were never looked at before all below was fixed.
inline constexpr std::array<std::uint64_t, 10> kClassificationSeeds = {
    401, 402, 403, 404, 405, 406, 407, 408, 409, 410};
// Of places, made anew: in the worlds above every wing was of a building of its own, while the
// thesis learns from one part of a building and is asked about the other. There NN, AMN and iAMN
// had 75.8, 80.2 and 80.6 % right.
inline constexpr std::array<std::uint64_t, 10> kPlacesSeeds = {
    411, 412, 413, 414, 415, 416, 417, 418, 419, 420};
// The worlds of the first tables. Some options were chosen after their results had been seen, so
// these are what everything is tuned in from now on.
inline constexpr std::array<std::uint64_t, 10> kTuningSeeds = {
    101, 102, 103, 104, 105, 106, 107, 108, 109, 110};

// The `index`-th scan of a world's set: training facade, test facades, S, M, H, training wing, test
// wing.
enum class ScanSet : std::uint64_t {
  kFacadeTraining = 1,
  kFacadeTest = 2,
  kSingleObjects = 3,
  kManyObjects = 4,
  kPeople = 5,
  kPlacesTraining = 6,
  kPlacesTest = 7,
};
inline constexpr std::uint64_t ScanSeed(std::uint64_t world, ScanSet set, int index) {
  return 10000 * world + 100 * static_cast<std::uint64_t>(set) + static_cast<std::uint64_t>(index);
}

// Shares of points that are right, as the thesis gives them (9.3.6, 9.3.1, Table 9.1, 9.4.4).
inline constexpr double kThesisFacadeBayes = 0.855, kThesisFacadeAmn = 0.938;
struct ThesisRow {
  const char* name;
  double nearest, amn, iamn;
};
inline constexpr ThesisRow kThesisPeople = {"people (H)", 0.75, 0.69, 0.80};
inline constexpr ThesisRow kThesisSingle = {"single objects (S)", 0.81, 0.72, 0.89};
inline constexpr ThesisRow kThesisMany = {"many objects (M)", 0.63, 0.62, 0.76};
inline constexpr ThesisRow kThesisPlaces = {"places", 0.922, 0.898, 0.955};

// 9.4.3: M = 5; nearest neighbour: the one nearest (9.4.2). The thesis' spin images reach 10 to
// 15 cm, by the resolution of its scans, which it does not say. In ours, a point every 2.6 cm, that
// is too little: one nearest neighbour has 53 % of S right at 15 cm, 65 % at 25, 78 % at 35, 87 %
// at 50 (the worlds 1 and 2, which are none of the ten).
inline constexpr double kSpinRadiusM = 0.5;
inline constexpr int kInstanceNeighbours = 5;
inline constexpr int kNearestNeighbours = 1;

// 9.3.4 does not say how large the vicinity of a point is; chosen in world 1: the most that there
// is, with which the middle of a pane still sees its bars.
inline constexpr int kFacadeNeighbours = 64;

// Objects: scans of the two sets, and how many of the first are learned from.
inline constexpr int kSingleScans = 20, kSingleTrainingScans = 6, kManyScans = 7;
inline constexpr int kPeopleScans = 11;

// d_max of Fig. 9.1.
inline constexpr std::array<int, 6> kTreeDepths = {7, 9, 11, 13, 15, 17};

// Fig. 9.5: instances a class, samples, the width of the Gaussians that label them.
inline constexpr int kPlaneInstances = 25, kPlaneSamples = 1000;
inline constexpr double kPlaneSigma = 0.05;

// Places: edge of the cells [m], and the features that boosting may keep.
inline constexpr double kPlaceCellM = 0.35;
inline constexpr int kPlaceFeatures = 30;

// What must hold: seeds in which instance-based networks are ahead of both others, and how
// unlikely their lead may be under chance (Wilcoxon's signed ranks, one-sided).
inline constexpr int kLeastWins = 8;
inline constexpr double kSignificance = 0.05;

}  // namespace strata::testing

#endif  // STRATA_TESTS_EXPERIMENTS_CLASSIFICATION_CLASSIFICATION_CASES_H_
