// Which of many things belong together, told pair by pair.
#ifndef STRATA_CORE_COMMON_DISJOINT_SETS_H_
#define STRATA_CORE_COMMON_DISJOINT_SETS_H_

#include <algorithm>
#include <cstddef>
#include <vector>

namespace strata {

// Things are numbers from 0 on; each is a set of its own until it is joined. One thread at a time.
class DisjointSets {
 public:
  // False if they were in one set already.
  bool Join(std::size_t a, std::size_t b) {
    const std::size_t root_a = Root(a);
    const std::size_t root_b = Root(b);
    parent_[std::max(root_a, root_b)] = std::min(root_a, root_b);
    return root_a != root_b;
  }
  bool AreJoined(std::size_t a, std::size_t b) { return Root(a) == Root(b); }
  // The least of the set that `thing` is in.
  std::size_t Root(std::size_t thing) {
    while (parent_.size() <= thing) parent_.push_back(parent_.size());
    while (parent_[thing] != thing) {
      parent_[thing] = parent_[parent_[thing]];
      thing = parent_[thing];
    }
    return thing;
  }
  void clear() { parent_.clear(); }

 private:
  std::vector<std::size_t> parent_;
};

}  // namespace strata

#endif  // STRATA_CORE_COMMON_DISJOINT_SETS_H_
