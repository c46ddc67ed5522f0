#include "io/file.hpp"
#include "io/readers.hpp"
#include "io/text.hpp"
#include <farfield/io/atoms.hpp>
#include <farfield/io/pdb.hpp>

#include <array>
#include <cmath>
#include <new>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

namespace farfield::io {
namespace {

/// Columns of a line, counted from 1 as the format does; shorter or empty where the line ends.
std::string_view columns(std::string_view line, std::size_t first, std::size_t last) noexcept {
    return first > line.size() ? std::string_view() : line.substr(first - 1, last - first + 1);
}

std::string_view trimmed(std::string_view word) noexcept {
    while (!word.empty() && word.front() == ' ') {
        word.remove_prefix(1);
    }
    while (!word.empty() && word.back() == ' ') {
        word.remove_suffix(1);
    }
    return word;
}

bool is_letter(char c) noexcept {
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
}

/// The element that an atom's name of up to four columns tells.
std::optional<std::uint8_t> element_of_name(std::string_view name) noexcept {
    if (name.size() >= 2 && !is_letter(name[0])) { // a blank, or the digit of an old hydrogen
        return find_element(name.substr(1, 1));
    }
    const bool whole = trimmed(name).size() == 4;
    if (whole && (name[0] == 'H' || name[0] == 'D')) {
        return std::uint8_t{1};
    }
    if (const auto two = find_element(name.substr(0, 2)); two && name.size() >= 2) {
        return two;
    }
    return find_element(name.substr(0, 1));
}

class PdbReader {
  public:
    PdbReader(std::string_view bytes, std::string_view file) : bytes_(bytes), file_(file) {}

    Result<std::vector<Atom>> read() {
        std::size_t begin = 0;
        while (begin < bytes_.size() && !ended_) {
            const std::size_t end = std::min(bytes_.find('\n', begin), bytes_.size());
            std::string_view line = bytes_.substr(begin, end - begin);
            if (!line.empty() && line.back() == '\r') {
                line.remove_suffix(1);
            }
            ++line_;
            if (Result<void> done = read_line(line); !done) {
                return tl::unexpected(std::move(done).error());
            }
            begin = end + 1;
        }
        if (atoms_.empty()) {
            return fail(ErrorCode::bad_data, std::string(file_) + ": no atoms");
        }
        return std::move(atoms_);
    }

  private:
    [[nodiscard]] tl::unexpected<Error> bad(const std::string& message) const {
        return fail_at(file_, line_, message);
    }

    Result<void> read_line(std::string_view line) {
        const std::string_view record = trimmed(columns(line, 1, 6));
        if (record == "ATOM" || record == "HETATM") {
            return read_atom(line);
        }
        // Ends without atoms before them are those of an empty model.
        ended_ = !atoms_.empty() && (record == "END" || record == "ENDMDL" || record == "MODEL");
        return {};
    }

    Result<void> read_atom(std::string_view line) {
        if (is_other_location(line)) {
            return {};
        }
        Atom atom;
        constexpr std::array<std::string_view, 3> kNames = {
            "columns 31-38, x,", "columns 39-46, y,", "columns 47-54, z,"};
        for (int axis = 0; axis < 3; ++axis) {
            const std::string what(kNames[static_cast<std::size_t>(axis)]);
            const std::size_t first = 31 + 8 * static_cast<std::size_t>(axis);
            const std::string_view word = trimmed(columns(line, first, first + 7));
            double value = 0.0;
            if (!parse(word, value)) {
                return bad(what + " is " + quote(word) + ", not a number");
            }
            constexpr double kTooLarge = 1e5;
            if (!(std::abs(value) < kTooLarge)) {
                return bad(what + " is " + quote(word) + ", expected less than 100000 either way");
            }
            atom.position[axis] = value;
        }
        const std::string_view symbol = trimmed(columns(line, 77, 78));
        const std::string_view name = columns(line, 13, 16);
        const auto element = symbol.empty() ? element_of_name(name) : find_element(symbol);
        if (!element) {
            return symbol.empty()
                       ? bad("columns 13-16, name, is " + quote(name) +
                             ", which tells no element, and columns 77-78 are blank")
                       : bad("columns 77-78, element, is " + quote(symbol) + ", which is none");
        }
        atom.atomic_number = *element;
        if (atoms_.size() == kMaxAtoms) {
            return fail(
                ErrorCode::unsupported,
                std::string(file_) + ": more than the " + std::to_string(kMaxAtoms) +
                    " atoms that are allowed"
            );
        }
        atoms_.push_back(atom);
        return {};
    }

    /// Whether an atom is of another alternate location than the first one of its residue.
    bool is_other_location(std::string_view line) {
        const std::string_view location = columns(line, 17, 17);
        const std::string_view residue = columns(line, 22, 27); // chain, number, insertion
        if (residue != residue_) {
            residue_ = residue;
            location_ = std::string_view();
        }
        if (trimmed(location).empty()) {
            return false;
        }
        if (location_.empty()) {
            location_ = location;
        }
        return location != location_;
    }

    std::string_view bytes_;
    std::string_view file_;
    std::size_t line_ = 0;
    bool ended_ = false;
    std::string_view residue_;  ///< of the atom before
    std::string_view location_; ///< that this residue is read in; empty: none named yet
    std::vector<Atom> atoms_;
};

} // namespace

Result<std::vector<Atom>>
read_pdb(const std::filesystem::path& path, std::uint64_t max_file_bytes) {
    try {
        const auto bytes = read_file(path, max_file_bytes);
        if (!bytes) {
            return tl::unexpected(bytes.error());
        }
        return PdbReader(*bytes, path.filename().string()).read();
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::out_of_memory, path.string() + ": not enough memory");
    }
}

Result<void> read_pdb(const Input& input, LoadedScene& loaded) {
    const auto atoms = PdbReader(input.bytes, input.name).read();
    if (!atoms) {
        return tl::unexpected(atoms.error());
    }
    auto scene = make_balls(*atoms);
    if (!scene) {
        return tl::unexpected(std::move(scene).error());
    }
    std::set<std::uint8_t> others;
    for (const Atom& atom : *atoms) {
        if (!van_der_waals_radius(atom.atomic_number)) {
            others.insert(atom.atomic_number);
        }
    }
    for (const std::uint8_t element : others) {
        loaded.warnings.push_back(
            std::string(element_symbol(element)) + " has no van der Waals radius, " +
            text(kOtherRadius) + " angstrom is taken"
        );
    }
    loaded.scene = std::move(*scene);
    return {};
}

} // namespace farfield::io
