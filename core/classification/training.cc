#include "core/classification/training.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"

#include "core/classification/amn/amn_learning.h"
#include "core/classification/features/instance_features.h"
#include "core/classification/learners/instances.h"
#include "core/common/status.h"

namespace strata {
namespace {

// Features are half of the work, learning the other.
constexpr double kFeaturesShare = 0.5;
// Most points of all clouds together, where the reduction draws by class: more say little more.
constexpr std::size_t kMostDrawn = 100'000;
// Whatever the reduction: a gigabyte of features, with what learning adds.
constexpr std::size_t kMostRows = 1'000'000;

void Append(const TrainingCloud& more, TrainingCloud& to) {
  if (more.data.size() == 0) return;
  // A network of its own a cloud: those of different places have nothing to do with each other.
  const auto first = static_cast<std::uint32_t>(to.data.size());
  for (const NetworkEdge& edge : more.edges) to.edges.push_back({first + edge.i, first + edge.j});
  to.counts.insert(to.counts.end(), more.counts.begin(), more.counts.end());
  to.inner_edges.insert(to.inner_edges.end(), more.inner_edges.begin(), more.inner_edges.end());
  const Eigen::Index before = to.data.features.rows();
  const FeatureMatrix& features = more.data.features;
  to.data.features.conservativeResize(before + features.rows(), features.cols());
  to.data.features.bottomRows(features.rows()) = features;
  to.data.labels.insert(to.data.labels.end(), more.data.labels.begin(), more.data.labels.end());
  to.points_seen += more.points_seen;
}

// Rows that stand for several points keep the network of these.
ContractedNetwork NetworkOf(std::span<const Eigen::Vector3f> positions,
                            const ReducedPoints& reduced,
                            const NetworkOptions& options) {
  const std::size_t rows = reduced.data.size();
  if (!reduced.row_of.empty()) {
    return Contract(DrawNetwork(positions, options), reduced.row_of, rows);
  }
  return {DrawNetwork(reduced.positions, options), std::vector<std::uint32_t>(rows)};
}

// What is learned from of one part of a cloud.
absl::StatusOr<TrainingCloud> ReadPart(const PointCloud& part,
                                       const std::map<std::uint16_t, ClassIndex>& index,
                                       const TrainingOptions& options,
                                       const Stop& stop) {
  STRATA_ASSIGN_OR_RETURN(const FeatureMatrix features,
                          ComputeFeatures(part, options.features, stop));
  std::vector<Eigen::Vector3f> positions;
  LabelledFeatures labelled;
  labelled.classes = index.size();
  labelled.features.resize(features.rows(), features.cols());
  for (std::size_t i = 0; i < part.label.size(); ++i) {
    const auto known = index.find(part.label[i]);
    if (known == index.end() || !part.points[i].allFinite()) continue;
    labelled.features.row(static_cast<Eigen::Index>(positions.size())) =
        features.row(static_cast<Eigen::Index>(i));
    positions.push_back(part.points[i]);
    labelled.labels.push_back(known->second);
  }
  if (positions.empty()) return TrainingCloud();
  labelled.features.conservativeResize(static_cast<Eigen::Index>(positions.size()),
                                       Eigen::NoChange);
  ReducedPoints reduced = Reduce(positions, labelled, options.reduction);
  ContractedNetwork network = NetworkOf(positions, reduced, options.network);
  return TrainingCloud{std::move(reduced.data),
                       std::move(network.edges),
                       std::move(reduced.counts),
                       std::move(network.inner_edges),
                       positions.size()};
}

class Learner {
 public:
  Learner(const TrainingSet& set, std::span<const std::size_t> chosen) : options_(set.options) {
    for (const std::size_t k : chosen) Append(set.clouds[k], all_);
    classifier_.method = options_.method;
    classifier_.features = options_.features;
    classifier_.network = options_.network;
    classifier_.points_seen = all_.points_seen;
    classifier_.points_kept = all_.data.size();
    NameClasses(set.classes);
  }

  absl::StatusOr<Classifier> Learn(const Stop& stop) {
    STRATA_RETURN_IF_ERROR(Validate(all_.data));
    Standardise();
    switch (options_.method) {
      case ClassifierMethod::kBayes: {
        STRATA_ASSIGN_OR_RETURN(classifier_.model, LearnNaiveBayes(all_.data, {}));
        break;
      }
      case ClassifierMethod::kAdaBoost: {
        STRATA_ASSIGN_OR_RETURN(classifier_.model,
                                LearnAdaBoost(all_.data, {.rounds = options_.rounds}, stop));
        break;
      }
      case ClassifierMethod::kAmn: {
        STRATA_ASSIGN_OR_RETURN(classifier_.model, Network(all_.data.features, stop));
        break;
      }
      case ClassifierMethod::kNearest:
        classifier_.model = InstanceModel{std::move(all_.data), options_.neighbours, {}};
        break;
      case ClassifierMethod::kInstanceAmn: {
        InstanceModel model{{}, options_.neighbours, {}};
        const FeatureMatrix distances = InstanceFeatures(
            Instances(all_.data).DistancesWithin(static_cast<std::size_t>(options_.neighbours)));
        STRATA_ASSIGN_OR_RETURN(model.weights, Network(distances, stop));
        model.instances = std::move(all_.data);
        classifier_.model = std::move(model);
        break;
      }
    }
    return std::move(classifier_);
  }

 private:
  // Those there are points of, numbered anew.
  void NameClasses(const std::vector<ClassName>& classes) {
    std::vector<bool> present(classes.size(), false);
    for (const ClassIndex label : all_.data.labels) present[label] = true;
    std::vector<ClassIndex> place(classes.size());
    for (std::size_t k = 0; k < classes.size(); ++k) {
      place[k] = static_cast<ClassIndex>(classifier_.classes.size());
      if (present[k]) classifier_.classes.push_back(classes[k]);
    }
    for (ClassIndex& label : all_.data.labels) label = place[label];
    all_.data.classes = classifier_.classes.size();
  }

  void Standardise() {
    const Eigen::MatrixXd x = all_.data.features.cast<double>();
    const auto n = static_cast<double>(x.rows());
    const Eigen::RowVectorXd mean = x.colwise().mean();
    const Eigen::RowVectorXd deviation =
        ((x.rowwise() - mean).colwise().squaredNorm() / n).cwiseSqrt();
    classifier_.feature_mean = mean.cast<float>();
    classifier_.feature_scale =
        deviation.unaryExpr([](double d) { return d > 1e-9 ? 1.0 / d : 1.0; }).cast<float>();
    // The last one is the constant.
    classifier_.feature_mean.tail(1).setZero();
    classifier_.feature_scale.tail(1).setOnes();
    all_.data.features = Standardised(classifier_, std::move(all_.data.features));
  }

  absl::StatusOr<AmnWeights> Network(const FeatureMatrix& features, const Stop& stop) const {
    AmnLearningOptions learning;
    learning.slack_weight = options_.slack_weight;
    learning.tolerance = 1e-2;
    STRATA_ASSIGN_OR_RETURN(AmnLearning learned,
                            LearnByCuttingPlanes({features,
                                                  all_.edges,
                                                  all_.data.labels,
                                                  all_.data.classes,
                                                  all_.counts,
                                                  all_.inner_edges},
                                                 learning,
                                                 stop));
    return std::move(learned.weights);
  }

  const TrainingOptions& options_;
  TrainingCloud all_;
  Classifier classifier_;
};

}  // namespace

absl::StatusOr<TrainingSet> ReadTrainingSet(std::size_t clouds,
                                            CloudSource source,
                                            const std::vector<ClassName>& classes,
                                            const TrainingOptions& options,
                                            ClassifierProgress progress,
                                            const Stop& stop) {
  STRATA_RETURN_IF_ERROR(options.Validate());
  TrainingSet set{classes, options, std::vector<TrainingCloud>(clouds)};
  ReductionOptions& reduction = set.options.reduction;
  if (reduction.kind == ReductionKind::kBalanced && clouds > 0) {
    const std::size_t each = std::max<std::size_t>(1, kMostDrawn / clouds);
    reduction.count = static_cast<std::uint32_t>(std::min<std::size_t>(reduction.count, each));
  }
  std::map<std::uint16_t, ClassIndex> index;
  for (const ClassName& name : classes) index[name.id] = static_cast<ClassIndex>(index.size());
  std::size_t rows = 0;
  for (std::size_t k = 0; k < clouds; ++k) {
    STRATA_RETURN_IF_ERROR(progress(static_cast<double>(k) / static_cast<double>(clouds)));
    STRATA_RETURN_IF_ERROR(source(k, [&](const PointCloud& part) -> absl::Status {
      STRATA_ASSIGN_OR_RETURN(const TrainingCloud more, ReadPart(part, index, set.options, stop));
      Append(more, set.clouds[k]);
      rows += more.data.size();
      if (rows <= kMostRows) return absl::OkStatus();
      return absl::ResourceExhaustedError(
          absl::StrCat("training: more than ",
                       kMostRows,
                       " points to learn from; let them be reduced, as by reduce=auto"));
    }));
  }
  STRATA_RETURN_IF_ERROR(progress(1.0));
  return set;
}

absl::StatusOr<Classifier> LearnClassifier(const TrainingSet& set,
                                           std::span<const std::size_t> chosen,
                                           const Stop& stop) {
  return Learner(set, chosen).Learn(stop);
}

absl::StatusOr<Classifier> LearnClassifier(const TrainingSet& set, const Stop& stop) {
  std::vector<bool> seen(set.classes.size(), false);
  for (const TrainingCloud& cloud : set.clouds) {
    for (const ClassIndex label : cloud.data.labels) seen[label] = true;
  }
  for (std::size_t k = 0; k < seen.size(); ++k) {
    if (seen[k]) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("training: no point is labelled ", set.classes[k].name));
  }
  std::vector<std::size_t> all(set.clouds.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return LearnClassifier(set, all, stop);
}

absl::StatusOr<Classifier> TrainClassifier(const std::vector<PointCloud>& clouds,
                                           const std::vector<ClassName>& classes,
                                           const TrainingOptions& options,
                                           ClassifierProgress progress,
                                           const Stop& stop) {
  STRATA_ASSIGN_OR_RETURN(
      const TrainingSet set,
      ReadTrainingSet(
          clouds.size(),
          SourceOf(clouds),
          classes,
          options,
          [&progress](double share) { return progress(kFeaturesShare * share); },
          stop));
  STRATA_ASSIGN_OR_RETURN(Classifier classifier, LearnClassifier(set, stop));
  STRATA_RETURN_IF_ERROR(progress(1.0));
  return classifier;
}

}  // namespace strata
