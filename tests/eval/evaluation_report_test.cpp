#include "markup.hpp"
#include <farfield/eval/evaluation_report.hpp>

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace {

namespace fs = std::filesystem;
namespace eval = farfield::eval;
using farfield::EvaluatedRun;
using farfield::Evaluation;
using farfield::ReportPicture;
using farfield::RunReport;
using farfield::test::Element;
using farfield::test::parse_markup;
using nlohmann::ordered_json;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// A folder of its own that goes away.
class Folder {
  public:
    Folder() : path_(fs::temp_directory_path() / "farfield_test_evaluation_report") {
        fs::remove_all(path_);
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    ~Folder() { fs::remove_all(path_); }

    [[nodiscard]] const fs::path& path() const { return path_; }

    [[nodiscard]] std::string text(const std::string& name) const {
        std::ifstream stream(path_ / name, std::ios::binary);
        REQUIRE(stream);
        return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    }

    /// Names of the files that end so, sorted.
    [[nodiscard]] std::vector<std::string> names(const std::string& end) const {
        std::vector<std::string> found;
        for (const fs::directory_entry& entry : fs::directory_iterator(path_)) {
            const std::string name = entry.path().filename().string();
            if (name.ends_with(end)) {
                found.push_back(name);
            }
        }
        std::sort(found.begin(), found.end());
        return found;
    }

    /// All files by name.
    [[nodiscard]] std::map<std::string, std::string> files() const {
        std::map<std::string, std::string> all;
        for (const std::string& name : names("")) {
            all[name] = text(name);
        }
        return all;
    }

  private:
    fs::path path_;
};

/// Writes, and reads the page back.
std::vector<Element> write(const Evaluation& evaluation, const Folder& folder) {
    const auto written = eval::write_report(evaluation, folder.path());
    if (!written) {
        FAIL(written.error().message);
    }
    return parse_markup(folder.text("report.html"));
}

/// Cells of a table as RFC 4180 has it.
std::vector<std::vector<std::string>> parse_csv(const std::string& text) {
    std::vector<std::vector<std::string>> rows;
    std::vector<std::string> row(1);
    bool quoted = false;
    for (std::size_t at = 0; at < text.size(); ++at) {
        const char letter = text[at];
        if (quoted && letter == '"' && at + 1 < text.size() && text[at + 1] == '"') {
            row.back() += text[++at];
        } else if (letter == '"') {
            quoted = !quoted;
        } else if (letter == ',' && !quoted) {
            row.emplace_back();
        } else if (letter == '\n' && !quoted) {
            rows.push_back(row);
            row.assign(1, "");
        } else {
            row.back() += letter;
        }
    }
    REQUIRE_FALSE(quoted);
    REQUIRE(row == std::vector<std::string>(1));
    return rows;
}

/// A PNG file as far as anyone looks who does not decode it, and some bytes.
std::vector<std::uint8_t> png_start(std::uint8_t width, std::uint8_t height, std::size_t more) {
    std::vector<std::uint8_t> bytes = {0x89, 'P', 'N', 'G',   '\r', '\n', 0x1A, '\n',
                                       0,    0,   0,   13,    'I',  'H',  'D',  'R',
                                       0,    0,   0,   width, 0,    0,    0,    height};
    for (std::size_t index = 0; index < more; ++index) {
        bytes.push_back(static_cast<std::uint8_t>(251 * index + 17));
    }
    return bytes;
}

std::vector<std::uint8_t> decoded(const std::string& base64) {
    const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::vector<std::uint8_t> bytes;
    std::uint32_t bits = 0;
    int count = 0;
    for (const char letter : base64) {
        if (letter == '=') {
            break;
        }
        REQUIRE(digits.find(letter) != std::string::npos);
        bits = bits << 6U | static_cast<std::uint32_t>(digits.find(letter));
        count += 6;
        if (count >= 8) {
            count -= 8;
            bytes.push_back(static_cast<std::uint8_t>(bits >> static_cast<unsigned>(count) & 255U));
        }
    }
    REQUIRE(base64.size() % 4 == 0);
    return bytes;
}

/// A run that took a time and was this far from the truth.
EvaluatedRun measured(
    const std::string& name,
    double mean_ms,
    std::optional<double> flip,
    const std::string& technique = "image-cache"
) {
    EvaluatedRun run;
    run.walk = "island";
    run.name = name;
    run.figures.scene.name = "island";
    run.figures.scene.triangles = 40'599'982;
    run.figures.technique = technique;
    run.figures.backend = "opengl";
    run.figures.device = "a renderer";
    run.figures.width = 64;
    run.figures.height = 48;
    run.figures.fov_deg = 60.0;
    run.figures.frames = 4;
    run.frame_ms = {mean_ms, mean_ms, mean_ms, mean_ms};
    run.figures.frame_ms = eval::frame_times(run.frame_ms);
    run.figures.reference_frame_ms.total = 400.0;
    run.figures.speedup.overall = 100.0 / mean_ms;
    run.figures.truth.flip_mean = flip;
    return run;
}

/// Text of the page's elements of a name.
std::vector<std::string> texts(const std::vector<Element>& elements, const std::string& name) {
    std::vector<std::string> found;
    for (const Element& element : elements) {
        if (element.name == name) {
            found.push_back(element.text);
        }
    }
    return found;
}

bool says(const std::vector<Element>& page, const std::string& line) {
    const std::vector<std::string> lines = texts(page, "li");
    return std::find(lines.begin(), lines.end(), line) != lines.end();
}

/// Row headings of tables: names of runs, with their marks.
std::vector<std::string> row_names(const std::vector<Element>& page) {
    std::vector<std::string> names;
    for (const Element& element : page) {
        if (element.name == "th" && element.attribute("scope") == "row") {
            names.push_back(element.text);
        }
    }
    return names;
}

/// The cell of a table's first row below a heading of a group.
std::string
first_cell(const std::vector<Element>& page, const std::string& group, const std::string& title) {
    std::vector<std::string> groups;
    std::vector<std::string> titles;
    std::vector<std::string> cells;
    for (const Element& element : page) {
        if (element.attribute("scope") == "colgroup") {
            groups.insert(
                groups.end(),
                static_cast<std::size_t>(std::stoi(element.attribute("colspan"))),
                element.text
            );
        } else if (element.attribute("scope") == "col" && element.text != "run") {
            titles.push_back(element.text);
        } else if (element.name == "td" && element.parents.ends_with("tbody/tr")) {
            cells.push_back(element.text);
        }
    }
    REQUIRE(groups.size() == titles.size());
    REQUIRE(cells.size() >= titles.size());
    for (std::size_t index = 0; index < titles.size(); ++index) {
        if (groups[index] == group && titles[index] == title) {
            return cells[index];
        }
    }
    FAIL("no column " << group << ", " << title);
    return {};
}

struct Point {
    double x = 0.0;
    double y = 0.0;
};

/// Numbers of a path, of the points of a polygon, or of one attribute. Fails on what is none.
std::vector<double> numbers(const std::string& text) {
    std::string plain = text;
    std::replace_if(
        plain.begin(), plain.end(), [](char c) { return c == 'M' || c == 'L' || c == ','; }, ' '
    );
    std::istringstream stream(plain);
    std::vector<double> found;
    for (std::string word; stream >> word;) {
        INFO("'" << word << "' of '" << text << "'");
        REQUIRE(word.find_first_not_of("-0123456789.") == std::string::npos);
        found.push_back(std::stod(word));
    }
    return found;
}

std::vector<Point> points(const std::string& text) {
    const std::vector<double> flat = numbers(text);
    REQUIRE(flat.size() % 2 == 0);
    std::vector<Point> found;
    for (std::size_t index = 0; index < flat.size(); index += 2) {
        found.push_back({flat[index], flat[index + 1]});
    }
    return found;
}

/// Everything that has a place in a drawing lies in it.
void check_drawing(const std::vector<Element>& drawing) {
    REQUIRE(drawing.front().name == "svg");
    const double width = numbers(drawing.front().attribute("width")).at(0);
    const double height = numbers(drawing.front().attribute("height")).at(0);
    // Half of a marker, and what a label of one line may stick out of it.
    constexpr double kRoom = 8.0;
    const auto inside = [&](const Point& point) {
        CHECK(point.x >= -kRoom);
        CHECK(point.x <= width + kRoom);
        CHECK(point.y >= -kRoom);
        CHECK(point.y <= height + kRoom);
    };
    for (const Element& element : drawing) {
        for (const char* key : {"d", "points"}) {
            for (const Point& point : points(element.attribute(key))) {
                inside(point);
            }
        }
        for (const char* key : {"width", "height", "r", "font-size"}) {
            for (const double size : numbers(element.attribute(key))) {
                CHECK(size >= 0.0);
            }
        }
        for (const auto& [x, y] : {std::pair("x", "y"), std::pair("cx", "cy")}) {
            if (element.attributes.contains(x)) {
                inside({numbers(element.attribute(x)).at(0), numbers(element.attribute(y)).at(0)});
            }
        }
    }
}

/// The one path that has a class, of several the first.
std::vector<Point> path_of_class(const std::vector<Element>& drawing, const std::string& wanted) {
    for (const Element& element : drawing) {
        if (element.name == "path" && element.has_class(wanted)) {
            return points(element.attribute("d"));
        }
    }
    FAIL("no path of class " << wanted);
    return {};
}

struct Box {
    double left = 0.0;
    double right = 0.0;
    double top = 0.0;
    double bottom = 0.0;
};

/// Boxes of the labels of size 12, from their texts; widths as of a common sans-serif font.
std::vector<Box> label_boxes(const std::vector<Element>& drawing) {
    constexpr double kSize = 12.0;
    constexpr double kMeanWidth = 0.55 * kSize;
    std::vector<Box> boxes;
    for (const Element& element : drawing) {
        if (element.name == "text" && element.attribute("font-size") == "12.0") {
            const double x = numbers(element.attribute("x")).at(0);
            const double y = numbers(element.attribute("y")).at(0);
            const double width = kMeanWidth * static_cast<double>(element.text.size());
            boxes.push_back({x, x + width, y - 0.75 * kSize, y});
        }
    }
    return boxes;
}

void check_apart(const std::vector<Box>& boxes) {
    for (std::size_t a = 0; a < boxes.size(); ++a) {
        for (std::size_t b = a + 1; b < boxes.size(); ++b) {
            CAPTURE(a, b, boxes[a].left, boxes[a].top, boxes[b].left, boxes[b].top);
            CHECK(
                (boxes[a].right <= boxes[b].left || boxes[b].right <= boxes[a].left ||
                 boxes[a].bottom <= boxes[b].top || boxes[b].bottom <= boxes[a].top)
            );
        }
    }
}

} // namespace

TEST_CASE("markup that is not well-formed is recognised", "[evaluation_report]") {
    CHECK(parse_markup("<a b=\"c\"><d/>e &amp; f</a>").size() == 2);
    for (const char* bad :
         {"<a>",
          "</a>",
          "<a><b></a></b>",
          "<a b=c></a>",
          "<a b></a>",
          "<a b=\"1\" b=\"2\"/>",
          "<a>&</a>",
          "<a>\x01</a>",
          "<a b=\"<\"/>",
          "a < b"}) {
        INFO(bad);
        CHECK_THROWS(parse_markup(bad));
    }
}

TEST_CASE("the table has a column for every leaf of a run's JSON", "[evaluation_report]") {
    EvaluatedRun full = measured("a, \"b\"\nc", 10.0, 0.25);
    full.walk = "w";
    full.figures.cost_model = farfield::CostModel{.triangle_s = 3e-8};
    full.figures.work.new_count = 7;
    full.figures.truth.psnr_db_min = kInfinity;
    EvaluatedRun bare;
    bare.walk = "w";
    bare.name = "bare";
    Folder folder;
    write({"t", {}, {full, bare}}, folder);
    const auto rows = parse_csv(folder.text("results.csv"));
    REQUIRE(rows.size() == 3);

    // The JSON itself says what the columns are, and what stands in them.
    const ordered_json json = ordered_json::parse(eval::to_json(full.figures));
    std::vector<std::string> columns = {"walk", "name"};
    std::vector<std::string> cells = {"w", "a, \"b\"\nc"};
    const auto add = [&](const std::string& name, const ordered_json& value) {
        columns.push_back(name);
        cells.push_back(
            value.is_null()     ? ""
            : value.is_string() ? value.get<std::string>()
                                : value.dump()
        );
    };
    for (const auto& [key, value] : json.items()) {
        if (!value.is_object()) {
            add(key, value);
            continue;
        }
        for (const auto& [inner, figure] : value.items()) {
            add(std::string(key).append(".").append(inner), figure);
        }
    }
    CHECK(rows[0] == columns);
    CHECK(rows[1] == cells);
    const auto cell = [&](std::size_t row, const std::string& column) {
        const auto found = std::find(columns.begin(), columns.end(), column);
        REQUIRE(found != columns.end());
        return rows[row].at(static_cast<std::size_t>(found - columns.begin()));
    };
    CHECK(cell(1, "truth.flip_mean") == "0.25");
    CHECK(cell(1, "work.new") == "7");
    CHECK(cell(1, "cost_model.triangle_s") == "3e-08");
    CHECK(cell(1, "truth.psnr_db_min").empty());
    // What was not measured is empty, also where the whole group is missing; never zero.
    REQUIRE(rows[2].size() == columns.size());
    CHECK(cell(2, "name") == "bare");
    for (const char* column :
         {"frame_ms.mean",
          "speedup.overall",
          "error_px",
          "scene.triangles",
          "cost_model.texel_s"}) {
        INFO(column);
        CHECK(cell(2, column).empty());
    }
}

TEST_CASE("nodes beyond their promise have a table of their own", "[evaluation_report]") {
    const Folder folder;
    Evaluation evaluation;
    EvaluatedRun& run = evaluation.runs.emplace_back();
    run.walk = "hills, \"steep\"";
    run.name = std::string(300, 'n');
    run.overshoots = {
        {{.node = 7, .frame = 3, .disparity_px = 9.5, .promise_px = 8.75, .pixels = 12},
         14,
         true,
         36.5,
         211.25},
        {{.node = 8, .frame = 4, .disparity_px = kInfinity, .promise_px = 2.5, .pixels = 1},
         2,
         false,
         0.5,
         0.0}};
    write(evaluation, folder);
    const auto rows = parse_csv(folder.text("overshoots.csv"));
    REQUIRE(rows.size() == 3);
    using Row = std::vector<std::string>;
    CHECK(
        rows[0] == Row{"walk",
                       "run",
                       "node",
                       "level",
                       "kind",
                       "diagonal_m",
                       "distance_m",
                       "frame",
                       "disparity_px",
                       "promise_px",
                       "pixels"}
    );
    CHECK(
        rows[1] ==
        Row{run.walk, run.name, "7", "14", "leaf", "36.5", "211.25", "3", "9.5", "8.75", "12"}
    );
    // As in the other table, what JSON has no number for is an empty cell.
    CHECK(
        rows[2] == Row{run.walk, run.name, "8", "2", "interior", "0.5", "0.0", "4", "", "2.5", "1"}
    );
}

TEST_CASE("an evaluation without runs is a page that says so", "[evaluation_report]") {
    Folder folder;
    const auto page = write({}, folder);
    CHECK(texts(page, "h1") == std::vector<std::string>{"Evaluation"});
    const auto paragraphs = texts(page, "p");
    CHECK(std::count(paragraphs.begin(), paragraphs.end(), "There are no runs.") == 1);
    CHECK(parse_csv(folder.text("results.csv")).size() == 1);
    CHECK(folder.names(".svg").empty());
}

TEST_CASE("figures that were not measured are dashes", "[evaluation_report]") {
    EvaluatedRun bare;
    bare.walk = "w";
    bare.name = "bare";
    Folder folder;
    const auto page = write({"t", {}, {bare}}, folder);
    std::size_t cells = 0;
    for (const Element& element : page) {
        if (element.name == "td" && element.parents.ends_with("tbody/tr")) {
            ++cells;
            CHECK(element.text == "\u2014");
        }
    }
    CHECK(cells == 23);
    CHECK(folder.names(".svg").empty());
    CHECK(says(page, "Time or error was not measured, so nothing is said of: \u201Cbare\u201D."));

    // Infinity is a measured value, and zero is one.
    bare.figures.disparity_px.max = kInfinity;
    bare.figures.disparity_px.p99 = 0.0;
    bare.figures.image.missing_fraction = kNan;
    const auto odd = write({"t", {}, {bare}}, folder);
    CHECK(first_cell(odd, "disparity [px]", "max") == "\u221E");
    CHECK(first_cell(odd, "disparity [px]", "p99") == "0");
    CHECK(first_cell(odd, "against plain geometry", "missing [%]") == "\u2014");
}

TEST_CASE("figures arrive in their cells", "[evaluation_report]") {
    EvaluatedRun run = measured("one", 12.5, 0.0625);
    run.frame_ms = {10.0, 20.0, 30.0, 40.0};
    run.figures.frame_ms = {1.0, 12.5, 11.0, 2.0, 39.0, 40.0, 50.0};
    run.figures.speedup = {8.0, 9.0, 0.5, 70.0};
    run.figures.disparity_px = {0.5, 1.5, 2.25, 3.5, 12, 0.8};
    run.figures.image = {30.0, 31.0, 0.97, 0.0312, 0.001, 0.0005};
    static_cast<RunReport::ImageErrors&>(run.figures.truth
    ) = {28.0, 29.0, 0.95, 0.0625, 0.002, 0.004};
    run.figures.truth.reference_psnr_db_median = 29.7;
    run.figures.memory.image_bytes_peak = 24U << 20U;
    run.figures.memory.aov_bytes = 3U << 19U;
    // Of two frames with images, each of 64 x 48 pixels, 12 pixels are 0.195 %.
    run.disparity_p99_px = {1.0, std::nullopt, 2.0, std::nullopt};
    Folder folder;
    const auto page = write({"t", {}, {run}}, folder);
    const std::vector<std::array<std::string, 3>> expected = {
        {"frame [ms]", "mean", "12.5"},
        {"frame [ms]", "median", "11.0"},
        {"frame [ms]", "p99", "39.0"},
        {"frame [ms]", "max", "40.0"},
        {"speed-up [x]", "overall", "8.00"},
        {"speed-up [x]", "without first", "9.00"},
        {"disparity [px]", "p99", "1.50"},
        {"disparity [px]", "max", "2.25"},
        {"disparity [px]", "promised", "3.50"},
        {"disparity [px]", "pixels beyond", "0.195 %"},
        {"against plain geometry", "PSNR [dB]", "31.0"},
        {"against plain geometry", "SSIM", "0.970"},
        {"against plain geometry", "FLIP", "0.0312"},
        {"against plain geometry", "missing [%]", "0.100"},
        {"against plain geometry", "extra [%]", "0.0500"},
        {"against the truth", "PSNR [dB]", "29.0"},
        {"against the truth", "that of geometry", "29.7"},
        {"against the truth", "SSIM", "0.950"},
        {"against the truth", "FLIP", "0.0625"},
        {"against the truth", "missing [%]", "0.200"},
        {"against the truth", "extra [%]", "0.400"},
        {"memory [MiB]", "images", "24.0"},
        {"memory [MiB]", "AOV", "1.50"}};
    for (const auto& [group, title, text] : expected) {
        INFO(group << ", " << title);
        CHECK(first_cell(page, group, title) == text);
    }
    CHECK(std::count_if(page.begin(), page.end(), [](const Element& element) {
              return element.name == "td" && element.has_class("over");
          }) == 1);
    // Without the frames the share is not known, so the pixels are told.
    run.disparity_p99_px.clear();
    CHECK(
        first_cell(write({"t", {}, {run}}, folder), "disparity [px]", "pixels beyond") == "12 px"
    );
}

TEST_CASE("runs are sorted by time, and those that are dominated are told", "[evaluation_report]") {
    Folder folder;
    EvaluatedRun untimed = measured("untimed", 1.0, 0.1);
    untimed.figures.frame_ms.mean.reset();
    const Evaluation evaluation{
        "t",
        {},
        {measured("slow but near", 50.0, 0.05),
         measured("as near", 40.0, 0.101),
         untimed,
         measured("plain", 30.0, 0.10, "geometry"),
         measured("quick", 10.0, 0.20),
         measured("hardly slower", 30.5, 0.13),
         measured("far", 31.9, 0.15)}};
    const auto page = write(evaluation, folder);
    CHECK(
        row_names(page) ==
        std::vector<std::string>{
            "quick",
            "plain",
            "hardly slower",
            "far dominated",
            "as near dominated",
            "slow but near",
            "untimed"}
    );
    CHECK(says(
        page,
        "\u201Cas near\u201D is slower than the baseline \u201Cplain\u201D at equal measured "
        "error: "
        "40.0 and 30.0 ms a frame; FLIP against the truth 0.101 and 0.100."
    ));
    CHECK(says(
        page,
        "\u201Cfar\u201D is slower than the baseline \u201Cplain\u201D and further from the truth: "
        "31.9 and 30.0 ms a frame; FLIP against the truth 0.150 and 0.100."
    ));
    CHECK(says(page, "Time or error was not measured, so nothing is said of: \u201Cuntimed\u201D.")
    );
}

TEST_CASE("a baseline is named before a faster run that dominates too", "[evaluation_report]") {
    Folder folder;
    const auto page = write(
        {"t",
         {},
         {measured("best", 5.0, 0.05),
          measured("lod", 20.0, 0.08, "mesh-lod"),
          measured("plain", 30.0, 0.07, "geometry"),
          measured("worst", 40.0, 0.10)}},
        folder
    );
    CHECK(says(
        page,
        "\u201Cworst\u201D is slower than the baseline \u201Clod\u201D and further from the truth: "
        "40.0 and 20.0 ms a frame; FLIP against the truth 0.100 and 0.0800."
    ));
    CHECK(says(
        page,
        "\u201Clod\u201D is slower than \u201Cbest\u201D and further from the truth: 20.0 and 5.00 "
        "ms a frame; FLIP against the truth 0.0800 and 0.0500."
    ));
}

TEST_CASE("nearness is what both runs have, the truth first", "[evaluation_report]") {
    Folder folder;
    EvaluatedRun first = measured("first", 10.0, std::nullopt);
    EvaluatedRun second = measured("second", 20.0, 0.01);
    first.figures.truth.psnr_db_median = 30.0;
    second.figures.truth.psnr_db_median = 30.05;
    CHECK(says(
        write({"t", {}, {first, second}}, folder),
        "\u201Csecond\u201D is slower than \u201Cfirst\u201D at equal measured error: 20.0 and "
        "10.0 "
        "ms a frame; PSNR against the truth [dB] 30.1 and 30.0."
    ));
    second.figures.truth.psnr_db_median = 31.0;
    CHECK(says(
        write({"t", {}, {first, second}}, folder), "No run is dominated: what is slower is nearer."
    ));
    // Equal pictures: infinitely near to plain geometry, both.
    first.figures.truth.psnr_db_median.reset();
    first.figures.image.psnr_db_median = kInfinity;
    second.figures.image.psnr_db_median = kInfinity;
    const auto page = write({"t", {}, {first, second}}, folder);
    CHECK(row_names(page) == std::vector<std::string>{"first", "second dominated"});
}

TEST_CASE("runs of several devices are compared by milliseconds", "[evaluation_report]") {
    Folder folder;
    EvaluatedRun slow = measured("images", 10.0, 0.1); // 100 ms a frame of its own geometry
    EvaluatedRun cast = measured("rays", 5.0, 0.1, "geometry");
    cast.figures.device = "another renderer";
    cast.figures.backend = "embree";
    cast.figures.reference_frame_ms.total = 20.0; // 5 ms a frame
    cast.figures.speedup.overall = 1.0;
    const auto page = write({"t", {}, {slow, cast}}, folder);
    CHECK(
        row_names(page) == std::vector<std::string>{"rays \u00B7 B", "images \u00B7 A dominated"}
    );
    CHECK(first_cell(page, "speed-up [x]", "over the fastest geometry") == "1.00");
    CHECK(says(page, "Plain geometry is fastest on device B: 5.00 ms a frame."));
    CHECK(texts(page, "dd").back() == "another renderer");
    // The images, ten times as fast as their own geometry, are at a half in the plots.
    const auto drawing = parse_markup(folder.text("island_flip_speedup.svg"));
    const auto lines = texts(drawing, "text");
    CHECK(std::count(lines.begin(), lines.end(), "speed-up over plain geometry on B [x]") == 1);
    CHECK(std::count(lines.begin(), lines.end(), "0.5") == 1);
    CHECK(std::count(lines.begin(), lines.end(), "10") == 0);
    // With one device there is nothing to tell apart.
    slow.figures.device = cast.figures.device;
    const auto same = write({"t", {}, {slow, cast}}, folder);
    CHECK(row_names(same) == std::vector<std::string>{"rays", "images dominated"});
}

TEST_CASE("walks have parts, files and plots of their own", "[evaluation_report]") {
    Folder folder;
    Evaluation evaluation;
    evaluation.title = "Two walks";
    evaluation.notes = {"a note", "another"};
    for (const char* walk : {"Island, 30 frames", "island 30 frames", "\u2022"}) {
        EvaluatedRun run = measured("one", 10.0, 0.1);
        run.walk = walk;
        evaluation.runs.push_back(run);
    }
    const auto page = write(evaluation, folder);
    CHECK(
        texts(page, "h2") ==
        std::vector<std::string>{
            "Island, 30 frames", "island 30 frames", "\u2022", "What the figures mean"}
    );
    CHECK(says(page, "a note"));
    CHECK(says(page, "another"));
    CHECK(
        folder.names("_flip_speedup.svg") ==
        std::vector<std::string>{
            "island_30_frames_2_flip_speedup.svg",
            "island_30_frames_flip_speedup.svg",
            "walk_flip_speedup.svg"}
    );
    // Walks that differ in nothing that counts give no plot across them.
    CHECK(folder.names("speedup_frames.svg").empty());
    CHECK(folder.names("speedup_triangles.svg").empty());
    // Every link inside the page has its target.
    for (const Element& link : page) {
        const std::string target = link.attribute("href");
        if (target.starts_with("#")) {
            CHECK(std::any_of(page.begin(), page.end(), [&](const Element& element) {
                return "#" + element.attribute("id") == target;
            }));
        }
    }
}

TEST_CASE(
    "walks that differ in frames or triangles alone are plotted together", "[evaluation_report]"
) {
    Folder folder;
    Evaluation evaluation;
    const auto add = [&](const std::string& walk, int frames, std::uint64_t triangles, double ms) {
        EvaluatedRun run = measured("2 px", ms, 0.1);
        run.walk = walk;
        run.figures.frames = frames;
        run.figures.scene.triangles = triangles;
        evaluation.runs.push_back(run);
    };
    add("long", 1000, 1'000'000, 1.0);
    add("short", 10, 1'000'000, 100.0);
    add("middle", 100, 1'000'000, 10.0);
    write(evaluation, folder);
    CHECK(folder.names("speedup_triangles.svg").empty());
    const auto frames = parse_markup(folder.text("speedup_frames.svg"));
    // Speed-ups of 1, 10 and 100 at 10, 100 and 1000 frames: on logarithmic axes a straight line,
    // through the corners of the plot. Coordinates are rounded to 0.1.
    auto line = path_of_class(frames, "line");
    REQUIRE(line.size() == 4); // the first point is there twice
    line.erase(line.begin());
    CHECK(line[0].x < line[1].x);
    CHECK(line[1].x - line[0].x == Approx(line[2].x - line[1].x).margin(0.21));
    CHECK(line[0].y - line[1].y == Approx(line[1].y - line[2].y).margin(0.21));
    const auto axes = path_of_class(frames, "axis");
    CHECK(line[0].x == axes[0].x);
    CHECK(line[0].y == axes[0].y);
    CHECK(line[2].x == axes[1].x);

    add("small", 1000, 10'000, 50.0);
    write(evaluation, folder);
    CHECK(folder.names("speedup_triangles.svg").size() == 1);
    // Another threshold is another line; alone, it is none.
    evaluation.runs.back().figures.error_px = 8.0;
    fs::remove_all(folder.path());
    write(evaluation, folder);
    CHECK(folder.names("speedup_triangles.svg").empty());
}

TEST_CASE("times are drawn on a logarithmic axis, gaps are kept", "[evaluation_report]") {
    Folder folder;
    EvaluatedRun run = measured("one", 10.0, std::nullopt);
    run.frame_ms = {1.0, 10.0, 100.0};
    run.disparity_p99_px = {2.0, std::nullopt, 1.0};
    write({"t", {}, {run}}, folder);
    auto times = path_of_class(parse_markup(folder.text("island_frame_times.svg")), "line");
    times.erase(times.begin());
    REQUIRE(times.size() == 3);
    CHECK(times[0].y - times[1].y == Approx(times[1].y - times[2].y).margin(0.21));
    CHECK(times[1].x - times[0].x == Approx(times[2].x - times[1].x).margin(0.21));
    // Two points that nothing joins, each a line to itself; 2 is at the top of the axis, 1 halfway.
    const auto drawing = parse_markup(folder.text("island_disparity_frames.svg"));
    const auto gaps = path_of_class(drawing, "line");
    REQUIRE(gaps.size() == 4);
    CHECK(gaps[0].x == gaps[1].x);
    CHECK(gaps[2].x == gaps[3].x);
    const auto bottom = path_of_class(drawing, "axis").front().y;
    CHECK(bottom - gaps[0].y == Approx(2.0 * (bottom - gaps[2].y)).margin(0.31));
    // Also in a walk so long that its line is thinned.
    run.disparity_p99_px.assign(5000, 1.0);
    run.disparity_p99_px[2503].reset();
    write({"t", {}, {run}}, folder);
    int lines = 0;
    for (const Element& element : parse_markup(folder.text("island_disparity_frames.svg"))) {
        // All frames and their medians; what else has the class are bits beside labels.
        const std::string line = element.attribute("d");
        if (element.has_class("line") && line.size() > 1000) {
            CHECK(std::count(line.begin(), line.end(), 'M') == 2);
            ++lines;
        }
    }
    CHECK(lines == 2);
}

TEST_CASE("axes end on the round value beyond the last", "[evaluation_report]") {
    Folder folder;
    EvaluatedRun run = measured("one", 10.0, std::nullopt);
    const auto top_tick = [&](double most) {
        run.frame_ms = {2.0, most};
        write({"t", {}, {run}}, folder);
        std::string top;
        double height = kInfinity;
        for (const Element& element : parse_markup(folder.text("island_frame_times.svg"))) {
            if (element.has_class("end") && numbers(element.attribute("y")).at(0) < height) {
                height = numbers(element.attribute("y")).at(0);
                top = element.text;
            }
        }
        return top;
    };
    CHECK(top_tick(10.0) == "10");
    CHECK(top_tick(10.01) == "20");
    CHECK(top_tick(49.0) == "50");
    CHECK(top_tick(2.0) == "5"); // equal values still have some room
}

TEST_CASE("no peak of a long walk is lost", "[evaluation_report]") {
    Folder folder;
    EvaluatedRun run = measured("one", 1.0, std::nullopt);
    run.frame_ms.assign(10'000, 10.0);
    run.frame_ms[7777] = 1000.0;
    run.frame_ms[3333] = 1.0;
    write({"t", {}, {run}}, folder);
    const auto drawing = parse_markup(folder.text("island_frame_times.svg"));
    const auto every = path_of_class(drawing, "thin");
    CHECK(every.size() < 2500); // four a column, of which there are 600
    const auto [top, bottom] =
        std::minmax_element(every.begin(), every.end(), [](const Point& a, const Point& b) {
            return a.y < b.y;
        });
    const auto axes = path_of_class(drawing, "axis");
    CHECK(bottom->y == axes[0].y);
    const double share = (top->x - axes[0].x) / (axes[1].x - axes[0].x);
    CHECK(share == Approx(7777.0 / 9999.0).margin(0.001));
    CHECK(bottom->y - top->y == Approx(3.0 * 110.0).margin(0.21)); // three decades of 330
}

TEST_CASE("drawings of odd figures have no odd places", "[evaluation_report]") {
    const double huge = std::numeric_limits<double>::max();
    const double tiny = std::numeric_limits<double>::denorm_min();
    const std::vector<std::vector<double>> series = {
        {},
        {0.0},
        {0.0, 0.0},
        {5.0},
        {5.0, 5.0, 5.0},
        {kNan, kNan},
        {kInfinity, 1.0, -kInfinity},
        {-3.0, -1.0},
        {huge, 1.0},
        {tiny, tiny},
        {tiny, huge},
        {1e-290, 1e290},
        {0.3, 0.6, 0.9},
        std::vector<double>(5000, kNan)};
    std::size_t drawn = 0;
    for (std::size_t index = 0; index < series.size(); ++index) {
        CAPTURE(index);
        Evaluation evaluation;
        for (int copy = 0; copy < 2; ++copy) {
            EvaluatedRun run = measured("run " + std::to_string(copy), 10.0, 0.1);
            run.walk = "walk " + std::to_string(copy);
            run.figures.frames = 10 * (copy + 1);
            run.frame_ms = series[index];
            run.disparity_p99_px.assign(series[index].begin(), series[index].end());
            const double value = series[index].empty() ? 1.0 : series[index].back();
            run.figures.error_px = value;
            run.figures.speedup.overall = value;
            run.figures.truth.flip_mean = value;
            run.figures.disparity_px.p99 = value;
            run.figures.memory.image_bytes_peak = copy == 0 ? 0 : UINT64_MAX;
            run.figures.memory.image_budget_bytes = 0;
            evaluation.runs.push_back(run);
            run.walk = "walk 0";
            run.name = "another " + std::to_string(copy);
            evaluation.runs.push_back(run);
        }
        evaluation.runs[0].name = "run";
        evaluation.runs[2].name = "run"; // in both walks
        Folder folder;
        const auto page = write(evaluation, folder);
        for (const std::string& name : folder.names(".svg")) {
            INFO(name);
            check_drawing(parse_markup(folder.text(name)));
            ++drawn;
        }
    }
    CHECK(drawn > series.size());
}

TEST_CASE("text of every kind leaves pages and drawings well-formed", "[evaluation_report]") {
    Folder folder;
    const std::string odd = "<b a=\"1\">&amp;</b> \x01\xFF caf\xC3\xA9 ]]> --> \n'";
    EvaluatedRun run = measured(odd, 10.0, 0.1);
    run.walk = odd;
    run.figures.scene.name = odd;
    run.figures.technique = odd;
    run.figures.preset = odd;
    run.figures.backend = odd;
    run.figures.device = odd;
    run.figures.error_px = 2.0;
    run.worst_frame = 1;
    run.pictures = {{odd, png_start(3, 2, 5)}};
    EvaluatedRun longer = run;
    longer.walk = std::string(300, 'x');
    longer.name = std::string(300, '\xC3'); // halves of characters
    longer.figures.frames = 40;
    run.figures.memory.image_bytes_peak = 1;
    const auto page = write({odd, {odd}, {run, longer}}, folder);
    const std::string shown =
        "&lt;b a=&quot;1&quot;&gt;&amp;amp;&lt;/b&gt; \uFFFD\uFFFD caf\u00E9 ]]&gt; --&gt;  '";
    CHECK(texts(page, "h1") == std::vector<std::string>{shown});
    CHECK(row_names(page).front() == shown);
    CHECK(std::none_of(page.begin(), page.end(), [](const Element& element) {
        return element.attributes.contains("a"); // of the text, had it become a tag
    }));
    CHECK(folder.names(".svg").size() >= 5);
    for (const std::string& name : folder.names(".svg")) {
        INFO(name);
        const auto drawing = parse_markup(folder.text(name));
        check_drawing(drawing);
        CHECK(drawing.front().attribute("xmlns") == "http://www.w3.org/2000/svg");
    }
}

TEST_CASE("labels do not lie on each other", "[evaluation_report]") {
    Folder folder;
    Evaluation evaluation;
    for (int index = 0; index < 12; ++index) {
        // Groups of runs that measure the same.
        const double group = std::floor(index / 4.0);
        EvaluatedRun run =
            measured("run number " + std::to_string(index), 10.0 + group, 0.1 + 0.01 * group);
        run.figures.disparity_px.p99 = 1.0;
        evaluation.runs.push_back(run);
    }
    write(evaluation, folder);
    for (const char* name : {"island_flip_speedup.svg", "island_frame_times.svg"}) {
        INFO(name);
        const auto boxes = label_boxes(parse_markup(folder.text(name)));
        CHECK(boxes.size() == 12);
        check_apart(boxes);
    }
    // More labels than an ordinary plot has room for, all at one height.
    evaluation.runs.clear();
    for (int index = 0; index < 60; ++index) {
        evaluation.runs.push_back(measured("run " + std::to_string(index), 10.0, std::nullopt));
    }
    write(evaluation, folder);
    const auto drawing = parse_markup(folder.text("island_frame_times.svg"));
    check_drawing(drawing);
    const auto boxes = label_boxes(drawing);
    CHECK(boxes.size() == 60);
    check_apart(boxes);
}

TEST_CASE("pictures are in the page, byte for byte", "[evaluation_report]") {
    Folder folder;
    EvaluatedRun run = measured("one", 10.0, 0.1);
    run.frame_ms = {10.0, 20.0, 30.0, 40.0};
    run.disparity_p99_px = {1.0, 2.0, 3.0, 4.0};
    run.worst_frame = 2;
    for (std::size_t more = 0; more < 4; ++more) {
        run.pictures.push_back({"picture " + std::to_string(more), png_start(200, 100, more)});
    }
    const auto page = write({"t", {}, {run}}, folder);
    std::size_t found = 0;
    for (const Element& element : page) {
        if (element.name != "img") {
            continue;
        }
        REQUIRE(found < run.pictures.size());
        const ReportPicture& picture = run.pictures[found];
        const std::string start = "data:image/png;base64,";
        REQUIRE(element.attribute("src").starts_with(start));
        CHECK(decoded(element.attribute("src").substr(start.size())) == picture.png);
        CHECK(element.attribute("alt") == picture.caption);
        CHECK(element.attribute("width") == "200");
        CHECK(element.attribute("height") == "100");
        ++found;
    }
    CHECK(found == 4);
    const auto headings = texts(page, "h4");
    CHECK(headings == std::vector<std::string>{"one: frame 2"});
    const auto paragraphs = texts(page, "p");
    CHECK(std::count(paragraphs.begin(), paragraphs.end(), "30.0 ms, disparity p99 3.00 px") == 1);
}

TEST_CASE("what cannot be a report is refused by name", "[evaluation_report]") {
    Folder folder;
    const auto message = [&](const Evaluation& evaluation) {
        const auto written = eval::write_report(evaluation, folder.path());
        REQUIRE_FALSE(written);
        CHECK_FALSE(fs::exists(folder.path())); // refused before anything was touched
        return written.error().message;
    };
    CHECK(
        message({"t", {}, {measured("a", 1.0, 0.1), measured("a", 2.0, 0.1)}}) ==
        "evaluation: runs[1]: walk 'island' has another run of the name 'a'"
    );
    CHECK(message({"t", {}, {measured("", 1.0, 0.1)}}) == "evaluation: runs[0].name is empty");
    EvaluatedRun run = measured("a", 1.0, 0.1);
    run.walk.clear();
    CHECK(message({"t", {}, {run}}) == "evaluation: runs[0].walk is empty");
    run.walk = "w";
    run.pictures = {{"good", png_start(1, 1, 0)}, {"bad", {1, 2, 3}}};
    CHECK(
        message({"t", {}, {run}}) ==
        "evaluation: runs[0].pictures[1] ('a', 'bad'), 3 bytes, is not a PNG file"
    );
    run.pictures[1].png = png_start(0, 1, 0); // no columns
    CHECK(message({"t", {}, {run}}).ends_with("24 bytes, is not a PNG file"));
}

TEST_CASE("files that cannot be written are errors", "[evaluation_report]") {
    Folder folder;
    const Evaluation evaluation{"t", {}, {measured("a", 1.0, 0.1)}};
    const auto message = [&](const fs::path& place) {
        const auto written = eval::write_report(evaluation, place);
        REQUIRE_FALSE(written);
        CHECK(written.error().code == farfield::ErrorCode::device);
        return written.error().message;
    };
    // A file where the folder should be.
    fs::create_directories(folder.path());
    { std::ofstream(folder.path() / "file") << "x"; }
    CHECK(
        message(folder.path() / "file").find("file: cannot be made a folder") != std::string::npos
    );
    CHECK(
        message(folder.path() / "file" / "under").find("under: cannot be made a folder") !=
        std::string::npos
    );
    // Folders where files should be: each kind of file in turn.
    for (const char* name : {"island_frame_times.svg", "results.csv", "report.html"}) {
        const fs::path inside = folder.path() / name;
        fs::create_directories(inside / "taken" / name / "taken");
        CHECK(
            message(inside / "taken").find(std::string(name) + ": cannot be replaced") !=
            std::string::npos
        );
    }
}

TEST_CASE("the same evaluation gives the same bytes", "[evaluation_report]") {
    EvaluatedRun run = measured("a", 1.0, 0.1);
    run.figures.error_px = 2.0;
    run.pictures = {{"picture", png_start(4, 4, 100)}};
    const Evaluation evaluation{
        "t", {"note"}, {run, measured("b", 3.0, 0.2), measured("c", 2.0, 0.3, "geometry")}};
    Folder folder;
    write(evaluation, folder);
    const auto first = folder.files();
    CHECK(first.size() >= 5);
    write(evaluation, folder);
    CHECK(folder.files() == first);
}
