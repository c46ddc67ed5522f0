#pragma once

#include "canvas.hpp"

#include <glm/ext/vector_uint3_sized.hpp>
#include <glm/vec2.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

/// The band below a debug view that says what its colours mean.
namespace farfield::eval::detail {

/// How an entry of a legend shows what it explains.
enum class LegendSample : std::uint8_t {
    box,
    line,
    path,
    eye,
    mark,
    ramp,     ///< the colours of heat maps
    scale_bar ///< of a round length, whose label it is
};

/// One thing that a legend explains, and where.
struct LegendEntry {
    LegendSample sample = LegendSample::box;
    std::string label;
    glm::u8vec3 color{0};
    double line_px = 1.0;
    double tint = 0.0;  ///< opacity of the inside of a box
    glm::dvec2 at{0.0}; ///< [px] upper left corner, from that of the legend
};

/// Colours of what entries have in common. 8-bit sRGB
struct LegendColors {
    glm::u8vec3 background{0};
    glm::u8vec3 text{0};
    glm::u8vec3 rule{0}; ///< line above the band
    glm::u8vec3 eye{0};
};

/// Measures of a legend, in proportion to its font.
struct LegendLayout {
    int scale = 1;
    int sample_px = 0;
    int bar_px = 0; ///< longest scale bar
    int gap_px = 0;
    int row_px = 0;

    LegendLayout(int width, int height);
};

/// Entries, placed in rows.
class Legend {
  public:
    /// @param most_px [px] a higher legend is left out
    Legend(
        std::vector<LegendEntry> entries, const LegendLayout& layout, int width, int most_px
    ) noexcept;

    /// [px] 0: it is left out.
    [[nodiscard]] int height() const noexcept { return height_; }

    /// Adds the band to the lower side of a picture, which grows by it.
    /// @param pixels_per_metre for the scale bar, where there is one
    void append_to(Picture& picture, const LegendColors& colors, double pixels_per_metre) const;

  private:
    std::vector<LegendEntry> entries_;
    LegendLayout layout_;
    int height_ = 0;
};

/// The eye on a map: a dot with a ring.
void draw_eye(
    Canvas& canvas,
    const glm::dvec2& at,
    double size_px,
    const glm::u8vec3& ring,
    const glm::u8vec3& color
) noexcept;

/// A light line on a dark one, to be seen on any ground.
void draw_cased_path(
    Canvas& canvas,
    std::span<const glm::dvec2> points,
    double line_px,
    const glm::u8vec3& casing,
    const glm::u8vec3& color
) noexcept;

/// A cross, lying.
void draw_mark(
    Canvas& canvas, const glm::dvec2& at, double size_px, double line_px, const glm::u8vec3& color
) noexcept;

/// An opaque picture of one colour.
[[nodiscard]] Picture blank_picture(int width, int height, const glm::u8vec3& color);

} // namespace farfield::eval::detail
