#pragma once

#include <farfield/core/result.hpp>
#include <farfield/image/picture.hpp>

#include <glm/fwd.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <optional>
#include <vector>

namespace farfield {

/// Which pixels show geometry.
struct CoverageMask {
    int width = 0;                     ///< [px]
    int height = 0;                    ///< [px]
    std::vector<std::uint8_t> covered; ///< width * height, rows from the top; 0: background

    friend bool operator==(const CoverageMask&, const CoverageMask&) = default;
};

/// Where a picture and its reference disagree about what is background.
struct CoverageErrors {
    std::uint64_t covered_pixels = 0; ///< of the reference
    std::uint64_t missing_pixels = 0; ///< the reference shows geometry, the picture background
    std::uint64_t extra_pixels = 0;   ///< the reverse
    /// Of the reference's covered pixels; none where it covers none.
    std::optional<double> missing_fraction;
    std::optional<double> extra_fraction; ///< likewise; above 1 is possible
};

/// How far two pictures are apart, over the pixels looked at. Alpha is not looked at.
struct PictureDifference {
    double mean = 0.0; ///< absolute difference of a channel, [0, 255]
    int max = 0;       ///< largest absolute difference of a channel, [0, 255]
    /// Share of the pixels with some channel further apart than the threshold; none where there
    /// was no pixel to look at.
    std::optional<double> over_fraction;
};

/// Background inside geometry.
struct SkyHoles {
    std::uint64_t pixels = 0;        ///< sky in the picture, inside the reference's geometry
    std::uint64_t inside_pixels = 0; ///< of the reference's geometry without its border
    int first_x = -1;                ///< [px] the first hole from the top left, -1: none
    int first_y = -1;                ///< [px]
};

namespace eval {

/// PSNR of pictures that are equal or almost so. [dB] A cap keeps medians and reports finite (JSON
/// has no infinity, and null says that nothing was measured); it is what a mean square difference
/// of 6.5e-6 gives: two pictures of 640x480 that differ by 1 in six of their 921,600 channels.
inline constexpr double kMaxPsnrDb = 100.0;

/// Peak signal-to-noise ratio: 10 log10(255^2 / mean square difference of R, G and B, as encoded),
/// at most `kMaxPsnrDb`. [dB] It says nothing about where the difference is: a forest moved by one
/// pixel and a forest without leaves score alike.
/// @return an error where a picture is empty, its bytes do not fill its size, or sizes differ
[[nodiscard]] Result<double> psnr_db(const Picture& reference, const Picture& picture);

/// Mean and largest difference, and the share of pixels over a threshold.
/// @param threshold [0, 255] a pixel counts when a channel differs by more than that
/// @param looked_at only its covered pixels count; null: all pixels count
/// @return errors as `psnr_db`, and for a mask of another size
[[nodiscard]] Result<PictureDifference> compare(
    const Picture& reference,
    const Picture& picture,
    int threshold,
    const CoverageMask* looked_at = nullptr
);

/// Absolute difference of R, G and B times `factor`, clamped to 255, opaque: black is equal.
/// @param factor >= 0
/// @return errors as `psnr_db`
[[nodiscard]] Result<Picture>
difference_picture(const Picture& reference, const Picture& picture, double factor);

/// Covers the pixels whose colour is further from the background than `tolerance` in a channel.
/// Geometry that has the background's colour counts as background: choose a sky that nothing has.
/// @param tolerance [0, 255]; blending and filtering against the background need more than 0
[[nodiscard]] Result<CoverageMask>
coverage_by_background(const Picture& picture, const glm::u8vec3& background, int tolerance = 0);

/// Covers the pixels with alpha of at least `least_alpha`, for pictures over a transparent
/// background.
[[nodiscard]] Result<CoverageMask>
coverage_by_alpha(const Picture& picture, std::uint8_t least_alpha = 128);

/// Missing and extra pixels. @return an error where sizes differ or a mask does not fill its size
[[nodiscard]] Result<CoverageErrors>
compare_coverage(const CoverageMask& reference, const CoverageMask& picture);

/// Finds sky seen through surfaces that are closed: background of the picture where the reference
/// and all eight neighbours show geometry. The border of one pixel is left out, since a silhouette
/// may legally move within it; so are gaps in the reference, with their border. Beyond the edge of
/// the image nothing is a neighbour.
/// @return errors as `compare_coverage`
[[nodiscard]] Result<SkyHoles>
find_sky_holes(const CoverageMask& reference, const CoverageMask& picture);

} // namespace eval
} // namespace farfield
