#include "opengl/projection_shaders.hpp"

#include <farfield/gpu/keyframe_lookup.hpp>

#include <glm/ext/matrix_float3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace farfield::opengl {

namespace {

// What a keyframe is to a pass, in rows of four numbers.
//
//     0 to 2  columns of the rotation, each with a component of the offset [m]
//     3       texels per tangent, middle
//     4       corners of the source
//     5       nearest [step], offset_m, the square of the shift [px] or less than 0 for any shift,
//             steps a metre
//     6       the keyframe's eye as `pixel_point`, texture coordinates of a texel
//
// The first are for vertices alone.
constexpr std::size_t kVertexRows = 3;
constexpr std::size_t kRows = 7;
constexpr std::size_t kFragmentRows = kRows - kVertexRows;
using KeyframeRows = std::array<glm::vec4, kRows>;

glm::dvec2 pixels_per_tangent(const View& view) noexcept {
    const Lens& lens = view.lens;
    return {view.width / (lens.right - lens.left), view.height / (lens.top - lens.bottom)};
}

KeyframeRows rows_of(const gpu::KeyframeTerms& terms, const View& view, std::int32_t page_size) {
    KeyframeRows rows;
    for (int column = 0; column < 3; ++column) {
        rows[static_cast<std::size_t>(column)] =
            glm::vec4(terms.rotation[column], terms.offset[column]);
    }
    rows[3] = glm::vec4(terms.per_tangent, terms.middle);
    rows[4] = glm::vec4(terms.low, terms.last + 1);
    rows[5] = glm::vec4(
        terms.nearest * terms.steps_per_m,
        terms.offset_m,
        std::isinf(terms.max_shift_px)
            ? -1.0
            : std::min(
                  terms.max_shift_px * terms.max_shift_px, double{std::numeric_limits<float>::max()}
              ),
        terms.steps_per_m
    );
    const glm::dvec3 eye = -(terms.offset * terms.rotation); // in camera axes of the pass
    rows[6] = glm::vec4(glm::dvec2(eye) * pixels_per_tangent(view), -eye.z, 1.0 / page_size);
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

constexpr std::size_t kFirstPoint = 6;
constexpr std::size_t kFirstFlat = kFirstPoint + kMostKeyframes;

/// Declares where so many keyframes see vertices, "in" or "out" of a stage.
std::string keyframe_points(std::size_t keyframes, const char* direction, const char* suffix = "") {
    std::string text;
    for (std::size_t i = 0; i < keyframes; ++i) {
        text += "layout(location = " + number(kFirstPoint + i) + ") " + direction +
                " vec3 keyframe_point_" + number(i) + suffix + ";\n";
    }
    return text;
}

/// Declares rows of so many keyframes, those for fragments, "in" or "out" of a stage.
std::string flat_rows(std::size_t keyframes, const char* direction) {
    std::string text;
    for (std::size_t i = 0; i < keyframes * kFragmentRows; ++i) {
        text += "layout(location = " + number(kFirstFlat + i) + ") flat " + direction +
                " vec4 row_" + number(i) + ";\n";
    }
    return text;
}

/// A keyframe from its rows.
std::string keyframe_of_flat(std::size_t keyframe) {
    std::string text = "Keyframe(";
    for (std::size_t row = 0; row < kFragmentRows; ++row) {
        text += (row == 0 ? "row_" : ", row_") + number(keyframe * kFragmentRows + row);
    }
    return text + ")";
}

std::string keyframe_of_uniforms(std::size_t keyframe) {
    std::string text = "Keyframe(";
    for (std::size_t row = kVertexRows; row < kRows; ++row) {
        text += row == kVertexRows ? "" : ", ";
        text += "keyframe_rows[" + number(keyframe * kRows + row) + "]";
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
    vec4 window;
    vec4 source;
    vec4 kept;
    vec4 eye;
};
struct Sight {
    vec4 color;
    vec2 texel;
    vec2 at;
};
bool is_inside(Keyframe keyframe, float z, vec2 at) {
    return z > 0.0 && all(greaterThanEqual(at, keyframe.source.xy)) &&
           all(lessThan(at, keyframe.source.zw));
}
// A point and a normal of any length to the keyframe; the point as `pixel_point`.
bool look(
    sampler2D page_colors, usampler2D page_depths, Keyframe keyframe, vec3 point, vec3 normal,
    vec3 pixel, out Sight sight
) {
    float z = -point.z;
    vec2 tangents = point.xy * (1.0 / z);
    sight.at = tangents * keyframe.window.xy + keyframe.window.zw;
    sight.texel = floor(sight.at);
    vec2 center = sight.texel + 0.5;
    // Of the four texels that are filtered, all of the source.
    vec2 low = keyframe.source.xy;
    vec2 high = keyframe.source.zw;
    vec2 filtered_at = clamp(sight.at, low + 0.5, high - 0.5);
    vec2 first = min(floor(filtered_at - 0.5), max(high - 2.0, low));
    vec4 four = vec4(textureGather(page_depths, (first + 1.0) * keyframe.eye.w));
    vec2 column = sight.texel.x > first.x ? four.zy : four.wx;
    float depth = sight.texel.y > first.y ? column.y : column.x;
    // The tolerance.
    float length_sq = dot(normal, normal);
    float along = dot(normal, vec3(tangents, -1.0));
    float least = length_sq * (1.0 + dot(tangents, tangents)) / 256.0;
    float slope = z * dot(abs(normal.xy), 1.0 / keyframe.window.xy);
    float most = 1.0 + keyframe.kept.w * (keyframe.kept.y * sqrt(length_sq) + slope) *
                           inversesqrt(max(along * along, least));
    float own = z * keyframe.kept.w - keyframe.kept.x;
    vec4 apart = abs(four - own);
    bool filtered = max(max(apart.x, apart.y), max(apart.z, apart.w)) <= most;
    bool stands = abs(depth - own) <= most;
    // The shift along the ray.
    float beyond = (depth - own) / (z * keyframe.kept.w);
    vec2 shift = beyond * (pixel.xy * keyframe.eye.z - keyframe.eye.xy * pixel.z);
    float shown_w = pixel.z + beyond * (pixel.z - keyframe.eye.z);
    float scale = pixel.z * shown_w;
    bool close = dot(shift, shift) <= keyframe.kept.z * scale * scale;
    bool before = min(pixel.z, shown_w) > 0.0;
    bool any = keyframe.kept.z < 0.0;
    bool near = any || (close && before);
    sight.color =
        textureLod(page_colors, (filtered ? filtered_at : center) * keyframe.eye.w, 0.0);
    bool inside = is_inside(keyframe, z, sight.at);
    return inside && stands && near && depth < nothing && sight.color.a >= 0.5;
}
bool look_whole(
    sampler2D page_colors, usampler2D page_depths, Keyframe keyframe, vec3 point, out Sight sight
) {
    float z = -point.z;
    sight.at = point.xy * (1.0 / z) * keyframe.window.xy + keyframe.window.zw;
    sight.texel = floor(sight.at);
    float depth = float(textureLod(page_depths, (sight.texel + 0.5) * keyframe.eye.w, 0.0).x);
    vec2 filtered_at = clamp(sight.at, keyframe.source.xy + 0.5, keyframe.source.zw - 0.5);
    sight.color = textureLod(page_colors, filtered_at * keyframe.eye.w, 0.0);
    bool inside = is_inside(keyframe, z, sight.at);
    return inside && depth < nothing && sight.color.a >= 0.5;
}
)";
}

/// What positions keep of a texel that a keyframe shows.
constexpr const char* kPositionText = R"(
const float sqrt_half = 0.70710678;
// A point to the keyframe, and its steps to the neighbouring pixels.
void show_point(
    usampler2D page_points, usampler2D page_layers, Keyframe keyframe, Sight sight, vec3 from,
    mat2x3 moved, uint node
) {
    ivec2 texel = ivec2(sight.texel);
    uvec4 found = texelFetch(page_points, texel, 0);
    point = found;
    layer = uvec2(0u, 0xFFFFFFFFu);
    if (found.w == 0xFFFFFFFFu) { return; }
    vec3 ray = from / -from.z;
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
    std::string text = "layout(location = 4) out vec3 pixel_point;\n"
                       "uniform vec2 pixels_per_tangent;\n" +
                       uniforms(variant) + keyframe_points(variant.keyframes, "out");
    if (!variant.whole_triangles) {
        text += flat_rows(flat_keyframes(variant, positions), "out");
    }
    return text;
}

std::string projection_vertex_body(const ProjectionVariant& variant, bool positions) {
    std::string text = "    pixel_point = vec3(camera.xy * pixels_per_tangent, -camera.z);\n";
    for (std::size_t i = 0; i < variant.keyframes; ++i) {
        // Where a keyframe sees a point is linear in the point, and so is interpolated as it is.
        std::string one = R"(
    keyframe_point_# = mat3(ROW0.xyz, ROW1.xyz, ROW2.xyz) * camera.xyz + vec3(ROW0.w, ROW1.w, ROW2.w);
)";
        for (std::size_t row = 0; row < kVertexRows; ++row) {
            replace_all(one, "ROW" + number(row), "keyframe_rows[" + number(i * kRows + row) + "]");
        }
        replace_all(one, "#", number(i));
        text += one;
    }
    const std::size_t flat = variant.whole_triangles ? 0 : flat_keyframes(variant, positions);
    for (std::size_t i = 0; i < flat * kFragmentRows; ++i) {
        const std::size_t row = i / kFragmentRows * kRows + kVertexRows + i % kFragmentRows;
        text += "    row_" + number(i) + " = keyframe_rows[" + number(row) + "];\n";
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
    declarations += "layout(location = 4) in vec3 pixel_point[];\n" +
                    keyframe_points(variant.keyframes, "in", "[]") +
                    "layout(location = " + number(kFirstPoint) + ") out vec3 shown_from;\n";
    std::string choice;
    std::string point = "keyframe_point_0[i]";
    for (std::size_t i = 0; i < variant.keyframes; ++i) {
        std::string one = R"(
    if (shown < 0) {
        vec3 normal = cross(keyframe_point_#[1] - keyframe_point_#[0],
                            keyframe_point_#[2] - keyframe_point_#[0]);
        bool seen = true;
        for (int i = 0; i < 3; ++i) {
            seen = look(colors[#], depths[#], KEYFRAME, keyframe_point_#[i], normal,
                        pixel_point[i], sight) && seen;
        }
        shown = seen ? # : shown;
    }
)";
        replace_all(one, "KEYFRAME", keyframe_of_uniforms(i));
        replace_all(one, "#", number(i));
        choice += one;
        if (i > 0) {
            std::string chosen =
                "shown == " + number(i) + " ? keyframe_point_" + number(i) + "[i] : ";
            chosen += point;
            point = std::move(chosen);
        }
    }
    copies += "        shown_from = " + point + ";\n";
    const std::size_t flat = flat_keyframes(variant, positions);
    for (std::size_t i = 0; i < flat * kFragmentRows; ++i) {
        copies += "        row_" + number(i) + " = keyframe_rows[" + number(kRows) + " * shown + " +
                  number(kVertexRows + i) + "];\n";
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
            lookup_text(variant) + "void main() {\n    int shown = -1;\n    Sight sight;\n" +
            choice + R"(
    if (shown < 0) { return; }
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
    const std::size_t flat = flat_keyframes(variant, positions);
    std::string text = flat_rows(flat, "in") + uniforms(variant);
    if (variant.whole_triangles) {
        text += "layout(location = " + number(kFirstPoint) +
                ") in vec3 shown_from;\n"
                "layout(location = 5) flat in int shown;\n";
    } else {
        text += "layout(location = 4) in vec3 pixel_point;\n" +
                keyframe_points(variant.keyframes, "in");
    }
    text += lookup_text(variant);
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
    std::string text = "    Sight sight;\n    bool found = false;\n";
    // Derivatives first, where all fragments still go together.
    const bool whole = variant.whole_triangles;
    const std::size_t points = whole ? 1 : variant.keyframes;
    for (std::size_t i = 0; i < points; ++i) {
        std::string one = "    mat2x3 steps_# = mat2x3(dFdx(POINT), dFdy(POINT));\n";
        replace_all(one, "POINT", whole ? "shown_from" : "keyframe_point_#");
        replace_all(one, "#", number(i));
        text += one;
    }
    const std::size_t flat = flat_keyframes(variant, positions);
    for (std::size_t i = 0; i < variant.keyframes; ++i) {
        std::string one = R"(
    if (!found) {
        Keyframe keyframe = KEYFRAME;
        found = SEEN;
        vec4 seen = vec4(min(sight.color.rgb / sight.color.a, vec3(1.0)), 1.0);
        result = SHOWN;
)";
        if (positions) {
            one += R"(
        if (found) {
            show_point(points[#], layers[#], keyframe, sight, POINT, STEPS, nodes[#]);
        }
)";
        }
        one += "    }\n";
        std::string keyframe = keyframe_of_uniforms(i);
        if (whole && flat > 0) {
            keyframe = keyframe_of_flat(0);
        } else if (i < flat) {
            keyframe = keyframe_of_flat(i);
        }
        replace_all(one, "KEYFRAME", keyframe);
        replace_all(one, "SHOWN", whole ? "seen" : "found ? seen : result");
        replace_all(
            one,
            "SEEN",
            whole ? "shown == # && look_whole(colors[#], depths[#], keyframe, POINT, sight)"
                  : "look(colors[#], depths[#], keyframe, POINT, cross(steps_#[0], steps_#[1]), "
                    "pixel_point, sight)"
        );
        replace_all(one, "POINT", whole ? "shown_from" : "keyframe_point_#");
        replace_all(one, "STEPS", whole ? "steps_0" : "steps_#");
        replace_all(one, "#", number(i));
        text += one;
    }
    if (whole) {
        text += "    if (!found) { discard; }\n";
    }
    return text;
}

ProjectionUniforms ProjectionUniforms::of(GLuint program) noexcept {
    ProjectionUniforms locations;
    locations.rows_ = glGetUniformLocation(program, "keyframe_rows");
    locations.nodes_ = glGetUniformLocation(program, "nodes");
    locations.pixels_per_tangent_ = glGetUniformLocation(program, "pixels_per_tangent");
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
    const glm::vec2 scale(pixels_per_tangent(context.view));
    glUniform2f(pixels_per_tangent_, scale.x, scale.y);
}

} // namespace farfield::opengl
