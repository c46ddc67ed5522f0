#include "opengl/projection_shaders.hpp"

#include <farfield/gpu/keyframe_lookup.hpp>

#include <glm/ext/matrix_float3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace farfield::opengl {

namespace {

// What a keyframe is to a pass, in rows of four numbers. Lengths of the keyframe are in steps of
// its kept depths, so that these need no scale: the rotation is as many times longer as a metre has
// steps.
//
//     0 to 2  columns of the rotation, each with a component of the offset
//     3       texels per tangent, middle
//     4       corners of the source
//     5       nearest, offset_m times the square of the steps a metre, the square of the shift in
//             tangents of the pass's x or less than 0 for any shift, texture coordinates of a texel
constexpr std::size_t kRows = 6;
using KeyframeRows = std::array<glm::vec4, kRows>;

KeyframeRows rows_of(const gpu::KeyframeTerms& terms, const View& view, std::int32_t page_size) {
    const double steps = terms.steps_per_m;
    KeyframeRows rows;
    for (int column = 0; column < 3; ++column) {
        rows[static_cast<std::size_t>(column)] =
            glm::vec4(terms.rotation[column] * steps, terms.offset[column] * steps);
    }
    rows[3] = glm::vec4(terms.per_tangent, terms.middle);
    rows[4] = glm::vec4(terms.low, terms.last + 1);
    const double tangent = (view.lens.right - view.lens.left) / view.width;
    const double shift = terms.max_shift_px * tangent;
    rows[5] = glm::vec4(
        terms.nearest * steps,
        terms.offset_m * steps * steps,
        std::isinf(terms.max_shift_px)
            ? -1.0
            : std::min(shift * shift, double{std::numeric_limits<float>::max()}),
        1.0 / page_size
    );
    return rows;
}

std::string number(std::size_t value) {
    return std::to_string(value);
}

void replace_all(std::string& text, const std::string& what, const std::string& by) {
    for (std::size_t at = text.find(what); at != std::string::npos;
         at = text.find(what, at + by.size())) {
        text.replace(at, what.size(), by);
    }
}

/// Of how many keyframes the fragment shader gets the rows with the triangle. Software rasterisers
/// read uniforms pixel by pixel, which is most of the work then; but with more than these there may
/// be more inputs than a device has.
std::size_t flat_keyframes(const ProjectionVariant& variant, bool positions) noexcept {
    constexpr std::size_t kMostFlat = 2;
    if (positions) {
        return 0;
    }
    return variant.whole_triangles ? 1 : std::min(variant.keyframes, kMostFlat);
}

constexpr std::size_t kFirstFlat = 6;

/// Declares the rows of so many keyframes, "in" or "out" of a stage.
std::string flat_rows(std::size_t keyframes, const char* direction) {
    std::string text;
    for (std::size_t i = 0; i < keyframes * kRows; ++i) {
        text += "layout(location = " + number(kFirstFlat + i) + ") flat " + direction +
                " vec4 row_" + number(i) + ";\n";
    }
    return text;
}

/// A keyframe from its rows, named by a prefix and the index of the first.
std::string keyframe_of_flat(std::size_t keyframe) {
    std::string text = "keyframe_of(";
    for (std::size_t row = 0; row < kRows; ++row) {
        text += (row == 0 ? "row_" : ", row_") + number(keyframe * kRows + row);
    }
    return text + ")";
}

std::string uniforms(const ProjectionVariant& variant) {
    return "uniform vec4 keyframe_rows[" + number(kRows * variant.keyframes) + "];\n";
}

/// Looking up keyframes, in a fragment or a geometry shader. Everything is evaluated at once:
/// branches cost more.
std::string lookup_text(const ProjectionVariant& variant) {
    const std::string count = "[" + number(variant.keyframes) + "];\n";
    return "layout(binding = " + number(kKeyframeColorUnit) + ") uniform sampler2D colors" + count +
           "layout(binding = " + number(kKeyframeDepthUnit) + ") uniform usampler2D depths" +
           count + R"(
const float nothing = 65535.0;
struct Keyframe {
    mat3 rotation;
    vec3 offset;
    vec4 window;
    vec4 source;
    vec4 kept;
};
Keyframe keyframe_of(vec4 a, vec4 b, vec4 c, vec4 d, vec4 e, vec4 f) {
    return Keyframe(mat3(a.xyz, b.xyz, c.xyz), vec3(a.w, b.w, c.w), d, e, f);
}
struct Sight {
    vec4 color;
    vec2 texel;
    vec2 at;
};
bool is_inside(Keyframe keyframe, float z, vec2 at) {
    return z > 0.0 && all(greaterThanEqual(at, keyframe.source.xy)) &&
           all(lessThan(at, keyframe.source.zw));
}
// `camera` has beside a point the square of what a tangent of y has pixels, over that of x.
bool look(
    sampler2D page_colors, usampler2D page_depths, Keyframe keyframe, vec4 camera,
    vec3 camera_normal, out Sight sight
) {
    vec3 point = keyframe.rotation * camera.xyz + keyframe.offset;
    vec3 normal = keyframe.rotation * camera_normal;
    float z = -point.z;
    vec2 tangents = point.xy * (1.0 / z);
    vec2 per_texel = 1.0 / keyframe.window.xy;
    sight.at = tangents * keyframe.window.xy + keyframe.window.zw;
    sight.texel = floor(sight.at);
    vec2 center = sight.texel + 0.5;
    // Of the four texels that are filtered, all of the source.
    vec2 low = keyframe.source.xy;
    vec2 high = keyframe.source.zw;
    vec2 filtered_at = clamp(sight.at, low + 0.5, high - 0.5);
    vec2 first = min(floor(filtered_at - 0.5), max(high - 2.0, low));
    vec4 four = vec4(textureGather(page_depths, (first + 1.0) * keyframe.kept.w));
    vec2 column = sight.texel.x > first.x ? four.zy : four.wx;
    float depth = sight.texel.y > first.y ? column.y : column.x;
    // The tolerance. Normals are as long as the rotation.
    float length_sq = dot(keyframe.rotation[0], keyframe.rotation[0]);
    float along = dot(normal, vec3(tangents, -1.0));
    float least = length_sq * (1.0 + dot(tangents, tangents)) / 256.0;
    float slope = z * dot(abs(normal.xy), per_texel);
    float most = 1.0 + (keyframe.kept.y + slope) * inversesqrt(max(along * along, least));
    float own = z - keyframe.kept.x;
    vec4 apart = abs(four - own);
    bool filtered = max(max(apart.x, apart.y), max(apart.z, apart.w)) <= most;
    bool stands = abs(depth - own) <= most;
    // The shift. From the fragment to the point of the texel, in camera axes of the pass:
    vec3 step = vec3((center - keyframe.window.zw) * per_texel, -1.0) * (depth + keyframe.kept.x) -
                point;
    vec3 moved = step * keyframe.rotation; // length_sq times as long as that is in metres
    float shown_w = -camera.z * length_sq - moved.z;
    vec2 shift = moved.xy * -camera.z + camera.xy * moved.z;
    float scale = -camera.z * shown_w;
    float shift_sq = shift.x * shift.x + camera.w * shift.y * shift.y;
    bool close = shift_sq <= keyframe.kept.z * scale * scale;
    bool before = min(-camera.z, shown_w) > 0.0;
    bool any = keyframe.kept.z < 0.0;
    bool near = any || (close && before);
    sight.color =
        textureLod(page_colors, (filtered ? filtered_at : center) * keyframe.kept.w, 0.0);
    bool inside = is_inside(keyframe, z, sight.at);
    return inside && stands && near && depth < nothing && sight.color.a >= 0.5;
}
bool look_whole(
    sampler2D page_colors, usampler2D page_depths, Keyframe keyframe, vec4 camera, out Sight sight
) {
    vec3 point = keyframe.rotation * camera.xyz + keyframe.offset;
    float z = -point.z;
    sight.at = point.xy * (1.0 / z) * keyframe.window.xy + keyframe.window.zw;
    sight.texel = floor(sight.at);
    float depth = float(textureLod(page_depths, (sight.texel + 0.5) * keyframe.kept.w, 0.0).x);
    vec2 filtered_at = clamp(sight.at, keyframe.source.xy + 0.5, keyframe.source.zw - 0.5);
    sight.color = textureLod(page_colors, filtered_at * keyframe.kept.w, 0.0);
    bool inside = is_inside(keyframe, z, sight.at);
    return inside && depth < nothing && sight.color.a >= 0.5;
}
)";
}

constexpr const char* kRowsText = R"(
Keyframe keyframe_at(int k) {
    return keyframe_of(keyframe_rows[6 * k], keyframe_rows[6 * k + 1], keyframe_rows[6 * k + 2], keyframe_rows[6 * k + 3],
                       keyframe_rows[6 * k + 4], keyframe_rows[6 * k + 5]);
}
)";
static_assert(kRows == 6);

/// What positions keep of a texel that a keyframe shows.
constexpr const char* kPositionText = R"(
const float sqrt_half = 0.70710678;
// Steps to the neighbouring pixels, in camera axes of the pass.
void show_point(
    usampler2D page_points, usampler2D page_layers, Keyframe keyframe, Sight sight, vec3 camera,
    mat2x3 steps, uint node
) {
    ivec2 texel = ivec2(sight.texel);
    uvec4 found = texelFetch(page_points, texel, 0);
    point = found;
    layer = uvec2(0u, 0xFFFFFFFFu);
    if (found.w == 0xFFFFFFFFu) { return; }
    vec3 from = keyframe.rotation * camera + keyframe.offset;
    vec3 ray = from / -from.z;
    mat2x3 moved = keyframe.rotation * steps;
    vec2 scale = keyframe.window.xy / -from.z;
    mat2 to_texels = mat2((moved[0].xy + ray.xy * moved[0].z) * scale,
                          (moved[1].xy + ray.xy * moved[1].z) * scale);
    // Pixels per texel, from texels per pixel.
    mat2 to_pixels = inverse(to_texels);
    float half_diagonal = 0.5 * max(length(to_pixels[0] + to_pixels[1]),
                                    length(to_pixels[0] - to_pixels[1]));
    float distance = length(to_pixels * (sight.texel + 0.5 - sight.at));
    // Errors of the page's own sampling are seen enlarged at most by the largest singular value.
    float squares = dot(to_pixels[0], to_pixels[0]) + dot(to_pixels[1], to_pixels[1]);
    float area = determinant(to_pixels);
    float most = sqrt(0.5 * (squares + sqrt(max(squares * squares - 4.0 * area * area, 0.0))));
    float nested = uintBitsToFloat(texelFetch(page_layers, texel, 0).x);
    layer = uvec2(floatBitsToUint(max(half_diagonal, distance) / sqrt_half + nested * most), node);
}
)";

} // namespace

std::string projection_vertex_head(const ProjectionVariant& variant, bool positions) {
    std::string text = "layout(location = 4) out vec4 camera_point;\nuniform float pixel_ratio;\n";
    if (!variant.whole_triangles && flat_keyframes(variant, positions) > 0) {
        text += uniforms(variant) + flat_rows(flat_keyframes(variant, positions), "out");
    }
    return text;
}

std::string projection_vertex_body(const ProjectionVariant& variant, bool positions) {
    std::string text = "    camera_point = vec4(camera.xyz, pixel_ratio);\n";
    const std::size_t flat = variant.whole_triangles ? 0 : flat_keyframes(variant, positions);
    for (std::size_t i = 0; i < flat * kRows; ++i) {
        text += "    row_" + number(i) + " = keyframe_rows[" + number(i) + "];\n";
    }
    return text;
}

std::string projection_geometry_shader(
    const ProjectionVariant& variant, bool textured, bool clipped, bool positions
) {
    if (!variant.whole_triangles) {
        return "";
    }
    std::string declarations;
    std::string copies;
    const auto pass_on =
        [&](const char* location, const char* type, const char* name, const char* quality = "") {
            const std::string head = std::string("layout(location = ") + location + ") " + quality;
            declarations += head + "in " + type + " " + name + "[];\n" + head + "out " + type +
                            " next_" + name + ";\n";
            copies += std::string("        next_") + name + " = " + name + "[i];\n";
        };
    pass_on("0", "vec4", "shaded");
    if (textured) {
        pass_on("1", "vec2", "uv");
    }
    if (positions) {
        pass_on("2", "vec3", "shown_point");
        pass_on("3", "uint", "shown_item", "flat ");
    }
    pass_on("4", "vec4", "camera_point");
    const std::size_t flat = flat_keyframes(variant, positions);
    for (std::size_t i = 0; i < flat * kRows; ++i) {
        copies += "        row_" + number(i) + " = keyframe_rows[" + number(kRows) +
                  " * max(shown, 0) + " + number(i) + "];\n";
    }
    std::string text = "#version 450 core\nlayout(triangles) in;\n"
                       "layout(triangle_strip, max_vertices = 3) out;\n";
    if (clipped) {
        text += "in gl_PerVertex { vec4 gl_Position; float gl_ClipDistance[6]; } gl_in[];\n"
                "out gl_PerVertex { vec4 gl_Position; float gl_ClipDistance[6]; };\n";
        copies += "        for (int plane = 0; plane < 6; ++plane) {\n"
                  "            gl_ClipDistance[plane] = gl_in[i].gl_ClipDistance[plane];\n"
                  "        }\n";
    }
    text += declarations + flat_rows(flat, "out") +
            "layout(location = 5) flat out int next_shown;\n" + uniforms(variant) +
            lookup_text(variant) + kRowsText +
            "const int keyframe_count = " + number(variant.keyframes) + ";\n" + R"(
void main() {
    vec3 normal = normalize(cross(camera_point[1].xyz - camera_point[0].xyz,
                                  camera_point[2].xyz - camera_point[0].xyz));
    int shown = -1;
    for (int k = 0; k < keyframe_count && shown < 0; ++k) {
        bool seen = true;
        Sight sight;
        for (int i = 0; i < 3; ++i) {
            seen = look(colors[k], depths[k], keyframe_at(k), camera_point[i], normal, sight) &&
                   seen;
        }
        shown = seen ? k : shown;
    }
    for (int i = 0; i < 3; ++i) {
        gl_Position = gl_in[i].gl_Position;
)" + copies +
            "        next_shown = shown;\n"
            "        EmitVertex();\n"
            "    }\n"
            "}\n";
    return text;
}

std::string projection_fragment_head(const ProjectionVariant& variant, bool positions) {
    std::string text = "layout(location = 4) in vec4 camera_point;\n";
    const std::size_t flat = flat_keyframes(variant, positions);
    text += flat_rows(flat, "in") + uniforms(variant);
    if (variant.whole_triangles) {
        text += "layout(location = 5) flat in int shown;\n";
    }
    text += lookup_text(variant) + kRowsText;
    if (positions) {
        const std::string count = "[" + number(variant.keyframes) + "];\n";
        text += "layout(binding = " + number(kKeyframePointUnit) + ") uniform usampler2D points" +
                count + "layout(binding = " + number(kKeyframeLayerUnit) +
                ") uniform usampler2D layers" + count + "uniform uint nodes" + count +
                kPositionText;
    }
    return text;
}

std::string projection_fragment_body(const ProjectionVariant& variant, bool positions) {
    // Derivatives first, where all fragments still go together.
    std::string text =
        "    Sight sight;\n"
        "    bool found = false;\n"
        "    mat2x3 steps = mat2x3(dFdx(camera_point.xyz), dFdy(camera_point.xyz));\n"
        "    vec3 normal = normalize(cross(steps[0], steps[1]));\n";
    const std::size_t flat = flat_keyframes(variant, positions);
    for (std::size_t i = 0; i < variant.keyframes; ++i) {
        std::string one = R"(
    if (!found) {
        Keyframe keyframe = KEYFRAME;
        found = SEEN;
        result = found ? vec4(min(sight.color.rgb / sight.color.a, vec3(1.0)), 1.0) : result;
)";
        if (positions) {
            one += R"(
        if (found) {
            show_point(points[#], layers[#], keyframe, sight, camera_point.xyz, steps, nodes[#]);
        }
)";
        }
        one += "    }\n";
        std::string keyframe = "keyframe_at(#)";
        if (variant.whole_triangles && flat > 0) {
            keyframe = keyframe_of_flat(0);
        } else if (i < flat) {
            keyframe = keyframe_of_flat(i);
        }
        replace_all(one, "KEYFRAME", keyframe);
        replace_all(
            one,
            "SEEN",
            variant.whole_triangles
                ? "shown == # && look_whole(colors[#], depths[#], keyframe, camera_point, sight)"
                : "look(colors[#], depths[#], keyframe, camera_point, normal, sight)"
        );
        replace_all(one, "#", number(i));
        text += one;
    }
    return text;
}

ProjectionUniforms ProjectionUniforms::of(GLuint program) noexcept {
    ProjectionUniforms locations;
    locations.rows_ = glGetUniformLocation(program, "keyframe_rows");
    locations.nodes_ = glGetUniformLocation(program, "nodes");
    locations.pixel_ratio_ = glGetUniformLocation(program, "pixel_ratio");
    return locations;
}

void ProjectionUniforms::set(const PassContext& context) const noexcept {
    std::array<KeyframeRows, kMostKeyframes> rows{};
    std::array<GLuint, kMostKeyframes> nodes{};
    for (std::size_t i = 0; i < context.keyframes.size(); ++i) {
        const DeviceKeyframe& shown = context.keyframes[i];
        // In double up to here: eyes may be far from zero, and the terms are not.
        rows[i] = rows_of(
            gpu::keyframe_terms(*shown.keyframe, context.view), context.view, shown.page_size
        );
        nodes[i] = shown.keyframe->node;
        const auto unit = static_cast<GLuint>(i);
        glBindTextureUnit(kKeyframeColorUnit + unit, shown.colors);
        glBindTextureUnit(kKeyframeDepthUnit + unit, shown.depths);
        if (context.positions) {
            glBindTextureUnit(kKeyframePointUnit + unit, shown.points);
            glBindTextureUnit(kKeyframeLayerUnit + unit, shown.layers);
        }
    }
    const auto count = static_cast<GLsizei>(context.keyframes.size());
    glUniform4fv(rows_, count * static_cast<GLsizei>(kRows), &rows[0][0][0]);
    glUniform1uiv(nodes_, count, nodes.data());
    const Lens& lens = context.view.lens;
    const double x = context.view.width / (lens.right - lens.left);
    const double y = context.view.height / (lens.top - lens.bottom);
    glUniform1f(pixel_ratio_, static_cast<GLfloat>(y * y / (x * x)));
}

} // namespace farfield::opengl
