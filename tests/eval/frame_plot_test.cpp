#include "markup.hpp"
#include <farfield/eval/frame_plot.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace {

using namespace farfield;
namespace fs = std::filesystem;
using test::Element;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

FramePlot small_plot() {
    return {
        .title = "Events",
        .value_title = "images",
        .series = {{"new", {5.0, 1.0, 0.0}}, {"reused", {0.0, 4.0, 5.0}}},
        .levels = {{"boxes", 8.0}},
        .captions = {"One caption."}};
}

/// Lines of data: those of three points and more; what leads to labels has two.
std::vector<Element> lines_of(const std::string& svg) {
    std::vector<Element> lines;
    for (const Element& element : test::parse_markup(svg)) {
        const std::string points = element.attribute("d");
        if (element.has_class("line") && std::count(points.begin(), points.end(), 'L') >= 2) {
            lines.push_back(element);
        }
    }
    return lines;
}

std::string text_of(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    REQUIRE(stream);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

/// A file that goes away.
class File {
  public:
    explicit File(const char* name) : path_(fs::temp_directory_path() / name) {}
    File(const File&) = delete;
    File& operator=(const File&) = delete;
    ~File() { fs::remove(path_); }
    [[nodiscard]] const fs::path& path() const { return path_; }

  private:
    fs::path path_;
};

} // namespace

TEST_CASE("a plot of nothing is a document", "[frame_plot]") {
    const std::vector<Element> elements = test::parse_markup(eval::to_svg({}));
    REQUIRE_FALSE(elements.empty());
    CHECK(elements.front().name == "svg");
    CHECK(lines_of(eval::to_svg({})).empty());
}

TEST_CASE("a plot has its words and a line a series", "[frame_plot]") {
    const std::string svg = eval::to_svg(small_plot());
    const Element root = test::parse_markup(svg).front();
    for (const char* word : {"Events", "images", "new", "reused", "boxes", "One caption."}) {
        INFO(word);
        CHECK(root.text.find(word) != std::string::npos);
    }
    CHECK(lines_of(svg).size() == 2);
    CHECK(svg == eval::to_svg(small_plot()));
    CHECK(svg.find("nan") == std::string::npos);

    SECTION("what has no place leaves a gap") {
        FramePlot plot = small_plot();
        plot.series[0].values = {1.0, 2.0, std::nullopt, kNan, kInfinity, -1.0, 3.0, 4.0};
        const std::string gaps = eval::to_svg(plot);
        CHECK(gaps.find("nan") == std::string::npos);
        CHECK(gaps.find("inf") == std::string::npos);
        plot.series[0].values = {std::nullopt, std::nullopt};
        const std::string none = eval::to_svg(plot);
        CHECK(lines_of(none).size() == 1);
    }
}

TEST_CASE("a saved plot is its text", "[frame_plot]") {
    const File file("farfield_test_frame_plot.svg");
    REQUIRE(eval::save(small_plot(), file.path()));
    CHECK(text_of(file.path()) == eval::to_svg(small_plot()));
    const auto saved = eval::save(small_plot(), file.path() / "below" / "a.svg");
    REQUIRE_FALSE(saved);
    CHECK(saved.error().message.find("a.svg") != std::string::npos);
}

TEST_CASE("a table has a line a frame", "[frame_plot]") {
    const File file("farfield_test_frame_plot.csv");
    REQUIRE(eval::save_table({}, file.path()));
    CHECK(text_of(file.path()) == "frame\n");
    const std::vector<FrameSeries> series = {
        {"new", {5.0, 0.25, std::nullopt}},
        {"a, \"b\"", {kNan, kInfinity, -3.0, 1e300}},
        {"none", {}}};
    REQUIRE(eval::save_table(series, file.path()));
    const std::string text = text_of(file.path());
    CHECK(text.find("frame,new,\"a, \"\"b\"\"\",none\n0,5,,\n1,0.250000,,\n2,,-3,\n3,,1") == 0);
    CHECK(std::count(text.begin(), text.end(), '\n') == 5);
    CHECK_FALSE(eval::save_table(series, file.path() / "below" / "a.csv"));
}
