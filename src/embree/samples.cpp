#include "embree/samples.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>

namespace farfield::embree {

namespace {

/// The binary digits of a number behind the point, in reverse order: in [0, 1).
double mirrored(std::size_t number) noexcept {
    double place = 0.5;
    double result = 0.0;
    for (; number != 0; number >>= 1U) {
        result += (number & 1U) != 0 ? place : 0.0;
        place *= 0.5;
    }
    return result;
}

} // namespace

std::vector<glm::vec2> sample_places(std::int32_t samples) {
    const auto count = static_cast<std::size_t>(samples);
    std::vector<std::size_t> order(count);
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [](std::size_t a, std::size_t b) {
        return mirrored(a) < mirrored(b);
    });
    std::vector<glm::vec2> places(count);
    const auto part = [&](std::size_t index) {
        return static_cast<float>((static_cast<double>(index) + 0.5) / static_cast<double>(count));
    };
    for (std::size_t row = 0; row < count; ++row) {
        places[order[row]] = {part(order[row]), part(row)};
    }
    return places;
}

} // namespace farfield::embree
