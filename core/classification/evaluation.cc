#include "core/classification/evaluation.h"

#include <numeric>
#include <utility>

#include "core/common/random.h"

namespace strata {
namespace {

std::optional<double> Share(std::uint64_t part, std::uint64_t whole) {
  if (whole == 0) return std::nullopt;
  return static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

void ConfusionMatrix::Add(std::span<const ClassIndex> truth, std::span<const ClassIndex> given) {
  for (std::size_t i = 0; i < truth.size(); ++i) Add(truth[i], given[i]);
}

void ConfusionMatrix::Add(const ConfusionMatrix& other) {
  for (std::size_t k = 0; k < counts_.size(); ++k) counts_[k] += other.counts_[k];
}

std::uint64_t ConfusionMatrix::total() const {
  return std::accumulate(counts_.begin(), counts_.end(), std::uint64_t{0});
}

std::uint64_t ConfusionMatrix::Row(std::size_t k) const {
  std::uint64_t sum = 0;
  for (std::size_t given = 0; given < classes_; ++given) sum += count(k, given);
  return sum;
}

std::uint64_t ConfusionMatrix::Column(std::size_t k) const {
  std::uint64_t sum = 0;
  for (std::size_t truth = 0; truth < classes_; ++truth) sum += count(truth, k);
  return sum;
}

double ConfusionMatrix::Accuracy() const {
  std::uint64_t right = 0;
  for (std::size_t k = 0; k < classes_; ++k) right += count(k, k);
  return Share(right, total()).value_or(0.0);
}

std::optional<double> ConfusionMatrix::Precision(std::size_t k) const {
  return Share(count(k, k), Column(k));
}

std::optional<double> ConfusionMatrix::Recall(std::size_t k) const {
  return Share(count(k, k), Row(k));
}

std::optional<double> ConfusionMatrix::Iou(std::size_t k) const {
  return Share(count(k, k), Row(k) + Column(k) - count(k, k));
}

double ConfusionMatrix::MeanIou() const {
  double sum = 0.0;
  int seen = 0;
  for (std::size_t k = 0; k < classes_; ++k) {
    const std::optional<double> iou = Iou(k);
    if (!iou.has_value()) continue;
    sum += *iou;
    ++seen;
  }
  return seen > 0 ? sum / seen : 0.0;
}

std::vector<std::size_t> DrawFolds(std::size_t groups, std::size_t folds, std::uint64_t seed) {
  std::vector<std::size_t> fold(groups);
  for (std::size_t g = 0; g < groups; ++g) fold[g] = g % folds;
  SplitMix64 random(seed);
  for (std::size_t g = groups; g > 1; --g) {
    std::swap(fold[g - 1], fold[random.Below(static_cast<std::uint32_t>(g))]);
  }
  return fold;
}

}  // namespace strata
