#include "scenes/molecule.hpp"

#include "scenes/scene_catalog.hpp"
#include <farfield/io/atoms.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <string>
#include <vector>

namespace {

using farfield::Scene;
using farfield::io::Atom;
using farfield::scenes::MoleculeOptions;
namespace scenes = farfield::scenes;

const std::vector<Atom>& canonical() {
    static const std::vector<Atom> atoms = scenes::fold_molecule().value();
    return atoms;
}

double gap(const Atom& a, const Atom& b) {
    return glm::distance(a.position, b.position);
}

bool same(const std::vector<Atom>& a, const std::vector<Atom>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Atom& x, const Atom& y) {
        return x.position == y.position && x.atomic_number == y.atomic_number;
    });
}

} // namespace

TEST_CASE("molecules out of range are refused by name", "[molecule]") {
    for (const int atoms : {-1, 0, 1'000'001}) {
        const auto folded = scenes::fold_molecule({.atoms = atoms});
        REQUIRE_FALSE(folded);
        CHECK(
            folded.error().message ==
            "molecule: atoms is " + std::to_string(atoms) + ", expected 1 to 1000000"
        );
        CHECK_FALSE(scenes::make_molecule({.atoms = atoms}));
    }
}

TEST_CASE("a molecule has exactly the atoms asked for", "[molecule]") {
    for (const int atoms : {1, 2, 3, 7, 100, 6533, 6534}) {
        const auto folded = scenes::fold_molecule({.atoms = atoms});
        REQUIRE(folded);
        CHECK(folded->size() == static_cast<std::size_t>(atoms));
    }
}

TEST_CASE("the canonical molecule is the scene it has to be", "[molecule]") {
    const Scene scene = scenes::make_molecule().value();
    REQUIRE(farfield::validate(scene));
    CHECK(scene.instances.size() == 6534);
    CHECK(farfield::primitive_count(scene) == 5'227'200);
    REQUIRE(scene.meshes.size() == 5);
    CHECK(scene.materials.size() == 5);
    CHECK(scene.meshes[0].name == "H");
    CHECK(scene.meshes[4].name == "S");
}

TEST_CASE("a molecule is made of what proteins are made of", "[molecule]") {
    std::map<int, int> counts;
    for (const Atom& atom : canonical()) {
        ++counts[atom.atomic_number];
    }
    // Shares of atoms of proteins without the hydrogens of carbons, roughly.
    CHECK(counts[6] > 0.45 * 6534);
    CHECK(counts[7] > 0.12 * 6534);
    CHECK(counts[8] > 0.12 * 6534);
    CHECK(counts[1] > 0.08 * 6534);
    CHECK(counts[16] > 0);
    CHECK(counts[16] < 0.03 * 6534);
}

TEST_CASE("atoms are bonded, and the chain does not meet itself", "[molecule]") {
    const std::vector<Atom>& atoms = canonical();
    for (std::size_t i = 0; i < atoms.size(); ++i) {
        double nearest = std::numeric_limits<double>::infinity();
        double nearest_apart = nearest;
        for (std::size_t j = 0; j < atoms.size(); ++j) {
            const double distance = gap(atoms[i], atoms[j]);
            nearest = i == j ? nearest : std::min(nearest, distance);
            // Residues have 14 atoms at most, so those 30 apart are of residues that no bond joins;
            // the nearest are oxygens and hydrogens along helices.
            nearest_apart = i > j + 30 ? std::min(nearest_apart, distance) : nearest_apart;
        }
        REQUIRE(nearest_apart > 1.6);
        // The longest bond is that of sulphur and carbon.
        REQUIRE(nearest < 1.82);
    }
}

TEST_CASE("peptides are flat and have the bonds of proteins", "[molecule]") {
    // The second residue of a chain begins with its nitrogen, hydrogen and alpha carbon; the first
    // one is alpha carbon, carbon, oxygen.
    const std::vector<Atom>& atoms = canonical();
    const std::vector<int> expected = {6, 6, 8, 7, 1, 6, 6, 8};
    for (std::size_t i = 0; i < expected.size(); ++i) {
        REQUIRE(static_cast<int>(atoms[i].atomic_number) == expected[i]);
    }
    // Construction in double, coordinates of some 30 angstrom.
    CHECK(gap(atoms[0], atoms[1]) == Approx(1.525).epsilon(1e-9));
    CHECK(gap(atoms[1], atoms[2]) == Approx(1.231).epsilon(1e-9));
    CHECK(gap(atoms[1], atoms[3]) == Approx(1.329).epsilon(1e-9));
    CHECK(gap(atoms[3], atoms[4]) == Approx(1.010).epsilon(1e-9));
    // The group is 3.803 long and hangs between alpha carbons 3.800 apart.
    CHECK(gap(atoms[0], atoms[5]) == Approx(3.800).epsilon(1e-5));
    CHECK(gap(atoms[3], atoms[5]) == Approx(1.458).margin(0.02));
    const glm::dvec3 normal = glm::normalize(
        glm::cross(atoms[1].position - atoms[0].position, atoms[2].position - atoms[0].position)
    );
    for (const std::size_t i : {3U, 4U, 5U}) {
        CHECK(std::abs(glm::dot(normal, atoms[i].position - atoms[0].position)) < 1e-9);
    }
    // Along a helix the oxygen stands off the axis of the alpha carbons on the side of no
    // hydrogen.
    CHECK(gap(atoms[2], atoms[4]) > 2.8);
}

TEST_CASE("a molecule is a ball around 0 without holes", "[molecule]") {
    const std::vector<Atom>& atoms = canonical();
    glm::dvec3 middle(0.0);
    double square = 0.0;
    std::size_t outside = 0;
    // 15.5 cubic angstrom an atom.
    const double radius = std::cbrt(15.5 * 6534.0 * 0.75 / std::numbers::pi);
    for (const Atom& atom : atoms) {
        middle += atom.position / 6534.0;
        square += glm::dot(atom.position, atom.position) / 6534.0;
        outside += glm::length(atom.position) > 1.2 * radius ? 1 : 0;
    }
    CHECK(glm::length(middle) < 0.1 * radius);
    // sqrt(3/5) R for a full ball; loops and side chains stand off it by a tenth.
    CHECK(std::sqrt(square) > 0.77 * radius);
    CHECK(std::sqrt(square) < 0.85 * radius);
    CHECK(outside < atoms.size() / 50);
    // In the inner half of it, no place is farther from an atom than helices allow.
    for (int x = -4; x <= 4; ++x) {
        for (int y = -4; y <= 4; ++y) {
            for (int z = -4; z <= 4; ++z) {
                const Atom probe = {glm::dvec3(x, y, z) * (radius / 8.0), 6};
                double nearest = radius;
                for (const Atom& atom : atoms) {
                    nearest = std::min(nearest, gap(probe, atom));
                }
                REQUIRE(nearest < 6.0);
            }
        }
    }
}

TEST_CASE("the same options fold the same molecule, another seed another one", "[molecule]") {
    CHECK(same(canonical(), scenes::fold_molecule().value()));
    CHECK_FALSE(same(canonical(), scenes::fold_molecule({.seed = 1}).value()));
}

TEST_CASE("a molecule is shown from 1.75 to 14 radii, wherever it comes from", "[molecule]") {
    Scene scene = farfield::io::make_balls({{{{10.0, 0.0, 0.0}, 6}}}).value();
    const auto shown = scenes::show_molecule(std::move(scene));
    REQUIRE(shown);
    CHECK(shown->width == 124);
    CHECK(shown->height == 124);
    CHECK(shown->fov_deg == 60.0);
    const farfield::PathPose pose = farfield::eval::pose_at(shown->path, 0);
    const double angle = 25.0 * std::numbers::pi / 180.0;
    const glm::dvec3 expected =
        glm::dvec3(10.0, 0.0, 0.0) + 1.75 * 1.7 * glm::dvec3(std::sin(angle), 0.0, std::cos(angle));
    // The radius is that of float vertices.
    CHECK(glm::distance(pose.eye, expected) < 1e-5);
    CHECK_FALSE(scenes::show_molecule(Scene{}));
}
