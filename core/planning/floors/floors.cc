#include "core/planning/floors/floors.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

#include "core/common/hash_map.h"
#include "core/common/status.h"
#include "core/planning/endpoint.h"
#include "core/planning/floors/floor_grid.h"
#include "core/planning/floors/pieces.h"
#include "core/planning/floors/regions.h"
#include "core/planning/ground/profile_checks.h"
#include "core/planning/search_space.h"

namespace strata {
namespace {

constexpr int kNoFloor = -1;

// The pieces of a floor, rising.
using FloorPieces = std::vector<std::uint32_t>;

struct Middle {
  double x = 0.0;  // [cells]
  double y = 0.0;
};

Middle MiddleOf(const Piece& piece) {
  return {piece.block_x * double{kFloorBlockCells} + piece.mean_x,
          piece.block_y * double{kFloorBlockCells} + piece.mean_y};
}

// Regions of at least `min_cells` places, the largest first, then by their first piece.
std::vector<FloorPieces> LargeRegions(const std::vector<Piece>& pieces,
                                      const std::vector<std::uint32_t>& region,
                                      double min_cells) {
  std::map<std::uint32_t, std::pair<std::uint64_t, FloorPieces>> regions;
  for (std::uint32_t i = 0; i < pieces.size(); ++i) {
    auto& [cells, members] = regions[region[i]];
    cells += pieces[i].count;
    members.push_back(i);
  }
  std::vector<std::pair<std::uint64_t, FloorPieces>> large;
  for (auto& [first, entry] : regions) {
    if (static_cast<double>(entry.first) >= min_cells) large.push_back(std::move(entry));
  }
  std::stable_sort(
      large.begin(), large.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<FloorPieces> floors;
  floors.reserve(large.size());
  for (auto& [cells, members] : large) floors.push_back(std::move(members));
  return floors;
}

// Calls what(column, row) for each cell of the piece, within its block.
template <typename What>
void ForEachCell(const Piece& piece, const What& what) {
  for (int cell = 0; cell < kFloorBlockCells * kFloorBlockCells; ++cell) {
    if ((piece.cells >> cell & 1U) != 0) what(cell % kFloorBlockCells, cell / kFloorBlockCells);
  }
}

// The cell nearest to the middle of the piece whose middle is nearest to that of the floor: any
// free cell around there will do.
Eigen::Vector3d PlaceNear(const Middle& middle,
                          const std::vector<Piece>& pieces,
                          const FloorPieces& members,
                          double cell_m) {
  const auto distance = [&](std::uint32_t i) {
    return std::hypot(MiddleOf(pieces[i]).x - middle.x, MiddleOf(pieces[i]).y - middle.y);
  };
  const Piece& piece = pieces[*std::min_element(
      members.begin(), members.end(), [&](auto i, auto j) { return distance(i) < distance(j); })];
  Eigen::Vector3d place;
  double nearest = std::numeric_limits<double>::max();
  ForEachCell(piece, [&](int column, int row) {
    const double x = column + 0.5;
    const double y = row + 0.5;
    const double off = std::hypot(x - piece.mean_x, y - piece.mean_y);
    if (off >= nearest) return;
    nearest = off;
    place = {(piece.block_x * double{kFloorBlockCells} + x) * cell_m,
             (piece.block_y * double{kFloorBlockCells} + y) * cell_m,
             piece.mean_z};
  });
  return place;
}

Floor Describe(const std::vector<Piece>& pieces, const FloorPieces& members, double cell_m) {
  Floor floor;
  Middle middle;
  double cells = 0.0;
  floor.low.setConstant(std::numeric_limits<double>::max());
  floor.high.setConstant(std::numeric_limits<double>::lowest());
  for (const std::uint32_t i : members) {
    const Piece& piece = pieces[i];
    ForEachCell(piece, [&](int column, int row) {
      const double x = piece.block_x * double{kFloorBlockCells} + column;
      const double y = piece.block_y * double{kFloorBlockCells} + row;
      floor.low = floor.low.cwiseMin(Eigen::Vector3d(x * cell_m, y * cell_m, piece.low_z));
      floor.high =
          floor.high.cwiseMax(Eigen::Vector3d((x + 1) * cell_m, (y + 1) * cell_m, piece.high_z));
    });
    const Middle own = MiddleOf(piece);
    cells += piece.count;
    middle.x += piece.count * own.x;
    middle.y += piece.count * own.y;
    floor.mean_z_m += piece.count * double{piece.mean_z};
  }
  floor.area_m2 = cells * cell_m * cell_m;
  floor.mean_z_m /= cells;
  floor.place = PlaceNear({middle.x / cells, middle.y / cells}, pieces, members, cell_m);
  return floor;
}

std::vector<FloorLink> LinksOf(const Pieces& cut, const std::vector<int>& floor_of, double cell_m) {
  struct Sum {
    double moves = 0.0;
    double slope = 0.0;
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
  };
  std::map<std::pair<int, int>, Sum> sums;
  for (const Border& border : cut.borders) {
    const int a = floor_of[border.a];
    const int b = floor_of[border.b];
    if (a == kNoFloor || b == kNoFloor || a == b) continue;
    const Piece& from = cut.pieces[border.a];
    const Piece& to = cut.pieces[border.b];
    Sum& sum = sums[std::minmax(a, b)];
    const double moves = border.moves;
    sum.moves += moves;
    sum.slope += moves * SlopeAcross(from, to, cell_m);
    sum.place += moves * 0.5 *
                 Eigen::Vector3d((MiddleOf(from).x + MiddleOf(to).x) * cell_m,
                                 (MiddleOf(from).y + MiddleOf(to).y) * cell_m,
                                 double{from.mean_z} + to.mean_z);
  }
  std::vector<FloorLink> links;
  for (const auto& [between, sum] : sums) {
    // Three moves cross a straight border per cell: one straight, two diagonal.
    links.push_back({between.first,
                     between.second,
                     sum.place / sum.moves,
                     std::max(1.0, sum.moves / 3.0) * cell_m,
                     std::atan(sum.slope / sum.moves)});
  }
  return links;
}

absl::StatusOr<std::optional<int>> FloorAt(SearchSpace& space,
                                           const std::vector<TileKey>& tiles,
                                           const Pieces& cut,
                                           const std::vector<int>& floor_of,
                                           const PlanEndpoint& at) {
  STRATA_ASSIGN_OR_RETURN(const EndpointMatch match, MatchEndpoint(space, at));
  if (match.patch == kNoPatchId) return std::optional<int>();
  const SearchSpace::Slot& slot = space.SlotOfPatch(match.patch);
  STRATA_RETURN_IF_ERROR(space.status());
  const auto tile = std::lower_bound(tiles.begin(), tiles.end(), slot.key);
  if (tile == tiles.end() || *tile != slot.key) return std::optional<int>();
  const std::uint32_t number = slot.tile->standing.Number(match.patch - slot.base);
  const int floor = floor_of[cut.piece_of[tile - tiles.begin()][number]];
  return floor == kNoFloor ? std::optional<int>() : std::optional<int>(floor);
}

absl::Status Validate(const FloorQuery& query, double cell_size_m) {
  if (query.at.has_value()) STRATA_RETURN_IF_ERROR(ValidateEndpoint("at", *query.at, cell_size_m));
  if (query.floor.has_value() && (*query.floor < 0 || query.at.has_value())) {
    return absl::InvalidArgumentError(
        absl::StrCat("floor ", *query.floor, ": give a number of 0 or more, or a place, not both"));
  }
  if (std::isfinite(query.min_area_m2) && query.min_area_m2 >= 0.0) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("min_area_m2 ", query.min_area_m2, " is not a finite area of 0 or more"));
}

}  // namespace

absl::StatusOr<FloorPlan> FindFloors(TileCache& cache,
                                     TileSource& source,
                                     const std::vector<TileKey>& tiles,
                                     double cell_size_m,
                                     const FloorQuery& query,
                                     const Stop& stop) {
  STRATA_RETURN_IF_ERROR(Validate(query, cell_size_m));
  STRATA_ASSIGN_OR_RETURN(const ProfileChecks checks,
                          MakeProfileChecks(query.profile, cell_size_m));
  SearchSpace space(cache, source, checks, {}, stop);
  STRATA_ASSIGN_OR_RETURN(const Pieces cut, CutIntoPieces(space, tiles, stop));
  STRATA_ASSIGN_OR_RETURN(const std::vector<std::uint32_t> region,
                          JoinPieces(cut, cell_size_m, stop));
  const std::vector<FloorPieces> floors =
      LargeRegions(cut.pieces, region, query.min_area_m2 / (cell_size_m * cell_size_m));
  FloorPlan plan;
  plan.cell_size_m = cell_size_m;
  std::vector<int> floor_of(cut.pieces.size(), kNoFloor);
  for (std::size_t i = 0; i < floors.size(); ++i) {
    plan.floors.push_back(Describe(cut.pieces, floors[i], cell_size_m));
    for (const std::uint32_t piece : floors[i]) floor_of[piece] = static_cast<int>(i);
  }
  plan.links = LinksOf(cut, floor_of, cell_size_m);
  if (query.at.has_value()) {
    STRATA_ASSIGN_OR_RETURN(plan.at, FloorAt(space, tiles, cut, floor_of, *query.at));
  }
  if (!query.cells) return plan;
  for (std::size_t i = 0; i < floors.size(); ++i) {
    const std::optional<int> told = query.at.has_value() ? plan.at : query.floor;
    const bool one = query.at.has_value() || query.floor.has_value();
    if (one && told != static_cast<int>(i)) continue;
    STRATA_ASSIGN_OR_RETURN(plan.floors[i].blocks, FloorGrid(space, tiles, cut, floors[i], stop));
  }
  return plan;
}

}  // namespace strata
