#include "color_space.hpp"
#include "picture_checks.hpp"
#include "separable_filter.hpp"
#include <farfield/eval/flip.hpp>

#include <glm/common.hpp>
#include <glm/ext/matrix_double3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>

namespace farfield::eval {

namespace {

using detail::Kernel;
using detail::Plane;
using glm::dvec3;

constexpr double kPi = 3.14159265358979323846;

/// A Gaussian term a sqrt(pi / b) exp(-pi^2 x^2 / b) of a point spread, x in degrees.
struct SpreadTerm {
    double a = 0.0;
    double b = 0.0;

    [[nodiscard]] double sigma() const noexcept { return std::sqrt(b / 2.0) / kPi; }
};

// Contrast sensitivity of the eye (table 1 of the paper; the first two have one term).
constexpr SpreadTerm kAchromatic{1.0, 0.0047};
constexpr SpreadTerm kRedGreen{1.0, 0.0053};
constexpr std::array<SpreadTerm, 2> kBlueYellow = {{{34.1, 0.04}, {13.5, 0.025}}};
constexpr double kReach = 3.0; // of the filters, in standard deviations of the widest

constexpr double kColorPower = 0.7;     // q_c
constexpr double kKnee = 0.4;           // p_c: share of the largest colour distance ...
constexpr double kKneeError = 0.95;     // p_t: ... that takes this share of the errors
constexpr double kFeatureWidth = 0.082; // [degree] of edges and points as the eye detects them

/// One picture as the eye sees it.
struct Seen {
    std::vector<dvec3> colors; ///< Hunt-adjusted L*a*b* after the blur
    Plane edges;               ///< magnitude of the first derivatives
    Plane points;              ///< and of the second
};

/// Filters that depend on the options alone.
struct Filters {
    Kernel achromatic;
    Kernel red_green;
    std::array<Kernel, 2> blue_yellow;
    std::array<double, 2> blue_yellow_weights{};
    Kernel feature_smooth;
    Kernel feature_edge;
    Kernel feature_point;
};

Filters make_filters(double pixels_per_degree) {
    Filters filters;
    const double widest = kBlueYellow[0].sigma() * pixels_per_degree;
    const int radius = static_cast<int>(std::ceil(kReach * widest));
    filters.achromatic = detail::gaussian(kAchromatic.sigma() * pixels_per_degree, radius);
    filters.red_green = detail::gaussian(kRedGreen.sigma() * pixels_per_degree, radius);
    double total = 0.0;
    for (std::size_t term = 0; term < kBlueYellow.size(); ++term) {
        Kernel& kernel = filters.blue_yellow[term];
        kernel = detail::gaussian(kBlueYellow[term].sigma() * pixels_per_degree, radius);
        // The kernel has unit sum; its middle tells the sum s before that, which was 1 / middle.
        // In two dimensions the sum of the term is a sqrt(pi / b) s^2.
        const double sum = 1.0 / kernel.half[0];
        filters.blue_yellow_weights[term] =
            kBlueYellow[term].a * std::sqrt(kPi / kBlueYellow[term].b) * sum * sum;
        total += filters.blue_yellow_weights[term];
    }
    for (double& weight : filters.blue_yellow_weights) {
        weight /= total;
    }

    const double sigma = 0.5 * kFeatureWidth * pixels_per_degree;
    const int feature_radius = static_cast<int>(std::ceil(kReach * sigma));
    filters.feature_smooth = detail::gaussian(sigma, feature_radius);
    filters.feature_edge = filters.feature_smooth;
    filters.feature_edge.odd = true;
    filters.feature_point = filters.feature_smooth;
    // Positive weights are scaled to a sum of 1 and negative ones to -1, so that responses are at
    // most 1 whatever the resolution.
    double edge_sum = 0.0;
    double positive = 0.0;
    double negative = 0.0;
    for (std::size_t k = 0; k < filters.feature_smooth.half.size(); ++k) {
        const auto x = static_cast<double>(k);
        filters.feature_edge.half[k] *= x;
        filters.feature_point.half[k] *= x * x / (sigma * sigma) - 1.0;
        edge_sum += filters.feature_edge.half[k];
        const double both_sides = (k == 0 ? 1.0 : 2.0) * filters.feature_point.half[k];
        (both_sides > 0.0 ? positive : negative) += both_sides;
    }
    for (std::size_t k = 0; k < filters.feature_smooth.half.size(); ++k) {
        filters.feature_edge.half[k] /= edge_sum;
        double& weight = filters.feature_point.half[k];
        weight /= weight > 0.0 ? positive : -negative;
    }
    return filters;
}

std::array<double, 256> linear_levels() {
    std::array<double, 256> levels{};
    for (std::size_t level = 0; level < levels.size(); ++level) {
        levels[level] = detail::linear_from_srgb(static_cast<double>(level) / 255.0);
    }
    return levels;
}

/// Chroma looks weaker in the dark.
dvec3 hunt_adjusted(const dvec3& lab) noexcept {
    return {lab.x, 0.01 * lab.x * lab.y, 0.01 * lab.x * lab.z};
}

double hyab(const dvec3& a, const dvec3& b) noexcept {
    return std::abs(a.x - b.x) + std::hypot(a.y - b.y, a.z - b.z);
}

/// Length of the vector of a kernel's responses along both axes.
/// @param smoothed `in` after `smooth` along rows
Plane response(
    const Plane& in, const Plane& smoothed, const Kernel& kernel, const Kernel& smooth, Plane& rows
) {
    Plane along_x;
    Plane along_y;
    filter_rows(in, kernel, rows);
    filter_columns(rows, smooth, along_x);
    filter_columns(smoothed, kernel, along_y);
    for (std::size_t i = 0; i < along_x.values.size(); ++i) {
        const double x = along_x.values[i];
        const double y = along_y.values[i];
        along_x.values[i] = std::sqrt(x * x + y * y);
    }
    return along_x;
}

Seen see(const Picture& picture, const Filters& filters, const std::array<double, 256>& linear) {
    const int width = picture.width;
    const int height = picture.height;
    const glm::dmat3 to_xyz = detail::xyz_from_linear_rgb();
    const glm::dmat3 to_rgb = glm::inverse(to_xyz);

    // The opponent channels YyCxCz are 116 Y - 16, 500 (X - Y) and 200 (Y - Z). Their factors and
    // offsets pass through a filter of unit sum unchanged, so they are left out.
    Plane luminance(width, height);
    Plane red_green(width, height);
    Plane blue_yellow(width, height);
    for (std::size_t i = 0; i < luminance.values.size(); ++i) {
        const std::uint8_t* const rgb = picture.rgba.data() + 4 * i;
        const dvec3 xyz = to_xyz * dvec3(linear[rgb[0]], linear[rgb[1]], linear[rgb[2]]);
        luminance.values[i] = xyz.y;
        red_green.values[i] = xyz.x - xyz.y;
        blue_yellow.values[i] = xyz.y - xyz.z;
    }

    Seen seen;
    Plane rows;
    Plane smoothed;
    filter_rows(luminance, filters.feature_smooth, smoothed);
    seen.edges = response(luminance, smoothed, filters.feature_edge, filters.feature_smooth, rows);
    seen.points =
        response(luminance, smoothed, filters.feature_point, filters.feature_smooth, rows);

    const auto blur = [&rows](Plane& plane, const Kernel& kernel) {
        filter_rows(plane, kernel, rows);
        filter_columns(rows, kernel, plane);
    };
    blur(luminance, filters.achromatic);
    blur(red_green, filters.red_green);
    Plane narrow = blue_yellow;
    blur(blue_yellow, filters.blue_yellow[0]);
    blur(narrow, filters.blue_yellow[1]);
    seen.colors.reserve(luminance.values.size());
    for (std::size_t i = 0; i < luminance.values.size(); ++i) {
        const double y = luminance.values[i];
        const double y_less_z = filters.blue_yellow_weights[0] * blue_yellow.values[i] +
                                filters.blue_yellow_weights[1] * narrow.values[i];
        const dvec3 rgb = to_rgb * dvec3(red_green.values[i] + y, y, y - y_less_z);
        const dvec3 shown = glm::clamp(rgb, 0.0, 1.0);
        seen.colors.push_back(hunt_adjusted(detail::lab_from_xyz(to_xyz * shown)));
    }
    return seen;
}

/// Largest distance of colours that a screen can show, compressed: that of green and blue.
double largest_color_distance() {
    const glm::dmat3 to_xyz = detail::xyz_from_linear_rgb();
    const dvec3 green = hunt_adjusted(detail::lab_from_xyz(to_xyz[1]));
    const dvec3 blue = hunt_adjusted(detail::lab_from_xyz(to_xyz[2]));
    return std::pow(hyab(green, blue), kColorPower);
}

/// Distances below the knee take most of the range of errors. @param largest of all distances
double color_error(double distance, double largest) noexcept {
    const double compressed = std::pow(distance, kColorPower);
    const double knee = kKnee * largest;
    if (compressed < knee) {
        return kKneeError / knee * compressed;
    }
    const double beyond = (compressed - knee) / (largest - knee);
    return std::min(kKneeError + beyond * (1.0 - kKneeError), 1.0);
}

} // namespace

Result<PixelMap>
flip_map(const Picture& reference, const Picture& picture, const FlipOptions& options) {
    if (auto checked = detail::check_pair("reference", reference, "picture", picture); !checked) {
        return tl::unexpected(checked.error());
    }
    if (!(options.pixels_per_degree >= 1.0) || !(options.pixels_per_degree <= 1000.0)) {
        return fail(
            ErrorCode::invalid_argument,
            "FLIP: pixels per degree are " + std::to_string(options.pixels_per_degree) +
                ", expected 1 to 1000"
        );
    }
    const Filters filters = make_filters(options.pixels_per_degree);
    const std::array<double, 256> linear = linear_levels();
    const Seen a = see(reference, filters, linear);
    const Seen b = see(picture, filters, linear);
    const double largest = largest_color_distance();

    PixelMap map{picture.width, picture.height, {}};
    map.values.reserve(a.colors.size());
    for (std::size_t i = 0; i < a.colors.size(); ++i) {
        const double color = color_error(hyab(a.colors[i], b.colors[i]), largest);
        // Edges and points hardly ever meet, so the larger difference stands for both. Responses
        // are at most 1 along each axis, so their vectors are at most sqrt(2) long.
        const double feature = std::max(
            std::abs(a.edges.values[i] - b.edges.values[i]),
            std::abs(a.points.values[i] - b.points.values[i])
        );
        const double emphasis = std::min(std::sqrt(feature / std::sqrt(2.0)), 1.0);
        map.values.push_back(static_cast<float>(std::pow(color, 1.0 - emphasis)));
    }
    return map;
}

} // namespace farfield::eval
