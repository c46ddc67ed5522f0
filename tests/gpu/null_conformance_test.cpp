#include "gpu/backend_conformance.hpp"
#include <farfield/gpu/null/null_backend.hpp>

#include <catch2/catch.hpp>

using namespace farfield;

TEST_CASE("The null backend does what every backend does") {
    const support::SmallWorld world = support::make_world(support::small_scene());
    NullBackend backend(world.item_primitives, &world.hierarchy);
    support::check_conformance(backend, world);
    CHECK(backend.device() == "null");
}
