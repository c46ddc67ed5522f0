find_dependency(OpenGL COMPONENTS OpenGL EGL)
find_dependency(PkgConfig)
if(NOT TARGET PkgConfig::epoxy)
    pkg_check_modules(epoxy REQUIRED IMPORTED_TARGET epoxy)
endif()

include("${CMAKE_CURRENT_LIST_DIR}/farfield-opengl-targets.cmake")
