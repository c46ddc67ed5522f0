// STL, text and binary. Both repeat every corner; equal corners become one vertex again.
#include "io/raw_mesh.hpp"
#include "io/readers.hpp"
#include "io/text.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <unordered_map>
#include <utility>

namespace farfield::io {
namespace {

constexpr std::size_t kHeaderBytes = 84;
constexpr std::size_t kFacetBytes = 50;

struct HashPosition {
    std::size_t operator()(const glm::dvec3& p) const noexcept {
        std::uint64_t hash = 0;
        for (int axis = 0; axis < 3; ++axis) {
            hash = (hash ^ std::bit_cast<std::uint64_t>(p[axis])) * 0x9E3779B97F4A7C15ULL;
            hash ^= hash >> 32U;
        }
        return static_cast<std::size_t>(hash);
    }
};

class Welder {
  public:
    void add(const glm::dvec3& corner) {
        const glm::dvec3 key = corner + 0.0; // -0 and 0 are one place but two bit patterns
        const auto [entry, added] =
            numbers_.emplace(key, static_cast<std::uint32_t>(raw_.positions.size()));
        if (added) {
            raw_.positions.push_back(key);
        }
        raw_.indices.push_back(entry->second);
    }

    RawMesh take() { return std::move(raw_); }

  private:
    RawMesh raw_;
    std::unordered_map<glm::dvec3, std::uint32_t, HashPosition> numbers_;
};

std::uint32_t little_endian(std::string_view bytes, std::size_t position) noexcept {
    std::uint32_t value = 0;
    for (std::size_t i = 4; i-- > 0;) {
        value = value << 8U | static_cast<unsigned char>(bytes[position + i]);
    }
    return value;
}

Result<void> read_binary(const Input& input, std::uint64_t facets, Welder& welder) {
    for (std::size_t facet = 0; facet < facets; ++facet) {
        // A facet is a normal, three corners and two bytes that mean nothing.
        const std::size_t first = kHeaderBytes + facet * kFacetBytes + 12;
        for (std::size_t k = 0; k < 3; ++k) {
            glm::dvec3 corner(0.0);
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const auto value = static_cast<double>(
                    std::bit_cast<float>(little_endian(input.bytes, first + 12 * k + 4 * axis))
                );
                if (!std::isfinite(value)) {
                    return fail(
                        ErrorCode::bad_data,
                        input.name + ": a vertex coordinate of facet " + std::to_string(facet) +
                            " is " + text(value)
                    );
                }
                corner[static_cast<int>(axis)] = value;
            }
            welder.add(corner);
        }
    }
    return {};
}

Result<void> read_text(const Input& input, Welder& welder) {
    Scanner scanner(input.bytes, {});
    std::size_t corners = 0; // of the facet that is open
    for (; !scanner.at_end(); scanner.next_line()) {
        const std::string keyword = lower_case(scanner.word_in_line());
        if (keyword == "solid" || keyword == "endsolid") {
            continue; // a name follows, which may contain anything
        }
        if (keyword == "vertex") {
            glm::dvec3 corner(0.0);
            for (int axis = 0; axis < 3; ++axis) {
                const std::string_view word = scanner.word_in_line();
                if (!parse(word, corner[axis]) || !std::isfinite(corner[axis])) {
                    return fail_at(
                        input.name, scanner.line(), "a vertex coordinate is " + quote(word)
                    );
                }
            }
            welder.add(corner);
            ++corners;
        } else if (keyword == "facet" || keyword == "endfacet") {
            if (corners != (keyword == "facet" ? 0U : 3U)) {
                return fail_at(
                    input.name,
                    scanner.line(),
                    "a facet has " + std::to_string(corners) + " vertices instead of 3"
                );
            }
            corners = 0;
        } else if (!keyword.empty() && keyword != "outer" && keyword != "endloop") {
            return fail_at(input.name, scanner.line(), quote(keyword) + " is no word of STL");
        }
    }
    if (corners != 0) {
        return fail_at(input.name, scanner.line(), "the file ends in a facet");
    }
    return {};
}

} // namespace

Result<void> read_stl(const Input& input, LoadedScene& loaded) {
    const bool has_header = input.bytes.size() >= kHeaderBytes;
    const std::uint64_t facets = has_header ? little_endian(input.bytes, kHeaderBytes - 4) : 0;
    const std::uint64_t announced = kHeaderBytes + kFacetBytes * facets;
    // Binary files may begin with "solid" too; their length gives them away.
    const bool is_text = lower_case(input.bytes.substr(0, 5)) == "solid" &&
                         !(has_header && announced == input.bytes.size());
    Welder welder;
    if (is_text) {
        if (auto done = read_text(input, welder); !done) {
            return done;
        }
    } else {
        if (!has_header || announced > input.bytes.size()) {
            return fail(
                ErrorCode::bad_data,
                input.name + " announces " + std::to_string(facets) + " facets and has " +
                    std::to_string(input.bytes.size()) + " bytes instead of " +
                    std::to_string(announced)
            );
        }
        if (auto done = read_binary(input, facets, welder); !done) {
            return done;
        }
    }
    auto mesh = finish_mesh(welder.take(), input.name);
    if (!mesh) {
        return tl::unexpected(std::move(mesh.error()));
    }
    loaded.scene.meshes.push_back(std::move(*mesh));
    loaded.scene.instances.push_back({MeshId{0}});
    return {};
}

} // namespace farfield::io
