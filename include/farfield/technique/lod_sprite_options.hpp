#pragma once

#include <farfield/core/result.hpp>
#include <farfield/metric/pixel_conversion.hpp>
#include <farfield/policy/cost_model.hpp>
#include <farfield/technique/culled_geometry.hpp>

#include <cstdint>
#include <limits>

namespace farfield {

/// Which of the errors of all samples a keyframe is held to.
enum class SpriteCriterion : std::uint8_t {
    rms,     ///< the root of their mean square, as in the paper: single ones may be far larger
    largest, ///< the largest, found through the hierarchy of samples
};

/// What decides whether a keyframe has seen what a triangle of the coarse model shows.
enum class SpriteVisibility : std::uint8_t {
    fragments, ///< each fragment for itself
    triangles, ///< all three corners, as in the paper
};

/// How a `LodSprite` decides. Presets fill it in; every field has its default.
struct LodSpriteOptions {
    /// [px] > 0, finite; 0.5 to 4 are of use. What the criterion is held to; with `guaranteed` the
    /// farthest that anything projected is shown from its place, beside half a diagonal of the
    /// keyframe's texel, as pictures are sampled.
    double error_px = 1.0;
    PixelConversion conversion = PixelConversion::bound;
    SpriteCriterion criterion = SpriteCriterion::largest;
    /// The paper's shortcut: one turn for all samples, that of the middle of the model; distances
    /// to planes in place of distances along rays; one sample a coarse square; samples out of sight
    /// count. With `SpriteCriterion::rms` only.
    bool paper_theta = false;
    /// Keeps `error_px` fragment by fragment (`Keyframe::max_shift_px`): what is farther off shows
    /// the coarse model's own colour. Not the criterion but `max_own_share` asks for keyframes
    /// then.
    bool guaranteed = false;
    /// A keyframe is due when it is estimated to serve no more than the rest of the picture: what
    /// it has not seen, or with `guaranteed` shows too far off, has its own colour, and texels
    /// larger than `max_texel_px` count as lost as well. [0, 1]; 1: not looked at
    double max_own_share = 0.1;
    /// [px] Largest size of a keyframe's texels. >= 1; infinite: any
    double max_texel_px = 2.0;
    SpriteVisibility visibility = SpriteVisibility::fragments;
    /// Keyframes kept, the one that is being made included. >= 1; as many as the budget holds
    std::uint32_t max_keyframes = 8;
    std::uint64_t image_budget_bytes = std::uint64_t{64} << 20U; ///< [byte] 0: geometry only
    /// [texel] largest width and height of a keyframe, margin included; larger views are drawn as
    /// geometry. 64 to 16384
    std::int32_t keyframe_limit = 8192;
    /// Keyframes that a frame shows, each where those before it have seen nothing. 1 to 4
    std::uint32_t keyframes_shown = 2;
    /// How much wider and higher a keyframe is than the view, on pixels of the same size, so that
    /// turning does not leave it at once. [1, 4]
    double keyframe_margin = 1.0;
    /// [frame] How far ahead the keyframe after this one is foreseen; 0: not at all. At least
    /// `keyframe_tiles` otherwise, or it would be late.
    std::uint32_t predict_frames = 0;
    /// Frames over which a foreseen keyframe is made, one tile in each. 1 to 64
    std::uint32_t keyframe_tiles = 8;
    /// Cuts coarse models that can be refined anew for every frame.
    bool refine = false;
    /// With `refine`, a triangle is split where this share of `error_px` is exceeded. (0, 1]
    double refine_share = 1.0;
    std::uint32_t max_triangles = 65536; ///< of all cuts of a frame together, with `refine`. >= 1
    /// Draws geometry, and makes nothing, where keyframes would not live long enough to pay.
    bool never_slower = true;
    std::int32_t keyframe_samples = 1; ///< per texel of keyframes; 1 to what the backend takes
    CostModel costs{};
    GeometryOrder order = GeometryOrder::front_to_back; ///< of what is drawn as geometry
    std::uint32_t cache_id = 0; ///< tells the pages of techniques that share a backend apart
};

/// Checks values, and what they cannot mean together.
/// @return an error that names the option and its value
[[nodiscard]] Result<void> validate(const LodSpriteOptions& options);

namespace presets {

/// The LOD-sprite technique as published: one keyframe, the root of the mean square of shortcut
/// angles, mean pixel angle, triangles with a corner that the keyframe has not seen in their own
/// colour.
/// @param options what the preset leaves open: threshold, budget, costs, samples
/// @par Source Chen, Swan, Kuo 1999, section 3. Departures: the frame in which a keyframe is made
/// shows it as one image; a keyframe is given up where the eye comes as near to the coarse model as
/// that is wrong.
[[nodiscard]] LodSpriteOptions chen1999(LodSpriteOptions options = {}) noexcept;

/// What is projected is nowhere farther than `error_px` and half a texel's diagonal from its place,
/// fragment by fragment; keyframes are kept, and two of them shown at a time.
/// @param options what the preset leaves open: threshold, margin, prediction, refinement, budget
[[nodiscard]] LodSpriteOptions guaranteed_sprite(LodSpriteOptions options = {}) noexcept;

} // namespace presets

} // namespace farfield
