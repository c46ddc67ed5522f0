#include <farfield/gpu/frame_plan.hpp>
#include <farfield/technique/lod_sprite_options.hpp>

#include <cmath>
#include <limits>
#include <string>

namespace farfield {

namespace {

constexpr std::int32_t kSmallestLimit = 64;
constexpr std::int32_t kLargestPage = 16384;
constexpr double kMostMargin = 4.0;
constexpr std::uint32_t kMostTiles = 64;

tl::unexpected<Error> bad_option(const char* name, double value, const char* expected) {
    return fail(
        ErrorCode::invalid_argument,
        std::string("lod sprite: ") + name + " is " + std::to_string(value) + ", expected " +
            expected
    );
}

Result<void> check_errors(const LodSpriteOptions& options) {
    if (!(options.error_px > 0.0) || !std::isfinite(options.error_px)) {
        return bad_option("error_px", options.error_px, "a finite value above 0 pixels");
    }
    if (!(options.max_own_share >= 0.0 && options.max_own_share <= 1.0)) {
        return bad_option("max_own_share", options.max_own_share, "a share in [0, 1]");
    }
    if (!(options.max_texel_px >= 1.0)) {
        return bad_option("max_texel_px", options.max_texel_px, "at least 1 pixel");
    }
    if (!(options.refine_share > 0.0 && options.refine_share <= 1.0)) {
        return bad_option("refine_share", options.refine_share, "a share in (0, 1]");
    }
    if (options.max_triangles < 1) {
        return bad_option("max_triangles", options.max_triangles, "at least 1");
    }
    return {};
}

Result<void> check_keyframes(const LodSpriteOptions& options) {
    if (options.max_keyframes < 1) {
        return bad_option("max_keyframes", options.max_keyframes, "at least 1");
    }
    if (options.keyframe_limit < kSmallestLimit || options.keyframe_limit > kLargestPage) {
        return bad_option("keyframe_limit", options.keyframe_limit, "64 to 16384 texels");
    }
    if (options.keyframes_shown < 1 || options.keyframes_shown > kMostKeyframes) {
        return bad_option("keyframes_shown", options.keyframes_shown, "1 to 4");
    }
    if (!(options.keyframe_margin >= 1.0 && options.keyframe_margin <= kMostMargin)) {
        return bad_option("keyframe_margin", options.keyframe_margin, "a factor in [1, 4]");
    }
    if (options.keyframe_tiles < 1 || options.keyframe_tiles > kMostTiles) {
        return bad_option("keyframe_tiles", options.keyframe_tiles, "1 to 64");
    }
    if (options.keyframe_samples < 1 || options.keyframe_samples > 64) {
        return bad_option("keyframe_samples", options.keyframe_samples, "1 to 64");
    }
    return {};
}

Result<void> check_pairs(const LodSpriteOptions& options) {
    if (options.paper_theta && options.criterion != SpriteCriterion::rms) {
        return fail(
            ErrorCode::invalid_argument,
            "lod sprite: paper_theta is no bound and goes with the criterion rms alone"
        );
    }
    if (options.predict_frames != 0 && options.predict_frames < options.keyframe_tiles) {
        return bad_option(
            "predict_frames",
            options.predict_frames,
            "0, or no fewer frames than keyframe_tiles, which a keyframe takes"
        );
    }
    if (options.predict_frames != 0 && options.max_keyframes < 2) {
        return bad_option(
            "max_keyframes", options.max_keyframes, "at least 2 where keyframes are foreseen"
        );
    }
    return {};
}

} // namespace

Result<void> validate(const LodSpriteOptions& options) {
    for (const auto check : {check_errors, check_keyframes, check_pairs}) {
        if (Result<void> valid = check(options); !valid) {
            return valid;
        }
    }
    return validate(options.costs);
}

namespace presets {

LodSpriteOptions chen1999(LodSpriteOptions options) noexcept {
    options.conversion = PixelConversion::mean;
    options.criterion = SpriteCriterion::rms;
    options.paper_theta = true;
    options.guaranteed = false;
    options.max_own_share = 1.0;
    options.max_texel_px = std::numeric_limits<double>::infinity();
    options.visibility = SpriteVisibility::triangles;
    options.max_keyframes = 1;
    options.keyframes_shown = 1;
    options.keyframe_margin = 1.0;
    options.predict_frames = 0;
    options.refine = false;
    options.never_slower = false;
    return options;
}

LodSpriteOptions guaranteed_sprite(LodSpriteOptions options) noexcept {
    options.conversion = PixelConversion::bound;
    options.criterion = SpriteCriterion::largest;
    options.paper_theta = false;
    options.guaranteed = true;
    options.visibility = SpriteVisibility::fragments;
    return options;
}

} // namespace presets

} // namespace farfield
