# How every room of Strata becomes one target, with the rooms inside it. Sources are listed by hand; dependencies are direct
# ones only.

add_library(strata_build_options INTERFACE)
target_compile_features(strata_build_options INTERFACE cxx_std_20)
target_compile_options(
  strata_build_options
  INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
            -ffp-contract=off # derived bytes must not depend on whether a machine fuses a · b + c
            -ffile-prefix-map=${PROJECT_SOURCE_DIR}/= # so that every checkout compiles to the same, once (ccache)
            $<$<CXX_COMPILER_ID:Clang>:-Wthread-safety> $<$<BOOL:${STRATA_WARNINGS_AS_ERRORS}>:-Werror>
)
set(STRATA_SANITIZER_KIND "")
if(STRATA_SANITIZER MATCHES "address")
  set(STRATA_SANITIZER_KIND asan)
elseif(STRATA_SANITIZER MATCHES "thread")
  set(STRATA_SANITIZER_KIND tsan)
endif()
if(STRATA_SANITIZER)
  target_compile_options(strata_build_options INTERFACE -fsanitize=${STRATA_SANITIZER} -fno-omit-frame-pointer)
  target_link_options(strata_build_options INTERFACE -fsanitize=${STRATA_SANITIZER})
  if(STRATA_SANITIZER MATCHES "undefined")
    # These four take a third of the build time and find little that the address sanitizer does not. The list's path does not
    # say where the checkout lies: another's compilations are found (ccache).
    file(RELATIVE_PATH ignores ${PROJECT_BINARY_DIR} ${PROJECT_SOURCE_DIR}/deploy/cmake/sanitizer_ignores.txt)
    target_compile_options(
      strata_build_options
      INTERFACE -fno-sanitize=null,alignment,object-size,vptr -fno-sanitize-recover=undefined
                $<$<CXX_COMPILER_ID:Clang>:-fsanitize-ignorelist=${ignores}>
    )
  endif()
endif()

# Most of the time of a build goes into the headers of others. With STRATA_BATCHES (on in all presets but dev) each is parsed
# once for many sources: the largest are compiled beforehand, and sources of a target are compiled together.
if(STRATA_BATCHES)
  # Threads everywhere alike, or headers cannot be shared. g++ takes what a source includes for headers, and spends a tenth
  # of its time collecting garbage below 1 GB.
  set(gnu_options -Wno-subobject-linkage --param=ggc-min-heapsize=1000000)
  target_compile_options(strata_build_options INTERFACE -pthread "$<$<CXX_COMPILER_ID:GNU>:${gnu_options}>")
endif()

# strata_shared_headers(NAME HEADERS... DEPS...): compiles HEADERS beforehand, for strata_batch.
function(strata_shared_headers name)
  cmake_parse_arguments(ARG "" "" "HEADERS;DEPS" ${ARGN})
  file(WRITE ${PROJECT_BINARY_DIR}/empty.cc "")
  add_library(${name} OBJECT ${PROJECT_BINARY_DIR}/empty.cc)
  target_link_libraries(${name} PRIVATE strata_build_options ${ARG_DEPS})
  target_precompile_headers(${name} PRIVATE ${ARG_HEADERS})
endfunction()

# strata_batch(TARGET HEADERS): the target's sources use what strata_shared_headers made of HEADERS, and each other's. Not by
# clang: what it makes of headers holds the checkout's path, and no other checkout would find what it compiled (ccache).
function(strata_batch target headers)
  if(STRATA_BATCHES)
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      target_precompile_headers(${target} REUSE_FROM ${headers})
    endif()
    target_compile_options(${target} PRIVATE $<TARGET_PROPERTY:${headers},COMPILE_OPTIONS>)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
    set_property(GLOBAL APPEND PROPERTY STRATA_BATCHED ${target})
  endif()
endfunction()

# strata_write_batches(): says which sources of the targets of strata_batch go together; after all of them. When a source
# takes a name that another of its batch has, too, g++ says so: configure again.
function(strata_write_batches)
  get_property(targets GLOBAL PROPERTY STRATA_BATCHED)
  set(lines "")
  foreach(target ${targets})
    get_target_property(sources ${target} SOURCES)
    get_target_property(folder ${target} SOURCE_DIR)
    foreach(source ${sources})
      if(source MATCHES "\\.cc$")
        cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY ${folder} NORMALIZE)
        string(APPEND lines "${target}\t${source}\n")
      endif()
    endforeach()
  endforeach()
  file(WRITE ${PROJECT_BINARY_DIR}/batches.txt "${lines}")
  find_package(Python3 REQUIRED COMPONENTS Interpreter)
  execute_process(
    COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/deploy/cmake/batches.py ${PROJECT_SOURCE_DIR}
    INPUT_FILE ${PROJECT_BINARY_DIR}/batches.txt
    OUTPUT_FILE ${PROJECT_BINARY_DIR}/batches.cmake COMMAND_ERROR_IS_FATAL ANY
  )
  include(${PROJECT_BINARY_DIR}/batches.cmake)
endfunction()

# strata_library(NAME [NO_INSTALL] SOURCES... HEADERS... DEPS... [PRIVATE_DEPS...])
#
# Makes the static library strata_NAME with the alias strata::NAME. HEADERS are public, are installed, and are
# held self-contained by tests/check_headers.py. Includes start at the repository root.
function(strata_library name)
  cmake_parse_arguments(ARG "NO_INSTALL" "" "SOURCES;HEADERS;DEPS;PRIVATE_DEPS" ${ARGN})
  set(target strata_${name})
  if(ARG_SOURCES)
    add_library(${target} STATIC ${ARG_SOURCES})
    set(scope PUBLIC)
    target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:strata_build_options> ${ARG_PRIVATE_DEPS})
    strata_batch(${target} strata_large_headers)
  else()
    add_library(${target} INTERFACE)
    set(scope INTERFACE)
  endif()
  add_library(strata::${name} ALIAS ${target})
  target_compile_features(${target} ${scope} cxx_std_20)
  target_link_libraries(${target} ${scope} ${ARG_DEPS})
  target_sources(${target} ${scope} FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR} FILES ${ARG_HEADERS})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name} VERIFY_INTERFACE_HEADER_SETS ON)
  if(NOT ARG_NO_INSTALL)
    install(
      TARGETS ${target}
      EXPORT strata
      COMPONENT dev
      FILE_SET HEADERS
      DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/strata
      COMPONENT dev
    )
  endif()
endfunction()

set(STRATA_SHARED_HEADERS strata_large_headers) # of the folder's programs

# strata_executable(NAME OUTPUT SOURCES... DEPS... [SHARED_HEADERS NAME of strata_shared_headers])
function(strata_executable name output)
  cmake_parse_arguments(ARG "" "SHARED_HEADERS" "SOURCES;DEPS" ${ARGN})
  if(NOT ARG_SHARED_HEADERS)
    set(ARG_SHARED_HEADERS ${STRATA_SHARED_HEADERS})
  endif()
  add_executable(${name} ${ARG_SOURCES})
  set_target_properties(${name} PROPERTIES OUTPUT_NAME ${output})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE strata_build_options ${ARG_DEPS})
  strata_batch(${name} ${ARG_SHARED_HEADERS})
endfunction()

# strata_test(NAME SOURCES... DEPS... [LABELS...] [COST seconds] [PROCESSORS n] [TOGETHER suites...])
#
# A GoogleTest program; every TEST becomes a ctest test with the labels (default: unit). The labels asan, bytes and tsan
# also make it part of what tests/run_sanitizers.sh builds and runs. COST: what it takes at most on a machine that does
# little else; what may take long begins first. PROCESSORS: of those that ctest has, as many as a test takes that goes by
# the clock. TOGETHER: each of these suites is one ctest test, and one process, for which what its tests share is made
# once; ALL: the program is, whose many short tests would take longer to start than to run. No test has a time of its own
# after which it hangs: a machine at a tenth of its speed failed the gate by nothing else. CMakePresets.json has one for
# all.
function(strata_test name)
  cmake_parse_arguments(ARG "" "PROCESSORS;COST" "SOURCES;DEPS;LABELS;TOGETHER" ${ARGN})
  if(NOT ARG_LABELS)
    set(ARG_LABELS unit)
  endif()
  if(NOT ARG_COST)
    set(ARG_COST 120)
  endif()
  if(NOT ARG_PROCESSORS)
    set(ARG_PROCESSORS 1)
  endif()
  strata_executable(
    ${name} ${name} SOURCES ${ARG_SOURCES} DEPS ${ARG_DEPS} GTest::gmock_main SHARED_HEADERS strata_test_headers
  )
  if(TARGET strata_tsan_absl)
    target_link_libraries(${name} PRIVATE strata_tsan_absl)
  endif()
  foreach(label asan bytes tsan)
    if(TARGET ${label}_tests AND label IN_LIST ARG_LABELS)
      add_dependencies(${label}_tests ${name})
    endif()
  endforeach()
  list(JOIN ARG_LABELS "-" labels) # gtest_discover_tests takes one word; ctest -L looks for a part of it
  set(alone "*")
  if(ARG_TOGETHER)
    math(EXPR together_cost "5 * ${ARG_COST}")
    set(alone "*-")
    foreach(suite ${ARG_TOGETHER})
      set(test ${suite})
      set(tests "${suite}.*:*/${suite}.*")
      if(suite STREQUAL ALL)
        set(test ${name})
        set(tests "*")
      endif()
      string(APPEND alone "${tests}:")
      add_test(NAME ${test} COMMAND ${name} --gtest_filter=${tests})
      set_tests_properties(
        ${test} PROPERTIES LABELS "${labels}" PROCESSORS ${ARG_PROCESSORS} COST ${together_cost}
      )
    endforeach()
    if(ALL IN_LIST ARG_TOGETHER)
      return()
    endif()
  endif()
  gtest_discover_tests(
    ${name}
    DISCOVERY_TIMEOUT 60
    TEST_FILTER "${alone}"
    PROPERTIES LABELS "${labels}" PROCESSORS ${ARG_PROCESSORS} COST ${ARG_COST}
  )
endfunction()
