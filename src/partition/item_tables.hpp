#pragma once

#include <farfield/partition/hierarchy.hpp>

#include <span>

namespace farfield::partition::detail {

/// Fills what is kept of every whole item, `item_boxes`, `item_primitives` and `item_places`, from
/// the objects: the last step of every builder, once `items` is complete.
/// @pre `items` are objects of the span, each once
void fill_item_tables(Hierarchy& hierarchy, std::span<const Object> objects);

} // namespace farfield::partition::detail
