#include "opengl/program.hpp"

#include <array>

namespace farfield::opengl {

namespace {

Result<GLuint> compile(const char* name, GLenum stage, const std::string& text) {
    const GLuint shader = glCreateShader(stage);
    const char* source = text.c_str();
    glShaderSource(shader, 1, &source, nullptr);
    glCompileShader(shader);
    GLint compiled = GL_FALSE;
    glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
    if (compiled == GL_FALSE) {
        std::array<char, 1024> log{};
        glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
        glDeleteShader(shader);
        return fail(
            ErrorCode::device, std::string("OpenGL: shader of ") + name + ": " + log.data()
        );
    }
    return shader;
}

} // namespace

Result<GLuint>
link_program(const char* name, const std::string& vertex, const std::string& fragment) {
    Result<GLuint> vertex_shader = compile(name, GL_VERTEX_SHADER, vertex);
    if (!vertex_shader) {
        return vertex_shader;
    }
    Result<GLuint> fragment_shader = compile(name, GL_FRAGMENT_SHADER, fragment);
    if (!fragment_shader) {
        glDeleteShader(*vertex_shader);
        return fragment_shader;
    }
    const GLuint program = glCreateProgram();
    glAttachShader(program, *vertex_shader);
    glAttachShader(program, *fragment_shader);
    glLinkProgram(program);
    glDeleteShader(*vertex_shader);
    glDeleteShader(*fragment_shader);
    GLint linked = GL_FALSE;
    glGetProgramiv(program, GL_LINK_STATUS, &linked);
    if (linked == GL_FALSE) {
        std::array<char, 1024> log{};
        glGetProgramInfoLog(program, static_cast<GLsizei>(log.size()), nullptr, log.data());
        glDeleteProgram(program);
        return fail(ErrorCode::device, std::string("OpenGL: program ") + name + ": " + log.data());
    }
    return program;
}

} // namespace farfield::opengl
