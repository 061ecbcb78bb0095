#include "core/registration/point_index.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <numbers>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <nanoflann.hpp>

namespace strata {
namespace {

// nanoflann's view of the points; its method names are given.
struct PointsView {
  const std::vector<Eigen::Vector3d>& points;
  std::size_t kdtree_get_point_count() const { return points.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t k) const {
    return points[i][static_cast<Eigen::Index>(k)];
  }
  template <typename Box>
  bool kdtree_get_bbox(Box& /*box*/) const {
    return false;
  }
};
using Tree = nanoflann::
    KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, PointsView>, PointsView, 3, std::size_t>;

class ClosestPointIndex : public PointIndex {
 public:
  explicit ClosestPointIndex(const std::vector<Eigen::Vector3d>& points)
      : view_{points}, tree_(3, view_, nanoflann::KDTreeSingleIndexAdaptorParams(10)) {}

  std::size_t Find(const Eigen::Vector3d& p, double max_distance_m) const override {
    if (view_.points.empty()) return kNone;
    std::size_t index = kNone;
    double squared_m2 = 0.0;
    tree_.knnSearch(p.data(), 1, &index, &squared_m2);
    return squared_m2 < max_distance_m * max_distance_m ? index : kNone;
  }

 private:
  PointsView view_;
  Tree tree_;
};

class ProjectionIndex : public PointIndex {
 public:
  ProjectionIndex(const std::vector<Eigen::Vector3d>& points,
                  const Eigen::Vector3d& sensor,
                  double cell_rad)
      : points_(points),
        sensor_(sensor),
        columns_(static_cast<int>(std::ceil(2.0 * std::numbers::pi / cell_rad))),
        rows_(static_cast<int>(std::ceil(std::numbers::pi / cell_rad))),
        image_(static_cast<std::size_t>(columns_) * rows_, kNone) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Cell cell = CellOfDirection(points[i]);
      std::size_t& held = image_[At(cell.row, cell.column)];
      if (held == kNone || Range(points[i]) < Range(points[held])) held = i;
    }
  }

  std::size_t Find(const Eigen::Vector3d& p, double max_distance_m) const override {
    const Cell cell = CellOfDirection(p);
    double best_m2 = max_distance_m * max_distance_m;
    std::size_t best = kNone;
    const auto offer = [&](int row, int column) {
      const std::size_t i = image_[At(row, (column + columns_) % columns_)];
      if (i == kNone || !((points_[i] - p).squaredNorm() < best_m2)) return;
      best_m2 = (points_[i] - p).squaredNorm();
      best = i;
    };
    offer(cell.row, cell.column);
    if (image_[At(cell.row, cell.column)] != kNone) return best;
    for (int row = std::max(cell.row - 1, 0); row <= std::min(cell.row + 1, rows_ - 1); ++row) {
      for (int column = cell.column - 1; column <= cell.column + 1; ++column) offer(row, column);
    }
    return best;
  }

 private:
  struct Cell {
    int row, column;
  };
  Cell CellOfDirection(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d d = p - sensor_;
    const double azimuth = std::atan2(d.y(), d.x()) + std::numbers::pi;
    const double polar = std::atan2(d.head<2>().norm(), d.z());
    return {std::min(static_cast<int>(polar / std::numbers::pi * rows_), rows_ - 1),
            std::min(static_cast<int>(azimuth / (2.0 * std::numbers::pi) * columns_),
                     columns_ - 1)};
  }
  std::size_t At(int row, int column) const {
    return static_cast<std::size_t>(row) * columns_ + column;
  }
  double Range(const Eigen::Vector3d& p) const { return (p - sensor_).squaredNorm(); }

  const std::vector<Eigen::Vector3d>& points_;
  Eigen::Vector3d sensor_;
  int columns_;
  int rows_;
  std::vector<std::size_t> image_;
};

}  // namespace

std::unique_ptr<PointIndex> MakeClosestPointIndex(const std::vector<Eigen::Vector3d>& points) {
  return std::make_unique<ClosestPointIndex>(points);
}

std::unique_ptr<PointIndex> MakeProjectionIndex(const std::vector<Eigen::Vector3d>& points,
                                                const Eigen::Vector3d& sensor,
                                                double cell_rad) {
  return std::make_unique<ProjectionIndex>(points, sensor, cell_rad);
}

std::vector<Eigen::Vector3d> EstimateNormals(const std::vector<Eigen::Vector3d>& points,
                                             int neighbours) {
  std::vector<Eigen::Vector3d> normals(points.size(), Eigen::Vector3d::Zero());
  if (points.size() < 3) return normals;
  const PointsView view{points};
  const Tree tree(3, view, nanoflann::KDTreeSingleIndexAdaptorParams(10));
  const std::size_t k = std::min<std::size_t>(neighbours, points.size());
  std::vector<std::size_t> indices(k);
  std::vector<double> squared_m2(k);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t found =
        tree.knnSearch(points[i].data(), k, indices.data(), squared_m2.data());
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (std::size_t j = 0; j < found; ++j) mean += points[indices[j]];
    mean /= static_cast<double>(found);
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    for (std::size_t j = 0; j < found; ++j) {
      const Eigen::Vector3d d = points[indices[j]] - mean;
      covariance += d * d.transpose();
    }
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
    eigen.computeDirect(covariance);
    if (eigen.eigenvalues()[1] > 1e-6 * eigen.eigenvalues()[2]) {
      normals[i] = eigen.eigenvectors().col(0);
    }
  }
  return normals;
}

}  // namespace strata
