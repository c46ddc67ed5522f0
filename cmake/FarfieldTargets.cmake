# What every target of the project shares: language level, warnings, sanitizers, output folder.

set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/bin")

if(PROJECT_IS_TOP_LEVEL)
    set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
    find_program(FARFIELD_CCACHE ccache)
    if(FARFIELD_CCACHE)
        set(CMAKE_CXX_COMPILER_LAUNCHER "${FARFIELD_CCACHE}")
    endif()
endif()

# farfield_target(<target>): settings that are private to our own code.
function(farfield_target target)
    target_compile_features(${target} PUBLIC cxx_std_20)
    set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF)
    # Contraction would make one formula give two results; the metrics rely on every rounding.
    target_compile_options(${target} PRIVATE -ffp-contract=off)
    target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wconversion -Wshadow)
    # GCC 12 sees overlapping copies in `"text" + std::string` where there are none.
    target_compile_options(
        ${target}
        PRIVATE
            $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>:-Wno-restrict>
    )
    if(FARFIELD_WARNINGS_AS_ERRORS)
        target_compile_options(${target} PRIVATE -Werror)
    endif()
    if(FARFIELD_SANITIZE)
        list(JOIN FARFIELD_SANITIZE "," sanitizers)
        target_compile_options(
            ${target} PRIVATE -fsanitize=${sanitizers} -fno-omit-frame-pointer
                              -fno-sanitize-recover=all
        )
        # GCC's checks of the optimised code see through instrumented code badly; its manual says so.
        target_compile_options(
            ${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>
        )
        target_link_options(${target} PUBLIC -fsanitize=${sanitizers})
    endif()
endfunction()

# farfield_library(<component> [ROOMS <room>...]): one exported library. Public headers of its rooms
# are a header set, so that each is compiled alone; sources are those under src/<room>/. The core
# library is the component `farfield` and carries the umbrella header as well.
function(farfield_library component)
    cmake_parse_arguments(arg "" "" "ROOMS" ${ARGN})
    if(component STREQUAL "farfield")
        set(target farfield)
    else()
        set(target farfield_${component})
    endif()
    add_library(${target})
    add_library(farfield::${component} ALIAS ${target})
    set_target_properties(${target} PROPERTIES EXPORT_NAME ${component})
    set_property(GLOBAL APPEND PROPERTY FARFIELD_COMPONENTS ${component})
    farfield_target(${target})
    target_include_directories(${target} PRIVATE "${PROJECT_SOURCE_DIR}/src")
    set(headers "")
    if(component STREQUAL "farfield")
        list(APPEND headers "${PROJECT_SOURCE_DIR}/include/farfield/farfield.hpp")
    endif()
    foreach(room IN LISTS arg_ROOMS)
        file(
            GLOB_RECURSE room_headers
            CONFIGURE_DEPENDS
            "${PROJECT_SOURCE_DIR}/include/farfield/${room}/*.hpp"
        )
        list(APPEND headers ${room_headers})
        file(
            GLOB_RECURSE room_sources
            CONFIGURE_DEPENDS
            "${PROJECT_SOURCE_DIR}/src/${room}/*.cpp"
        )
        target_sources(${target} PRIVATE ${room_sources})
    endforeach()
    target_sources(
        ${target}
        PUBLIC FILE_SET HEADERS BASE_DIRS "${PROJECT_SOURCE_DIR}/include" FILES ${headers}
    )
    set_target_properties(${target} PROPERTIES VERIFY_INTERFACE_HEADER_SETS ON)
endfunction()
