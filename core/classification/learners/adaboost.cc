#include "core/classification/learners/adaboost.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <utility>

#include "core/common/option_checks.h"
#include "core/common/status.h"

namespace strata {
namespace {

// Bounds ε of a weak classifier: with none wrong its weight would be infinite.
constexpr double kLeastError = 1e-10;

// Learns one class against others on the rows that are left.
class Booster {
 public:
  // `target`: +1 or −1 of every row.
  Booster(const FeatureMatrix& features, std::vector<double> target)
      : features_(features),
        target_(std::move(target)),
        order_(static_cast<std::size_t>(features.cols())) {
    weights_.assign(target_.size(), 1.0 / static_cast<double>(target_.size()));
    for (std::size_t f = 0; f < order_.size(); ++f) {
      order_[f].resize(target_.size());
      std::iota(order_[f].begin(), order_[f].end(), 0U);
      std::stable_sort(order_[f].begin(), order_[f].end(), [&](std::uint32_t a, std::uint32_t b) {
        return At(a, f) < At(b, f);
      });
    }
  }

  absl::StatusOr<std::vector<Stump>> Run(int rounds, const Stop& stop) {
    std::vector<Stump> stumps;
    for (int round = 0; round < rounds; ++round) {
      STRATA_RETURN_IF_ERROR(stop.status());
      Stump stump;
      const double error = Best(stump);
      if (error >= 0.5 - 1e-12) break;
      stump.weight = std::log((1.0 - std::max(error, kLeastError)) / std::max(error, kLeastError));
      stumps.push_back(stump);
      if (error <= kLeastError) break;
      Reweigh(stump);
    }
    return stumps;
  }

  // Share of the rows' first weights that the stumps get wrong.
  double Error(const std::vector<Stump>& stumps) const {
    double wrong = 0.0;
    for (std::size_t i = 0; i < target_.size(); ++i) {
      double sum = 0.0;
      for (const Stump& stump : stumps) sum += stump.weight * Answer(stump, i);
      wrong += (sum > 0.0) != (target_[i] > 0.0) ? 1.0 : 0.0;
    }
    return wrong / static_cast<double>(target_.size());
  }

 private:
  float At(std::size_t row, std::size_t feature) const {
    return features_(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(feature));
  }
  double Answer(const Stump& stump, std::size_t row) const {
    return stump.sign * (At(row, stump.feature) - stump.threshold) > 0.0F ? 1.0 : -1.0;
  }

  // The stump with the least weighted error, over all features and thresholds.
  double Best(Stump& best) const {
    double least = 1.0;
    double positive = 0.0;
    for (std::size_t i = 0; i < target_.size(); ++i)
      positive += target_[i] > 0.0 ? weights_[i] : 0.0;
    for (std::size_t f = 0; f < order_.size(); ++f) {
      // Wrong if all above the threshold are taken for +1: at first everything is above.
      double wrong = 1.0 - positive;
      for (std::size_t k = 0; k <= order_[f].size(); ++k) {
        if (k > 0) {
          const std::uint32_t row = order_[f][k - 1];
          wrong += target_[row] > 0.0 ? weights_[row] : -weights_[row];
        }
        if (k > 0 && k < order_[f].size() && At(order_[f][k - 1], f) == At(order_[f][k], f))
          continue;
        for (const float sign : {1.0F, -1.0F}) {
          const double error = sign > 0.0F ? wrong : 1.0 - wrong;
          if (error >= least - 1e-12) continue;
          least = error;
          best = {f, Threshold(f, k), sign, 0.0};
        }
      }
    }
    return std::max(0.0, least);
  }

  // Between the rows k − 1 and k in the order of feature f.
  float Threshold(std::size_t f, std::size_t k) const {
    if (k == 0) return std::nextafter(At(order_[f].front(), f), -HUGE_VALF);
    const float below = At(order_[f][k - 1], f);
    if (k == order_[f].size()) return below;
    const float middle = below + 0.5F * (At(order_[f][k], f) - below);
    return middle < At(order_[f][k], f) ? middle : below;
  }

  void Reweigh(const Stump& stump) {
    double total = 0.0;
    for (std::size_t i = 0; i < target_.size(); ++i) {
      if (Answer(stump, i) != target_[i]) weights_[i] *= std::exp(stump.weight);
      total += weights_[i];
    }
    for (double& weight : weights_) weight /= total;
  }

  const FeatureMatrix& features_;
  const std::vector<double> target_;
  std::vector<std::vector<std::uint32_t>> order_;  // rows by every feature
  std::vector<double> weights_;
};

struct Candidate {
  BoostedClass boosted;
  double error = 1.0;
};

absl::StatusOr<Candidate> Boost(const FeatureMatrix& features,
                                const std::vector<ClassIndex>& labels,
                                ClassIndex label,
                                int rounds,
                                const Stop& stop) {
  std::vector<double> target;
  for (const ClassIndex other : labels) target.push_back(other == label ? 1.0 : -1.0);
  Booster booster(features, std::move(target));
  Candidate candidate;
  candidate.boosted.label = label;
  STRATA_ASSIGN_OR_RETURN(candidate.boosted.stumps, booster.Run(rounds, stop));
  candidate.error = booster.Error(candidate.boosted.stumps);
  return candidate;
}

}  // namespace

absl::StatusOr<AdaBoost> LearnAdaBoost(const LabelledFeatures& data,
                                       const AdaBoostOptions& options,
                                       const Stop& stop) {
  STRATA_RETURN_IF_ERROR(Validate(data));
  OptionChecks checks("adaboost options");
  checks.InRange("rounds", options.rounds, 1, 10000);
  STRATA_RETURN_IF_ERROR(checks.status());
  // The order: by the error of each class against all others.
  std::vector<std::pair<double, ClassIndex>> order;
  for (std::size_t k = 0; k < data.classes; ++k) {
    STRATA_ASSIGN_OR_RETURN(
        const Candidate alone,
        Boost(data.features, data.labels, static_cast<ClassIndex>(k), options.rounds, stop));
    order.emplace_back(alone.error, static_cast<ClassIndex>(k));
  }
  std::sort(order.begin(), order.end());
  AdaBoost model;
  model.rest = order.back().second;
  order.pop_back();
  FeatureMatrix features = data.features;
  std::vector<ClassIndex> labels = data.labels;
  for (const auto& [error, label] : order) {
    STRATA_ASSIGN_OR_RETURN(Candidate next, Boost(features, labels, label, options.rounds, stop));
    model.sequence.push_back(std::move(next.boosted));
    // What is left for those that come after.
    Eigen::Index kept = 0;
    for (std::size_t i = 0; i < labels.size(); ++i) {
      if (labels[i] == label) continue;
      features.row(kept) = features.row(static_cast<Eigen::Index>(i)).eval();
      labels[static_cast<std::size_t>(kept++)] = labels[i];
    }
    features.conservativeResize(kept, Eigen::NoChange);
    labels.resize(static_cast<std::size_t>(kept));
  }
  return model;
}

std::vector<ClassIndex> AdaBoostLabels(const AdaBoost& model, const FeatureMatrix& features) {
  std::vector<ClassIndex> labels(static_cast<std::size_t>(features.rows()), model.rest);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    for (const BoostedClass& boosted : model.sequence) {
      double sum = 0.0;
      for (const Stump& stump : boosted.stumps) {
        const float x =
            features(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(stump.feature));
        sum += stump.sign * (x - stump.threshold) > 0.0F ? stump.weight : -stump.weight;
      }
      if (sum <= 0.0) continue;
      labels[i] = boosted.label;
      break;
    }
  }
  return labels;
}

std::vector<std::size_t> FeaturesByWeight(const AdaBoost& model) {
  std::map<std::size_t, double> total;
  for (const BoostedClass& boosted : model.sequence) {
    for (const Stump& stump : boosted.stumps) total[stump.feature] += std::abs(stump.weight);
  }
  std::vector<std::size_t> features;
  for (const auto& [feature, weight] : total) features.push_back(feature);
  std::stable_sort(features.begin(), features.end(), [&total](std::size_t a, std::size_t b) {
    return total[a] > total[b];
  });
  return features;
}

}  // namespace strata
