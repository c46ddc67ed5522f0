#include "partition/checks.hpp"

#include <array>
#include <cstdio>

namespace farfield::partition::detail {

std::string text(double value) {
    std::array<char, 32> buffer{};
    std::snprintf(buffer.data(), buffer.size(), "%.9g", value);
    return buffer.data();
}

Result<void> check_objects(std::span<const Object> objects, const PrimitiveShape& shape) {
    const bool callable =
        std::visit([](const auto& callback) { return static_cast<bool>(callback); }, shape);
    constexpr std::uint64_t kMaxObjects = UINT32_MAX - 1ULL;
    if (objects.size() > kMaxObjects) {
        return fail(
            ErrorCode::unsupported,
            "objects: " + std::to_string(objects.size()) + " of them, expected at most " +
                std::to_string(kMaxObjects)
        );
    }
    std::uint64_t total = 0;
    std::uint64_t split_total = 0;
    for (std::size_t index = 0; index < objects.size(); ++index) {
        const Object& object = objects[index];
        const auto name = [index] { return "object " + std::to_string(index); };
        if (auto checked = check_box(object.bounds, [&] { return name() + ": bounds"; });
            !checked) {
            return checked;
        }
        if (object.primitives > UINT64_MAX - total) {
            return fail(
                ErrorCode::unsupported,
                name() + ": primitives is " + std::to_string(object.primitives) +
                    ", with those of the objects before it more than 2^64 - 1"
            );
        }
        total += object.primitives;
        if (!object.splittable || object.primitives == 0) {
            continue;
        }
        if (object.primitives > UINT32_MAX - split_total) {
            return fail(
                ErrorCode::unsupported,
                name() + ": primitives is " + std::to_string(object.primitives) +
                    ", with those of the splittable objects before it more than 2^32 - 1"
            );
        }
        split_total += object.primitives;
        if (!callable) {
            return fail(
                ErrorCode::invalid_argument,
                name() + ": splittable is true, expected a callback for its primitives with it"
            );
        }
    }
    return {};
}

} // namespace farfield::partition::detail
