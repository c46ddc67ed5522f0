#pragma once

#include <farfield/core/ids.hpp>
#include <farfield/core/result.hpp>
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/math/box3.hpp>
#include <farfield/math/view.hpp>
#include <farfield/partition/hierarchy.hpp>

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace farfield {

/// What a geometry source is asked to draw.
struct DrawList {
    std::span<const ItemId> items;                ///< whole items
    std::span<const Piece> pieces;                ///< runs of primitives of split items
    std::span<const Selection> selections = {};   ///< single primitives of items
    std::span<const std::uint32_t> selected = {}; ///< what `selections` refer to
};

/// A keyframe to project, and what the device calls the textures of its page. They are the
/// backend's and hold for one draw. OpenGL: names of 2D textures of one level. Colours are RGBA8,
/// as filtered with texture coordinates; depths R16UI; points RGBA32UI (three floats and the item)
/// and layers RG32UI (a float of texels and the node) are there only with positions.
struct DeviceKeyframe {
    const Keyframe* keyframe = nullptr;
    std::int32_t page_size = 0; ///< [texel] width and height
    std::uint32_t colors = 0;
    std::uint32_t depths = 0;
    std::uint32_t points = 0;
    std::uint32_t layers = 0;
};

/// Where and how a geometry source draws. Target, viewport, scissor, depth and blend state are set
/// by the backend before the call; depth is reverse-z (nearer is greater), clip depth in [0, 1].
struct PassContext {
    const View& view;
    glm::dvec3 origin{0.0};    ///< of `clip`
    std::optional<Box3f> clip; ///< draw only what is inside, relative to `origin`
    bool color = true;         ///< false: only depth is kept
    bool positions = false; ///< positions are kept beside the colour; how is the backend's to say
    /// Keyframes to project, as `Command::Kind::projected` says; none: plain geometry.
    std::span<const DeviceKeyframe> keyframes = {};
    bool whole_triangles = false; ///< as `Command::whole_triangles`
};

/// Draws items. The engine may implement it with its own meshes and shaders; Farfield's own draw a
/// `Scene`. One implementation per kind of backend, since its calls are those of the device.
class GeometrySource {
  public:
    GeometrySource() = default;
    GeometrySource(const GeometrySource&) = delete;
    GeometrySource& operator=(const GeometrySource&) = delete;
    virtual ~GeometrySource() = default;

    /// What the source can do; a technique's options must ask for no more.
    struct Capabilities {
        bool subset = false;      ///< draws pieces
        bool clip_planes = false; ///< honours `PassContext::clip`
        /// Honours `PassContext::positions`. Without it no disparity is measured, nothing else.
        bool position_output = false;
        bool selection = false;  ///< draws selections
        bool projection = false; ///< honours `PassContext::keyframes`
    };
    [[nodiscard]] virtual Capabilities capabilities() const noexcept = 0;

    /// Called before a plan is drawn, for what its commands project: makes what drawing needs and
    /// is not there yet.
    /// @param keyframes of one command, 1 to `kMostKeyframes`
    /// @return an error, and the plan is not drawn
    [[nodiscard]] virtual Result<void>
    prepare_projection(std::size_t keyframes, bool whole_triangles, bool positions) noexcept;

    /// Draws the list, each primitive once, in any order. May change every device state that
    /// belongs to drawing; the backend sets its own again.
    virtual void draw(const DrawList& list, const PassContext& context) noexcept = 0;
};

} // namespace farfield
