#include "io/png16.hpp"
#include "io/readers.hpp"
#include "io/text.hpp"
#include "io/textures.hpp"
#include <farfield/io/height_field.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <system_error>
#include <utility>

namespace farfield::io {
namespace {

struct Layout {
    double width = 0.0;
    double height = 0.0;
    double spacing_m = 0.0;
    double scale = 0.0;
    double offset = 0.0;
};

Result<Layout> read_layout(const std::filesystem::path& path) {
    constexpr std::uint64_t kMaxBytes = 1ULL << 20U; // five numbers and a few remarks
    const auto bytes = read_file(path, kMaxBytes);
    if (!bytes) {
        return tl::unexpected(bytes.error());
    }
    const auto json = nlohmann::json::parse(*bytes, nullptr, false);
    if (!json.is_object()) {
        return fail(ErrorCode::bad_data, path.string() + " is not a JSON object");
    }
    Layout layout;
    const std::array<std::pair<const char*, double*>, 5> fields = {{
        {"width", &layout.width},
        {"height", &layout.height},
        {"spacing_m", &layout.spacing_m},
        {"height_scale", &layout.scale},
        {"height_offset", &layout.offset},
    }};
    for (const auto& [name, value] : fields) {
        const auto found = json.find(name);
        if (found == json.end() || !found->is_number()) {
            return fail(ErrorCode::bad_data, path.string() + " has no number " + quote(name));
        }
        *value = found->get<double>();
    }
    if (!(layout.spacing_m > 0.0)) {
        return fail(
            ErrorCode::bad_data, path.string() + ": spacing_m is " + text(layout.spacing_m)
        );
    }
    return layout;
}

/// The picture beside a height field; empty when there is none.
std::filesystem::path find_colour(const Input& input, const std::string& stem) {
    for (const char* const suffix : {"_colour", "_ortho"}) {
        for (const char* const extension : {".png", ".jpg", ".jpeg"}) {
            std::filesystem::path path = input.folder / (stem + suffix + extension);
            if (std::error_code ignored; std::filesystem::is_regular_file(path, ignored)) {
                return path;
            }
        }
    }
    return {};
}

Mesh make_terrain(const GreyImage& image, const Layout& layout) {
    const auto [lowest, highest] = std::minmax_element(image.samples.begin(), image.samples.end());
    const auto height_of = [&layout](double sample) {
        return sample * layout.scale + layout.offset;
    };
    Mesh mesh;
    mesh.origin.y = 0.5 * (height_of(*lowest) + height_of(*highest));
    mesh.positions.reserve(image.samples.size());
    mesh.texcoords.reserve(image.samples.size());
    const double columns = static_cast<double>(image.width);
    const double rows = static_cast<double>(image.height);
    for (std::uint64_t row = 0; row < image.height; ++row) {
        for (std::uint64_t column = 0; column < image.width; ++column) {
            const double x = static_cast<double>(column);
            const double z = static_cast<double>(row);
            mesh.positions.emplace_back(
                (x - 0.5 * (columns - 1.0)) * layout.spacing_m,
                height_of(image.samples[row * image.width + column]) - mesh.origin.y,
                (z - 0.5 * (rows - 1.0)) * layout.spacing_m
            );
            mesh.texcoords.emplace_back((x + 0.5) / columns, (z + 0.5) / rows);
        }
    }
    mesh.indices.reserve(6 * (image.width - 1) * (image.height - 1));
    for (std::uint64_t row = 0; row + 1 < image.height; ++row) {
        for (std::uint64_t column = 0; column + 1 < image.width; ++column) {
            const auto north_west = static_cast<std::uint32_t>(row * image.width + column);
            const std::uint32_t north_east = north_west + 1;
            const auto south_west = static_cast<std::uint32_t>(north_west + image.width);
            const std::uint32_t south_east = south_west + 1;
            // Counter-clockwise from above.
            mesh.indices.insert(
                mesh.indices.end(),
                {north_west, south_west, south_east, north_west, south_east, north_east}
            );
        }
    }
    mesh.splittable = true;
    compute_normals(mesh);
    update_bounds(mesh);
    return mesh;
}

} // namespace

Result<void> read_height_field(const Input& input, LoadedScene& loaded) {
    auto image = decode_grey16(input.bytes, input.name, kMaxHeightSamples);
    if (!image) {
        return tl::unexpected(std::move(image.error()));
    }
    if (image->width < 2 || image->height < 2) {
        return fail(
            ErrorCode::unsupported,
            input.name + " has " + std::to_string(image->width) + " x " +
                std::to_string(image->height) + " samples, no square to cut into triangles"
        );
    }
    const std::string stem = std::filesystem::path(input.name).stem().string();
    const std::string layout_name = stem + ".json";
    const auto layout = read_layout(input.folder / layout_name);
    if (!layout) {
        return tl::unexpected(layout.error());
    }
    if (layout->width != static_cast<double>(image->width) ||
        layout->height != static_cast<double>(image->height)) {
        return fail(
            ErrorCode::bad_data,
            input.name + " has " + std::to_string(image->width) + " x " +
                std::to_string(image->height) + " samples, " + layout_name + " announces " +
                text(layout->width) + " x " + text(layout->height)
        );
    }
    Mesh mesh = make_terrain(*image, *layout);
    mesh.name = stem;
    MeshPart part{0, static_cast<std::uint32_t>(mesh.indices.size())};
    if (const auto colour = find_colour(input, stem); !colour.empty()) {
        TextureStore textures(input, loaded);
        if (const TextureId texture = textures.load(colour); texture != kNone<TextureId>) {
            part.material = make_id<MaterialId>(loaded.scene.materials.size());
            loaded.scene.materials.push_back({glm::vec4(1.0F), texture});
        }
    }
    mesh.parts.push_back(part);
    loaded.scene.meshes.push_back(std::move(mesh));
    loaded.scene.instances.push_back({MeshId{0}});
    return {};
}

} // namespace farfield::io
