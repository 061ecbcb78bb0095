#include "tests/fuzz/rpc_examples.h"

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include <google/protobuf/text_format.h>

#include "core/classification/classifier_codec.h"
#include "core/classification/training.h"
#include "core/codec/local_map_codec.h"
#include "core/mls/build.h"
#include "core/world/scan_hash.h"
#include "proto/translate/points.h"
#include "proto/translate/scans.h"
#include "strata/v1/classifiers.pb.h"
#include "strata/v1/posegraph.pb.h"
#include "strata/v1/scans.pb.h"
#include "tests/fuzz/proto_mutator.h"
#include "tests/fuzz/require.h"
#include "tests/fuzz/small_world.h"

namespace strata::fuzz {
namespace {

using google::protobuf::MethodDescriptor;

// Of the calls that take one message: path behind the package, and request. Those with variants
// come more than once.
const std::multimap<std::string, std::string>& Examples() {
  static const auto* const examples = new std::multimap<std::string, std::string>{
      {"Maps/Create", "name: 'other' parameters { mls { cell_size_m: 0.1 } fade_after: 2 }"},
      {"Maps/Get", "name: 'world'"},
      {"Maps/List", ""},
      {"Maps/Delete", "name: 'other'"},
      {"Maps/Stats", "name: 'world'"},
      {"Maps/History", "name: 'world'"},
      {"Maps/ListClasses", "name: 'world'"},
      {"Maps/SetClass", "name: 'world' map_class { id: 2 name: 'box' colour: 255 }"},
      {"Maps/SetOrigin", "name: 'world' origin { latitude_rad: 0.8 longitude_rad: 0.2 }"},
      {"Maps/Watch", "name: 'world' tiles: true once: true"},
      {"Maps/Watch", "name: 'world' since: 2 epoch: 1 trajectory: 'world'"},
      {"Maps/Backup", "name: 'world'"},
      {"Scans/GetUploadState", "map: 'world' trajectory: 'run'"},
      {"Scans/Get", "map: 'world' id { trajectory: 'world' sequence: 1 }"},
      {"Scans/List", "map: 'world' box { min { x: -9 y: -9 } max { x: 3 y: 3 } }"},
      {"Scans/List", "map: 'world' state: SCAN_STATE_INTEGRATED from { seconds: 1600000002 }"},
      {"Scans/GetPoints", "map: 'world' id { trajectory: 'world' sequence: 2 }"},
      {"Scans/GetFaded", "map: 'world' id { trajectory: 'world' sequence: 2 }"},
      {"Scans/Delete", "map: 'world' id { trajectory: 'run' sequence: 1 }"},
      {"Scans/Delete", "map: 'world' id { trajectory: 'world' sequence: 3 }"},
      {"Tiles/Get", "map: 'world' key { level: 0 x: -1 y: 0 }"},
      {"Tiles/List", "map: 'world' area { level: 1 x_min: -2 x_max: 2 epoch: 2 }"},
      {"Tiles/Fetch", "map: 'world' area { epoch: 2 }"},
      {"Tiles/Fetch",
       "map: 'world' area { level: 0 } held { key { x: -1 y: 0 } version: 1 } "
       "held { key { x: 7 y: 7 } version: 2 }"},
      {"Planning/PlanPath",
       "map: 'world' from { x_m: -6 y_m: 0.7 z_m: 0 } to { x_m: 1 y_m: 2 z_m: 0 } "
       "profile { radius_m: 0.2 height_m: 0.3 max_step_m: 2 max_slope_rad: 1.4 max_gap_m: 1 "
       "max_roughness_m: 5 }"},
      {"Planning/PlanPath",
       "map: 'world' from { x_m: -6 y_m: 0.7 level: 0 } to { x_m: -5 y_m: 1 level: 0 } "
       "profile { radius_m: 0.1 max_gap_m: 1 } max_expanded: 1000 "
       "class_costs { class_id: 1 factor: 2 } class_costs { class_id: 2 forbidden: true }"},
      {"Planning/CheckPath",
       "map: 'world' waypoints { x: -6 y: 0.7 } waypoints { x: -5 y: 1 } waypoints { x: 1 y: 2 } "
       "profile { radius_m: 0.2 height_m: 0.3 max_step_m: 2 max_gap_m: 1 max_roughness_m: 5 } "
       "known { valid: true epoch: 1 commit_sequence: 3 tiles { x: -1 } }"},
      {"Planning/WatchPath",
       "map: 'world' waypoints { x: -6 y: 0.7 } waypoints { x: -5 y: 1 } "
       "profile { radius_m: 0.2 height_m: 0.3 max_step_m: 2 max_gap_m: 1 max_roughness_m: 5 }"},
      {"Planning/ListFloors",
       "map: 'world' at { x_m: -6 y_m: 0.7 } min_area_m2: 0 cells: true "
       "profile { radius_m: 0.1 height_m: 0.3 max_step_m: 2 max_gap_m: 1 max_roughness_m: 5 }"},
      {"Planning/ListPlaces",
       "map: 'world' at { x_m: -6 y_m: 0.7 } cells: true "
       "profile { radius_m: 0.1 height_m: 0.3 max_step_m: 2 max_gap_m: 1 max_roughness_m: 5 }"},
      {"Planning/Explore",
       "map: 'world' from { x_m: -6 y_m: 0.7 } count: 2 resolution_m: 0.5 min_bits: 1 "
       "sensor { rows: 4 columns: 90 max_range_m: 6 } "
       "profile { radius_m: 0.1 height_m: 0.3 max_step_m: 2 max_gap_m: 1 max_roughness_m: 5 }"},
      {"Planning/CheckShape",
       "map: 'world' waypoints { x: -6 y: 0.7 } waypoints { x: -5 y: 1 } clearance_m: 0.1 "
       "shape { xyz: [0, 0, 0.2, 1, 0, 0.2, 0, 1, 0.5] triangles: [0, 1, 2] "
       "parts { kind: SHAPE_KIND_CYLINDER size { x: 0.3 z: 1 } "
       "pose { translation { z: 0.6 } } } }"},
      {"Planning/SampleSurfaces", "map: 'world' places { x: -6 y: 0.7 } places { x: 2 y: 2 }"},
      {"Planning/SetProfile", "map: 'world' name: 'slim' profile { radius_m: 0.1 height_m: 0.3 }"},
      {"Planning/ListProfiles", "map: 'world'"},
      {"Models/GetPlaneModel", "map: 'world'"},
      {"Objects/ListEntities",
       "map: 'world' class_id: 2 region { min { x: -9 y: -9 z: -9 } max { x: 9 y: 9 z: 9 } }"},
      {"Objects/ListKinds", "map: 'world'"},
      {"Objects/GetKind", "map: 'world' kind: 'box'"},
      {"Objects/RenameKind", "map: 'world' kind: 'box' name: 'crate'"},
      {"Objects/ImportKind",
       "map: 'world' name: 'box' class_name: 'thing' "
       "shape { points: [0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1, "
       "0.5, 0, 0, 0, 0.5, 0, 0.5, 1, 0, 1, 0.5, 0, 0.5, 0, 1, 0, 0.5, 1, 0.5, 1, 1, 1, 0.5, 1, "
       "0, 0, 0.5, 1, 0, 0.5, 0, 1, 0.5, 1, 1, 0.5] "
       "vertices: [0, 0, 0, 1, 0, 0, 0, 1, 0] triangles: [0, 1, 2] }"},
      {"Objects/DeleteKind", "map: 'world' kind: 'box'"},
      {"Objects/ListInferred",
       "map: 'world' class_id: 2 region { min { x: -9 y: -9 z: -9 } max { x: 9 y: 9 z: 9 } }"},
      {"PoseGraph/Get", "map: 'world'"},
      {"PoseGraph/SetPose",
       "map: 'world' id { trajectory: 'world' sequence: 2 } "
       "pose { translation { x: -2 y: 1.4 } rotation { z: 0.6 w: 0.8 } }"},
      {"PoseGraph/RemoveConstraint", "map: 'world' id: 1"},
      {"PoseGraph/EnableConstraint", "map: 'world' id: 1 enabled: true"},
      {"PoseGraph/LookupPose", "map: 'world' id { trajectory: 'run' sequence: 1 }"},
      {"Jobs/Start", "map: 'world' kind: 'rebuild'"},
      {"Jobs/Start", "map: 'world' kind: 'verify'"},
      {"Jobs/Start",
       "map: 'world' kind: 'optimize' parameters { key: 'dry_run' value: '1' } "
       "parameters { key: 'rounds' value: '1' }"},
      {"Jobs/Start", "map: 'world' kind: 'revert' parameters { key: 'epoch' value: '1' }"},
      {"Jobs/Start",
       "map: 'world' kind: 'train' parameters { key: 'method' value: 'bayes' } "
       "parameters { key: 'folds' value: '0' }"},
      {"Jobs/Start", "map: 'world' kind: 'evaluate' parameters { key: 'model' value: 'first' }"},
      {"Jobs/Start", "map: 'world' kind: 'classify' parameters { key: 'model' value: 'first' }"},
      {"Jobs/Start", "map: 'world' kind: 'fade'"},
      {"Jobs/Get", "map: 'world' id: 1"},
      {"Jobs/List", "map: 'world'"},
      {"Jobs/Cancel", "map: 'world' id: 2"},
      {"Jobs/Accept", "map: 'world' id: 2"},
      {"Jobs/Revert", "map: 'world' id: 2"},
      {"Jobs/Watch", "map: 'world' id: 2"},
      {"Classifiers/Get", "map: 'world' name: 'first'"},
      {"Classifiers/List", "map: 'world'"},
      {"Classifiers/Delete", "map: 'world' name: 'first'"},
      {"Classifiers/Export", "map: 'world' name: 'first'"},
  };
  return *examples;
}

template <typename Request>
Request& AddRequest(RpcCall& call) {
  call.requests.push_back(NewRequest(*call.method));
  return static_cast<Request&>(*call.requests.back());
}

PointCloud SomeFloor(int points, std::minstd_rand& random) {
  const auto coordinate = [&] { return static_cast<float>(random() % 1000) / 100.0F - 5.0F; };
  PointCloud cloud;
  for (int i = 0; i < points; ++i) cloud.points.emplace_back(coordinate(), coordinate(), 0.01F);
  return cloud;
}

v1::ScanStart AnyStart(std::minstd_rand& random) {
  v1::ScanStart start;
  start.set_map("world");
  start.set_resume(random() % 2 == 0);
  v1::ScanHeader& header = *start.mutable_header();
  header.mutable_id()->set_trajectory(random() % 4 == 0 ? "world" : "run");
  header.mutable_id()->set_sequence(1 + random() % 3);
  header.mutable_pose()->mutable_translation()->set_x(static_cast<double>(random() % 3));
  header.set_alignment(random() % 2 == 0 ? v1::ALIGNMENT_ON : v1::ALIGNMENT_OFF);
  if (random() % 4 != 0) header.set_content_hash("announced");
  return start;
}

// One scan in one to three chunks; every fourth breaks off.
template <typename Request>
void AddScan(RpcCall& call, std::minstd_rand& random) {
  *AddRequest<Request>(call).mutable_start() = AnyStart(random);
  const unsigned chunks = 1 + random() % 3;
  for (unsigned i = 0; i < chunks; ++i) {
    const int points = 1 + static_cast<int>(random() % 40);
    *AddRequest<Request>(call).mutable_chunk() = translate::ToProto(SomeFloor(points, random));
  }
  Announce(call);
  if (random() % 4 == 0) {
    call.cut = true;
    call.requests.pop_back();
  }
}

void AddLocalMap(RpcCall& call, std::minstd_rand& random) {
  MlsParameters parameters;
  parameters.cell_size_m = kWorldCellSizeM;
  const auto built =
      BuildMlsMap(SomeFloor(40, random), Pose::Identity(), SensorModel(), parameters);
  Require(built.ok(), "points make a local map");
  auto& start = *AddRequest<v1::UploadLocalMapRequest>(call).mutable_start();
  start.set_map("world");
  start.mutable_header()->mutable_id()->set_trajectory("run");
  start.mutable_header()->mutable_id()->set_sequence(1 + random() % 3);
  start.set_cell_size_m(parameters.cell_size_m);
  start.set_gap_size_m(parameters.gap_size_m);
  start.set_thickness_m(parameters.thickness_m);
  AddRequest<v1::UploadLocalMapRequest>(call).set_local_map(*EncodeLocalMap(built->map));
}

void AddLabels(RpcCall& call, std::minstd_rand& random) {
  v1::SetScanLabelsStart& start = *AddRequest<v1::SetScanLabelsRequest>(call).mutable_start();
  start.set_map("world");
  start.mutable_id()->set_trajectory("world");
  start.mutable_id()->set_sequence(1 + random() % kWorldScans);
  start.set_update(random() % 2 == 0);
  std::vector<std::uint16_t> labels(kWorldPoints);
  for (std::uint16_t& label : labels) label = static_cast<std::uint16_t>(random() % 3);
  AddRequest<v1::SetScanLabelsRequest>(call).set_labels(translate::PackLabels(labels));
}

void AddLocalize(RpcCall& call, std::minstd_rand& random) {
  const int points = 20 + static_cast<int>(random() % 200);
  v1::LocalizeStart& start = *AddRequest<v1::LocalizeRequest>(call).mutable_start();
  start.set_map("world");
  start.set_point_count(static_cast<std::uint64_t>(points));
  if (random() % 2 == 0) start.mutable_guess()->mutable_translation()->set_x(-6.0);
  *AddRequest<v1::LocalizeRequest>(call).mutable_chunk() =
      translate::ToProto(SomeFloor(points, random));
}

void AddTrack(RpcCall& call, std::minstd_rand& random) {
  v1::TrackStart& start = *AddRequest<v1::TrackRequest>(call).mutable_start();
  start.set_map("world");
  if (random() % 2 == 0) start.mutable_guess()->mutable_translation()->set_x(-6.0);
  for (int k = 0; k < 3; ++k) {
    const int points = 20 + static_cast<int>(random() % 200);
    v1::TrackStep& step = *AddRequest<v1::TrackRequest>(call).mutable_step();
    step.mutable_odometry()->mutable_translation()->set_x(0.5 * k);
    if (random() % 4 == 0) continue;  // without points
    step.set_point_count(static_cast<std::uint64_t>(points));
    *AddRequest<v1::TrackRequest>(call).mutable_chunk() =
        translate::ToProto(SomeFloor(points, random));
  }
}

void AddConstraint(RpcCall& call, std::minstd_rand& random) {
  auto& request = AddRequest<v1::AddConstraintRequest>(call);
  request.set_map("world");
  v1::Constraint& constraint = *request.mutable_constraint();
  constraint.mutable_i()->set_trajectory("world");
  constraint.mutable_i()->set_sequence(1);
  constraint.mutable_j()->set_trajectory("world");
  constraint.mutable_j()->set_sequence(2 + random() % 2);
  constraint.mutable_pose()->mutable_translation()->set_x(4.0);
  constraint.mutable_pose()->mutable_rotation()->set_w(1.0);
  for (int i = 0; i < 36; ++i) constraint.add_information(i % 7 == 0 ? 100.0 : 0.0);
}

const std::string& ClassifierBytes() {
  static const auto* const bytes = [] {
    std::minstd_rand random(1);
    PointCloud cloud = SomeFloor(200, random);
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      cloud.label.push_back(static_cast<std::uint16_t>(1 + i % 2));
      if (i % 2 == 1) cloud.points[i].z() += 1.0F;
    }
    TrainingOptions options;
    options.method = ClassifierMethod::kAdaBoost;  // whose bytes are few
    options.rounds = 3;
    const auto learned = TrainClassifier(
        {cloud},
        {{1, "floor"}, {2, "box"}},
        options,
        [](double) { return absl::OkStatus(); },
        Stop());
    Require(learned.ok(), "labelled points make a classifier");
    return new std::string(EncodeClassifier(*learned));
  }();
  return *bytes;
}

void AddImport(RpcCall& call) {
  auto& start = *AddRequest<v1::ImportClassifierRequest>(call).mutable_start();
  start.set_map("world");
  start.set_name("second");
  AddRequest<v1::ImportClassifierRequest>(call).set_bytes(ClassifierBytes());
}

RpcCall CallOf(const MethodDescriptor& method, const std::string& text) {
  RpcCall call;
  call.method = &method;
  call.requests.push_back(NewRequest(method));
  Require(google::protobuf::TextFormat::ParseFromString(text, call.requests.back().get()),
          "an example is a request of its call");
  return call;
}

std::string KeyOf(const MethodDescriptor& method) {
  return absl::StrCat(method.service()->name(), "/", method.name());
}

const MethodDescriptor& MethodOf(absl::string_view key) {
  for (const MethodDescriptor* method : AllMethods()) {
    if (KeyOf(*method) == key) return *method;
  }
  Require(false, "a story has calls that there are");
  return *AllMethods()[0];
}

RpcCall AnyText(const MethodDescriptor& method, std::minstd_rand& random) {
  const auto [begin, end] = Examples().equal_range(KeyOf(method));
  const auto count = static_cast<unsigned>(std::distance(begin, end));
  Require(count > 0, "every call has an example");
  return CallOf(method, std::next(begin, static_cast<int>(random() % count))->second);
}

// The next job of the small world is its second.
constexpr char kNextJob[] = "map: 'world' id: 2";

using Story = std::vector<std::pair<absl::string_view, std::string>>;

const std::vector<Story>& Stories() {
  static const auto* const stories = new std::vector<Story>{
      {{"Jobs/Start", "map: 'world' kind: 'optimize' parameters { key: 'dry_run' value: '1' }"},
       {"Jobs/Watch", kNextJob},
       {"Jobs/Accept", kNextJob},
       {"Tiles/Fetch", "map: 'world' area { epoch: 2 }"},
       {"Jobs/Revert", kNextJob}},
      {{"Jobs/Start", "map: 'world' kind: 'optimize'"},
       {"Jobs/Watch", kNextJob},
       {"Maps/Watch", "name: 'world' since: 3 epoch: 2 tiles: true once: true"},
       {"Jobs/Start", "map: 'world' kind: 'revert' parameters { key: 'epoch' value: '1' }"},
       {"Tiles/List", "map: 'world' area { epoch: 1 }"}},
      {{"Objects/ImportKind",
        "map: 'world' name: 'box' class_name: 'thing' "
        "shape { points: [0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1, "
        "0.5, 0, 0, 0, 0.5, 0, 0.5, 1, 0, 1, 0.5, 0, 0.5, 0, 1, 0, 0.5, 1, 0.5, 1, 1, 1, 0.5, 1, "
        "0, 0, 0.5, 1, 0, 0.5, 0, 1, 0.5, 1, 1, 0.5] }"},
       {"Jobs/Start", "map: 'world' kind: 'objects'"},
       {"Jobs/Watch", kNextJob},
       {"Objects/RenameKind", "map: 'world' kind: 'box' name: 'crate'"},
       {"Objects/GetKind", "map: 'world' kind: 'crate'"},
       {"Objects/ListEntities", "map: 'world' kind: 'crate'"},
       {"Jobs/Start", "map: 'world' kind: 'complete'"},
       {"Jobs/Watch", kNextJob},
       {"Objects/ListInferred", "map: 'world' kind: 'crate'"},
       {"Objects/DeleteKind", "map: 'world' kind: 'crate'"},
       {"Objects/ListKinds", "map: 'world'"}},
      {{"Jobs/Start", "map: 'world' kind: 'classify' parameters { key: 'model' value: 'first' }"},
       {"Jobs/Watch", kNextJob},
       {"Scans/GetPoints", "map: 'world' id { trajectory: 'world' sequence: 1 }"},
       {"Classifiers/Delete", "map: 'world' name: 'first'"},
       {"Jobs/Start", "map: 'world' kind: 'verify'"}},
      {{"Scans/Delete", "map: 'world' id { trajectory: 'world' sequence: 2 }"},
       {"Models/GetPlaneModel", "map: 'world'"},
       {"Objects/ListEntities", "map: 'world'"},
       {"PoseGraph/Get", "map: 'world'"},
       {"Jobs/Start", "map: 'world' kind: 'rebuild'"},
       {"Tiles/Fetch", "map: 'world' area { epoch: 1 }"},
       {"Planning/SampleSurfaces", "map: 'world' places { x: -2 y: 1.4 }"}},
  };
  return *stories;
}

template <typename Request>
void AnnounceScans(RpcCall& call) {
  v1::ScanHeader* header = nullptr;
  PointCloud cloud;
  const auto finish = [&] {
    if (header == nullptr) return;
    header->set_point_count(cloud.size());
    if (header->content_hash().empty()) return;
    header->clear_content_hash();
    const auto translated = translate::FromProto(*header);
    const auto fits = [&](const auto& column) {
      return column.empty() || column.size() == cloud.size();
    };
    const bool even = fits(cloud.intensity) && fits(cloud.colour) && fits(cloud.label);
    header->set_content_hash(translated.ok() && even ? ContentHashOf(*translated, cloud)
                                                     : "unknown");
  };
  for (auto& message : call.requests) {
    auto& request = static_cast<Request&>(*message);
    if (request.has_start()) {
      finish();
      header = request.mutable_start()->mutable_header();
      cloud = {};
      continue;
    }
    const auto chunk = translate::FromProto(request.chunk());
    if (!chunk.ok()) continue;
    const auto append = [](const auto& from, auto& to) {
      to.insert(to.end(), from.begin(), from.end());
    };
    append(chunk->points, cloud.points);
    append(chunk->intensity, cloud.intensity);
    append(chunk->colour, cloud.colour);
    append(chunk->label, cloud.label);
  }
  finish();
}

RpcCall AnExample(const MethodDescriptor& method, std::minstd_rand& random) {
  RpcCall call;
  call.method = &method;
  const absl::string_view input = method.input_type()->name();
  if (input == "UploadScanRequest") {
    AddScan<v1::UploadScanRequest>(call, random);
  } else if (input == "IngestScansRequest") {
    AddScan<v1::IngestScansRequest>(call, random);
    if (random() % 2 == 0) AddScan<v1::IngestScansRequest>(call, random);
  } else if (input == "UploadLocalMapRequest") {
    AddLocalMap(call, random);
  } else if (input == "SetScanLabelsRequest") {
    AddLabels(call, random);
  } else if (input == "LocalizeRequest") {
    AddLocalize(call, random);
  } else if (input == "TrackRequest") {
    AddTrack(call, random);
  } else if (input == "AddConstraintRequest") {
    AddConstraint(call, random);
  } else if (input == "ImportClassifierRequest") {
    AddImport(call);
  } else {
    return AnyText(method, random);
  }
  return call;
}

// A scan that comes in two tries, goes, and comes again.
RpcScript ScanStory(std::minstd_rand& random) {
  RpcScript script;
  script.push_back(AnExample(MethodOf("Scans/Upload"), random));
  script[0].cut = false;
  script.push_back(CopyOf(script[0]));
  script.insert(script.begin(), BreakOff(script[0], random));
  script.insert(
      script.begin() + 2,
      CallOf(
          MethodOf("Scans/Delete"),
          absl::StrCat("map: 'world' id { trajectory: 'run' sequence: ", 1 + random() % 3, " }")));
  script.push_back(CopyOf(script.back()));
  return script;
}

}  // namespace

RpcCall AnyExample(std::minstd_rand& random) {
  return AnExample(*AllMethods()[random() % AllMethods().size()], random);
}

RpcScript AnyStory(std::minstd_rand& random) {
  const std::size_t which = random() % (Stories().size() + 1);
  if (which == Stories().size()) return ScanStory(random);
  RpcScript script;
  for (const auto& [key, text] : Stories()[which]) script.push_back(CallOf(MethodOf(key), text));
  return script;
}

RpcCall BreakOff(RpcCall& call, std::minstd_rand& random) {
  const std::size_t sent = 1 + random() % call.requests.size();
  RpcCall first{.method = call.method, .requests = {}, .cut = random() % 2 == 0};
  first.held = !first.cut;
  for (std::size_t i = 0; i < sent; ++i) {
    first.requests.push_back(NewRequest(*call.method));
    first.requests.back()->CopyFrom(*call.requests[i]);
  }
  const auto* start = dynamic_cast<const v1::UploadScanRequest*>(call.requests[0].get());
  if (start != nullptr && start->start().resume()) {
    call.requests.erase(call.requests.begin() + 1,
                        call.requests.begin() + static_cast<std::ptrdiff_t>(sent));
  }
  if (random() % 4 == 0) Mutate(*first.requests[0], random);  // claims the same, says another thing
  return first;
}

void Announce(RpcCall& call) {
  const absl::string_view input = call.method->input_type()->name();
  if (input == "UploadScanRequest") AnnounceScans<v1::UploadScanRequest>(call);
  if (input == "IngestScansRequest") AnnounceScans<v1::IngestScansRequest>(call);
}

}  // namespace strata::fuzz
