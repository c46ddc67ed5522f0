find_dependency(glm CONFIG)
find_dependency(tl-expected CONFIG)

include("${CMAKE_CURRENT_LIST_DIR}/farfield-farfield-targets.cmake")
