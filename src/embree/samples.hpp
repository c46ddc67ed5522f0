#pragma once

#include <glm/vec2.hpp>

#include <cstdint>
#include <vector>

namespace farfield::embree {

/// Places of the samples in a pixel, in (0, 1)^2, both coordinates at the centres of n equal parts:
/// x of part i, y of the part that i comes to when the numbers below n are ordered by their binary
/// digits read backwards. For powers of two these are the Hammersley points. Any n is well spread:
/// every row and every column of width 1/n holds one sample. One sample is the centre.
/// @par Source Hammersley: Monte Carlo methods for solving multivariable problems, 1960
[[nodiscard]] std::vector<glm::vec2> sample_places(std::int32_t samples);

} // namespace farfield::embree
