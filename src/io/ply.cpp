// PLY in double precision: text, little and big endian; any elements in any order.
#include "io/raw_mesh.hpp"
#include "io/readers.hpp"
#include "io/text.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

namespace farfield::io {
namespace {

enum class Format : std::uint8_t { text, little_endian, big_endian };

enum class Type : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

struct TypeName {
    const char* name;
    const char* alias;
    std::size_t bytes;
};

/// In the order of `Type`.
constexpr std::array<TypeName, 8> kTypes = {{
    {"char", "int8", 1},
    {"uchar", "uint8", 1},
    {"short", "int16", 2},
    {"ushort", "uint16", 2},
    {"int", "int32", 4},
    {"uint", "uint32", 4},
    {"float", "float32", 4},
    {"double", "float64", 8},
}};

std::size_t bytes_of(Type type) noexcept {
    return kTypes[static_cast<std::size_t>(type)].bytes;
}

bool parse(std::string_view word, Type& type) noexcept {
    for (std::size_t i = 0; i < kTypes.size(); ++i) {
        if (word == kTypes[i].name || word == kTypes[i].alias) {
            type = static_cast<Type>(i);
            return true;
        }
    }
    return false;
}

/// What a vertex property means to us; the value is a position in `VertexRow`.
enum class Role : std::uint8_t { x, y, z, nx, ny, nz, red, green, blue, alpha, u, v, none };
constexpr std::size_t kRoles = static_cast<std::size_t>(Role::none);
using VertexRow = std::array<double, kRoles>;

struct RoleName {
    const char* name;
    Role role;
};

constexpr std::array<RoleName, 21> kRoleNames = {{
    {"x", Role::x},
    {"y", Role::y},
    {"z", Role::z},
    {"nx", Role::nx},
    {"ny", Role::ny},
    {"nz", Role::nz},
    {"red", Role::red},
    {"green", Role::green},
    {"blue", Role::blue},
    {"alpha", Role::alpha},
    {"diffuse_red", Role::red},
    {"diffuse_green", Role::green},
    {"diffuse_blue", Role::blue},
    {"r", Role::red},
    {"g", Role::green},
    {"b", Role::blue},
    {"a", Role::alpha},
    {"s", Role::u},
    {"t", Role::v},
    {"texture_u", Role::u},
    {"texture_v", Role::v},
}};

Role role_of(std::string_view name) noexcept {
    if (name == "u" || name == "v") {
        return name == "u" ? Role::u : Role::v;
    }
    for (const RoleName& entry : kRoleNames) {
        if (name == entry.name) {
            return entry.role;
        }
    }
    return Role::none;
}

struct Property {
    std::string name;
    Type type = Type::float32;
    bool is_list = false;
    Type count_type = Type::uint8; ///< of a list
};

struct Element {
    std::string name;
    std::uint64_t count = 0;
    std::vector<Property> properties;
};

class PlyReader {
  public:
    PlyReader(const Input& input, LoadedScene& loaded)
        : input_(input), loaded_(loaded), scanner_(input.bytes, {}) {}

    Result<void> read() {
        if (auto done = read_header(); !done) {
            return done;
        }
        if (auto done = check_sizes(); !done) {
            return done;
        }
        for (const Element& element : elements_) {
            if (element.properties.empty()) {
                continue;
            }
            Result<void> done;
            if (element.name == "vertex") {
                done = read_vertices(element);
            } else if (element.name == "face") {
                done = read_faces(element);
            } else {
                done = skip(element);
            }
            if (!done) {
                return done;
            }
        }
        return finish();
    }

  private:
    [[nodiscard]] tl::unexpected<Error> bad(const std::string& message) const {
        if (format_ == Format::text || in_header_) {
            return fail_at(input_.name, scanner_.line(), message);
        }
        return fail(
            ErrorCode::bad_data,
            input_.name + ": byte " + std::to_string(position_) + ": " + message
        );
    }

    // Header

    Result<void> read_header() {
        if (scanner_.rest_of_line() != "ply" && input_.bytes.substr(0, 3) != "PLY") {
            return bad("the file does not begin with 'ply'");
        }
        bool has_format = false;
        for (;;) {
            scanner_.next_line();
            if (scanner_.at_end()) {
                return bad("the header has no end");
            }
            const std::string_view keyword = scanner_.word_in_line();
            if (keyword == "end_header") {
                break;
            }
            Result<void> done;
            if (keyword == "format") {
                has_format = true;
                done = read_format(scanner_.word_in_line());
            } else if (keyword == "element") {
                done = read_element();
            } else if (keyword == "property") {
                done = read_property();
            } else if (!keyword.empty() && keyword != "comment" && keyword != "obj_info") {
                done = bad(quote(keyword) + " is no word of a PLY header");
            }
            if (!done) {
                return done;
            }
        }
        if (!has_format) {
            return bad("the header names no format");
        }
        scanner_.next_line();
        position_ = input_.bytes.size() - scanner_.remaining();
        in_header_ = false;
        return {};
    }

    Result<void> read_format(std::string_view word) {
        if (word == "ascii") {
            format_ = Format::text;
        } else if (word == "binary_little_endian") {
            format_ = Format::little_endian;
        } else if (word == "binary_big_endian") {
            format_ = Format::big_endian;
        } else {
            return bad("the format is " + quote(word));
        }
        return {};
    }

    Result<void> read_element() {
        Element element;
        element.name = std::string(scanner_.word_in_line());
        const std::string_view word = scanner_.word_in_line();
        std::int64_t count = 0;
        if (!io::parse(word, count) || count < 0) {
            return bad("the number of " + quote(element.name) + " elements is " + quote(word));
        }
        if (element.name == "vertex" && std::exchange(has_vertices_, true)) {
            return bad("there are two elements of vertices");
        }
        element.count = static_cast<std::uint64_t>(count);
        elements_.push_back(std::move(element));
        return {};
    }

    Result<void> read_property() {
        if (elements_.empty()) {
            return bad("a property comes before the first element");
        }
        Property property;
        std::string_view word = scanner_.word_in_line();
        property.is_list = word == "list";
        if (property.is_list) {
            word = scanner_.word_in_line();
            if (!parse(word, property.count_type) || property.count_type >= Type::float32) {
                return bad("the count of a list has type " + quote(word));
            }
            word = scanner_.word_in_line();
        }
        if (!parse(word, property.type)) {
            return bad("a property has type " + quote(word));
        }
        property.name = std::string(scanner_.word_in_line());
        elements_.back().properties.push_back(std::move(property));
        return {};
    }

    /// Refuses counts that the rest of the file cannot hold, before anything is allocated for them.
    [[nodiscard]] Result<void> check_sizes() const {
        // The very last blank of a text may be missing.
        const std::uint64_t available =
            input_.bytes.size() - position_ + (format_ == Format::text ? 1U : 0U);
        std::uint64_t left = available;
        for (const Element& element : elements_) {
            std::uint64_t row = 0; // least bytes
            for (const Property& property : element.properties) {
                // A number of a text takes a digit and a blank; a list may be empty.
                row += format_ == Format::text ? 2U
                       : property.is_list      ? bytes_of(property.count_type)
                                               : bytes_of(property.type);
            }
            if (row != 0 && element.count > left / row) {
                return bad(
                    "the header announces " + std::to_string(element.count) + " elements " +
                    quote(element.name) + " of " + std::to_string(row) +
                    " bytes or more, the file ends after " + std::to_string(available)
                );
            }
            left -= row * element.count;
        }
        return {};
    }

    // Values

    Result<double> read_value(Type type, const char* what) {
        if (format_ == Format::text) {
            const std::string_view word = scanner_.word();
            double value = 0.0;
            if (word.empty()) {
                return bad(std::string("the file ends before ") + what);
            }
            if (!io::parse(word, value)) {
                return bad(std::string(what) + " is " + quote(word) + ", not a number");
            }
            return value;
        }
        const std::size_t size = bytes_of(type);
        if (input_.bytes.size() - position_ < size) {
            return bad(std::string("the file ends before ") + what);
        }
        std::uint64_t bits = 0;
        for (std::size_t i = 0; i < size; ++i) {
            const std::size_t place = format_ == Format::big_endian ? i : size - 1 - i;
            bits = bits << 8U | static_cast<unsigned char>(input_.bytes[position_ + place]);
        }
        position_ += size;
        return decoded(type, bits);
    }

    static double decoded(Type type, std::uint64_t bits) noexcept {
        switch (type) {
        case Type::int8:
            return static_cast<double>(static_cast<std::int8_t>(bits));
        case Type::int16:
            return static_cast<double>(static_cast<std::int16_t>(bits));
        case Type::int32:
            return static_cast<double>(static_cast<std::int32_t>(bits));
        case Type::float32:
            return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
        case Type::float64:
            return std::bit_cast<double>(bits);
        case Type::uint8:
        case Type::uint16:
        case Type::uint32:
            break;
        }
        return static_cast<double>(bits);
    }

    /// Count of a list; what the rest of the file cannot hold is refused.
    Result<std::uint64_t> read_count(const Property& property) {
        const auto value = read_value(property.count_type, "the length of a list");
        if (!value) {
            return tl::unexpected(value.error());
        }
        const std::uint64_t least = format_ == Format::text ? 2U : bytes_of(property.type);
        const std::uint64_t left =
            format_ == Format::text ? scanner_.remaining() + 1U : input_.bytes.size() - position_;
        if (!(*value >= 0.0) || *value != std::floor(*value)) {
            return bad("the length of list " + quote(property.name) + " is " + text(*value));
        }
        if (*value * static_cast<double>(least) > static_cast<double>(left)) {
            return bad(
                "list " + quote(property.name) + " announces " + text(*value) +
                " numbers, the file ends after " + std::to_string(left) + " bytes"
            );
        }
        return static_cast<std::uint64_t>(*value);
    }

    Result<void> skip_property(const Property& property) {
        std::uint64_t count = 1;
        if (property.is_list) {
            const auto length = read_count(property);
            if (!length) {
                return tl::unexpected(length.error());
            }
            count = *length;
        }
        for (std::uint64_t i = 0; i < count; ++i) {
            if (const auto value = read_value(property.type, "a property"); !value) {
                return tl::unexpected(value.error());
            }
        }
        return {};
    }

    Result<void> skip(const Element& element) {
        skipped_strips_ = skipped_strips_ || element.name == "tristrips";
        for (std::uint64_t i = 0; i < element.count; ++i) {
            for (const Property& property : element.properties) {
                if (auto done = skip_property(property); !done) {
                    return done;
                }
            }
        }
        return {};
    }

    // Elements

    Result<void> read_vertices(const Element& element) {
        std::vector<Role> roles;
        std::array<bool, kRoles> given{};
        for (const Property& property : element.properties) {
            Role role = property.is_list ? Role::none : role_of(property.name);
            if (role != Role::none && std::exchange(given[static_cast<std::size_t>(role)], true)) {
                role = Role::none; // a second one of the same meaning
            }
            roles.push_back(role);
        }
        const auto has = [&given](Role a, Role b, Role c) {
            return given[static_cast<std::size_t>(a)] && given[static_cast<std::size_t>(b)] &&
                   given[static_cast<std::size_t>(c)];
        };
        if (!has(Role::x, Role::y, Role::z)) {
            return fail(ErrorCode::bad_data, input_.name + ": vertices without x, y and z");
        }
        has_normals_ = has(Role::nx, Role::ny, Role::nz);
        has_colors_ = has(Role::red, Role::green, Role::blue);
        has_texcoords_ = has(Role::u, Role::v, Role::v);
        raw_.positions.reserve(element.count);
        VertexRow row{};
        for (std::uint64_t i = 0; i < element.count; ++i) {
            row[static_cast<std::size_t>(Role::alpha)] = 1.0;
            for (std::size_t p = 0; p < roles.size(); ++p) {
                const Property& property = element.properties[p];
                if (roles[p] == Role::none) {
                    if (auto done = skip_property(property); !done) {
                        return done;
                    }
                    continue;
                }
                const auto value = read_value(property.type, "a vertex property");
                if (!value) {
                    return tl::unexpected(value.error());
                }
                const bool is_color = roles[p] >= Role::red && roles[p] <= Role::alpha;
                row[static_cast<std::size_t>(roles[p])] =
                    is_color ? *value * color_scale(property.type) : *value;
            }
            if (auto done = append_vertex(row, i); !done) {
                return done;
            }
        }
        return {};
    }

    /// Integer colours use the whole range of their type.
    static double color_scale(Type type) noexcept {
        switch (type) {
        case Type::int8:
        case Type::uint8:
            return 1.0 / 255.0;
        case Type::int16:
        case Type::uint16:
            return 1.0 / 65535.0;
        case Type::int32:
        case Type::uint32:
            return 1.0 / 4294967295.0;
        case Type::float32:
        case Type::float64:
            break;
        }
        return 1.0;
    }

    Result<void> append_vertex(const VertexRow& row, std::uint64_t vertex) {
        const auto value = [&row](Role role) { return row[static_cast<std::size_t>(role)]; };
        const glm::dvec3 position(value(Role::x), value(Role::y), value(Role::z));
        constexpr std::array<char, 3> kAxis = {'x', 'y', 'z'};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double coordinate = position[static_cast<int>(axis)];
            if (!std::isfinite(coordinate)) {
                return bad(
                    "coordinate " + std::string(1, kAxis[axis]) + " of vertex " +
                    std::to_string(vertex) + " is " + text(coordinate)
                );
            }
        }
        raw_.positions.push_back(position);
        if (has_normals_) {
            raw_.normals.emplace_back(value(Role::nx), value(Role::ny), value(Role::nz));
        }
        if (has_texcoords_) {
            // The first row of texels is on top here and at the bottom there.
            raw_.texcoords.emplace_back(value(Role::u), 1.0 - value(Role::v));
            if (!std::isfinite(raw_.texcoords.back().x) ||
                !std::isfinite(raw_.texcoords.back().y)) {
                return bad(
                    "the texture coordinates of vertex " + std::to_string(vertex) + " are " +
                    text(value(Role::u)) + ' ' + text(value(Role::v))
                );
            }
        }
        if (has_colors_) {
            const glm::dvec4 color(
                value(Role::red), value(Role::green), value(Role::blue), value(Role::alpha)
            );
            glm::u8vec4 stored(255);
            if (std::isnan(color.r + color.g + color.b + color.a)) {
                ++invalid_colors_;
            } else {
                stored = {to_byte(color.r), to_byte(color.g), to_byte(color.b), to_byte(color.a)};
            }
            raw_.colors.push_back(stored);
        }
        return {};
    }

    Result<void> read_faces(const Element& element) {
        for (std::uint64_t face = 0; face < element.count; ++face) {
            for (const Property& property : element.properties) {
                const bool is_face = property.is_list && (property.name == "vertex_indices" ||
                                                          property.name == "vertex_index");
                auto done = is_face ? read_face(property, face) : skip_property(property);
                if (!done) {
                    return done;
                }
            }
        }
        return {};
    }

    Result<void> read_face(const Property& property, std::uint64_t face) {
        const auto count = read_count(property);
        if (!count) {
            return tl::unexpected(count.error());
        }
        if (*count < 3) {
            return bad(
                "face " + std::to_string(face) + " has " + std::to_string(*count) +
                " indices instead of 3 or more"
            );
        }
        corners_.clear();
        for (std::uint64_t k = 0; k < *count; ++k) {
            const auto index = read_value(property.type, "a face index");
            if (!index) {
                return tl::unexpected(index.error());
            }
            if (!(*index >= 0.0 && *index < UINT32_MAX) || *index != std::floor(*index)) {
                return bad("face " + std::to_string(face) + " has index " + text(*index));
            }
            corners_.push_back(static_cast<std::uint32_t>(*index));
            if (corners_.back() > largest_index_) {
                largest_index_ = corners_.back();
                largest_face_ = face;
            }
        }
        append_fan(raw_.indices, corners_.size(), [this](std::size_t k) { return corners_[k]; });
        return {};
    }

    Result<void> finish() {
        // Judged here, because faces may come before vertices.
        if (!raw_.indices.empty() && largest_index_ >= raw_.positions.size()) {
            return fail(
                ErrorCode::bad_data,
                input_.name + ": face " + std::to_string(largest_face_) + " has index " +
                    std::to_string(largest_index_) + " of " +
                    std::to_string(raw_.positions.size()) + " vertices"
            );
        }
        if (raw_.indices.empty() && skipped_strips_) {
            return fail(
                ErrorCode::unsupported, input_.name + ": triangle strips of PLY are not read"
            );
        }
        if (invalid_colors_ != 0) {
            loaded_.warnings.push_back(
                std::to_string(invalid_colors_) + " vertex colours are not numbers and became white"
            );
        }
        auto mesh = finish_mesh(std::move(raw_), input_.name);
        if (!mesh) {
            return tl::unexpected(std::move(mesh.error()));
        }
        loaded_.scene.meshes.push_back(std::move(*mesh));
        loaded_.scene.instances.push_back({MeshId{0}});
        return {};
    }

    const Input& input_;
    LoadedScene& loaded_;
    Scanner scanner_;
    std::size_t position_ = 0; ///< of binary data
    bool in_header_ = true;
    Format format_ = Format::text;
    std::vector<Element> elements_;
    bool has_vertices_ = false;
    bool has_normals_ = false;
    bool has_colors_ = false;
    bool has_texcoords_ = false;
    bool skipped_strips_ = false;
    RawMesh raw_;
    std::vector<std::uint32_t> corners_;
    std::uint32_t largest_index_ = 0;
    std::uint64_t largest_face_ = 0;
    std::size_t invalid_colors_ = 0;
};

} // namespace

Result<void> read_ply(const Input& input, LoadedScene& loaded) {
    return PlyReader(input, loaded).read();
}

} // namespace farfield::io
