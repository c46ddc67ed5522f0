// What a first program with Farfield does: three boxes become a hierarchy.

#include <farfield/farfield.hpp>

#include <array>
#include <cstdint>
#include <cstdio>

int main() {
    const std::array<farfield::Object, 3> objects = {{
        {.bounds = {{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}}, .primitives = 100},
        {.bounds = {{4.0, 0.0, 0.0}, {5.0, 1.0, 1.0}}, .primitives = 100},
        {.bounds = {{8.0, 0.0, 0.0}, {9.0, 1.0, 1.0}}, .primitives = 100},
    }};
    const farfield::Result<farfield::Hierarchy> tree =
        farfield::partition::build_bsp(objects, {.max_items = 1});
    if (!tree) {
        std::fprintf(stderr, "%s\n", tree.error().message.c_str());
        return 1;
    }
    const std::uint64_t primitives = farfield::primitive_count(tree->nodes.front());
    std::printf(
        "%zu nodes, %llu primitives\n",
        tree->nodes.size(),
        static_cast<unsigned long long>(primitives)
    );
    return primitives == 300 && tree->items.size() == 3 ? 0 : 1;
}
