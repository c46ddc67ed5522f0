#pragma once

#include <farfield/core/result.hpp>

#include <epoxy/gl.h>

#include <string>

namespace farfield::opengl {

/// Compiles and links a vertex and a fragment shader.
/// @param name of the program, for the error message
[[nodiscard]] Result<GLuint>
link_program(const char* name, const std::string& vertex, const std::string& fragment);

} // namespace farfield::opengl
