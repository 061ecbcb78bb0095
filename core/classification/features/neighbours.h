// The nearest neighbours of every point of a cloud.
#ifndef STRATA_CORE_CLASSIFICATION_FEATURES_NEIGHBOURS_H_
#define STRATA_CORE_CLASSIFICATION_FEATURES_NEIGHBOURS_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace strata {

class BoxTree;

// The same number of neighbours for every point, nearest first; equally far ones by index. A point
// is not its own neighbour. Immutable.
class Neighbours {
 public:
  // `count` ≥ 1, or as many as there are other points. Points must be finite.
  static Neighbours Find(std::span<const Eigen::Vector3f> points, std::size_t count);
  // Neighbours of every one of `queries` among other points; at most as many as there are.
  static Neighbours Find(std::span<const Eigen::Vector3f> queries,
                         std::span<const Eigen::Vector3f> points,
                         std::size_t count);

  std::size_t size() const { return points_; }  // points
  std::size_t count() const { return count_; }  // neighbours of a point
  std::span<const std::uint32_t> Of(std::size_t point) const {
    return {indices_.data() + point * count_, count_};
  }
  // Beside Of() [m²].
  std::span<const float> SquaredDistances(std::size_t point) const {
    return {squared_.data() + point * count_, count_};
  }

 private:
  void Fill(const BoxTree& queries, const BoxTree& points, bool without_self);

  std::size_t points_ = 0;
  std::size_t count_ = 0;
  std::vector<std::uint32_t> indices_;
  std::vector<float> squared_;
};

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_FEATURES_NEIGHBOURS_H_
