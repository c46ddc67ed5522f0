#pragma once

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>

namespace farfield::run {

/// Text that goes to the terminal and into a page of results, line by line.
class Page {
  public:
    explicit Page(const std::filesystem::path& file) : file_(file) {}

    /// One line, formatted as by `printf`; at most 1023 characters.
    template <typename... Values>
    void line(const char* format, Values... values) {
        std::array<char, 1024> text{};
        std::snprintf(text.data(), text.size(), format, values...);
        std::puts(text.data());
        std::fflush(stdout);
        file_ << text.data() << '\n';
        file_.flush();
    }

  private:
    std::ofstream file_;
};

} // namespace farfield::run
