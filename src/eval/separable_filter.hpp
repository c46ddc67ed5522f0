#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace farfield::eval::detail {

/// One number a pixel to compute with, rows from the top.
struct Plane {
    Plane() = default;
    Plane(int columns, int rows)
        : width(columns), height(rows),
          values(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)) {}

    [[nodiscard]] std::span<double> row(int y) noexcept {
        return std::span(values).subspan(first_of(y), static_cast<std::size_t>(width));
    }
    [[nodiscard]] std::span<const double> row(int y) const noexcept {
        return std::span(values).subspan(first_of(y), static_cast<std::size_t>(width));
    }

    int width = 0;
    int height = 0;
    std::vector<double> values;

  private:
    [[nodiscard]] std::size_t first_of(int y) const noexcept {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
    }
};

/// Weights along one axis. Offset k >= 0 has `half[k]`; offset -k has the same, or, where `odd`,
/// the same with the other sign.
struct Kernel {
    std::vector<double> half; ///< never empty; `half[0]` is 0 where `odd`
    bool odd = false;
};

/// Gaussian of unit sum, cut off beyond `radius`.
/// @param sigma [px] > 0
[[nodiscard]] Kernel gaussian(double sigma, int radius);

/// Filters along rows; the first and last pixel of a row go on beyond it.
/// @param out other than `in`; takes its size
void filter_rows(const Plane& in, const Kernel& kernel, Plane& out);

/// Filters along columns; the first and last row go on beyond the picture.
/// @param out other than `in`; takes its size
void filter_columns(const Plane& in, const Kernel& kernel, Plane& out);

} // namespace farfield::eval::detail
