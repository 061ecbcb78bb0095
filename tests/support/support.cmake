# The only library that is compiled with places of this machine.
strata_library(
  test_paths
  NO_INSTALL
  SOURCES paths.cc
  HEADERS paths.h
  DEPS absl::strings
)
target_compile_definitions(
  strata_test_paths PRIVATE STRATA_SOURCE_DIR="${PROJECT_SOURCE_DIR}" STRATA_BUILD_DIR="${PROJECT_BINARY_DIR}"
)

# What several test programs share. Never linked into the product.
strata_library(
  test_support
  NO_INSTALL
  SOURCES data_dir.cc drawing.cc simulator/park.cc temp_dir.cc
  HEADERS asked.h data_dir.h drawing.h simulator/park.h status_matchers.h temp_dir.h
  DEPS strata::common strata::mls strata::test_paths absl::strings GTest::gmock
)

# Allocations that fail on demand.
strata_library(failing_memory NO_INSTALL SOURCES faults/failing_memory.cc HEADERS faults/failing_memory.h)

# Recorded scans for experiments and benchmarks.
strata_library(
  test_recordings
  NO_INSTALL
  SOURCES pcd.cc
  HEADERS pcd.h
  DEPS strata::cloud strata::geometry absl::statusor
)

# ROS messages and bags.
strata_library(
  bag_writer
  NO_INSTALL
  SOURCES bag_writer.cc
  HEADERS bag_writer.h
  DEPS strata::geometry absl::strings
  PRIVATE_DEPS bz2 lz4 z PkgConfig::sqlite3 PkgConfig::zstd
)

add_subdirectory(ros2)

# Recorded clouds with known classes.
strata_library(
  labelled_clouds
  NO_INSTALL
  SOURCES labelled_clouds.cc
  HEADERS labelled_clouds.h
  DEPS strata::classification
  PRIVATE_DEPS strata::test_support
)

# Robots driven through drawn worlds, to check paths against.
strata_library(
  sweep
  NO_INSTALL
  SOURCES simulator/sweep.cc
  HEADERS simulator/sweep.h
  DEPS strata::simulator strata::world
  PRIVATE_DEPS absl::str_format
)

# Storeys as floor grids, with what every cell is.
strata_library(
  floor_plans
  NO_INSTALL
  SOURCES simulator/floor_plans.cc
  HEADERS simulator/floor_plans.h
  DEPS strata::simulator strata::world
)

strata_test(
  simulator_test
  SOURCES simulator/scene_test.cc simulator/simulator_test.cc simulator/sweep_test.cc simulator/views_test.cc simulator/worlds_test.cc
  DEPS strata::simulator strata::sweep
  TOGETHER ALL
)

add_library(strata_mock_database STATIC mock_database.cc)
add_library(strata::mock_database ALIAS strata_mock_database)
target_include_directories(strata_mock_database PUBLIC ${PROJECT_SOURCE_DIR})
target_link_libraries(strata_mock_database PUBLIC strata::api GTest::gmock PRIVATE strata_build_options)
strata_batch(strata_mock_database strata_test_headers)

# Disks beneath SQLite that fail, and one that loses what was not synced.
strata_library(
  faulty_disk
  NO_INSTALL
  SOURCES faults/disk_shim.cc faults/faulty_disk.cc faults/power_cut_disk.cc
  HEADERS faults/disk_shim.h faults/faulty_disk.h faults/power_cut_disk.h
  PRIVATE_DEPS PkgConfig::sqlite3 ${CMAKE_DL_LIBS}
)

# Stores that lose the answer to a commit.
strata_library(
  answer_loss
  NO_INSTALL
  SOURCES faults/answer_loss.cc
  HEADERS faults/answer_loss.h
  DEPS strata::engine strata::storage
)

# The conformance suite of core/api; its tests run in every program that names a database for it. Objects, not an
# archive: a linker leaves out of an archive what nobody calls.
add_library(
  strata_database_suite OBJECT
  database_suite/database_suite.cc database_suite/classes.cc database_suite/jobs.cc database_suite/maps.cc database_suite/models.cc database_suite/inferred.cc database_suite/kinds.cc database_suite/objects.cc database_suite/planning.cc
  database_suite/posegraph.cc database_suite/scans.cc database_suite/things.cc database_suite/tiles.cc database_suite/watch.cc
  database_suite/worlds.cc
)
add_library(strata::database_suite ALIAS strata_database_suite)
target_include_directories(strata_database_suite PUBLIC ${PROJECT_SOURCE_DIR})
target_link_libraries(
  strata_database_suite
  PUBLIC strata::api strata::test_support GTest::gmock
  PRIVATE strata_build_options strata::codec absl::synchronization
)
strata_batch(strata_database_suite strata_test_headers)

if(STRATA_SANITIZER_KIND STREQUAL tsan)
  strata_test(tsan_absl_test SOURCES tsan_absl_test.cc DEPS absl::status absl::synchronization LABELS unit tsan)
endif()

# For LD_PRELOAD.
add_library(strata_jumping_clock MODULE faults/jumping_clock.cc)
target_link_libraries(strata_jumping_clock PRIVATE strata_build_options ${CMAKE_DL_LIBS})

# PostgreSQL servers of a test's own.
strata_library(
  postgres_cluster
  NO_INSTALL
  SOURCES postgres_cluster.cc
  HEADERS postgres_cluster.h
  DEPS strata::storage_postgresql strata::test_support
)
