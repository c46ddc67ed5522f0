#pragma once

#include <farfield/core/result.hpp>

#include <epoxy/gl.h>

#include <bit>
#include <cstdint>
#include <string>

namespace farfield::opengl {

/// Compiles and links a vertex and a fragment shader, and a geometry shader if its text is not
/// empty.
/// @param name of the program, for the error message
[[nodiscard]] Result<GLuint> link_program(
    const char* name,
    const std::string& vertex,
    const std::string& fragment,
    const std::string& geometry = {}
);

/// Bytes from the start of a bound buffer, as OpenGL takes them: as if they were a pointer.
[[nodiscard]] inline const void* buffer_offset(std::uintptr_t bytes) noexcept {
    return std::bit_cast<const void*>(bytes);
}

} // namespace farfield::opengl
