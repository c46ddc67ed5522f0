#include "embree/samples.hpp"

#include <cstddef>

namespace farfield::embree {

namespace {

/// The binary digits of a number behind the point, in reverse order: in [0, 1).
double mirrored(std::uint32_t number) noexcept {
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
    double mean = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
        mean += mirrored(static_cast<std::uint32_t>(i)) / static_cast<double>(count);
    }
    std::vector<glm::vec2> places;
    places.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        const double x = (static_cast<double>(i) + 0.5) / static_cast<double>(count);
        const double y = mirrored(static_cast<std::uint32_t>(i)) + 0.5 - mean;
        places.emplace_back(static_cast<float>(x), static_cast<float>(y));
    }
    return places;
}

} // namespace farfield::embree
