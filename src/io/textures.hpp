#pragma once

#include "io/readers.hpp"
#include <farfield/image/picture.hpp>

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace farfield::io {

/// Size that an encoded picture announces, before anything is decoded.
struct PictureSize {
    std::uint64_t width = 0;
    std::uint64_t height = 0;
    int bit_depth = 8; ///< per channel
    int channels = 4;  ///< as stored
};

/// Size of a PNG from its header. Checked against the length of the file: what deflate cannot have
/// made is refused.
[[nodiscard]] Result<PictureSize> png_size(std::string_view bytes, const std::string& name);

/// 8-bit RGBA of a whole PNG in memory.
[[nodiscard]] Result<Picture>
decode_png(std::string_view bytes, const std::string& name, int max_side);

/// PNG or JPEG, told apart by their first bytes.
[[nodiscard]] Result<Picture>
decode_picture(std::string_view bytes, const std::string& name, int max_side);

/// Adds textures to a scene within the limits of the options. What cannot be had becomes a warning
/// and no texture.
class TextureStore {
  public:
    TextureStore(const Input& input, LoadedScene& loaded) : input_(input), loaded_(loaded) {}

    /// Decodes a picture; `name` is for warnings.
    [[nodiscard]] TextureId add(std::string_view bytes, const std::string& name);

    /// Reads a picture file, each file once.
    [[nodiscard]] TextureId load(const std::filesystem::path& path);

    /// True when some texel is not opaque; false for no texture.
    [[nodiscard]] bool has_alpha(TextureId texture) const {
        return texture != kNone<TextureId> && has_alpha_[index_of(texture)];
    }

  private:
    [[nodiscard]] TextureId leave_out(const std::string& reason);

    const Input& input_;
    LoadedScene& loaded_;
    std::map<std::string, TextureId> loads_;
    std::uint64_t bytes_ = 0;
    std::vector<bool> has_alpha_; ///< of each texture
};

} // namespace farfield::io
