#include "gpu/drawer.hpp"
#include "gpu/drawing.hpp"
#include "gpu/flat_scene.hpp"
#include "support/random.hpp"
#include "support/small_scene.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

using namespace farfield;
using namespace farfield::support;

namespace {

constexpr std::uint32_t kTriangles = 300;

/// Triangles in random places and colours, in three parts: painted, cut out, painted otherwise.
struct Heap {
    Scene scene = flat_scene();
    std::vector<MaterialId> materials;
    static constexpr std::uint32_t kSecondPart = 120;
    static constexpr std::uint32_t kThirdPart = 200;

    Heap() {
        scene.textures.push_back(checker_texture(8));
        materials = {
            add_material(scene, {.base_color = {1.0F, 0.8F, 0.7F, 1.0F}}),
            add_material(
                scene,
                {.base_color = glm::vec4(1.0F), .texture = TextureId{0}, .alpha_cutoff = 0.5F}
            ),
            add_material(scene, {.base_color = {0.5F, 0.6F, 1.0F, 1.0F}})};
    }

    /// The triangles whose numbers are given, in their parts.
    [[nodiscard]] Mesh mesh_of(const std::vector<std::uint32_t>& triangles) const {
        Random random(41);
        Mesh mesh;
        for (std::uint32_t i = 0; i < kTriangles; ++i) {
            const glm::vec3 middle = random.vector(-4.0F, 4.0F);
            const std::vector<glm::vec3> corners = {
                middle + random.vector(-1.0F, 1.0F),
                middle + random.vector(-1.0F, 1.0F),
                middle + random.vector(-1.0F, 1.0F)};
            const auto color = static_cast<std::uint8_t>(random.below(200));
            for (const glm::vec3& corner_at : corners) {
                mesh.positions.push_back(corner_at);
                mesh.colors.push_back({color, 255 - color, 200, 255});
                mesh.texcoords.push_back(glm::vec2(random.vector(0.0F, 1.0F)));
            }
        }
        std::vector<std::uint32_t> ordered = triangles;
        std::sort(ordered.begin(), ordered.end());
        std::vector<std::uint32_t> ends;
        for (const std::uint32_t end : {kSecondPart, kThirdPart, kTriangles}) {
            const auto last = std::lower_bound(ordered.begin(), ordered.end(), end);
            ends.push_back(3 * static_cast<std::uint32_t>(last - ordered.begin()));
        }
        for (const std::uint32_t triangle : ordered) {
            for (std::uint32_t k = 0; k < 3; ++k) {
                mesh.indices.push_back(3 * triangle + k);
            }
        }
        compute_normals(mesh);
        update_bounds(mesh);
        std::uint32_t first = 0;
        for (std::size_t part = 0; part < ends.size(); ++part) {
            mesh.parts.push_back({first, ends[part] - first, materials[part]});
            first = ends[part];
        }
        return mesh;
    }

    ItemId add(const std::vector<std::uint32_t>& triangles, const glm::dvec3& offset = {}) {
        scene.meshes.push_back(mesh_of(triangles));
        add_instance(scene, make_id<MeshId>(scene.meshes.size() - 1), offset, 0.7, 1.1);
        return make_id<ItemId>(scene.instances.size() - 1);
    }
};

std::vector<std::uint32_t> all_triangles() {
    std::vector<std::uint32_t> all(kTriangles);
    std::iota(all.begin(), all.end(), 0U);
    return all;
}

/// So many of all, in no order.
std::vector<std::uint32_t> some_triangles(std::uint32_t count, std::uint64_t seed) {
    std::vector<std::uint32_t> all = all_triangles();
    Random random(seed);
    for (std::size_t i = all.size() - 1; i > 0; --i) {
        std::swap(all[i], all[random.below(static_cast<std::uint32_t>(i + 1))]);
    }
    all.resize(count);
    return all;
}

/// A frame that draws selections in one command.
FramePlan selecting_plan(
    const std::vector<std::pair<ItemId, std::vector<std::uint32_t>>>& selections,
    const View& view = flat_view()
) {
    FramePlan plan = flat_plan({}, view);
    for (const auto& [item, triangles] : selections) {
        plan.selections.push_back(
            {item,
             static_cast<std::uint32_t>(plan.selected.size()),
             static_cast<std::uint32_t>(triangles.size())}
        );
        plan.selected.insert(plan.selected.end(), triangles.begin(), triangles.end());
    }
    plan.commands[0].selection_count = static_cast<std::uint32_t>(selections.size());
    return plan;
}

int count_colored(const Picture& picture) {
    int count = 0;
    for (int y = 0; y < picture.height; ++y) {
        for (int x = 0; x < picture.width; ++x) {
            count += color_at(picture, x, y) == kBlack ? 0 : 1;
        }
    }
    return count;
}

} // namespace

TEST_CASE("Selected triangles look like a mesh that has no others") {
    for (const glm::dvec3& offset : {glm::dvec3(0.0), glm::dvec3(1.0e7, -2.0e6, 4.0e6)}) {
        Heap heap;
        const ItemId whole = heap.add(all_triangles(), offset);
        std::vector<std::vector<std::uint32_t>> choices = {
            {0}, {kTriangles - 1}, {Heap::kSecondPart}, {150, 250, 10}, all_triangles()};
        for (const std::uint32_t count : {20U, 60U, 200U}) {
            choices.push_back(some_triangles(count, count));
        }
        std::vector<ItemId> parts;
        for (const std::vector<std::uint32_t>& choice : choices) {
            parts.push_back(heap.add(choice, offset));
        }
        const auto drawer = make_drawer(heap.scene);
        if (drawer == nullptr) {
            return;
        }
        const int most_samples = std::min(4, drawer->backend().limits().samples);
        const View view = flat_view(offset);
        for (const int samples : {1, most_samples}) {
            for (std::size_t i = 0; i < choices.size(); ++i) {
                INFO("offset " << offset.x << ", choice " << i << ", " << samples << " samples");
                const Picture expected =
                    draw(drawer->backend(), flat_plan({parts[i]}, view), kSize, kSize, samples);
                const FramePlan plan = selecting_plan({{whole, choices[i]}}, view);
                const Picture picture = draw(drawer->backend(), plan, kSize, kSize, samples);
                CHECK(count_different(picture, expected) == 0);
                CHECK((choices[i].size() < 20 || count_colored(picture) > 100));
            }
            const Picture nothing =
                draw(drawer->backend(), selecting_plan({{whole, {}}}, view), kSize, kSize, samples);
            CHECK(count_colored(nothing) == 0);
        }
    }
}

TEST_CASE("Selections stand beside items, other selections and clip boxes") {
    Heap heap;
    const std::vector<std::uint32_t> first = some_triangles(60, 1);
    const std::vector<std::uint32_t> second = some_triangles(80, 2);
    std::vector<std::uint32_t> rest; // of the second, without the first
    for (const std::uint32_t triangle : second) {
        if (std::find(first.begin(), first.end(), triangle) == first.end()) {
            rest.push_back(triangle);
        }
    }
    const ItemId whole = heap.add(all_triangles());
    const ItemId twin = heap.add(all_triangles(), {1.5, 1.0, -2.0});
    const ItemId first_alone = heap.add(first);
    const ItemId rest_alone = heap.add(rest);
    const ItemId twin_alone = heap.add(second, {1.5, 1.0, -2.0});
    const ItemId quad = add_quad(heap.scene, kGreenPaint, {0.0, 0.0, -1.0}, 3.0);
    const auto drawer = make_drawer(heap.scene);
    if (drawer == nullptr) {
        return;
    }
    Backend& backend = drawer->backend();
    const auto picture_of = [&](const FramePlan& plan) {
        return draw(backend, plan, kSize, kSize);
    };

    // Twice of one item, of two items, and a whole one in between.
    FramePlan plan = selecting_plan({{whole, first}, {twin, second}, {whole, rest}});
    plan.items = {quad};
    plan.commands[0].count = 1;
    const FramePlan alone = flat_plan({first_alone, rest_alone, twin_alone, quad});
    CHECK(count_different(picture_of(plan), picture_of(alone)) == 0);

    // In two commands, one of them clipped.
    const Box3f clip{{-1.0F, -4.0F, -4.0F}, {2.0F, 1.0F, 4.0F}};
    plan.clips = {clip};
    plan.commands.push_back(plan.commands[0]);
    plan.commands[0].selection_count = 1;
    plan.commands[0].clip = 0;
    plan.commands[1].count = 0;
    plan.commands[1].first_selection = 1;
    plan.commands[1].selection_count = 2;
    plan.passes[0].command_count = 2;
    FramePlan clipped = flat_plan({first_alone, quad, rest_alone, twin_alone});
    clipped.clips = {clip};
    clipped.commands.push_back(clipped.commands[0]);
    clipped.commands[0].count = 2;
    clipped.commands[0].clip = 0;
    clipped.commands[1].first = 2;
    clipped.commands[1].count = 2;
    clipped.passes[0].command_count = 2;
    const Picture picture = picture_of(plan);
    CHECK(count_different(picture, picture_of(clipped)) == 0);
    CHECK(count_different(picture, picture_of(alone)) > 100);

    // As a mask, that hides what comes after it.
    plan = selecting_plan({{whole, first}});
    plan.commands[0].kind = Command::Kind::mask;
    plan.items = {twin};
    Command after;
    after.count = 1;
    plan.commands.push_back(after);
    plan.passes[0].command_count = 2;
    FramePlan mask = flat_plan({first_alone, twin});
    mask.commands.push_back(mask.commands[0]);
    mask.commands[0].kind = Command::Kind::mask;
    mask.commands[0].count = 1;
    mask.commands[1].first = 1;
    mask.commands[1].count = 1;
    mask.passes[0].command_count = 2;
    CHECK(count_different(picture_of(plan), picture_of(mask)) == 0);
}

TEST_CASE("Primitives of split items are selected by their numbers in the mesh") {
    Scene scene = flat_scene();
    Mesh ground = ground_mesh(24, 12.0F);
    std::vector<std::uint32_t> chosen;
    Random random(9);
    for (std::uint32_t i = 0; i < ground.indices.size() / 3; ++i) {
        if (random.below(3) == 0) {
            chosen.push_back(i);
        }
    }
    Mesh part = ground;
    part.splittable = false;
    part.indices.clear();
    for (const std::uint32_t triangle : chosen) {
        for (std::uint32_t k = 0; k < 3; ++k) {
            part.indices.push_back(ground.indices[std::size_t{3} * triangle + k]);
        }
    }
    const MaterialId red = add_material(scene, {.base_color = kRedPaint});
    add_instance(scene, add_mesh(scene, std::move(ground), red), {0.0, -1.0, 0.0});
    const auto built = partition::build_bsp(
        objects_of(scene), {.max_piece_primitives = 32}, primitive_bounds_of(scene)
    );
    REQUIRE(built.has_value());
    REQUIRE(built->pieces.size() > 2);
    add_instance(scene, add_mesh(scene, std::move(part), red), {0.0, -1.0, 0.0});
    const auto drawer = make_drawer(scene, &*built);
    if (drawer == nullptr) {
        return;
    }
    Backend& backend = drawer->backend();
    const Picture expected = draw(backend, flat_plan({ItemId{1}}), kSize, kSize);
    FramePlan plan = selecting_plan({{ItemId{0}, chosen}});
    const Picture picture = draw(backend, plan, kSize, kSize);
    CHECK(count_different(picture, expected) == 0);
    CHECK(count_colored(picture) > 200);

    // With pieces of the same item in the same command: either draws.
    plan.pieces = built->pieces;
    plan.commands[0].piece_count = 1;
    const Picture both = draw(backend, plan, kSize, kSize);
    CHECK(count_colored(both) >= count_colored(picture));
    plan.commands[0].piece_count = static_cast<std::uint32_t>(plan.pieces.size());
    CHECK(draw(backend, plan, kSize, kSize) == draw(backend, flat_plan({ItemId{0}}), kSize, kSize));
}
