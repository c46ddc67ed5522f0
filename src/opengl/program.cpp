#include "opengl/program.hpp"

#include <array>
#include <utility>

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

Result<GLuint> link_program(
    const char* name,
    const std::string& vertex,
    const std::string& fragment,
    const std::string& geometry
) {
    const std::array<std::pair<GLenum, const std::string*>, 3> stages = {
        {{GL_VERTEX_SHADER, &vertex},
         {GL_GEOMETRY_SHADER, &geometry},
         {GL_FRAGMENT_SHADER, &fragment}}};
    const GLuint program = glCreateProgram();
    for (const auto& [stage, text] : stages) {
        if (text->empty()) {
            continue;
        }
        Result<GLuint> shader = compile(name, stage, *text);
        if (!shader) {
            glDeleteProgram(program);
            return shader;
        }
        glAttachShader(program, *shader);
        glDeleteShader(*shader); // with the program
    }
    glLinkProgram(program);
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
