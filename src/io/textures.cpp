#include "io/textures.hpp"

#include "io/file.hpp"

#include <tiny_gltf.h>

#include <optional>
#include <system_error>
#include <utility>

namespace farfield::io {
namespace {

unsigned byte_at(std::string_view bytes, std::size_t position) noexcept {
    return static_cast<unsigned char>(bytes[position]);
}

/// Size from the first frame header of a JPEG; nothing when there is none.
std::optional<PictureSize> jpeg_size(std::string_view bytes) noexcept {
    std::size_t position = 2;
    while (position + 9 < bytes.size()) {
        if (byte_at(bytes, position) != 0xFFU) {
            return std::nullopt;
        }
        const unsigned marker = byte_at(bytes, position + 1);
        if (marker == 0xFFU) { // fill byte
            ++position;
            continue;
        }
        const bool frame = marker >= 0xC0U && marker <= 0xCFU && marker != 0xC4U &&
                           marker != 0xC8U && marker != 0xCCU;
        if (frame) {
            PictureSize size;
            size.height = byte_at(bytes, position + 5) * 256U + byte_at(bytes, position + 6);
            size.width = byte_at(bytes, position + 7) * 256U + byte_at(bytes, position + 8);
            return size;
        }
        position += 2U + byte_at(bytes, position + 2) * 256U + byte_at(bytes, position + 3);
    }
    return std::nullopt;
}

bool is_translucent(const std::vector<std::uint8_t>& rgba) noexcept {
    for (std::size_t i = 3; i < rgba.size(); i += 4) {
        if (rgba[i] != 255) {
            return true;
        }
    }
    return false;
}

Result<Picture> decode_jpeg(std::string_view bytes, const std::string& name, int max_side) {
    const auto size = jpeg_size(bytes);
    if (!size || size->width == 0 || size->height == 0) {
        return fail(ErrorCode::bad_data, name + ": a JPEG without a frame header");
    }
    const auto limit = static_cast<std::uint64_t>(max_side);
    if (size->width > limit || size->height > limit) {
        return fail(
            ErrorCode::unsupported,
            name + " is " + std::to_string(size->width) + " x " + std::to_string(size->height) +
                " texels, more than " + std::to_string(max_side) + " a side"
        );
    }
    // A block of 64 samples takes at least one bit for its mean, and no component is sampled more
    // coarsely than 4 x 4: 8192 texels a byte are out of reach.
    constexpr std::uint64_t kTexelsPerByte = 8192;
    if (size->width * size->height > kTexelsPerByte * bytes.size()) {
        return fail(
            ErrorCode::bad_data,
            name + " announces " + std::to_string(size->width) + " x " +
                std::to_string(size->height) + " texels in " + std::to_string(bytes.size()) +
                " bytes"
        );
    }
    tinygltf::Image image;
    std::string error;
    std::string warning;
    const bool decoded = tinygltf::LoadImageData(
        &image,
        0,
        &error,
        &warning,
        0,
        0,
        reinterpret_cast<const unsigned char*>(bytes.data()),
        static_cast<int>(bytes.size()),
        nullptr
    );
    const std::size_t expected = size->width * size->height * 4U;
    if (!decoded || image.bits != 8 || image.component != 4 || image.image.size() != expected) {
        return fail(ErrorCode::bad_data, name + ": the JPEG cannot be decoded");
    }
    Picture picture;
    picture.width = image.width;
    picture.height = image.height;
    picture.rgba = std::move(image.image);
    return picture;
}

} // namespace

Result<Picture> decode_picture(std::string_view bytes, const std::string& name, int max_side) {
    if (bytes.substr(0, 4) == "\x89PNG") {
        return decode_png(bytes, name, max_side);
    }
    if (bytes.substr(0, 3) == "\xFF\xD8\xFF" && bytes.size() <= INT32_MAX) {
        return decode_jpeg(bytes, name, max_side);
    }
    return fail(ErrorCode::unsupported, name + " is neither a PNG nor a JPEG");
}

TextureId TextureStore::leave_out(const std::string& reason) {
    loaded_.warnings.push_back("a texture is left out: " + reason);
    return kNone<TextureId>;
}

TextureId TextureStore::add(std::string_view bytes, const std::string& name) {
    auto picture = decode_picture(bytes, name, input_.options.max_texture_side);
    if (!picture) {
        return leave_out(picture.error().message);
    }
    bytes_ += picture->rgba.size();
    if (bytes_ > input_.options.max_texture_bytes) {
        bytes_ -= picture->rgba.size();
        return leave_out(
            name + " would make more than " + std::to_string(input_.options.max_texture_bytes) +
            " bytes of textures"
        );
    }
    const auto id = make_id<TextureId>(loaded_.scene.textures.size());
    has_alpha_.push_back(is_translucent(picture->rgba));
    loaded_.scene.textures.push_back({picture->width, picture->height, std::move(picture->rgba)});
    return id;
}

TextureId TextureStore::load(const std::filesystem::path& path) {
    std::error_code failure;
    const std::filesystem::path full = std::filesystem::weakly_canonical(path, failure);
    const std::string key = failure ? path.string() : full.string();
    if (const auto found = loads_.find(key); found != loads_.end()) {
        return found->second;
    }
    const auto bytes = read_file(path, input_.options.max_file_bytes);
    const TextureId id =
        bytes ? add(*bytes, path.filename().string()) : leave_out(bytes.error().message);
    loads_.emplace(key, id);
    return id;
}

} // namespace farfield::io
