#include "picture_checks.hpp"
#include <farfield/eval/image_errors.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <string>

namespace farfield::eval {

namespace {

using detail::check;
using detail::check_pair;

constexpr std::size_t kChannels = 4;
constexpr std::size_t kColors = 3; // alpha is the fourth

Result<void> check_level(const char* what, int value) {
    if (value < 0 || value > 255) {
        return fail(
            ErrorCode::invalid_argument,
            std::string(what) + " is " + std::to_string(value) + ", expected 0 to 255"
        );
    }
    return {};
}

std::size_t pixel_count(const Picture& picture) {
    return picture.rgba.size() / kChannels;
}

int channel_difference(const Picture& a, const Picture& b, std::size_t pixel, std::size_t channel) {
    const std::size_t at = pixel * kChannels + channel;
    return std::abs(static_cast<int>(a.rgba[at]) - static_cast<int>(b.rgba[at]));
}

} // namespace

Result<double> psnr_db(const Picture& reference, const Picture& picture) {
    if (auto checked = check_pair("reference", reference, "picture", picture); !checked) {
        return tl::unexpected(checked.error());
    }
    std::uint64_t squares = 0; // exact: at most 2^16 a channel, far under 2^48 channels
    for (std::size_t pixel = 0; pixel < pixel_count(picture); ++pixel) {
        for (std::size_t channel = 0; channel < kColors; ++channel) {
            const int difference = channel_difference(reference, picture, pixel, channel);
            squares += static_cast<std::uint64_t>(difference * difference);
        }
    }
    if (squares == 0) {
        return kMaxPsnrDb;
    }
    const double mean =
        static_cast<double>(squares) / static_cast<double>(pixel_count(picture) * kColors);
    return std::min(10.0 * std::log10(255.0 * 255.0 / mean), kMaxPsnrDb);
}

Result<PictureDifference> compare(
    const Picture& reference, const Picture& picture, int threshold, const CoverageMask* looked_at
) {
    if (auto checked = check_pair("reference", reference, "picture", picture); !checked) {
        return tl::unexpected(checked.error());
    }
    if (auto checked = check_level("threshold", threshold); !checked) {
        return tl::unexpected(checked.error());
    }
    if (looked_at != nullptr) {
        if (auto checked = check_pair("reference", reference, "mask", *looked_at); !checked) {
            return tl::unexpected(checked.error());
        }
    }
    PictureDifference result;
    std::uint64_t sum = 0;
    std::uint64_t looked = 0;
    std::uint64_t over = 0;
    for (std::size_t pixel = 0; pixel < pixel_count(picture); ++pixel) {
        if (looked_at != nullptr && looked_at->covered[pixel] == 0) {
            continue;
        }
        ++looked;
        int largest = 0;
        for (std::size_t channel = 0; channel < kColors; ++channel) {
            const int difference = channel_difference(reference, picture, pixel, channel);
            sum += static_cast<std::uint64_t>(difference);
            largest = std::max(largest, difference);
        }
        result.max = std::max(result.max, largest);
        over += largest > threshold ? 1 : 0;
    }
    if (looked != 0) {
        result.mean = static_cast<double>(sum) / static_cast<double>(looked * kColors);
        result.over_fraction = static_cast<double>(over) / static_cast<double>(looked);
    }
    return result;
}

Result<Picture>
difference_picture(const Picture& reference, const Picture& picture, double factor) {
    if (auto checked = check_pair("reference", reference, "picture", picture); !checked) {
        return tl::unexpected(checked.error());
    }
    if (!(factor >= 0.0) || !std::isfinite(factor)) {
        return fail(
            ErrorCode::invalid_argument,
            "difference picture: factor is " + std::to_string(factor) + ", expected 0 or more"
        );
    }
    Picture result{picture.width, picture.height, std::vector<std::uint8_t>(picture.rgba.size())};
    for (std::size_t pixel = 0; pixel < pixel_count(picture); ++pixel) {
        for (std::size_t channel = 0; channel < kColors; ++channel) {
            const double value = factor * channel_difference(reference, picture, pixel, channel);
            result.rgba[pixel * kChannels + channel] =
                static_cast<std::uint8_t>(std::min(std::round(value), 255.0));
        }
        result.rgba[pixel * kChannels + kColors] = 255;
    }
    return result;
}

Result<CoverageMask>
coverage_by_background(const Picture& picture, const glm::u8vec3& background, int tolerance) {
    if (auto checked = check("picture", picture); !checked) {
        return tl::unexpected(checked.error());
    }
    if (auto checked = check_level("tolerance", tolerance); !checked) {
        return tl::unexpected(checked.error());
    }
    const std::array<int, kColors> sky = {background.x, background.y, background.z};
    CoverageMask mask{picture.width, picture.height, {}};
    mask.covered.resize(pixel_count(picture));
    for (std::size_t pixel = 0; pixel < mask.covered.size(); ++pixel) {
        for (std::size_t channel = 0; channel < kColors; ++channel) {
            const int value = picture.rgba[pixel * kChannels + channel];
            if (std::abs(value - sky[channel]) > tolerance) {
                mask.covered[pixel] = 1;
            }
        }
    }
    return mask;
}

Result<CoverageMask> coverage_by_alpha(const Picture& picture, std::uint8_t least_alpha) {
    if (auto checked = check("picture", picture); !checked) {
        return tl::unexpected(checked.error());
    }
    CoverageMask mask{picture.width, picture.height, {}};
    mask.covered.resize(pixel_count(picture));
    for (std::size_t pixel = 0; pixel < mask.covered.size(); ++pixel) {
        const std::uint8_t alpha = picture.rgba[pixel * kChannels + kColors];
        mask.covered[pixel] = alpha >= least_alpha ? 1 : 0;
    }
    return mask;
}

Result<CoverageErrors>
compare_coverage(const CoverageMask& reference, const CoverageMask& picture) {
    if (auto checked = check_pair("reference mask", reference, "mask", picture); !checked) {
        return tl::unexpected(checked.error());
    }
    CoverageErrors errors;
    for (std::size_t pixel = 0; pixel < reference.covered.size(); ++pixel) {
        const bool expected = reference.covered[pixel] != 0;
        const bool shown = picture.covered[pixel] != 0;
        errors.covered_pixels += expected ? 1 : 0;
        errors.missing_pixels += expected && !shown ? 1 : 0;
        errors.extra_pixels += !expected && shown ? 1 : 0;
    }
    if (errors.covered_pixels != 0) {
        const auto covered = static_cast<double>(errors.covered_pixels);
        errors.missing_fraction = static_cast<double>(errors.missing_pixels) / covered;
        errors.extra_fraction = static_cast<double>(errors.extra_pixels) / covered;
    }
    return errors;
}

Result<SkyHoles> find_sky_holes(const CoverageMask& reference, const CoverageMask& picture) {
    if (auto checked = check_pair("reference mask", reference, "mask", picture); !checked) {
        return tl::unexpected(checked.error());
    }
    const auto covered = [](const CoverageMask& mask, int x, int y) {
        const auto row = static_cast<std::size_t>(y) * static_cast<std::size_t>(mask.width);
        return mask.covered[row + static_cast<std::size_t>(x)] != 0;
    };
    const auto inside = [&](int x, int y) {
        for (int v = std::max(y - 1, 0); v <= std::min(y + 1, reference.height - 1); ++v) {
            for (int u = std::max(x - 1, 0); u <= std::min(x + 1, reference.width - 1); ++u) {
                if (!covered(reference, u, v)) {
                    return false;
                }
            }
        }
        return true;
    };
    SkyHoles holes;
    for (int y = 0; y < reference.height; ++y) {
        for (int x = 0; x < reference.width; ++x) {
            if (!inside(x, y)) {
                continue;
            }
            ++holes.inside_pixels;
            if (covered(picture, x, y)) {
                continue;
            }
            if (holes.pixels == 0) {
                holes.first_x = x;
                holes.first_y = y;
            }
            ++holes.pixels;
        }
    }
    return holes;
}

} // namespace farfield::eval
