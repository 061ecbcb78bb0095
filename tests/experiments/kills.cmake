find_package(CLI11 REQUIRED)
find_package(nlohmann_json REQUIRED)
strata_executable(
  kill_campaign
  kill_campaign
  SOURCES kill_campaign.cc
  DEPS strata::cluster_campaign CLI11::CLI11 nlohmann_json::nlohmann_json
)
