// The things in maps between the core's words and the wire's. ToProto never fails; FromProto
// answers INVALID_ARGUMENT naming the field.
#ifndef STRATA_PROTO_TRANSLATE_OBJECTS_H_
#define STRATA_PROTO_TRANSLATE_OBJECTS_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/world/things/entity.h"
#include "core/world/things/inferred.h"
#include "core/world/things/kind.h"
#include "strata/v1/objects.pb.h"

namespace strata::translate {

v1::Entity ToProto(const Entity& entity);
v1::EntitySearch ToProto(const EntitiesInfo& info);
v1::ListEntitiesRequest ToProto(absl::string_view map, const EntityQuery& query);

v1::KindInfo ToProto(const KindInfo& info);
v1::KindShape ToProto(const KindShape& shape);
v1::ImportKindRequest ToProto(absl::string_view map, const NewKind& kind);

v1::InferredPart ToProto(const InferredPart& part);
v1::InferredSearch ToProto(const InferredInfo& info);
v1::ListInferredRequest ToInferredRequest(absl::string_view map, const EntityQuery& query);

absl::StatusOr<Entity> FromProto(const v1::Entity& proto);
absl::StatusOr<EntitiesInfo> FromProto(const v1::EntitySearch& proto);
absl::StatusOr<EntityQuery> FromProto(const v1::ListEntitiesRequest& proto);
absl::StatusOr<KindInfo> FromProto(const v1::KindInfo& proto);
// As ValidateKindShape() takes it.
absl::StatusOr<KindShape> FromProto(const v1::KindShape& proto);
absl::StatusOr<NewKind> FromProto(const v1::ImportKindRequest& proto);
absl::StatusOr<InferredPart> FromProto(const v1::InferredPart& proto);
absl::StatusOr<InferredInfo> FromProto(const v1::InferredSearch& proto);
absl::StatusOr<EntityQuery> FromProto(const v1::ListInferredRequest& proto);

}  // namespace strata::translate

#endif  // STRATA_PROTO_TRANSLATE_OBJECTS_H_
