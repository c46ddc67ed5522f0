#include "technique/geometry_pass.hpp"
#include "technique/plan_writer.hpp"
#include <farfield/math/frustum.hpp>
#include <farfield/metric/pixel_conversion.hpp>
#include <farfield/partition/changes.hpp>
#include <farfield/technique/mesh_lod.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>
#include <utility>

namespace farfield {

namespace {

constexpr std::uint32_t kMostLevels = 255;

std::string text(double value) {
    std::array<char, 32> buffer{};
    std::snprintf(buffer.data(), buffer.size(), "%.9g", value);
    return buffer.data();
}

Result<void> check_item(const LodTable& table, std::size_t index) {
    const LodItem& item = table.items[index];
    const std::string name = "level table: item " + std::to_string(index);
    const auto bad = [&](const std::string& what) {
        return fail(ErrorCode::bad_data, name + what);
    };
    if (item.level_count > kMostLevels) {
        return bad(
            " has " + std::to_string(item.level_count) + " levels, expected at most " +
            std::to_string(kMostLevels)
        );
    }
    if (std::uint64_t{item.first_level} + item.level_count > table.levels.size()) {
        return bad(
            ": levels " + std::to_string(item.first_level) + " to " +
            std::to_string(std::uint64_t{item.first_level} + item.level_count) + " of " +
            std::to_string(table.levels.size())
        );
    }
    if (item.level_count > 0 && (!is_finite(item.bounds) || is_empty(item.bounds))) {
        return bad(": bounds are empty or not finite");
    }
    float least_error = 0.0F;
    std::uint64_t most_primitives = item.primitives;
    for (std::uint32_t k = 0; k < item.level_count; ++k) {
        const ItemLevel& level = table.levels[item.first_level + k];
        const std::string level_name = ", level " + std::to_string(k + 1);
        if (level.item == kNone<ItemId>) {
            return bad(level_name + ": item is none");
        }
        if (!std::isfinite(level.error_m) || !(level.error_m >= least_error)) {
            return bad(
                level_name + ": error_m is " + text(double{level.error_m}) +
                ", expected a finite number of at least " + text(double{least_error})
            );
        }
        if (level.primitives >= most_primitives) {
            return bad(
                level_name + ": primitives is " + std::to_string(level.primitives) +
                ", expected less than " + std::to_string(most_primitives)
            );
        }
        least_error = level.error_m;
        most_primitives = level.primitives;
    }
    return {};
}

Result<void> check_options(const MeshLodOptions& options) {
    if (!(options.error_px > 0.0) || !std::isfinite(options.error_px)) {
        return fail(
            ErrorCode::invalid_argument,
            "mesh lod: error_px is " + text(options.error_px) +
                ", expected a finite value above 0 pixels"
        );
    }
    if (!(options.hysteresis >= 0.0 && options.hysteresis < 1.0)) {
        return fail(
            ErrorCode::invalid_argument,
            "mesh lod: hysteresis is " + text(options.hysteresis) +
                ", expected at least 0 and less than 1"
        );
    }
    return {};
}

/// Largest error for each metre of distance.
double sine_of_threshold(const MeshLodOptions& options, const View& view) noexcept {
    const double angle = metric::angle_of_pixels(view, options.error_px, options.conversion);
    return std::sin(std::min(angle, std::numbers::pi / 2.0));
}

} // namespace

Result<void> validate(const LodTable& table) {
    for (std::size_t index = 0; index < table.items.size(); ++index) {
        if (Result<void> valid = check_item(table, index); !valid) {
            return valid;
        }
    }
    return {};
}

Result<MeshLod>
MeshLod::create(const Hierarchy& hierarchy, const LodTable& table, const MeshLodOptions& options) {
    if (Result<void> valid = check_options(options); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    if (hierarchy.nodes.empty()) {
        return fail(ErrorCode::invalid_argument, "mesh lod: the hierarchy has no nodes");
    }
    if (Result<void> valid = validate(table); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    const auto unknown = [&](ItemId item) {
        return item != kNone<ItemId> && index_of(item) >= table.items.size();
    };
    std::vector<ItemId> items = hierarchy.items;
    for (const MovingItem& moving : hierarchy.moving) {
        items.push_back(moving.item);
    }
    if (const auto found = std::find_if(items.begin(), items.end(), unknown);
        found != items.end()) {
        return fail(
            ErrorCode::invalid_argument,
            "mesh lod: the hierarchy holds item " + std::to_string(index_of(*found)) +
                ", the table " + std::to_string(table.items.size()) +
                " items; levels do not belong into the hierarchy"
        );
    }
    return MeshLod(hierarchy, table, options);
}

MeshLod::MeshLod(const Hierarchy& hierarchy, const LodTable& table, const MeshLodOptions& options)
    : hierarchy_(&hierarchy), options_(options), built_version_(hierarchy.nodes[0].content_version),
      levels_(table.levels) {
    items_.reserve(table.items.size());
    built_boxes_.reserve(table.items.size());
    std::size_t most_levels = 0;
    for (const LodItem& from : table.items) {
        Item item;
        if (from.level_count > 0) {
            item.box = local_box(from.bounds, hierarchy.origin);
        }
        item.first_level = from.first_level;
        item.level_count = static_cast<std::uint8_t>(from.level_count);
        item.primitives = from.primitives;
        built_boxes_.push_back(partition::item_box(hierarchy, make_id<ItemId>(items_.size())));
        items_.push_back(item);
        most_levels = std::max<std::size_t>(most_levels, from.level_count);
    }
    items_per_level_.resize(most_levels + 1);
}

Box3f MeshLod::box_of(ItemId id) const noexcept {
    if (moved_) {
        const Box3f now = partition::item_box(*hierarchy_, id);
        if (now != built_boxes_[index_of(id)]) {
            return now;
        }
    }
    return items_[index_of(id)].box;
}

std::uint8_t MeshLod::coarsest(const Item& item, double error_m) const noexcept {
    std::uint8_t level = 0;
    while (level < item.level_count && double{levels_[item.first_level + level].error_m} <= error_m
    ) {
        ++level;
    }
    return level;
}

void MeshLod::replace(ItemId& id, const glm::dvec3& eye, double sine) noexcept {
    Item& item = items_[index_of(id)];
    if (item.level_count > 0) {
        const Box3f around = box_of(id);
        // In double: the box was rounded outwards, so the distance is never too large.
        const Box3d box{glm::dvec3(around.lo), glm::dvec3(around.hi)};
        const double error_m = distance(box, eye) * sine;
        const std::uint8_t most = coarsest(item, error_m);
        const std::uint8_t least = coarsest(item, error_m * (1.0 - options_.hysteresis));
        item.level = std::clamp(item.level, least, most);
    }
    ++items_per_level_[item.level];
    statistics_.full_triangles += item.primitives;
    if (item.level == 0) {
        statistics_.triangles += item.primitives;
        return;
    }
    const ItemLevel& level = levels_[item.first_level + item.level - 1U];
    statistics_.triangles += level.primitives;
    id = level.item;
}

const FramePlan& MeshLod::plan(const View& view) noexcept {
    // Nothing leaves its place without the root's counting up; only what moved at first does.
    moved_ = moved_ || !hierarchy_->moving.empty() ||
             hierarchy_->nodes[0].content_version != built_version_;
    clear(plan_);
    plan_.origin = hierarchy_->origin;
    PlanWriter writer(plan_, *hierarchy_);
    writer.open();
    write_geometry(
        *hierarchy_,
        make_frustum(view, hierarchy_->origin),
        local_point(view.eye, hierarchy_->origin),
        options_.order,
        writer
    );
    writer.close(frame_pass(view, 0));

    statistics_ = {};
    std::fill(items_per_level_.begin(), items_per_level_.end(), 0U);
    const glm::dvec3 eye = view.eye - hierarchy_->origin;
    const double sine = sine_of_threshold(options_, view);
    for (ItemId& item : plan_.items) {
        replace(item, eye, sine);
    }
    for (const Piece& piece : plan_.pieces) {
        statistics_.triangles += piece.count;
        statistics_.full_triangles += piece.count;
    }
    return plan_;
}

} // namespace farfield
