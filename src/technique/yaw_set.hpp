#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace farfield {

/// Angles from `from` to `to`, both included. [rad] -pi <= from <= to <= pi
struct YawArc {
    double from = 0.0;
    double to = 0.0;
};

/// A set of directions around an axis: disjoint arcs in ascending order. One that goes through pi
/// is two arcs.
class YawSet {
  public:
    [[nodiscard]] std::span<const YawArc> arcs() const noexcept { return {arcs_.data(), count_}; }

    /// All directions.
    [[nodiscard]] static YawSet full() noexcept;

    /// Adds every yaw with `a cos(yaw) + b sin(yaw) + c >= 0`, and a little more, never less.
    void add(double a, double b, double c) noexcept;

    /// Leaves what is in both.
    void intersect(const YawSet& other) noexcept;

  private:
    void add(const YawArc& arc) noexcept;

    /// More than the unions and intersections of a box need: each of its corners adds two at most,
    /// and what does not fit is joined with its neighbour, which only makes the set larger.
    std::array<YawArc, 24> arcs_{};
    std::size_t count_ = 0;
};

} // namespace farfield
