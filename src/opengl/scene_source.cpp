#include "opengl/program.hpp"
#include "opengl/projection_shaders.hpp"
#include "opengl/state_guard.hpp"
#include <farfield/core/assert.hpp>
#include <farfield/opengl/scene_source.hpp>

#include <epoxy/gl.h>
#include <glm/ext/matrix_double3x3.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace farfield::opengl {

namespace {

constexpr GLuint kPosition = 0;
constexpr GLuint kNormal = 1;
constexpr GLuint kColor = 2;
constexpr GLuint kTexcoord = 3;
constexpr GLuint kRows = 4;       // three rows of the object-to-camera transform
constexpr GLuint kNormalRows = 7; // three rows of the object-to-world transform of normals
constexpr GLuint kItem = 10;

constexpr GLuint kVertexBinding = 0;
constexpr GLuint kTexcoordBinding = 1;
constexpr GLuint kInstanceBinding = 2;

struct Vertex {
    glm::vec3 position{0.0F};
    std::uint32_t normal = 0; // 10 bits a component, signed
    glm::u8vec4 color{255};
};
static_assert(sizeof(Vertex) == 20);

struct InstanceData {
    std::array<glm::vec4, 3> rows{};
    std::array<glm::vec3, 3> normal_rows{};
    std::uint32_t item = 0;
};
static_assert(sizeof(InstanceData) == 88);

// Shading happens per vertex: it costs one interpolated value and no work per pixel, and the same
// shaders draw the geometry baseline.
std::string
vertex_shader(bool textured, bool clipped, bool positions, const ProjectionVariant* projection) {
    std::string text = "#version 450 core\n";
    if (clipped) {
        text += "out gl_PerVertex { vec4 gl_Position; float gl_ClipDistance[6]; };\n";
    }
    // Keyframes and own colours are drawn one after the other, at the same depths. A block that is
    // declared anew comes before anything that is said of what is in it.
    text += "invariant gl_Position;\n";
    text += R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 color;
layout(location = 4) in vec4 rows[3];
layout(location = 7) in vec3 normal_rows[3];
uniform mat4 projection;
uniform vec4 base_color;
uniform vec4 light; // direction towards it, and the ambient share
layout(location = 0) out vec4 shaded;
)";
    if (textured) {
        text += "layout(location = 3) in vec2 texcoord;\n"
                "layout(location = 1) out vec2 uv;\n";
    }
    if (clipped) {
        text += "uniform vec4 clip_planes[6];\n";
    }
    if (positions) {
        text += "layout(location = 10) in uint item;\n"
                "layout(location = 2) out vec3 shown_point;\n"
                "layout(location = 3) flat out uint shown_item;\n";
    }
    if (projection != nullptr) {
        text += projection_vertex_head(*projection, positions);
    }
    text += R"(
void main() {
    vec4 p = vec4(position, 1.0);
    vec4 camera = vec4(dot(rows[0], p), dot(rows[1], p), dot(rows[2], p), 1.0);
    gl_Position = projection * camera;
    vec3 n = vec3(dot(normal_rows[0], normal), dot(normal_rows[1], normal),
                  dot(normal_rows[2], normal));
    float lit = 0.5 + 0.5 * dot(normalize(n), light.xyz);
    shaded = vec4(color.rgb * base_color.rgb * (light.w + (1.0 - light.w) * lit),
                  color.a * base_color.a);
)";
    if (textured) {
        text += "    uv = texcoord;\n";
    }
    if (positions) {
        text += "    shown_point = position;\n    shown_item = item;\n";
    }
    if (projection != nullptr) {
        text += projection_vertex_body(*projection, positions);
    }
    if (clipped) {
        text += "    for (int i = 0; i < 6; ++i) {\n"
                "        gl_ClipDistance[i] = dot(clip_planes[i], camera);\n    }\n";
    }
    text += "}\n";
    return text;
}

enum class Surface : std::uint8_t { plain, textured, cutout };
constexpr std::size_t kSurfaces = 3;

std::string fragment_shader(Surface surface, bool positions, const ProjectionVariant* projection) {
    std::string text = "#version 450 core\n"
                       "layout(location = 0) in vec4 shaded;\n"
                       "layout(location = 0) out vec4 result;\n";
    if (surface != Surface::plain) {
        text += "layout(location = 1) in vec2 uv;\n"
                "layout(binding = 0) uniform sampler2D base_texture;\n";
    }
    if (surface == Surface::cutout) {
        text += "uniform float alpha_cutoff;\n";
    }
    if (positions) {
        text += "layout(location = 2) in vec3 shown_point;\n"
                "layout(location = 3) flat in uint shown_item;\n"
                "layout(location = 1) out uvec4 point;\n"
                "layout(location = 2) out uvec2 layer;\n";
    }
    if (projection != nullptr) {
        text += projection_fragment_head(*projection, positions);
    }
    text += "void main() {\n";
    if (surface == Surface::plain) {
        text += "    result = vec4(shaded.rgb, 1.0);\n";
    } else {
        text += "    vec4 color = shaded * texture(base_texture, uv);\n";
        if (surface == Surface::cutout) {
            text += "    if (color.a < alpha_cutoff) { discard; }\n";
        }
        text += "    result = vec4(color.rgb, 1.0);\n";
    }
    if (positions) {
        text += "    point = uvec4(floatBitsToUint(shown_point), shown_item);\n"
                "    layer = uvec2(0u, 0xFFFFFFFFu);\n";
    }
    if (projection != nullptr) {
        text += projection_fragment_body(*projection, positions);
    }
    text += "}\n";
    return text;
}

std::uint32_t pack_normal(const glm::vec3& normal) {
    std::uint32_t packed = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const float clamped = std::clamp(normal[axis], -1.0F, 1.0F);
        const auto value = static_cast<std::int32_t>(std::lround(clamped * 511.0F));
        packed |= (static_cast<std::uint32_t>(value) & 0x3FFU) << (10 * axis);
    }
    return packed;
}

struct Program {
    GLuint name = 0;
    GLint projection = -1;
    GLint base_color = -1;
    GLint light = -1;
    GLint clip_planes = -1;
    GLint alpha_cutoff = -1;
    ProjectionUniforms projection_uniforms; // of one that projects keyframes
};

/// By surface, and by what is asked for: clipping (1), positions (2).
using Programs = std::array<std::array<Program, 4>, kSurfaces>;

/// Which of a surface's programs draws. Those that project keyframes all clip: without a clip box
/// the distances are written and not looked at. That costs nothing beside projecting, and linking
/// half as many is time out of a frame.
constexpr std::size_t program_place(bool clipped, bool positions, bool projecting) {
    return (clipped || projecting ? 1U : 0U) + (positions ? 2U : 0U);
}

struct PartOnDevice {
    std::size_t index_offset = 0; // bytes into the index buffer
    GLsizei index_count = 0;
    std::uint32_t material = 0;
};

struct MeshOnDevice {
    glm::dvec3 origin{0.0};
    Box3d bounds;
    GLint base_vertex = 0;
    std::uint32_t first_part = 0;
    std::uint32_t part_count = 0;
    std::size_t first_index = 0; // into the index buffer
};

/// Selected primitives of one item that are of one part of its mesh: one draw.
struct SelectedRun {
    std::uint32_t part = 0;
    std::uint32_t instance = 0;
    std::size_t first_index = 0; // into the buffer of selected indices
    GLsizei index_count = 0;
    GLint base_vertex = 0;
};

struct MaterialOnDevice {
    glm::vec4 base_color{1.0F};
    GLuint texture = 0;
    float alpha_cutoff = 0.0F;
    Surface surface = Surface::plain;
};

GLuint upload(const void* data, std::size_t bytes) {
    GLuint buffer = 0;
    glCreateBuffers(1, &buffer);
    // A buffer of no bytes is an error; an empty scene has one.
    glNamedBufferStorage(
        buffer,
        static_cast<GLsizeiptr>(std::max<std::size_t>(bytes, 4)),
        bytes == 0 ? nullptr : data,
        0
    );
    return buffer;
}

} // namespace

struct SceneSource::Impl {
    std::vector<MeshOnDevice> meshes;
    std::vector<PartOnDevice> parts;
    std::vector<MaterialOnDevice> materials;
    std::array<bool, kSurfaces> surfaces{}; // those that there are
    std::vector<GLuint> textures;
    std::vector<Instance> instances;
    DirectionalLight light;

    Programs programs;
    std::array<Programs, ProjectionVariant::kCount> projecting; // those that were prepared
    GLuint vertices = 0;
    GLuint texcoords = 0;
    GLuint indices = 0;
    GLuint split_indices = 0; // of `Hierarchy::primitives`, in that order
    GLuint selected_indices = 0;
    std::size_t selected_capacity = 0;
    std::size_t index_count = 0; // of all meshes
    GLuint instance_buffer = 0;
    std::size_t instance_capacity = 0;
    GLuint plain_array = 0;    // vertex array without texture coordinates
    GLuint textured_array = 0; // with them
    std::uint64_t bytes = 0;

    // Scratch of one draw: items by mesh, their transforms, and the runs of split primitives.
    std::vector<std::uint32_t> mesh_count;
    std::vector<std::uint32_t> touched;
    std::vector<InstanceData> data;
    // Runs of pieces of one item: indices of each, the bytes before them, the base vertex.
    std::vector<GLsizei> piece_counts;
    std::vector<const void*> piece_offsets;
    std::vector<GLint> piece_vertices;
    // Selected primitives.
    std::vector<std::uint32_t> kept_indices;     // those of `indices`, from the first selection on
    std::vector<std::uint32_t> gathered_indices; // of selected primitives
    std::vector<SelectedRun> selected_runs;
    // What the device has now, within one draw.
    const Program* current = nullptr;
    std::uint32_t current_material = UINT32_MAX;
    bool showing_keyframes = false;

    Impl() = default;
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;
    ~Impl() {
        delete_programs(programs);
        for (const Programs& variant : projecting) {
            delete_programs(variant);
        }
        const std::array<GLuint, 6> buffers = {
            vertices, texcoords, indices, split_indices, selected_indices, instance_buffer};
        glDeleteBuffers(static_cast<GLsizei>(buffers.size()), buffers.data());
        glDeleteVertexArrays(1, &plain_array);
        glDeleteVertexArrays(1, &textured_array);
        glDeleteTextures(static_cast<GLsizei>(textures.size()), textures.data());
    }

    static void delete_programs(const Programs& programs) noexcept;
    Result<void> make_programs(bool positions, const ProjectionVariant* projection);
    Result<void> upload_textures(const Scene& scene);
    void add_materials(const Scene& scene);
    void upload_meshes(const Scene& scene);
    void upload_split(const Scene& scene, const Hierarchy& hierarchy);
    void make_arrays();

    [[nodiscard]] InstanceData instance_data(ItemId item, const View& view) const noexcept;
    void reserve_instances(std::size_t count) noexcept;
    void gather_selections(const DrawList& list, std::uint32_t first_instance) noexcept;
    void gather_part(
        const MeshOnDevice& mesh, std::uint32_t part, std::span<const std::uint32_t> primitives
    ) noexcept;
    std::size_t gather_runs(
        std::span<const Piece> pieces, std::size_t first, const MeshOnDevice& mesh
    ) noexcept;
    void draw_runs(std::uint32_t instance) noexcept;
    void draw_items(const PassContext& context) noexcept;
    void draw_pieces(const DrawList& list, const PassContext& context) noexcept;
    void draw_selections(const PassContext& context) noexcept;
    void use_material(std::uint32_t material, const PassContext& context) noexcept;
};

void SceneSource::Impl::delete_programs(const Programs& programs) noexcept {
    for (const auto& by_clip : programs) {
        for (const Program& program : by_clip) {
            glDeleteProgram(program.name);
        }
    }
}

/// Makes those of the scene's surfaces that are not there.
Result<void> SceneSource::Impl::make_programs(bool positions, const ProjectionVariant* projection) {
    Programs& made = projection == nullptr ? programs : projecting[projection->place()];
    for (std::size_t surface = 0; surface < kSurfaces; ++surface) {
        for (const bool clipped : {false, true}) {
            const bool projects = projection != nullptr;
            Program& program = made[surface][program_place(clipped, positions, projects)];
            if (program.name != 0 || !surfaces[surface]) {
                continue;
            }
            const bool clips = clipped || projects;
            const auto kind = static_cast<Surface>(surface);
            const bool textured = kind != Surface::plain;
            const Result<GLuint> linked = link_program(
                "scene source",
                vertex_shader(textured, clips, positions, projection),
                fragment_shader(kind, positions, projection),
                projects ? projection_geometry_shader(*projection, textured, clips, positions) : ""
            );
            if (!linked) {
                return tl::unexpected(linked.error());
            }
            program.name = *linked;
            program.projection = glGetUniformLocation(program.name, "projection");
            program.base_color = glGetUniformLocation(program.name, "base_color");
            program.light = glGetUniformLocation(program.name, "light");
            program.clip_planes = glGetUniformLocation(program.name, "clip_planes");
            program.alpha_cutoff = glGetUniformLocation(program.name, "alpha_cutoff");
            if (projects) {
                program.projection_uniforms = ProjectionUniforms::of(*linked);
            }
        }
    }
    return {};
}

Result<void> SceneSource::Impl::upload_textures(const Scene& scene) {
    GLint largest = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &largest);
    for (std::size_t i = 0; i < scene.textures.size(); ++i) {
        const Texture& texture = scene.textures[i];
        if (texture.width > largest || texture.height > largest) {
            return fail(
                ErrorCode::unsupported,
                "OpenGL: texture " + std::to_string(i) + " is " + std::to_string(texture.width) +
                    " x " + std::to_string(texture.height) + " texels, the device takes " +
                    std::to_string(largest)
            );
        }
        GLsizei levels = 1;
        for (int side = std::max(texture.width, texture.height); side > 1; side /= 2) {
            ++levels;
        }
        GLuint name = 0;
        glCreateTextures(GL_TEXTURE_2D, 1, &name);
        textures.push_back(name);
        glTextureStorage2D(name, levels, GL_RGBA8, texture.width, texture.height);
        glTextureSubImage2D(
            name,
            0,
            0,
            0,
            texture.width,
            texture.height,
            GL_RGBA,
            GL_UNSIGNED_BYTE,
            texture.pixels.data()
        );
        glGenerateTextureMipmap(name);
        glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
        bytes += texture.pixels.size() * 4 / 3;
    }
    return {};
}

void SceneSource::Impl::add_materials(const Scene& scene) {
    // Entry 0 is the material of parts that name none.
    materials.push_back({});
    GLuint white = 0;
    for (const Material& material : scene.materials) {
        MaterialOnDevice on_device;
        on_device.base_color = material.base_color;
        on_device.alpha_cutoff = material.alpha_cutoff;
        if (material.texture != kNone<TextureId>) {
            on_device.texture = textures[index_of(material.texture)];
            on_device.surface = material.alpha_cutoff > 0.0F ? Surface::cutout : Surface::textured;
        } else if (material.alpha_cutoff > 0.0F) {
            // Holes come from the alpha of vertices: rare enough to share a program.
            if (white == 0) {
                constexpr std::array<std::uint8_t, 4> kWhite = {255, 255, 255, 255};
                glCreateTextures(GL_TEXTURE_2D, 1, &white);
                textures.push_back(white);
                glTextureStorage2D(white, 1, GL_RGBA8, 1, 1);
                glTextureSubImage2D(white, 0, 0, 0, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, kWhite.data());
            }
            on_device.texture = white;
            on_device.surface = Surface::cutout;
        }
        materials.push_back(on_device);
    }
}

void SceneSource::Impl::upload_meshes(const Scene& scene) {
    std::vector<Vertex> vertex_data;
    std::vector<glm::vec2> texcoord_data;
    std::vector<std::uint32_t> index_data;
    bool any_texcoords = false;
    for (const Mesh& mesh : scene.meshes) {
        MeshOnDevice on_device;
        on_device.origin = mesh.origin;
        on_device.base_vertex = static_cast<GLint>(vertex_data.size());
        on_device.first_part = static_cast<std::uint32_t>(parts.size());
        on_device.part_count = static_cast<std::uint32_t>(mesh.parts.size());
        for (const MeshPart& part : mesh.parts) {
            parts.push_back(
                {(index_data.size() + part.first_index) * sizeof(std::uint32_t),
                 static_cast<GLsizei>(part.index_count),
                 part.material == kNone<MaterialId>
                     ? 0U
                     : static_cast<std::uint32_t>(index_of(part.material)) + 1U}
            );
            surfaces[static_cast<std::size_t>(materials[parts.back().material].surface)] = true;
        }
        for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
            Vertex vertex;
            vertex.position = mesh.positions[i];
            vertex.normal = pack_normal(mesh.normals[i]);
            vertex.color = mesh.colors.empty() ? glm::u8vec4(255) : mesh.colors[i];
            vertex_data.push_back(vertex);
        }
        any_texcoords = any_texcoords || !mesh.texcoords.empty();
        texcoord_data.insert(texcoord_data.end(), mesh.texcoords.begin(), mesh.texcoords.end());
        texcoord_data.resize(vertex_data.size(), glm::vec2(0.0F));
        on_device.first_index = index_data.size();
        index_data.insert(index_data.end(), mesh.indices.begin(), mesh.indices.end());
        on_device.bounds = mesh.bounds;
        meshes.push_back(on_device);
    }
    if (!any_texcoords) {
        texcoord_data.resize(1, glm::vec2(0.0F));
    }
    vertices = upload(vertex_data.data(), vertex_data.size() * sizeof(Vertex));
    texcoords = upload(texcoord_data.data(), texcoord_data.size() * sizeof(glm::vec2));
    indices = upload(index_data.data(), index_data.size() * sizeof(std::uint32_t));
    bytes += vertex_data.size() * sizeof(Vertex) + texcoord_data.size() * sizeof(glm::vec2) +
             index_data.size() * sizeof(std::uint32_t);
    index_count = index_data.size();
    instances = scene.instances;
    light = scene.light;
    mesh_count.assign(meshes.size(), 0);
    touched.reserve(meshes.size());
}

void SceneSource::Impl::upload_split(const Scene& scene, const Hierarchy& hierarchy) {
    std::vector<std::uint32_t> index_data;
    index_data.reserve(hierarchy.primitives.size() * 3);
    for (const Piece& piece : hierarchy.pieces) {
        const Mesh& mesh = scene.meshes[index_of(scene.instances[index_of(piece.item)].mesh)];
        for (std::uint32_t i = 0; i < piece.count; ++i) {
            const std::size_t first = std::size_t{hierarchy.primitives[piece.first + i]} * 3;
            for (std::size_t corner_index = 0; corner_index < 3; ++corner_index) {
                index_data.push_back(mesh.indices[first + corner_index]);
            }
        }
    }
    split_indices = upload(index_data.data(), index_data.size() * sizeof(std::uint32_t));
    bytes += index_data.size() * sizeof(std::uint32_t);
}

void SceneSource::Impl::make_arrays() {
    const auto attribute = [](GLuint array,
                              GLuint index,
                              GLint size,
                              GLenum type,
                              GLboolean normalized,
                              std::size_t offset,
                              GLuint binding) {
        glEnableVertexArrayAttrib(array, index);
        glVertexArrayAttribFormat(
            array, index, size, type, normalized, static_cast<GLuint>(offset)
        );
        glVertexArrayAttribBinding(array, index, binding);
    };
    for (GLuint* array : {&plain_array, &textured_array}) {
        glCreateVertexArrays(1, array);
        attribute(
            *array, kPosition, 3, GL_FLOAT, GL_FALSE, offsetof(Vertex, position), kVertexBinding
        );
        attribute(
            *array,
            kNormal,
            4,
            GL_INT_2_10_10_10_REV,
            GL_TRUE,
            offsetof(Vertex, normal),
            kVertexBinding
        );
        attribute(
            *array, kColor, 4, GL_UNSIGNED_BYTE, GL_TRUE, offsetof(Vertex, color), kVertexBinding
        );
        for (GLuint row = 0; row < 3; ++row) {
            attribute(
                *array,
                kRows + row,
                4,
                GL_FLOAT,
                GL_FALSE,
                offsetof(InstanceData, rows) + row * sizeof(glm::vec4),
                kInstanceBinding
            );
            attribute(
                *array,
                kNormalRows + row,
                3,
                GL_FLOAT,
                GL_FALSE,
                offsetof(InstanceData, normal_rows) + row * sizeof(glm::vec3),
                kInstanceBinding
            );
        }
        glEnableVertexArrayAttrib(*array, kItem);
        glVertexArrayAttribIFormat(
            *array, kItem, 1, GL_UNSIGNED_INT, static_cast<GLuint>(offsetof(InstanceData, item))
        );
        glVertexArrayAttribBinding(*array, kItem, kInstanceBinding);
        glVertexArrayBindingDivisor(*array, kInstanceBinding, 1);
        glVertexArrayVertexBuffer(*array, kVertexBinding, vertices, 0, sizeof(Vertex));
    }
    attribute(textured_array, kTexcoord, 2, GL_FLOAT, GL_FALSE, 0, kTexcoordBinding);
    glVertexArrayVertexBuffer(textured_array, kTexcoordBinding, texcoords, 0, sizeof(glm::vec2));
    reserve_instances(1024);
}

void SceneSource::Impl::reserve_instances(std::size_t count) noexcept {
    if (count <= instance_capacity) {
        return;
    }
    instance_capacity = std::max(count, instance_capacity * 2);
    glDeleteBuffers(1, &instance_buffer);
    glCreateBuffers(1, &instance_buffer);
    glNamedBufferStorage(
        instance_buffer,
        static_cast<GLsizeiptr>(instance_capacity * sizeof(InstanceData)),
        nullptr,
        GL_DYNAMIC_STORAGE_BIT
    );
    for (const GLuint array : {plain_array, textured_array}) {
        glVertexArrayVertexBuffer(
            array, kInstanceBinding, instance_buffer, 0, sizeof(InstanceData)
        );
    }
    data.reserve(instance_capacity);
}

InstanceData SceneSource::Impl::instance_data(ItemId item, const View& view) const noexcept {
    const Instance& instance = instances[index_of(item)];
    const glm::dmat4x3& world = instance.object_to_world;
    const glm::dmat3 linear(world[0], world[1], world[2]);
    const glm::dmat3 world_to_camera = glm::transpose(view.camera_to_world);
    const glm::dmat3 to_camera = world_to_camera * linear;
    // The mesh's origin and the eye may both be far from zero: their difference is formed first.
    const glm::dvec3 offset =
        world_to_camera * (linear * meshes[index_of(instance.mesh)].origin + (world[3] - view.eye));
    // Cofactors are the inverse transpose but for a factor, and exist for flattened instances too.
    const glm::dmat3 normal(
        glm::cross(linear[1], linear[2]),
        glm::cross(linear[2], linear[0]),
        glm::cross(linear[0], linear[1])
    );
    const double sign = glm::determinant(linear) < 0.0 ? -1.0 : 1.0;
    InstanceData result;
    result.item = static_cast<std::uint32_t>(index_of(item));
    for (int row = 0; row < 3; ++row) {
        const auto r = static_cast<std::size_t>(row);
        result.rows[r] =
            glm::vec4(to_camera[0][row], to_camera[1][row], to_camera[2][row], offset[row]);
        result.normal_rows[r] =
            glm::vec3(sign * normal[0][row], sign * normal[1][row], sign * normal[2][row]);
    }
    return result;
}

/// Adds the indices of those primitives that are of one part.
void SceneSource::Impl::gather_part(
    const MeshOnDevice& mesh, std::uint32_t part_index, std::span<const std::uint32_t> primitives
) noexcept {
    const PartOnDevice& part = parts[mesh.first_part + part_index];
    const std::size_t first = part.index_offset / sizeof(std::uint32_t);
    const std::size_t before = (first - mesh.first_index) / 3; // primitives of earlier parts
    const std::size_t count = static_cast<std::size_t>(part.index_count) / 3;
    // Room for all of them at once: one check a primitive is the whole work of most.
    const std::size_t begin = gathered_indices.size();
    gathered_indices.resize(begin + primitives.size() * 3);
    std::uint32_t* out = gathered_indices.data() + begin;
    const std::uint32_t* of_part = kept_indices.data() + first;
    for (const std::uint32_t primitive : primitives) {
        const std::size_t of = primitive - before; // enormous for one of an earlier part
        if (of < count) {
            out = std::copy_n(of_part + of * 3, 3, out);
        }
    }
    gathered_indices.resize(static_cast<std::size_t>(out - gathered_indices.data()));
}

/// Prepares draws of selected primitives.
void SceneSource::Impl::gather_selections(
    const DrawList& list, std::uint32_t first_instance
) noexcept {
    if (kept_indices.empty()) {
        kept_indices.resize(index_count);
        glGetNamedBufferSubData(
            indices,
            0,
            static_cast<GLsizeiptr>(index_count * sizeof(std::uint32_t)),
            kept_indices.data()
        );
    }
    gathered_indices.clear();
    selected_runs.clear();
    for (std::size_t i = 0; i < list.selections.size(); ++i) {
        const Selection& selection = list.selections[i];
        const MeshOnDevice& mesh = meshes[index_of(instances[index_of(selection.item)].mesh)];
        const auto primitives = list.selected.subspan(selection.first, selection.count);
        for (std::uint32_t part = 0; part < mesh.part_count; ++part) {
            const std::size_t first = gathered_indices.size();
            gather_part(mesh, part, primitives);
            const std::size_t count = gathered_indices.size() - first;
            if (count > 0) {
                selected_runs.push_back(
                    {mesh.first_part + part,
                     first_instance + static_cast<std::uint32_t>(i),
                     first,
                     static_cast<GLsizei>(count),
                     mesh.base_vertex}
                );
            }
        }
    }
    if (gathered_indices.size() > selected_capacity) {
        selected_capacity = std::max(gathered_indices.size(), selected_capacity * 2);
        glDeleteBuffers(1, &selected_indices);
        glCreateBuffers(1, &selected_indices);
        glNamedBufferStorage(
            selected_indices,
            static_cast<GLsizeiptr>(selected_capacity * sizeof(std::uint32_t)),
            nullptr,
            GL_DYNAMIC_STORAGE_BIT
        );
    }
    if (!gathered_indices.empty()) {
        glInvalidateBufferData(selected_indices);
        glNamedBufferSubData(
            selected_indices,
            0,
            static_cast<GLsizeiptr>(gathered_indices.size() * sizeof(std::uint32_t)),
            gathered_indices.data()
        );
    }
}

void SceneSource::Impl::draw_items(const PassContext& context) noexcept {
    for (const GLuint array : {plain_array, textured_array}) {
        glVertexArrayElementBuffer(array, indices);
    }
    std::uint32_t first = 0;
    for (const std::uint32_t mesh : touched) {
        const MeshOnDevice& on_device = meshes[mesh];
        const std::uint32_t count = mesh_count[mesh] - first;
        for (std::uint32_t p = 0; p < on_device.part_count; ++p) {
            const PartOnDevice& part = parts[on_device.first_part + p];
            use_material(part.material, context);
            glDrawElementsInstancedBaseVertexBaseInstance(
                GL_TRIANGLES,
                part.index_count,
                GL_UNSIGNED_INT,
                buffer_offset(part.index_offset),
                static_cast<GLsizei>(count),
                on_device.base_vertex,
                first
            );
        }
        first += count;
    }
}

/// Prepares a draw of the runs of primitives of one item, from the first on. Neighbours are one
/// run.
/// @return the first piece of another item
std::size_t SceneSource::Impl::gather_runs(
    std::span<const Piece> pieces, std::size_t first, const MeshOnDevice& mesh
) noexcept {
    piece_counts.clear();
    piece_offsets.clear();
    std::size_t i = first;
    while (i < pieces.size() && pieces[i].item == pieces[first].item) {
        const Piece& piece = pieces[i++];
        std::uint32_t count = piece.count;
        while (i < pieces.size() && pieces[i].item == piece.item &&
               pieces[i].first == piece.first + count) {
            count += pieces[i++].count;
        }
        piece_counts.push_back(static_cast<GLsizei>(count * 3));
        piece_offsets.push_back(buffer_offset(std::size_t{piece.first} * 3 * sizeof(std::uint32_t))
        );
    }
    piece_vertices.assign(piece_counts.size(), mesh.base_vertex);
    return i;
}

/// Draws them as one instance, all with one call: there may be a thousand. With the program and the
/// vertex array in use.
void SceneSource::Impl::draw_runs(std::uint32_t instance) noexcept {
    const GLuint array =
        materials[current_material].surface == Surface::plain ? plain_array : textured_array;
    const auto begin_instances_at = [&](std::size_t first) {
        glVertexArrayVertexBuffer(
            array,
            kInstanceBinding,
            instance_buffer,
            static_cast<GLintptr>(first * sizeof(InstanceData)),
            sizeof(InstanceData)
        );
    };
    begin_instances_at(instance);
    glMultiDrawElementsBaseVertex(
        GL_TRIANGLES,
        piece_counts.data(),
        GL_UNSIGNED_INT,
        piece_offsets.data(),
        static_cast<GLsizei>(piece_counts.size()),
        piece_vertices.data()
    );
    begin_instances_at(0);
}

/// Draws all pieces of a list.
void SceneSource::Impl::draw_pieces(const DrawList& list, const PassContext& context) noexcept {
    for (const GLuint array : {plain_array, textured_array}) {
        glVertexArrayElementBuffer(array, split_indices);
    }
    // Behind those of whole items.
    std::uint32_t instance = touched.empty() ? 0U : mesh_count[touched.back()];
    for (std::size_t i = 0; i < list.pieces.size(); ++instance) {
        const MeshOnDevice& mesh = meshes[index_of(instances[index_of(list.pieces[i].item)].mesh)];
        i = gather_runs(list.pieces, i, mesh);
        use_material(parts[mesh.first_part].material, context);
        draw_runs(instance);
    }
}

void SceneSource::Impl::draw_selections(const PassContext& context) noexcept {
    for (const GLuint array : {plain_array, textured_array}) {
        glVertexArrayElementBuffer(array, selected_indices);
    }
    for (const SelectedRun& run : selected_runs) {
        use_material(parts[run.part].material, context);
        glDrawElementsInstancedBaseVertexBaseInstance(
            GL_TRIANGLES,
            run.index_count,
            GL_UNSIGNED_INT,
            buffer_offset(run.first_index * sizeof(std::uint32_t)),
            1,
            run.base_vertex,
            run.instance
        );
    }
}

void SceneSource::Impl::use_material(std::uint32_t index, const PassContext& context) noexcept {
    if (index == current_material) {
        return;
    }
    current_material = index;
    const MaterialOnDevice& material = materials[index];
    const ProjectionVariant projection{context.keyframes.size(), context.whole_triangles};
    const Programs& made = showing_keyframes ? projecting[projection.place()] : programs;
    const Program& program =
        made[static_cast<std::size_t>(material.surface)]
            [program_place(context.clip.has_value(), context.positions, showing_keyframes)];
    FARFIELD_ASSERT(program.name != 0);
    if (&program != current) {
        current = &program;
        glUseProgram(program.name);
        const glm::mat4 clip_from_camera = projection_matrix(context.view.lens);
        glUniformMatrix4fv(program.projection, 1, GL_FALSE, &clip_from_camera[0][0]);
        const glm::vec3 to_light = glm::normalize(light.to_light);
        glUniform4f(program.light, to_light.x, to_light.y, to_light.z, light.ambient);
        if (context.clip.has_value()) {
            // Inward planes of the box, in camera space.
            std::array<glm::vec4, 6> planes{};
            const glm::dvec3 eye = context.view.eye - context.origin;
            for (int axis = 0; axis < 3; ++axis) {
                glm::dvec3 normal(0.0);
                normal[axis] = 1.0;
                const glm::vec3 in_camera(glm::transpose(context.view.camera_to_world) * normal);
                const auto plane = static_cast<std::size_t>(axis) * 2;
                planes[plane] = glm::vec4(in_camera, eye[axis] - double{context.clip->lo[axis]});
                planes[plane + 1] =
                    glm::vec4(-in_camera, double{context.clip->hi[axis]} - eye[axis]);
            }
            glUniform4fv(program.clip_planes, 6, &planes[0][0]);
        }
        if (showing_keyframes) {
            program.projection_uniforms.set(context);
        }
        glBindVertexArray(material.surface == Surface::plain ? plain_array : textured_array);
    }
    glUniform4fv(program.base_color, 1, &material.base_color[0]);
    if (material.surface != Surface::plain) {
        glBindTextureUnit(0, material.texture);
    }
    if (material.surface == Surface::cutout) {
        glUniform1f(program.alpha_cutoff, material.alpha_cutoff);
    }
}

SceneSource::SceneSource(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
SceneSource::~SceneSource() = default;

Result<std::unique_ptr<SceneSource>>
SceneSource::create(const Scene& scene, const Hierarchy* hierarchy) {
    auto impl = std::make_unique<Impl>();
    {
        const UploadGuard guard;
        if (Result<void> uploaded = impl->upload_textures(scene); !uploaded) {
            return tl::unexpected(std::move(uploaded).error());
        }
        impl->add_materials(scene);
    }
    impl->upload_meshes(scene);
    for (const bool positions : {false, true}) {
        if (Result<void> made = impl->make_programs(positions, nullptr); !made) {
            return tl::unexpected(std::move(made).error());
        }
    }
    if (hierarchy != nullptr && !hierarchy->pieces.empty()) {
        impl->upload_split(scene, *hierarchy);
    }
    impl->make_arrays();
    if (glGetError() == GL_OUT_OF_MEMORY) {
        return fail(
            ErrorCode::out_of_memory,
            "OpenGL: no memory for " + std::to_string(impl->bytes) + " bytes of the scene"
        );
    }
    return std::unique_ptr<SceneSource>(new SceneSource(std::move(impl)));
}

GeometrySource::Capabilities SceneSource::capabilities() const noexcept {
    return {
        .subset = true,
        .clip_planes = true,
        .position_output = true,
        .selection = true,
        .projection = true};
}

Result<void> SceneSource::prepare_projection(
    std::size_t keyframes, bool whole_triangles, bool positions
) noexcept {
    const ProjectionVariant projection{keyframes, whole_triangles};
    return impl_->make_programs(positions, &projection);
}

void SceneSource::draw(const DrawList& list, const PassContext& context) noexcept {
    Impl& impl = *impl_;
    // Group the items by mesh with a counting sort over the meshes that occur.
    impl.touched.clear();
    for (const ItemId item : list.items) {
        FARFIELD_ASSERT(index_of(item) < impl.instances.size());
        const std::size_t mesh = index_of(impl.instances[index_of(item)].mesh);
        if (impl.mesh_count[mesh]++ == 0) {
            impl.touched.push_back(static_cast<std::uint32_t>(mesh));
        }
    }
    std::sort(impl.touched.begin(), impl.touched.end());
    // One instance a whole item, one a run of split primitives of one item, and one a selection.
    std::size_t runs = 0;
    for (std::size_t i = 0; i < list.pieces.size(); ++i) {
        runs += i == 0 || list.pieces[i].item != list.pieces[i - 1].item ? 1 : 0;
    }
    const std::size_t total = list.items.size() + runs + list.selections.size();
    if (total == 0) {
        return;
    }
    impl.reserve_instances(total);
    impl.data.resize(total);
    std::uint32_t next = 0;
    for (const std::uint32_t mesh : impl.touched) {
        const std::uint32_t count = impl.mesh_count[mesh];
        impl.mesh_count[mesh] = next; // where the next instance of this mesh goes
        next += count;
    }
    for (const ItemId item : list.items) {
        const std::size_t mesh = index_of(impl.instances[index_of(item)].mesh);
        impl.data[impl.mesh_count[mesh]++] = impl.instance_data(item, context.view);
    }
    for (std::size_t i = 0; i < list.pieces.size(); ++i) {
        if (i == 0 || list.pieces[i].item != list.pieces[i - 1].item) {
            impl.data[next++] = impl.instance_data(list.pieces[i].item, context.view);
        }
    }
    const std::uint32_t first_selection = next;
    for (const Selection& selection : list.selections) {
        impl.data[next++] = impl.instance_data(selection.item, context.view);
    }
    glInvalidateBufferData(impl.instance_buffer);
    glNamedBufferSubData(
        impl.instance_buffer,
        0,
        static_cast<GLsizeiptr>(total * sizeof(InstanceData)),
        impl.data.data()
    );
    if (context.clip.has_value()) {
        for (GLenum plane = 0; plane < 6; ++plane) {
            glEnable(GL_CLIP_DISTANCE0 + plane);
        }
    }

    if (!list.selections.empty()) {
        impl.gather_selections(list, first_selection);
    }
    const bool projecting = !context.keyframes.empty();
    for (const bool keyframes : {true, false}) {
        // As `ProjectionVariant` says.
        if (keyframes ? !projecting : projecting && !context.whole_triangles) {
            continue;
        }
        impl.showing_keyframes = keyframes;
        impl.current = nullptr;
        impl.current_material = UINT32_MAX;
        if (!impl.touched.empty()) {
            impl.draw_items(context);
        }
        if (runs > 0) {
            impl.draw_pieces(list, context);
        }
        if (!list.selections.empty()) {
            impl.draw_selections(context);
        }
    }
    for (const std::uint32_t mesh : impl.touched) {
        impl.mesh_count[mesh] = 0;
    }
    if (context.clip.has_value()) {
        for (GLenum plane = 0; plane < 6; ++plane) {
            glDisable(GL_CLIP_DISTANCE0 + plane);
        }
    }
}

Result<void> SceneSource::set_transform(ItemId item, const glm::dmat4x3& object_to_world) {
    if (index_of(item) >= impl_->instances.size()) {
        return fail(
            ErrorCode::not_found,
            "OpenGL: item " + std::to_string(index_of(item)) + " of " +
                std::to_string(impl_->instances.size())
        );
    }
    Instance& instance = impl_->instances[index_of(item)];
    const Box3d& bounds = impl_->meshes[index_of(instance.mesh)].bounds;
    if (Result<void> valid = check_placement(item, bounds, object_to_world); !valid) {
        return valid;
    }
    instance.object_to_world = object_to_world;
    return {};
}

std::uint64_t SceneSource::device_bytes() const noexcept {
    return impl_->bytes + impl_->selected_capacity * sizeof(std::uint32_t);
}

} // namespace farfield::opengl
