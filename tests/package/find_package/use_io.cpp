#include <farfield/io/mesh_tools.hpp>
#include <farfield/io/png.hpp>
#include <farfield/io/scene_file.hpp>

#include <cstdio>

// A file that is not there is an error, which says so; that this links is the point.
int main() {
    farfield::Mesh mesh;
    mesh.positions = {{0.0F, 0.0F, 0.0F}, {1.0F, 0.0F, 0.0F}, {0.0F, 1.0F, 0.0F}};
    mesh.normals = {{0.0F, 0.0F, 1.0F}, {0.0F, 0.0F, 1.0F}, {0.0F, 0.0F, 1.0F}};
    mesh.indices = {0, 1, 2};
    mesh.parts = {{.first_index = 0, .index_count = 3}};
    farfield::io::optimize_for_drawing(mesh);

    const auto scene = farfield::io::load_scene("no_such_scene.obj");
    const auto picture = farfield::io::read_png("no_such_picture.png");
    if (scene || picture || farfield::primitive_count(mesh) != 1) {
        return 1;
    }
    std::printf("%s\n%s\n", scene.error().message.c_str(), picture.error().message.c_str());
    return 0;
}
