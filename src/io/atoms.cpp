#include "io/text.hpp"
#include <farfield/io/atoms.hpp>

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

namespace farfield::io {
namespace {

using glm::dvec3;

constexpr std::size_t kElements = 118;

constexpr std::array<std::string_view, kElements> kSymbols = {
    "H",  "He", "Li", "Be", "B",  "C",  "N",  "O",  "F",  "Ne", "Na", "Mg", "Al", "Si", "P",
    "S",  "Cl", "Ar", "K",  "Ca", "Sc", "Ti", "V",  "Cr", "Mn", "Fe", "Co", "Ni", "Cu", "Zn",
    "Ga", "Ge", "As", "Se", "Br", "Kr", "Rb", "Sr", "Y",  "Zr", "Nb", "Mo", "Tc", "Ru", "Rh",
    "Pd", "Ag", "Cd", "In", "Sn", "Sb", "Te", "I",  "Xe", "Cs", "Ba", "La", "Ce", "Pr", "Nd",
    "Pm", "Sm", "Eu", "Gd", "Tb", "Dy", "Ho", "Er", "Tm", "Yb", "Lu", "Hf", "Ta", "W",  "Re",
    "Os", "Ir", "Pt", "Au", "Hg", "Tl", "Pb", "Bi", "Po", "At", "Rn", "Fr", "Ra", "Ac", "Th",
    "Pa", "U",  "Np", "Pu", "Am", "Cm", "Bk", "Cf", "Es", "Fm", "Md", "No", "Lr", "Rf", "Db",
    "Sg", "Bh", "Hs", "Mt", "Ds", "Rg", "Cn", "Nh", "Fl", "Mc", "Lv", "Ts", "Og"};

struct Radius {
    std::uint8_t atomic_number = 0;
    double angstrom = 0.0;
};

constexpr std::array<Radius, 38> kRadii = {{
    {1, 1.20},  {2, 1.40},  {3, 1.82},  {6, 1.70},  {7, 1.55},  {8, 1.52},  {9, 1.47},  {10, 1.54},
    {11, 2.27}, {12, 1.73}, {14, 2.10}, {15, 1.80}, {16, 1.80}, {17, 1.75}, {18, 1.88}, {19, 2.75},
    {28, 1.63}, {29, 1.40}, {30, 1.39}, {31, 1.87}, {33, 1.85}, {34, 1.90}, {35, 1.85}, {36, 2.02},
    {46, 1.63}, {47, 1.72}, {48, 1.58}, {49, 1.93}, {50, 2.17}, {52, 2.06}, {53, 1.98}, {54, 2.16},
    {78, 1.75}, {79, 1.66}, {80, 1.55}, {81, 1.96}, {82, 2.02}, {92, 1.86},
}};

char upper(char c) noexcept {
    return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
}

} // namespace

std::string_view element_symbol(std::uint8_t atomic_number) noexcept {
    return kSymbols[std::size_t{atomic_number} - 1];
}

std::optional<std::uint8_t> find_element(std::string_view symbol) noexcept {
    const auto same = [](char a, char b) { return upper(a) == upper(b); };
    if (symbol == "D" || symbol == "d") {
        return std::uint8_t{1};
    }
    for (std::size_t i = 0; i < kElements; ++i) {
        if (std::equal(
                symbol.begin(), symbol.end(), kSymbols[i].begin(), kSymbols[i].end(), same
            )) {
            return static_cast<std::uint8_t>(i + 1);
        }
    }
    return std::nullopt;
}

std::optional<double> van_der_waals_radius(std::uint8_t atomic_number) noexcept {
    const auto* const found = std::find_if(kRadii.begin(), kRadii.end(), [&](const Radius& radius) {
        return radius.atomic_number == atomic_number;
    });
    return found == kRadii.end() ? std::nullopt : std::optional(found->angstrom);
}

glm::u8vec3 cpk_color(std::uint8_t atomic_number) noexcept {
    switch (atomic_number) {
    case 1: // hydrogen
        return {246, 246, 246};
    case 6: // carbon
        return {146, 146, 150};
    case 7: // nitrogen
        return {60, 90, 240};
    case 8: // oxygen
        return {232, 36, 28};
    case 9:  // fluorine
    case 17: // chlorine
        return {40, 220, 50};
    case 11: // sodium
    case 19: // potassium
        return {140, 70, 220};
    case 12: // magnesium
    case 20: // calcium
        return {30, 130, 40};
    case 15: // phosphorus
    case 26: // iron
        return {250, 140, 20};
    case 16: // sulphur
    case 34: // selenium
        return {246, 204, 50};
    case 29: // copper
    case 30: // zinc
    case 35: // bromine
        return {160, 60, 40};
    case 53: // iodine
        return {120, 20, 140};
    default:
        return {240, 40, 150};
    }
}

Mesh make_ball() {
    // An octahedron whose rows became circles: 4, 8 ... 40 ... 8, 4 vertices, and the poles.
    constexpr std::uint32_t kRows = 10; // from a pole to the equator; 8 * 10 * 10 triangles
    static_assert(8 * kRows * kRows == kBallTriangles);
    constexpr double kHalfPi = std::numbers::pi / 2.0;
    Mesh mesh;
    const auto quarter_of = [](std::uint32_t row) { return std::min(row, 2 * kRows - row); };
    std::array<std::uint32_t, 2 * kRows + 1> first{};
    for (std::uint32_t row = 0; row <= 2 * kRows; ++row) {
        first[row] = static_cast<std::uint32_t>(mesh.positions.size());
        const double from_pole = kHalfPi * row / kRows;
        const std::uint32_t around = std::max(4 * quarter_of(row), 1U);
        const bool pole = around == 1;
        for (std::uint32_t i = 0; i < around; ++i) {
            const double azimuth = 4.0 * kHalfPi * i / around;
            const double across = pole ? 0.0 : std::sin(from_pole);
            mesh.positions.emplace_back(
                dvec3(across * std::cos(azimuth), std::cos(from_pole), -across * std::sin(azimuth))
            );
        }
    }
    // Between two rows every quarter of the way around is a strip with one vertex more on the row
    // nearer to the equator.
    for (std::uint32_t row = 0; row < 2 * kRows; ++row) {
        const bool north = row < kRows;
        const std::uint32_t wide_row = north ? row + 1 : row;
        const std::uint32_t narrow_row = north ? row : row + 1;
        const std::uint32_t wide = quarter_of(wide_row);
        const std::uint32_t narrow = quarter_of(narrow_row);
        const auto vertex = [&](std::uint32_t in_row, std::uint32_t quarter, std::uint32_t i) {
            const std::uint32_t around = std::max(4 * quarter_of(in_row), 1U);
            return first[in_row] + (quarter * quarter_of(in_row) + i) % around;
        };
        const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
            // Anticlockwise from outside: the southern half mirrors the northern one.
            mesh.indices.insert(mesh.indices.end(), {a, north ? b : c, north ? c : b});
        };
        for (std::uint32_t quarter = 0; quarter < 4; ++quarter) {
            for (std::uint32_t i = 0; i < wide; ++i) {
                add(vertex(narrow_row, quarter, i),
                    vertex(wide_row, quarter, i),
                    vertex(wide_row, quarter, i + 1));
            }
            for (std::uint32_t i = 0; i < narrow; ++i) {
                add(vertex(narrow_row, quarter, i),
                    vertex(wide_row, quarter, i + 1),
                    vertex(narrow_row, quarter, i + 1));
            }
        }
    }
    mesh.normals = mesh.positions;
    mesh.parts.push_back({0, static_cast<std::uint32_t>(mesh.indices.size()), kNone<MaterialId>});
    update_bounds(mesh);
    return mesh;
}

Result<Scene> make_balls(std::span<const Atom> atoms) {
    if (atoms.empty()) {
        return fail(ErrorCode::invalid_argument, "molecule: no atoms");
    }
    if (atoms.size() > kMaxAtoms) {
        return fail(
            ErrorCode::unsupported,
            "molecule: " + std::to_string(atoms.size()) + " atoms, more than the " +
                std::to_string(kMaxAtoms) + " that are allowed"
        );
    }
    std::array<bool, kElements + 1> used{};
    for (std::size_t i = 0; i < atoms.size(); ++i) {
        const Atom& atom = atoms[i];
        const std::string name = "molecule: atoms[" + std::to_string(i) + "]";
        if (atom.atomic_number < 1 || atom.atomic_number > kElements) {
            return fail(
                ErrorCode::invalid_argument,
                name + ".atomic_number is " + std::to_string(atom.atomic_number) +
                    ", expected 1 to 118"
            );
        }
        for (int axis = 0; axis < 3; ++axis) {
            if (!std::isfinite(atom.position[axis])) {
                return fail(
                    ErrorCode::invalid_argument,
                    name + ".position[" + std::to_string(axis) + "] is " + text(atom.position[axis])
                );
            }
        }
        used[atom.atomic_number] = true;
    }
    Scene scene;
    scene.name = "molecule";
    std::array<MeshId, kElements + 1> mesh_of{};
    std::array<double, kElements + 1> radius_of{};
    for (std::size_t element = 1; element <= kElements; ++element) {
        if (!used[element]) {
            continue;
        }
        const auto number = static_cast<std::uint8_t>(element);
        mesh_of[element] = make_id<MeshId>(scene.meshes.size());
        radius_of[element] = van_der_waals_radius(number).value_or(kOtherRadius);
        scene.meshes.push_back(make_ball());
        scene.meshes.back().name = element_symbol(number);
        scene.meshes.back().parts[0].material = make_id<MaterialId>(scene.materials.size());
        scene.materials.push_back({glm::vec4(glm::vec3(cpk_color(number)) / 255.0F, 1.0F)});
    }
    scene.instances.reserve(atoms.size());
    for (const Atom& atom : atoms) {
        Instance instance;
        instance.mesh = mesh_of[atom.atomic_number];
        for (int axis = 0; axis < 3; ++axis) {
            instance.object_to_world[axis][axis] = radius_of[atom.atomic_number];
        }
        instance.object_to_world[3] = atom.position;
        scene.instances.push_back(instance);
    }
    if (Result<void> valid = validate(scene); !valid) { // a position near the largest double
        return tl::unexpected(std::move(valid).error());
    }
    return scene;
}

} // namespace farfield::io
