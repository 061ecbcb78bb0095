#include "proto/translate/classifiers.h"

#include "core/common/status.h"
#include "proto/translate/geometry.h"

namespace strata::translate {

v1::Classifier ToProto(const ClassifierInfo& info) {
  v1::Classifier proto;
  proto.set_id(info.id);
  proto.set_name(info.name);
  *proto.mutable_created() = ToProto(info.created);
  proto.set_job(info.job);
  proto.set_description(info.description);
  proto.mutable_parameters()->insert(info.parameters.begin(), info.parameters.end());
  proto.mutable_scores()->insert(info.scores.begin(), info.scores.end());
  proto.set_bytes(info.bytes);
  return proto;
}

absl::StatusOr<ClassifierInfo> FromProto(const v1::Classifier& proto) {
  ClassifierInfo info;
  info.id = proto.id();
  info.name = proto.name();
  STRATA_ASSIGN_OR_RETURN(info.created, FromProto("created", proto.created()));
  info.job = proto.job();
  info.description = proto.description();
  info.parameters.insert(proto.parameters().begin(), proto.parameters().end());
  info.scores.insert(proto.scores().begin(), proto.scores().end());
  info.bytes = proto.bytes();
  return info;
}

}  // namespace strata::translate
