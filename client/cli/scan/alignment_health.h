// How well the scans of an import fit to what the map had of their places.
#ifndef STRATA_CLIENT_CLI_SCAN_ALIGNMENT_HEALTH_H_
#define STRATA_CLIENT_CLI_SCAN_ALIGNMENT_HEALTH_H_

#include <cstddef>
#include <string>
#include <vector>

#include "client/cli/terminal/json.h"
#include "core/world/scan.h"

namespace strata::cli {

// Not thread-safe.
class AlignmentHealth {
 public:
  // Takes a scan that is integrated. One that had nothing to align to says nothing.
  void Add(const ScanInfo& scan);

  std::size_t compared() const { return overlaps_.size(); }
  // In [0, 1]; 0 where nothing was compared.
  double MedianOverlap() const;
  // Registrations that ended at the limit of their steps.
  std::size_t at_step_limit() const { return at_step_limit_; }
  // "median overlap 0.96, 28 of 29 aligned, 0 at the step limit"
  std::string Summary() const;
  // Whether the poses are more likely those of other scans: 5 compared or more, and less than half
  // of them aligned or a median overlap below 0.75. Recorded drives with their own poses have 0.92
  // to 0.98, and all are aligned; with poses in another order 0.05 to 0.61 and 0 to 38 %.
  bool Doubtful() const;

 private:
  std::vector<double> overlaps_;
  std::size_t aligned_ = 0;
  std::size_t at_step_limit_ = 0;
};

// Adds a summary for people, or numbers for programs; nothing where nothing was compared.
void AddHealth(const AlignmentHealth& health, bool for_programs, Json& json);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_SCAN_ALIGNMENT_HEALTH_H_
