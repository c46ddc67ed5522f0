#include "separable_filter.hpp"

#include <algorithm>
#include <cmath>

namespace farfield::eval::detail {

namespace {

/// out[i] += weight * (after[i] + before[i]), or minus: one load and store of `out` for two taps.
void accumulate(
    std::span<double> out, const double* after, const double* before, double weight, bool odd
) noexcept {
    double* const sum = out.data();
    if (odd) {
        for (std::size_t i = 0; i < out.size(); ++i) {
            sum[i] += weight * (after[i] - before[i]);
        }
    } else {
        for (std::size_t i = 0; i < out.size(); ++i) {
            sum[i] += weight * (after[i] + before[i]);
        }
    }
}

void start(std::span<double> out, const double* middle, double weight) noexcept {
    for (std::size_t i = 0; i < out.size(); ++i) {
        out[i] = weight * middle[i];
    }
}

void match_size(const Plane& in, Plane& out) {
    out.width = in.width;
    out.height = in.height;
    out.values.resize(in.values.size());
}

} // namespace

Kernel gaussian(double sigma, int radius) {
    Kernel kernel;
    double sum = 0.0;
    for (int k = 0; k <= radius; ++k) {
        kernel.half.push_back(std::exp(-0.5 * (k / sigma) * (k / sigma)));
        sum += (k == 0 ? 1.0 : 2.0) * kernel.half.back();
    }
    for (double& weight : kernel.half) {
        weight /= sum;
    }
    return kernel;
}

void filter_rows(const Plane& in, const Kernel& kernel, Plane& out) {
    match_size(in, out);
    const std::size_t radius = kernel.half.size() - 1;
    const auto width = static_cast<std::size_t>(in.width);
    std::vector<double> padded(width + 2 * radius);
    for (int y = 0; y < in.height; ++y) {
        const std::span<const double> row = in.row(y);
        const auto first = padded.begin() + static_cast<std::ptrdiff_t>(radius);
        std::fill(padded.begin(), first, row.front());
        std::fill(std::copy(row.begin(), row.end(), first), padded.end(), row.back());
        const double* const middle = padded.data() + radius;
        const std::span<double> sums = out.row(y);
        start(sums, middle, kernel.half[0]);
        for (std::size_t k = 1; k <= radius; ++k) {
            accumulate(sums, middle + k, middle - k, kernel.half[k], kernel.odd);
        }
    }
}

void filter_columns(const Plane& in, const Kernel& kernel, Plane& out) {
    match_size(in, out);
    const int radius = static_cast<int>(kernel.half.size()) - 1;
    const auto row_at = [&](int y) { return in.row(std::clamp(y, 0, in.height - 1)).data(); };
    for (int y = 0; y < in.height; ++y) {
        const std::span<double> sums = out.row(y);
        start(sums, row_at(y), kernel.half[0]);
        for (int k = 1; k <= radius; ++k) {
            const double weight = kernel.half[static_cast<std::size_t>(k)];
            accumulate(sums, row_at(y + k), row_at(y - k), weight, kernel.odd);
        }
    }
}

} // namespace farfield::eval::detail
