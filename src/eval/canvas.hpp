#pragma once

#include <farfield/image/picture.hpp>

#include <glm/ext/vector_uint3_sized.hpp>
#include <glm/vec2.hpp>

#include <span>
#include <string_view>

namespace farfield::eval::detail {

/// Draws into a picture, anti-aliased and clipped to it. Points are in pixels from the upper left
/// corner, y down: the middle of the first pixel is (0.5, 0.5). What is not finite is not drawn.
class Canvas {
  public:
    /// The picture must outlive the canvas and keep its size.
    explicit Canvas(Picture& picture) noexcept : picture_(&picture) {}

    /// A line with round ends. @param width [px] below 1 it fades
    void
    line(const glm::dvec2& a, const glm::dvec2& b, double width, const glm::u8vec3& color) noexcept;

    /// Lines from point to point and back to the first.
    void
    outline(std::span<const glm::dvec2> points, double width, const glm::u8vec3& color) noexcept;

    /// The inside of a convex polygon. @param opacity [0, 1]
    void
    fill(std::span<const glm::dvec2> points, const glm::u8vec3& color, double opacity) noexcept;

    /// One line of text; only characters that Farfield writes have a shape, others are blank.
    /// @param at upper left corner of the first character
    /// @param scale [px] of a dot of the font, >= 1
    void
    text(const glm::dvec2& at, std::string_view text, int scale, const glm::u8vec3& color) noexcept;

    /// [px] of a text, the gap after its last character included.
    [[nodiscard]] static int text_width(std::string_view text, int scale) noexcept;
    /// [px] from the top of capitals to the bottom of descenders.
    [[nodiscard]] static int text_height(int scale) noexcept;

  private:
    void blend(int x, int y, const glm::u8vec3& color, double opacity) noexcept;

    Picture* picture_;
};

} // namespace farfield::eval::detail
