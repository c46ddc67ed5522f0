// Nanoseconds for one evaluation of each metric, the stable form beside the naive one where there
// is one. Inputs are 1024 random boxes at 0.6 to 60 diagonals, in turn, so that no branch is
// learnt.
#include <farfield/math/box3.hpp>
#include <farfield/metric/angular_discrepancy.hpp>
#include <farfield/metric/angular_discrepancy_bound.hpp>
#include <farfield/metric/pixel_angle.hpp>
#include <farfield/metric/safety_zone.hpp>
#include <farfield/policy/lifespan.hpp>

#include <benchmark/benchmark.h>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>

namespace {

using namespace farfield;

constexpr std::size_t kCases = 1024;

template <typename T>
struct Case {
    ImagePlane<T> image;
    Box3<T> box;
    glm::vec<3, T> viewer{T(0)};
    glm::vec<3, T> velocity{T(0)};
    T to_point = 0;
    T to_image = 0;
    T epsilon = 0;
};

template <typename T>
const std::array<Case<T>, kCases>& cases() {
    static const std::array<Case<T>, kCases> kAll = [] {
        std::mt19937 engine(7);
        std::uniform_real_distribution<T> symmetric(T(-1), T(1));
        std::uniform_real_distribution<T> positive(T(0.1), T(1));
        const auto vector = [&] {
            const T x = symmetric(engine);
            const T y = symmetric(engine);
            return glm::vec<3, T>(x, y, symmetric(engine));
        };
        std::array<Case<T>, kCases> all;
        for (Case<T>& c : all) {
            do {
                const T half = positive(engine) / 2;
                c.box = {glm::vec<3, T>(-half), glm::vec<3, T>(half)};
                const glm::vec<3, T> away = glm::normalize(vector());
                const T distance = std::pow(T(100), symmetric(engine) / 2 + T(0.5));
                c.image = {away * distance, vector() * half / T(2), away + vector() / T(4)};
                c.viewer = c.image.viewpoint + vector() * distance / T(20);
                c.velocity = vector();
                c.to_point = distance;
                c.to_image = distance * (1 + symmetric(engine) / 10);
                c.epsilon = T(1e-3) * positive(engine);
            } while (metric::check(c.image, c.box, c.viewer) != MetricOutcome::ok);
        }
        return all;
    }();
    return kAll;
}

template <typename T, typename Evaluate>
void run(benchmark::State& state, const Evaluate& evaluate) {
    const auto& all = cases<T>();
    std::size_t index = 0;
    for (auto _ : state) {
        benchmark::DoNotOptimize(evaluate(all[index]));
        index = (index + 1) % kCases;
    }
    state.SetItemsProcessed(state.iterations());
}

/// The definition with the arc cosine of a dot product, as papers write it.
template <typename T>
T naive_angle(const Case<T>& c, const glm::vec<3, T>& point) {
    const glm::vec<3, T> ray = point - c.image.viewpoint;
    const T ratio =
        glm::dot(c.image.normal, c.image.point - c.image.viewpoint) / glm::dot(c.image.normal, ray);
    const glm::vec<3, T> a = point - c.viewer;
    const glm::vec<3, T> b = c.image.viewpoint + ray * ratio - c.viewer;
    return std::acos(glm::dot(a, b) / (glm::length(a) * glm::length(b)));
}

template <typename T>
void angle_of_point(benchmark::State& state) {
    run<T>(state, [](const Case<T>& c) {
        return metric::angular_discrepancy_unchecked(c.image, c.viewer, c.box.hi);
    });
}

template <typename T>
void angle_of_point_naive(benchmark::State& state) {
    run<T>(state, [](const Case<T>& c) { return naive_angle(c, c.box.hi); });
}

template <typename T>
void angle_of_point_checked(benchmark::State& state) {
    run<T>(state, [](const Case<T>& c) {
        return metric::angular_discrepancy(c.image, c.viewer, c.box.hi);
    });
}

template <typename T>
void corners(benchmark::State& state) {
    run<T>(state, [](const Case<T>& c) {
        return metric::corner_discrepancy_unchecked(c.image, c.box, c.viewer);
    });
}

template <typename T>
void corners_naive(benchmark::State& state) {
    run<T>(state, [](const Case<T>& c) {
        T largest = 0;
        for (unsigned index = 0; index < 8; ++index) {
            largest = std::max(largest, naive_angle(c, corner(c.box, index)));
        }
        return largest;
    });
}

template <typename T>
void corners_checked(benchmark::State& state) {
    run<T>(state, [](const Case<T>& c) {
        return metric::corner_discrepancy(c.image, c.box, c.viewer);
    });
}

template <typename T>
void bound_t1(benchmark::State& state) {
    run<T>(state, [](const Case<T>& c) {
        return metric::bound_t1_unchecked(c.image, c.box, c.viewer);
    });
}

template <typename T>
void bound_t2(benchmark::State& state) {
    run<T>(state, [](const Case<T>& c) {
        return metric::bound_t2_unchecked(c.image, c.box, c.viewer);
    });
}

template <typename T>
void bound(benchmark::State& state) {
    run<T>(state, [](const Case<T>& c) {
        return metric::angular_discrepancy_bound_unchecked(c.image, c.box, c.viewer);
    });
}

/// Thresholds of 1, 10 and 1000 thousandths of a radian: the larger, the more the cheap bound
/// decides.
template <typename T>
void is_within(benchmark::State& state) {
    const T threshold = T(1e-3) * static_cast<T>(state.range(0));
    run<T>(state, [&](const Case<T>& c) {
        return metric::is_within_unchecked(c.image, c.box, c.viewer, threshold);
    });
}

template <typename T>
void safety_distance(benchmark::State& state) {
    run<T>(state, [](const Case<T>& c) {
        return metric::safety_distance_unchecked(c.to_point, c.to_image, c.epsilon);
    });
}

template <typename T>
void safety_distance_naive(benchmark::State& state) {
    run<T>(state, [](const Case<T>& c) {
        const T r = std::abs(c.to_point - c.to_image) / (2 * std::sin(c.epsilon));
        return std::sqrt(c.to_point * c.to_image + r * r) - r;
    });
}

template <typename T>
void safety_distance_corners(benchmark::State& state) {
    run<T>(state, [](const Case<T>& c) {
        return metric::corner_safety_distance_unchecked(c.image, c.box, c.epsilon);
    });
}

template <typename T>
void safety_distance_bound(benchmark::State& state) {
    run<T>(state, [](const Case<T>& c) {
        return metric::safety_distance_bound_unchecked(c.image, c.box, c.epsilon);
    });
}

template <typename T>
void inscribed_cube(benchmark::State& state) {
    run<T>(state, [](const Case<T>& c) {
        return metric::inscribed_cube(Ball<T>{c.image.viewpoint, c.to_point});
    });
}

template <typename T>
void angle_of_pixels(benchmark::State& state) {
    const auto scale = metric::pixel_scale(T(1), 1920, 1080).scale;
    run<T>(state, [&](const Case<T>& c) {
        return metric::angle_of_pixels_unchecked(scale, c.to_image);
    });
}

template <typename T>
void angle_of_pixels_naive(benchmark::State& state) {
    const auto scale = metric::pixel_scale(T(1), 1920, 1080).scale;
    run<T>(state, [&](const Case<T>& c) {
        return std::atan(scale.corner_tangent + c.to_image / scale.focal_px) -
               std::atan(scale.corner_tangent);
    });
}

template <typename T>
void pixels_of_angle(benchmark::State& state) {
    const auto scale = metric::pixel_scale(T(1), 1920, 1080).scale;
    run<T>(state, [&](const Case<T>& c) {
        return metric::pixels_of_angle_unchecked(scale, c.epsilon);
    });
}

/// What a frame does for a node with a zone: the life span that is left.
template <typename T>
void lifespan_extrapolated_box(benchmark::State& state) {
    const FrameCount<T> count;
    run<T>(state, [&](const Case<T>& c) {
        const glm::vec<3, T> middle(T(0));
        return policy::extrapolated_lifespan_unchecked(
            c.box, middle, c.velocity, c.image.normal, count
        );
    });
}

template <typename T>
void lifespan_guaranteed_box(benchmark::State& state) {
    const FrameCount<T> count;
    const MotionBound<T> motion{T(2), T(5), count.frame_seconds};
    run<T>(state, [&](const Case<T>& c) {
        const glm::vec<3, T> middle(T(0));
        return policy::guaranteed_lifespan_unchecked(c.box, middle, c.velocity, motion, count);
    });
}

template <typename T>
void lifespan_guaranteed_ball(benchmark::State& state) {
    const FrameCount<T> count;
    const MotionBound<T> motion{T(2), T(5), count.frame_seconds};
    run<T>(state, [&](const Case<T>& c) {
        const Ball<T> zone{c.image.viewpoint, c.to_point};
        return policy::guaranteed_lifespan_unchecked(zone, c.viewer, c.velocity, motion, count);
    });
}

template <typename T>
void lifespan_straight_ball(benchmark::State& state) {
    const FrameCount<T> count;
    run<T>(state, [&](const Case<T>& c) {
        const Ball<T> zone{c.image.viewpoint, c.to_point};
        return policy::extrapolated_lifespan_unchecked(zone, c.viewer, c.velocity, count);
    });
}

BENCHMARK_TEMPLATE(angle_of_point, float);
BENCHMARK_TEMPLATE(angle_of_point, double);
BENCHMARK_TEMPLATE(angle_of_point_naive, float);
BENCHMARK_TEMPLATE(angle_of_point_naive, double);
BENCHMARK_TEMPLATE(angle_of_point_checked, float);
BENCHMARK_TEMPLATE(corners, float);
BENCHMARK_TEMPLATE(corners, double);
BENCHMARK_TEMPLATE(corners_naive, float);
BENCHMARK_TEMPLATE(corners_naive, double);
BENCHMARK_TEMPLATE(corners_checked, float);
BENCHMARK_TEMPLATE(bound_t1, float);
BENCHMARK_TEMPLATE(bound_t1, double);
BENCHMARK_TEMPLATE(bound_t2, float);
BENCHMARK_TEMPLATE(bound_t2, double);
BENCHMARK_TEMPLATE(bound, float);
BENCHMARK_TEMPLATE(bound, double);
BENCHMARK_TEMPLATE(is_within, float)->Arg(1)->Arg(10)->Arg(1000);
BENCHMARK_TEMPLATE(safety_distance, float);
BENCHMARK_TEMPLATE(safety_distance, double);
BENCHMARK_TEMPLATE(safety_distance_naive, float);
BENCHMARK_TEMPLATE(safety_distance_naive, double);
BENCHMARK_TEMPLATE(safety_distance_corners, float);
BENCHMARK_TEMPLATE(safety_distance_bound, float);
BENCHMARK_TEMPLATE(safety_distance_bound, double);
BENCHMARK_TEMPLATE(inscribed_cube, float);
BENCHMARK_TEMPLATE(angle_of_pixels, float);
BENCHMARK_TEMPLATE(angle_of_pixels_naive, float);
BENCHMARK_TEMPLATE(pixels_of_angle, float);
BENCHMARK_TEMPLATE(lifespan_extrapolated_box, float);
BENCHMARK_TEMPLATE(lifespan_guaranteed_box, float);
BENCHMARK_TEMPLATE(lifespan_guaranteed_ball, float);
BENCHMARK_TEMPLATE(lifespan_straight_ball, float);

} // namespace
