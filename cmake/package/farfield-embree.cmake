find_dependency(Threads)
find_dependency(embree CONFIG)

include("${CMAKE_CURRENT_LIST_DIR}/farfield-embree-targets.cmake")
