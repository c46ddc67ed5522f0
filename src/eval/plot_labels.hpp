#pragma once

#include <glm/vec2.hpp>

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// Where the labels of a plot go. Units of the drawing, y down.
namespace farfield::eval::detail {

/// About the width of a text in a common sans-serif font; rather too much than too little. @pre
/// valid UTF-8
[[nodiscard]] double text_width(std::string_view text, double size) noexcept;

/// The text in lines of at most `most` characters where its words allow it. @pre valid UTF-8
[[nodiscard]] std::vector<std::string> wrapped(std::string_view text, std::size_t most);

/// Heights as near to the wanted ones as they can be at `spacing` from each other (the least sum of
/// squares), and then inside `top` to `bottom` where that is long enough.
/// @param wanted ascending
[[nodiscard]] std::vector<double>
moved_apart(std::span<const double> wanted, double spacing, double top, double bottom);

struct PointLabel {
    glm::dvec2 point{0.0};
    glm::dvec2 size{0.0};
    std::string text;
};

struct LabelArea {
    glm::dvec2 low{0.0};
    glm::dvec2 high{0.0};
};

/// The upper left corner of each label: near its point, in the area, where it covers the least of
/// other labels and of the points. Found by choosing again and again, which may leave overlaps
/// where there are more labels than room.
/// @param radius of the points
[[nodiscard]] std::vector<glm::dvec2>
places_beside(std::span<const PointLabel> labels, double radius, const LabelArea& area);

} // namespace farfield::eval::detail
