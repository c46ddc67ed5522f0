#include <farfield/embree/embree_backend.hpp>

#include <cstdio>

// A frame of nothing; that this links is the point.
int main() {
    const auto backend = farfield::embree::EmbreeBackend::create({}, nullptr);
    if (!backend) {
        std::printf("%s\n", backend.error().message.c_str());
        return 1;
    }
    std::printf("%s\n", (*backend)->device().c_str());
    return 0;
}
