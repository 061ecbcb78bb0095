// The planner's definitions written down once more, without tiles, windows, queues or tables: slow
// and plain, to compare with.
#ifndef STRATA_TESTS_CORE_PLANNING_PLAIN_PLANNER_H_
#define STRATA_TESTS_CORE_PLANNING_PLAIN_PLANNER_H_

#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/mls/tile_key.h"
#include "core/world/plan.h"
#include "core/world/robot_profile.h"
#include "tests/support/drawing.h"

namespace strata::testing {

class PlainPlanner {
 public:
  PlainPlanner(const DrawnMap& map, const RobotProfile& profile, double cell_size_m);

  struct Patch {
    CellIndex cell;
    double z = 0.0;
    double bottom = 0.0;
    double sigma = 0.0;
    bool underside = false;
    double danger = -1.0;                       // < 0: cannot stand
    std::vector<std::pair<int, double>> moves;  // target, cost [m]
  };
  const std::vector<Patch>& patches() const { return patches_; }
  // Multiplies moves by what classes cost; `class_of` says which class the surfaces of a cell are.
  void AddClasses(const std::function<int(CellIndex)>& class_of, const ClassCosts& costs);
  // Where a query from or to `endpoint` begins or ends, -1 if nowhere. REQUIRES: z_m.
  int Place(const PlanEndpoint& endpoint) const;
  // Cost of the cheapest path between places to stand, infinity if none. Dijkstra.
  double Cost(int from, int to) const;

 private:
  struct Edge {
    CellIndex cell;  // where ground ends
    int seen_from;   // patch
    int met;         // obstacle or drop; -1: unknown ground, too little clearance
  };
  // Patches in a cell as a robot at z finds them, -1: none.
  struct Meeting {
    int ground = -1;
    int obstacle = -1;
    int drop = -1;
    bool hole = true;  // nothing reaches down to the ground
    bool Nothing() const { return ground < 0 && obstacle < 0 && drop < 0; }
  };
  Meeting Meet(CellIndex cell, double z, double rise) const;
  // Ends on both sides, along an axis, at tops of height z, within 0.2 m.
  bool IsHoleInDeck(CellIndex cell, double z) const;
  // Heights of decks that no beam hit there.
  std::vector<double> UnseenDecks(CellIndex cell) const;
  // The highest place to stand of the endpoint's cell on which the robot reaches z.
  int PlaceOnFloor(const PlanEndpoint& endpoint) const;
  bool Concerns(const Edge& edge, double z) const;
  bool DiscFree(CellIndex cell, double z) const;
  bool Tolerated(CellIndex hole, double z) const;
  int Run(CellIndex hole, double z, int dx, int dy) const;
  void FindEdges(int i);
  void AddMet(CellIndex cell, int seen_from, const Meeting& meeting);
  double EdgeDistance(CellIndex cell, double z) const;
  double DangerAt(int i, double distance) const;  // < 0: too steep or rough
  int OneWay(int i, int dx, int dy, int* cells) const;
  void FindMoves(int i);
  double Rise(double cells) const;

  RobotProfile profile_;
  double cell_size_;
  double footprint_;
  std::vector<Patch> patches_;
  std::map<CellIndex, std::vector<int>> columns_;
  std::vector<Edge> edges_;
};

// Moves a disc along the path in steps of a centimetre and compares it with every surface; empty if
// nothing is in its way, otherwise what is where.
std::string Collision(const DrawnMap& map,
                      const std::vector<Eigen::Vector3d>& waypoints,
                      const RobotProfile& profile,
                      double cell_size_m);

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_PLANNING_PLAIN_PLANNER_H_
