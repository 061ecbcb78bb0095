// The scenes of the thesis' experiments on classification (9.3.3, 9.4.4), as labelled scans of one
// pan-tilt laser scanner. Deterministic: the same seed gives the same scans.
#ifndef STRATA_TESTS_EXPERIMENTS_CLASSIFICATION_CLASSIFICATION_SCENES_H_
#define STRATA_TESTS_EXPERIMENTS_CLASSIFICATION_CLASSIFICATION_SCENES_H_

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/cloud/point_cloud.h"

namespace strata::testing {

// Labels of a subject's scans, from 1; 0 is what nobody labelled.
std::vector<std::string> FacadeClasses();  // wall, window, gutter
std::vector<std::string> ObjectClasses();  // chair, table, screen, fan, trash can
std::vector<std::string> PeopleClasses();  // head, torso, legs, arms
std::vector<std::string> PlaceClasses();   // room, corridor, lobby

// One wall of a building, two storeys high, with a gutter under the eaves, seen from 12 m. Windows
// are single-size, or a mixture of single- and double-size: recessed frames with bars before glass
// or curtains of any depth. Sills and frames are of the window. Ground and roof are there without a
// label, as is all that is farther than half a metre from the wall (9.3.3).
PointCloud ScanFacade(bool double_windows, std::uint64_t seed);

// One object of each class, free-standing side by side in any direction, the screen on its table
// (S). No two objects are of the same size; chairs and screens are of several kinds. The scan has
// neither floor nor walls.
PointCloud ScanSingleObjects(std::uint64_t seed);
// Two or three of each class in a narrower field, before and behind each other (M).
PointCloud ScanManyObjects(std::uint64_t seed);

// Two people who stand, walk, sit or point, from about 3 m (H). No floor, no walls.
PointCloud ScanPeople(std::uint64_t seed);

// The free cells of one wing of a building as a robot's occupancy grid has it: rooms, side
// corridors and bays along a corridor, a lobby at its end, of any width and shape; doors half open,
// furniture, people's legs; worn walls, noisy beams and some that do not come back. (The first
// wings were so tidy that all three methods had 99 % right.)
struct Places {
  std::vector<Eigen::Vector3f> cells;        // centres, z = 0
  std::vector<std::uint16_t> labels;         // of every cell
  std::vector<std::vector<float>> ranges_m;  // of every cell: 360 beams, one a degree
};
inline constexpr float kPlaceMaxRangeM = 30.0F;
// Wings of one `building` have corridors of one width, and rooms and lobbies of about one size.
Places ScanPlaces(std::uint64_t building, std::uint64_t seed);

}  // namespace strata::testing

#endif  // STRATA_TESTS_EXPERIMENTS_CLASSIFICATION_CLASSIFICATION_SCENES_H_
