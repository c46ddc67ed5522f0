// Catch2 2.13 has no way to skip a test: a case that cannot run here calls support::skip, and the
// program then exits with 77, which CTest shows as skipped. FARFIELD_REQUIRE_GPU turns that into a
// failure, so that a lane with a GPU cannot lose its tests in silence.
#define CATCH_CONFIG_RUNNER
#include "support/skip.hpp"

#include <catch2/catch.hpp>

#include <cstdio>
#include <cstdlib>

namespace farfield::support {

namespace {
bool skipped = false;
} // namespace

void skip(const char* reason) {
    std::fprintf(stderr, "skipped: %s\n", reason);
    if (std::getenv("FARFIELD_REQUIRE_GPU") != nullptr) {
        FAIL("skipped though FARFIELD_REQUIRE_GPU is set: " << reason);
    }
    skipped = true;
}

} // namespace farfield::support

int main(int argc, char** argv) {
    constexpr int kSkipped = 77;
    const int status = Catch::Session().run(argc, argv);
    return status == 0 && farfield::support::skipped ? kSkipped : status;
}
