// Wavefront OBJ in double precision, as it is met in the wild rather than as it was defined.
#include "io/raw_mesh.hpp"
#include "io/readers.hpp"
#include "io/text.hpp"
#include "io/textures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <unordered_map>
#include <utility>

namespace farfield::io {
namespace {

constexpr std::uint32_t kNoMaterial = UINT32_MAX;
constexpr std::int32_t kNotGiven = -1;

/// Positions in the arrays of v, vt and vn, from 0.
struct Corner {
    std::int32_t position = 0;
    std::int32_t texcoord = kNotGiven;
    std::int32_t normal = kNotGiven;

    friend bool operator==(const Corner&, const Corner&) = default;
};

struct HashCorner {
    std::size_t operator()(const Corner& corner) const noexcept {
        std::uint64_t hash = static_cast<std::uint32_t>(corner.position);
        hash = hash * 0x9E3779B97F4A7C15ULL + static_cast<std::uint32_t>(corner.texcoord);
        hash = hash * 0x9E3779B97F4A7C15ULL + static_cast<std::uint32_t>(corner.normal);
        return static_cast<std::size_t>(hash ^ (hash >> 29U));
    }
};

struct Polygon {
    std::uint32_t first = 0; ///< corner
    std::uint32_t count = 0;
    std::uint32_t material = kNoMaterial; ///< into the names of usemtl
};

/// The largest index that a file has used of one array. Elements may be used before they are
/// defined, so it is judged at the end.
struct LargestIndex {
    std::int64_t value = 0;
    std::size_t line = 0;
};

class ObjReader {
  public:
    ObjReader(const Input& input, LoadedScene& loaded)
        : input_(input), loaded_(loaded), textures_(input, loaded),
          scanner_(input.bytes, {'#', true}) {}

    Result<void> read() {
        for (; !scanner_.at_end(); scanner_.next_line()) {
            if (auto done = read_line(); !done) {
                return done;
            }
        }
        if (auto done = check_largest(); !done) {
            return done;
        }
        auto mesh = finish_mesh(build(), input_.name);
        if (!mesh) {
            return tl::unexpected(std::move(mesh.error()));
        }
        report();
        loaded_.scene.meshes.push_back(std::move(*mesh));
        loaded_.scene.instances.push_back({MeshId{0}});
        return {};
    }

  private:
    [[nodiscard]] tl::unexpected<Error> bad(const std::string& message) const {
        return fail_at(input_.name, line_, message);
    }

    Result<void> read_line() {
        const std::string_view keyword = scanner_.word_in_line();
        line_ = scanner_.line();
        if (keyword == "v") {
            return read_vertex();
        }
        if (keyword == "vt") {
            return read_texcoord();
        }
        if (keyword == "vn") {
            return read_normal();
        }
        if (keyword == "f" || keyword == "fo") {
            return read_face();
        }
        if (keyword == "usemtl") {
            material_ = material_number(std::string(scanner_.rest_of_line()));
        } else if (keyword == "mtllib") {
            read_libraries(scanner_.rest_of_line());
        } else if (keyword == "l" || keyword == "p") {
            ++lines_and_points_;
        } else if (keyword == "curv" || keyword == "surf") {
            ++free_forms_;
        }
        return {};
    }

    /// Reads up to `values.size()` numbers of this line, at least `needed`.
    template <std::size_t N>
    Result<std::size_t>
    read_numbers(const char* what, std::size_t needed, std::array<double, N>& values) {
        for (std::size_t i = 0; i < N; ++i) {
            const std::string_view word = scanner_.word_in_line();
            if (word.empty()) {
                if (i < needed) {
                    return bad(
                        std::string(what) + " has " + std::to_string(i) + " numbers instead of " +
                        std::to_string(needed)
                    );
                }
                return i;
            }
            if (!parse(word, values[i])) {
                return bad(std::string(what) + " has " + quote(word) + " where a number should be");
            }
        }
        return N;
    }

    Result<void> read_vertex() {
        std::array<double, 7> values{};
        const auto count = read_numbers("a vertex", 3, values);
        if (!count) {
            return tl::unexpected(count.error());
        }
        constexpr std::array<char, 3> kAxis = {'x', 'y', 'z'};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            if (!std::isfinite(values[axis])) {
                return bad(
                    std::string("vertex coordinate ") + kAxis[axis] + " is " + text(values[axis])
                );
            }
        }
        // Four numbers are a weight, which matters only to curves; six are a colour.
        if (*count >= 6 && colors_.empty()) {
            colors_.resize(positions_.size(), glm::u8vec4(255));
        }
        positions_.emplace_back(values[0], values[1], values[2]);
        if (!colors_.empty() || *count >= 6) {
            glm::u8vec4 color(255);
            if (*count >= 6) {
                if (std::isnan(values[3] + values[4] + values[5])) {
                    ++invalid_colors_;
                } else {
                    color = {to_byte(values[3]), to_byte(values[4]), to_byte(values[5]), 255};
                }
            }
            colors_.push_back(color);
        }
        return {};
    }

    Result<void> read_texcoord() {
        std::array<double, 2> values{};
        if (const auto count = read_numbers("a texture vertex", 1, values); !count) {
            return tl::unexpected(count.error());
        }
        // The first row of texels is on top here and at the bottom there.
        const glm::vec2 texcoord(
            static_cast<float>(values[0]), static_cast<float>(1.0 - values[1])
        );
        if (!std::isfinite(texcoord.x) || !std::isfinite(texcoord.y)) {
            return bad("a texture vertex is " + text(values[0]) + ' ' + text(values[1]));
        }
        texcoords_.push_back(texcoord);
        return {};
    }

    Result<void> read_normal() {
        std::array<double, 3> values{};
        if (const auto count = read_numbers("a vertex normal", 3, values); !count) {
            return tl::unexpected(count.error());
        }
        normals_.emplace_back(values[0], values[1], values[2]);
        return {};
    }

    /// One index of a corner: from 1, or backwards from -1.
    Result<std::int32_t> read_index(
        std::string_view word, const char* what, std::size_t defined, LargestIndex& largest
    ) const {
        std::int64_t index = 0;
        if (!parse(word, index)) {
            return bad(std::string(what) + " index is " + quote(word) + ", not a whole number");
        }
        if (index < 0) {
            index += static_cast<std::int64_t>(defined) + 1;
        }
        if (index < 1 || index > INT32_MAX) {
            return bad(
                std::string(what) + " index is " + quote(word) + ", outside the " +
                std::to_string(defined) + " so far"
            );
        }
        if (index > largest.value) {
            largest = {index, line_};
        }
        return static_cast<std::int32_t>(index - 1);
    }

    Result<Corner> read_corner(std::string_view word) {
        Corner corner;
        const std::size_t first = word.find('/');
        const auto position =
            read_index(word.substr(0, first), "vertex", positions_.size(), largest_position_);
        if (!position) {
            return tl::unexpected(position.error());
        }
        corner.position = *position;
        if (first == std::string_view::npos) {
            return corner;
        }
        word.remove_prefix(first + 1);
        const std::size_t second = word.find('/');
        if (const std::string_view part = word.substr(0, second); !part.empty()) {
            const auto texcoord =
                read_index(part, "texture vertex", texcoords_.size(), largest_texcoord_);
            if (!texcoord) {
                return tl::unexpected(texcoord.error());
            }
            corner.texcoord = *texcoord;
        }
        if (second == std::string_view::npos || second + 1 == word.size()) {
            return corner;
        }
        const auto normal =
            read_index(word.substr(second + 1), "vertex normal", normals_.size(), largest_normal_);
        if (!normal) {
            return tl::unexpected(normal.error());
        }
        corner.normal = *normal;
        return corner;
    }

    Result<void> read_face() {
        Polygon polygon{static_cast<std::uint32_t>(corners_.size()), 0, material_};
        for (;;) {
            const std::string_view word = scanner_.word_in_line();
            if (word.empty()) {
                break;
            }
            const auto corner = read_corner(word);
            if (!corner) {
                return tl::unexpected(corner.error());
            }
            corners_.push_back(*corner);
            ++polygon.count;
        }
        if (polygon.count < 3) {
            return bad(
                "a face has " + std::to_string(polygon.count) + " indices instead of 3 or more"
            );
        }
        if (corners_.size() >= UINT32_MAX) {
            return fail(ErrorCode::unsupported, input_.name + ": more than 2^32 corners of faces");
        }
        polygons_.push_back(polygon);
        return {};
    }

    Result<void> check_largest() {
        const auto check = [this](
                               const LargestIndex& largest, const char* what, std::size_t defined
                           ) -> Result<void> {
            if (largest.value > static_cast<std::int64_t>(defined)) {
                return fail_at(
                    input_.name,
                    largest.line,
                    std::string(what) + " index is " + std::to_string(largest.value) + " of " +
                        std::to_string(defined)
                );
            }
            return {};
        };
        if (auto done = check(largest_position_, "vertex", positions_.size()); !done) {
            return done;
        }
        if (auto done = check(largest_texcoord_, "texture vertex", texcoords_.size()); !done) {
            return done;
        }
        return check(largest_normal_, "vertex normal", normals_.size());
    }

    std::uint32_t material_number(const std::string& name) {
        const auto [entry, added] =
            used_materials_.emplace(name, static_cast<std::uint32_t>(used_materials_.size()));
        if (added) {
            used_names_.push_back(name);
        }
        return entry->second;
    }

    // Materials

    void read_libraries(std::string_view names) {
        // One name with blanks, or several names: whichever exists.
        std::error_code ignored;
        if (std::filesystem::is_regular_file(input_.folder / names, ignored)) {
            read_library(names);
            return;
        }
        Scanner words(names, {});
        for (auto word = words.word(); !word.empty(); word = words.word()) {
            read_library(word);
        }
    }

    void read_library(std::string_view name) {
        if (!libraries_.emplace(std::string(name), true).second) {
            return;
        }
        const std::filesystem::path path = input_.folder / name;
        const auto bytes = read_file(path, input_.options.max_file_bytes);
        if (!bytes) {
            loaded_.warnings.push_back("a material library is left out: " + bytes.error().message);
            return;
        }
        Scanner scanner(*bytes, {'#', false});
        Material* material = nullptr;
        for (; !scanner.at_end(); scanner.next_line()) {
            const std::string keyword = lower_case(scanner.word_in_line());
            if (keyword == "newmtl") {
                material = &materials_[std::string(scanner.rest_of_line())];
            } else if (material == nullptr) {
                continue;
            } else if (keyword == "kd") {
                for (int channel = 0; channel < 3; ++channel) {
                    read_fraction(scanner, material->base_color[channel]);
                }
            } else if (keyword == "d") {
                read_fraction(scanner, material->base_color.a);
            } else if (keyword == "tr") {
                float transparency = 0.0F;
                read_fraction(scanner, transparency);
                material->base_color.a = 1.0F - transparency;
            } else if (keyword == "map_kd") {
                material->texture = read_map(scanner.rest_of_line(), path.parent_path());
            }
        }
    }

    /// A number in [0, 1]; anything else leaves the value as it is.
    static void read_fraction(Scanner& scanner, float& value) {
        double read = 0.0;
        if (parse(scanner.word_in_line(), read) && !std::isnan(read)) {
            value = static_cast<float>(std::clamp(read, 0.0, 1.0));
        }
    }

    TextureId read_map(std::string_view value, const std::filesystem::path& folder) {
        if (value.substr(0, 1) == "-") { // options first, the name is the last word
            const std::size_t blank = value.find_last_of(" \t");
            value.remove_prefix(blank == std::string_view::npos ? value.size() : blank + 1);
        }
        std::string name(value);
        std::replace(name.begin(), name.end(), '\\', '/');
        return textures_.load(folder / name);
    }

    MaterialId add_material(const std::string& name) {
        const auto found = materials_.find(name);
        if (found == materials_.end()) {
            if (!name.empty()) {
                missing_materials_.push_back(name);
            }
            return kNone<MaterialId>;
        }
        Material material = found->second;
        const bool translucent =
            material.base_color.a < 1.0F ||
            (material.texture != kNone<TextureId> && textures_.has_alpha(material.texture));
        if (translucent) {
            material.alpha_cutoff = 0.5F;
            loaded_.warnings.push_back(
                "material " + quote(name) + " is translucent and drawn as a mask with cutoff 0.5"
            );
        }
        const auto id = make_id<MaterialId>(loaded_.scene.materials.size());
        loaded_.scene.materials.push_back(material);
        return id;
    }

    // Geometry

    RawMesh build() {
        RawMesh raw;
        // By material, within one in the file's order.
        std::stable_sort(
            polygons_.begin(),
            polygons_.end(),
            [](const Polygon& a, const Polygon& b) { return a.material < b.material; }
        );
        const std::vector<std::uint32_t> vertices = number_vertices(raw);
        std::uint32_t part_material = kNoMaterial;
        for (const Polygon& polygon : polygons_) {
            if (raw.parts.empty() || polygon.material != part_material) {
                part_material = polygon.material;
                const auto first = static_cast<std::uint32_t>(raw.indices.size());
                raw.parts.push_back(
                    {first,
                     0,
                     part_material == kNoMaterial ? kNone<MaterialId>
                                                  : add_material(used_names_[part_material])}
                );
            }
            append_fan(raw.indices, polygon.count, [&](std::size_t k) {
                return vertices[polygon.first + k];
            });
            raw.parts.back().index_count =
                static_cast<std::uint32_t>(raw.indices.size()) - raw.parts.back().first_index;
        }
        return raw;
    }

    /// A vertex for every combination of indices; fills the arrays of `raw`.
    /// @return the vertex of each corner
    std::vector<std::uint32_t> number_vertices(RawMesh& raw) {
        const bool plain = std::all_of(corners_.begin(), corners_.end(), [](const Corner& corner) {
            return corner.texcoord == kNotGiven && corner.normal == kNotGiven;
        });
        std::vector<std::uint32_t> vertices(corners_.size());
        if (plain) {
            for (std::size_t i = 0; i < corners_.size(); ++i) {
                vertices[i] = static_cast<std::uint32_t>(corners_[i].position);
            }
            raw.positions = std::move(positions_);
            raw.colors = std::move(colors_);
            return vertices;
        }
        std::unordered_map<Corner, std::uint32_t, HashCorner> numbers;
        numbers.reserve(positions_.size());
        for (std::size_t i = 0; i < corners_.size(); ++i) {
            const Corner& corner = corners_[i];
            const auto [entry, added] =
                numbers.emplace(corner, static_cast<std::uint32_t>(raw.positions.size()));
            vertices[i] = entry->second;
            if (added) {
                append_vertex(raw, corner);
            }
        }
        return vertices;
    }

    void append_vertex(RawMesh& raw, const Corner& corner) const {
        const auto position = static_cast<std::size_t>(corner.position);
        raw.positions.push_back(positions_[position]);
        if (!colors_.empty()) {
            raw.colors.push_back(colors_[position]);
        }
        if (!texcoords_.empty()) {
            raw.texcoords.push_back(
                corner.texcoord == kNotGiven ? glm::vec2(0.0F)
                                             : texcoords_[static_cast<std::size_t>(corner.texcoord)]
            );
        }
        if (!normals_.empty()) {
            raw.normals.push_back(
                corner.normal == kNotGiven ? glm::vec3(0.0F)
                                           : normals_[static_cast<std::size_t>(corner.normal)]
            );
        }
    }

    void report() {
        if (invalid_colors_ != 0) {
            loaded_.warnings.push_back(
                std::to_string(invalid_colors_) + " vertex colours are not numbers and became white"
            );
        }
        if (lines_and_points_ != 0) {
            loaded_.warnings.push_back(
                std::to_string(lines_and_points_) + " lines and points are left out"
            );
        }
        if (free_forms_ != 0) {
            loaded_.warnings.push_back(
                std::to_string(free_forms_) + " free-form curves and surfaces are left out"
            );
        }
        if (!missing_materials_.empty()) {
            loaded_.warnings.push_back(
                std::to_string(missing_materials_.size()) +
                " materials are in no library and became white, the first is " +
                quote(missing_materials_.front())
            );
        }
    }

    const Input& input_;
    LoadedScene& loaded_;
    TextureStore textures_;
    Scanner scanner_;
    std::size_t line_ = 1; ///< where the current statement began

    std::vector<glm::dvec3> positions_;
    std::vector<glm::u8vec4> colors_; ///< empty or as many as positions
    std::vector<glm::vec2> texcoords_;
    std::vector<glm::vec3> normals_;
    std::vector<Corner> corners_;
    std::vector<Polygon> polygons_;
    LargestIndex largest_position_;
    LargestIndex largest_texcoord_;
    LargestIndex largest_normal_;

    std::map<std::string, bool> libraries_; ///< by name, read or not found
    std::map<std::string, Material> materials_;
    std::map<std::string, std::uint32_t> used_materials_;
    std::vector<std::string> used_names_;
    std::uint32_t material_ = kNoMaterial;

    std::vector<std::string> missing_materials_;
    std::size_t invalid_colors_ = 0;
    std::size_t lines_and_points_ = 0;
    std::size_t free_forms_ = 0;
};

} // namespace

Result<void> read_obj(const Input& input, LoadedScene& loaded) {
    return ObjReader(input, loaded).read();
}

} // namespace farfield::io
