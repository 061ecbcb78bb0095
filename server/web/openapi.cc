#include "server/web/openapi.h"

#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include <nlohmann/json.hpp>

#include "server/web/comments.h"
#include "strata/v1/bounds.pb.h"

namespace strata::server::web {
namespace {

namespace pb = google::protobuf;
using nlohmann::json;

json Reference(const std::string& name) {
  return {{"$ref", absl::StrCat("#/components/schemas/", name)}};
}

// `description` of an object, where there is one.
json Described(json object, std::string description) {
  if (!description.empty()) object["description"] = std::move(description);
  return object;
}

// Schemas of messages and enumerations, each once.
class Schemas {
 public:
  explicit Schemas(const Comments& comments) : comments_(comments) {}
  json Of(const pb::Descriptor& message) {
    if (seen_.insert(message.full_name()).second) {
      json schema = {{"type", "object"}, {"properties", json::object()}};
      for (int i = 0; i < message.field_count(); ++i) {
        const pb::FieldDescriptor& field = *message.field(i);
        schema["properties"][field.name()] = Described(OfField(field), comments_.Of(field));
      }
      all_[message.full_name()] = Described(std::move(schema), comments_.Of(message));
    }
    return Reference(message.full_name());
  }
  json Of(const pb::EnumDescriptor& enumeration) {
    if (seen_.insert(enumeration.full_name()).second) {
      json schema = {{"type", "string"}};
      std::string description = comments_.Of(enumeration);
      for (int i = 0; i < enumeration.value_count(); ++i) {
        const pb::EnumValueDescriptor& value = *enumeration.value(i);
        schema["enum"].push_back(value.name());
        const std::string said = comments_.Of(value);
        if (!said.empty()) absl::StrAppend(&description, "\n- ", value.name(), ": ", said);
      }
      all_[enumeration.full_name()] = Described(std::move(schema), std::move(description));
    }
    return Reference(enumeration.full_name());
  }
  json Take() { return std::move(all_); }

 private:
  json OfField(const pb::FieldDescriptor& field) {
    if (field.is_map()) {
      return {{"type", "object"},
              {"additionalProperties", OfValue(*field.message_type()->map_value())}};
    }
    json value = OfValue(field);
    if (!field.is_repeated()) return value;
    json list = {{"type", "array"}, {"items", std::move(value)}};
    const std::uint32_t most = field.options().GetExtension(v1::max_items);
    if (most > 0) list["maxItems"] = most;
    return list;
  }
  // As ProtoJSON writes one.
  json OfValue(const pb::FieldDescriptor& field) {
    switch (field.cpp_type()) {
      case pb::FieldDescriptor::CPPTYPE_INT32:
        return {{"type", "integer"}, {"format", "int32"}};
      case pb::FieldDescriptor::CPPTYPE_UINT32:
        return {{"type", "integer"}, {"minimum", 0}, {"maximum", 4294967295}};
      case pb::FieldDescriptor::CPPTYPE_INT64:
        return {{"type", "string"}, {"format", "int64"}};
      case pb::FieldDescriptor::CPPTYPE_UINT64:
        return {{"type", "string"}, {"format", "uint64"}};
      case pb::FieldDescriptor::CPPTYPE_DOUBLE:
        return {{"type", "number"}, {"format", "double"}};
      case pb::FieldDescriptor::CPPTYPE_FLOAT:
        return {{"type", "number"}, {"format", "float"}};
      case pb::FieldDescriptor::CPPTYPE_BOOL:
        return {{"type", "boolean"}};
      case pb::FieldDescriptor::CPPTYPE_ENUM:
        return Of(*field.enum_type());
      case pb::FieldDescriptor::CPPTYPE_STRING:
        return field.type() == pb::FieldDescriptor::TYPE_BYTES
                   ? json{{"type", "string"}, {"format", "byte"}}
                   : json{{"type", "string"}};
      case pb::FieldDescriptor::CPPTYPE_MESSAGE:
        if (field.message_type()->well_known_type() == pb::Descriptor::WELLKNOWNTYPE_TIMESTAMP) {
          return {{"type", "string"}, {"format", "date-time"}};
        }
        return Of(*field.message_type());
    }
    return json::object();
  }

  const Comments& comments_;
  std::set<std::string> seen_;
  json all_ = json::object();
};

json ErrorResponse() {
  return {{"description", "an error, as Connect has it"},
          {"content", {{"application/json", {{"schema", Reference("Error")}}}}}};
}

json ErrorSchema() {
  const json text = {{"type", "string"}};
  return {{"type", "object"},
          {"required", {"code"}},
          {"properties",
           {{"code", text},
            {"message", text},
            {"details", {{"type", "array"}, {"items", {{"type", "object"}}}}}}}};
}

json OperationOf(const pb::MethodDescriptor& method, const Comments& comments, Schemas& schemas) {
  const bool stream = method.server_streaming();
  const char* type = stream ? "application/connect+json" : "application/json";
  json operation = {
      {"operationId", absl::StrCat(method.service()->name(), "_", method.name())},
      {"tags", {method.service()->name()}},
      {"requestBody",
       {{"required", true}, {"content", {{type, {{"schema", schemas.Of(*method.input_type())}}}}}}},
      {"responses",
       {{"200",
         {{"description",
           stream ? "a stream: each answer, then the end, in an envelope of Connect"
                  : "the answer"},
          {"content", {{type, {{"schema", schemas.Of(*method.output_type())}}}}}}},
        {"default", ErrorResponse()}}}};
  std::string description = comments.Of(method);
  if (stream) {
    absl::StrAppend(
        &description,
        description.empty() ? "" : "\n\n",
        "The request, too, is in an envelope: a byte 0, its size in four bytes (big-endian).");
  }
  return Described(std::move(operation), std::move(description));
}

json TileOperation() {
  const auto parameter = [](const char* name, const char* place, const char* type) {
    return json{{"name", name},
                {"in", place},
                {"required", std::string(place) == "path"},
                {"schema", {{"type", type}}}};
  };
  return {{"operationId", "Tiles_GetBytes"},
          {"tags", {"Tiles"}},
          {"parameters",
           {parameter("map", "path", "string"),
            parameter("level", "path", "integer"),
            parameter("x", "path", "integer"),
            parameter("y", "path", "integer"),
            parameter("v", "query", "string")}},
          {"responses",
           {{"200",
             {{"description",
               "the tile as served; for good in caches if v is its version, which ETag has, too"},
              {"content",
               {{"application/octet-stream",
                 {{"schema", {{"type", "string"}, {"format", "binary"}}}}}}}}},
            {"304", {{"description", "the tile of If-None-Match is the one there is"}}},
            {"default", ErrorResponse()}}}};
}

}  // namespace

std::string OpenApiOf(const Contract& contract) {
  const Comments comments;
  Schemas schemas(comments);
  json paths = json::object();
  json tags = json::array();
  for (const pb::ServiceDescriptor* service : contract.services()) {
    tags.push_back(Described({{"name", service->name()}}, comments.Of(*service)));
    for (int i = 0; i < service->method_count(); ++i) {
      const pb::MethodDescriptor& method = *service->method(i);
      if (method.client_streaming()) continue;
      paths[absl::StrCat("/", service->full_name(), "/", method.name())]["post"] =
          OperationOf(method, comments, schemas);
    }
  }
  paths["/v1/maps/{map}/tiles/{level}/{x}/{y}"]["get"] = TileOperation();
  json components = schemas.Take();
  components["Error"] = ErrorSchema();
  const json document = {
      {"openapi", "3.1.0"},
      {"info", {{"title", "Strata"}, {"version", STRATA_VERSION}}},
      {"tags", std::move(tags)},
      {"security", json::array({json::object(), {{"token", json::array()}}})},
      {"paths", std::move(paths)},
      {"components",
       {{"schemas", std::move(components)},
        {"securitySchemes", {{"token", {{"type", "http"}, {"scheme", "bearer"}}}}}}}};
  return document.dump();
}

}  // namespace strata::server::web
