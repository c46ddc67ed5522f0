#include <farfield/policy/amortization.hpp>

#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <limits>

using farfield::policy::image_pays;

TEST_CASE("an image without a life never pays") {
    CHECK_FALSE(image_pays(0.0, 0.0, 1.0, 0));
    CHECK_FALSE(image_pays(0.0, 0.0, std::numeric_limits<double>::infinity(), 0));
}

TEST_CASE("an image pays where it is cheaper, not where it costs the same") {
    // 12 / 4 + 2 = 5, exactly.
    CHECK_FALSE(image_pays(12.0, 2.0, 5.0, 4));
    CHECK(image_pays(12.0, 2.0, std::nextafter(5.0, 6.0), 4));
    CHECK_FALSE(image_pays(12.0, 2.0, std::nextafter(5.0, 4.0), 4));
    CHECK(image_pays(12.0, 2.0, 5.0, 5));
    CHECK_FALSE(image_pays(12.0, 2.0, 5.0, 3));
    CHECK_FALSE(image_pays(0.0, 0.0, 0.0, 1));
    CHECK(image_pays(0.0, 0.0, std::numeric_limits<double>::denorm_min(), 1));
    // Drawing it alone costs more than the contents: no life is long enough.
    CHECK_FALSE(image_pays(0.0, 2.0, 1.0, UINT32_MAX));
}

TEST_CASE("a longer life, dearer contents and a cheaper image never speak against it") {
    for (std::uint32_t life = 1; life < 64; ++life) {
        for (int contents = 1; contents < 16; ++contents) {
            if (image_pays(20.0, 1.5, contents, life)) {
                CHECK(image_pays(20.0, 1.5, contents, life + 1));
                CHECK(image_pays(20.0, 1.5, contents + 1.0, life));
                CHECK(image_pays(19.0, 1.5, contents, life));
                CHECK(image_pays(20.0, 1.25, contents, life));
            }
        }
    }
}
