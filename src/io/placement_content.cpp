#include "io/placement_content.hpp"

#include "io/binary.hpp"

#include <cstddef>
#include <vector>

namespace farfield::io {
namespace {

static_assert(sizeof(Lens) == 48 && sizeof(View) == 152 && sizeof(Box3d) == 48);
static_assert(sizeof(Box3f) == 24 && sizeof(PlacementWeights<double>) == 32);
static_assert(sizeof(PlacementNode) == 12);

/// Elements without gaps are their own field.
bool visit_fields(auto& value, const auto& visit) {
    return visit(value);
}

// Elements with gaps, field by field: the same list for writing and reading.
template <typename T, typename As>
concept Either = std::is_same_v<std::remove_const_t<T>, As>;

template <Either<PlacementCell> Cell>
bool visit_fields(Cell& cell, const auto& visit) {
    return visit(cell.node, cell.box, cell.primitives);
}

template <Either<PlacementSite> Site>
bool visit_fields(Site& site, const auto& visit) {
    return visit(site.eyes, site.level, site.first_range, site.range_count);
}

template <Either<PlacementRange> Range>
bool visit_fields(Range& range, const auto& visit) {
    return visit(range.yaw, range.image, range.primitives);
}

template <Either<PlacedImage> Image>
bool visit_fields(Image& image, const auto& visit) {
    return visit(
        image.site,
        image.view,
        image.near_depth,
        image.far_depth,
        image.primitives,
        image.first_cell,
        image.cell_count
    );
}

/// All but the arrays. @pre target_primitives is there
template <Either<PlacementMap> Map>
bool visit_fields(Map& map, const auto& visit) {
    auto& options = map.options;
    auto& quality = map.quality;
    return visit(
        options.max_primitives,
        *options.target_primitives,
        options.lens,
        options.width,
        options.height,
        options.texels_per_pixel,
        options.max_pitch,
        options.up,
        options.eyes,
        options.first_grid,
        options.max_level,
        options.cell_depth,
        options.clearance,
        options.lookahead,
        options.weights,
        map.origin,
        map.model_digest,
        map.primitives,
        map.grid,
        map.spacing,
        quality.views,
        quality.level,
        quality.worst,
        quality.worst_before,
        quality.miss
    );
}

/// Calls `each(name, array)` for all arrays, until one fails.
template <Either<PlacementMap> Map>
bool visit_arrays(Map& map, const auto& each) {
    return each("cells", map.cells) && each("nodes", map.nodes) && each("sites", map.sites) &&
           each("ranges", map.ranges) && each("images", map.images) &&
           each("replaced cells", map.replaced);
}

template <typename T>
bool take_array(ByteReader& reader, std::vector<T>& array) {
    std::uint64_t count = 0;
    bool is_whole = reader.take(count);
    const auto take = [&](auto&... fields) { return (reader.take(fields) && ...); };
    // One by one: what a damaged number announces is not there.
    for (std::uint64_t i = 0; is_whole && i < count; ++i) {
        is_whole = visit_fields(array.emplace_back(), take);
    }
    return is_whole;
}

} // namespace

std::string placement_content(const PlacementMap& map) {
    std::string bytes;
    const auto put = [&](const auto&... fields) {
        (append(bytes, fields), ...);
        return true;
    };
    visit_fields(map, put);
    visit_arrays(map, [&](const char* /*name*/, const auto& array) {
        append(bytes, std::uint64_t{array.size()});
        for (const auto& element : array) {
            visit_fields(element, put);
        }
        return true;
    });
    return bytes;
}

std::optional<std::string> take_placement_content(std::string_view content, PlacementMap& map) {
    ByteReader reader(content);
    map.options.target_primitives.emplace();
    const auto take = [&](auto&... fields) { return (reader.take(fields) && ...); };
    if (!visit_fields(map, take)) {
        return "ends after " + std::to_string(content.size()) + " bytes";
    }
    const char* in = nullptr;
    const auto take_all = [&](const char* name, auto& array) {
        in = name;
        return take_array(reader, array);
    };
    if (!visit_arrays(map, take_all)) {
        return std::string("ends in its ") + in;
    }
    if (reader.left() != 0) {
        return "has " + std::to_string(reader.left()) + " bytes too many";
    }
    if (const Result<void> valid = validate(map); !valid) {
        return "is wrong: " + valid.error().message;
    }
    return std::nullopt;
}

} // namespace farfield::io
