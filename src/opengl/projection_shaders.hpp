#pragma once

#include <farfield/core/result.hpp>
#include <farfield/gpu/geometry_source.hpp>

#include <epoxy/gl.h>

#include <cstddef>
#include <cstdint>
#include <string>

namespace farfield::opengl {

/// What shaders that project keyframes have beside those of plain geometry. The text says in GLSL
/// what `gpu::KeyframeLookup` says; the names are those of its terms.
///
/// Fragments have their own colour in the same draw, where no keyframe sees them. Whole triangles
/// are drawn first where a keyframe sees them, and then once more as plain geometry, which is shown
/// where nothing was: so nothing is worked out twice, and coarse models of few triangles, which are
/// shown like that, cost little to draw twice.
struct ProjectionVariant {
    std::size_t keyframes = 1; ///< to `kMostKeyframes`
    bool whole_triangles = false;

    static constexpr std::size_t kCount = std::size_t{kMostKeyframes} * 2;
    [[nodiscard]] std::size_t place() const noexcept {
        return (keyframes - 1) * 2 + (whole_triangles ? 1 : 0);
    }
};

/// Texture units: of colours and depths of the keyframes, of their points and layers.
inline constexpr GLuint kKeyframeColorUnit = 1;
inline constexpr GLuint kKeyframeDepthUnit = kKeyframeColorUnit + kMostKeyframes;
inline constexpr GLuint kKeyframePointUnit = kKeyframeDepthUnit + kMostKeyframes;
inline constexpr GLuint kKeyframeLayerUnit = kKeyframePointUnit + kMostKeyframes;
inline constexpr GLuint kUnitsWithKeyframes = kKeyframeLayerUnit + kMostKeyframes;

/// Declarations of a vertex shader; takes locations from 4 on of its outputs.
[[nodiscard]] std::string projection_vertex_head(const ProjectionVariant& variant, bool positions);
/// Statements of it, after `camera`, a point relative to the eye in camera axes.
[[nodiscard]] std::string projection_vertex_body(const ProjectionVariant& variant, bool positions);

/// The geometry shader that tells which keyframe a triangle shows as a whole, and hands the rest
/// on; "" where there is none.
[[nodiscard]] std::string projection_geometry_shader(
    const ProjectionVariant& variant, bool textured, bool clipped, bool positions
);

/// Declarations of a fragment shader.
[[nodiscard]] std::string
projection_fragment_head(const ProjectionVariant& variant, bool positions);
/// Statements of it, after `result`, and with positions `point` and `layer`, are those of plain
/// geometry; with whole triangles, of nothing.
[[nodiscard]] std::string
projection_fragment_body(const ProjectionVariant& variant, bool positions);

/// Uniforms of all these.
class ProjectionUniforms {
  public:
    static ProjectionUniforms of(GLuint program) noexcept;

    /// Sets them, with the program in use, and binds textures.
    /// @pre as many keyframes as the variant has
    void set(const PassContext& context) const noexcept;

  private:
    GLint rows_ = -1;
    GLint nodes_ = -1;
    GLint pixels_per_tangent_ = -1;
};

} // namespace farfield::opengl
