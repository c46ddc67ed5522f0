// Every model of the folder FARFIELD_DATA: loaded with the number of triangles that its list
// announces, or refused for the reason it is there.
#include <farfield/io/coarse_mesh.hpp>
#include <farfield/io/pdb.hpp>
#include <farfield/io/scene_file.hpp>

#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>

namespace {

using namespace farfield;

std::filesystem::path data(const std::string& name) {
    return std::filesystem::path(FARFIELD_DATA) / name;
}

std::uint64_t stored_triangles(const Scene& scene) {
    std::uint64_t count = 0;
    for (const Mesh& mesh : scene.meshes) {
        count += primitive_count(mesh);
    }
    return count;
}

struct Model {
    const char* file;
    std::uint64_t stored;
    std::uint64_t instanced;
};

} // namespace

TEST_CASE("real scenes have the triangles that their list announces") {
    const auto model = GENERATE(
        Model{"forest/forest_1117.glb", 167456, 40772000},
        Model{"forest/terrain_257.png", 131072, 131072},
        Model{"trees/willow.glb", 36384, 36384},
        Model{"trees/oak_large.glb", 22566, 22566},
        Model{"trees/ash_medium.glb", 20000, 20000},
        Model{"trees/pine_medium.glb", 19872, 19872},
        Model{"trees/bush_1.glb", 13872, 13872},
        Model{"terrain_bigtujunga/bigtujunga.png", 1535664, 1535664},
        Model{"terrain_lunar_pit/tranquillitatis_pit.png", 131072, 131072},
        Model{"house_interior/house.glb", 112234, 145844},
        Model{"pipe_supports_huldra/huldra_pipe_supports.glb", 62712, 62712},
        Model{"engine_2cylinder/2CylinderEngine.glb", 75730, 121496},
        Model{"city_delft/delft.glb", 36269, 36269},
        Model{"city_instanced/city_kaykit.glb", 17943, 7824283},
        Model{"meshes_classic/stanford-bunny.obj", 69451, 69451},
        Model{"meshes_classic/armadillo.obj", 86482, 86482},
        Model{"meshes_classic/lucy.ply", 99970, 99970},
        Model{"meshes_classic/dragon_medium.glb", 14782, 14782},
        Model{"meshes_classic/dragon_low.glb", 2312, 2312},
        Model{"meshes_classic/spot_triangulated.obj", 5856, 5856},
        Model{"meshes_classic/teapot.obj", 6320, 6320},
        Model{"meshes_awkward/trimesh_chair_model.obj", 12756, 12756},
        Model{"meshes_awkward/trimesh_cycloidal.ply", 43368, 43368},
        Model{"meshes_awkward/trimesh_bunny.ply", 16301, 16301},
        Model{"meshes_awkward/trimesh_soup.stl", 100, 100},
        Model{"meshes_awkward/georeferenced_delft_buildings.obj", 5563, 5563},
        Model{"meshes_awkward/made_single_triangle.obj", 1, 1}
    );
    const auto loaded = io::load_scene(data(model.file), {.flag_splittable = false});
    INFO(model.file << ": " << (loaded ? "" : loaded.error().message));
    REQUIRE(loaded.has_value());
    CHECK(stored_triangles(loaded->scene) == model.stored);
    CHECK(primitive_count(loaded->scene) == model.instanced);
}

TEST_CASE("what is awkward and whole loads") {
    const auto* const file = GENERATE(
        "trimesh_capsule.obj",
        "trimesh_shared.STL",
        "trimesh_two_objects.obj",
        "trimesh_joined_tetrahedra.obj",
        "trimesh_not_convex.obj",
        "trimesh_featuretype.STL",
        "trimesh_octagonal_pocket.stl",
        "trimesh_large_block_obb.STL",
        "trimesh_wallhole.obj",
        "trimesh_whitespace.off",
        "trimesh_comments.off",
        "trimesh_negative_indices.obj",
        "trimesh_polygonfaces.obj",
        "trimesh_singlevn.obj",
        "trimesh_nancolor.obj",
        "trimesh_no_indices_3storybuilding.glb",
        "made_zero_area.obj",
        "made_all_coincident.obj",
        "made_huge_range.obj",
        "made_far_small_cube.obj",
        "made_flat_sheet.obj",
        "made_duplicate_triangles.obj"
    );
    const auto loaded = io::load_scene(data(std::string("meshes_awkward/") + file));
    INFO(file << ": " << (loaded ? "" : loaded.error().message));
    REQUIRE(loaded.has_value());
    CHECK(primitive_count(loaded->scene) > 0);
    CHECK(validate(loaded->scene).has_value()); // once more, after flag_splittable
}

TEST_CASE("what is broken or empty is refused with the place and the value") {
    struct Refusal {
        const char* file;
        const char* words;
    };
    const auto refusal = GENERATE(
        Refusal{"made_nan_vertex.obj", ":4: vertex coordinate y is nan"},
        Refusal{"made_inf_vertex.obj", ":7: vertex coordinate z is inf"},
        Refusal{"made_index_out_of_range.obj", ":22: vertex index is '0'"},
        Refusal{"made_truncated.ply", "the header announces 8 elements 'vertex'"},
        Refusal{"trimesh_notenoughindices.obj", ":9: a face has 2 indices"},
        Refusal{"trimesh_empty.obj", "no triangles"},
        Refusal{"trimesh_empty.ply", "no triangles"},
        Refusal{"trimesh_empty.stl", "no triangles"},
        Refusal{"trimesh_empty_nodes.glb", "no triangles"},
        Refusal{"trimesh_points_emptyface.ply", "no triangles"},
        Refusal{"trimesh_face_in_group_name.obj", "no triangles"}
    );
    const auto loaded = io::load_scene(data(std::string("meshes_awkward/") + refusal.file));
    REQUIRE_FALSE(loaded.has_value());
    CHECK(loaded.error().code == ErrorCode::bad_data);
    CHECK_THAT(loaded.error().message, Catch::Contains(refusal.words));
}

TEST_CASE("a georeferenced file keeps its millimetres") {
    // Coordinates have three decimals, so their sum in double is a whole number of millimetres to
    // within 1e-6; in single precision at 447,500 m the step is 31 mm.
    const auto loaded = io::load_scene(
        data("meshes_awkward/georeferenced_delft_buildings.obj"), {.up = io::UpAxis::z}
    );
    REQUIRE(loaded.has_value());
    CHECK(loaded->scene.up == glm::dvec3(0.0, 0.0, 1.0));
    const Mesh& mesh = loaded->scene.meshes.front();
    double worst = 0.0;
    for (const glm::vec3& position : mesh.positions) {
        for (int axis = 0; axis < 3; ++axis) {
            const double millimetres =
                1000.0 * (mesh.origin[axis] + static_cast<double>(position[axis]));
            worst = std::max(worst, std::abs(millimetres - std::round(millimetres)));
        }
    }
    // Half a step of a float at 260 m from the centre is 0.015 mm.
    CHECK(worst < 0.016);
}

TEST_CASE("a protein has the atoms that its records announce") {
    const auto atoms = io::read_pdb(data("protein_7ddo/7ddo.pdb"));
    REQUIRE(atoms.has_value());
    // 6,411 ATOM and 57 HETATM records; 7 of them are second alternate locations.
    CHECK(atoms->size() == 6468 - 7);
    std::map<int, int> counts;
    for (const io::Atom& atom : *atoms) {
        ++counts[atom.atomic_number];
    }
    CHECK(counts.size() == 5); // C, N, O, S, Zn
    CHECK(counts[30] == 1);
    const auto loaded = io::load_scene(data("protein_7ddo/7ddo.pdb"));
    REQUIRE(loaded.has_value());
    CHECK(loaded->warnings.empty());
    CHECK(loaded->scene.instances.size() == atoms->size());
    CHECK(primitive_count(loaded->scene) == 800 * atoms->size());
    // A globule of about 800 residues is some 100 angstrom across.
    const glm::dvec3 size = extent(scene_bounds(loaded->scene));
    CHECK(size.x > 50.0);
    CHECK(size.x < 150.0);
}

TEST_CASE("every mesh has a coarse model or a reason why not") {
    std::size_t made = 0;
    for (const char* const folder : {"meshes_classic", "meshes_awkward", "pipe_supports_huldra"}) {
        for (const auto& entry : std::filesystem::directory_iterator(data(folder))) {
            const auto loaded = io::load_scene(entry.path(), {.flag_splittable = false});
            if (!loaded) {
                continue; // refused above, or no scene at all
            }
            for (const Mesh& mesh : loaded->scene.meshes) {
                INFO(entry.path().filename() << ": " << mesh.name);
                auto coarse = io::make_coarse_mesh(mesh, {.triangles = 1000});
                if (!coarse) {
                    CHECK(coarse.error().code == ErrorCode::bad_data);
                    CHECK_THAT(coarse.error().message, Catch::Contains("an area"));
                    continue;
                }
                ++made;
                CHECK(primitive_count(*coarse) <= primitive_count(mesh));
                Scene scene = loaded->scene;
                scene.meshes = {std::move(*coarse)};
                scene.instances.clear();
                const auto valid = validate(scene);
                INFO((valid ? std::string() : valid.error().message));
                CHECK(valid.has_value());
            }
        }
    }
    CHECK(made > 30);
}
