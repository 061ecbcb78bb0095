#include "server/reflection.h"

#include <memory>
#include <vector>

#include <grpcpp/impl/server_builder_option.h>

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

}  // namespace

void LeaveOutReflection(grpc::ServerBuilder& builder) {
  builder.SetOption(std::make_unique<NoReflection>());
}

}  // namespace strata::server
