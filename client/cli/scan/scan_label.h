// strata scan label
#ifndef STRATA_CLIENT_CLI_SCAN_SCAN_LABEL_H_
#define STRATA_CLIENT_CLI_SCAN_SCAN_LABEL_H_

#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "client/cli/terminal/command.h"

namespace strata::cli {

// A part of the map: what lies above and below a polygon, between two heights.
struct Prism {
  std::vector<Eigen::Vector2d> corners;  // at least 3, in either direction [m]
  double z_min = -std::numeric_limits<double>::infinity();
  double z_max = std::numeric_limits<double>::infinity();

  // A point on an edge may be in or out.
  bool Contains(const Eigen::Vector3d& point) const;
};

void AddScanLabel(Commands& commands, CLI::App* noun);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_SCAN_SCAN_LABEL_H_
