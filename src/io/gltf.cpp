// glTF 2.0 through tinygltf, which parses and believes: every index, offset and size is checked
// here before it is used, and what it does recursively or without looking is refused beforehand.
#include "io/raw_mesh.hpp"
#include "io/readers.hpp"
#include "io/text.hpp"
#include "io/textures.hpp"

#include <glm/ext/matrix_double4x4.hpp>
#include <glm/ext/quaternion_double.hpp>
#include <glm/gtc/quaternion.hpp>
#include <nlohmann/json.hpp>
#include <tiny_gltf.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

namespace farfield::io {
namespace {

/// Deepest nesting of brackets; what tinygltf keeps of unknown members it reads recursively.
constexpr std::size_t kMaxJsonDepth = 128;
/// Deepest way from a root to a node.
constexpr std::size_t kMaxNodeDepth = 1024;
/// Decoded geometry may be this many times as large as the files. Honest files need up to 16 (bytes
/// that become floats); more only where primitives share what they are made of.
constexpr std::uint64_t kMaxUnfolding = 64;

constexpr std::uint32_t kJsonChunk = 0x4E4F534AU;
constexpr std::uint32_t kBinaryChunk = 0x004E4942U;

std::uint32_t number_at(std::string_view bytes, std::size_t position) noexcept {
    std::uint32_t value = 0;
    for (std::size_t i = 4; i-- > 0;) {
        value = value << 8U | static_cast<unsigned char>(bytes[position + i]);
    }
    return value;
}

std::string numbered(const char* what, std::size_t index) {
    return std::string(what) + ' ' + std::to_string(index);
}

/// Checks the frame of a GLB; returns its JSON.
Result<std::string_view> split_glb(const Input& input) {
    const std::string_view bytes = input.bytes;
    const auto bad = [&input](const std::string& message) {
        return fail(ErrorCode::bad_data, input.name + ": " + message);
    };
    if (bytes.size() < 20 || bytes.substr(0, 4) != "glTF") {
        return bad("not a binary glTF");
    }
    if (number_at(bytes, 4) != 2) {
        return fail(
            ErrorCode::unsupported,
            input.name + ": binary glTF version " + std::to_string(number_at(bytes, 4))
        );
    }
    const std::uint64_t length = number_at(bytes, 8);
    if (length > bytes.size()) {
        return bad(
            "the header announces " + std::to_string(length) + " bytes of " +
            std::to_string(bytes.size())
        );
    }
    const std::uint64_t json_length = number_at(bytes, 12);
    if (number_at(bytes, 16) != kJsonChunk || 20 + json_length > length) {
        return bad("the JSON chunk has " + std::to_string(json_length) + " bytes");
    }
    const std::uint64_t next = 20 + json_length;
    if (next + 8 <= length) {
        const std::uint64_t binary_length = number_at(bytes, next);
        if (number_at(bytes, next + 4) == kBinaryChunk && next + 8 + binary_length > length) {
            return bad("the binary chunk has " + std::to_string(binary_length) + " bytes");
        }
    }
    return bytes.substr(20, json_length);
}

/// Deepest nesting of brackets outside strings.
std::size_t json_depth(std::string_view json) noexcept {
    std::size_t depth = 0;
    std::size_t deepest = 0;
    bool in_string = false;
    for (std::size_t i = 0; i < json.size(); ++i) {
        const char c = json[i];
        if (in_string) {
            i += c == '\\' ? 1U : 0U;
            in_string = c != '"';
        } else if (c == '"') {
            in_string = true;
        } else if (c == '[' || c == '{') {
            deepest = std::max(deepest, ++depth);
        } else if ((c == ']' || c == '}') && depth > 0) {
            --depth;
        }
    }
    return deepest;
}

/// What tinygltf would do at a price before anybody can look at its result.
Result<void> check_json(const Input& input, std::string_view json_text) {
    const auto bad = [&input](const std::string& message) {
        return fail(ErrorCode::bad_data, input.name + ": " + message);
    };
    if (const std::size_t depth = json_depth(json_text); depth > kMaxJsonDepth) {
        return bad("brackets are nested " + std::to_string(depth) + " deep");
    }
    const auto json = nlohmann::json::parse(json_text, nullptr, false);
    if (!json.is_object()) {
        return bad("not JSON");
    }
    std::size_t inside = 0; // buffers that are the binary chunk, each of which becomes a copy
    if (const auto buffers = json.find("buffers"); buffers != json.end() && buffers->is_array()) {
        for (const auto& buffer : *buffers) {
            inside += buffer.is_object() && !buffer.contains("uri") ? 1U : 0U;
        }
    }
    if (inside > 1) {
        return bad(std::to_string(inside) + " buffers have no uri, one may");
    }
    if (const auto required = json.find("extensionsRequired");
        required != json.end() && required->is_array()) {
        for (const auto& extension : *required) {
            // Quantised attributes need nothing but what accessors do anyway.
            if (extension.is_string() && extension != "KHR_mesh_quantization") {
                return fail(
                    ErrorCode::unsupported,
                    input.name + " requires the extension " + quote(extension.get<std::string>())
                );
            }
        }
    }
    return {};
}

/// How tinygltf reads the files that a glTF names.
struct ExternalFiles {
    std::uint64_t max_bytes = 0; ///< of all together
    std::uint64_t bytes = 0;     ///< so far
};

bool file_exists(const std::string& path, void* /*user_data*/) {
    std::error_code ignored;
    return std::filesystem::is_regular_file(path, ignored);
}

std::string same_path(const std::string& path, void* /*user_data*/) {
    return path;
}

bool read_external(
    std::vector<unsigned char>* out, std::string* error, const std::string& path, void* user_data
) {
    auto& files = *static_cast<ExternalFiles*>(user_data);
    const auto bytes = read_file(path, files.max_bytes - files.bytes);
    if (!bytes) {
        *error += bytes.error().message;
        return false;
    }
    files.bytes += bytes->size();
    out->assign(bytes->begin(), bytes->end());
    return true;
}

/// Keeps what belongs to pictures outside of buffers and leaves the others where they are: they are
/// decoded when a material needs them, after their place has been checked.
bool keep_picture(
    tinygltf::Image* image,
    const int /*index*/,
    std::string* /*error*/,
    std::string* /*warning*/,
    int /*width*/,
    int /*height*/,
    const unsigned char* bytes,
    int size,
    void* /*user_data*/
) {
    if (image->bufferView < 0 && size > 0) {
        image->image.assign(bytes, bytes + size);
    }
    return true;
}

/// An accessor whose every element lies inside its buffer.
struct AccessorView {
    const unsigned char* data = nullptr;
    std::size_t count = 0;
    std::size_t stride = 0;
    int component_type = 0;
    int components = 0;
    bool normalized = false;
};

template <typename T>
T load_as(const unsigned char* from) noexcept {
    T value{};
    std::memcpy(&value, from, sizeof(T)); // files need not be aligned
    return value;
}

/// Component as a number; normalised integers as fractions.
double component(const AccessorView& view, std::size_t element, int index) noexcept {
    const auto size = static_cast<std::size_t>(
        tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(view.component_type))
    );
    const unsigned char* const from =
        view.data + element * view.stride + static_cast<std::size_t>(index) * size;
    const auto fraction = [&view](double value, double largest) {
        return view.normalized ? std::max(value / largest, -1.0) : value;
    };
    switch (view.component_type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
        return fraction(load_as<std::int8_t>(from), 127.0);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        return fraction(load_as<std::uint8_t>(from), 255.0);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
        return fraction(load_as<std::int16_t>(from), 32767.0);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        return fraction(load_as<std::uint16_t>(from), 65535.0);
    case TINYGLTF_COMPONENT_TYPE_INT:
        return load_as<std::int32_t>(from);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        return load_as<std::uint32_t>(from);
    case TINYGLTF_COMPONENT_TYPE_DOUBLE:
        return load_as<double>(from);
    default:
        return static_cast<double>(load_as<float>(from));
    }
}

/// Colours of a glTF are linear, ours are encoded.
double encode_srgb(double linear) noexcept {
    const double c = std::clamp(linear, 0.0, 1.0); // NaN stays NaN
    return c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1.0 / 2.4) - 0.055;
}

/// Accessors that make the vertices of a primitive; -1: none.
struct VertexAccessors {
    int position = -1;
    int normal = -1;
    int color = -1;
    int texcoord = -1;

    friend bool operator<(const VertexAccessors& a, const VertexAccessors& b) noexcept {
        return std::tie(a.position, a.normal, a.color, a.texcoord) <
               std::tie(b.position, b.normal, b.color, b.texcoord);
    }
};

int find_attribute(const tinygltf::Primitive& primitive, const std::string& name) {
    const auto found = primitive.attributes.find(name);
    return found == primitive.attributes.end() ? -1 : found->second;
}

class GltfReader {
  public:
    GltfReader(const Input& input, LoadedScene& loaded)
        : input_(input), loaded_(loaded), textures_(input, loaded) {}

    Result<void> read() {
        if (auto done = parse_file(); !done) {
            return done;
        }
        images_.assign(model_.images.size(), std::nullopt);
        for (std::size_t i = 0; i < model_.materials.size(); ++i) {
            add_material(model_.materials[i], i);
        }
        meshes_.assign(model_.meshes.size(), kNone<MeshId>);
        for (std::size_t i = 0; i < model_.meshes.size(); ++i) {
            if (auto done = add_mesh(i); !done) {
                return done;
            }
        }
        if (auto done = place_nodes(); !done) {
            return done;
        }
        report();
        if (loaded_.scene.instances.empty()) {
            return fail(ErrorCode::bad_data, input_.name + ": no triangles");
        }
        return {};
    }

  private:
    [[nodiscard]] tl::unexpected<Error> bad(const std::string& message) const {
        return fail(ErrorCode::bad_data, input_.name + ": " + message);
    }

    Result<void> parse_file() {
        const bool is_binary = input_.bytes.substr(0, 4) == "glTF";
        std::string_view json_text = input_.bytes;
        if (is_binary) {
            const auto split = split_glb(input_);
            if (!split) {
                return tl::unexpected(split.error());
            }
            json_text = *split;
        }
        if (input_.bytes.size() > UINT32_MAX) {
            return fail(ErrorCode::unsupported, input_.name + " is larger than 4 GiB");
        }
        if (auto done = check_json(input_, json_text); !done) {
            return done;
        }
        ExternalFiles external{input_.options.max_file_bytes};
        tinygltf::TinyGLTF parser;
        parser.SetFsCallbacks({file_exists, same_path, read_external, nullptr, &external});
        parser.SetImageLoader(keep_picture, nullptr);
        std::string error;
        std::string warning;
        const std::string folder = input_.folder.string();
        const auto length = static_cast<unsigned>(input_.bytes.size());
        const bool parsed = is_binary
                                ? parser.LoadBinaryFromMemory(
                                      &model_,
                                      &error,
                                      &warning,
                                      reinterpret_cast<const unsigned char*>(input_.bytes.data()),
                                      length,
                                      folder
                                  )
                                : parser.LoadASCIIFromString(
                                      &model_, &error, &warning, input_.bytes.data(), length, folder
                                  );
        if (!parsed) {
            return bad(one_line(error));
        }
        if (!warning.empty()) {
            loaded_.warnings.push_back(one_line(warning));
        }
        budget_bytes_ = kMaxUnfolding * (input_.bytes.size() + external.bytes) + (1U << 20U);
        return {};
    }

    static std::string one_line(std::string message) {
        while (!message.empty() && message.back() == '\n') {
            message.pop_back();
        }
        std::replace(message.begin(), message.end(), '\n', ' ');
        return message;
    }

    // Data

    /// The bytes of a buffer view.
    [[nodiscard]] Result<std::string_view> view_bytes(int index, const std::string& where) const {
        if (index < 0 || static_cast<std::size_t>(index) >= model_.bufferViews.size()) {
            return bad(
                where + " has buffer view " + std::to_string(index) + " of " +
                std::to_string(model_.bufferViews.size())
            );
        }
        const tinygltf::BufferView& view = model_.bufferViews[static_cast<std::size_t>(index)];
        if (view.buffer < 0 || static_cast<std::size_t>(view.buffer) >= model_.buffers.size()) {
            return bad(
                where + " has buffer " + std::to_string(view.buffer) + " of " +
                std::to_string(model_.buffers.size())
            );
        }
        const auto& data = model_.buffers[static_cast<std::size_t>(view.buffer)].data;
        if (view.byteOffset > data.size() || view.byteLength > data.size() - view.byteOffset) {
            return bad(
                where + ": buffer view " + std::to_string(index) + " takes " +
                std::to_string(view.byteLength) + " bytes from " + std::to_string(view.byteOffset) +
                " of a buffer of " + std::to_string(data.size())
            );
        }
        return std::string_view(
            reinterpret_cast<const char*>(data.data()) + view.byteOffset, view.byteLength
        );
    }

    [[nodiscard]] Result<AccessorView> view_accessor(int index, const std::string& where) const {
        if (index < 0 || static_cast<std::size_t>(index) >= model_.accessors.size()) {
            return bad(
                where + " is accessor " + std::to_string(index) + " of " +
                std::to_string(model_.accessors.size())
            );
        }
        const tinygltf::Accessor& accessor = model_.accessors[static_cast<std::size_t>(index)];
        if (accessor.sparse.isSparse || accessor.bufferView < 0) {
            return fail(
                ErrorCode::unsupported,
                input_.name + ": " + where + " is a sparse accessor, which is not read"
            );
        }
        const auto bytes = view_bytes(accessor.bufferView, where);
        if (!bytes) {
            return tl::unexpected(bytes.error());
        }
        const int component_size =
            tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor.componentType));
        const int components =
            tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type));
        if (component_size <= 0 || components <= 0) {
            return bad(
                where + " has component type " + std::to_string(accessor.componentType) +
                " and type " + std::to_string(accessor.type)
            );
        }
        AccessorView view;
        view.count = accessor.count;
        view.component_type = accessor.componentType;
        view.components = components;
        view.normalized = accessor.normalized;
        const auto element =
            static_cast<std::size_t>(component_size) * static_cast<std::size_t>(components);
        const std::size_t stride =
            model_.bufferViews[static_cast<std::size_t>(accessor.bufferView)].byteStride;
        view.stride = stride == 0 ? element : stride;
        // The last element may end before its stride does.
        const std::size_t length = bytes->size();
        const bool fits =
            view.stride >= element && accessor.byteOffset <= length &&
            (view.count == 0 ||
             (length - accessor.byteOffset >= element &&
              view.count - 1 <= (length - accessor.byteOffset - element) / view.stride));
        if (!fits) {
            return bad(
                where + " has " + std::to_string(view.count) + " elements of " +
                std::to_string(element) + " bytes, " + std::to_string(view.stride) +
                " apart, from " + std::to_string(accessor.byteOffset) + " of a buffer view of " +
                std::to_string(length) + " bytes"
            );
        }
        view.data = reinterpret_cast<const unsigned char*>(bytes->data()) + accessor.byteOffset;
        return view;
    }

    /// Counts memory against what files of this size may unfold to.
    Result<void> spend(std::uint64_t bytes, const std::string& where) {
        if (bytes > budget_bytes_) {
            return fail(
                ErrorCode::out_of_memory,
                input_.name + ": " + where + " unfolds to more than " +
                    std::to_string(kMaxUnfolding) + " times the size of the file"
            );
        }
        budget_bytes_ -= bytes;
        return {};
    }

    // Materials

    TextureId texture_of(const tinygltf::TextureInfo& info, std::size_t material) {
        if (info.index < 0) {
            return kNone<TextureId>;
        }
        const std::string where = numbered("material", material);
        const auto texture = static_cast<std::size_t>(info.index);
        if (texture >= model_.textures.size() || model_.textures[texture].source < 0 ||
            static_cast<std::size_t>(model_.textures[texture].source) >= model_.images.size()) {
            loaded_.warnings.push_back(
                where + " loses its texture, " + numbered("texture", texture) +
                " has no image that is read"
            );
            return kNone<TextureId>;
        }
        const auto image = static_cast<std::size_t>(model_.textures[texture].source);
        if (!images_[image]) {
            images_[image] = decode_image(image);
        }
        return *images_[image];
    }

    TextureId decode_image(std::size_t index) {
        tinygltf::Image& image = model_.images[index];
        const std::string where = input_.name + ": " + numbered("image", index);
        if (image.bufferView < 0) {
            const std::vector<unsigned char> bytes = std::move(image.image);
            return textures_.add(
                {reinterpret_cast<const char*>(bytes.data()), bytes.size()}, where
            );
        }
        const auto bytes = view_bytes(image.bufferView, numbered("image", index));
        return textures_.add(bytes ? *bytes : std::string_view{}, where);
    }

    void add_material(const tinygltf::Material& source, std::size_t index) {
        Material material;
        const auto& factor = source.pbrMetallicRoughness.baseColorFactor;
        for (std::size_t channel = 0; channel < 4 && factor.size() == 4; ++channel) {
            const double value =
                channel == 3 ? std::clamp(factor[channel], 0.0, 1.0) : encode_srgb(factor[channel]);
            material.base_color[static_cast<int>(channel)] = static_cast<float>(value);
        }
        material.texture = texture_of(source.pbrMetallicRoughness.baseColorTexture, index);
        if (source.alphaMode == "MASK") {
            material.alpha_cutoff = static_cast<float>(std::clamp(source.alphaCutoff, 0.0, 1.0));
        } else if (source.alphaMode == "BLEND") {
            material.alpha_cutoff = 0.5F;
            ++blended_materials_;
        }
        transformed_textures_ +=
            source.pbrMetallicRoughness.baseColorTexture.extensions.count("KHR_texture_transform");
        loaded_.scene.materials.push_back(material);
    }

    // Meshes

    Result<void> add_mesh(std::size_t index) {
        const tinygltf::Mesh& source = model_.meshes[index];
        Mesh mesh;
        mesh.name = source.name.empty() ? numbered("mesh", index) : source.name;
        first_vertices_.clear();
        for (std::size_t p = 0; p < source.primitives.size(); ++p) {
            const std::string where = numbered("mesh", index) + " primitive " + std::to_string(p);
            const int mode = source.primitives[p].mode;
            if (mode != -1 && mode != TINYGLTF_MODE_TRIANGLES &&
                mode != TINYGLTF_MODE_TRIANGLE_STRIP && mode != TINYGLTF_MODE_TRIANGLE_FAN) {
                ++other_primitives_;
                continue;
            }
            if (auto done = add_primitive(mesh, source.primitives[p], where); !done) {
                return done;
            }
        }
        if (mesh.indices.empty()) {
            return {};
        }
        drop_unused(mesh); // meshes may share the vertices of a whole file
        complete_normals(mesh);
        update_bounds(mesh);
        meshes_[index] = make_id<MeshId>(loaded_.scene.meshes.size());
        loaded_.scene.meshes.push_back(std::move(mesh));
        return {};
    }

    Result<void>
    add_primitive(Mesh& mesh, const tinygltf::Primitive& primitive, const std::string& where) {
        VertexAccessors accessors;
        accessors.position = find_attribute(primitive, "POSITION");
        accessors.normal = find_attribute(primitive, "NORMAL");
        accessors.color = find_attribute(primitive, "COLOR_0");
        MeshPart part;
        part.first_index = static_cast<std::uint32_t>(mesh.indices.size());
        int texcoord_set = 0;
        if (primitive.material >= 0) {
            if (static_cast<std::size_t>(primitive.material) >= model_.materials.size()) {
                return bad(
                    where + " has material " + std::to_string(primitive.material) + " of " +
                    std::to_string(model_.materials.size())
                );
            }
            part.material = make_id<MaterialId>(static_cast<std::size_t>(primitive.material));
            texcoord_set = model_.materials[static_cast<std::size_t>(primitive.material)]
                               .pbrMetallicRoughness.baseColorTexture.texCoord;
        }
        accessors.texcoord = find_attribute(primitive, "TEXCOORD_" + std::to_string(texcoord_set));

        std::size_t vertex_count = 0;
        const auto first_vertex = add_vertices(mesh, accessors, where, vertex_count);
        if (!first_vertex) {
            return tl::unexpected(first_vertex.error());
        }
        const auto corners = read_corners(primitive, where, vertex_count);
        if (!corners) {
            return tl::unexpected(corners.error());
        }
        if (auto done = add_triangles(mesh, primitive.mode, *corners, *first_vertex, where);
            !done) {
            return done;
        }
        part.index_count = static_cast<std::uint32_t>(mesh.indices.size()) - part.first_index;
        mesh.parts.push_back(part);
        return {};
    }

    /// Appends the vertices of a primitive, unless another one of the mesh has done so.
    /// @return the number of the first
    Result<std::uint32_t> add_vertices(
        Mesh& mesh, const VertexAccessors& accessors, const std::string& where, std::size_t& count
    ) {
        const auto positions = view_accessor(accessors.position, where + " POSITION");
        if (!positions) {
            return tl::unexpected(positions.error());
        }
        count = positions->count;
        if (const auto found = first_vertices_.find(accessors); found != first_vertices_.end()) {
            return found->second;
        }
        if (positions->components != 3) {
            return bad(
                where + " POSITION has " + std::to_string(positions->components) + " components"
            );
        }
        constexpr std::uint64_t kVertexBytes = sizeof(glm::vec3) * 2 + sizeof(glm::dvec3);
        if (auto done = spend(count * kVertexBytes, where); !done) {
            return tl::unexpected(done.error());
        }
        if (mesh.positions.size() + count >= UINT32_MAX) {
            return fail(
                ErrorCode::unsupported, input_.name + ": " + where + " has too many vertices"
            );
        }
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        for (std::size_t i = 0; i < count; ++i) {
            mesh.positions.emplace_back(
                component(*positions, i, 0),
                component(*positions, i, 1),
                component(*positions, i, 2)
            );
            const glm::vec3& position = mesh.positions.back();
            for (int axis = 0; axis < 3; ++axis) {
                if (!std::isfinite(position[axis])) {
                    return bad(
                        where + " POSITION " + std::to_string(i) + '[' + std::to_string(axis) +
                        "] is " + text(static_cast<double>(position[axis]))
                    );
                }
            }
        }
        if (auto done = add_normals(mesh, accessors.normal, where, count); !done) {
            return tl::unexpected(done.error());
        }
        if (auto done = add_colors(mesh, accessors.color, where, count); !done) {
            return tl::unexpected(done.error());
        }
        if (auto done = add_texcoords(mesh, accessors.texcoord, where, count); !done) {
            return tl::unexpected(done.error());
        }
        first_vertices_.emplace(accessors, first);
        return first;
    }

    /// An attribute beside the positions: as many elements, `least` to `most` components.
    [[nodiscard]] Result<AccessorView> view_attribute(
        int accessor, const std::string& where, std::size_t count, int least, int most
    ) const {
        auto view = view_accessor(accessor, where);
        if (view && (view->count != count || view->components < least || view->components > most)) {
            return bad(
                where + " has " + std::to_string(view->count) + " elements of " +
                std::to_string(view->components) + " components for " + std::to_string(count) +
                " positions"
            );
        }
        return view;
    }

    Result<void>
    add_normals(Mesh& mesh, int accessor, const std::string& where, std::size_t count) {
        if (accessor < 0) {
            mesh.normals.resize(mesh.positions.size(), glm::vec3(0.0F)); // computed at the end
            return {};
        }
        const auto view = view_attribute(accessor, where + " NORMAL", count, 3, 3);
        if (!view) {
            return tl::unexpected(view.error());
        }
        for (std::size_t i = 0; i < count; ++i) {
            mesh.normals.emplace_back(
                component(*view, i, 0), component(*view, i, 1), component(*view, i, 2)
            );
        }
        return {};
    }

    Result<void> add_colors(Mesh& mesh, int accessor, const std::string& where, std::size_t count) {
        const std::size_t before = mesh.positions.size() - count;
        if (accessor < 0) {
            if (!mesh.colors.empty()) {
                mesh.colors.resize(mesh.positions.size(), glm::u8vec4(255));
            }
            return {};
        }
        const auto view = view_attribute(accessor, where + " COLOR_0", count, 3, 4);
        if (!view) {
            return tl::unexpected(view.error());
        }
        mesh.colors.resize(before, glm::u8vec4(255));
        for (std::size_t i = 0; i < count; ++i) {
            glm::dvec4 color(1.0);
            for (int channel = 0; channel < view->components; ++channel) {
                const double value = component(*view, i, channel);
                color[channel] = channel == 3 ? value : encode_srgb(value);
            }
            if (std::isnan(color.r + color.g + color.b + color.a)) {
                ++invalid_colors_;
                color = glm::dvec4(1.0);
            }
            mesh.colors.emplace_back(
                to_byte(color.r), to_byte(color.g), to_byte(color.b), to_byte(color.a)
            );
        }
        return {};
    }

    Result<void>
    add_texcoords(Mesh& mesh, int accessor, const std::string& where, std::size_t count) {
        const std::size_t before = mesh.positions.size() - count;
        if (accessor < 0) {
            if (!mesh.texcoords.empty()) {
                mesh.texcoords.resize(mesh.positions.size(), glm::vec2(0.0F));
            }
            return {};
        }
        const auto view = view_attribute(accessor, where + " TEXCOORD", count, 2, 2);
        if (!view) {
            return tl::unexpected(view.error());
        }
        mesh.texcoords.resize(before, glm::vec2(0.0F));
        for (std::size_t i = 0; i < count; ++i) {
            const glm::vec2 texcoord(component(*view, i, 0), component(*view, i, 1));
            if (!std::isfinite(texcoord.x) || !std::isfinite(texcoord.y)) {
                return bad(where + " TEXCOORD " + std::to_string(i) + " is not finite");
            }
            mesh.texcoords.push_back(texcoord);
        }
        return {};
    }

    /// The vertex of each corner; 0, 1, 2 ... where there are no indices.
    Result<std::vector<std::uint32_t>> read_corners(
        const tinygltf::Primitive& primitive, const std::string& where, std::size_t vertex_count
    ) {
        AccessorView view;
        view.count = vertex_count;
        if (primitive.indices >= 0) {
            const auto found = view_accessor(primitive.indices, where + " indices");
            if (!found) {
                return tl::unexpected(found.error());
            }
            view = *found;
            const bool whole = view.component_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE ||
                               view.component_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
                               view.component_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
            if (view.components != 1 || !whole) {
                return bad(
                    where + " indices have component type " + std::to_string(view.component_type)
                );
            }
            view.normalized = false;
        }
        // Three corners a vertex where a strip or fan becomes triangles.
        if (auto done = spend(view.count * 4 * sizeof(std::uint32_t), where); !done) {
            return tl::unexpected(done.error());
        }
        std::vector<std::uint32_t> corners(view.count);
        for (std::size_t i = 0; i < view.count; ++i) {
            corners[i] = primitive.indices < 0 ? static_cast<std::uint32_t>(i)
                                               : static_cast<std::uint32_t>(component(view, i, 0));
            if (corners[i] >= vertex_count) {
                return bad(
                    where + ": index " + std::to_string(i) + " is " + std::to_string(corners[i]) +
                    " of " + std::to_string(vertex_count) + " vertices"
                );
            }
        }
        return corners;
    }

    Result<void> add_triangles(
        Mesh& mesh,
        int mode,
        const std::vector<std::uint32_t>& corners,
        std::uint32_t first,
        const std::string& where
    ) const {
        if (mesh.indices.size() + 3 * corners.size() >= UINT32_MAX) {
            return fail(
                ErrorCode::unsupported, input_.name + ": " + where + " has too many triangles"
            );
        }
        if (mode == TINYGLTF_MODE_TRIANGLE_FAN) {
            append_fan(mesh.indices, corners.size(), [&](std::size_t k) {
                return first + corners[k];
            });
            return {};
        }
        if (mode == TINYGLTF_MODE_TRIANGLE_STRIP) {
            for (std::size_t k = 2; k < corners.size(); ++k) {
                const std::size_t odd = k % 2; // every other triangle is turned around
                mesh.indices.insert(
                    mesh.indices.end(),
                    {first + corners[k - 2], first + corners[k - 1 + odd], first + corners[k - odd]}
                );
            }
            return {};
        }
        if (corners.size() % 3 != 0) {
            return bad(
                where + " has " + std::to_string(corners.size()) + " corners, not a multiple of 3"
            );
        }
        for (const std::uint32_t corner : corners) {
            mesh.indices.push_back(first + corner);
        }
        return {};
    }

    // Nodes

    struct Visit {
        int node = 0;
        std::size_t depth = 0;
        glm::dmat4 parent_to_world{1.0};
    };

    static glm::dmat4 local_transform(const tinygltf::Node& node) {
        glm::dmat4 local(1.0);
        if (node.matrix.size() == 16) {
            for (std::size_t i = 0; i < 16; ++i) {
                local[static_cast<int>(i / 4)][static_cast<int>(i % 4)] = node.matrix[i];
            }
            return local;
        }
        if (node.rotation.size() == 4) {
            const auto& r = node.rotation;
            const glm::dquat rotation(r[3], r[0], r[1], r[2]);
            const double length = glm::length(rotation);
            if (length > 0.0) {
                local = glm::mat4_cast(rotation / length);
            }
        }
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const int i = static_cast<int>(axis);
            if (node.scale.size() == 3) {
                local[i] *= node.scale[axis];
            }
            if (node.translation.size() == 3) {
                local[3][i] = node.translation[axis];
            }
        }
        return local;
    }

    /// Nodes of the scene to show: the default one, else the first, else all without a parent.
    [[nodiscard]] std::vector<int> root_nodes() const {
        const std::size_t shown =
            model_.defaultScene >= 0 ? static_cast<std::size_t>(model_.defaultScene) : 0;
        if (shown < model_.scenes.size()) {
            return model_.scenes[shown].nodes;
        }
        std::vector<bool> has_parent(model_.nodes.size(), false);
        for (const tinygltf::Node& node : model_.nodes) {
            for (const int child : node.children) {
                if (child >= 0 && static_cast<std::size_t>(child) < has_parent.size()) {
                    has_parent[static_cast<std::size_t>(child)] = true;
                }
            }
        }
        std::vector<int> roots;
        for (std::size_t i = 0; i < has_parent.size(); ++i) {
            if (!has_parent[i]) {
                roots.push_back(static_cast<int>(i));
            }
        }
        return roots;
    }

    /// Every node once, parents before children, in the file's order.
    Result<void> place_nodes() {
        std::vector<bool> visited(model_.nodes.size(), false);
        std::vector<Visit> open;
        std::vector<int> roots = root_nodes();
        std::reverse(roots.begin(), roots.end());
        open.reserve(roots.size());
        for (const int root : roots) {
            open.push_back({root});
        }
        while (!open.empty()) {
            const Visit visit = open.back();
            open.pop_back();
            if (visit.node < 0 || static_cast<std::size_t>(visit.node) >= model_.nodes.size()) {
                return bad(
                    "node " + std::to_string(visit.node) + " of " +
                    std::to_string(model_.nodes.size()) + " is a child or a root"
                );
            }
            const auto index = static_cast<std::size_t>(visit.node);
            if (visited[index]) {
                return bad(
                    numbered("node", index) +
                    " is reached twice: nodes make a cycle or share a child"
                );
            }
            visited[index] = true;
            if (visit.depth > kMaxNodeDepth) {
                return bad(
                    numbered("node", index) + " is more than " + std::to_string(kMaxNodeDepth) +
                    " levels deep"
                );
            }
            const tinygltf::Node& node = model_.nodes[index];
            const glm::dmat4 to_world = visit.parent_to_world * local_transform(node);
            if (auto done = place_mesh(node.mesh, to_world, index); !done) {
                return done;
            }
            for (auto child = node.children.rbegin(); child != node.children.rend(); ++child) {
                open.push_back({*child, visit.depth + 1, to_world});
            }
        }
        return {};
    }

    Result<void> place_mesh(int mesh, const glm::dmat4& to_world, std::size_t node) {
        if (mesh < 0) {
            return {};
        }
        if (static_cast<std::size_t>(mesh) >= meshes_.size()) {
            return bad(
                numbered("node", node) + " has mesh " + std::to_string(mesh) + " of " +
                std::to_string(meshes_.size())
            );
        }
        const MeshId id = meshes_[static_cast<std::size_t>(mesh)];
        if (id != kNone<MeshId>) {
            loaded_.scene.instances.push_back({id, glm::dmat4x3(to_world)});
        }
        return {};
    }

    void report() {
        const auto count = [this](std::size_t number, const char* sentence) {
            if (number != 0) {
                loaded_.warnings.push_back(std::to_string(number) + sentence);
            }
        };
        count(
            blended_materials_,
            " materials have alpha mode BLEND and are drawn as masks with cutoff 0.5"
        );
        count(other_primitives_, " primitives are points or lines and are left out");
        count(invalid_colors_, " vertex colours are not numbers and became white");
        count(transformed_textures_, " materials lose the transform of their texture");
        count(model_.skins.size(), " skins are left out, their meshes keep their rest pose");
        count(model_.animations.size(), " animations are left out");
    }

    const Input& input_;
    LoadedScene& loaded_;
    TextureStore textures_;
    tinygltf::Model model_;
    std::uint64_t budget_bytes_ = 0;
    std::vector<std::optional<TextureId>> images_; ///< decoded ones
    std::vector<MeshId> meshes_;                   ///< ours of each of the file; none: no triangles
    std::map<VertexAccessors, std::uint32_t> first_vertices_; ///< of the current mesh
    std::size_t blended_materials_ = 0;
    std::size_t other_primitives_ = 0;
    std::size_t invalid_colors_ = 0;
    std::size_t transformed_textures_ = 0;
};

} // namespace

Result<void> read_gltf(const Input& input, LoadedScene& loaded) {
    return GltfReader(input, loaded).read();
}

} // namespace farfield::io
