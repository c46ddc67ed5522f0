// Reads the table of rooms from docs/architecture.md and holds the #include lines of the library
// against it, so that the page and the code cannot drift apart.

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <istream>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kCoreTarget = "farfield::farfield";

struct Room {
    std::string name;
    std::string target;
};

const fs::path& source_dir() {
    static const fs::path dir = FARFIELD_SOURCE_DIR;
    return dir;
}

/// Text between backquotes, or nothing when the cell holds anything else.
std::optional<std::string> backquoted(std::string_view cell) {
    const std::size_t first = cell.find('`');
    const std::size_t last = cell.rfind('`');
    if (first == std::string_view::npos || first == last) {
        return std::nullopt;
    }
    return std::string(cell.substr(first + 1, last - first - 1));
}

/// Rows of the table under the heading "## Rooms", in order: `| `name` | `target` | ... |`.
std::vector<Room> read_rooms(std::istream& page) {
    std::vector<Room> rooms;
    bool in_section = false;
    for (std::string line; std::getline(page, line);) {
        if (line.starts_with("## ")) {
            in_section = line == "## Rooms";
        }
        if (!in_section || !line.starts_with("| `")) {
            continue;
        }
        const std::size_t second = line.find('|', 1);
        const std::size_t third = line.find('|', second + 1);
        const std::optional<std::string> name = backquoted(line.substr(0, second));
        const std::optional<std::string> target = backquoted(line.substr(second, third - second));
        if (name && target) {
            rooms.push_back({*name, *target});
        }
    }
    return rooms;
}

std::vector<Room> rooms_of_page() {
    std::ifstream page(source_dir() / "docs" / "architecture.md");
    REQUIRE(page);
    return read_rooms(page);
}

/// Paths of the #include lines, with their brackets or quotes: `<glm/vec3.hpp>`, `"core/x.hpp"`.
std::vector<std::string> includes_of(std::istream& source) {
    std::vector<std::string> includes;
    for (std::string line; std::getline(source, line);) {
        const std::size_t hash = line.find_first_not_of(" \t");
        if (hash == std::string::npos || line[hash] != '#') {
            continue;
        }
        const std::size_t word = line.find_first_not_of(" \t", hash + 1);
        if (word == std::string::npos || line.compare(word, 7, "include") != 0) {
            continue;
        }
        const std::size_t open = line.find_first_of("<\"", word + 7);
        if (open == std::string::npos) {
            continue;
        }
        const std::size_t close = line.find(line[open] == '<' ? '>' : '"', open + 1);
        if (close != std::string::npos) {
            includes.push_back(line.substr(open, close - open + 1));
        }
    }
    return includes;
}

std::string first_part(std::string_view path) {
    return std::string(path.substr(0, path.find('/')));
}

/// What is wrong with an #include in a file of room `from`; empty when nothing is.
std::string
violation(const std::vector<Room>& rooms, const std::string& from, const std::string& include) {
    const auto find = [&](const std::string& name) {
        return std::find_if(rooms.begin(), rooms.end(), [&](const Room& room) {
            return room.name == name;
        });
    };
    const auto here = find(from);
    if (here == rooms.end()) {
        return "room '" + from + "' is not in the table";
    }
    const bool in_core = here->target == kCoreTarget;
    const std::string path = include.substr(1, include.size() - 2);
    std::string room_path;
    if (include.front() == '"') {
        if (path.find('/') == std::string::npos) {
            return {}; // a neighbour in the same folder
        }
        room_path = path;
    } else if (path.starts_with("farfield/")) {
        room_path = path.substr(std::string_view("farfield/").size());
    } else {
        const bool standard = path.find_first_of("./") == std::string::npos;
        const bool light = path.starts_with("glm/") || path.starts_with("tl/");
        if (in_core && !standard && !light) {
            return "farfield::farfield needs only GLM and tl::expected, not " + include;
        }
        return {};
    }
    const auto there = find(first_part(room_path));
    if (there == rooms.end()) {
        return include + " is in no room of the table";
    }
    if (room_path.starts_with("gpu/null/") && from == "eval") {
        return include + " is a backend; eval sees only the abstract one";
    }
    if (there == here) {
        return {};
    }
    if (there > here) {
        return "room '" + from + "' stands above '" + there->name + "' and includes it";
    }
    if (there->target != kCoreTarget) {
        return "room '" + from + "' stands beside '" + there->name + "' and includes it";
    }
    return {};
}

struct SourceFile {
    fs::path path; ///< relative to the project
    std::string room;
};

/// All sources and headers of the rooms under `include/farfield` and `src`.
std::vector<SourceFile> library_files() {
    std::vector<SourceFile> files;
    for (const char* folder : {"include/farfield", "src"}) {
        const fs::path top = source_dir() / folder;
        for (const fs::directory_entry& entry : fs::recursive_directory_iterator(top)) {
            const fs::path extension = entry.path().extension();
            const fs::path inside = entry.path().lexically_relative(top);
            if (!entry.is_regular_file() || (extension != ".hpp" && extension != ".cpp") ||
                !inside.has_parent_path()) {
                continue;
            }
            files.push_back({entry.path().lexically_relative(source_dir()), *inside.begin()});
        }
    }
    std::sort(files.begin(), files.end(), [](const SourceFile& a, const SourceFile& b) {
        return a.path < b.path;
    });
    return files;
}

const std::vector<Room>& sample_rooms() {
    static const std::vector<Room> rooms = {
        {"core", "farfield::farfield"},
        {"gpu", "farfield::farfield"},
        {"technique", "farfield::farfield"},
        {"opengl", "farfield::opengl"},
        {"eval", "farfield::eval"},
    };
    return rooms;
}

} // namespace

TEST_CASE("The table of rooms is read in order and only from its own section", "[architecture]") {
    std::istringstream page(
        "# Page\n\n## Numbers\n| `not_a_room` | `x` | |\n"
        "## Rooms\n\n| room | target | holds |\n|---|---|---|\n"
        "| `core` | `farfield::farfield` | `Result` |\n| `io` | `farfield::io` | files |\n"
        "## Later\n| `neither` | `x` | |\n"
    );
    const std::vector<Room> rooms = read_rooms(page);
    REQUIRE(rooms.size() == 2);
    CHECK(rooms[0].name == "core");
    CHECK(rooms[0].target == "farfield::farfield");
    CHECK(rooms[1].name == "io");
    CHECK(rooms[1].target == "farfield::io");

    std::istringstream empty;
    CHECK(read_rooms(empty).empty());
}

TEST_CASE("Include lines are found, comments and other directives are not", "[architecture]") {
    std::istringstream source(
        "#include <farfield/core/ids.hpp>\n  #  include \"math/digits.hpp\" // why\n"
        "// #include <vector>\n#define include <map>\n#pragma once\n#\n#include MACRO\n"
    );
    CHECK(
        includes_of(source) ==
        std::vector<std::string>{"<farfield/core/ids.hpp>", "\"math/digits.hpp\""}
    );
}

TEST_CASE("Every kind of forbidden include is recognised", "[architecture]") {
    const auto judged = [](const char* from, const char* include) {
        return violation(sample_rooms(), from, include);
    };
    SECTION("allowed") {
        CHECK(judged("gpu", "<farfield/core/ids.hpp>").empty());
        CHECK(judged("gpu", "<farfield/gpu/backend.hpp>").empty());
        CHECK(judged("gpu", "<farfield/gpu/null/backend.hpp>").empty());
        CHECK(judged("gpu", "\"helper.hpp\"").empty());
        CHECK(judged("gpu", "\"core/helper.hpp\"").empty());
        CHECK(judged("gpu", "<vector>").empty());
        CHECK(judged("gpu", "<glm/vec3.hpp>").empty());
        CHECK(judged("opengl", "<farfield/gpu/null/backend.hpp>").empty());
        CHECK(judged("opengl", "<epoxy/gl.h>").empty());
        CHECK(judged("eval", "<farfield/technique/image_cache.hpp>").empty());
    }
    SECTION("forbidden") {
        CHECK_FALSE(judged("core", "<farfield/gpu/backend.hpp>").empty());
        CHECK_FALSE(judged("core", "\"gpu/helper.hpp\"").empty());
        CHECK_FALSE(judged("technique", "<farfield/opengl/backend.hpp>").empty());
        CHECK_FALSE(judged("eval", "<farfield/opengl/backend.hpp>").empty());
        CHECK_FALSE(judged("opengl", "<farfield/eval/run.hpp>").empty());
        CHECK_FALSE(judged("eval", "<farfield/gpu/null/backend.hpp>").empty());
        CHECK_FALSE(judged("core", "<epoxy/gl.h>").empty());
        CHECK_FALSE(judged("core", "<png.h>").empty());
        CHECK_FALSE(judged("core", "<farfield/farfield.hpp>").empty());
        CHECK_FALSE(judged("core", "\"../gpu/helper.hpp\"").empty());
        CHECK_FALSE(judged("attic", "<vector>").empty());
        CHECK_FALSE(judged("core", "<farfield/attic/x.hpp>").empty());
    }
}

TEST_CASE("The page names exactly the rooms that exist", "[architecture]") {
    std::set<std::string> named;
    for (const Room& room : rooms_of_page()) {
        INFO("room '" << room.name << "'");
        CHECK(named.insert(room.name).second);
    }
    std::set<std::string> existing;
    for (const SourceFile& file : library_files()) {
        existing.insert(file.room);
    }
    CHECK(named == existing);
}

TEST_CASE("A room includes only rooms above it", "[architecture]") {
    const std::vector<Room> rooms = rooms_of_page();
    const std::vector<SourceFile> files = library_files();
    REQUIRE_FALSE(files.empty());
    for (const SourceFile& file : files) {
        std::ifstream source(source_dir() / file.path);
        REQUIRE(source);
        for (const std::string& include : includes_of(source)) {
            const std::string wrong = violation(rooms, file.room, include);
            INFO(file.path.string() << ": " << wrong);
            CHECK(wrong.empty());
        }
    }
}

TEST_CASE("The umbrella header has every public header of the core library", "[architecture]") {
    std::set<std::string> core_rooms;
    for (const Room& room : rooms_of_page()) {
        if (room.target == kCoreTarget) {
            core_rooms.insert(room.name);
        }
    }
    std::ifstream umbrella(source_dir() / "include" / "farfield" / "farfield.hpp");
    REQUIRE(umbrella);
    const std::vector<std::string> lines = includes_of(umbrella);
    std::set<std::string> surplus(lines.begin(), lines.end());
    for (const SourceFile& file : library_files()) {
        // Headers in a folder `detail` are there for other headers alone.
        if (file.path.extension() != ".hpp" || *file.path.begin() != "include" ||
            !core_rooms.contains(file.room) || file.path.parent_path().filename() == "detail") {
            continue;
        }
        const std::string path = file.path.lexically_relative("include").generic_string();
        INFO("missing from farfield.hpp: " << path);
        CHECK(surplus.erase("<" + path + ">") == 1);
    }
    for (const std::string& include : surplus) {
        FAIL_CHECK("neither public nor of the core, yet in farfield.hpp: " << include);
    }
}
