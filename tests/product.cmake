# The product as its users have it: the console lines of pages, references, what is installed and packed, recorded data through a
# real server. All of it beside the tests: none of it keeps two processors busy by itself.

# strata_product_test(NAME LABEL COST COMMAND...): COST in seconds, so that what takes long begins first. 77: nothing to try it on.
function(strata_product_test name label cost)
  add_test(NAME ${name} COMMAND ${ARGN})
  set_tests_properties(${name} PROPERTIES LABELS ${label} COST ${cost} SKIP_RETURN_CODE 77)
endfunction()

set(python /usr/bin/python3)
set(build --build ${PROJECT_BINARY_DIR})

set(pages ${CMAKE_CURRENT_SOURCE_DIR}/readme_test.py)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${pages})
execute_process(COMMAND ${python} ${pages} --list OUTPUT_VARIABLE tours COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "[^\n]+" tours "${tours}")
foreach(page ${tours})
  cmake_path(GET page STEM name)
  strata_product_test(page_${name} pages 300 ${python} ${pages} ${build} --only ${page})
endforeach()
strata_product_test(
  references_are_made pages 30 ${python} ${PROJECT_SOURCE_DIR}/docs/reference/make.py ${build} --check
)

foreach(data nclt hall facade kitti isprs others)
  strata_product_test(
    recorded_${data} recorded 300 ${python} ${CMAKE_CURRENT_SOURCE_DIR}/experiments/real_data.py ${build} --only ${data}
  )
endforeach()

strata_product_test(consumer packages 100 ${CMAKE_CURRENT_SOURCE_DIR}/consumer/run.sh ${PROJECT_BINARY_DIR})
strata_product_test(packages packages 100 ${CMAKE_CURRENT_SOURCE_DIR}/packages/run.sh ${PROJECT_BINARY_DIR})
# An installation makes pages of the manual in the build's folder.
set_tests_properties(consumer packages PROPERTIES RESOURCE_LOCK installation)
