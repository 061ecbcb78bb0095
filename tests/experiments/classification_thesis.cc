// The thesis' experiments on classification (9.3, 9.4), ours beside the thesis' numbers:
//
//   classification_thesis scenes      what the scans are made of
//
// What they are run with stands in classification_cases.h.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "tests/experiments/classification_cases.h"
#include "tests/experiments/classification_scenes.h"

namespace strata {
namespace {

void PrintCounts(const char* name,
                 const std::vector<std::string>& classes,
                 const std::vector<std::uint16_t>& labels) {
  std::vector<std::size_t> count(classes.size() + 1, 0);
  for (const std::uint16_t label : labels) ++count.at(label);
  std::printf("| %s | %zu | unlabelled %zu", name, labels.size(), count[0]);
  for (std::size_t k = 0; k < classes.size(); ++k) {
    std::printf(", %s %zu", classes[k].c_str(), count[k + 1]);
  }
  std::printf(" |\n");
}

void PrintScenes() {
  std::printf("| scan | points | of which |\n|---|---|---|\n");
  for (const std::uint64_t seed : testing::kClassificationSeeds) {
    PrintCounts("facade", testing::FacadeClasses(), testing::ScanFacade(false, seed).label);
    PrintCounts("facade, double", testing::FacadeClasses(), testing::ScanFacade(true, seed).label);
    PrintCounts("objects", testing::ObjectClasses(), testing::ScanSingleObjects(seed).label);
    PrintCounts("many objects", testing::ObjectClasses(), testing::ScanManyObjects(seed).label);
    PrintCounts("people", testing::PeopleClasses(), testing::ScanPeople(seed).label);
    PrintCounts("places", testing::PlaceClasses(), testing::ScanPlaces(seed).labels);
  }
}

int Main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  if (what == "scenes") {
    PrintScenes();
    return 0;
  }
  std::fprintf(stderr, "usage: classification_thesis scenes\n");
  return 2;
}

}  // namespace
}  // namespace strata

int main(int argc, char** argv) { return strata::Main(argc, argv); }
