// OFF as Geomview defines it and as others write it: any blanks, comments anywhere, the header word
// glued to the counts or missing, colours behind vertices in bytes or fractions.
#include "io/raw_mesh.hpp"
#include "io/readers.hpp"
#include "io/text.hpp"

#include <array>
#include <cmath>
#include <utility>

namespace farfield::io {
namespace {

struct Header {
    bool normals = false;
    bool colors = false;
};

class OffReader {
  public:
    OffReader(const Input& input, LoadedScene& loaded)
        : input_(input), loaded_(loaded), scanner_(input.bytes, {'#', false}) {}

    Result<void> read() {
        if (auto done = read_header(); !done) {
            return done;
        }
        if (auto done = read_counts(); !done) {
            return done;
        }
        for (std::int64_t i = 0; i < vertices_; ++i) {
            if (auto done = read_vertex(); !done) {
                return done;
            }
        }
        for (std::int64_t i = 0; i < faces_; ++i) {
            if (auto done = read_face(i); !done) {
                return done;
            }
        }
        store_colors();
        auto mesh = finish_mesh(std::move(raw_), input_.name);
        if (!mesh) {
            return tl::unexpected(std::move(mesh.error()));
        }
        loaded_.scene.meshes.push_back(std::move(*mesh));
        loaded_.scene.instances.push_back({MeshId{0}});
        return {};
    }

  private:
    [[nodiscard]] tl::unexpected<Error> bad(const std::string& message) const {
        return fail_at(input_.name, scanner_.line(), message);
    }

    Result<void> read_number(const char* what, double& value) {
        const std::string_view word = scanner_.word();
        if (word.empty()) {
            return bad(std::string("the file ends before ") + what);
        }
        if (!parse(word, value)) {
            return bad(std::string(what) + " is " + quote(word) + ", not a number");
        }
        return {};
    }

    Result<void> read_header() {
        const std::string_view word = scanner_.word();
        const std::size_t end = word.find("OFF");
        if (end == std::string_view::npos) {
            if (std::int64_t count = 0; !parse(word, count)) {
                return bad("the file begins with " + quote(word) + " instead of OFF");
            }
            scanner_.return_to(word.data()); // no header: the counts come first
            return {};
        }
        std::string_view prefix = word.substr(0, end);
        if (prefix.substr(0, 2) == "ST") {
            prefix.remove_prefix(2); // texcoords end a vertex's line and are left there
        }
        if (prefix.substr(0, 1) == "C") {
            header_.colors = true;
            prefix.remove_prefix(1);
        }
        if (prefix.substr(0, 1) == "N") {
            header_.normals = true;
            prefix.remove_prefix(1);
        }
        if (prefix == "4" || prefix == "n" || prefix == "4n") {
            return fail(
                ErrorCode::unsupported,
                input_.name + ": " + quote(word) + " has vertices that are not three-dimensional"
            );
        }
        if (!prefix.empty()) {
            return bad("the file begins with " + quote(word) + " instead of OFF");
        }
        scanner_.return_to(word.data() + end + 3);
        const std::string_view next = scanner_.word();
        if (next == "BINARY") {
            return fail(ErrorCode::unsupported, input_.name + ": binary OFF is not read");
        }
        if (!next.empty()) {
            scanner_.return_to(next.data());
        }
        return {};
    }

    Result<void> read_count(const char* what, std::int64_t& value) {
        const std::string_view word = scanner_.word();
        if (!parse(word, value) || value < 0) {
            return bad(std::string("the number of ") + what + " is " + quote(word));
        }
        return {};
    }

    Result<void> read_counts() {
        if (auto done = read_count("vertices", vertices_); !done) {
            return done;
        }
        if (auto done = read_count("faces", faces_); !done) {
            return done;
        }
        // A vertex takes three digits and three blanks, a face a digit and a blank at the least,
        // the very last blank excepted.
        const auto remaining = static_cast<std::int64_t>(scanner_.remaining());
        if (vertices_ > remaining / 5 || faces_ > (remaining + 1) / 2) {
            return bad(
                "the header announces " + std::to_string(vertices_) + " vertices and " +
                std::to_string(faces_) + " faces, the file ends after " +
                std::to_string(remaining) + " bytes"
            );
        }
        static_cast<void>(scanner_.word_in_line()); // the number of edges, if it is there
        raw_.positions.reserve(static_cast<std::size_t>(vertices_));
        return {};
    }

    Result<void> read_vertex() {
        constexpr std::array<const char*, 3> kNames = {
            "vertex coordinate x", "vertex coordinate y", "vertex coordinate z"};
        glm::dvec3 position(0.0);
        for (int axis = 0; axis < 3; ++axis) {
            const char* const name = kNames[static_cast<std::size_t>(axis)];
            if (auto done = read_number(name, position[axis]); !done) {
                return done;
            }
            if (!std::isfinite(position[axis])) {
                return bad(std::string(name) + " is " + text(position[axis]));
            }
        }
        raw_.positions.push_back(position);
        if (header_.normals) {
            glm::dvec3 normal(0.0);
            for (int axis = 0; axis < 3; ++axis) {
                if (auto done = read_number("a vertex normal", normal[axis]); !done) {
                    return done;
                }
            }
            raw_.normals.emplace_back(normal);
        }
        if (header_.colors) {
            colors_.push_back(read_color());
        }
        scanner_.next_line();
        return {};
    }

    /// Up to four numbers at the end of a vertex's line; what is missing stays white.
    glm::dvec4 read_color() {
        glm::dvec4 color(-1.0);
        for (int channel = 0; channel < 4; ++channel) {
            if (!parse(scanner_.word_in_line(), color[channel])) {
                break;
            }
            in_bytes_ = in_bytes_ || color[channel] > 1.0;
        }
        return color;
    }

    Result<void> read_face(std::int64_t face) {
        const std::string_view word = scanner_.word();
        std::int64_t count = 0;
        if (word.empty()) {
            return bad(
                "the file ends after " + std::to_string(face) + " of " + std::to_string(faces_) +
                " faces"
            );
        }
        if (!parse(word, count) || count < 3) {
            return bad("a face has " + quote(word) + " vertices instead of 3 or more");
        }
        corners_.clear();
        for (std::int64_t k = 0; k < count; ++k) {
            const std::string_view index_word = scanner_.word();
            std::int64_t index = 0;
            if (index_word.empty()) {
                return bad("the file ends in a face");
            }
            if (!parse(index_word, index) || index < 0 || index >= vertices_) {
                return bad(
                    "face index " + quote(index_word) + " is not one of " +
                    std::to_string(vertices_) + " vertices"
                );
            }
            corners_.push_back(static_cast<std::uint32_t>(index));
        }
        append_fan(raw_.indices, corners_.size(), [this](std::size_t k) { return corners_[k]; });
        scanner_.next_line(); // what follows is the face's colour
        return {};
    }

    void store_colors() {
        const double scale = in_bytes_ ? 1.0 / 255.0 : 1.0;
        std::size_t invalid = 0;
        raw_.colors.reserve(colors_.size());
        for (const glm::dvec4& color : colors_) {
            glm::u8vec4 stored(255);
            if (std::isnan(color.x + color.y + color.z + color.w)) {
                ++invalid;
            } else {
                for (int channel = 0; channel < 4; ++channel) {
                    stored[channel] =
                        color[channel] < 0.0 ? stored[channel] : to_byte(color[channel] * scale);
                }
            }
            raw_.colors.push_back(stored);
        }
        if (invalid != 0) {
            loaded_.warnings.push_back(
                std::to_string(invalid) + " vertex colours are not numbers and became white"
            );
        }
    }

    const Input& input_;
    LoadedScene& loaded_;
    Scanner scanner_;
    Header header_;
    std::int64_t vertices_ = 0;
    std::int64_t faces_ = 0;
    RawMesh raw_;
    std::vector<glm::dvec4> colors_; ///< as written; negative: channel not given
    bool in_bytes_ = false;          ///< some channel is above 1, so all are in 0..255
    std::vector<std::uint32_t> corners_;
};

} // namespace

Result<void> read_off(const Input& input, LoadedScene& loaded) {
    return OffReader(input, loaded).read();
}

} // namespace farfield::io
