#pragma once

#include <farfield/metric/outcome.hpp>

#include <glm/vec3.hpp>

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace farfield::support {

/// One line of a golden file.
class GoldenRow {
  public:
    /// @param line of the file, counted from 1
    GoldenRow(const std::vector<std::string>& columns, std::vector<std::string> cells, int line);

    /// True where the column is not empty.
    [[nodiscard]] bool has(const std::string& column) const;
    [[nodiscard]] const std::string& text(const std::string& column) const;

    /// A number, parsed in its own precision: a detour over `double` would round a `float` twice,
    /// or (GCC 12) not at all. T is float, double or long double.
    template <typename T>
    [[nodiscard]] T number(const std::string& column) const;

    /// The columns `prefix`x, `prefix`y and `prefix`z.
    template <typename T>
    [[nodiscard]] glm::vec<3, T> vector(const std::string& prefix) const {
        return {number<T>(prefix + "x"), number<T>(prefix + "y"), number<T>(prefix + "z")};
    }

    /// True where the inputs of the row are exact in T.
    template <typename T>
    [[nodiscard]] bool serves() const {
        return sizeof(T) > sizeof(float) || text("f32") == "1";
    }

    /// The column `status`.
    [[nodiscard]] MetricOutcome status() const;

    [[nodiscard]] const std::string& label() const { return text("label"); }

    /// "17 H05_scale (line 19)", to tell which row failed.
    [[nodiscard]] std::string name() const;

  private:
    const std::vector<std::string>* columns_;
    std::vector<std::string> cells_;
    int line_;
};

/// A file in the format of tests/golden. Throws std::runtime_error where it is missing or damaged,
/// naming the file and the line.
class GoldenFile {
  public:
    /// By its name without ".csv"; in tests/golden unless another folder is given.
    explicit GoldenFile(const std::string& name);
    GoldenFile(const std::filesystem::path& folder, const std::string& name);
    GoldenFile(const GoldenFile&) = delete;
    GoldenFile& operator=(const GoldenFile&) = delete;

    [[nodiscard]] const std::vector<GoldenRow>& rows() const { return rows_; }

  private:
    std::vector<std::string> columns_;
    std::vector<GoldenRow> rows_;
};

} // namespace farfield::support
