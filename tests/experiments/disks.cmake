find_package(CLI11 REQUIRED)
strata_executable(
  disk_campaign disk_campaign
  SOURCES disk_campaign.cc
  DEPS disk_campaigns CLI11::CLI11 absl::str_format PkgConfig::glog
)
