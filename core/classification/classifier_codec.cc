#include "core/classification/classifier_codec.h"

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Cholesky>

#include "core/codec/blob.h"
#include "core/codec/bytes.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr std::uint16_t kVersion = 1;
constexpr std::uint64_t kMaxClasses = 1000;
constexpr std::uint64_t kMaxFeatures = 10000;
constexpr std::uint64_t kMaxNameBytes = 200;
// Squares of differences, and their sums, stay far from overflow.
constexpr double kMaxNumber = 1e15;
constexpr float kMaxFeature = 1e9F;

// Both directions visit the same fields in the same order.
class Writer {
 public:
  explicit Writer(std::string& out) : out_(out) {}

  void Whole(std::uint64_t value) { PutVarint(out_, value); }
  void Number(double value) { PutFixed(out_, std::bit_cast<std::uint64_t>(value)); }
  void Number(float value) { PutFixed(out_, std::bit_cast<std::uint32_t>(value)); }
  void Text(const std::string& text) {
    Whole(text.size());
    out_ += text;
  }
  template <typename T>
  void Size(const std::vector<T>& items, std::uint64_t /*most*/) {
    Whole(items.size());
  }
  template <typename Matrix>
  void Shape(const Matrix& matrix) {
    Whole(static_cast<std::uint64_t>(matrix.rows()));
    Whole(static_cast<std::uint64_t>(matrix.cols()));
  }
  template <typename T, typename Stored>
  void As(const Stored& value) {
    Whole(static_cast<std::uint64_t>(value));
  }

 private:
  std::string& out_;
};

class Reader {
 public:
  explicit Reader(absl::string_view body) : in_(body) {}

  void Whole(std::uint64_t& value) { value = in_.Varint(); }
  void Number(double& value) {
    value = std::bit_cast<double>(in_.Fixed<std::uint64_t>());
    ok_ = ok_ && std::abs(value) <= kMaxNumber;
  }
  void Number(float& value) {
    value = std::bit_cast<float>(in_.Fixed<std::uint32_t>());
    ok_ = ok_ && std::abs(value) <= kMaxFeature;
  }
  void Text(std::string& text) {
    const std::uint64_t size = in_.Varint();
    ok_ = ok_ && size <= kMaxNameBytes;
    if (ok_) text = std::string(in_.Take(size));
  }
  template <typename T>
  void Size(std::vector<T>& items, std::uint64_t most) {
    const std::uint64_t size = in_.Varint();
    // Every item takes a byte at least, so that no memory is asked for that the bytes do not back.
    ok_ = ok_ && size <= most && size <= in_.remaining();
    if (ok_) items.resize(size);
  }
  template <typename Matrix>
  void Shape(Matrix& matrix) {
    const std::uint64_t rows = in_.Varint();
    const std::uint64_t columns = in_.Varint();
    if constexpr (Matrix::RowsAtCompileTime == 1) ok_ = ok_ && rows == 1;
    if constexpr (Matrix::ColsAtCompileTime == 1) ok_ = ok_ && columns == 1;
    ok_ = ok_ && columns <= kMaxFeatures && rows <= in_.remaining() &&
          rows * columns * sizeof(typename Matrix::Scalar) <= in_.remaining();
    if (ok_) matrix.resize(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(columns));
  }
  template <typename T, typename Stored>
  void As(Stored& value) {
    const std::uint64_t whole = in_.Varint();
    value = static_cast<Stored>(static_cast<T>(whole));
    ok_ = ok_ && static_cast<std::uint64_t>(static_cast<T>(value)) == whole;
  }

  bool ok() const { return ok_ && in_.ok(); }
  bool at_end() const { return in_.remaining() == 0; }

 private:
  ByteReader in_;
  bool ok_ = true;
};

template <typename Archive, typename Matrix>
void Visit(Archive& archive, Matrix& matrix) {
  archive.Shape(matrix);
  for (auto&& x : matrix.reshaped()) archive.Number(x);
}

template <typename Archive, typename Features>
void VisitFeatures(Archive& archive, Features& features) {
  archive.template As<std::uint8_t>(features.set);
  archive.template As<std::uint8_t>(features.neighbours);
  archive.template As<std::uint8_t>(features.scales);
  archive.Number(features.voxel_m);
  archive.Number(features.max_height_m);
  archive.Number(features.plane_side_m);
  archive.Number(features.wall_distance_m);
  archive.Number(features.spin_radius_m);
}

template <typename Archive, typename Network>
void VisitNetwork(Archive& archive, Network& network) {
  archive.template As<std::uint8_t>(network.max_degree);
  archive.template As<std::uint16_t>(network.draws);
  archive.Number(network.sigma_spacings);
  archive.Whole(network.seed);
}

template <typename Archive, typename Weights>
void VisitWeights(Archive& archive, Weights& weights) {
  Visit(archive, weights.node);
  Visit(archive, weights.edge);
}

template <typename Archive, typename Bayes>
void VisitBayes(Archive& archive, Bayes& bayes) {
  Visit(archive, bayes.mean);
  archive.Size(bayes.covariance, kMaxClasses);
  for (auto& covariance : bayes.covariance) Visit(archive, covariance);
  Visit(archive, bayes.log_prior);
}

template <typename Archive, typename Boost>
void VisitBoost(Archive& archive, Boost& boost) {
  archive.Size(boost.sequence, kMaxClasses);
  for (auto& boosted : boost.sequence) {
    archive.template As<ClassIndex>(boosted.label);
    archive.Size(boosted.stumps, 10000);
    for (auto& stump : boosted.stumps) {
      archive.template As<std::uint16_t>(stump.feature);
      archive.Number(stump.threshold);
      archive.Number(stump.sign);
      archive.Number(stump.weight);
    }
  }
  archive.template As<ClassIndex>(boost.rest);
}

template <typename Archive, typename Kept>
void VisitInstances(Archive& archive, Kept& kept) {
  Visit(archive, kept.instances.features);
  archive.Size(kept.instances.labels, UINT64_MAX);
  for (auto& label : kept.instances.labels) archive.template As<ClassIndex>(label);
  archive.template As<std::uint8_t>(kept.neighbours);
  VisitWeights(archive, kept.weights);
}

template <typename Archive, typename Model>
void VisitHeader(Archive& archive, Model& model) {
  archive.template As<std::uint8_t>(model.method);
  archive.Size(model.classes, kMaxClasses);
  for (auto& name : model.classes) {
    archive.template As<std::uint16_t>(name.id);
    archive.Text(name.name);
  }
  VisitFeatures(archive, model.features);
  VisitNetwork(archive, model.network);
  Visit(archive, model.feature_mean);
  Visit(archive, model.feature_scale);
  archive.Whole(model.points_seen);
  archive.Whole(model.points_kept);
}

absl::Status Wrong(absl::string_view what) {
  return absl::DataLossError(absl::StrCat("classifier: ", what));
}

absl::Status CheckWeights(const AmnWeights& weights, Eigen::Index classes, Eigen::Index features) {
  if (weights.node.rows() != classes || weights.node.cols() != features ||
      weights.edge.size() != classes) {
    return Wrong("weights of another shape than classes and features");
  }
  if (weights.edge.minCoeff() < 0.0) return Wrong("an edge weight is negative");
  return absl::OkStatus();
}

absl::Status CheckBayes(const NaiveBayes& bayes, Eigen::Index classes, Eigen::Index features) {
  bool fits = bayes.mean.rows() == classes && bayes.mean.cols() == features &&
              bayes.log_prior.size() == classes &&
              static_cast<Eigen::Index>(bayes.covariance.size()) == classes;
  for (const Eigen::MatrixXd& covariance : bayes.covariance) {
    fits = fits && covariance.rows() == features && covariance.cols() == features;
    if (!fits) break;
    if (Eigen::LLT<Eigen::MatrixXd>(covariance).info() != Eigen::Success) {
      return Wrong("a covariance is not positive definite");
    }
  }
  return fits ? absl::OkStatus()
              : Wrong("means and covariances of another shape than classes and features");
}

absl::Status CheckBoost(const AdaBoost& boost, std::size_t classes, std::size_t features) {
  for (const BoostedClass& boosted : boost.sequence) {
    if (boosted.label >= classes) return Wrong("a boosted class is none");
    for (const Stump& stump : boosted.stumps) {
      if (stump.feature >= features)
        return Wrong("a weak classifier asks for a feature that is none");
    }
  }
  return boost.rest < classes ? absl::OkStatus() : Wrong("the last class is none");
}

absl::Status CheckInstances(const Classifier& classifier, const InstanceModel& kept) {
  const LabelledFeatures& data = kept.instances;
  if (const absl::Status valid = Validate(data); !valid.ok()) return Wrong(valid.message());
  if (data.features.cols() != classifier.feature_mean.size() || kept.neighbours < 1) {
    return Wrong("instances of another shape than the features");
  }
  if (classifier.method == ClassifierMethod::kNearest) return absl::OkStatus();
  const auto classes = static_cast<Eigen::Index>(data.classes);
  return CheckWeights(kept.weights, classes, classes * kept.neighbours + 1);
}

absl::Status CheckModel(const Classifier& classifier) {
  const auto classes = static_cast<Eigen::Index>(classifier.classes.size());
  const Eigen::Index features = classifier.feature_mean.size();
  switch (classifier.method) {
    case ClassifierMethod::kBayes:
      return CheckBayes(std::get<NaiveBayes>(classifier.model), classes, features);
    case ClassifierMethod::kAdaBoost:
      return CheckBoost(std::get<AdaBoost>(classifier.model),
                        classifier.classes.size(),
                        static_cast<std::size_t>(features));
    case ClassifierMethod::kAmn:
      return CheckWeights(std::get<AmnWeights>(classifier.model), classes, features);
    case ClassifierMethod::kNearest:
    case ClassifierMethod::kInstanceAmn:
      return CheckInstances(classifier, std::get<InstanceModel>(classifier.model));
  }
  return Wrong("the method is none");
}

absl::Status CheckHeader(const Classifier& classifier) {
  if (classifier.classes.size() < 2) return Wrong("fewer than two classes");
  std::set<std::uint16_t> ids;
  for (const ClassName& name : classifier.classes) {
    if (name.id == 0 || !ids.insert(name.id).second) return Wrong("a class id is 0 or there twice");
  }
  if (const absl::Status valid = classifier.features.Validate(); !valid.ok()) {
    return Wrong(valid.message());
  }
  if (const absl::Status valid = classifier.network.Validate(); !valid.ok()) {
    return Wrong(valid.message());
  }
  const auto features = static_cast<Eigen::Index>(FeatureNames(classifier.features).size());
  if (classifier.feature_mean.size() != features || classifier.feature_scale.size() != features) {
    return Wrong("means of another number of features than its set has");
  }
  return absl::OkStatus();
}

void ReadModel(Reader& reader, Classifier& classifier) {
  switch (classifier.method) {
    case ClassifierMethod::kBayes:
      VisitBayes(reader, classifier.model.emplace<NaiveBayes>());
      break;
    case ClassifierMethod::kAdaBoost:
      VisitBoost(reader, classifier.model.emplace<AdaBoost>());
      break;
    case ClassifierMethod::kAmn:
      VisitWeights(reader, classifier.model.emplace<AmnWeights>());
      break;
    case ClassifierMethod::kNearest:
    case ClassifierMethod::kInstanceAmn: {
      auto& kept = classifier.model.emplace<InstanceModel>();
      VisitInstances(reader, kept);
      kept.instances.classes = classifier.classes.size();
      break;
    }
  }
}

}  // namespace

std::string EncodeClassifier(const Classifier& classifier) {
  std::string body;
  Writer writer(body);
  VisitHeader(writer, classifier);
  if (const auto* bayes = std::get_if<NaiveBayes>(&classifier.model)) VisitBayes(writer, *bayes);
  if (const auto* boost = std::get_if<AdaBoost>(&classifier.model)) VisitBoost(writer, *boost);
  if (const auto* amn = std::get_if<AmnWeights>(&classifier.model)) VisitWeights(writer, *amn);
  if (const auto* kept = std::get_if<InstanceModel>(&classifier.model)) {
    VisitInstances(writer, *kept);
  }
  return SealBlob(BlobKind::kClassifier, kVersion, body);
}

absl::StatusOr<Classifier> DecodeClassifier(absl::string_view bytes) {
  STRATA_ASSIGN_OR_RETURN(const absl::string_view body,
                          OpenBlob(BlobKind::kClassifier, kVersion, bytes));
  Reader reader(body);
  Classifier classifier;
  VisitHeader(reader, classifier);
  if (!reader.ok())
    return Wrong("its header does not fit its length, or holds numbers that are none");
  STRATA_RETURN_IF_ERROR(CheckHeader(classifier));
  ReadModel(reader, classifier);
  if (!reader.ok() || !reader.at_end()) {
    return Wrong("its model does not fit its length, or holds numbers that are none");
  }
  STRATA_RETURN_IF_ERROR(CheckModel(classifier));
  return classifier;
}

}  // namespace strata
