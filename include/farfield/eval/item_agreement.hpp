#pragma once

#include <farfield/core/result.hpp>
#include <farfield/image/position_picture.hpp>

#include <cstdint>
#include <optional>

namespace farfield {

/// Whether two pictures of one view, made in different ways, show the same items. Pixels that are
/// background in both count nowhere: sky that agrees with sky says nothing.
struct ItemAgreement {
    std::uint64_t pixels = 0; ///< that show an item in at least one of the pictures
    /// Of them, those whose 3x3 neighbourhood has one id in each of the pictures; background is an
    /// id here. Elsewhere rounding may well decide which of two items a pixel shows.
    std::uint64_t settled_pixels = 0;
    std::uint64_t equal_pixels = 0;         ///< of the settled ones: the same id in both
    std::optional<double> settled_fraction; ///< of `pixels`; none where there are none
    std::optional<double> equal_fraction;   ///< of `settled_pixels`; none where there are none
};

namespace eval {

/// Compares item ids. Beyond the edge of the image nothing is a neighbour.
/// @return an error where a picture is empty, its texels do not fill its size, or sizes differ
[[nodiscard]] Result<ItemAgreement>
compare_items(const PositionPicture& a, const PositionPicture& b);

} // namespace eval
} // namespace farfield
