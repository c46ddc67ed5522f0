#include <farfield/opengl/context.hpp>

#include <cstdio>

// A machine without OpenGL is no failure of the package; that this links is the point.
int main() {
    const auto context = farfield::opengl::HeadlessContext::create();
    std::printf("%s\n", context ? "OpenGL is there" : context.error().message.c_str());
    return 0;
}
