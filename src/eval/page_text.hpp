#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

/// Text as it goes into pages, plots and tables. Nothing here asks the locale.
namespace farfield::eval::detail {

/// What stands for a figure that was not measured.
inline constexpr std::string_view kNotMeasured = "\u2014";

/// The text with bytes that are not UTF-8 replaced by U+FFFD.
[[nodiscard]] std::string valid_utf8(std::string_view text);

/// The text as content or as an attribute in double quotes of HTML and SVG: valid UTF-8, markup
/// escaped, control characters, which XML refuses, replaced.
[[nodiscard]] std::string escaped(std::string_view text);

/// Characters of a valid UTF-8 text.
[[nodiscard]] std::size_t character_count(std::string_view text) noexcept;

/// The text, or its beginning and an ellipsis where it has more than `most` characters. @pre
/// valid UTF-8, most >= 1
[[nodiscard]] std::string shortened(std::string_view text, std::size_t most);

/// A number with a fixed count of decimals; infinity as such, NaN as not measured.
[[nodiscard]] std::string fixed_text(double value, int decimals);

/// A number with three or four digits that count, thousands apart: 12.3, 1,234, 0.00123.
[[nodiscard]] std::string figure_text(double value);
[[nodiscard]] std::string figure_text(const std::optional<double>& value);

/// A whole number, thousands apart.
[[nodiscard]] std::string whole_text(std::uint64_t value);

/// A number of an axis: as short as it can be said with six digits.
[[nodiscard]] std::string tick_text(double value);

/// Bytes for a `data:` URI. RFC 4648, section 4.
[[nodiscard]] std::string base64(std::span<const std::uint8_t> bytes);

} // namespace farfield::eval::detail
