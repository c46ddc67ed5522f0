#include "support/random.hpp"
#include "technique/placement_search.hpp"
#include <farfield/policy/placement_benefit.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

namespace {

using namespace farfield;
using farfield::support::Random;

SubsetTask task_of(const std::vector<SeenCell>& cells, std::uint64_t total, std::uint64_t target) {
    SubsetTask task;
    task.cells = cells;
    task.total = total;
    task.target = target;
    task.lens = {-1.0, 1.0, -0.75, 0.75, 0.1, 1e4};
    task.width = 640;
    task.height = 480;
    task.model_extent = 100.0;
    return task;
}

std::uint64_t sum_of(const std::vector<SeenCell>& cells) {
    return std::accumulate(
        cells.begin(),
        cells.end(),
        std::uint64_t{0},
        [](std::uint64_t sum, const SeenCell& cell) { return sum + cell.primitives; }
    );
}

/// Borders of a box of screen and depth, as small as some cells allow.
struct Borders {
    double left = std::numeric_limits<double>::infinity();
    double right = -std::numeric_limits<double>::infinity();
    double bottom = std::numeric_limits<double>::infinity();
    double top = -std::numeric_limits<double>::infinity();
    double near_depth = std::numeric_limits<double>::infinity();
};

Borders borders_of(const std::vector<SeenCell>& cells, const std::vector<std::uint32_t>& which) {
    Borders borders;
    for (const std::uint32_t index : which) {
        const SeenCell& cell = cells.at(index);
        borders.left = std::min(borders.left, cell.left);
        borders.right = std::max(borders.right, cell.right);
        borders.bottom = std::min(borders.bottom, cell.bottom);
        borders.top = std::max(borders.top, cell.top);
        borders.near_depth = std::min(borders.near_depth, cell.near_depth);
    }
    return borders;
}

bool is_within(const SeenCell& cell, const Borders& borders) {
    return cell.left >= borders.left && cell.right <= borders.right &&
           cell.bottom >= borders.bottom && cell.top <= borders.top &&
           cell.near_depth >= borders.near_depth;
}

/// What every subset has to be: named cells in order, their sum, enough of them, and all within
/// their own borders.
void check_subset(const SubsetTask& task, const Subset& subset) {
    const std::vector<SeenCell> cells(task.cells.begin(), task.cells.end());
    REQUIRE_FALSE(subset.cells.empty());
    std::uint64_t sum = 0;
    std::vector<bool> is_in(cells.size(), false);
    for (std::size_t i = 0; i < subset.cells.size(); ++i) {
        REQUIRE(subset.cells[i] < cells.size());
        if (i > 0) {
            REQUIRE(subset.cells[i] > subset.cells[i - 1]);
        }
        sum += cells[subset.cells[i]].primitives;
        is_in[subset.cells[i]] = true;
    }
    REQUIRE(subset.primitives == sum);
    REQUIRE(subset.primitives <= task.total);
    REQUIRE(task.total - subset.primitives <= task.target);
    const Borders borders = borders_of(cells, subset.cells);
    for (std::size_t i = 0; i < cells.size(); ++i) {
        REQUIRE(is_in[i] == is_within(cells[i], borders));
    }
}

/// What an image of a subset is worth, by its own borders.
double benefit_of(const SubsetTask& task, const Subset& subset) {
    const std::vector<SeenCell> cells(task.cells.begin(), task.cells.end());
    const Borders borders = borders_of(cells, subset.cells);
    const Lens& lens = task.lens;
    const auto part = [](double lo, double hi, double least, double most) {
        return std::max(std::min(hi, most) - std::max(lo, least), 0.0) / (most - least);
    };
    Placement<double> placement;
    placement.drawn = task.total - subset.primitives;
    placement.total = task.total;
    placement.image_width = task.width * part(borders.left, borders.right, lens.left, lens.right);
    placement.image_height = task.height * part(borders.bottom, borders.top, lens.bottom, lens.top);
    placement.screen_width = task.width;
    placement.screen_height = task.height;
    placement.depth = borders.near_depth;
    placement.model_extent = task.model_extent;
    return policy::placement_benefit(placement, task.weights).total;
}

/// Boxes of the world before a camera at 0, as tangents: large ones overlap many others.
std::vector<SeenCell> random_cells(Random& random, std::size_t count) {
    std::vector<SeenCell> cells(count);
    for (SeenCell& cell : cells) {
        cell.near_depth = random.uniform(1.0, 100.0);
        const double half = random.uniform(0.1, 4.0) / cell.near_depth;
        const double x = random.uniform(-1.0, 1.0);
        const double y = random.uniform(-0.75, 0.75);
        cell.left = x - half;
        cell.right = x + half;
        cell.bottom = y - half;
        cell.top = y + half;
        cell.primitives = 1 + random.below(1000);
    }
    return cells;
}

/// Equal cells side by side on the screen and one behind the other.
std::vector<SeenCell> grid_cells(std::size_t columns, std::size_t rows, std::size_t layers) {
    std::vector<SeenCell> cells;
    for (std::size_t z = 0; z < layers; ++z) {
        for (std::size_t y = 0; y < rows; ++y) {
            for (std::size_t x = 0; x < columns; ++x) {
                const double wide = 2.0 / static_cast<double>(columns);
                const double high = 1.5 / static_cast<double>(rows);
                SeenCell cell;
                cell.left = -1.0 + wide * static_cast<double>(x);
                cell.right = -1.0 + wide * static_cast<double>(x + 1);
                cell.bottom = -0.75 + high * static_cast<double>(y);
                cell.top = -0.75 + high * static_cast<double>(y + 1);
                cell.near_depth = 1.0 + static_cast<double>(z);
                cell.primitives = 10;
                cells.push_back(cell);
            }
        }
    }
    return cells;
}

} // namespace

TEST_CASE("a single cell is the subset") {
    for (const std::uint64_t target : {0U, 5U, 100U}) {
        const std::vector<SeenCell> one = grid_cells(1, 1, 1);
        const SubsetTask task = task_of(one, 10, target);
        const Subset subset = search_subset(task);
        CHECK(subset.cells == std::vector<std::uint32_t>{0});
        CHECK(subset.primitives == 10);
    }
}

TEST_CASE("cells that nothing tells apart stay together") {
    const std::vector<SeenCell> same(50, grid_cells(1, 1, 1)[0]);
    const Subset subset = search_subset(task_of(same, 600, 590));
    CHECK(subset.cells.size() == 50);
    CHECK(subset.primitives == 500);
}

TEST_CASE("where nothing may be left every cell is replaced") {
    Random random(1);
    const std::vector<SeenCell> cells = random_cells(random, 300);
    const Subset subset = search_subset(task_of(cells, sum_of(cells), 0));
    CHECK(subset.cells.size() == cells.size());
    CHECK(subset.primitives == sum_of(cells));
    // Neither may any where what cannot be replaced is as much as may be left.
    CHECK(search_subset(task_of(cells, sum_of(cells) + 700, 700)).cells.size() == cells.size());
}

TEST_CASE("cells without primitives are replaced or left as it comes") {
    std::vector<SeenCell> cells = grid_cells(4, 4, 4);
    for (std::size_t i = 0; i < cells.size(); i += 2) {
        cells[i].primitives = 0;
    }
    for (const std::uint64_t target : {0U, 100U, 319U}) {
        const SubsetTask task = task_of(cells, 320, target);
        check_subset(task, search_subset(task));
    }
}

TEST_CASE("a subset is contiguous and leaves no more than the target") {
    Random random(2);
    std::size_t smaller = 0;
    for (int run = 0; run < 300; ++run) {
        const std::vector<SeenCell> cells = random_cells(random, 1 + random.below(120));
        const std::uint64_t others = random.below(2000);
        const std::uint64_t total = sum_of(cells) + others;
        const auto share = random.uniform(0.0, 1.0);
        const std::uint64_t target =
            others + static_cast<std::uint64_t>(share * static_cast<double>(sum_of(cells)));
        SubsetTask task = task_of(cells, total, target);
        task.lookahead = 1 + random.below(3);
        CAPTURE(run, cells.size(), total, target, task.lookahead);
        const Subset subset = search_subset(task);
        check_subset(task, subset);
        smaller += subset.cells.size() < cells.size() ? 1U : 0U;
        const Subset again = search_subset(task);
        REQUIRE(again.cells == subset.cells);
    }
    CHECK(smaller > 200);
}

TEST_CASE("a subset does not depend on the order of cells") {
    Random random(3);
    for (int run = 0; run < 30; ++run) {
        const std::vector<SeenCell> cells = random_cells(random, 80);
        const std::vector<SeenCell> turned(cells.rbegin(), cells.rend());
        const std::uint64_t total = sum_of(cells);
        const Subset a = search_subset(task_of(cells, total, total / 3));
        Subset b = search_subset(task_of(turned, total, total / 3));
        for (std::uint32_t& index : b.cells) {
            index = 79 - index;
        }
        std::reverse(b.cells.begin(), b.cells.end());
        REQUIRE(a.cells == b.cells);
    }
}

TEST_CASE("no border can be moved any more: one place further leaves too much") {
    Random random(4);
    for (int run = 0; run < 100; ++run) {
        const std::vector<SeenCell> cells = random_cells(random, 2 + random.below(100));
        const std::uint64_t total = sum_of(cells);
        const std::uint64_t target = total / (2 + random.below(5));
        SubsetTask task = task_of(cells, total, target);
        task.lookahead = 1 + random.below(2);
        const Subset subset = search_subset(task);
        const Borders tight = borders_of(cells, subset.cells);
        for (int border = 0; border < 5; ++border) {
            // The cells strictly within one of the borders.
            std::uint64_t kept = 0;
            for (const std::uint32_t index : subset.cells) {
                const SeenCell& cell = cells[index];
                const std::array<bool, 5> inner = {
                    cell.near_depth > tight.near_depth,
                    cell.top<tight.top, cell.bottom> tight.bottom,
                    cell.right<tight.right, cell.left> tight.left};
                kept += inner[static_cast<std::size_t>(border)] ? cell.primitives : 0;
            }
            CAPTURE(run, border);
            REQUIRE(total - kept > target);
        }
    }
}

TEST_CASE("on a fine grid what is left is within a cell of the target in one direction") {
    // Cells one behind the other: a subset takes any number of them.
    for (const std::uint64_t target : {0U, 15U, 1234U, 5000U, 9989U}) {
        const std::vector<SeenCell> line = grid_cells(1, 1, 1000);
        const SubsetTask task = task_of(line, 10'000, target);
        const Subset subset = search_subset(task);
        check_subset(task, subset);
        CAPTURE(target, subset.primitives);
        CHECK(10'000 - subset.primitives + 10 > target);
        // What is far away is replaced.
        CHECK(subset.cells.back() == 999);
        CHECK(subset.cells.front() == 1000 - subset.cells.size());
    }
    for (const auto& [columns, rows] : {std::pair{1000U, 1U}, std::pair{1U, 1000U}}) {
        const std::vector<SeenCell> line = grid_cells(columns, rows, 1);
        const SubsetTask task = task_of(line, 10'000, 2345);
        const Subset subset = search_subset(task);
        check_subset(task, subset);
        CHECK(10'000 - subset.primitives + 10 > 2345);
    }
}

TEST_CASE("on a fine grid of three directions what is left is within a layer of the target") {
    const std::vector<SeenCell> cells = grid_cells(16, 16, 16);
    for (const std::uint64_t target : {4096U, 10'000U, 20'480U, 33'333U, 40'000U}) {
        const SubsetTask task = task_of(cells, 40'960, target);
        const Subset subset = search_subset(task);
        check_subset(task, subset);
        // The smallest of the layers at the borders of the subset does not fit: its cells are at
        // most as many as those of a face of a cube of as many cells.
        const double left = static_cast<double>(40'960 - subset.primitives);
        const double replaced = static_cast<double>(subset.primitives) / 10.0;
        const double layer = 10.0 * std::pow(replaced, 2.0 / 3.0);
        CAPTURE(target, left, layer);
        CHECK(left + layer > static_cast<double>(target));
    }
}

TEST_CASE("weights say whether far or small images are better") {
    const std::vector<SeenCell> cells = grid_cells(8, 1, 8);
    SubsetTask task = task_of(cells, 640, 320);
    task.model_extent = 9.0;
    task.weights = {.cost = 0.0, .benefit = 1.0, .size = 0.0, .depth = 1.0};
    const Subset deep = search_subset(task);
    check_subset(task, deep);
    const Borders far_away = borders_of(cells, deep.cells);
    CHECK(far_away.near_depth == 5.0);
    CHECK(far_away.left == -1.0);
    CHECK(far_away.right == 1.0);
    task.weights = {.cost = 0.0, .benefit = 1.0, .size = 1.0, .depth = 0.0};
    const Subset small = search_subset(task);
    check_subset(task, small);
    const Borders narrow = borders_of(cells, small.cells);
    CHECK(narrow.near_depth == 1.0);
    CHECK(narrow.right - narrow.left == Approx(1.0));
}

TEST_CASE("what sticks out of the screen makes no image larger") {
    // Of two cells side by side one reaches far beyond the screen, so that less of it is seen than
    // of the other.
    const SeenCell inner{-0.5, 0.5, -0.5, 0.5, 10.0, 50};
    for (int side = 0; side < 4; ++side) {
        SeenCell outer = inner;
        switch (side) {
        case 0:
            outer.left = -9.0;
            outer.right = -0.5;
            break;
        case 1:
            outer.left = 0.5;
            outer.right = 9.0;
            break;
        case 2:
            outer.bottom = -9.0;
            outer.top = -0.5;
            break;
        default:
            outer.bottom = 0.5;
            outer.top = 9.0;
            break;
        }
        CAPTURE(side);
        const std::vector<SeenCell> cells = {outer, inner};
        SubsetTask task = task_of(cells, 100, 50);
        task.lens = {-1.0, 1.0, -1.0, 1.0, 0.1, 1e4};
        // The side that is measured here is the longer one.
        task.width = side < 2 ? 4800 : 480;
        task.height = side < 2 ? 480 : 4800;
        CHECK(search_subset(task).cells == std::vector<std::uint32_t>{0});
    }
}

TEST_CASE("of borders that are equally good the top moves before the bottom, right before left") {
    const std::vector<SeenCell> beside = {
        {-0.5, 0.0, -0.25, 0.25, 10.0, 50}, {0.0, 0.5, -0.25, 0.25, 10.0, 50}};
    CHECK(search_subset(task_of(beside, 100, 50)).cells == std::vector<std::uint32_t>{0});
    const std::vector<SeenCell> above = {
        {-0.25, 0.25, -0.5, 0.0, 10.0, 50}, {-0.25, 0.25, 0.0, 0.5, 10.0, 50}};
    CHECK(search_subset(task_of(above, 100, 50)).cells == std::vector<std::uint32_t>{0});
}

TEST_CASE("looking ahead finds better subsets on the whole") {
    Random random(5);
    std::size_t different = 0;
    std::array<double, 3> benefit{};
    for (int run = 0; run < 200; ++run) {
        const std::vector<SeenCell> cells = random_cells(random, 60);
        const std::uint64_t total = sum_of(cells);
        SubsetTask task = task_of(cells, total, total / 2);
        std::array<Subset, 3> subsets;
        for (std::uint32_t steps = 1; steps <= 3; ++steps) {
            task.lookahead = steps;
            subsets[steps - 1] = search_subset(task);
            benefit[steps - 1] += benefit_of(task, subsets[steps - 1]);
        }
        different += subsets[0].cells != subsets[1].cells ? 1U : 0U;
    }
    CAPTURE(benefit[0], benefit[1], benefit[2]);
    CHECK(different > 3);
    CHECK(benefit[1] > benefit[0]);
    CHECK(benefit[2] > benefit[0]);
}
