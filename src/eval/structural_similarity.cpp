#include "picture_checks.hpp"
#include "separable_filter.hpp"
#include <farfield/eval/structural_similarity.hpp>

#include <cstddef>
#include <limits>
#include <string>

namespace farfield::eval {

namespace {

using detail::Plane;

constexpr int kRadius = kSsimWindow / 2;
constexpr double kSigma = 1.5;
constexpr double kC1 = (0.01 * 255.0) * (0.01 * 255.0);
constexpr double kC2 = (0.03 * 255.0) * (0.03 * 255.0);

Plane luma_of(const Picture& picture) {
    Plane luma(picture.width, picture.height);
    for (std::size_t i = 0; i < luma.values.size(); ++i) {
        luma.values[i] = 0.299 * picture.rgba[4 * i] + 0.587 * picture.rgba[4 * i + 1] +
                         0.114 * picture.rgba[4 * i + 2];
    }
    return luma;
}

/// Replaces a plane by its weighted means.
void blur(Plane& plane, const detail::Kernel& kernel, Plane& scratch) {
    filter_rows(plane, kernel, scratch);
    filter_columns(scratch, kernel, plane);
}

} // namespace

Result<PixelMap> ssim_map(const Picture& reference, const Picture& picture) {
    if (auto checked = detail::check_pair("reference", reference, "picture", picture); !checked) {
        return tl::unexpected(checked.error());
    }
    const int width = picture.width;
    const int height = picture.height;
    if (width < kSsimWindow || height < kSsimWindow) {
        return fail(
            ErrorCode::invalid_argument,
            "structural similarity: pictures are " + detail::size_text(width, height) +
                " pixels, expected at least " + detail::size_text(kSsimWindow, kSsimWindow)
        );
    }
    // In double, a variance keeps its digits as the difference of a mean square and a squared mean:
    // those are below 2^16, so it is right to 1e-10, where C2 is 58.5.
    Plane x = luma_of(reference);
    Plane y = luma_of(picture);
    Plane squares(width, height); // x^2 + y^2: only the sum of both variances is needed
    Plane products(width, height);
    for (std::size_t i = 0; i < x.values.size(); ++i) {
        const double a = x.values[i];
        const double b = y.values[i];
        squares.values[i] = a * a + b * b;
        products.values[i] = a * b;
    }
    const detail::Kernel kernel = detail::gaussian(kSigma, kRadius);
    Plane scratch(width, height);
    for (Plane* plane : {&x, &y, &squares, &products}) {
        blur(*plane, kernel, scratch);
    }

    PixelMap map{width, height, {}};
    map.values.assign(x.values.size(), std::numeric_limits<float>::quiet_NaN());
    for (int row = kRadius; row < height - kRadius; ++row) {
        const std::size_t first = static_cast<std::size_t>(row) * static_cast<std::size_t>(width);
        for (std::size_t i = first + kRadius; i < first + static_cast<std::size_t>(width) - kRadius;
             ++i) {
            const double mean_product = x.values[i] * y.values[i];
            const double mean_squares = x.values[i] * x.values[i] + y.values[i] * y.values[i];
            const double covariance = products.values[i] - mean_product;
            const double variances = squares.values[i] - mean_squares;
            const double index = (2.0 * mean_product + kC1) * (2.0 * covariance + kC2) /
                                 ((mean_squares + kC1) * (variances + kC2));
            map.values[i] = static_cast<float>(index);
        }
    }
    return map;
}

} // namespace farfield::eval
