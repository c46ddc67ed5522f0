#include <farfield/image/layered_depth_image.hpp>

#include <cmath>
#include <cstddef>
#include <string>

namespace farfield {

namespace {

tl::unexpected<Error> bad(const std::string& what) {
    return tl::unexpected(Error{ErrorCode::bad_data, "layered depth image: " + what});
}

/// A sample of the texel (column, row).
Result<void> check_sample(
    const LayeredDepthImage& image, std::size_t index, std::int32_t column, std::int32_t row
) {
    const LayeredSample& sample = image.samples[index];
    const auto name = [&] { return "sample " + std::to_string(index); };
    if (sample.x / kLayeredSteps != column || sample.y / kLayeredSteps != row) {
        return bad(
            name() + " at " + std::to_string(sample.x) + ", " + std::to_string(sample.y) +
            " sixteenths of a texel lies outside of texel " + std::to_string(column) + ", " +
            std::to_string(row)
        );
    }
    if (sample.extent == 0) {
        return bad(name() + " has an extent of 0");
    }
    if (sample.color.a != 255) {
        return bad(name() + " has an alpha of " + std::to_string(sample.color.a));
    }
    return {};
}

Result<void> check_sizes(const LayeredDepthImage& image) {
    if (Result<void> valid = validate(image.view); !valid) {
        return valid;
    }
    const View& view = image.view;
    if (view.width > kMostLayeredTexels || view.height > kMostLayeredTexels) {
        return bad(
            std::to_string(view.width) + " x " + std::to_string(view.height) +
            " texels, at most 4096 a side"
        );
    }
    const bool in_order = image.near_depth > 0.0 && image.far_depth > image.near_depth;
    if (!in_order || !std::isfinite(image.far_depth)) {
        return bad(
            "depths of " + std::to_string(image.near_depth) + " to " +
            std::to_string(image.far_depth) + " m"
        );
    }
    const auto width = static_cast<std::size_t>(view.width);
    const auto height = static_cast<std::size_t>(view.height);
    if (image.counts.size() != width * height) {
        return bad(
            std::to_string(image.counts.size()) + " counts for " + std::to_string(width * height) +
            " texels"
        );
    }
    if (image.rows.size() != height + 1) {
        return bad(
            std::to_string(image.rows.size()) + " starts of rows for " + std::to_string(height) +
            " rows"
        );
    }
    if (!image.points.empty() && image.points.size() != image.samples.size()) {
        return bad(
            std::to_string(image.points.size()) + " points for " +
            std::to_string(image.samples.size()) + " samples"
        );
    }
    return {};
}

} // namespace

Result<void> validate(const LayeredDepthImage& image) {
    if (Result<void> valid = check_sizes(image); !valid) {
        return valid;
    }
    std::size_t next = 0;
    std::size_t texel = 0;
    for (std::int32_t row = 0; row < image.view.height; ++row) {
        if (image.rows[static_cast<std::size_t>(row)] != next) {
            return bad(
                "row " + std::to_string(row) + " starts at " +
                std::to_string(image.rows[static_cast<std::size_t>(row)]) + ", its samples at " +
                std::to_string(next)
            );
        }
        for (std::int32_t column = 0; column < image.view.width; ++column, ++texel) {
            const std::size_t end = next + image.counts[texel];
            if (end > image.samples.size()) {
                return bad(
                    "texel " + std::to_string(column) + ", " + std::to_string(row) +
                    " has samples up to " + std::to_string(end) + " of " +
                    std::to_string(image.samples.size())
                );
            }
            for (std::size_t i = next; i < end; ++i) {
                if (Result<void> valid = check_sample(image, i, column, row); !valid) {
                    return valid;
                }
                if (i > next && image.samples[i].depth > image.samples[i - 1].depth) {
                    return bad("sample " + std::to_string(i) + " is nearer than the one before");
                }
            }
            next = end;
        }
    }
    if (image.rows.back() != next || image.samples.size() != next) {
        return bad(
            std::to_string(image.samples.size()) + " samples, rows end at " +
            std::to_string(image.rows.back()) + ", texels at " + std::to_string(next)
        );
    }
    return {};
}

std::uint64_t memory_bytes(const LayeredDepthImage& image) noexcept {
    return image.counts.size() * sizeof(std::uint8_t) + image.rows.size() * sizeof(std::uint32_t) +
           image.samples.size() * sizeof(LayeredSample) +
           image.points.size() * sizeof(PositionTexel);
}

} // namespace farfield
