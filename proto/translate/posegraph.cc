#include "proto/translate/posegraph.h"

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "proto/translate/geometry.h"
#include "proto/translate/scans.h"

namespace strata::translate {
namespace {

using RowMajor6d = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

static_assert(v1::CONSTRAINT_ORIGIN_INGEST == static_cast<int>(ConstraintOrigin::kIngest));
static_assert(v1::CONSTRAINT_ORIGIN_PERSON == static_cast<int>(ConstraintOrigin::kPerson));

absl::StatusOr<Matrix6d> InformationFromProto(const v1::Constraint& proto) {
  if (proto.information_size() == RowMajor6d::SizeAtCompileTime) {
    const Matrix6d information = Eigen::Map<const RowMajor6d>(proto.information().data());
    if (information.allFinite()) return information;
  }
  return absl::InvalidArgumentError(absl::StrCat("constraint ",
                                                 proto.id(),
                                                 ": information has ",
                                                 proto.information_size(),
                                                 " numbers, not 36 finite ones"));
}

}  // namespace

v1::PoseNode ToProto(const PoseNode& node) {
  v1::PoseNode proto;
  *proto.mutable_id() = ToProto(node.id);
  *proto.mutable_time() = ToProto(node.time);
  proto.set_state(ToProto(node.state));
  *proto.mutable_uploaded() = ToProto(node.T_map_scan_uploaded);
  *proto.mutable_current() = ToProto(node.T_map_scan);
  return proto;
}

absl::StatusOr<PoseNode> FromProto(const v1::PoseNode& proto) {
  PoseNode node;
  node.id = FromProto(proto.id());
  STRATA_ASSIGN_OR_RETURN(node.time, FromProto("time", proto.time()));
  STRATA_ASSIGN_OR_RETURN(node.state, FromProto(proto.state()));
  STRATA_ASSIGN_OR_RETURN(node.T_map_scan_uploaded, FromProto("uploaded", proto.uploaded()));
  STRATA_ASSIGN_OR_RETURN(node.T_map_scan, FromProto("current", proto.current()));
  return node;
}

v1::Constraint ToProto(const Constraint& constraint) {
  v1::Constraint proto;
  proto.set_id(constraint.id);
  *proto.mutable_i() = ToProto(constraint.i);
  *proto.mutable_j() = ToProto(constraint.j);
  *proto.mutable_pose() = ToProto(constraint.T_i_j);
  const RowMajor6d information = constraint.information;
  proto.mutable_information()->Add(information.data(), information.data() + information.size());
  proto.set_origin(static_cast<v1::ConstraintOrigin>(constraint.origin));
  proto.set_enabled(constraint.enabled);
  proto.set_note(constraint.note);
  return proto;
}

absl::StatusOr<Constraint> FromProto(const v1::Constraint& proto) {
  if (!v1::ConstraintOrigin_IsValid(proto.origin()) ||
      proto.origin() == v1::CONSTRAINT_ORIGIN_UNSPECIFIED) {
    return absl::InvalidArgumentError(absl::StrCat(
        "constraint ", proto.id(), ": origin ", static_cast<int>(proto.origin()), " is not known"));
  }
  Constraint constraint;
  constraint.id = proto.id();
  constraint.i = FromProto(proto.i());
  constraint.j = FromProto(proto.j());
  STRATA_ASSIGN_OR_RETURN(constraint.T_i_j, FromProto("pose", proto.pose()));
  STRATA_ASSIGN_OR_RETURN(constraint.information, InformationFromProto(proto));
  constraint.origin = static_cast<ConstraintOrigin>(proto.origin());
  constraint.enabled = proto.enabled();
  constraint.note = proto.note();
  return constraint;
}

}  // namespace strata::translate
