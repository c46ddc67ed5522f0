#pragma once

#include <glm/vec2.hpp>

#include <cstdint>
#include <vector>

namespace farfield::embree {

/// Places of the samples in a pixel, in [0, 1)^2: the Hammersley points, x = (i + 1/2) / n and y
/// the digits of i mirrored in base 2, moved so that their mean is 1/2. Any n is well spread: every
/// column of width 1/n holds one sample, and so does every row where n is a power of two. One
/// sample is the centre.
/// @par Source Hammersley: Monte Carlo methods for solving multivariable problems, 1960
[[nodiscard]] std::vector<glm::vec2> sample_places(std::int32_t samples);

} // namespace farfield::embree
