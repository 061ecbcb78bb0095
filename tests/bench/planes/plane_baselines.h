// What the thesis sets before its own way to planes (5.2, 5.3), as it describes them.
#ifndef STRATA_TESTS_BENCH_PLANE_BASELINES_H_
#define STRATA_TESTS_BENCH_PLANE_BASELINES_H_

#include <cstdint>
#include <vector>

#include "tests/bench/planes/plane_cases.h"

namespace strata::bench {

using PointGroups = std::vector<std::vector<std::uint32_t>>;

// 5.2.2: an accumulator over azimuth, elevation (3° each) and distance (twice near_m). Its highest
// cell is a plane; the points within near_m of the plane through that cell's points are taken out
// of it, until none holds min_points. At most `most` points vote, evenly chosen; all are told
// apart.
PointGroups HoughPlanes(const PlaneCase& input, std::size_t most);

// 5.2.1, Algorithm 2: regions of points whose normals are within 10° of the first one's, over
// neighbours, the 30 nearest, from first points in random order. (Line 11 has the neighbours of z,
// line 14 adds z to the queue: slips for z' and z_s.)
PointGroups GrownPlanes(const PlaneCase& input);

// 5.3 with 5.4.1: EM over points from 40 drawn planes (5.4.2), equally likely, without clutter;
// then planes go, one by one, while that lowers the BIC, and EM once more. Points within 3ρ of
// their plane are of it; ρ is a third of near_m. At most `most` points, evenly chosen; all are told
// apart.
PointGroups PlainEmPlanes(const PlaneCase& input, std::size_t most);

// With the planes through their points by least squares.
FoundPlanes FittedPlanes(const PlaneCase& input, PointGroups groups);

}  // namespace strata::bench

#endif  // STRATA_TESTS_BENCH_PLANE_BASELINES_H_
