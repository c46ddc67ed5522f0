#pragma once

#include <farfield/core/result.hpp>
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/image/proxy_pair.hpp>
#include <farfield/math/view.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/technique/lod_sprite_options.hpp>

#include <cstdint>
#include <memory>
#include <span>

namespace farfield {

/// How a frame of a `LodSprite` comes about.
enum class SpriteFrame : std::uint8_t {
    geometry,  ///< all of it is geometry
    image,     ///< what has pairs is shown by one image, a keyframe of this very view
    projected, ///< what has pairs is shown by coarse models with keyframes projected on them
};

/// Why a frame is plain geometry.
enum class SpriteRefusal : std::uint8_t {
    none,     ///< it is not
    empty,    ///< nothing that has a pair is in view
    memory,   ///< the budget or `keyframe_limit` holds no keyframe of this size
    near,     ///< the eye is as near to a coarse model as that is wrong, or on its other side
    too_dear, ///< a keyframe would not live long enough to pay
};

/// What the last plan did; counts of one frame unless said otherwise.
struct LodSpriteStatistics {
    SpriteFrame frame = SpriteFrame::geometry;
    SpriteRefusal refusal = SpriteRefusal::none;
    std::uint32_t keyframes_made = 0;      ///< at once, for this view
    std::uint32_t tiles_made = 0;          ///< of foreseen keyframes
    std::uint32_t keyframes_predicted = 0; ///< foreseen ones, finished
    std::uint32_t keyframes_reused = 0;    ///< took over from another, without being made anew
    std::uint32_t keyframes_evicted = 0;   ///< given up to make room
    std::uint32_t keyframes_shown = 0;     ///< by the frame
    std::uint32_t keyframes_kept = 0;      ///< now, finished
    /// [px] of the first keyframe shown, by the criterion: angles as `conversion` says. What is
    /// less than a sixteenth of the threshold counts as that; 0 where nothing is projected, and
    /// with `guaranteed`, where it is not asked for
    double error_px = 0.0;
    /// Of the part of the picture that shows what has pairs: estimated to be in own colours, or in
    /// texels that are too large. 0 where nothing is projected
    double own_share = 0.0;
    std::uint64_t coarse_triangles = 0; ///< drawn with keyframes
    std::uint32_t samples = 0;          ///< whose angles were measured
    std::uint32_t nodes = 0;            ///< of sample trees, looked at for angles
    std::uint64_t texels_created = 0;
    std::uint64_t image_bytes = 0;      ///< now: pages and scratch as allocated
    std::uint64_t image_bytes_peak = 0; ///< ever
};

/// Shows what has pairs of fine and coarse models by keyframes: pictures of the fine models, with
/// depth, projected on the coarse ones.
///
///     auto sprite = LodSprite::create(*tree, pairs, presets::guaranteed_sprite({.error_px = 1}));
///     const FramePlan& plan = sprite->plan(view, motion);
///     if (!backend.execute(plan, target, clear)) { sprite->forget_images(); }
///
/// A frame is one of three. A keyframe is still right: coarse models are drawn, each fragment in
/// the colour of the first of a few keyframes that has seen it, and in its own where none has. None
/// is: one is made of the fine models, and shown as an image on the pixels that it was made on, as
/// right as geometry. Or geometry is drawn, where keyframes would not pay or cannot be. Items
/// without a pair, and those that move, are geometry in every frame.
///
/// A keyframe is right while the error of samples is within the threshold (`sprite_error`), or with
/// `guaranteed` wherever it is shown, fragment by fragment; and while it serves enough of the
/// picture in texels that are small enough. Keyframes that went out of use are kept, and taken
/// again where they are right. With `predict_frames` the next one is made ahead of need, a tile a
/// frame, for where the eye will be.
/// @par Source Chen, Swan, Kuo 1999; docs/lod-sprite.md says what is different, and why.
///
/// The world may change between plans, by `partition::mark_changed` and `update_bounds` of the
/// hierarchy, and by `set_appearance` here: keyframes of what was are not shown. An item that rests
/// elsewhere than where its pair was built is geometry from then on.
///
/// Blind spots: what a keyframe serves is estimated from samples, and hills between them are seen
/// only as far as samples are dense; triangles of a coarse model that rise over the fine one hide
/// what stands behind, unless they are drawn with a finer cut.
class LodSprite {
  public:
    /// @param hierarchy must outlive the technique
    /// @param pairs of items of the hierarchy, whole or split, each of them once; must outlive the
    /// technique, and pass `validate`, which is checked
    /// @return an error that names the option or the pair and its value
    [[nodiscard]] static Result<LodSprite> create(
        const Hierarchy& hierarchy,
        std::span<const ProxyPair> pairs,
        const LodSpriteOptions& options
    );

    LodSprite(LodSprite&& other) noexcept;
    LodSprite& operator=(LodSprite&& other) noexcept;
    LodSprite(const LodSprite&) = delete;
    LodSprite& operator=(const LodSprite&) = delete;
    ~LodSprite();

    /// The plan of one frame; valid until the next call. Deterministic; reads no clock; allocates
    /// nothing once warm.
    /// @param motion of the viewer in world units: for how long a keyframe would live, and where
    /// the next one is needed
    /// @pre validate(view)
    /// @par Cost that of the error of the keyframe in use; of all keyframes where it is no longer
    /// right; linear in the triangles of the cut with `refine`
    [[nodiscard]] const FramePlan& plan(const View& view, const Motion& motion) noexcept;

    /// Starts over: the next plan drops every page. After a plan that failed or was not executed.
    void forget_images() noexcept;

    /// Light or shading look different when `version` is another number than before: every keyframe
    /// is stale then. 0 at first.
    void set_appearance(std::uint64_t version) noexcept;

    /// Of the last plan.
    [[nodiscard]] const LodSpriteStatistics& statistics() const noexcept;

  private:
    struct Impl;
    explicit LodSprite(std::unique_ptr<Impl> impl) noexcept;
    std::unique_ptr<Impl> impl_;
};

} // namespace farfield
