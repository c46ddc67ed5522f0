#include "io/files.hpp"
#include <farfield/io/atoms.hpp>
#include <farfield/io/pdb.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

using namespace farfield;

namespace {

Result<std::vector<io::Atom>> read(const std::string& text) {
    support::TemporaryFolder folder;
    return io::read_pdb(folder.write("test.pdb", text));
}

std::string message(const std::string& text) {
    const auto atoms = read(text);
    return atoms ? "read" : atoms.error().message;
}

/// A record with everything in its columns.
std::string atom(
    const std::string& name,
    const std::string& element,
    const std::string& x = "  11.104",
    const std::string& location = " ",
    int residue = 1,
    const std::string& record = "ATOM  "
) {
    std::array<char, 100> line{};
    std::snprintf(
        line.data(),
        line.size(),
        "%s%5d %4s%1sGLY A%4d    %8s%8s%8s  1.00 20.00          %2s  \n",
        record.c_str(),
        1,
        name.c_str(),
        location.c_str(),
        residue,
        x.c_str(),
        "   6.134",
        "  -6.504",
        element.c_str()
    );
    return line.data();
}

} // namespace

TEST_CASE("PDB: atoms have the positions and elements of their columns") {
    const auto atoms = read(
        "HEADER    X\nREMARK   1 ATOM\n" + atom(" CA ", " C") +
        atom("ZN  ", "ZN", "-999.999", " ", 2, "HETATM") + "TER\n" + atom(" N  ", "n")
    );
    REQUIRE(atoms);
    REQUIRE(atoms->size() == 3);
    CHECK((*atoms)[0].position == glm::dvec3(11.104, 6.134, -6.504));
    CHECK((*atoms)[0].atomic_number == 6);
    CHECK((*atoms)[1].position.x == -999.999);
    CHECK((*atoms)[1].atomic_number == 30);
    CHECK((*atoms)[2].atomic_number == 7);
}

TEST_CASE("PDB: without an element the name tells it") {
    const auto [name, number] = GENERATE(
        std::pair<const char*, int>(" CA ", 6), // the alpha carbon
        std::pair<const char*, int>("CA  ", 20),
        std::pair<const char*, int>("1HB ", 1),
        std::pair<const char*, int>("HG11", 1), // and not mercury
        std::pair<const char*, int>("HG  ", 80),
        std::pair<const char*, int>(" OXT", 8),
        std::pair<const char*, int>("N1  ", 7),
        std::pair<const char*, int>(" D  ", 1),
        std::pair<const char*, int>("SE  ", 34)
    );
    INFO(name);
    const auto atoms = read(atom(name, "  "));
    REQUIRE(atoms);
    CHECK(static_cast<int>(atoms->front().atomic_number) == number);
    // Lines may end after the coordinates, with or without a carriage return.
    const auto cut = read(atom(name, "  ").substr(0, 54) + "\r\n");
    REQUIRE(cut);
    CHECK(cut->front().atomic_number == atoms->front().atomic_number);
}

TEST_CASE("PDB: only the first model and the first alternate location count") {
    const std::string one = atom(" CA ", " C");
    CHECK(read("MODEL 1\n" + one + one + "ENDMDL\nMODEL 2\n" + one + "ENDMDL\n")->size() == 2);
    CHECK(read("MODEL 1\n" + one + "MODEL 2\n" + one)->size() == 1);
    CHECK(read("MODEL 1\nENDMDL\nMODEL 2\n" + one + "ENDMDL\n")->size() == 1);
    CHECK(read(one + "END\n" + one)->size() == 1);

    const auto atoms = read(
        atom(" N  ", " N", "   1.000") + atom(" CA ", " C", "   2.000", "B") +
        atom(" CA ", " C", "   3.000", "A") + atom(" CB ", " C", "   4.000", "B") +
        // The next residue chooses anew.
        atom(" CA ", " C", "   5.000", "A", 2) + atom(" CA ", " C", "   6.000", "B", 2)
    );
    REQUIRE(atoms);
    std::vector<double> places;
    for (const io::Atom& one_of_them : *atoms) {
        places.push_back(one_of_them.position.x);
    }
    CHECK(places == std::vector<double>{1.0, 2.0, 4.0, 5.0});
}

TEST_CASE("PDB: errors name the line, the columns and the value") {
    CHECK(message("") == "test.pdb: no atoms");
    CHECK(message("HEADER\nEND\n") == "test.pdb: no atoms");
    const std::string good = atom(" CA ", " C");
    const auto second = [&](const std::string& x) { return message(good + atom(" CA ", " C", x)); };
    CHECK(second("   abc  ") == "test.pdb:2: columns 31-38, x, is 'abc', not a number");
    CHECK(second("        ") == "test.pdb:2: columns 31-38, x, is '', not a number");
    CHECK(second(" 1.0 2.0") == "test.pdb:2: columns 31-38, x, is '1.0 2.0', not a number");
    for (const char* const value : {"nan", "inf", "-inf", "1e999", "100000", "-1e5"}) {
        INFO(value);
        CHECK(
            second(value) == "test.pdb:2: columns 31-38, x, is '" + std::string(value) +
                                 "', expected less than 100000 either way"
        );
    }
    CHECK(
        message(good + good.substr(0, 46) + "\n") ==
        "test.pdb:2: columns 47-54, z, is '', not a number"
    );
    CHECK(
        message(atom(" CA ", "Q1")) == "test.pdb:1: columns 77-78, element, is 'Q1', which is none"
    );
    CHECK(
        message(atom("_12 ", "  ")) ==
        "test.pdb:1: columns 13-16, name, is '_12 ', which tells no element, and columns 77-78 "
        "are blank"
    );
    support::TemporaryFolder folder;
    CHECK(io::read_pdb(folder.path() / "no.pdb").error().code == ErrorCode::not_found);
    const auto path = folder.write("test.pdb", good);
    CHECK(io::read_pdb(path, good.size()));
    CHECK(io::read_pdb(path, good.size() - 1).error().code == ErrorCode::out_of_memory);
}

TEST_CASE("PDB: a file is loaded as balls, with a warning for radii that nobody gives") {
    const auto loaded = support::load_bytes(
        "test.PDB", atom(" CA ", " C") + atom("FE  ", "FE") + atom(" C  ", " C")
    );
    REQUIRE(loaded);
    CHECK(loaded->scene.name == "test");
    CHECK(loaded->scene.instances.size() == 3);
    CHECK(loaded->scene.meshes.size() == 2);
    CHECK(primitive_count(loaded->scene) == 2400);
    CHECK(loaded->scene.instances[1].object_to_world[0].x == 2.0);
    REQUIRE(loaded->warnings.size() == 1);
    CHECK(loaded->warnings[0] == "Fe has no van der Waals radius, 2 angstrom is taken");
}

TEST_CASE("elements are found by their symbols") {
    for (int number = 1; number <= 118; ++number) {
        const auto element = static_cast<std::uint8_t>(number);
        CHECK(io::find_element(io::element_symbol(element)) == element);
    }
    CHECK(static_cast<int>(io::find_element("CL").value_or(0)) == 17);
    CHECK(static_cast<int>(io::find_element("og").value_or(0)) == 118);
    CHECK_FALSE(io::find_element(""));
    CHECK_FALSE(io::find_element("Xx"));
    CHECK_FALSE(io::find_element("CAL"));
    CHECK(io::van_der_waals_radius(1) == 1.20);
    CHECK(io::van_der_waals_radius(6) == 1.70);
    CHECK(io::van_der_waals_radius(7) == 1.55);
    CHECK(io::van_der_waals_radius(8) == 1.52);
    CHECK(io::van_der_waals_radius(16) == 1.80);
    CHECK_FALSE(io::van_der_waals_radius(26));
    CHECK(io::cpk_color(6) != io::cpk_color(8));
}

TEST_CASE("a ball is closed, round and faces outwards") {
    const Mesh ball = io::make_ball();
    CHECK(primitive_count(ball) == 800);
    CHECK(ball.positions.size() == 402);
    for (const glm::vec3& position : ball.positions) {
        // Squares of components are rounded twice each: 3 ulp of 1.
        REQUIRE(std::abs(glm::length(position) - 1.0F) < 4e-7F);
    }
    CHECK(ball.normals == ball.positions);
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    double volume = 0.0;
    double least = 1.0;
    double most = 0.0;
    for (std::size_t i = 0; i < ball.indices.size(); i += 3) {
        std::array<glm::dvec3, 3> corners{};
        for (std::size_t k = 0; k < 3; ++k) {
            ++edges[{ball.indices[i + k], ball.indices[i + (k + 1) % 3]}];
            corners[k] = glm::dvec3(ball.positions[ball.indices[i + k]]);
        }
        const glm::dvec3 across = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
        REQUIRE(glm::dot(across, corners[0]) > 0.0);
        volume += glm::dot(corners[0], glm::cross(corners[1], corners[2])) / 6.0;
        const double area = glm::length(across) / 2.0;
        least = std::min(least, area);
        most = std::max(most, area);
    }
    CHECK(edges.size() == 2400); // each edge once in either direction
    for (const auto& [edge, count] : edges) {
        REQUIRE(count == 1);
        REQUIRE(edges.count({edge.second, edge.first}) == 1);
    }
    // Facets of edges of about 9 degrees lie up to 1 - cos(6 degrees) = 0.5 % inside.
    CHECK(volume < 4.0 / 3.0 * std::numbers::pi);
    CHECK(volume > 0.98 * 4.0 / 3.0 * std::numbers::pi);
    CHECK(most < 2.0 * least);
}

TEST_CASE("atoms that make no scene are refused by name") {
    const auto refusal = [](const std::vector<io::Atom>& atoms) {
        const auto scene = io::make_balls(atoms);
        return scene ? std::string("made") : scene.error().message;
    };
    CHECK(refusal({}) == "molecule: no atoms");
    CHECK(
        refusal({{}, {{0.0, std::numeric_limits<double>::quiet_NaN(), 0.0}, 6}}) ==
        "molecule: atoms[1].position[1] is nan"
    );
    CHECK(
        refusal({{{0.0, 0.0, 0.0}, 0}}) ==
        "molecule: atoms[0].atomic_number is 0, expected 1 to 118"
    );
    CHECK(
        refusal({{{0.0, 0.0, 0.0}, 119}}) ==
        "molecule: atoms[0].atomic_number is 119, expected 1 to 118"
    );
    CHECK(refusal(std::vector<io::Atom>(io::kMaxAtoms + 1)).find("molecule: 4194305 atoms") == 0);
}

TEST_CASE("each atom is a ball of its element, scaled and moved") {
    const std::vector<io::Atom> atoms = {
        {{1.0, 2.0, 3.0}, 8}, {{1e6, 0.0, 0.0}, 1}, {{0.0, 0.0, 0.0}, 8}};
    const Scene scene = io::make_balls(atoms).value();
    REQUIRE(validate(scene));
    REQUIRE(scene.meshes.size() == 2);
    CHECK(scene.meshes[0].name == "H");
    CHECK(scene.meshes[1].name == "O");
    REQUIRE(scene.instances.size() == 3);
    CHECK(scene.instances[0].mesh == make_id<MeshId>(1));
    CHECK(
        scene.instances[0].object_to_world ==
        glm::dmat4x3({1.52, 0, 0}, {0, 1.52, 0}, {0, 0, 1.52}, {1, 2, 3})
    );
    CHECK(scene.instances[1].object_to_world[0].x == 1.20);
    CHECK(scene.instances[1].object_to_world[3].x == 1e6);
    const Box3d box = item_bounds(scene, make_id<ItemId>(0));
    CHECK(box.hi.y == Approx(3.52).epsilon(1e-6));
    CHECK(box.lo.y == Approx(0.48).epsilon(1e-6));
}
