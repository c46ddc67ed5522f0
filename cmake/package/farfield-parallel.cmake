find_dependency(TBB CONFIG)

include("${CMAKE_CURRENT_LIST_DIR}/farfield-parallel-targets.cmake")
