#include "picture_checks.hpp"
#include <farfield/eval/item_agreement.hpp>

#include <algorithm>
#include <cstddef>

namespace farfield::eval {

namespace {

ItemId item_at(const PositionPicture& picture, int x, int y) noexcept {
    const auto row = static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width);
    return picture.texels[row + static_cast<std::size_t>(x)].item;
}

bool settled(const PositionPicture& picture, int x, int y) noexcept {
    const ItemId item = item_at(picture, x, y);
    for (int v = std::max(y - 1, 0); v <= std::min(y + 1, picture.height - 1); ++v) {
        for (int u = std::max(x - 1, 0); u <= std::min(x + 1, picture.width - 1); ++u) {
            if (item_at(picture, u, v) != item) {
                return false;
            }
        }
    }
    return true;
}

} // namespace

Result<ItemAgreement> compare_items(const PositionPicture& a, const PositionPicture& b) {
    if (auto checked = detail::check_pair("first picture", a, "second picture", b); !checked) {
        return tl::unexpected(checked.error());
    }
    ItemAgreement result;
    for (int y = 0; y < a.height; ++y) {
        for (int x = 0; x < a.width; ++x) {
            const ItemId item_a = item_at(a, x, y);
            const ItemId item_b = item_at(b, x, y);
            if (item_a == kNone<ItemId> && item_b == kNone<ItemId>) {
                continue;
            }
            ++result.pixels;
            if (settled(a, x, y) && settled(b, x, y)) {
                ++result.settled_pixels;
                result.equal_pixels += item_a == item_b ? 1 : 0;
            }
        }
    }
    if (result.pixels != 0) {
        result.settled_fraction =
            static_cast<double>(result.settled_pixels) / static_cast<double>(result.pixels);
    }
    if (result.settled_pixels != 0) {
        result.equal_fraction =
            static_cast<double>(result.equal_pixels) / static_cast<double>(result.settled_pixels);
    }
    return result;
}

} // namespace farfield::eval
