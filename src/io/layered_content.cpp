#include "io/layered_content.hpp"

#include "io/binary.hpp"

#include <array>
#include <cstring>
#include <numeric>

namespace farfield::io {
namespace {

/// What is in front of the arrays.
struct Front {
    View view;
    double near_depth = 0.0;
    double far_depth = 0.0;
    std::uint64_t samples = 0;
    std::uint64_t points = 0;
};
static_assert(sizeof(View) == 152 && sizeof(Front) == 184 && sizeof(PositionTexel) == 24);

/// Bytes of a sample: its place in the texel, depth, extent, green, red and blue. A sample's first
/// bytes lie one after the other, then all second ones: bytes of one kind are alike.
constexpr std::size_t kPlanes = 8;
using PlaneBytes = std::array<std::uint8_t, kPlanes>;

std::uint8_t low(unsigned value) {
    return static_cast<std::uint8_t>(value & 0xFFU);
}

/// Small differences of either sign as small numbers: 0, -1, 1, -2, ...
unsigned folded(std::uint16_t value, std::uint16_t expected) {
    const auto difference = static_cast<std::uint16_t>(value - expected);
    const unsigned sign = difference >= 0x8000U ? 0xFFFFU : 0U;
    return (((unsigned{difference} << 1U) ^ sign) & 0xFFFFU);
}

std::uint16_t unfolded(unsigned value, std::uint16_t expected) {
    const unsigned difference = (value >> 1U) ^ ((value & 1U) != 0U ? 0xFFFFU : 0U);
    return static_cast<std::uint16_t>(expected + difference);
}

/// What is left of a sample where another one is known that should be much like it.
PlaneBytes split(const LayeredSample& sample, const LayeredSample& like) {
    const unsigned place = sample.x % unsigned{kLayeredSteps} | sample.y % unsigned{kLayeredSteps}
                                                                    << 4U;
    const unsigned depth = folded(sample.depth, like.depth);
    const unsigned extent = folded(sample.extent, like.extent);
    const unsigned red = sample.color.r - unsigned{like.color.r};
    const unsigned green = sample.color.g - unsigned{like.color.g};
    const unsigned blue = sample.color.b - unsigned{like.color.b};
    // Brightness changes in all channels alike.
    return {
        low(place),
        low(depth),
        low(depth >> 8U),
        low(extent),
        low(extent >> 8U),
        low(green),
        low(red - green),
        low(blue - green)};
}

LayeredSample
joined(const PlaneBytes& bytes, const LayeredSample& like, unsigned column, unsigned row) {
    LayeredSample sample;
    sample.x = static_cast<std::uint16_t>(column * unsigned{kLayeredSteps} + (bytes[0] & 15U));
    sample.y = static_cast<std::uint16_t>(row * unsigned{kLayeredSteps} + (bytes[0] >> 4U));
    sample.depth = unfolded(bytes[1] | unsigned{bytes[2]} << 8U, like.depth);
    sample.extent = unfolded(bytes[3] | unsigned{bytes[4]} << 8U, like.extent);
    const unsigned green = bytes[5];
    sample.color.g = low(like.color.g + green);
    sample.color.r = low(like.color.r + bytes[6] + green);
    sample.color.b = low(like.color.b + bytes[7] + green);
    sample.color.a = 255;
    return sample;
}

/// Calls `each(index, like, texel)` for every sample; `like` is where the one is that should be
/// much like it: in front of it in its texel, or the first of the last texel that has any; for the
/// very first one itself.
template <typename Each>
void for_each_sample(const std::vector<std::uint8_t>& counts, Each&& each) {
    std::size_t index = 0;
    std::size_t first = 0;
    for (std::size_t texel = 0; texel < counts.size(); ++texel) {
        const std::size_t begin = index;
        for (std::size_t end = begin + counts[texel]; index < end; ++index) {
            each(index, index > begin ? index - 1 : first, texel);
        }
        first = counts[texel] > 0 ? begin : first;
    }
}

std::string bad_sizes(const Front& front, std::uint64_t counted, std::size_t left) {
    return "has " + std::to_string(left) + " bytes for " + std::to_string(front.samples) +
           " samples and " + std::to_string(front.points) + " points, and counts " +
           std::to_string(counted) + " samples";
}

} // namespace

std::string layered_content(const LayeredDepthImage& image) {
    const std::size_t samples = image.samples.size();
    std::string bytes;
    bytes.reserve(
        sizeof(Front) + image.counts.size() + kPlanes * samples +
        sizeof(PositionTexel) * image.points.size()
    );
    append(
        bytes, Front{image.view, image.near_depth, image.far_depth, samples, image.points.size()}
    );
    append(bytes, image.counts);
    std::size_t at = bytes.size();
    bytes.resize(at + kPlanes * samples);
    for_each_sample(image.counts, [&](std::size_t index, std::size_t like, std::size_t /*texel*/) {
        const LayeredSample known = index > 0 ? image.samples[like] : LayeredSample{};
        const PlaneBytes planes = split(image.samples[index], known);
        for (std::size_t plane = 0; plane < kPlanes; ++plane) {
            bytes[at + plane * samples + index] = static_cast<char>(planes[plane]);
        }
    });
    at = bytes.size();
    bytes.resize(at + sizeof(PositionTexel) * image.points.size());
    for (std::size_t i = 0; i < image.points.size(); ++i) {
        std::array<char, sizeof(PositionTexel)> point{};
        std::memcpy(point.data(), &image.points[i], point.size());
        for (std::size_t plane = 0; plane < point.size(); ++plane) {
            bytes[at + plane * samples + i] = point[plane];
        }
    }
    return bytes;
}

std::optional<std::string>
take_layered_content(std::string_view content, LayeredDepthImage& image) {
    ByteReader reader(content);
    Front front;
    if (!reader.take(front)) {
        return "ends after " + std::to_string(content.size()) + " bytes";
    }
    image.view = front.view;
    image.near_depth = front.near_depth;
    image.far_depth = front.far_depth;
    if (const Result<void> valid = validate(image.view); !valid) {
        return "has a wrong view: " + valid.error().message;
    }
    const auto width = static_cast<std::size_t>(image.view.width);
    const auto height = static_cast<std::size_t>(image.view.height);
    if (!reader.take(image.counts, width * height)) {
        return "ends in the counts of its " + std::to_string(width) + " x " +
               std::to_string(height) + " texels";
    }
    const std::uint64_t counted =
        std::accumulate(image.counts.begin(), image.counts.end(), std::uint64_t{0});
    // All numbers are below 2^40 once the first is what was counted, so that none overflows.
    const bool adds_up =
        front.samples == counted && (front.points == 0 || front.points == counted) &&
        reader.left() == kPlanes * front.samples + sizeof(PositionTexel) * front.points;
    if (!adds_up) {
        return bad_sizes(front, counted, reader.left());
    }
    const auto samples = static_cast<std::size_t>(counted);
    const std::string_view planes = reader.rest();
    image.rows.resize(height + 1);
    image.samples.resize(samples);
    for_each_sample(image.counts, [&](std::size_t index, std::size_t like, std::size_t texel) {
        PlaneBytes bytes{};
        for (std::size_t plane = 0; plane < kPlanes; ++plane) {
            bytes[plane] = static_cast<std::uint8_t>(planes[plane * samples + index]);
        }
        const LayeredSample known = index > 0 ? image.samples[like] : LayeredSample{};
        image.samples[index] = joined(
            bytes, known, static_cast<unsigned>(texel % width), static_cast<unsigned>(texel / width)
        );
    });
    for (std::size_t row = 0; row < height; ++row) {
        const auto begin = image.counts.begin() + static_cast<std::ptrdiff_t>(row * width);
        image.rows[row + 1] =
            std::accumulate(begin, begin + static_cast<std::ptrdiff_t>(width), image.rows[row]);
    }
    image.points.resize(front.points);
    const std::string_view points = planes.substr(kPlanes * samples);
    for (std::size_t i = 0; i < image.points.size(); ++i) {
        std::array<char, sizeof(PositionTexel)> point{};
        for (std::size_t plane = 0; plane < point.size(); ++plane) {
            point[plane] = points[plane * samples + i];
        }
        std::memcpy(&image.points[i], point.data(), point.size());
    }
    if (const Result<void> valid = validate(image); !valid) {
        return "is wrong: " + valid.error().message;
    }
    return std::nullopt;
}

} // namespace farfield::io
