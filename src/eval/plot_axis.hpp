#pragma once

#include "plot.hpp"

#include <span>
#include <string>
#include <vector>

namespace farfield::eval::detail {

/// Values to places along one side of a plot.
class Axis {
  public:
    struct Tick {
        double share = 0.0; ///< [0, 1]
        std::string label;
    };

    /// An axis that holds all of the values that have a place; some range where none has.
    Axis(PlotScale scale, std::span<const double> values);

    /// True where the value lies on an axis of the scale.
    [[nodiscard]] static bool has_place(PlotScale scale, double value) noexcept;

    /// Place of a value along the axis, [0, 1]. @pre it was among the values, and has a place
    [[nodiscard]] double share(double value) const noexcept;

    [[nodiscard]] const std::vector<Tick>& ticks() const noexcept { return ticks_; }

  private:
    void fit_linear(double most, bool tight);
    void fit_logarithmic(double least, double most);

    bool logarithmic_;
    double low_ = 0.0;  ///< decimal logarithm where the axis is logarithmic
    double high_ = 1.0; ///< likewise
    std::vector<Tick> ticks_;
};

} // namespace farfield::eval::detail
