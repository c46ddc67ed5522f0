#pragma once

#include <farfield/core/result.hpp>
#include <farfield/gpu/frame_plan.hpp>

#include <epoxy/gl.h>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace farfield::opengl {

/// What drawing splats and cubes writes.
enum class CellOutput : std::uint8_t {
    colors,
    sampled_colors, ///< into a target of several samples
    points,         ///< positions of what owns its pixel: nothing is known of it
};

/// Draws splats and cubes. All of a plan are added, command by command, then uploaded at once and
/// drawn in the order in which they were added.
///
/// Points are one pixel in size and placed on pixels, so that what a splat covers is decided here,
/// sample by sample, and not by how a device rounds: a splat becomes a point for every pixel in
/// which it covers samples, and most of those smaller than a pixel become nothing. Of larger splats
/// the inner pixels are one quad.
class CellDrawer {
  public:
    CellDrawer() = default;
    ~CellDrawer();
    CellDrawer(const CellDrawer&) = delete;
    CellDrawer& operator=(const CellDrawer&) = delete;

    /// Makes what draws, unless it is there.
    [[nodiscard]] Result<void> require(CellOutput output);

    /// Forgets what was added.
    void clear() noexcept;

    /// @param places of the samples of a pixel, within it, at most 32
    void add_splats(
        const FramePlan& plan,
        const Pass& pass,
        const Command& command,
        std::span<const glm::dvec2> places
    );
    void add_cubes(const FramePlan& plan, const Pass& pass, const Command& command);

    /// Hands what was added to the device. @pre an output was required if anything was added
    void upload();

    /// Draws the command that was added as the `index`-th. @pre uploaded, and the output required
    void draw(std::size_t index, CellOutput output) const noexcept;

    /// Most samples a pixel: those of one word of a sample mask.
    static constexpr std::int32_t kMostSamples = 32;

  private:
    struct Vertex {
        glm::vec4 position; ///< clip space
        glm::vec<4, std::uint8_t> color{0};
        std::uint32_t samples = 0; ///< mask of those that are covered
    };
    static_assert(sizeof(Vertex) == 24);

    /// Vertices that are drawn at once: of points, or four of each quad.
    struct Run {
        bool quads = false;
        std::uint32_t first = 0;
        std::uint32_t count = 0;
    };
    struct Added {
        std::size_t first_run = 0;
        std::size_t run_count = 0;
    };

    void begin_command();
    void grow_run(bool quads, std::uint32_t vertices);
    void make_array() noexcept;
    void reserve(std::size_t vertex_count, std::size_t quad_count);

    std::array<GLuint, 3> programs_{}; ///< by output
    GLuint array_ = 0;
    GLuint vertex_buffer_ = 0;
    GLuint index_buffer_ = 0;
    std::size_t vertex_capacity_ = 0;
    std::size_t quad_capacity_ = 0;
    std::vector<Vertex> vertices_;
    std::vector<Run> runs_;
    std::vector<Added> added_;
};

/// Indices of quads of four vertices each, as two triangles.
[[nodiscard]] std::vector<std::uint32_t> quad_indices(std::size_t quads);

} // namespace farfield::opengl
