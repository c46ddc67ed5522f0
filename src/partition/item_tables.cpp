#include "partition/item_tables.hpp"

#include <cstdint>

namespace farfield::partition::detail {

void fill_item_tables(Hierarchy& hierarchy, std::span<const Object> objects) {
    const std::size_t items = hierarchy.items.size();
    hierarchy.item_boxes.resize(items);
    hierarchy.item_primitives.resize(items);
    hierarchy.item_places.assign(objects.size(), Hierarchy::kNoPlace);
    for (std::size_t place = 0; place < items; ++place) {
        const std::size_t item = index_of(hierarchy.items[place]);
        hierarchy.item_boxes[place] = local_box(objects[item].bounds, hierarchy.origin);
        hierarchy.item_primitives[place] = objects[item].primitives;
        hierarchy.item_places[item] = static_cast<std::uint32_t>(place);
    }
}

} // namespace farfield::partition::detail
