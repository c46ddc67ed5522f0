#include "io/file.hpp"
#include "io/png16.hpp"
#include "io/textures.hpp"
#include <farfield/io/png.hpp>

#include <png.h>

#include <array>
#include <csetjmp>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace farfield::io {
namespace {

constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";

unsigned byte_at(std::string_view bytes, std::size_t position) noexcept {
    return static_cast<unsigned char>(bytes[position]);
}

std::uint64_t number_at(std::string_view bytes, std::size_t position) noexcept {
    std::uint64_t number = 0;
    for (std::size_t i = 0; i < 4; ++i) {
        number = number * 256U + byte_at(bytes, position + i);
    }
    return number;
}

/// What libpng reads from: a place in memory.
struct Source {
    std::string_view bytes;
    std::size_t position = 0;
};

extern "C" {
static void read_bytes(png_structp png, png_bytep target, png_size_t count) {
    auto& source = *static_cast<Source*>(png_get_io_ptr(png));
    if (count > source.bytes.size() - source.position) {
        png_error(png, "the file ends too early");
    }
    std::memcpy(target, source.bytes.data() + source.position, count);
    source.position += count;
}

static void ignore_warning(png_structp /*png*/, png_const_charp /*message*/) {}

static void keep_error(png_structp png, png_const_charp message) {
    std::strncpy(static_cast<char*>(png_get_error_ptr(png)), message, 127);
    png_longjmp(png, 1);
}
}

/// Reads the rows of a 16-bit greyscale PNG. Returns by longjmp on errors, so it owns nothing with
/// a destructor.
bool read_rows(Source& source, std::uint16_t* samples, std::uint64_t width, char* error) {
    png_structp png =
        png_create_read_struct(PNG_LIBPNG_VER_STRING, error, keep_error, ignore_warning);
    if (png == nullptr) {
        return false;
    }
    png_infop info = png_create_info_struct(png);
    if (info == nullptr || setjmp(png_jmpbuf(png)) != 0) { // NOLINT(cert-err52-cpp): libpng's way
        png_destroy_read_struct(&png, &info, nullptr);
        return false;
    }
    png_set_read_fn(png, &source, read_bytes);
    png_read_info(png, info);
    png_set_swap(png); // files are big-endian
    const int passes = png_set_interlace_handling(png);
    png_read_update_info(png, info);
    const png_uint_32 height = png_get_image_height(png, info);
    for (int pass = 0; pass < passes; ++pass) {
        for (png_uint_32 row = 0; row < height; ++row) {
            png_read_row(png, reinterpret_cast<png_bytep>(samples + row * width), nullptr);
        }
    }
    png_read_end(png, nullptr);
    png_destroy_read_struct(&png, &info, nullptr);
    return true;
}

tl::unexpected<Error> too_large(const std::string& name, const PictureSize& size, int max_side) {
    return fail(
        ErrorCode::unsupported,
        name + " is " + std::to_string(size.width) + " x " + std::to_string(size.height) +
            " texels, more than " + std::to_string(max_side) + " a side"
    );
}

} // namespace

Result<PictureSize> png_size(std::string_view bytes, const std::string& name) {
    constexpr std::size_t kHeaderEnd = 33; // signature and the header chunk
    if (bytes.size() < kHeaderEnd || bytes.substr(0, kSignature.size()) != kSignature ||
        bytes.substr(12, 4) != "IHDR") {
        return fail(ErrorCode::bad_data, name + " is not a PNG");
    }
    PictureSize size;
    size.width = number_at(bytes, 16);
    size.height = number_at(bytes, 20);
    size.bit_depth = static_cast<int>(byte_at(bytes, 24));
    const unsigned color_type = byte_at(bytes, 25);
    size.channels = color_type == 2U ? 3 : color_type == 4U ? 2 : color_type == 6U ? 4 : 1;
    // Deflate packs at most 1032 bytes into one.
    constexpr std::uint64_t kDeflateLimit = 1032;
    const std::uint64_t bits = static_cast<std::uint64_t>(size.channels) *
                               static_cast<std::uint64_t>(size.bit_depth) * size.width;
    if (size.width == 0 || size.height == 0 || size.width > INT32_MAX || size.height > INT32_MAX ||
        (bits / 8U) * size.height > kDeflateLimit * bytes.size()) {
        return fail(
            ErrorCode::bad_data,
            name + " announces " + std::to_string(size.width) + " x " +
                std::to_string(size.height) + " texels in " + std::to_string(bytes.size()) +
                " bytes"
        );
    }
    return size;
}

Result<Picture> decode_png(std::string_view bytes, const std::string& name, int max_side) {
    const auto size = png_size(bytes, name);
    if (!size) {
        return tl::unexpected(size.error());
    }
    const auto limit = static_cast<std::uint64_t>(max_side);
    if (size->width > limit || size->height > limit) {
        return too_large(name, *size, max_side);
    }
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    const auto failed = [&image, &name] {
        std::string message = name + ": " + image.message;
        png_image_free(&image);
        return fail(ErrorCode::bad_data, std::move(message));
    };
    if (png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()) == 0) {
        return failed();
    }
    image.format = PNG_FORMAT_RGBA;
    Picture picture;
    picture.width = static_cast<int>(image.width);
    picture.height = static_cast<int>(image.height);
    picture.rgba.resize(PNG_IMAGE_SIZE(image));
    if (png_image_finish_read(&image, nullptr, picture.rgba.data(), 0, nullptr) == 0) {
        return failed();
    }
    return picture;
}

Result<GreyImage>
decode_grey16(std::string_view bytes, const std::string& name, std::uint64_t max_samples) {
    const auto size = png_size(bytes, name);
    if (!size) {
        return tl::unexpected(size.error());
    }
    constexpr unsigned kGrey = 0;
    if (size->bit_depth != 16 || byte_at(bytes, 25) != kGrey) {
        return fail(
            ErrorCode::bad_data,
            name + " has " + std::to_string(size->channels) + " channels of " +
                std::to_string(size->bit_depth) + " bits instead of one of 16"
        );
    }
    if (size->width > max_samples / size->height) {
        return fail(
            ErrorCode::unsupported,
            name + " has " + std::to_string(size->width) + " x " + std::to_string(size->height) +
                " samples, more than " + std::to_string(max_samples)
        );
    }
    GreyImage image;
    image.width = size->width;
    image.height = size->height;
    image.samples.resize(size->width * size->height);
    Source source{bytes};
    std::array<char, 128> error{};
    if (!read_rows(source, image.samples.data(), size->width, error.data())) {
        return fail(ErrorCode::bad_data, name + ": " + error.data());
    }
    return image;
}

Result<Picture> read_png(const std::filesystem::path& path) {
    // A picture of the largest size that does not compress at all, and as much for other chunks.
    constexpr std::uint64_t kMaxBytes = 16ULL * kMaxPictureSide * kMaxPictureSide;
    const auto bytes = read_file(path, kMaxBytes);
    if (!bytes) {
        return tl::unexpected(bytes.error());
    }
    return decode_png(*bytes, path.string(), kMaxPictureSide);
}

Result<std::vector<std::uint8_t>> encode_png(const Picture& picture) {
    if (picture.width < 1 || picture.height < 1 || picture.width > kMaxPictureSide ||
        picture.height > kMaxPictureSide) {
        return fail(
            ErrorCode::invalid_argument,
            "a picture of " + std::to_string(picture.width) + " x " +
                std::to_string(picture.height) + " pixels"
        );
    }
    const std::size_t pixels =
        static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height);
    if (picture.rgba.size() != 4U * pixels) {
        return fail(
            ErrorCode::invalid_argument,
            "a picture of " + std::to_string(picture.rgba.size()) + " bytes instead of " +
                std::to_string(4U * pixels)
        );
    }
    bool opaque = true;
    for (std::size_t i = 0; i < pixels && opaque; ++i) {
        opaque = picture.rgba[4U * i + 3U] == 255;
    }
    std::vector<std::uint8_t> rgb;
    if (opaque) {
        rgb.reserve(3U * pixels);
        for (std::size_t i = 0; i < pixels; ++i) {
            const auto* const first = picture.rgba.data() + 4U * i;
            rgb.insert(rgb.end(), first, first + 3);
        }
    }
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = static_cast<png_uint_32>(picture.width);
    image.height = static_cast<png_uint_32>(picture.height);
    image.format = opaque ? PNG_FORMAT_RGB : PNG_FORMAT_RGBA;
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
    std::vector<std::uint8_t> bytes(size);
    const void* const rows = opaque ? rgb.data() : picture.rgba.data();
    if (png_image_write_to_memory(&image, bytes.data(), &size, 0, rows, 0, nullptr) == 0) {
        return fail(ErrorCode::device, std::string("cannot be encoded: ") + image.message);
    }
    bytes.resize(size);
    return bytes;
}

Result<void> write_png(const std::filesystem::path& path, const Picture& picture) {
    const auto bytes = encode_png(picture);
    if (!bytes) {
        return fail(bytes.error().code, path.string() + ": " + bytes.error().message);
    }
    return write_file(path, {reinterpret_cast<const char*>(bytes->data()), bytes->size()});
}

} // namespace farfield::io
