// Cells of surface as a mixture of planes, whose normals are a mixture of main directions
// (thesis 5.3, 5.4), and whose colours may count (5.5).
// Internal to core/planes, not installed.
//
// Differs from the thesis: the data are flat cells with their covariances instead of points, all
// points of a cell sharing their responsibilities (a bound on the likelihood that keeps EM
// monotone: Verbeek, Nunnink, Vlassis 2006); what no plane explains is clutter, what no direction
// explains has none; a plane is only where it has support, so that distant walls in one plane stay
// two.
#ifndef STRATA_CORE_PLANES_MODELS_PLANE_MIXTURE_H_
#define STRATA_CORE_PLANES_MODELS_PLANE_MIXTURE_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/common/hash_map.h"
#include "core/common/stop.h"
#include "core/geometry/primitives.h"
#include "core/planes/models/plane_colour.h"

namespace strata {

using Voxel = std::uint64_t;  // a cube of kVoxelM in the frame of the cells
inline constexpr double kVoxelM = 1.0;
Voxel VoxelOf(const Eigen::Vector3d& point);
Eigen::AlignedBox3d BoxOf(Voxel voxel);
// The 27 around it, itself included.
std::vector<Voxel> VoxelsAround(Voxel voxel);

struct MixtureCell {
  Eigen::Vector3d mean;
  Eigen::Matrix3d covariance;  // of its points about the mean [m²]
  double measurements = 1.0;   // independent ones: n_j
  double variance_m2 = 1e-4;   // ρ² of each
  double area_m2 = 0.0;
  LabColour colour = LabColour::Zero();  // mean
  double colour_variance = 0.0;          // of its points about it, all three together
};

struct MixturePlane {
  Plane plane;
  std::vector<Voxel> voxels;  // where it has support; ascending
  // Of a measurement to be on it, spread evenly over its voxels: two planes in one place share what
  // is there, so that they do no better than one.
  double chance = 0.0;
  LabColour colour = LabColour::Zero();  // c̄_m
  // Held during a run of EM, see PlaneMixture::Prepare().
  double weight = 1.0;  // w_m (5.20): measurements of its normal, as many as may count
};

// Of a cell, by plane.
struct Membership {
  std::uint32_t plane = 0;
  double share = 0.0;  // E[α_jm]
};

struct MixtureOptions {
  double direction_sigma_rad = 0.03;  // σ of 5.13, of one measurement
  double max_measurements = 25.0;     // of a normal, w_m
  double independent_area_m2 = 0.25;  // of surface for one of those
  double clutter_half_m = 1.0;        // h: what is clutter is evenly spread over 2h
  bool directions = true;
  bool colour = false;  // colours count (5.24)
};

class PlaneMixture {
 public:
  PlaneMixture(std::vector<MixtureCell> cells, const MixtureOptions& options);

  const std::vector<MixtureCell>& cells() const { return cells_; }
  const MixtureOptions& options() const { return options_; }
  std::vector<MixturePlane> planes;
  std::vector<Eigen::Vector3d> directions;  // φ_k, unit; the sign is arbitrary
  // Of a plane to have direction k, at last none (the thesis' all are 1/K: two of one main
  // direction would do better than one). Their logarithms are part of the objective, so that none
  // gets 0.
  std::vector<double> chances = {1.0};

  // A main direction, if there is none as near as σ and not too many; it gets a plane's chance.
  void AddDirection(const Eigen::Vector3d& direction);

  // Which cells may be in which planes by their voxels and one around them, the planes' weights,
  // and the E-step. To be called whenever planes came, left or grew; within a run of EM it holds.
  void Prepare();
  void EStep();
  // The part of an E-step that is of normals and main directions: what those change.
  void DirectionEStep();
  // The planes and directions that maximise the expected log-likelihood for the expectations of
  // the last E-step, one given the others in turns, each in closed form.
  void MStep();
  // EM until the objective gains less than 1e-6 of a measurement each, at most `max_steps`. The
  // objective never falls. CANCELLED and DEADLINE_EXCEEDED by `stop`.
  absl::Status Run(int max_steps, const Stop& stop);

  // What EM maximises, for the expectations of the last E-step at their best.
  double LogLikelihood() const { return data_log_ + prior_log_; }
  // Q: what an M-step maximises, for the last E-step's expectations and the current planes.
  double ExpectedLogLikelihood() const;
  double measurements() const { return measurements_; }

  // Of cell j those planes that it may be in. After EStep().
  std::span<const Membership> memberships(std::size_t j) const {
    return std::span(members_).subspan(begins_[j], begins_[j + 1] - begins_[j]);
  }
  // The plane that has most of cell j, unless clutter has half of it.
  std::optional<std::uint32_t> PlaneOf(std::size_t j) const;
  // ln p(cell, plane), a measurement's mean, where density is counted beside that of measurements
  // all over the cells' voxels.
  double CellLog(const MixtureCell& cell, const MixturePlane& plane) const;
  double ClutterLog() const;  // the same of clutter
  // How many times as likely cell j is on the plane as it is clutter, but for PlaceDensity().
  double Odds(std::size_t j, const MixturePlane& plane) const;
  // Of the plane's measurements in its voxels to those of all in theirs.
  double PlaceDensity(const MixturePlane& plane) const {
    return PlaceDensity(plane.chance, plane.voxels.size());
  }
  double PlaceDensity(double chance, std::size_t voxels) const;
  // Of cell j, all planes' odds with their densities, and 1 for clutter, at the last E-step.
  double odds_sum(std::size_t j) const { return odds_sums_[j]; }
  // Of a plane whose measurements lie as close as those of all others.
  double MeanChance(std::size_t voxels) const;
  // E[β_mk] of the last E-step; row m; the last column is "none".
  const Eigen::MatrixXd& direction_shares() const { return beta_; }
  // Density of plane m's normal with direction k and its chance; K is none.
  double DirectionDensity(std::size_t m, std::size_t k) const;
  // Voxels of the cells that are more of the plane than of anything else.
  void RefreshSupport();

 private:
  struct Scatter {  // Σ α n/ρ² (1, x, x xᵀ)
    double weight = 0.0;
    Eigen::Vector3d first = Eigen::Vector3d::Zero();
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
    // Σ α n u (1, c), u the weight of Student's t.
    double colour_weight = 0.0;
    LabColour colour = LabColour::Zero();
  };
  std::vector<Scatter> Scatters() const;
  void UpdateChances();
  void UpdateDirectionChances();
  void FitPlanes(const std::vector<Scatter>& scatters, const std::vector<MixturePlane>& before);
  void FitDirections();
  // Shares from what the planes' densities make of the odds of each cell's members.
  void ShareOut(std::span<const double> odds);
  double Misfit(const MixtureCell& cell, const MixturePlane& plane) const;
  // ln of DirectionDensity(), however small that is.
  double DirectionLog(std::size_t m, std::size_t k) const;
  // Of each of the cells' voxels the planes with support in it or beside it, ascending.
  std::vector<std::vector<std::uint32_t>> PlanesByVoxel() const;
  // All cells' possible members, and the odds of each.
  std::vector<double> FindMembers();
  void DropLeast();
  void WeighNormals();

  std::vector<MixtureCell> cells_;
  std::vector<double> peak_logs_;  // of each cell: ln of the density at its plane
  MixtureOptions options_;
  HashMap<Voxel, std::uint32_t> voxel_ids_;             // those that have cells
  std::vector<std::uint32_t> voxel_of_;                 // of each cell
  std::vector<std::vector<std::uint32_t>> neighbours_;  // of each voxel, itself included
  std::vector<Membership> members_;                     // cell by cell
  std::vector<std::size_t> begins_;                     // of each cell's, and the end
  std::vector<double> odds_sums_;
  std::vector<double> plane_measurements_;  // Σ share n
  Eigen::MatrixXd beta_;
  double measurements_ = 0.0;
  double data_log_ = 0.0, prior_log_ = 0.0;
};

}  // namespace strata

#endif  // STRATA_CORE_PLANES_MODELS_PLANE_MIXTURE_H_
