#include "core/classification/classifier.h"

#include <algorithm>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"

#include "core/classification/amn_inference.h"
#include "core/classification/amn_learning.h"
#include "core/classification/instance_features.h"
#include "core/classification/instances.h"
#include "core/classification/neighbours.h"
#include "core/common/option_checks.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr ClassifierMethod kMethods[] = {ClassifierMethod::kBayes,
                                         ClassifierMethod::kNearest,
                                         ClassifierMethod::kAdaBoost,
                                         ClassifierMethod::kAmn,
                                         ClassifierMethod::kInstanceAmn};
// Out of which a point's few neighbours in the network are drawn.
constexpr std::size_t kNetworkCandidates = 16;
// Features are half of the work, learning the other.
constexpr double kFeaturesShare = 0.5;

std::vector<NetworkEdge> NetworkOf(const std::vector<Eigen::Vector3f>& points,
                                   const NetworkOptions& options) {
  return DrawNetwork(Neighbours::Find(points, kNetworkCandidates), options);
}

FeatureMatrix Standardised(const Classifier& classifier, FeatureMatrix features) {
  features.rowwise() -= classifier.feature_mean;
  features.array().rowwise() *= classifier.feature_scale.array();
  return features;
}

class Trainer {
 public:
  Trainer(const std::vector<ClassName>& classes, const TrainingOptions& options)
      : options_(options) {
    classifier_.method = options.method;
    classifier_.classes = classes;
    classifier_.features = options.features;
    classifier_.network = options.network;
    for (const ClassName& name : classes) index_[name.id] = static_cast<ClassIndex>(index_.size());
    data_.classes = classes.size();
  }

  // Its labelled points, reduced among themselves.
  absl::Status Add(const PointCloud& cloud, const Stop& stop) {
    STRATA_ASSIGN_OR_RETURN(const FeatureMatrix features,
                            ComputeFeatures(cloud, options_.features, stop));
    std::vector<Eigen::Vector3f> positions;
    LabelledFeatures labelled;
    labelled.classes = data_.classes;
    labelled.features.resize(features.rows(), features.cols());
    for (std::size_t i = 0; i < cloud.label.size(); ++i) {
      const auto known = index_.find(cloud.label[i]);
      if (known == index_.end() || !cloud.points[i].allFinite()) continue;
      labelled.features.row(static_cast<Eigen::Index>(positions.size())) =
          features.row(static_cast<Eigen::Index>(i));
      positions.push_back(cloud.points[i]);
      labelled.labels.push_back(known->second);
    }
    if (positions.empty()) return absl::OkStatus();
    labelled.features.conservativeResize(static_cast<Eigen::Index>(positions.size()),
                                         Eigen::NoChange);
    classifier_.points_seen += positions.size();
    ReducedPoints reduced = Reduce(positions, labelled, options_.reduction);
    AppendNetwork(positions, reduced);
    Append(std::move(reduced));
    return absl::OkStatus();
  }

  absl::StatusOr<Classifier> Learn(const Stop& stop) {
    classifier_.points_kept = data_.size();
    STRATA_RETURN_IF_ERROR(CheckClasses());
    Standardise();
    switch (options_.method) {
      case ClassifierMethod::kBayes: {
        STRATA_ASSIGN_OR_RETURN(classifier_.model, LearnNaiveBayes(data_, {}));
        break;
      }
      case ClassifierMethod::kAdaBoost: {
        STRATA_ASSIGN_OR_RETURN(classifier_.model,
                                LearnAdaBoost(data_, {.rounds = options_.rounds}, stop));
        break;
      }
      case ClassifierMethod::kAmn: {
        STRATA_ASSIGN_OR_RETURN(classifier_.model, Network(data_.features, stop));
        break;
      }
      case ClassifierMethod::kNearest:
        classifier_.model = InstanceModel{std::move(data_), options_.neighbours, {}};
        break;
      case ClassifierMethod::kInstanceAmn: {
        InstanceModel model{{}, options_.neighbours, {}};
        const FeatureMatrix distances = InstanceFeatures(
            Instances(data_).DistancesWithin(static_cast<std::size_t>(options_.neighbours)));
        STRATA_ASSIGN_OR_RETURN(model.weights, Network(distances, stop));
        model.instances = std::move(data_);
        classifier_.model = std::move(model);
        break;
      }
    }
    return std::move(classifier_);
  }

 private:
  // A network of its own a cloud: those of different places have nothing to do with each other.
  void AppendNetwork(const std::vector<Eigen::Vector3f>& positions, const ReducedPoints& reduced) {
    const std::size_t rows = reduced.data.size();
    ContractedNetwork network;
    if (reduced.row_of.empty()) {
      network = {NetworkOf(reduced.positions, options_.network), std::vector<std::uint32_t>(rows)};
    } else {
      network = Contract(NetworkOf(positions, options_.network), reduced.row_of, rows);
    }
    const auto first = static_cast<std::uint32_t>(data_.size());
    for (const NetworkEdge& edge : network.edges) {
      edges_.push_back({first + edge.i, first + edge.j});
    }
    inner_edges_.insert(inner_edges_.end(), network.inner_edges.begin(), network.inner_edges.end());
    counts_.insert(counts_.end(), reduced.counts.begin(), reduced.counts.end());
  }

  void Append(ReducedPoints reduced) {
    const Eigen::Index before = data_.features.rows();
    const FeatureMatrix& more = reduced.data.features;
    data_.features.conservativeResize(before + more.rows(), more.cols());
    data_.features.bottomRows(more.rows()) = more;
    data_.labels.insert(data_.labels.end(), reduced.data.labels.begin(), reduced.data.labels.end());
  }

  absl::Status CheckClasses() const {
    std::vector<bool> seen(data_.classes, false);
    for (const ClassIndex label : data_.labels) seen[label] = true;
    for (std::size_t k = 0; k < seen.size(); ++k) {
      if (seen[k]) continue;
      return absl::InvalidArgumentError(
          absl::StrCat("training: no point is labelled ", classifier_.classes[k].name));
    }
    return Validate(data_);
  }

  void Standardise() {
    const Eigen::MatrixXd x = data_.features.cast<double>();
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
    data_.features = Standardised(classifier_, std::move(data_.features));
  }

  absl::StatusOr<AmnWeights> Network(const FeatureMatrix& features, const Stop& stop) const {
    AmnLearningOptions learning;
    learning.slack_weight = options_.slack_weight;
    learning.tolerance = 1e-3;
    STRATA_ASSIGN_OR_RETURN(
        AmnLearning learned,
        LearnByCuttingPlanes({features, edges_, data_.labels, data_.classes, counts_, inner_edges_},
                             learning,
                             stop));
    return std::move(learned.weights);
  }

  const TrainingOptions& options_;
  std::map<std::uint16_t, ClassIndex> index_;  // of class ids
  LabelledFeatures data_;
  std::vector<NetworkEdge> edges_;
  std::vector<std::uint32_t> counts_;       // of every row of data_
  std::vector<std::uint32_t> inner_edges_;  // of every row of data_
  Classifier classifier_;
};

absl::StatusOr<ClassifiedCloud> Infer(const AmnWeights& weights,
                                      const FeatureMatrix& features,
                                      const std::vector<NetworkEdge>& edges,
                                      const Stop& stop) {
  STRATA_ASSIGN_OR_RETURN(AmnLabels found,
                          MaximizeScore(MakeAmnProblem(weights, features, edges), stop));
  return ClassifiedCloud{std::move(found.labels), found.score};
}

// Neighbours of points that are none are none: they keep their place, far from all others.
std::vector<NetworkEdge> NetworkOfFinite(const PointCloud& cloud, const NetworkOptions& options) {
  std::vector<Eigen::Vector3f> points;
  std::vector<std::uint32_t> rows;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!cloud.points[i].allFinite()) continue;
    points.push_back(cloud.points[i]);
    rows.push_back(static_cast<std::uint32_t>(i));
  }
  std::vector<NetworkEdge> edges = NetworkOf(points, options);
  for (NetworkEdge& edge : edges) edge = {rows[edge.i], rows[edge.j]};
  return edges;
}

}  // namespace

absl::string_view ToString(ClassifierMethod method) {
  switch (method) {
    case ClassifierMethod::kBayes:
      return "bayes";
    case ClassifierMethod::kNearest:
      return "knn";
    case ClassifierMethod::kAdaBoost:
      return "adaboost";
    case ClassifierMethod::kAmn:
      return "amn";
    case ClassifierMethod::kInstanceAmn:
      return "iamn";
  }
  return "unknown";
}

absl::StatusOr<ClassifierMethod> ClassifierMethodFromName(absl::string_view name) {
  for (const ClassifierMethod method : kMethods) {
    if (name == ToString(method)) return method;
  }
  return absl::InvalidArgumentError(absl::StrCat(
      "method '", name.substr(0, 100), "' is none of bayes, knn, adaboost, amn, iamn"));
}

absl::Status TrainingOptions::Validate() const {
  STRATA_RETURN_IF_ERROR(features.Validate());
  STRATA_RETURN_IF_ERROR(reduction.Validate());
  STRATA_RETURN_IF_ERROR(network.Validate());
  OptionChecks checks("training options");
  checks.InRange("slack_weight", slack_weight, 1e-12, 1e12);
  checks.InRange("neighbours", neighbours, 1, 100);
  checks.InRange("rounds", rounds, 1, 10000);
  return checks.status();
}

absl::StatusOr<Classifier> TrainClassifier(const std::vector<PointCloud>& clouds,
                                           const std::vector<ClassName>& classes,
                                           const TrainingOptions& options,
                                           ClassifierProgress progress,
                                           const Stop& stop) {
  const auto source = [&clouds](std::size_t k,
                                absl::FunctionRef<absl::Status(const PointCloud&)> use) {
    return use(clouds[k]);
  };
  return TrainClassifier(clouds.size(), source, classes, options, progress, stop);
}

absl::StatusOr<Classifier> TrainClassifier(std::size_t clouds,
                                           CloudSource source,
                                           const std::vector<ClassName>& classes,
                                           const TrainingOptions& options,
                                           ClassifierProgress progress,
                                           const Stop& stop) {
  STRATA_RETURN_IF_ERROR(options.Validate());
  Trainer trainer(classes, options);
  for (std::size_t k = 0; k < clouds; ++k) {
    STRATA_RETURN_IF_ERROR(
        progress(kFeaturesShare * static_cast<double>(k) / static_cast<double>(clouds)));
    STRATA_RETURN_IF_ERROR(
        source(k, [&](const PointCloud& part) { return trainer.Add(part, stop); }));
  }
  STRATA_RETURN_IF_ERROR(progress(kFeaturesShare));
  STRATA_ASSIGN_OR_RETURN(Classifier classifier, trainer.Learn(stop));
  STRATA_RETURN_IF_ERROR(progress(1.0));
  return classifier;
}

absl::StatusOr<ClassifiedCloud> Classify(const Classifier& classifier,
                                         const PointCloud& cloud,
                                         const Stop& stop) {
  STRATA_ASSIGN_OR_RETURN(FeatureMatrix raw, ComputeFeatures(cloud, classifier.features, stop));
  const FeatureMatrix features = Standardised(classifier, std::move(raw));
  if (const auto* bayes = std::get_if<NaiveBayes>(&classifier.model)) {
    return ClassifiedCloud{LargestScores(NaiveBayesScores(*bayes, features))};
  }
  if (const auto* boosted = std::get_if<AdaBoost>(&classifier.model)) {
    return ClassifiedCloud{AdaBoostLabels(*boosted, features)};
  }
  if (const auto* weights = std::get_if<AmnWeights>(&classifier.model)) {
    return Infer(*weights, features, NetworkOfFinite(cloud, classifier.network), stop);
  }
  const auto& kept = std::get<InstanceModel>(classifier.model);
  const Instances instances(kept.instances);
  const auto count = static_cast<std::size_t>(kept.neighbours);
  if (classifier.method == ClassifierMethod::kNearest) {
    return ClassifiedCloud{LargestScores(instances.Votes(features, count))};
  }
  return Infer(kept.weights,
               InstanceFeatures(instances.Distances(features, count)),
               NetworkOfFinite(cloud, classifier.network),
               stop);
}

}  // namespace strata
