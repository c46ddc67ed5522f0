#include "opengl/projection_shaders.hpp"

#include <farfield/gpu/keyframe_lookup.hpp>

#include <glm/ext/matrix_float3x3.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace farfield::opengl {

namespace {

std::string number(std::size_t value) {
    return std::to_string(value);
}

/// Repeats a text for every keyframe, its number in the place of each '#'.
std::string for_keyframes(const ProjectionVariant& variant, const std::string& text) {
    std::string all;
    for (std::size_t i = 0; i < variant.keyframes; ++i) {
        std::string one = text;
        for (std::size_t at = one.find('#'); at != std::string::npos; at = one.find('#', at)) {
            one.replace(at, 1, number(i));
        }
        all += one;
    }
    return all;
}

/// Looking up keyframes, in a fragment or a geometry shader.
std::string lookup_text(const ProjectionVariant& variant) {
    const std::string count = "[" + number(variant.keyframes) + "];\n";
    return "const float nothing = 65535.0;\n"
           "uniform mat3 to_pixel" +
           count + "uniform vec3 to_pixel_offset" + count + "uniform vec4 window" +
           count +                         // texels per tangent, middle
           "uniform vec4 source" + count + // corners
           "uniform vec4 kept" + count +   // nearest, steps a metre, offset, shift squared
           "uniform float page" + count +  // size of a texel in texture coordinates
           "uniform vec4 viewport;\n"
           "layout(binding = " +
           number(kKeyframeColorUnit) + ") uniform sampler2D colors" + count +
           "layout(binding = " + number(kKeyframeDepthUnit) + ") uniform usampler2D depths" +
           count + R"(
struct Four {
    vec2 at;      // what is filtered
    vec2 first;   // the lower left texel
    vec4 depths;  // upper left, upper right, lower right, lower left; so the weights
    vec4 weights;
    vec3 chosen;  // texel from the first, and its depth
    bool keeps;
};
bool is_inside(int k, vec3 place, vec2 at) {
    return place.z > 0.0 && all(greaterThanEqual(at, source[k].xy)) &&
           all(lessThan(at, source[k].zw));
}
Four four_at(usampler2D page_depths, int k, vec2 at) {
    Four four;
    four.at = clamp(at, source[k].xy + 0.5, source[k].zw - 0.5);
    vec2 corner = four.at - 0.5;
    four.first = floor(corner);
    vec2 share = corner - four.first;
    vec2 rest = 1.0 - share;
    // Of the four texels around this point, whatever a device rounds.
    four.depths = vec4(textureGather(page_depths, (four.first + 1.0) * page[k]));
    four.weights = vec4(rest.x, share.x, share.x, rest.x) *
                   vec4(share.y, share.y, rest.y, rest.y);
    vec4 weights = four.weights * vec4(lessThan(four.depths, vec4(nothing)));
    float most = max(max(weights.x, weights.y), max(weights.z, weights.w));
    // Of equals the first, row by row from below.
    four.chosen = weights.w == most ? vec3(0.0, 0.0, four.depths.w)
                : weights.z == most ? vec3(1.0, 0.0, four.depths.z)
                : weights.x == most ? vec3(0.0, 1.0, four.depths.x)
                                    : vec3(1.0, 1.0, four.depths.y);
    four.keeps = dot(weights, vec4(1.0)) >= 0.5;
    return four;
}
float tolerance(int k, vec3 place, vec2 at, vec3 normal) {
    vec2 tangents = (at - window[k].zw) / window[k].xy;
    vec3 in_camera = vec3(window[k].xy * normal.xy, dot(window[k].zw, normal.xy) + normal.z);
    float squared = dot(in_camera, in_camera);
    float along = abs(dot(normal, vec3(at, 1.0)));
    float least = sqrt(squared * (1.0 + dot(tangents, tangents))) / 16.0;
    float slope = place.z * (abs(normal.x) + abs(normal.y));
    return 1.0 + kept[k].y * (kept[k].z * sqrt(squared) + slope) / max(along, least);
}
// Pixels with a weight, as places have one.
bool is_near(int k, vec2 center, float depth, vec3 pixel) {
    float z = kept[k].x + depth / kept[k].y;
    vec3 seen = to_pixel[k] * vec3(center * z, z) + to_pixel_offset[k];
    vec2 shift = seen.xy * pixel.z - pixel.xy * seen.z;
    float scale = seen.z * pixel.z;
    return kept[k].w < 0.0 ||
           (seen.z > 0.0 && pixel.z > 0.0 && dot(shift, shift) <= kept[k].w * scale * scale);
}
struct Sight {
    vec4 color;
    ivec2 texel;
};
bool look(
    sampler2D page_colors, usampler2D page_depths, int k, vec3 place, vec3 normal, vec3 pixel,
    out Sight sight
) {
    vec2 at = place.xy / place.z;
    Four four = four_at(page_depths, k, at);
    float own = (place.z - kept[k].x) * kept[k].y;
    float most = tolerance(k, place, at, normal);
    bvec4 stand = lessThanEqual(abs(four.depths - own), vec4(most));
    bool filtered = dot(four.weights, vec4(not(stand))) == 0.0;
    vec2 center = four.first + four.chosen.xy + 0.5;
    sight.texel = ivec2(center);
    sight.color = textureLod(page_colors, (filtered ? four.at : center) * page[k], 0.0);
    return is_inside(k, place, at) && four.keeps && abs(four.chosen.z - own) <= most &&
           sight.color.a >= 0.5 && is_near(k, center, four.chosen.z, pixel);
}
bool look_whole(
    sampler2D page_colors, usampler2D page_depths, int k, vec3 place, out Sight sight
) {
    vec2 at = place.xy / place.z;
    Four four = four_at(page_depths, k, at);
    sight.texel = ivec2(four.first + four.chosen.xy);
    sight.color = textureLod(page_colors, four.at * page[k], 0.0);
    return is_inside(k, place, at) && four.keeps && sight.color.a >= 0.5;
}
)";
}

/// What positions keep of a texel that a keyframe shows.
constexpr const char* kPositionText = R"(
const float sqrt_half = 0.70710678;
void show_point(
    usampler2D page_points, usampler2D page_layers, ivec2 texel, vec2 at, mat2 to_texels, uint node
) {
    uvec4 found = texelFetch(page_points, texel, 0);
    point = found;
    layer = uvec2(0u, 0xFFFFFFFFu);
    if (found.w == 0xFFFFFFFFu) { return; }
    // Pixels per texel, from texels per pixel.
    mat2 to_pixels = inverse(to_texels);
    float half_diagonal = 0.5 * max(length(to_pixels[0] + to_pixels[1]),
                                    length(to_pixels[0] - to_pixels[1]));
    float moved = length(to_pixels * (vec2(texel) + 0.5 - at));
    // Errors of the page's own sampling are seen enlarged at most by the largest singular value.
    float squares = dot(to_pixels[0], to_pixels[0]) + dot(to_pixels[1], to_pixels[1]);
    float area = determinant(to_pixels);
    float scale = sqrt(0.5 * (squares + sqrt(max(squares * squares - 4.0 * area * area, 0.0))));
    float nested = uintBitsToFloat(texelFetch(page_layers, texel, 0).x);
    layer = uvec2(floatBitsToUint(max(half_diagonal, moved) / sqrt_half + nested * scale), node);
}
)";

} // namespace

std::string projection_vertex_head(const ProjectionVariant& variant) {
    const std::string count = "[" + number(variant.keyframes) + "];\n";
    return "uniform mat3 to_place" + count + "uniform vec3 to_place_offset" + count +
           for_keyframes(variant, "layout(location = 4 + #) out vec3 place_#;\n");
}

std::string projection_vertex_body(const ProjectionVariant& variant) {
    return for_keyframes(variant, "    place_# = to_place[#] * camera.xyz + to_place_offset[#];\n");
}

std::string projection_geometry_shader(
    const ProjectionVariant& variant, bool textured, bool clipped, bool positions
) {
    if (!variant.whole_triangles) {
        return "";
    }
    std::string declarations;
    std::string copies;
    const auto pass_on = [&](const std::string& location,
                             const std::string& type,
                             const std::string& name,
                             const std::string& quality = "") {
        const std::string head = "layout(location = " + location + ") " + quality;
        declarations += head + "in " + type + " " + name + "[];\n";
        declarations += head + "out " + type + " next_" + name + ";\n";
        copies += "        next_" + name + " = " + name + "[i];\n";
    };
    pass_on("0", "vec4", "shaded");
    if (textured) {
        pass_on("1", "vec2", "uv");
    }
    if (positions) {
        pass_on("2", "vec3", "shown_point");
        pass_on("3", "uint", "shown_item", "flat ");
    }
    for (std::size_t i = 0; i < variant.keyframes; ++i) {
        pass_on(number(4 + i), "vec3", "place_" + number(i));
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
    text += declarations + "layout(location = 8) flat out int keyframe;\n" + lookup_text(variant);
    text += R"(
void main() {
    bool seen;
    int shown = -1;
    Sight sight;
)";
    text += for_keyframes(variant, R"(
    seen = shown < 0;
    for (int i = 0; i < 3; ++i) {
        vec4 at = gl_in[i].gl_Position;
        seen = look(
            colors[#], depths[#], #, place_#[i],
            cross(place_#[1] - place_#[0], place_#[2] - place_#[0]),
            vec3(0.5 * (at.xy + at.w) * viewport.zw, at.w), sight
        ) && seen;
    }
    shown = seen ? # : shown;
)");
    text += "    for (int i = 0; i < 3; ++i) {\n"
            "        gl_Position = gl_in[i].gl_Position;\n" +
            copies +
            "        keyframe = shown;\n"
            "        EmitVertex();\n"
            "    }\n"
            "}\n";
    return text;
}

std::string projection_fragment_head(const ProjectionVariant& variant, bool positions) {
    std::string text = for_keyframes(variant, "layout(location = 4 + #) in vec3 place_#;\n");
    if (variant.whole_triangles) {
        text += "layout(location = 8) flat in int keyframe;\n";
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
    // Derivatives first, where all fragments still go together.
    std::string text = "    Sight sight;\n";
    if (!variant.whole_triangles) {
        text += "    vec3 pixel = vec3(gl_FragCoord.xy - viewport.xy, 1.0);\n";
        text +=
            for_keyframes(variant, "    vec3 normal_# = cross(dFdx(place_#), dFdy(place_#));\n");
    }
    if (positions) {
        text += for_keyframes(
            variant,
            "    vec2 at_# = place_#.xy / place_#.z;\n"
            "    mat2 to_texels_# = mat2(dFdx(at_#), dFdy(at_#));\n"
        );
    }
    const std::string seen =
        variant.whole_triangles
            ? "keyframe == # && look_whole(colors[#], depths[#], #, place_#, sight)"
            : "look(colors[#], depths[#], #, place_#, normal_#, pixel, sight)";
    std::string choices = for_keyframes(
        variant,
        "    else if (" + seen +
            ") {\n"
            "        result = vec4(min(sight.color.rgb / sight.color.a, vec3(1.0)), 1.0);\n" +
            (positions ? "        show_point(points[#], layers[#], sight.texel, at_#, "
                         "to_texels_#, nodes[#]);\n"
                       : "") +
            "    }\n"
    );
    // The first one has none before it.
    choices.replace(choices.find("else "), 5, "");
    return text + choices;
}

ProjectionUniforms ProjectionUniforms::of(GLuint program, const ProjectionVariant& variant) {
    ProjectionUniforms uniforms;
    for (std::size_t i = 0; i < variant.keyframes; ++i) {
        const auto location = [&](const char* name) {
            return glGetUniformLocation(program, (name + ("[" + number(i) + "]")).c_str());
        };
        uniforms.keyframes_[i] = {
            .to_place = location("to_place"),
            .to_place_offset = location("to_place_offset"),
            .to_pixel = location("to_pixel"),
            .to_pixel_offset = location("to_pixel_offset"),
            .window = location("window"),
            .source = location("source"),
            .kept = location("kept"),
            .page = location("page"),
            .node = location("nodes")};
    }
    uniforms.viewport_ = glGetUniformLocation(program, "viewport");
    return uniforms;
}

void ProjectionUniforms::set(const PassContext& context) const noexcept {
    for (std::size_t i = 0; i < context.keyframes.size(); ++i) {
        const DeviceKeyframe& shown = context.keyframes[i];
        const OfKeyframe& uniform = keyframes_[i];
        // In double up to here: eyes may be far from zero, and the matrices are not.
        const gpu::KeyframeTerms terms = gpu::keyframe_terms(*shown.keyframe, context.view);
        const glm::mat3 to_place(terms.to_place);
        const glm::vec3 to_place_offset(terms.to_place_offset);
        const glm::mat3 to_pixel(terms.to_pixel);
        const glm::vec3 to_pixel_offset(terms.to_pixel_offset);
        const glm::vec4 window(terms.per_tangent, terms.middle);
        const glm::vec4 source(terms.low, terms.high);
        // What is not tested has no square.
        const double most = std::min(
            terms.max_shift_px * terms.max_shift_px, double{std::numeric_limits<float>::max()}
        );
        const glm::vec4 kept(
            terms.nearest,
            terms.steps_per_m,
            terms.offset_m,
            std::isinf(terms.max_shift_px) ? -1.0 : most
        );
        glUniformMatrix3fv(uniform.to_place, 1, GL_FALSE, &to_place[0][0]);
        glUniform3fv(uniform.to_place_offset, 1, &to_place_offset[0]);
        glUniformMatrix3fv(uniform.to_pixel, 1, GL_FALSE, &to_pixel[0][0]);
        glUniform3fv(uniform.to_pixel_offset, 1, &to_pixel_offset[0]);
        glUniform4fv(uniform.window, 1, &window[0]);
        glUniform4fv(uniform.source, 1, &source[0]);
        glUniform4fv(uniform.kept, 1, &kept[0]);
        glUniform1f(uniform.page, 1.0F / static_cast<float>(shown.page_size));
        const auto unit = static_cast<GLuint>(i);
        glBindTextureUnit(kKeyframeColorUnit + unit, shown.colors);
        glBindTextureUnit(kKeyframeDepthUnit + unit, shown.depths);
        if (context.positions) {
            glUniform1ui(uniform.node, shown.keyframe->node);
            glBindTextureUnit(kKeyframePointUnit + unit, shown.points);
            glBindTextureUnit(kKeyframeLayerUnit + unit, shown.layers);
        }
    }
    glUniform4f(
        viewport_,
        static_cast<GLfloat>(context.viewport.x),
        static_cast<GLfloat>(context.viewport.y),
        static_cast<GLfloat>(context.viewport.width),
        static_cast<GLfloat>(context.viewport.height)
    );
}

} // namespace farfield::opengl
