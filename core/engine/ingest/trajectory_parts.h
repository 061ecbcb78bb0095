// Which trajectories constraints hold together.
#ifndef STRATA_CORE_ENGINE_INGEST_TRAJECTORY_PARTS_H_
#define STRATA_CORE_ENGINE_INGEST_TRAJECTORY_PARTS_H_

#include <cstddef>
#include <vector>

namespace strata {

// Disjoint sets of trajectories, numbered as they come in. One thread at a time.
class TrajectoryParts {
 public:
  void clear() { parent_.clear(); }
  void Join(std::size_t a, std::size_t b) { parent_[Root(b)] = Root(a); }
  bool AreJoined(std::size_t a, std::size_t b) { return Root(a) == Root(b); }

 private:
  std::size_t Root(std::size_t trajectory) {
    while (parent_.size() <= trajectory) parent_.push_back(parent_.size());
    while (parent_[trajectory] != trajectory) {
      parent_[trajectory] = parent_[parent_[trajectory]];
      trajectory = parent_[trajectory];
    }
    return trajectory;
  }

  std::vector<std::size_t> parent_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_INGEST_TRAJECTORY_PARTS_H_
