#include "golden_check/golden_checks.hpp"

#include "metric/reference.hpp"
#include "support/naive_metrics.hpp"
#include <farfield/math/box3.hpp>
#include <farfield/metric/angular_discrepancy.hpp>
#include <farfield/metric/angular_discrepancy_bound.hpp>
#include <farfield/metric/impostor_angles.hpp>
#include <farfield/metric/pixel_angle.hpp>
#include <farfield/metric/projected_size.hpp>
#include <farfield/metric/safety_zone.hpp>
#include <farfield/metric/sprite_angle.hpp>
#include <farfield/metric/star_shape.hpp>
#include <farfield/policy/lifespan.hpp>
#include <farfield/policy/placement_benefit.hpp>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace farfield::golden {

namespace {

using support::GoldenRow;
using support::RealVector;

template <typename T>
using Vector = glm::vec<3, T>;

template <typename T>
ImagePlane<T> image_of(const GoldenRow& row) {
    return {row.vector<T>("v0"), row.vector<T>("c"), row.vector<T>("n")};
}

template <typename T>
Box3<T> box_of(const GoldenRow& row) {
    return {row.vector<T>("lo"), row.vector<T>("hi")};
}

/// Counts may be above 2^24: they are read in double.
template <typename Count>
Count count_of(const GoldenRow& row, const char* column) {
    return static_cast<Count>(row.number<double>(column));
}

template <typename T>
T optional_number(const GoldenRow& row, const char* column, T otherwise) {
    return row.has(column) ? row.number<T>(column) : otherwise;
}

template <typename T>
void check_point(const GoldenRow& row, Tally& tally) {
    const ImagePlane<T> image = image_of<T>(row);
    const auto viewer = row.vector<T>("v");
    const auto point = row.vector<T>("a");
    const Measured<T> measured = metric::angular_discrepancy(image, viewer, point);
    if (!tally.outcome(measured.outcome)) {
        tally.holds(std::isnan(measured.value), "what is rejected is a NaN");
        return;
    }
    // The results next to zero may be denormal numbers, whose steps are not relative.
    const Real limit =
        8 * kRoundoff<T> * row.number<Real>("scale") + std::numeric_limits<T>::denorm_min();
    const Real expected = row.number<Real>("theta");
    tally.near("theta", measured.value, expected, limit);
    if (measured.outcome == MetricOutcome::ok) {
        tally.holds(
            metric::angular_discrepancy_unchecked(image, viewer, point) == measured.value,
            "unchecked is the same"
        );
        tally.compare(
            "angular_discrepancy",
            expected,
            kRoundoff<T>,
            measured.value,
            naive::angular_discrepancy(image, viewer, point)
        );
    }
}

template <typename T>
void check_box(const GoldenRow& row, Tally& tally) {
    constexpr Real kLooser = std::is_same_v<T, float> ? 1e-3L : 1e-11L;
    const ImagePlane<T> image = image_of<T>(row);
    const Box3<T> box = box_of<T>(row);
    const auto viewer = row.vector<T>("v");
    const Measured<T> corners = metric::corner_discrepancy(image, box, viewer);
    const Measured<T> t1 = metric::bound_t1(image, box, viewer);
    const Measured<T> t2 = metric::bound_t2(image, box, viewer);
    const Measured<T> both = metric::angular_discrepancy_bound(image, box, viewer);
    tally.holds(
        corners.outcome == t1.outcome && t1.outcome == t2.outcome && t2.outcome == both.outcome,
        "all functions of a box judge alike"
    );
    if (!tally.outcome(both.outcome)) {
        tally.holds(
            std::isnan(corners.value) && std::isnan(t1.value) && std::isnan(t2.value) &&
                std::isnan(both.value),
            "what is rejected is a NaN"
        );
        return;
    }
    tally.holds(
        metric::corner_discrepancy_unchecked(image, box, viewer) == corners.value &&
            metric::bound_t1_unchecked(image, box, viewer) == t1.value &&
            metric::bound_t2_unchecked(image, box, viewer) == t2.value &&
            metric::angular_discrepancy_bound_unchecked(image, box, viewer) == both.value,
        "unchecked is the same"
    );
    tally.holds(both.value == std::min(t1.value, t2.value), "the bound is the smaller of both");
    if (row.status() != MetricOutcome::ok) {
        tally.holds(
            corners.value == std::numbers::pi_v<T> && both.value == std::numbers::pi_v<T>,
            "a hidden image has pi"
        );
        return;
    }
    // The largest of eight angles, each within 8 units of its own scale, cannot be off by more than
    // the largest of these errors.
    Real scale = 0;
    for (unsigned index = 0; index < 8; ++index) {
        scale = std::max(scale, support::angle_scale(image, viewer, corner(box, index)));
    }
    const Real expected_corners = row.number<Real>("theta_corners");
    tally.near("theta_corners", corners.value, expected_corners, 8 * kRoundoff<T> * scale);
    tally.compare("corner_discrepancy", expected_corners, kRoundoff<T>, corners.value);
    const Real truth = row.number<Real>("theta_max");
    if (truth > 3) {
        tally.holds(both.value == std::numbers::pi_v<T>, "the bound of pi is pi");
        return;
    }
    tally.holds(t1.value >= truth && t2.value >= truth, "both bounds hold");
    // Bounds may only be looser than in exact arithmetic, and not by much.
    const Real exact = std::min(row.number<Real>("bound_t1"), row.number<Real>("bound_t2"));
    tally.near("bound", std::max(Real(both.value), exact), exact, exact * kLooser);
    if (truth > 0) {
        tally.ratio("bound / largest angle", both.value / truth);
        tally.ratio("cheap bound / largest angle", t1.value / truth);
        tally.ratio("bound / bound without rounding", both.value / exact);
    }
}

template <typename T>
void check_safety_distance(const GoldenRow& row, Tally& tally) {
    const T to_point = row.number<T>("h");
    const T to_image = row.number<T>("ht");
    const T epsilon = row.number<T>("eps");
    const Measured<T> measured = metric::safety_distance(to_point, to_image, epsilon);
    if (!tally.outcome(measured.outcome)) {
        tally.holds(std::isnan(measured.value), "what is rejected is a NaN");
        return;
    }
    const Real expected = row.number<Real>("d");
    tally.near("d", measured.value, expected, 8 * kRoundoff<T> * expected);
    tally.holds(measured.value <= std::min(to_point, to_image), "no more than either distance");
    tally.holds(
        metric::safety_distance_unchecked(to_point, to_image, epsilon) == measured.value,
        "unchecked is the same"
    );
    // What the paper's own formula is not.
    tally.holds(
        metric::safety_distance_unchecked(to_image, to_point, epsilon) == measured.value,
        "symmetric"
    );
    tally.compare(
        "safety_distance",
        expected,
        kRoundoff<T>,
        measured.value,
        naive::safety_distance(to_point, to_image, epsilon)
    );
}

template <typename T>
void check_box_zone(const GoldenRow& row, Tally& tally) {
    constexpr Real kShorter = std::is_same_v<T, float> ? 1e-4L : 1e-12L;
    const ImagePlane<T> image = image_of<T>(row);
    const Box3<T> box = box_of<T>(row);
    const T epsilon = row.number<T>("eps");
    const Measured<T> bound = metric::safety_distance_bound(image, box, epsilon);
    const Measured<T> corners = metric::corner_safety_distance(image, box, epsilon);
    tally.holds(bound.outcome == corners.outcome, "both functions judge alike");
    if (!tally.outcome(bound.outcome)) {
        tally.holds(std::isnan(bound.value) && std::isnan(corners.value), "rejected is a NaN");
        return;
    }
    tally.holds(
        metric::safety_distance_bound_unchecked(image, box, epsilon) == bound.value &&
            metric::corner_safety_distance_unchecked(image, box, epsilon) == corners.value,
        "unchecked is the same"
    );
    const Real truth = row.number<Real>("d_true");
    tally.holds(bound.value <= truth, "the bound holds");
    const Real exact = row.number<Real>("d_cons");
    tally.near("bound", std::min(Real(bound.value), exact), exact, exact * kShorter);
    if (truth > 0) {
        tally.ratio("zone bound / largest zone", bound.value / truth);
    }
    // Each corner's distance is |a - v0| times a ratio of D, z and e. Their first-order effect on
    // it is at most theirs on these three, of which z and D are sums of three products.
    Real limit = 0;
    for (unsigned index = 0; index < 8; ++index) {
        const RealVector n(image.normal);
        const RealVector ray = RealVector(corner(box, index)) - RealVector(image.viewpoint);
        const RealVector plane = RealVector(image.point) - RealVector(image.viewpoint);
        const RealVector off = RealVector(image.point) - RealVector(corner(box, index));
        const auto condition = [&](const RealVector& v) {
            return glm::length(n) * glm::length(v) / std::abs(glm::dot(n, v));
        };
        limit = std::max({limit, condition(ray), condition(plane), condition(off)});
    }
    const Real expected = row.number<Real>("d_corners");
    tally.near("d_corners", corners.value, expected, 16 * kRoundoff<T> * limit * expected);
}

template <typename T>
void check_pixels(const GoldenRow& row, Tally& tally) {
    const T fov = row.number<T>("fovy");
    const int width = count_of<int>(row, "width");
    const int height = count_of<int>(row, "height");
    const T pixels = row.number<T>("px");
    const T angle = row.number<T>("theta");
    const auto measured = metric::pixel_scale(fov, width, height);
    const PixelScale<T>& scale = measured.scale;
    const Measured<T> epsilon = metric::angle_of_pixels(scale, pixels);
    const bool has_scale = measured.outcome == MetricOutcome::ok;
    if (!tally.outcome(has_scale ? epsilon.outcome : measured.outcome)) {
        tally.holds(std::isnan(epsilon.value), "what is rejected is a NaN");
        return;
    }
    const Real fov_exact = fov;
    const Real condition = 1 + fov_exact / std::sin(fov_exact);
    const auto check = [&](T value, const char* column, Real amplified) {
        const Real expected = row.number<Real>(column);
        tally.near(column, value, expected, 4 * kRoundoff<T> * amplified * expected);
    };
    check(scale.focal_px, "f_px", condition);
    check(scale.corner_tangent, "r_corner", condition);
    check(epsilon.value, "eps_px", condition);
    check(metric::mean_pixel_angle(fov, height), "alpha_mean_y", 1);
    check(metric::central_pixel_angle(scale), "alpha_centre", condition);
    // Twice: the corner tangent enters squared.
    check(metric::corner_pixel_angle(scale), "alpha_corner", 2 * condition);
    tally.holds(
        metric::angle_of_pixels_unchecked(scale, pixels) == epsilon.value, "unchecked is the same"
    );
    if (row.has("eps_px_inside")) {
        // 1 + r (r - p/f) cancels by up to the ratio of its terms.
        const Real r = row.number<Real>("r_corner");
        const Real step = row.number<Real>("px") / row.number<Real>("f_px");
        const Real terms = (1 + r * r + r * step) / std::hypot(step, 1 + r * (r - step));
        const Measured<T> inside = metric::angle_of_pixels_inside(scale, pixels);
        check(inside.value, "eps_px_inside", condition * (1 + terms));
    }
    const Real rest = 1 - row.number<Real>("r_corner") * std::tan(row.number<Real>("theta"));
    const Measured<T> back = metric::pixels_of_angle(scale, angle);
    check(back.value, "px_of_theta", condition / std::abs(rest));
    tally.compare(
        "angle_of_pixels",
        row.number<Real>("eps_px"),
        kRoundoff<T>,
        epsilon.value,
        naive::angle_of_pixels(scale.focal_px, scale.corner_tangent, pixels)
    );
    tally.compare(
        "pixels_of_angle",
        row.number<Real>("px_of_theta"),
        kRoundoff<T>,
        back.value,
        naive::pixels_of_angle(scale.focal_px, scale.corner_tangent, angle)
    );
}

template <typename T>
Lifespan<T> lifespan_of(const GoldenRow& row) {
    const std::string& kind = row.text("kind");
    const auto position = row.vector<T>("p");
    const auto velocity = row.vector<T>("vel");
    const FrameCount<T> count{row.number<T>("dt"), count_of<std::uint32_t>(row, "nmax")};
    MotionBound<T> bound;
    bound.max_acceleration = optional_number(row, "A", T(0));
    bound.max_speed = optional_number(row, "vmax", bound.max_speed);
    if (kind == "aabb_guaranteed_euler") {
        bound.step_seconds = count.frame_seconds;
    }
    if (kind.starts_with("sphere")) {
        const Ball<T> zone{row.vector<T>("c"), row.number<T>("R")};
        return kind == "sphere_linear"
                   ? policy::extrapolated_lifespan(zone, position, velocity, count)
                   : policy::guaranteed_lifespan(zone, position, velocity, bound, count);
    }
    const Box3<T> zone = box_of<T>(row);
    if (kind.starts_with("aabb_guaranteed")) {
        return policy::guaranteed_lifespan(zone, position, velocity, bound, count);
    }
    const Vector<T> acceleration = row.has("accx") ? row.vector<T>("acc") : Vector<T>(T(0));
    return policy::extrapolated_lifespan(zone, position, velocity, acceleration, count);
}

/// How much more than the inputs' the relative error of the exit time may be.
Real lifespan_condition(const GoldenRow& row) {
    const std::string& kind = row.text("kind");
    if (kind.starts_with("sphere")) {
        const RealVector offset = row.vector<Real>("p") - row.vector<Real>("c");
        const Real radius = row.number<Real>("R");
        return 1 + radius / (radius - glm::length(offset));
    }
    return kind == "aabb_quadratic" || kind == "aabb_guaranteed_euler" ? Real(12) : Real(1);
}

template <typename T>
void check_lifespan(const GoldenRow& row, Tally& tally) {
    const Lifespan<T> life = lifespan_of<T>(row);
    if (!tally.outcome(life.outcome)) {
        tally.holds(life.frames == 0 && std::isnan(life.exit_seconds), "rejected is a NaN");
        return;
    }
    tally.holds(life.frames == count_of<std::uint32_t>(row, "frames"), "frames");
    const Real expected = row.number<Real>("t_exit");
    const Real limit = 8 * kRoundoff<T> * lifespan_condition(row);
    if (expected > std::numeric_limits<T>::max()) {
        tally.holds(std::isinf(life.exit_seconds), "never leaves");
    } else {
        tally.near("t_exit", life.exit_seconds, expected, limit * expected);
    }
    if (row.has("t_true")) {
        tally.holds(
            Real(life.exit_seconds) <= row.number<Real>("t_true") * (1 + limit), "the bound holds"
        );
    }
    if (row.text("kind") == "aabb_guaranteed" && expected <= std::numeric_limits<T>::max()) {
        // The first passage of the six faces, as school has it.
        const Box3<T> zone = box_of<T>(row);
        const auto position = row.vector<T>("p");
        const auto velocity = row.vector<T>("vel");
        T first = std::numeric_limits<T>::infinity();
        for (int axis = 0; axis < 3; ++axis) {
            const T most = row.number<T>("A");
            const T up = naive::first_passage(zone.hi[axis] - position[axis], velocity[axis], most);
            const T down =
                naive::first_passage(position[axis] - zone.lo[axis], -velocity[axis], most);
            first = std::min({first, up, down});
        }
        tally.compare("guaranteed_lifespan", expected, kRoundoff<T>, life.exit_seconds, first);
    }
}

template <typename T>
void check_impostor(const GoldenRow& row, Tally& tally) {
    const Box3<T> box = box_of<T>(row);
    const auto viewpoint = row.vector<T>("v0");
    const auto viewer = row.vector<T>("v");
    const auto measured = metric::impostor_view(box, viewpoint, viewer);
    if (!tally.outcome(measured.outcome)) {
        tally.holds(std::isnan(measured.view.distance), "what is rejected is a NaN");
        return;
    }
    const ImagePlane<T> image = metric::impostor_plane(box, viewpoint);
    const Measured<T> corners = metric::corner_discrepancy(image, box, viewer);
    tally.holds(corners.outcome == measured.outcome, "all functions judge alike");
    if (measured.outcome != MetricOutcome::ok) {
        tally.holds(corners.value == std::numbers::pi_v<T>, "a hidden image has pi");
        return;
    }
    constexpr Real kUnit = kRoundoff<T>;
    const auto relative = [&](T value, const char* column, Real units) {
        const Real expected = row.number<Real>(column);
        tally.near(column, value, expected, units * kUnit * std::abs(expected));
    };
    // The axis is known to some units of (D + diagonal) / D, and turns the motion by as much.
    const Real diagonal = glm::length(RealVector(box.hi) - RealVector(box.lo));
    const Real length = row.number<Real>("D");
    const Real turn = 1 + diagonal / length;
    const Real moved = glm::length(RealVector(viewer) - RealVector(viewpoint));
    const auto check_length = [&](T value, const char* column, Real size) {
        tally.near(column, value, row.number<Real>(column), 16 * kUnit * turn * size);
    };
    check_length(measured.view.distance, "D", length);
    check_length(measured.view.half_depth, "f", diagonal);
    check_length(measured.view.half_width, "W", diagonal);
    check_length(measured.view.inwards, "m_par", moved);
    check_length(measured.view.sideways, "m_perp", moved);

    const ImpostorView<T> view{
        row.number<T>("D"),
        row.number<T>("f"),
        row.number<T>("W"),
        row.number<T>("m_par"),
        row.number<T>("m_perp")};
    const T trans = metric::alpha_trans_unchecked(view);
    const T size = metric::alpha_size_unchecked(view);
    relative(trans, "alpha_trans_axis", 64);
    relative(metric::alpha_spread_unchecked(view), "alpha_spread_axis", 64);
    relative(size, "alpha_size_axis", 64);
    const T texel = row.number<T>("quad_w") / row.number<T>("texels");
    const Measured<T> tex = metric::alpha_tex(texel, view.distance - view.inwards);
    relative(tex.value, "alpha_tex", 64);
    relative(corners.value, "theta_corners", 64);
    // Each part of the motion is known to some units of all of it.
    const Real both =
        row.number<Real>("alpha_trans_corners") + row.number<Real>("alpha_size_corners");
    const auto check_part = [&](T value, const char* column) {
        tally.near(column, value, row.number<Real>(column), 64 * kUnit * turn * both);
    };
    check_part(
        metric::alpha_trans_corners_unchecked(box, viewpoint, viewer), "alpha_trans_corners"
    );
    check_part(metric::alpha_size_corners_unchecked(box, viewpoint, viewer), "alpha_size_corners");
    tally.compare(
        "alpha_trans",
        row.number<Real>("alpha_trans_axis"),
        kUnit,
        trans,
        naive::alpha_trans(view.distance, view.half_depth, view.sideways)
    );
    tally.compare("alpha_size", row.number<Real>("alpha_size_axis"), kUnit, size);
    tally.compare("alpha_tex", row.number<Real>("alpha_tex"), kUnit, tex.value);
}

template <typename T>
void check_sprite(const GoldenRow& row, Tally& tally) {
    const auto drawn_from = row.vector<T>("v1");
    const auto seen_from = row.vector<T>("v2");
    const auto point = row.vector<T>("C");
    const T offset = row.number<T>("b");
    const Measured<T> measured = metric::sprite_angle(drawn_from, seen_from, point, offset);
    if (!tally.outcome(measured.outcome)) {
        tally.holds(std::isnan(measured.value), "what is rejected is a NaN");
        return;
    }
    constexpr Real kUnit = kRoundoff<T>;
    const Real theta = row.number<Real>("theta");
    tally.near("theta", measured.value, theta, 8 * kUnit * row.number<Real>("scale"));
    tally.holds(
        metric::sprite_angle_unchecked(drawn_from, seen_from, point, offset) == measured.value,
        "unchecked is the same"
    );
    if (measured.outcome != MetricOutcome::ok) {
        return;
    }
    tally.compare(
        "sprite_angle",
        theta,
        kUnit,
        measured.value,
        naive::sprite_angle(drawn_from, seen_from, point, offset)
    );
    // The cross product is known to some units of both lengths.
    const Real moved = glm::length(row.vector<Real>("v2") - row.vector<Real>("v1"));
    const auto check_turn = [&](const Vector<T>& from, const char* column) {
        const Real sight = glm::length(RealVector(from) - row.vector<Real>("v1"));
        const Real turn = row.number<Real>(column);
        const Real limit = 8 * kUnit * (turn + moved / sight);
        tally.near(column, metric::sprite_turn_unchecked(drawn_from, seen_from, from), turn, limit);
    };
    check_turn(point, "psi");
    check_turn(row.vector<T>("Cref"), "psi_ref");
    // With the turn rounded, |b| sin psi over a + b cos psi, of which the second may cancel.
    const Real turn = row.number<Real>("psi_ref");
    const Real a = row.number<Real>("a");
    const Real b = row.number<Real>("b");
    const Real across = std::abs(b) * std::sin(turn);
    const Real along = a + b * std::cos(turn);
    const Real shared = row.number<Real>("theta_shared");
    const Real scale = shared + across * (a + std::abs(b)) / (across * across + along * along);
    const T shared_angle =
        metric::shared_sprite_angle_unchecked(row.number<T>("psi_ref"), row.number<T>("a"), offset);
    tally.near("theta_shared", shared_angle, shared, 8 * kUnit * scale);
    const bool is_nearer = row.number<Real>("psi") > turn;
    if (row.label().starts_with("H46")) {
        tally.holds(
            is_nearer ? shared_angle < measured.value : shared_angle > measured.value,
            "nearer points are under-estimated, farther ones over-estimated"
        );
    }
}

template <typename T>
std::vector<T> angles_of(const GoldenRow& row) {
    std::vector<T> angles;
    const std::string& text = row.text("thetas");
    for (const char* at = text.c_str(); *at != '\0';) {
        char* end = nullptr;
        if constexpr (std::is_same_v<T, float>) {
            angles.push_back(std::strtof(at, &end));
        } else {
            angles.push_back(std::strtod(at, &end));
        }
        if (end == at || (*end != ';' && *end != '\0')) {
            throw std::runtime_error("row " + row.name() + ": no numbers in thetas");
        }
        at = *end == ';' ? end + 1 : end;
    }
    return angles;
}

template <typename T>
void check_rms(const GoldenRow& row, Tally& tally) {
    const std::vector<T> angles = angles_of<T>(row);
    const std::span<const T> span(angles);
    if (!tally.outcome(metric::check_angles(span))) {
        return;
    }
    const AngleSpread<T> spread = metric::angle_spread_unchecked(span);
    const Real expected = row.number<Real>("rms");
    tally.near("rms", spread.rms, expected, 8 * kRoundoff<T> * expected);
    tally.holds(Real(spread.largest) == row.number<Real>("max"), "largest");
    const bool passes =
        metric::is_below_unchecked(span, row.number<T>("kappa"), row.number<T>("alpha"));
    tally.holds(passes == (row.text("passes") == "1"), "passes");
    // Squares summed as they are: for few terms nothing is wrong with that but underflow.
    T sum = 0;
    for (const T angle : angles) {
        sum += angle * angle;
    }
    const T plain = std::sqrt(sum / static_cast<T>(std::max<std::size_t>(angles.size(), 1)));
    tally.compare("angle_spread", expected, kRoundoff<T>, spread.rms, plain);
}

template <typename T>
void check_star(const GoldenRow& row, Tally& tally) {
    const HalfAngles<T> angles{row.number<T>("alpha_x"), row.number<T>("alpha_y")};
    const T spacing = row.number<T>("r");
    const auto measured = metric::star_shape(angles, spacing);
    if (!tally.outcome(measured.outcome)) {
        tally.holds(std::isnan(measured.shape.guaranteed_radius), "what is rejected is a NaN");
        return;
    }
    const StarShape<T>& shape = measured.shape;
    const auto check = [&](T value, const char* column, Real condition) {
        const Real expected = row.number<Real>(column);
        tally.near(column, value, expected, 8 * kRoundoff<T> * condition * expected);
    };
    const Real condition = 1 + Real(angles.x) / std::cos(Real(angles.x));
    check(shape.half_spacing, "s", condition);
    check(shape.paper_radius, "radius_paper_even", 1);
    check(shape.guaranteed_radius, "radius_guaranteed", 1);
    // Next to 53.13 degrees rounding decides whether there is a planar radius.
    const Real s = row.number<Real>("s");
    const bool is_close = std::abs(s - Real(spacing)) <= 8 * kRoundoff<T> * condition * s;
    tally.holds(is_close || shape.planar_radius.has_value() == row.has("radius_plane"), "planar");
    if (shape.planar_radius && row.has("radius_plane")) {
        check(*shape.planar_radius, "radius_plane", condition);
    }
    tally.compare("star_shape", row.number<Real>("s"), kRoundoff<T>, shape.half_spacing);
}

template <typename T>
CameraPose<T> pose_of(const GoldenRow& row) {
    return {
        row.vector<T>("eye"), row.vector<T>("right"), row.vector<T>("up"), row.vector<T>("fwd")};
}

template <typename T>
void check_reverse_frustum(const GoldenRow& row, Tally& tally) {
    const CameraPose<T> pose = pose_of<T>(row);
    const glm::vec<2, T> tangents(row.number<T>("tx"), row.number<T>("ty"));
    const auto point = row.vector<T>("g");
    const Measured<T> measured = metric::reverse_frustum_margin(pose, tangents, point);
    if (!tally.outcome(measured.outcome)) {
        tally.holds(std::isnan(measured.value), "what is rejected is a NaN");
        return;
    }
    const Real apart = glm::length(RealVector(pose.eye) - RealVector(point));
    const Real limit = 4 * kRoundoff<T> * apart * (2 + Real(tangents.x) + Real(tangents.y));
    const Real margin = row.number<Real>("margin");
    tally.near("margin", measured.value, margin, limit);
    const bool inside = metric::serves_unchecked(pose, tangents, point);
    const bool is_hard = row.label().starts_with("H");
    if (std::abs(margin) > limit || is_hard) {
        tally.holds(inside == (row.text("inside") == "1"), "inside");
    }
}

template <typename T>
void check_benefit(const GoldenRow& row, Tally& tally) {
    Placement<T> placement;
    placement.drawn = count_of<std::uint64_t>(row, "gc");
    placement.total = count_of<std::uint64_t>(row, "Gc");
    placement.image_width = row.number<T>("Iw");
    placement.image_height = row.number<T>("Ih");
    placement.screen_width = row.number<T>("Sw");
    placement.screen_height = row.number<T>("Sh");
    placement.depth = row.number<T>("d");
    placement.model_extent = row.number<T>("A");
    const PlacementWeights<T> weights{
        row.number<T>("C"), row.number<T>("B"), row.number<T>("B1"), row.number<T>("B2")};
    const PlacementBenefit<T> worth = policy::placement_benefit(placement, weights);
    if (!tally.outcome(worth.outcome)) {
        tally.holds(std::isnan(worth.total), "what is rejected is a NaN");
        return;
    }
    constexpr Real kLimit = 4 * kRoundoff<T>;
    tally.near("cost", worth.cost, row.number<Real>("cost"), kLimit);
    tally.near("benefit", worth.benefit, row.number<Real>("benefit"), kLimit);
    tally.near("cb", worth.total, row.number<Real>("cb"), kLimit);
    tally.compare("placement_benefit", row.number<Real>("cb"), kRoundoff<T>, worth.total);
}

template <typename T>
void check_cube(const GoldenRow& row, Tally& tally) {
    const Cube<T> cube{row.vector<T>("cc"), row.number<T>("edge")};
    const CameraPose<T> pose = pose_of<T>(row);
    const T focal_px = row.number<T>("f_px");
    const auto measured = metric::projected_size(cube, pose, focal_px);
    if (!tally.outcome(measured.outcome)) {
        tally.holds(std::isnan(measured.size.diameter_px), "what is rejected is a NaN");
        return;
    }
    const Real jacobian = row.number<Real>("bound_jacobian");
    const Real limit = 8 * kRoundoff<T> * jacobian;
    const Real diameter = row.number<Real>("diam_px");
    tally.near("width_px", measured.size.width_px, row.number<Real>("width_px"), limit);
    tally.near("height_px", measured.size.height_px, row.number<Real>("height_px"), limit);
    tally.near("diam_px", measured.size.diameter_px, diameter, limit);
    const T sphere_px = metric::sphere_bound_px_unchecked(cube, pose, focal_px);
    const T jacobian_px = metric::jacobian_bound_px_unchecked(cube, pose, focal_px);
    tally.holds(Real(sphere_px) >= diameter && Real(jacobian_px) >= diameter, "both bounds hold");
    if (measured.outcome != MetricOutcome::ok) {
        tally.holds(std::isinf(sphere_px) && std::isinf(jacobian_px), "infinite behind the eye");
        return;
    }
    // Depths are lowered by 8 units of the distance, which counts where they are small beside it.
    const Real depth =
        glm::dot(row.vector<Real>("cc") - row.vector<Real>("eye"), row.vector<Real>("fwd"));
    const Real distance = glm::length(row.vector<Real>("cc") - row.vector<Real>("eye"));
    const Real radius = row.number<Real>("edge") * std::numbers::sqrt3_v<Real> / 2;
    const Real slack = 64 * kRoundoff<T> * (1 + distance / std::max(depth - radius, Real(1e-3)));
    const Real sphere = row.number<Real>("bound_sphere");
    tally.near("bound_sphere", sphere_px, sphere, slack * sphere);
    tally.near("bound_jacobian", jacobian_px, jacobian, slack * jacobian);
    if (diameter > 0) {
        tally.ratio("sphere bound / diameter", sphere_px / diameter);
        tally.ratio("jacobian bound / diameter", jacobian_px / diameter);
        tally.compare(
            "projected_size",
            diameter,
            kRoundoff<T>,
            measured.size.diameter_px,
            naive::cube_diameter_px(
                cube.center, cube.edge, pose.eye, pose.right, pose.up, pose.forward, focal_px
            )
        );
    }
}

constexpr std::array<FileCheck, 13> kFileChecks{{
    {"alpha_trans_size", check_impostor<float>, check_impostor<double>},
    {"angular_discrepancy", check_point<float>, check_point<double>},
    {"box_max_discrepancy", check_box<float>, check_box<double>},
    {"box_safety", check_box_zone<float>, check_box_zone<double>},
    {"colour_cube", check_cube<float>, check_cube<double>},
    {"cost_benefit", check_benefit<float>, check_benefit<double>},
    {"lifespan", check_lifespan<float>, check_lifespan<double>},
    {"lodsprite_rms", check_rms<float>, check_rms<double>},
    {"lodsprite_theta", check_sprite<float>, check_sprite<double>},
    {"pixel_angle", check_pixels<float>, check_pixels<double>},
    {"reverse_frustum", check_reverse_frustum<float>, check_reverse_frustum<double>},
    {"safety_zone", check_safety_distance<float>, check_safety_distance<double>},
    {"star_shape", check_star<float>, check_star<double>},
}};

} // namespace

std::span<const FileCheck> file_checks() {
    return kFileChecks;
}

} // namespace farfield::golden
