// Batches are held against the functions for one box, which have tests of their own: whatever holds
// of those then holds of batches with every instruction set.
#include "metric/reference.hpp"
#include "support/golden.hpp"
#include "support/random.hpp"
#include <farfield/math/box3.hpp>
#include <farfield/metric/angular_discrepancy.hpp>
#include <farfield/metric/angular_discrepancy_batch.hpp>
#include <farfield/metric/angular_discrepancy_bound.hpp>

#include <catch2/catch.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <vector>

namespace {

using namespace farfield;
using metric::InstructionSet;
using support::Case;

template <typename T>
using Vector = glm::vec<3, T>;

constexpr std::array kSets{
    InstructionSet::scalar, InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512};

/// Calls `test` with each set that this machine has, the other names in the report.
template <typename Test>
void for_each_set(const Test& test) {
    for (const InstructionSet set : kSets) {
        if (!metric::is_supported(set)) {
            WARN("not on this machine: " << metric::name(set));
            continue;
        }
        INFO(metric::name(set));
        test(set);
    }
}

/// Cases by coordinate, from `skipped` elements after the beginning of an allocation.
template <typename T>
class Columns {
  public:
    explicit Columns(const std::vector<Case<T>>& cases, std::size_t skipped = 0)
        : skipped_(skipped) {
        for (std::vector<T>& column : columns_) {
            column.resize(skipped);
        }
        for (const Case<T>& c : cases) {
            const std::array rows{
                c.image.viewpoint, c.image.point, c.image.normal, c.box.lo, c.box.hi};
            for (std::size_t i = 0; i < rows.size(); ++i) {
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    columns_[3 * i + axis].push_back(rows[i][static_cast<int>(axis)]);
                }
            }
        }
    }

    [[nodiscard]] ImageColumns<T> images() const { return {points(0), points(1), points(2)}; }
    [[nodiscard]] BoxColumns<T> boxes() const { return {points(3), points(4)}; }

  private:
    [[nodiscard]] PointColumns<T> points(std::size_t index) const {
        const auto column = [&](std::size_t axis) {
            return std::span<const T>(columns_[3 * index + axis]).subspan(skipped_);
        };
        return {column(0), column(1), column(2)};
    }

    std::size_t skipped_;
    std::array<std::vector<T>, 15> columns_;
};

/// All four functions, of cases with one viewer, against those for one box. The images are those of
/// the cases, or one for all.
template <typename T, typename Images>
void check_batch(
    const std::vector<Case<T>>& cases,
    const Images& images,
    const BoxColumns<T>& boxes,
    InstructionSet set
) {
    const std::size_t count = cases.size();
    const Vector<T> viewer = count == 0 ? Vector<T>(T(0)) : cases.front().viewer;
    // What lies behind the results must stay as it is.
    constexpr std::size_t kBehind = 17;
    const T untouched = T(-7);
    const auto angles = [&](auto function) {
        std::vector<T> results(count + kBehind, untouched);
        function(images, boxes, viewer, std::span(results).first(count), set);
        CHECK(std::count(results.begin(), results.end(), untouched) == kBehind);
        return results;
    };
    const auto corners = angles(metric::corner_discrepancies_unchecked<T, Images>);
    const auto cheap = angles(metric::bounds_t1_unchecked<T, Images>);
    const auto bounds = angles(metric::angular_discrepancy_bounds_unchecked<T, Images>);
    for (std::size_t i = 0; i < count; ++i) {
        const Case<T>& c = cases[i];
        const T corner = metric::corner_discrepancy_unchecked(c.image, c.box, viewer);
        const T t1 = metric::bound_t1_unchecked(c.image, c.box, viewer);
        const T bound = metric::angular_discrepancy_bound_unchecked(c.image, c.box, viewer);
        if (corners[i] != corner || cheap[i] != t1 || bounds[i] != bound) {
            FAIL_CHECK(
                c << " at " << i << " corners " << corners[i] << " not " << corner << ", t1 "
                  << cheap[i] << " not " << t1 << ", bound " << bounds[i] << " not " << bound
            );
        }
    }
    for (const T threshold : {T(0), T(1e-3), T(0.05), T(3.2)}) {
        constexpr std::uint8_t kUntouched = 77;
        std::vector<std::uint8_t> within(count + kBehind, kUntouched);
        metric::are_within_unchecked(
            images, boxes, viewer, threshold, std::span(within).first(count), set
        );
        CHECK(std::count(within.begin(), within.end(), kUntouched) == kBehind);
        for (std::size_t i = 0; i < count; ++i) {
            const bool expected =
                metric::is_within_unchecked(cases[i].image, cases[i].box, viewer, threshold);
            if (within[i] != (expected ? 1 : 0)) {
                FAIL_CHECK(cases[i] << " at " << i << " threshold " << threshold);
            }
        }
    }
}

template <typename T>
void check_with_own_images(
    const std::vector<Case<T>>& cases, InstructionSet set, std::size_t skipped = 0
) {
    const Columns<T> columns(cases, skipped);
    check_batch(cases, columns.images(), columns.boxes(), set);
}

/// Cases around one viewer: the scene of each is moved so that its viewer is at the origin.
template <typename T>
std::vector<Case<T>> cases_of_one_viewer(support::Random& random, std::size_t count) {
    std::vector<Case<T>> cases;
    while (cases.size() < count) {
        Case<T> c = support::random_case<T>(random, T(0.02), T(100));
        c.image.viewpoint -= c.viewer;
        c.image.point -= c.viewer;
        c.box = {c.box.lo - c.viewer, c.box.hi - c.viewer};
        c.viewer = Vector<T>(T(0));
        if (metric::check(c.image, c.box) == MetricOutcome::ok) {
            cases.push_back(c);
        }
    }
    return cases;
}

/// The golden boxes that have an angle, hard cases included, each with its own viewer.
template <typename T>
std::vector<Case<T>> golden_cases() {
    const support::GoldenFile file("box_max_discrepancy");
    std::vector<Case<T>> cases;
    for (const support::GoldenRow& row : file.rows()) {
        if (row.serves<T>() && !is_error(row.status())) {
            Case<T> c;
            c.image = {row.vector<T>("v0"), row.vector<T>("c"), row.vector<T>("n")};
            c.box = {row.vector<T>("lo"), row.vector<T>("hi")};
            c.viewer = row.vector<T>("v");
            cases.push_back(c);
        }
    }
    return cases;
}

} // namespace

TEST_CASE("The widest instruction set is one of the machine's") {
    CHECK(metric::is_supported(InstructionSet::scalar));
    CHECK(metric::is_supported(metric::widest_instruction_set()));
    for (const InstructionSet set : kSets) {
        CHECK_FALSE(std::string(metric::name(set)).empty());
        if (metric::is_supported(set)) {
            CHECK(set <= metric::widest_instruction_set());
        }
    }
}

TEMPLATE_TEST_CASE("Batches of every length end where they should", "", float, double) {
    using T = TestType;
    support::Random random(51);
    const std::vector<Case<T>> all = cases_of_one_viewer<T>(random, 35);
    for_each_set([&](InstructionSet set) {
        for (std::size_t count = 0; count <= 17; ++count) {
            INFO(count << " boxes");
            check_with_own_images<T>({all.begin(), all.begin() + static_cast<int>(count)}, set);
        }
        check_with_own_images(all, set);
    });
}

TEMPLATE_TEST_CASE("Columns may begin at any element", "", float, double) {
    using T = TestType;
    support::Random random(52);
    const std::vector<Case<T>> cases = cases_of_one_viewer<T>(random, 37);
    for_each_set([&](InstructionSet set) {
        for (std::size_t skipped = 0; skipped < 16; ++skipped) {
            check_with_own_images(cases, set, skipped);
        }
    });
}

TEMPLATE_TEST_CASE("Batches agree with the functions for one box", "", float, double) {
    using T = TestType;
    support::Random random(53);
    const std::vector<Case<T>> cases = cases_of_one_viewer<T>(random, 5000);
    for_each_set([&](InstructionSet set) { check_with_own_images(cases, set); });
}

TEMPLATE_TEST_CASE("One image serves many boxes", "", float, double) {
    using T = TestType;
    support::Random random(54);
    for (int i = 0; i < 20; ++i) {
        const Case<T> first = support::random_case<T>(random, T(0.5), T(20));
        std::vector<Case<T>> cases{first};
        while (cases.size() < 200) {
            Case<T> c = first;
            const Vector<T> shift = random.vector(T(-1), T(1));
            c.box = {c.box.lo * T(0.5) + shift, c.box.hi * T(0.5) + shift};
            if (metric::check(c.image, c.box) == MetricOutcome::ok) {
                cases.push_back(c);
            }
        }
        const Columns<T> columns(cases);
        for_each_set([&](InstructionSet set) {
            check_batch(cases, first.image, columns.boxes(), set);
        });
    }
}

TEMPLATE_TEST_CASE("Golden boxes come out the same in every lane", "", float, double) {
    using T = TestType;
    support::Random random(55);
    const std::vector<Case<T>> golden = golden_cases<T>();
    REQUIRE(golden.size() > 200);
    for_each_set([&](InstructionSet set) {
        for (const Case<T>& hard : golden) {
            // Its neighbours have its viewer and are taken from its own place and unit.
            std::vector<Case<T>> cases(17, hard);
            for (std::size_t i = 0; i < cases.size(); ++i) {
                const T share = random.uniform(T(0), T(1));
                Case<T> other = hard;
                other.box.hi = hard.box.lo + (hard.box.hi - hard.box.lo) * share;
                if (i % 2 == 1 && metric::check(other.image, other.box) == MetricOutcome::ok) {
                    cases[i] = other;
                }
            }
            check_with_own_images(cases, set);
            std::rotate(cases.begin(), cases.begin() + 1, cases.end());
            check_with_own_images(cases, set);
        }
    });
}

TEMPLATE_TEST_CASE("Batches keep the bounds of the golden file", "", float, double) {
    using T = TestType;
    const support::GoldenFile file("box_max_discrepancy");
    for_each_set([&](InstructionSet set) {
        for (const support::GoldenRow& row : file.rows()) {
            if (!row.serves<T>() || row.status() != MetricOutcome::ok) {
                continue;
            }
            Case<T> c;
            c.image = {row.vector<T>("v0"), row.vector<T>("c"), row.vector<T>("n")};
            c.box = {row.vector<T>("lo"), row.vector<T>("hi")};
            const Columns<T> columns({c});
            T bound = 0;
            metric::angular_discrepancy_bounds_unchecked(
                columns.images(), columns.boxes(), row.vector<T>("v"), std::span(&bound, 1), set
            );
            const bool is_pi = row.number<support::Real>("theta_max") > 3;
            INFO("row " << row.name());
            CHECK(
                (is_pi ? bound == std::numbers::pi_v<T>
                       : bound >= row.number<support::Real>("theta_max"))
            );
        }
    });
}

TEMPLATE_TEST_CASE("Degenerate boxes among ordinary ones", "", float, double) {
    using T = TestType;
    constexpr T kTiny = std::numeric_limits<T>::min();
    support::Random random(56);
    const ImagePlane<T> image{Vector<T>(T(0)), {T(0), T(0), T(-5)}, {T(0), T(0), T(-1)}};
    const Vector<T> lo(T(-1), T(-1), T(-6));
    const std::vector<Box3<T>> boxes{
        {lo, lo},                                                // a point
        {lo, {T(1), T(-1), T(-6)}},                              // a segment
        {{T(-1), T(-1), T(-5)}, {T(1), T(1), T(-5)}},            // in the plane
        {{T(-1), T(-1), T(-5)}, {T(1), T(1), -5 + 8 * T(1e-7)}}, // nearly so
        {{T(-1), T(-1), T(-9)}, {T(1), T(1), -kTiny}},           // up to the viewpoint's depth
        {{T(-1e6), T(-1e6), T(-6)}, {T(1e6), T(1e6), T(-5.5)}},  // a wide slab
        {{T(0.4), T(0.2), T(-4)}, {T(0.6), T(0.3), T(-3)}},      // may hold the viewer
        {{T(-1), T(-1), T(-3)}, {T(1), T(1), T(-2)}}};           // its image is behind
    for (const Vector<T>& viewer :
         {image.viewpoint,
          Vector<T>(T(0.5), T(0.25), T(0)),
          Vector<T>(kTiny, T(0), T(0)),
          Vector<T>(std::numeric_limits<T>::denorm_min(), T(0), T(0)),
          Vector<T>(T(0.5), T(0.25), T(-3.5)),
          Vector<T>(T(0.5), T(0.25), T(-5)),
          Vector<T>(T(1e6), T(0), T(0))}) {
        std::vector<Case<T>> cases;
        for (int i = 0; i < 40; ++i) {
            cases.push_back(
                {image, boxes[random.below(static_cast<unsigned>(boxes.size()))], viewer}
            );
            REQUIRE(metric::check(image, cases.back().box) == MetricOutcome::ok);
        }
        for_each_set([&](InstructionSet set) {
            check_with_own_images(cases, set);
            const Columns<T> columns(cases);
            check_batch(cases, image, columns.boxes(), set);
        });
    }
}
