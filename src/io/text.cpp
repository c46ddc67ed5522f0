#include "io/text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>

namespace farfield::io {
namespace {

bool is_blank(char c) noexcept {
    return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

} // namespace

std::string text(double value) {
    std::array<char, 32> buffer{};
    const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
    return error == std::errc{} ? std::string(buffer.data(), end) : std::string("?");
}

std::string quote(std::string_view word) {
    constexpr std::size_t kLongest = 40;
    std::string result = "'";
    for (const char c : word.substr(0, kLongest)) {
        result += c >= ' ' && c <= '~' ? c : '?';
    }
    return result + (word.size() > kLongest ? "...'" : "'");
}

bool parse(std::string_view word, double& value) noexcept {
    if (!word.empty() && word.front() == '+') {
        word.remove_prefix(1);
    }
    const char* const end = word.data() + word.size();
    const auto [stop, error] = std::from_chars(word.data(), end, value);
    if (error == std::errc::result_out_of_range && stop == end) {
        // from_chars does not tell 1e999 from 1e-999; strtod does, and needs an end.
        std::array<char, 64> copy{};
        if (word.size() >= copy.size()) {
            return false;
        }
        std::copy(word.begin(), word.end(), copy.begin());
        value = std::strtod(copy.data(), nullptr);
        return true;
    }
    return error == std::errc{} && stop == end;
}

bool parse(std::string_view word, std::int64_t& value) noexcept {
    if (!word.empty() && word.front() == '+') {
        word.remove_prefix(1);
    }
    const char* const end = word.data() + word.size();
    const auto [stop, error] = std::from_chars(word.data(), end, value);
    return error == std::errc{} && stop == end;
}

std::string lower_case(std::string_view word) {
    std::string result(word);
    std::transform(result.begin(), result.end(), result.begin(), [](char c) {
        return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    });
    return result;
}

tl::unexpected<Error> fail_at(std::string_view file, std::size_t line, const std::string& message) {
    return fail(
        ErrorCode::bad_data, std::string(file) + ':' + std::to_string(line) + ": " + message
    );
}

std::size_t Scanner::continuation(std::size_t position) const noexcept {
    if (!syntax_.continued_lines || text_[position] != '\\') {
        return 0;
    }
    const std::string_view after = text_.substr(position + 1, 2);
    if (after.substr(0, 1) == "\n") {
        return 2;
    }
    return after == "\r\n" ? 3 : 0;
}

std::string_view Scanner::word_in_line() noexcept {
    while (position_ < text_.size()) {
        if (const std::size_t joined = continuation(position_); joined != 0) {
            position_ += joined;
            ++line_;
        } else if (is_blank(text_[position_])) {
            ++position_;
        } else {
            break;
        }
    }
    if (at_end() || text_[position_] == '\n' ||
        (syntax_.comment != '\0' && text_[position_] == syntax_.comment)) {
        return {};
    }
    const std::size_t begin = position_;
    while (position_ < text_.size() && !is_blank(text_[position_]) && text_[position_] != '\n' &&
           continuation(position_) == 0) {
        ++position_;
    }
    return text_.substr(begin, position_ - begin);
}

std::string_view Scanner::word() noexcept {
    for (;;) {
        const std::string_view found = word_in_line();
        if (!found.empty() || at_end()) {
            return found;
        }
        next_line();
    }
}

std::string_view Scanner::rest_of_line() noexcept {
    const std::size_t begin = position_;
    position_ = std::min(text_.find('\n', position_), text_.size());
    std::string_view rest = text_.substr(begin, position_ - begin);
    while (!rest.empty() && is_blank(rest.front())) {
        rest.remove_prefix(1);
    }
    while (!rest.empty() && is_blank(rest.back())) {
        rest.remove_suffix(1);
    }
    return rest;
}

void Scanner::next_line() noexcept {
    position_ = std::min(text_.find('\n', position_), text_.size());
    if (position_ < text_.size()) {
        ++position_;
        ++line_;
    }
}

} // namespace farfield::io
