#pragma once

#include <farfield/core/result.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace farfield::io {

/// Shortest decimal that reads back as the same number.
[[nodiscard]] std::string text(double value);

/// A word of a file for a message: cut to a readable length, unprintable bytes as '?'.
[[nodiscard]] std::string quote(std::string_view word);

/// Whole word as a number; "nan", "inf" and a leading '+' are read too.
[[nodiscard]] bool parse(std::string_view word, double& value) noexcept;
[[nodiscard]] bool parse(std::string_view word, std::int64_t& value) noexcept;

[[nodiscard]] std::string lower_case(std::string_view word);

/// "file:line: message" as `bad_data`.
[[nodiscard]] tl::unexpected<Error>
fail_at(std::string_view file, std::size_t line, const std::string& message);

/// Walks the words of a text file and knows the line.
class Scanner {
  public:
    /// What the format allows beside words and blanks.
    struct Syntax {
        char comment = '\0';          ///< a word that begins so ends its line; '\0': no comments
        bool continued_lines = false; ///< a backslash before the line's end joins the next line
    };

    Scanner(std::string_view text, Syntax syntax) noexcept : text_(text), syntax_(syntax) {}

    /// Next word of this line; empty at its end.
    [[nodiscard]] std::string_view word_in_line() noexcept;

    /// Next word of this line or of one below; empty at the end of the text.
    [[nodiscard]] std::string_view word() noexcept;

    /// What is left of this line without blanks around it; comments belong to it.
    [[nodiscard]] std::string_view rest_of_line() noexcept;

    /// To the beginning of the next line.
    void next_line() noexcept;

    /// Back to a place inside the word that was read last.
    void return_to(const char* place) noexcept {
        position_ = static_cast<std::size_t>(place - text_.data());
    }

    [[nodiscard]] bool at_end() const noexcept { return position_ >= text_.size(); }
    [[nodiscard]] std::size_t line() const noexcept { return line_; } ///< from 1
    [[nodiscard]] std::size_t remaining() const noexcept { return text_.size() - position_; }

  private:
    /// Length of a line continuation at `position`; 0 when there is none.
    [[nodiscard]] std::size_t continuation(std::size_t position) const noexcept;

    std::string_view text_;
    Syntax syntax_;
    std::size_t position_ = 0;
    std::size_t line_ = 1;
};

} // namespace farfield::io
