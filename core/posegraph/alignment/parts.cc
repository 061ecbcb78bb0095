#include "core/posegraph/alignment/parts.h"

namespace strata {

DisjointSets JoinedBy(const std::vector<RelativePoseTerm>& relative,
                      const std::vector<bool>& rejected,
                      std::size_t end) {
  DisjointSets joined;
  for (std::size_t k = 0; k < end; ++k) {
    if (!rejected[k]) joined.Join(relative[k].i, relative[k].j);
  }
  return joined;
}

std::vector<std::size_t> PartsOf(DisjointSets& joined, std::size_t nodes) {
  std::vector<std::size_t> parts;
  for (std::size_t k = 0; k < nodes; ++k) parts.push_back(joined.Root(k));
  return parts;
}

}  // namespace strata
