find_dependency(nlohmann_json CONFIG)
find_dependency(TinyGLTF CONFIG)
find_dependency(PNG)
find_dependency(meshoptimizer CONFIG)

include("${CMAKE_CURRENT_LIST_DIR}/farfield-io-targets.cmake")
