// A second level of classification (thesis 12.2.2) on recorded clouds with known classes: points
// that a network labels alike and that touch are an entity; entities are labelled again, by what
// they are as a whole and what is beside them.
//
//   labelled_entities [--data oakland|folds|wachtberg] [--method NAME]
//
// The splits are those of labelled_clouds. What the second level learns from are labels of clouds
// that the first level has not learned from. Exits with 1 unless the better of the second levels
// is ahead in accuracy and in mean IoU: then the library should have it.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <map>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <Eigen/Eigenvalues>

#include "core/classification/amn/amn_inference.h"
#include "core/classification/amn/amn_learning.h"
#include "core/classification/evaluation.h"
#include "core/classification/features/ground_height.h"
#include "core/classification/features/neighbours.h"
#include "core/classification/learners/adaboost.h"
#include "core/classification/training.h"
#include "tests/support/labelled_clouds.h"

namespace strata {
namespace {

using testing::LabelledClouds;

// Chosen before any result.
constexpr std::size_t kNeighbours = 8;
constexpr float kTouchingM = 0.5F;

class Groups {
 public:
  explicit Groups(std::size_t size) : parent_(size) {
    std::iota(parent_.begin(), parent_.end(), 0U);
  }
  std::uint32_t Find(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  // The lower index leads.
  void Join(std::uint32_t i, std::uint32_t j) {
    i = Find(i);
    j = Find(j);
    parent_[std::max(i, j)] = std::min(i, j);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

// A cloud's entities.
struct Entities {
  std::vector<std::uint32_t> of_point;
  FeatureMatrix features;            // the constant 1 last
  std::vector<NetworkEdge> edges;    // once for every pair that touches
  std::vector<std::uint32_t> sizes;  // points
};

class EntityFinder {
 public:
  EntityFinder(const PointCloud& cloud, const std::vector<ClassIndex>& labels, std::size_t classes)
      : cloud_(cloud), labels_(labels), classes_(classes) {}

  Entities Run() {
    const Neighbours neighbours = Neighbours::Find(cloud_.points, kNeighbours);
    Groups groups(cloud_.size());
    ForTouching(neighbours, [&](std::uint32_t i, std::uint32_t j) {
      if (labels_[i] == labels_[j]) groups.Join(i, j);
    });
    Number(groups);
    found_.features =
        FeatureMatrix::Zero(static_cast<Eigen::Index>(found_.sizes.size()), Columns());
    found_.features.rightCols(1).setOnes();
    PutShapes();
    PutSurroundings(neighbours);
    return std::move(found_);
  }

 private:
  // Size, three extents, three heights, three shares of variance, how upright the longest axis is.
  static constexpr Eigen::Index kShapes = 11;
  // Its label; how often it touches which other; the share of touching that is of its own.
  Eigen::Index Columns() const { return kShapes + 2 * static_cast<Eigen::Index>(classes_) + 2; }

  template <typename Use>
  void ForTouching(const Neighbours& neighbours, const Use& use) const {
    for (std::uint32_t i = 0; i < neighbours.size(); ++i) {
      for (std::size_t k = 0; k < neighbours.count(); ++k) {
        if (neighbours.SquaredDistances(i)[k] > kTouchingM * kTouchingM) break;
        use(i, neighbours.Of(i)[k]);
      }
    }
  }

  void Number(Groups& groups) {
    std::vector<std::uint32_t> number(cloud_.size(), 0);
    for (std::uint32_t i = 0; i < cloud_.size(); ++i) {
      const std::uint32_t leader = groups.Find(i);
      if (leader == i) {
        number[i] = static_cast<std::uint32_t>(found_.sizes.size());
        found_.sizes.push_back(0);
        points_.emplace_back();
      }
      found_.of_point.push_back(number[leader]);
      ++found_.sizes[number[leader]];
      points_[number[leader]].push_back(i);
    }
  }

  void PutShapes() {
    const std::vector<float> heights = HeightsAboveLowest(cloud_.points).value();
    for (std::size_t e = 0; e < points_.size(); ++e) {
      auto row = found_.features.row(static_cast<Eigen::Index>(e));
      row[0] = std::log(static_cast<float>(points_[e].size()));
      PutBox(points_[e], row);
      std::vector<float> sorted;
      for (const std::uint32_t i : points_[e]) sorted.push_back(heights[i]);
      std::sort(sorted.begin(), sorted.end());
      row[4] = sorted[sorted.size() / 20];
      row[5] = sorted[sorted.size() / 2];
      row[6] = sorted[sorted.size() - 1 - sorted.size() / 20];
      row[kShapes + labels_[points_[e].front()]] = 1.0F;
    }
  }

  template <typename Row>
  void PutBox(const std::vector<std::uint32_t>& points, Row& row) const {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const std::uint32_t i : points) mean += cloud_.points[i].cast<double>();
    mean /= static_cast<double>(points.size());
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    for (const std::uint32_t i : points) {
      const Eigen::Vector3d d = cloud_.points[i].cast<double>() - mean;
      moments += d * d.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(moments);
    Eigen::AlignedBox3d box;
    for (const std::uint32_t i : points) {
      box.extend(axes.eigenvectors().transpose() * (cloud_.points[i].cast<double>() - mean));
    }
    const double total = std::max(1e-12, moments.trace());
    for (int k = 0; k < 3; ++k) {
      row[1 + k] = static_cast<float>(std::log(0.05 + box.sizes()[k]));
      row[7 + k] = static_cast<float>(axes.eigenvalues()[k] / total);
    }
    row[10] = static_cast<float>(std::abs(axes.eigenvectors()(2, 2)));
  }

  void PutSurroundings(const Neighbours& neighbours) {
    const Eigen::Index other = kShapes + static_cast<Eigen::Index>(classes_);
    const Eigen::Index own = other + static_cast<Eigen::Index>(classes_);
    std::vector<float> outside(points_.size(), 0.0F);
    std::vector<float> all(points_.size(), 0.0F);
    ForTouching(neighbours, [&](std::uint32_t i, std::uint32_t j) {
      // Both ways: a neighbour's neighbour need not be one.
      for (const auto& [a, b] : {std::pair(i, j), std::pair(j, i)}) {
        const std::uint32_t e = found_.of_point[a];
        const std::uint32_t f = found_.of_point[b];
        ++all[e];
        if (e == f) continue;
        ++outside[e];
        ++found_.features(static_cast<Eigen::Index>(e), other + labels_[b]);
        if (e < f) found_.edges.push_back({e, f});
      }
    });
    for (std::size_t e = 0; e < points_.size(); ++e) {
      auto row = found_.features.row(static_cast<Eigen::Index>(e));
      row.segment(other, static_cast<Eigen::Index>(classes_)) /= std::max(1.0F, outside[e]);
      row[own] = 1.0F - outside[e] / std::max(1.0F, all[e]);
    }
    const auto key = [](const NetworkEdge& edge) { return std::pair(edge.i, edge.j); };
    std::sort(found_.edges.begin(),
              found_.edges.end(),
              [&](const NetworkEdge& a, const NetworkEdge& b) { return key(a) < key(b); });
    found_.edges.erase(std::unique(found_.edges.begin(), found_.edges.end()), found_.edges.end());
  }

  const PointCloud& cloud_;
  const std::vector<ClassIndex>& labels_;
  const std::size_t classes_;
  Entities found_;
  std::vector<std::vector<std::uint32_t>> points_;  // of every entity
};

// What the second level learns from: entities whose class is known, that of most of their points.
struct Lesson {
  LabelledFeatures data;
  std::vector<NetworkEdge> edges;
  std::vector<std::uint32_t> counts;
};

void AddLesson(const PointCloud& cloud, const Entities& entities, Lesson& lesson) {
  std::vector<std::map<ClassIndex, std::uint32_t>> votes(entities.sizes.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (cloud.label[i] == 0) continue;
    ++votes[entities.of_point[i]][static_cast<ClassIndex>(cloud.label[i] - 1)];
  }
  std::vector<std::uint32_t> row_of(votes.size(), UINT32_MAX);
  std::vector<std::size_t> known;
  for (std::size_t e = 0; e < votes.size(); ++e) {
    if (votes[e].empty()) continue;
    row_of[e] = static_cast<std::uint32_t>(lesson.data.size());
    const auto most = std::max_element(
        votes[e].begin(), votes[e].end(), [](auto& a, auto& b) { return a.second < b.second; });
    lesson.data.labels.push_back(most->first);
    lesson.counts.push_back(entities.sizes[e]);
    known.push_back(e);
  }
  for (const NetworkEdge& edge : entities.edges) {
    if (row_of[edge.i] == UINT32_MAX || row_of[edge.j] == UINT32_MAX) continue;
    lesson.edges.push_back({row_of[edge.i], row_of[edge.j]});
  }
  FeatureMatrix& features = lesson.data.features;
  const Eigen::Index before = features.rows();
  features.conservativeResize(before + static_cast<Eigen::Index>(known.size()),
                              entities.features.cols());
  features.bottomRows(static_cast<Eigen::Index>(known.size())) =
      entities.features(known, Eigen::all);
}

// Two second levels: boosting, and a network of the entities that weigh as many points as they
// have.
struct SecondLevel {
  AdaBoost boosted;
  AmnWeights network;
  Eigen::RowVectorXf mean, deviation;

  FeatureMatrix Standardised(FeatureMatrix features) const {
    features.rowwise() -= mean;
    features.array().rowwise() /= deviation.array();
    return features;
  }
};

SecondLevel LearnSecond(const Lesson& lesson) {
  SecondLevel second;
  second.boosted = LearnAdaBoost(lesson.data, {.rounds = 200}, Stop()).value();
  const FeatureMatrix& x = lesson.data.features;
  second.mean = x.colwise().mean();
  second.deviation = ((x.rowwise() - second.mean).colwise().squaredNorm() /
                      static_cast<float>(std::max<Eigen::Index>(1, x.rows())))
                         .cwiseSqrt()
                         .cwiseMax(1e-6F);
  second.mean.tail(1).setZero();
  second.deviation.tail(1).setOnes();
  const std::vector<std::uint32_t> inner(lesson.counts.size(), 0);
  const FeatureMatrix features = second.Standardised(x);
  second.network =
      LearnByCuttingPlanes(
          {features, lesson.edges, lesson.data.labels, lesson.data.classes, lesson.counts, inner},
          {.tolerance = 1e-3},
          Stop())
          .value()
          .weights;
  return second;
}

// A class that none of the clouds has cannot be learned.
Classifier LearnFirst(const std::vector<PointCloud>& clouds,
                      const std::vector<ClassName>& classes,
                      ClassifierMethod method) {
  TrainingOptions options;
  options.method = method;
  std::vector<ClassName> present;
  for (const ClassName& name : classes) {
    const bool known = std::any_of(clouds.begin(), clouds.end(), [&](const PointCloud& cloud) {
      return std::find(cloud.label.begin(), cloud.label.end(), name.id) != cloud.label.end();
    });
    if (known) present.push_back(name);
  }
  return TrainClassifier(
             clouds, present, options, [](double) { return absl::OkStatus(); }, Stop())
      .value();
}

// Places in all classes, whose ids are 1, 2, …
std::vector<ClassIndex> LabelFirst(const Classifier& first, const PointCloud& cloud) {
  std::vector<ClassIndex> labels = Classify(first, cloud, Stop()).value().labels;
  for (ClassIndex& label : labels) {
    label = static_cast<ClassIndex>(first.classes[label].id - 1);
  }
  return labels;
}

// One cloud as two, left and right of its middle.
std::vector<PointCloud> Halves(const PointCloud& cloud) {
  std::vector<float> xs;
  for (const Eigen::Vector3f& p : cloud.points) xs.push_back(p.x());
  std::nth_element(xs.begin(), xs.begin() + static_cast<std::ptrdiff_t>(xs.size() / 2), xs.end());
  std::vector<PointCloud> halves(2);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    PointCloud& half = halves[cloud.points[i].x() < xs[xs.size() / 2] ? 0 : 1];
    half.sensor_origin = cloud.sensor_origin;
    half.points.push_back(cloud.points[i]);
    half.label.push_back(cloud.label[i]);
  }
  return halves;
}

// Each half of the clouds is labelled by what the other half taught.
Lesson MakeLesson(std::vector<PointCloud> clouds,
                  const std::vector<ClassName>& classes,
                  ClassifierMethod method) {
  if (clouds.size() == 1) clouds = Halves(clouds.front());
  Lesson lesson;
  lesson.data.classes = classes.size();
  for (const bool out : {false, true}) {
    std::vector<PointCloud> learned;
    std::vector<const PointCloud*> asked;
    for (std::size_t k = 0; k < clouds.size(); ++k) {
      if ((k % 2 == 1) == out) {
        asked.push_back(&clouds[k]);
      } else {
        learned.push_back(clouds[k]);
      }
    }
    const Classifier first = LearnFirst(learned, classes, method);
    for (const PointCloud* cloud : asked) {
      const std::vector<ClassIndex> labels = LabelFirst(first, *cloud);
      AddLesson(*cloud, EntityFinder(*cloud, labels, classes.size()).Run(), lesson);
    }
  }
  return lesson;
}

struct Outcome {
  explicit Outcome(std::size_t classes) : first(classes), boosted(classes), network(classes) {}
  ConfusionMatrix first, boosted, network;
};

void Count(const PointCloud& cloud,
           const std::vector<ClassIndex>& of_entity,
           const std::vector<std::uint32_t>& entity_of,
           ConfusionMatrix& matrix) {
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (cloud.label[i] == 0) continue;
    matrix.Add(static_cast<ClassIndex>(cloud.label[i] - 1), of_entity[entity_of[i]]);
  }
}

void RunSplit(const std::vector<PointCloud>& train,
              const std::vector<PointCloud>& test,
              const std::vector<ClassName>& classes,
              ClassifierMethod method,
              Outcome& outcome) {
  const Lesson lesson = MakeLesson(train, classes, method);
  const SecondLevel second = LearnSecond(lesson);
  const Classifier first = LearnFirst(train, classes, method);
  for (const PointCloud& cloud : test) {
    const std::vector<ClassIndex> labels = LabelFirst(first, cloud);
    const Entities entities = EntityFinder(cloud, labels, classes.size()).Run();
    std::vector<ClassIndex> before(entities.sizes.size());
    for (std::size_t i = 0; i < labels.size(); ++i) before[entities.of_point[i]] = labels[i];
    Count(cloud, before, entities.of_point, outcome.first);
    Count(cloud,
          AdaBoostLabels(second.boosted, entities.features),
          entities.of_point,
          outcome.boosted);
    const FeatureMatrix features = second.Standardised(entities.features);
    // Learned with a row's points all in it, so that an edge weighs against all of them.
    AmnProblem problem = MakeAmnProblem(second.network, features, entities.edges);
    for (std::size_t e = 0; e < entities.sizes.size(); ++e) {
      problem.node_scores.row(static_cast<Eigen::Index>(e)) *= entities.sizes[e];
    }
    Count(cloud, MaximizeScore(problem, Stop()).value().labels, entities.of_point, outcome.network);
  }
  std::fprintf(stderr, "%zu entities learned from\n", lesson.data.size());
}

void PrintRow(const char* name, const ConfusionMatrix& matrix) {
  std::printf("%-26s %8.4f %8.4f ", name, matrix.Accuracy(), matrix.MeanIou());
  for (std::size_t k = 0; k < matrix.classes(); ++k) {
    std::printf(" %10.3f", matrix.Iou(k).value_or(std::nan("")));
  }
  std::printf("\n");
}

bool IsAhead(const ConfusionMatrix& a, const ConfusionMatrix& b) {
  return a.Accuracy() > b.Accuracy() && a.MeanIou() > b.MeanIou();
}

int Main(int argc, char** argv) {
  CLI::App app("a second level of classification on recorded clouds");
  std::string data = "folds";
  std::string name = "amn";
  app.add_option("--data", data)->check(CLI::IsMember({"oakland", "folds", "wachtberg"}));
  app.add_option("--method", name, "of the first level");
  CLI11_PARSE(app, argc, argv);
  const ClassifierMethod method = ClassifierMethodFromName(name).value();
  const LabelledClouds learned =
      data == "wachtberg" ? testing::ReadWachtbergHalves() : testing::ReadOakland("part3");
  if (learned.clouds.empty()) {
    std::printf("%s: no data\n", data.c_str());
    return 0;
  }
  Outcome outcome(learned.classes.size());
  if (data == "oakland") {
    RunSplit(
        learned.clouds, testing::ReadOakland("part2").clouds, learned.classes, method, outcome);
  } else {
    const std::size_t folds = data == "wachtberg" ? 2 : 3;
    for (std::size_t fold = 0; fold < folds; ++fold) {
      std::vector<PointCloud> train, test;
      for (std::size_t i = 0; i < learned.clouds.size(); ++i) {
        const bool out = i * folds / learned.clouds.size() == fold;
        (out ? test : train).push_back(learned.clouds[i]);
      }
      RunSplit(train, test, learned.classes, method, outcome);
    }
  }
  std::printf("%-26s %8s %8s ", data.c_str(), "accuracy", "mean IoU");
  for (const ClassName& of : learned.classes) std::printf(" %10s", of.name.c_str());
  std::printf("\n");
  PrintRow((name + " alone").c_str(), outcome.first);
  PrintRow("and boosted entities", outcome.boosted);
  PrintRow("and a network of entities", outcome.network);
  return IsAhead(outcome.boosted, outcome.first) || IsAhead(outcome.network, outcome.first) ? 0 : 1;
}

}  // namespace
}  // namespace strata

int main(int argc, char** argv) { return strata::Main(argc, argv); }
