#include "page_text.hpp"

#include <farfield/core/assert.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace farfield::eval::detail {

namespace {

bool continues_character(char byte) noexcept {
    return (static_cast<unsigned char>(byte) & 0xC0U) == 0x80U;
}

std::string with_thousands_apart(std::string digits) {
    const std::size_t whole = std::min(digits.find('.'), digits.size());
    const std::size_t first = digits.starts_with('-') ? 1 : 0;
    for (std::size_t at = whole; at > first + 3; at -= 3) {
        digits.insert(at - 3, ",");
    }
    return digits;
}

std::string written(double value, std::chars_format format, int precision) {
    std::array<char, 400> text{}; // the largest double has 309 digits before the point
    const auto end =
        std::to_chars(text.data(), text.data() + text.size(), value, format, precision);
    FARFIELD_ASSERT(end.ec == std::errc());
    return {text.data(), end.ptr};
}

} // namespace

std::string valid_utf8(std::string_view text) {
    using nlohmann::json;
    const std::string quoted = json(text).dump(-1, ' ', false, json::error_handler_t::replace);
    return json::parse(quoted).get<std::string>();
}

std::string escaped(std::string_view text) {
    std::string result;
    for (const char letter : valid_utf8(text)) {
        switch (letter) {
        case '&':
            result += "&amp;";
            break;
        case '<':
            result += "&lt;";
            break;
        case '>':
            result += "&gt;";
            break;
        case '"':
            result += "&quot;";
            break;
        case '\n':
        case '\t':
            result += ' ';
            break;
        default:
            if (static_cast<unsigned char>(letter) < 0x20U || letter == '\x7F') {
                result += "\uFFFD";
            } else {
                result += letter;
            }
        }
    }
    return result;
}

std::size_t character_count(std::string_view text) noexcept {
    const auto count =
        std::count_if(text.begin(), text.end(), [](char c) { return !continues_character(c); });
    return static_cast<std::size_t>(count);
}

std::string shortened(std::string_view text, std::size_t most) {
    FARFIELD_ASSERT(most >= 1);
    if (character_count(text) <= most) {
        return std::string(text);
    }
    std::size_t end = 0;
    for (std::size_t kept = 0; kept + 1 < most; ++kept) {
        do {
            ++end;
        } while (end < text.size() && continues_character(text[end]));
    }
    return std::string(text.substr(0, end)) + "\u2026";
}

std::string fixed_text(double value, int decimals) {
    if (std::isnan(value)) {
        return std::string(kNotMeasured);
    }
    if (std::isinf(value)) {
        return value > 0.0 ? "\u221E" : "-\u221E";
    }
    return written(value, std::chars_format::fixed, decimals);
}

std::string figure_text(double value) {
    constexpr double kLargest = 1e12;
    constexpr double kSmallest = 1e-4;
    const double size = std::abs(value);
    if (!std::isfinite(value) || value == 0.0) {
        return fixed_text(value, 0);
    }
    if (size >= kLargest || size < kSmallest) {
        return written(value, std::chars_format::scientific, 2);
    }
    if (size >= 100.0) {
        return with_thousands_apart(fixed_text(value, 0));
    }
    constexpr int kDecimalsOfOne = 2;
    return fixed_text(value, kDecimalsOfOne - static_cast<int>(std::floor(std::log10(size))));
}

std::string figure_text(const std::optional<double>& value) {
    return value ? figure_text(*value) : std::string(kNotMeasured);
}

std::string whole_text(std::uint64_t value) {
    return with_thousands_apart(std::to_string(value));
}

std::string tick_text(double value) {
    constexpr double kLargest = 1e9;
    const double size = std::abs(value);
    if (size >= 1.0 && size < kLargest && value == std::round(value)) {
        return with_thousands_apart(fixed_text(value, 0));
    }
    return written(value, std::chars_format::general, 6);
}

std::string base64(std::span<const std::uint8_t> bytes) {
    constexpr std::string_view kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t at = 0; at < bytes.size(); at += 3) {
        const std::size_t count = std::min<std::size_t>(3, bytes.size() - at);
        std::uint32_t group = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            group = group << 8U | (i < count ? bytes[at + i] : 0U);
        }
        for (std::size_t digit = 0; digit < 4; ++digit) {
            const std::uint32_t value = group >> (18U - 6U * digit) & 0x3FU;
            text += digit <= count ? kDigits[value] : '=';
        }
    }
    return text;
}

} // namespace farfield::eval::detail
