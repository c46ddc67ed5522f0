#include <farfield/technique/image_cache_options.hpp>

#include <cmath>
#include <string>

namespace farfield {

namespace {

constexpr std::int32_t kLargestPage = 16384;
constexpr std::int32_t kSmallestPage = 64;
constexpr std::int32_t kSmallestLimit = 16;

tl::unexpected<Error> bad_option(const char* name, double value, const char* expected) {
    return fail(
        ErrorCode::invalid_argument,
        std::string("image cache: ") + name + " is " + std::to_string(value) + ", expected " +
            expected
    );
}

tl::unexpected<Error> bad_pair(const char* what) {
    return fail(ErrorCode::invalid_argument, std::string("image cache: ") + what);
}

Result<void> check_values(const ImageCacheOptions& options) {
    if (!(options.error_px > 0.0) || !std::isfinite(options.error_px)) {
        return bad_option("error_px", options.error_px, "a finite value above 0 pixels");
    }
    if (!(options.overlap_px >= 0.0) || !std::isfinite(options.overlap_px)) {
        return bad_option("overlap_px", options.overlap_px, "a finite value of at least 0 texels");
    }
    if (options.image_samples < 1 || options.image_samples > 64) {
        return bad_option("image_samples", options.image_samples, "1 to 64");
    }
    if (options.frame_samples < 1 || options.frame_samples > 64) {
        return bad_option("frame_samples", options.frame_samples, "1 to 64");
    }
    if (options.page_size < kSmallestPage || options.page_size > kLargestPage) {
        return bad_option("page_size", options.page_size, "64 to 16384 texels");
    }
    if (options.image_limit < kSmallestLimit || options.image_limit > kLargestPage) {
        return bad_option("image_limit", options.image_limit, "16 to 16384 texels");
    }
    if (!(options.texel_px > 0.0 && options.texel_px <= 1.0)) {
        return bad_option("texel_px", options.texel_px, "a value in (0, 1] pixels");
    }
    if (!(options.max_texel_px >= options.texel_px)) {
        return bad_option("max_texel_px", options.max_texel_px, "at least texel_px");
    }
    if (options.max_life < 1) {
        return bad_option("max_life", options.max_life, "at least 1 frame");
    }
    return {};
}

Result<void> check_pairs(const ImageCacheOptions& options) {
    if (options.orientation == ImageOrientation::view_aligned) {
        if (options.all_around) {
            return bad_pair("all_around needs images that face the eye (orientation)");
        }
        if (options.validity == ImageValidity::impostor_angles) {
            return bad_pair("the angles of impostors need images that face the eye (orientation)");
        }
        if (options.texel_px != 1.0) {
            return bad_option("texel_px", options.texel_px, "1 pixel for view-aligned images");
        }
    } else if (options.exact_pixels) {
        return bad_pair("exact_pixels needs view-aligned images (orientation)");
    }
    if (options.quad_depth == QuadDepth::plane && options.surfaces == SurfacePlacement::first) {
        return bad_pair("quad_depth plane does not go with surfaces drawn first");
    }
    return {};
}

} // namespace

Result<void> validate(const ImageCacheOptions& options) {
    if (Result<void> valid = check_values(options); !valid) {
        return valid;
    }
    if (Result<void> valid = check_pairs(options); !valid) {
        return valid;
    }
    return validate(options.costs);
}

namespace presets {

ImageCacheOptions shade1996(ImageCacheOptions options) noexcept {
    options.conversion = PixelConversion::mean;
    options.validity = ImageValidity::angle;
    options.orientation = ImageOrientation::view_aligned;
    options.policy = ImagePolicy::amortized;
    return options;
}

ImageCacheOptions schaufler1996(ImageCacheOptions options) noexcept {
    options.conversion = PixelConversion::mean;
    options.validity = ImageValidity::impostor_angles;
    options.orientation = ImageOrientation::facing_eye;
    options.policy = ImagePolicy::whenever_possible;
    options.exact_pixels = false;
    options.image_limit = 256;
    options.texel_px = 0.75;
    options.max_texel_px = 1.0;
    return options;
}

} // namespace presets

} // namespace farfield
