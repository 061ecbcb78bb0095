// What a scan is registered to: the chains of scans around it (thesis 7.3.4, pooled local maps).
#ifndef STRATA_CORE_POSEGRAPH_ALIGNMENT_SCAN_CHAINS_H_
#define STRATA_CORE_POSEGRAPH_ALIGNMENT_SCAN_CHAINS_H_

#include <cstddef>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "core/geometry/pose.h"
#include "core/posegraph/alignment/alignment.h"

namespace strata {

// Scans that follow each other on a trajectory, near to some scan.
struct ScanChain {
  std::vector<std::size_t> nodes;  // in the order of the way, at least one
  bool own = false;                // the scan's own way, up to it
  bool may_be_false = false;       // only nearness says that it overlaps with the scan
};

// Chooses for every scan of a problem. Immutable; must not outlive the problem.
class ScanChains {
 public:
  ScanChains(const AlignmentProblem& problem, const NeighbourPolicy& policy);

  // Around `node` at these poses: of the scans near by and of those that the problem pairs it with,
  // one chain for every pass of a robot. Of its own pass only what is behind it, or nothing that
  // was measured about it would be independent of where it is. Scans that nothing joins to it are
  // not near: they have a frame of their own, and what looks alike there says nothing. A chain ends
  // before a node that is `loose`, one that nothing is known about from the scans before it: what
  // matches one side of such a step says nothing of the other. Empty: none is.
  std::vector<ScanChain> Around(std::size_t node,
                                std::span<const Pose> T_map_scan,
                                const std::vector<bool>& loose = {}) const;

 private:
  using Place = std::pair<std::size_t, std::size_t>;  // trajectory, and the index in it

  bool OwnPass(std::size_t node, std::size_t other) const;
  bool IsLooseBetween(const Place& before, std::size_t end, const std::vector<bool>& loose) const;

  struct Partner {
    std::size_t node = 0;
    bool may_be_false = false;
  };

  NeighbourPolicy policy_;
  std::span<const std::vector<std::size_t>> trajectories_;
  std::vector<Place> way_;                      // of every node
  std::vector<std::vector<Partner>> partners_;  // of every node, by the problem's pairs
  std::vector<std::size_t> part_;  // of every node: of what is joined or placed by priors
  std::set<std::pair<std::size_t, std::size_t>> excluded_;  // smaller node first
};

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_ALIGNMENT_SCAN_CHAINS_H_
