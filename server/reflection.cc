#include "server/reflection.h"

#include <memory>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/string_view.h"
#include <grpcpp/impl/server_builder_option.h>

#include "proto/translate/status.h"

namespace strata::server {
namespace {

constexpr char kPluginName[] = "proto_server_reflection";

class NoReflection final : public grpc::ServerBuilderOption {
 public:
  void UpdateArguments(grpc::ChannelArguments* /*arguments*/) override {}
  void UpdatePlugins(std::vector<std::unique_ptr<grpc::ServerBuilderPlugin>>* plugins) override {
    std::erase_if(*plugins, [](const auto& plugin) { return plugin->name() == kPluginName; });
  }
};

class ReflectionGuard final : public grpc::AuthMetadataProcessor {
 public:
  explicit ReflectionGuard(Access& access) : access_(access) {}

  // What it does is as quick as another thread would be found.
  bool IsBlocking() const override { return false; }

  grpc::Status Process(const InputMetadata& metadata,
                       grpc::AuthContext* context,
                       OutputMetadata* /*consumed*/,
                       OutputMetadata* /*response*/) override {
    const auto value = [&metadata](const char* key) {
      const auto found = metadata.find(key);
      return found == metadata.end()
                 ? absl::string_view()
                 : absl::string_view(found->second.data(), found->second.size());
    };
    if (!absl::StartsWith(value(":path"), "/grpc.reflection.")) return grpc::Status::OK;
    const absl::Status known =
        access_.Authenticate(value(kAuthorizationKey), CertificateNameOf(*context)).status();
    return translate::ToGrpcStatus(known, "");
  }

 private:
  Access& access_;
};

}  // namespace

void LeaveOutReflection(grpc::ServerBuilder& builder) {
  builder.SetOption(std::make_unique<NoReflection>());
}

std::shared_ptr<grpc::AuthMetadataProcessor> GuardReflection(Access& access) {
  return std::make_shared<ReflectionGuard>(access);
}

}  // namespace strata::server
