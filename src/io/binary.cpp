#include "io/binary.hpp"

#include <memory>
#include <zstd.h>

namespace farfield::io {
namespace {

constexpr std::uint32_t kByteOrder = 0x01020304;
constexpr std::uint32_t kOtherByteOrder = 0x04030201;

} // namespace

void append(std::string& bytes, const Signature& signature) {
    bytes += signature.magic;
    append(bytes, kByteOrder);
    append(bytes, signature.version);
}

Result<ByteReader>
after_signature(std::string_view bytes, const Signature& signature, const std::string& name) {
    if (bytes.substr(0, signature.magic.size()) != signature.magic) {
        return fail(ErrorCode::bad_data, name + " is no " + std::string(signature.what));
    }
    ByteReader reader(bytes.substr(signature.magic.size()));
    std::uint32_t byte_order = 0;
    std::uint32_t version = 0;
    if (!reader.take(byte_order) || !reader.take(version)) {
        return fail(
            ErrorCode::bad_data,
            name + " ends in its header, after " + std::to_string(bytes.size()) + " bytes"
        );
    }
    if (byte_order == kOtherByteOrder) {
        return fail(ErrorCode::unsupported, name + " has the other byte order");
    }
    if (byte_order != kByteOrder) {
        return fail(
            ErrorCode::bad_data,
            name + " has a damaged header: its byte order is " + std::to_string(byte_order)
        );
    }
    if (version != signature.version) {
        return fail(
            ErrorCode::unsupported,
            name + " has version " + std::to_string(version) + " of the format, expected " +
                std::to_string(signature.version)
        );
    }
    return reader;
}

Result<void> check_byte_order(const Signature& signature, const std::string& name) {
    if (!kLittleEndian) {
        return fail(
            ErrorCode::unsupported,
            name + ": no " + std::string(signature.what) + " on big-endian machines"
        );
    }
    return {};
}

Result<std::string> pack(std::string_view content, std::uint64_t max_ratio, int level) {
    struct Free {
        void operator()(ZSTD_CCtx* context) const noexcept { ZSTD_freeCCtx(context); }
    };
    const std::unique_ptr<ZSTD_CCtx, Free> context(ZSTD_createCCtx());
    if (!context) {
        return fail(ErrorCode::out_of_memory, "no memory for zstd");
    }
    ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
    ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, level);
    std::string bytes(ZSTD_compressBound(content.size()), '\0');
    const std::size_t size =
        ZSTD_compress2(context.get(), bytes.data(), bytes.size(), content.data(), content.size());
    if (ZSTD_isError(size) != 0U) {
        return fail(ErrorCode::out_of_memory, std::string("zstd: ") + ZSTD_getErrorName(size));
    }
    bytes.resize(size);
    if (content.size() / max_ratio >= size) {
        // A frame that zstd skips, of at least one byte after its own header.
        const auto filling = static_cast<std::uint32_t>(content.size() / max_ratio - size + 1);
        append(bytes, std::uint32_t{ZSTD_MAGIC_SKIPPABLE_START});
        append(bytes, filling);
        bytes.append(filling, '\0');
    }
    return bytes;
}

Result<std::string>
unpack(std::string_view packed, std::uint64_t content_bytes, const std::string& name) {
    std::string content(content_bytes, '\0');
    const std::size_t size =
        ZSTD_decompress(content.data(), content.size(), packed.data(), packed.size());
    if (ZSTD_isError(size) != 0U) {
        return fail(ErrorCode::bad_data, name + " cannot be unpacked: " + ZSTD_getErrorName(size));
    }
    if (size != content.size()) {
        return fail(
            ErrorCode::bad_data,
            name + " has " + std::to_string(size) + " bytes of content, its header says " +
                std::to_string(content.size())
        );
    }
    return content;
}

} // namespace farfield::io
