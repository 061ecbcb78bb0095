// Every field of every message survives wire → core → wire. The messages are filled by reflection,
// so that a field that is added and forgotten in the translation fails here.
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include <gmock/gmock.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include "proto/translate/jobs.h"
#include "proto/translate/localize.h"
#include "proto/translate/maps.h"
#include "proto/translate/models.h"
#include "proto/translate/objects.h"
#include "proto/translate/places.h"
#include "proto/translate/planning.h"
#include "proto/translate/posegraph.h"
#include "proto/translate/scans.h"
#include "proto/translate/shape.h"
#include "proto/translate/tiles.h"
#include "proto/translate/track.h"
#include "proto/translate/watch.h"
#include "tests/support/status_matchers.h"

namespace strata::translate {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

// Gives every field another value that its range allows.
class Filler {
 public:
  void Fill(Message& message) {
    const auto& descriptor = *message.GetDescriptor();
    if (descriptor.full_name() == "strata.v1.Quaternion") {
      FillQuaternion(message);
      return;
    }
    if (descriptor.full_name() == "strata.v1.Plane") {
      FillPlane(message);
      return;
    }
    for (int i = 0; i < descriptor.field_count(); ++i) {
      const FieldDescriptor& field = *descriptor.field(i);
      // Of alternatives the last one stays.
      if (field.is_map()) {
        FillMap(message, field);
      } else if (field.is_repeated()) {
        const bool matrix = field.name() == "information" || field.name() == "covariance";
        const int count = matrix ? 36 : field.name() == "xyz" ? 9 : 2;
        for (int n = 0; n < count; ++n) Add(message, field);
      } else {
        Set(message, field);
      }
    }
  }

 private:
  void FillQuaternion(Message& message) {
    auto& q = dynamic_cast<v1::Quaternion&>(message);
    q.set_x(0.5);
    q.set_y(-0.5);
    q.set_z(0.5);
    q.set_w(0.5);
  }

  static void FillPlane(Message& message) {
    auto& plane = dynamic_cast<v1::Plane&>(message);
    plane.mutable_normal()->set_x(0.6);
    plane.mutable_normal()->set_z(-0.8);
    plane.set_distance(-7.5);
  }

  // Small, positive, growing.
  double Real() { return 0.01 + 0.001 * ++count_; }
  std::string Text() { return absl::StrCat("text", ++count_); }
  int Whole(const FieldDescriptor& field) { return field.name() == "level" ? 3 : ++count_; }
  static int LastValue(const FieldDescriptor& field) {
    return field.enum_type()->value(field.enum_type()->value_count() - 1)->number();
  }

  void Set(Message& message, const FieldDescriptor& field) {
    const Reflection& reflection = *message.GetReflection();
    switch (field.cpp_type()) {
      case FieldDescriptor::CPPTYPE_INT32:
        return reflection.SetInt32(&message, &field, Whole(field));
      case FieldDescriptor::CPPTYPE_INT64:
        return reflection.SetInt64(&message, &field, Whole(field));
      case FieldDescriptor::CPPTYPE_UINT32:
        return reflection.SetUInt32(&message, &field, static_cast<std::uint32_t>(Whole(field)));
      case FieldDescriptor::CPPTYPE_UINT64:
        return reflection.SetUInt64(&message, &field, static_cast<std::uint64_t>(Whole(field)));
      case FieldDescriptor::CPPTYPE_DOUBLE:
        return reflection.SetDouble(&message, &field, Real());
      case FieldDescriptor::CPPTYPE_FLOAT:
        return reflection.SetFloat(&message, &field, static_cast<float>(Real()));
      case FieldDescriptor::CPPTYPE_BOOL:
        return reflection.SetBool(&message, &field, field.name() != "keep_points");
      case FieldDescriptor::CPPTYPE_ENUM:
        return reflection.SetEnumValue(&message, &field, LastValue(field));
      case FieldDescriptor::CPPTYPE_STRING:
        return reflection.SetString(
            &message, &field, field.name() == "content_hash" ? std::string(32, 'c') : Text());
      case FieldDescriptor::CPPTYPE_MESSAGE:
        return Fill(*reflection.MutableMessage(&message, &field));
    }
  }

  void Add(Message& message, const FieldDescriptor& field) {
    const Reflection& reflection = *message.GetReflection();
    if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
      return Fill(*reflection.AddMessage(&message, &field));
    }
    if (field.cpp_type() == FieldDescriptor::CPPTYPE_FLOAT) {
      return reflection.AddFloat(&message, &field, static_cast<float>(Real()));
    }
    if (field.cpp_type() == FieldDescriptor::CPPTYPE_UINT32) {
      return reflection.AddUInt32(&message, &field, static_cast<std::uint32_t>(++count_));
    }
    if (field.cpp_type() == FieldDescriptor::CPPTYPE_INT32) {
      return reflection.AddInt32(&message, &field, ++count_);
    }
    ASSERT_EQ(field.cpp_type(), FieldDescriptor::CPPTYPE_DOUBLE) << field.full_name();
    reflection.AddDouble(&message, &field, Real());
  }

  void FillMap(Message& message, const FieldDescriptor& field) {
    Fill(*message.GetReflection()->AddMessage(&message, &field));
  }

  int count_ = 0;
};

template <typename Proto>
Proto Filled() {
  Proto proto;
  Filler().Fill(proto);
  return proto;
}

void ExpectSame(const Message& expected, const Message& actual) {
  google::protobuf::util::MessageDifferencer differencer;
  std::string report;
  differencer.ReportDifferencesToString(&report);
  // The translation through a rotation matrix rounds.
  differencer.set_float_comparison(google::protobuf::util::MessageDifferencer::APPROXIMATE);
  EXPECT_TRUE(differencer.Compare(expected, actual)) << report;
}

template <typename Proto>
void ExpectRoundTrip(const Proto& proto) {
  STRATA_ASSERT_OK_AND_ASSIGN(const auto core, FromProto(proto));
  ExpectSame(proto, ToProto(core));
}

v1::ScanHeader FilledHeader() {
  v1::ScanHeader header = Filled<v1::ScanHeader>();
  header.set_rows(3);
  header.set_columns(7);
  header.set_point_count(21);
  // Single precision.
  header.mutable_sensor_origin()->set_x(0.25);
  header.mutable_sensor_origin()->set_y(-0.5);
  header.mutable_sensor_origin()->set_z(1.75);
  return header;
}

TEST(TranslateRoundTripTest, Maps) {
  ExpectSame(Filled<v1::RobotProfile>(), ToProto(FromProto(Filled<v1::RobotProfile>())));
  ExpectSame(Filled<v1::SensorModel>(), ToProto(FromProto(Filled<v1::SensorModel>())));
  ExpectSame(Filled<v1::MapParameters>(), ToProto(FromProto(Filled<v1::MapParameters>())));
  ExpectRoundTrip(Filled<v1::MapInfo>());
  ExpectRoundTrip(Filled<v1::MapStats>());
}

TEST(TranslateRoundTripTest, AbsentFieldsTakeTheCoresDefaults) {
  EXPECT_EQ(FromProto(v1::MapParameters()), MapParameters());
  EXPECT_EQ(FromProto(v1::RobotProfile()), RobotProfile());
  EXPECT_EQ(FromProto(v1::SensorModel()), SensorModel());
  STRATA_ASSERT_OK_AND_ASSIGN(const api::TileArea area, FromProto(v1::TileArea()));
  EXPECT_EQ(area.x_min, api::TileArea().x_min);
  EXPECT_EQ(area.y_max, api::TileArea().y_max);
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanQuery query, FromProto(v1::PlanPathRequest()));
  EXPECT_EQ(query.max_expanded, PlanQuery().max_expanded);
  EXPECT_EQ(query.from.z_m, std::nullopt);
  EXPECT_EQ(query.from.level, std::nullopt);
  EXPECT_TRUE(query.class_costs.empty());
}

TEST(TranslateRoundTripTest, Scans) {
  ExpectRoundTrip(FilledHeader());
  v1::ScanInfo scan = Filled<v1::ScanInfo>();
  *scan.mutable_header() = FilledHeader();
  ExpectRoundTrip(scan);
  ExpectSame(Filled<v1::ScanAck>(), ToProto(FromProto(Filled<v1::ScanAck>())));
  ExpectSame(Filled<v1::GetUploadStateResponse>(),
             ToProto(FromProto(Filled<v1::GetUploadStateResponse>())));
  const auto request = Filled<v1::ListScansRequest>();
  STRATA_ASSERT_OK_AND_ASSIGN(const api::ScanFilter filter, FromProto(request));
  ExpectSame(request, ToProto(request.map(), filter));
}

TEST(TranslateRoundTripTest, Tiles) {
  ExpectRoundTrip(Filled<v1::EncodedTile>());
  ExpectRoundTrip(Filled<v1::TileInfo>());
  ExpectRoundTrip(Filled<v1::TileArea>());
  ExpectRoundTrip(Filled<v1::HeldTile>());
  ExpectRoundTrip(Filled<v1::FetchTilesResponse>());
}

TEST(TranslateRoundTripTest, Models) {
  auto plane = Filled<v1::ModelPlane>();
  ExpectRoundTrip(plane);
  plane.clear_colour();
  ExpectRoundTrip(plane);
  plane.set_colour(0);
  ExpectRoundTrip(plane);
  plane.set_colour(0x1000000);
  EXPECT_THAT(
      FromProto(plane),
      testing::StatusIs(absl::StatusCode::kInvalidArgument, ::testing::HasSubstr("RRGGBB")));
  ExpectRoundTrip(Filled<v1::PlaneModel>());
}

TEST(TranslateRoundTripTest, Objects) {
  ExpectRoundTrip(Filled<v1::Entity>());
  ExpectRoundTrip(Filled<v1::EntitySearch>());
  ExpectRoundTrip(Filled<v1::KindInfo>());
  ExpectRoundTrip(Filled<v1::InferredSearch>());
  auto unsaid = Filled<v1::KindInfo>();
  unsaid.set_origin(v1::KIND_ORIGIN_UNSPECIFIED);
  EXPECT_THAT(
      FromProto(unsaid),
      testing::StatusIs(absl::StatusCode::kInvalidArgument, ::testing::HasSubstr("origin")));
  auto request = Filled<v1::ListEntitiesRequest>();
  STRATA_ASSERT_OK_AND_ASSIGN(const EntityQuery query, FromProto(request));
  ExpectSame(request, ToProto(request.map(), query));
  request.set_class_id(256);
  EXPECT_THAT(
      FromProto(request),
      testing::StatusIs(absl::StatusCode::kInvalidArgument, ::testing::HasSubstr("class_id")));
  request.set_class_id(255);
  std::swap(*request.mutable_region()->mutable_min(), *request.mutable_region()->mutable_max());
  EXPECT_THAT(
      FromProto(request),
      testing::StatusIs(absl::StatusCode::kInvalidArgument, ::testing::HasSubstr("region")));
}

TEST(TranslateRoundTripTest, InferredParts) {
  const InferredPart part{3, 0x123456789abc, 500, 7, {{1e6, 2.0, 3.0}, {1e6 + 1.0, 2.5, 3.25}}};
  v1::InferredPart proto = ToProto(part);
  STRATA_ASSERT_OK_AND_ASSIGN(const InferredPart back, FromProto(proto));
  EXPECT_EQ(back, part);
  STRATA_ASSERT_OK_AND_ASSIGN(const InferredPart none, FromProto(ToProto(InferredPart())));
  EXPECT_TRUE(none.points.empty());
  proto.add_points(1.0F);
  EXPECT_THAT(FromProto(proto), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("points")));
  for (const float beyond : {std::numeric_limits<float>::infinity(), std::nanf(""), -1e9F}) {
    proto = ToProto(part);
    proto.set_points(4, beyond);
    EXPECT_THAT(FromProto(proto),
                StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("points[1] of what is")));
  }
  v1::ListInferredRequest request;
  request.set_kind("golf");
  request.set_class_id(7);
  STRATA_ASSERT_OK_AND_ASSIGN(const EntityQuery query, FromProto(request));
  EXPECT_EQ(query.kind, "golf");
  EXPECT_EQ(ToInferredRequest("", query).SerializeAsString(), request.SerializeAsString());
}

TEST(TranslateRoundTripTest, ShapesOfKinds) {
  NewKind kind{"box", "thing", {}};
  for (int i = 0; i < 25; ++i) kind.shape.points.emplace_back(0.1F * static_cast<float>(i), 1, 2);
  kind.shape.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  kind.shape.triangles = {{0, 1, 2}};
  const v1::ImportKindRequest request = ToProto("m", kind);
  STRATA_ASSERT_OK_AND_ASSIGN(const NewKind back, FromProto(request));
  EXPECT_EQ(back.name, kind.name);
  EXPECT_EQ(back.class_name, kind.class_name);
  EXPECT_EQ(back.shape, kind.shape);
  const auto refused = [](v1::KindShape shape, const char* why) {
    EXPECT_THAT(FromProto(shape),
                testing::StatusIs(absl::StatusCode::kInvalidArgument, ::testing::HasSubstr(why)));
  };
  v1::KindShape odd = request.shape();
  odd.add_points(1.0F);
  refused(odd, "shape.points has 76 numbers");
  v1::KindShape hostile = request.shape();
  hostile.set_points(7, 1e30F);
  refused(hostile, "point 2");
  hostile.set_points(7, std::numeric_limits<float>::quiet_NaN());
  refused(hostile, "point 2");
  v1::KindShape large = request.shape();
  for (int i = 0; i < 60'000; ++i) large.add_vertices(0.0F);
  refused(large, "vertices");
}

TEST(TranslateRoundTripTest, Planning) {
  const auto by_level = Filled<v1::PlanPathRequest>();
  auto by_height = by_level;
  by_height.mutable_from()->set_z_m(-2.5);
  for (const v1::PlanPathRequest& request : {by_level, by_height}) {
    STRATA_ASSERT_OK_AND_ASSIGN(const PlanQuery query, FromProto(request));
    ExpectSame(request, ToProto(request.map(), query));
  }
  v1::PlanPathRequest of_later;
  EXPECT_EQ(FromProto(of_later)->inferred, InferredAs::kIgnore);
  of_later.set_inferred(static_cast<v1::InferredAs>(9));
  EXPECT_THAT(FromProto(of_later),
              strata::testing::StatusIs(absl::StatusCode::kInvalidArgument,
                                        ::testing::HasSubstr("inferred")));
  ExpectRoundTrip(Filled<v1::PlanPathResponse>());
  ExpectRoundTrip(Filled<v1::SurfaceColumn>());
  ExpectRoundTrip(Filled<v1::PathCheck>());
  ExpectRoundTrip(Filled<v1::ListFloorsResponse>());
  const auto floors = Filled<v1::ListFloorsRequest>();
  STRATA_ASSERT_OK_AND_ASSIGN(const FloorQuery asked, FromProto(floors));
  ExpectSame(floors, ToProto(floors.map(), asked));
  ExpectRoundTrip(Filled<v1::ListPlacesResponse>());
  const auto places = Filled<v1::ListPlacesRequest>();
  STRATA_ASSERT_OK_AND_ASSIGN(const PlaceQuery of_floor, FromProto(places));
  ExpectSame(places, ToProto(places.map(), of_floor));
  ExpectRoundTrip(Filled<v1::ExploreResponse>());
  auto explore = Filled<v1::ExploreRequest>();
  explore.set_budget_m(3.0);
  explore.mutable_sensor()->set_max_range_m(5.0);
  STRATA_ASSERT_OK_AND_ASSIGN(const ExploreQuery explored, FromProto(explore));
  ExpectSame(explore, ToProto(explore.map(), explored));
  ExpectRoundTrip(Filled<v1::CheckShapeResponse>());
  auto by_poses = Filled<v1::CheckShapeRequest>();
  by_poses.mutable_shape()->clear_triangles();
  for (const std::uint32_t v : {0U, 2U, 1U}) by_poses.mutable_shape()->add_triangles(v);
  auto by_places = by_poses;
  by_poses.clear_waypoints();
  by_places.clear_poses();
  for (v1::CheckShapeRequest& shape : std::vector<v1::CheckShapeRequest>{by_poses, by_places}) {
    STRATA_ASSERT_OK_AND_ASSIGN(const ShapeQuery held, FromProto(shape));
    ExpectSame(shape, ToProto(shape.map(), held));
  }
  const auto check = Filled<v1::CheckPathRequest>();
  STRATA_ASSERT_OK_AND_ASSIGN(const PathQuery checked, FromProto(check));
  ExpectSame(check, CheckToProto(check.map(), checked));
  const auto watch = Filled<v1::WatchPathRequest>();
  STRATA_ASSERT_OK_AND_ASSIGN(const PathQuery watched, FromProto(watch));
  ExpectSame(watch, WatchToProto(watch.map(), watched));
}

TEST(TranslateRoundTripTest, Backups) {
  const auto piece = Filled<v1::BackupMapResponse>();
  ExpectSame(piece, ToProto(FromProto(piece)));
}

TEST(TranslateRoundTripTest, ClassCosts) {
  v1::PlanPathRequest request;
  const auto add = [&request](std::uint32_t id) {
    request.add_class_costs()->set_class_id(id);
    return request.mutable_class_costs(request.class_costs_size() - 1);
  };
  add(3)->set_factor(2.5);
  add(255)->set_forbidden(true);
  STRATA_ASSERT_OK_AND_ASSIGN(const PlanQuery query, FromProto(request));
  EXPECT_EQ(query.class_costs, (ClassCosts{{3, 2.5}, {255, kForbiddenClass}}));
  ASSERT_EQ(ToProto("m", query).class_costs_size(), 2);
  for (int k = 0; k < 2; ++k) {
    ExpectSame(request.class_costs(k), ToProto("m", query).class_costs(k));
  }
  const auto refused = [](std::uint32_t id, double factor) {
    v1::PlanPathRequest bad;
    bad.add_class_costs()->set_class_id(id);
    bad.mutable_class_costs(0)->set_factor(factor);
    return FromProto(bad).status();
  };
  for (const auto& [id, factor] : {std::pair(0U, 2.0),
                                   std::pair(256U, 2.0),
                                   std::pair(4'294'967'295U, 2.0),
                                   std::pair(1U, 0.0),
                                   std::pair(1U, -kForbiddenClass),
                                   std::pair(1U, std::nan(""))}) {
    EXPECT_THAT(refused(id, factor),
                testing::StatusIs(absl::StatusCode::kInvalidArgument,
                                  ::testing::HasSubstr("class_costs: ")))
        << id << " " << factor;
  }
  add(3)->set_factor(2.0);
  EXPECT_THAT(FromProto(request).status(),
              testing::StatusIs(absl::StatusCode::kInvalidArgument,
                                ::testing::HasSubstr("class 3 is there twice")));
}

TEST(TranslateRoundTripTest, EveryPlanReasonAndObstruction) {
  for (int reason = 1; reason < v1::PlanReason_ARRAYSIZE; ++reason) {
    for (int obstruction = 0; obstruction < v1::Obstruction_ARRAYSIZE; ++obstruction) {
      auto plan = Filled<v1::PlanPathResponse>();
      plan.set_reason(static_cast<v1::PlanReason>(reason));
      plan.set_obstruction(static_cast<v1::Obstruction>(obstruction));
      ExpectRoundTrip(plan);
    }
  }
}

TEST(TranslateRoundTripTest, JobsAndPoseGraph) {
  ExpectRoundTrip(Filled<v1::Job>());
  ExpectRoundTrip(Filled<v1::PoseNode>());
  ExpectRoundTrip(Filled<v1::Constraint>());
  ExpectRoundTrip(Filled<v1::GlobalPlane>());
  ExpectRoundTrip(Filled<v1::LookupPoseResponse>());
}

TEST(TranslateRoundTripTest, APriorHasNoFirstScan) {
  auto prior = Filled<v1::Constraint>();
  prior.clear_i();
  ExpectRoundTrip(prior);
  STRATA_ASSERT_OK_AND_ASSIGN(const Constraint constraint, FromProto(prior));
  EXPECT_TRUE(constraint.is_prior());
}

TEST(TranslateRoundTripTest, Localize) {
  auto start = Filled<v1::LocalizeStart>();
  start.set_rows(0);
  start.set_columns(0);
  start.set_point_count(0);  // the points come apart
  start.mutable_sensor_origin()->set_x(0.25);
  start.mutable_sensor_origin()->set_y(-0.5);
  start.mutable_sensor_origin()->set_z(1.75);
  STRATA_ASSERT_OK_AND_ASSIGN(const LocalizeQuery query, FromProto(start));
  ExpectSame(start, ToProto(start.map(), query));
  ExpectRoundTrip(Filled<v1::LocalizeResponse>());
  STRATA_ASSERT_OK_AND_ASSIGN(const LocalizeQuery defaults, FromProto(v1::LocalizeStart()));
  EXPECT_EQ(defaults.guess_radius_m, LocalizeQuery().guess_radius_m);
  EXPECT_EQ(defaults.T_map_scan_guess, std::nullopt);
}

TEST(TranslateRoundTripTest, Track) {
  const auto start = Filled<v1::TrackStart>();
  STRATA_ASSERT_OK_AND_ASSIGN(const TrackStart begun, FromProto(start));
  ExpectSame(start, ToProto(start.map(), begun));
  STRATA_ASSERT_OK_AND_ASSIGN(const TrackStart defaults, FromProto(v1::TrackStart()));
  EXPECT_EQ(defaults.guess_radius_m, TrackStart().guess_radius_m);
  v1::TrackStep step = ToProto(TrackStep());
  step.mutable_odometry()->mutable_translation()->set_y(-2.5);
  step.mutable_sensor_origin()->set_z(1.75);
  for (int i = 0; i < 36; ++i) step.add_motion_covariance(i % 7 == 0 ? 0.5 + i : 0.0);
  ExpectRoundTrip(step);
  step.set_point_count(4);  // the points that follow bring their grid
  step.set_rows(2);
  step.set_columns(2);
  STRATA_ASSERT_OK_AND_ASSIGN(const TrackStep taken, FromProto(step));
  STRATA_EXPECT_OK(FromProto(ToProto(taken)).status());
  ExpectRoundTrip(Filled<v1::TrackResponse>());
}

TEST(TranslateRoundTripTest, Watch) {
  ExpectRoundTrip(Filled<v1::Epoch>());
  ExpectRoundTrip(Filled<v1::WatchMapResponse>());
  auto request = Filled<v1::WatchMapRequest>();
  request.set_tiles(false);
  STRATA_ASSERT_OK_AND_ASSIGN(const api::WatchOptions options, FromProto(request));
  ExpectSame(request, ToProto(request.name(), options));
  STRATA_ASSERT_OK_AND_ASSIGN(const api::WatchOptions defaults, FromProto(v1::WatchMapRequest()));
  EXPECT_TRUE(defaults.tiles);
}

TEST(TranslateRoundTripTest, UnknownEnumeratorsAreRefused) {
  using ::strata::testing::StatusIs;
  using ::testing::HasSubstr;
  constexpr auto kRefused = absl::StatusCode::kInvalidArgument;
  auto header = FilledHeader();
  header.set_alignment(static_cast<v1::Alignment>(9));
  EXPECT_THAT(FromProto(header), StatusIs(kRefused, HasSubstr("alignment: 9")));
  auto job = Filled<v1::Job>();
  job.set_state(v1::JOB_STATE_UNSPECIFIED);
  EXPECT_THAT(FromProto(job), StatusIs(kRefused, HasSubstr("state 0")));
  v1::ListScansRequest list;
  list.set_state(static_cast<v1::ScanState>(77));
  EXPECT_THAT(FromProto(list), StatusIs(kRefused, HasSubstr("state: 77")));
  auto constraint = Filled<v1::Constraint>();
  constraint.mutable_information()->RemoveLast();
  EXPECT_THAT(FromProto(constraint), StatusIs(kRefused, HasSubstr("35 numbers")));
  constraint = Filled<v1::Constraint>();
  constraint.set_origin(v1::CONSTRAINT_ORIGIN_UNSPECIFIED);
  EXPECT_THAT(FromProto(constraint), StatusIs(kRefused, HasSubstr("origin 0")));
  auto plane = Filled<v1::GlobalPlane>();
  plane.set_kind(static_cast<v1::PlaneKind>(4));
  EXPECT_THAT(FromProto(plane), StatusIs(kRefused, HasSubstr("kind 4")));
  v1::TileKey key;
  key.set_level(13);
  EXPECT_THAT(FromProto(key), StatusIs(kRefused, HasSubstr("level 13 is not in [0, 12]")));
  v1::TileArea area;
  area.set_x_min(5);
  area.set_x_max(4);
  EXPECT_THAT(FromProto(area), StatusIs(kRefused, HasSubstr("x from 5 to 4")));
}

}  // namespace
}  // namespace strata::translate
