// Nanoseconds for one evaluation of each metric, the stable form beside the naive one where there
// is one. Inputs are 1024 random boxes at 0.6 to 60 diagonals, in turn, so that no branch is
// learnt. The counter `worst_error` is the largest relative error over them, beside the stable form
// in double; NaN counts as infinite. Batches take all boxes at once, from columns that begin at
// multiples of 64 bytes, and count boxes: items_per_second is boxes per second.
#include "../tests/support/naive_metrics.hpp"
#include <farfield/math/box3.hpp>
#include <farfield/metric/angular_discrepancy.hpp>
#include <farfield/metric/angular_discrepancy_batch.hpp>
#include <farfield/metric/angular_discrepancy_bound.hpp>
#include <farfield/metric/impostor_angles.hpp>
#include <farfield/metric/pixel_angle.hpp>
#include <farfield/metric/projected_size.hpp>
#include <farfield/metric/safety_zone.hpp>
#include <farfield/metric/sprite_angle.hpp>
#include <farfield/metric/star_shape.hpp>
#include <farfield/policy/lifespan.hpp>
#include <farfield/policy/placement_benefit.hpp>

#include <benchmark/benchmark.h>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <span>
#include <string>
#include <type_traits>

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

Case<double> in_double(const Case<double>& c) {
    return c;
}

Case<double> in_double(const Case<float>& c) {
    return {
        {glm::dvec3(c.image.viewpoint), glm::dvec3(c.image.point), glm::dvec3(c.image.normal)},
        {glm::dvec3(c.box.lo), glm::dvec3(c.box.hi)},
        glm::dvec3(c.viewer),
        glm::dvec3(c.velocity),
        static_cast<double>(c.to_point),
        static_cast<double>(c.to_image),
        static_cast<double>(c.epsilon)};
}

/// Times `evaluate` and compares it with `stable` in double.
template <typename T, typename Evaluate, typename Stable>
void run(benchmark::State& state, const Evaluate& evaluate, const Stable& stable) {
    run<T>(state, evaluate);
    double worst = 0;
    for (const Case<T>& c : cases<T>()) {
        const double expected = stable(in_double(c));
        const double error = std::abs(static_cast<double>(evaluate(c)) - expected) / expected;
        worst = error <= worst ? worst : error;
        if (std::isnan(error)) {
            worst = std::numeric_limits<double>::infinity();
            break;
        }
    }
    state.counters["worst_error"] = worst;
}

/// Forms that are timed and compared, as generic lambdas: the same text in both precisions.
constexpr auto kAngleOfPoint = [](const auto& c) {
    return metric::angular_discrepancy_unchecked(c.image, c.viewer, c.box.hi);
};
constexpr auto kSafetyDistance = [](const auto& c) {
    return metric::safety_distance_unchecked(c.to_point, c.to_image, c.epsilon);
};
constexpr auto kAngleOfPixels = [](const auto& c) {
    using T = std::remove_cvref_t<decltype(c.epsilon)>;
    return metric::angle_of_pixels_unchecked(PixelScale<T>{T(988), T(1.115)}, c.epsilon * 1000);
};
constexpr auto kPixelsOfAngle = [](const auto& c) {
    using T = std::remove_cvref_t<decltype(c.epsilon)>;
    return metric::pixels_of_angle_unchecked(PixelScale<T>{T(988), T(1.115)}, c.epsilon);
};
constexpr auto kAlphaTrans = [](const auto& c) {
    using T = std::remove_cvref_t<decltype(c.epsilon)>;
    const T off = std::abs(c.viewer.x - c.image.viewpoint.x);
    return metric::alpha_trans_unchecked(ImpostorView<T>{
        c.to_point, T(0.05) * c.to_point, T(1), T(0), off});
};
constexpr auto kSpriteAngle = [](const auto& c) {
    return metric::sprite_angle_unchecked(c.image.viewpoint, c.viewer, c.box.hi, c.epsilon);
};
constexpr auto kCubeDiameter = [](const auto& c) {
    using T = std::remove_cvref_t<decltype(c.epsilon)>;
    const Cube<T> cube{{c.box.hi.x, c.box.hi.y, -20 * c.to_point}, c.epsilon};
    return metric::projected_size_unchecked(cube, CameraPose<T>{}, T(988)).diameter_px;
};
constexpr auto kFirstExit = [](const auto& c) {
    using T = std::remove_cvref_t<decltype(c.epsilon)>;
    return policy::detail::first_passage(c.epsilon, std::abs(c.velocity.x), T(0.1));
};

template <typename T>
void angle_of_point(benchmark::State& state) {
    run<T>(state, kAngleOfPoint, kAngleOfPoint);
}

template <typename T>
void angle_of_point_naive(benchmark::State& state) {
    run<T>(
        state,
        [](const Case<T>& c) { return naive::angular_discrepancy(c.image, c.viewer, c.box.hi); },
        kAngleOfPoint
    );
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
    run<T>(
        state,
        [](const Case<T>& c) {
            T largest = 0;
            for (unsigned index = 0; index < 8; ++index) {
                const glm::vec<3, T> point = corner(c.box, index);
                largest = std::max(largest, naive::angular_discrepancy(c.image, c.viewer, point));
            }
            return largest;
        },
        [](const Case<double>& c) {
            return metric::corner_discrepancy_unchecked(c.image, c.box, c.viewer);
        }
    );
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

/// The cases by coordinate: viewpoint, point and normal of the image, lo and hi of the box.
template <typename T>
struct Columns {
    struct alignas(64) Column {
        std::array<T, kCases> values{};
    };
    std::array<Column, 15> columns;

    Columns() {
        for (std::size_t i = 0; i < kCases; ++i) {
            const Case<T>& c = cases<T>()[i];
            const std::array rows{
                c.image.viewpoint, c.image.point, c.image.normal, c.box.lo, c.box.hi};
            for (std::size_t column = 0; column < columns.size(); ++column) {
                columns[column].values[i] = rows[column / 3][static_cast<int>(column % 3)];
            }
        }
    }

    [[nodiscard]] PointColumns<T> points(std::size_t index) const {
        return {
            columns[3 * index].values,
            columns[3 * index + 1].values,
            columns[3 * index + 2].values};
    }
};

/// Times `batch(images, boxes, viewer, results, set)`, with one image for all boxes or one each.
template <typename T, typename Result, typename Batch>
void run_batch(benchmark::State& state, const Batch& batch) {
    const auto set = static_cast<metric::InstructionSet>(state.range(0));
    const bool one_image = state.range(1) == 1;
    state.SetLabel(
        std::string(metric::name(set)) + (one_image ? ", one image" : ", an image for each")
    );
    if (!metric::is_supported(set)) {
        state.SkipWithError("not on this machine");
        return;
    }
    static const Columns<T> kColumns;
    alignas(64) std::array<Result, kCases> results{};
    const BoxColumns<T> boxes{kColumns.points(3), kColumns.points(4)};
    const ImageColumns<T> images{kColumns.points(0), kColumns.points(1), kColumns.points(2)};
    // All boxes are about the origin, so the image of one serves all.
    const Case<T>& first = cases<T>().front();
    for (auto _ : state) {
        if (one_image) {
            batch(first.image, boxes, first.viewer, std::span<Result>(results), set);
        } else {
            batch(images, boxes, first.viewer, std::span<Result>(results), set);
        }
        benchmark::DoNotOptimize(results.data());
        benchmark::ClobberMemory();
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kCases));
    state.counters["per_box"] = benchmark::Counter(
        static_cast<double>(kCases),
        benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert
    );
}

template <typename T>
void batch_t1(benchmark::State& state) {
    run_batch<T, T>(state, [](const auto&... arguments) {
        metric::bounds_t1_unchecked(arguments...);
    });
}

template <typename T>
void batch_bound(benchmark::State& state) {
    run_batch<T, T>(state, [](const auto&... arguments) {
        metric::angular_discrepancy_bounds_unchecked(arguments...);
    });
}

template <typename T>
void batch_corners(benchmark::State& state) {
    run_batch<T, T>(state, [](const auto&... arguments) {
        metric::corner_discrepancies_unchecked(arguments...);
    });
}

template <typename T>
void batch_within(benchmark::State& state) {
    run_batch<T, std::uint8_t>(
        state,
        [](const auto& images, const auto& boxes, const auto& viewer, auto within, auto set) {
            metric::are_within_unchecked(images, boxes, viewer, T(0.01), within, set);
        }
    );
}

template <typename T>
void safety_distance(benchmark::State& state) {
    run<T>(state, kSafetyDistance, kSafetyDistance);
}

template <typename T>
void safety_distance_naive(benchmark::State& state) {
    run<T>(
        state,
        [](const Case<T>& c) { return naive::safety_distance(c.to_point, c.to_image, c.epsilon); },
        kSafetyDistance
    );
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
    run<T>(state, kAngleOfPixels, kAngleOfPixels);
}

template <typename T>
void angle_of_pixels_naive(benchmark::State& state) {
    run<T>(
        state,
        [](const Case<T>& c) { return naive::angle_of_pixels(T(988), T(1.115), c.epsilon * 1000); },
        kAngleOfPixels
    );
}

template <typename T>
void pixels_of_angle(benchmark::State& state) {
    run<T>(state, kPixelsOfAngle, kPixelsOfAngle);
}

template <typename T>
void pixels_of_angle_naive(benchmark::State& state) {
    run<T>(
        state,
        [](const Case<T>& c) { return naive::pixels_of_angle(T(988), T(1.115), c.epsilon); },
        kPixelsOfAngle
    );
}

template <typename T>
void impostor_view(benchmark::State& state) {
    run<T>(state, [](const Case<T>& c) {
        return metric::impostor_view_unchecked(c.box, c.image.viewpoint, c.viewer);
    });
}

template <typename T>
void alpha_trans(benchmark::State& state) {
    run<T>(state, kAlphaTrans, kAlphaTrans);
}

template <typename T>
void alpha_trans_naive(benchmark::State& state) {
    run<T>(
        state,
        [](const Case<T>& c) {
            const T off = std::abs(c.viewer.x - c.image.viewpoint.x);
            return naive::alpha_trans(c.to_point, T(0.05) * c.to_point, off);
        },
        kAlphaTrans
    );
}

template <typename T>
void alpha_size(benchmark::State& state) {
    run<T>(state, [](const Case<T>& c) {
        return metric::alpha_size_unchecked(ImpostorView<T>{
            c.to_point, T(0.05) * c.to_point, T(1), c.epsilon, T(0)});
    });
}

template <typename T>
void sprite_angle(benchmark::State& state) {
    run<T>(state, kSpriteAngle, kSpriteAngle);
}

template <typename T>
void sprite_angle_naive(benchmark::State& state) {
    run<T>(
        state,
        [](const Case<T>& c) {
            return naive::sprite_angle(c.image.viewpoint, c.viewer, c.box.hi, c.epsilon);
        },
        kSpriteAngle
    );
}

template <typename T>
void largest_sprite_turn(benchmark::State& state) {
    run<T>(state, [](const Case<T>& c) {
        return metric::largest_sprite_turn_unchecked(c.image.viewpoint, c.viewer, c.box);
    });
}

template <typename T>
void cube_diameter(benchmark::State& state) {
    run<T>(state, kCubeDiameter, kCubeDiameter);
}

template <typename T>
void cube_diameter_naive(benchmark::State& state) {
    run<T>(
        state,
        [](const Case<T>& c) {
            const CameraPose<T> pose;
            return naive::cube_diameter_px(
                glm::vec<3, T>(c.box.hi.x, c.box.hi.y, -20 * c.to_point),
                c.epsilon,
                pose.eye,
                pose.right,
                pose.up,
                pose.forward,
                T(988)
            );
        },
        kCubeDiameter
    );
}

template <typename T>
void cube_sphere_bound(benchmark::State& state) {
    run<T>(state, [](const Case<T>& c) {
        const Cube<T> cube{{c.box.hi.x, c.box.hi.y, -20 * c.to_point}, c.epsilon};
        return metric::sphere_bound_px_unchecked(cube, CameraPose<T>{}, T(988));
    });
}

template <typename T>
void reverse_frustum(benchmark::State& state) {
    const glm::vec<2, T> tangents(T(0.5), T(0.4));
    run<T>(state, [&](const Case<T>& c) {
        return metric::reverse_frustum_margin_unchecked(
            CameraPose<T>{c.viewer}, tangents, c.box.hi
        );
    });
}

template <typename T>
void placement_benefit(benchmark::State& state) {
    run<T>(state, [](const Case<T>& c) {
        const Placement<T> placement{
            1000, 9000, c.to_point, c.to_image, T(640), T(480), c.to_point, T(100)};
        return policy::placement_benefit_unchecked(placement);
    });
}

template <typename T>
void first_passage(benchmark::State& state) {
    run<T>(state, kFirstExit, kFirstExit);
}

template <typename T>
void first_passage_naive(benchmark::State& state) {
    run<T>(
        state,
        [](const Case<T>& c) {
            return naive::first_passage(c.epsilon, std::abs(c.velocity.x), T(0.1));
        },
        kFirstExit
    );
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
BENCHMARK_TEMPLATE(angle_of_point_checked, double);
BENCHMARK_TEMPLATE(corners, float);
BENCHMARK_TEMPLATE(corners, double);
BENCHMARK_TEMPLATE(corners_naive, float);
BENCHMARK_TEMPLATE(corners_naive, double);
BENCHMARK_TEMPLATE(bound_t1, float);
BENCHMARK_TEMPLATE(bound_t1, double);
BENCHMARK_TEMPLATE(bound_t2, float);
BENCHMARK_TEMPLATE(bound_t2, double);
BENCHMARK_TEMPLATE(bound, float);
BENCHMARK_TEMPLATE(bound, double);
BENCHMARK_TEMPLATE(safety_distance, float);
BENCHMARK_TEMPLATE(safety_distance, double);
BENCHMARK_TEMPLATE(safety_distance_naive, float);
BENCHMARK_TEMPLATE(safety_distance_naive, double);
BENCHMARK_TEMPLATE(safety_distance_corners, float);
BENCHMARK_TEMPLATE(safety_distance_corners, double);
BENCHMARK_TEMPLATE(safety_distance_bound, float);
BENCHMARK_TEMPLATE(safety_distance_bound, double);
BENCHMARK_TEMPLATE(inscribed_cube, float);
BENCHMARK_TEMPLATE(inscribed_cube, double);
BENCHMARK_TEMPLATE(angle_of_pixels, float);
BENCHMARK_TEMPLATE(angle_of_pixels, double);
BENCHMARK_TEMPLATE(angle_of_pixels_naive, float);
BENCHMARK_TEMPLATE(angle_of_pixels_naive, double);
BENCHMARK_TEMPLATE(pixels_of_angle, float);
BENCHMARK_TEMPLATE(pixels_of_angle, double);
BENCHMARK_TEMPLATE(pixels_of_angle_naive, float);
BENCHMARK_TEMPLATE(pixels_of_angle_naive, double);
BENCHMARK_TEMPLATE(impostor_view, float);
BENCHMARK_TEMPLATE(impostor_view, double);
BENCHMARK_TEMPLATE(alpha_trans, float);
BENCHMARK_TEMPLATE(alpha_trans, double);
BENCHMARK_TEMPLATE(alpha_trans_naive, float);
BENCHMARK_TEMPLATE(alpha_trans_naive, double);
BENCHMARK_TEMPLATE(alpha_size, float);
BENCHMARK_TEMPLATE(alpha_size, double);
BENCHMARK_TEMPLATE(sprite_angle, float);
BENCHMARK_TEMPLATE(sprite_angle, double);
BENCHMARK_TEMPLATE(sprite_angle_naive, float);
BENCHMARK_TEMPLATE(sprite_angle_naive, double);
BENCHMARK_TEMPLATE(largest_sprite_turn, float);
BENCHMARK_TEMPLATE(largest_sprite_turn, double);
BENCHMARK_TEMPLATE(cube_diameter, float);
BENCHMARK_TEMPLATE(cube_diameter, double);
BENCHMARK_TEMPLATE(cube_diameter_naive, float);
BENCHMARK_TEMPLATE(cube_diameter_naive, double);
BENCHMARK_TEMPLATE(cube_sphere_bound, float);
BENCHMARK_TEMPLATE(cube_sphere_bound, double);
BENCHMARK_TEMPLATE(reverse_frustum, float);
BENCHMARK_TEMPLATE(reverse_frustum, double);
BENCHMARK_TEMPLATE(placement_benefit, float);
BENCHMARK_TEMPLATE(placement_benefit, double);
BENCHMARK_TEMPLATE(first_passage, float);
BENCHMARK_TEMPLATE(first_passage, double);
BENCHMARK_TEMPLATE(first_passage_naive, float);
BENCHMARK_TEMPLATE(first_passage_naive, double);
BENCHMARK_TEMPLATE(lifespan_extrapolated_box, float);
BENCHMARK_TEMPLATE(lifespan_extrapolated_box, double);
BENCHMARK_TEMPLATE(lifespan_guaranteed_box, float);
BENCHMARK_TEMPLATE(lifespan_guaranteed_box, double);
BENCHMARK_TEMPLATE(lifespan_guaranteed_ball, float);
BENCHMARK_TEMPLATE(lifespan_guaranteed_ball, double);
BENCHMARK_TEMPLATE(lifespan_straight_ball, float);
BENCHMARK_TEMPLATE(lifespan_straight_ball, double);
BENCHMARK_TEMPLATE(is_within, float)->Arg(1)->Arg(10)->Arg(1000);
BENCHMARK_TEMPLATE(is_within, double)->Arg(1)->Arg(10)->Arg(1000);

/// Each instruction set, with one image for all boxes and with one for each.
void batches(benchmark::internal::Benchmark* benchmark) {
    benchmark->ArgNames({"set", "one_image"});
    benchmark->ArgsProduct({{0, 1, 2, 3}, {1, 0}});
}

BENCHMARK_TEMPLATE(batch_t1, float)->Apply(batches);
BENCHMARK_TEMPLATE(batch_t1, double)->Apply(batches);
BENCHMARK_TEMPLATE(batch_bound, float)->Apply(batches);
BENCHMARK_TEMPLATE(batch_bound, double)->Apply(batches);
BENCHMARK_TEMPLATE(batch_corners, float)->Apply(batches);
BENCHMARK_TEMPLATE(batch_corners, double)->Apply(batches);
BENCHMARK_TEMPLATE(batch_within, float)->Apply(batches);
BENCHMARK_TEMPLATE(batch_within, double)->Apply(batches);

} // namespace
