// Growth of the partition builders with the number of objects, on scenes of different kinds, and of
// what follows a changing world; beside the builders, where Embree is part of the build, its
// builder of bounding volumes on the same boxes, with one thread as ours.
#include "../tests/partition/scenes.hpp"
#include <farfield/partition/bsp.hpp>
#include <farfield/partition/changes.hpp>
#include <farfield/partition/kdtree.hpp>
#include <farfield/partition/octree.hpp>

#include <benchmark/benchmark.h>
#if FARFIELD_BENCH_EMBREE
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace {

using farfield::Object;

/// What a tree is worth when rays or frusta go through it: the surfaces of its boxes, those of
/// leaves once for each item or primitive, over the surface of the root.
struct SurfaceCost {
    double sum = 0.0;
    double root = 0.0;

    static double area(const glm::dvec3& size) {
        return 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
    }

    [[nodiscard]] double value() const { return root > 0.0 ? sum / root : 0.0; }
};

double surface_cost(const farfield::Hierarchy& tree) {
    SurfaceCost cost;
    for (const farfield::HierarchyNode& node : tree.nodes) {
        const farfield::Box3f box = farfield::bounds(node);
        if (farfield::is_empty(box)) {
            continue;
        }
        const double area = SurfaceCost::area(glm::dvec3(box.hi) - glm::dvec3(box.lo));
        cost.root = &node == tree.nodes.data() ? area : cost.root;
        const bool leaf = farfield::is_leaf(node);
        const std::uint64_t drawn = node.item_count + node.piece_primitives + node.guest_primitives;
        cost.sum += area * static_cast<double>(leaf ? drawn : 1U);
    }
    return cost.value();
}

/// What a tree is worth, beside the time it took.
void report(benchmark::State& state, const farfield::Hierarchy& tree, std::size_t elements) {
    using benchmark::Counter;
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(elements));
    state.counters["depth"] = Counter(tree.quality.depth);
    state.counters["leaves"] = Counter(tree.quality.leaves);
    state.counters["surface_cost"] = Counter(surface_cost(tree));
    state.counters["cut_items"] = Counter(tree.quality.cut_items);
    state.counters["guests"] = Counter(static_cast<double>(tree.nodes[0].guest_primitives));
    state.counters["tree_bytes"] = Counter(static_cast<double>(farfield::memory_bytes(tree)));
}

template <typename Builder>
void measure(benchmark::State& state, std::size_t elements, const Builder& builder) {
    farfield::Hierarchy last;
    while (state.KeepRunning()) {
        auto tree = builder();
        if (!tree) {
            state.SkipWithError(tree.error().message.c_str());
            return;
        }
        last = std::move(*tree);
    }
    report(state, last, elements);
}

void build(
    benchmark::State& state,
    std::span<const Object> objects,
    std::size_t elements,
    const farfield::partition::BspOptions& options,
    const farfield::PrimitiveBounds& primitive_bounds = {}
) {
    measure(state, elements, [&] {
        return farfield::partition::build_bsp(objects, options, primitive_bounds);
    });
}

/// Leaves of one box, as a BSP's; cells of these scenes need 17 halvings and more.
void build_kdtree(benchmark::State& state, std::span<const Object> objects) {
    measure(state, objects.size(), [&] {
        return farfield::partition::build_kdtree(
            objects, {.branching = 4, .max_primitives = 1, .max_depth = 16}
        );
    });
}

void random_boxes(benchmark::State& state) {
    const auto objects =
        farfield::support::random_boxes(static_cast<std::size_t>(state.range(0)), 1);
    build(state, objects, objects.size(), {.split_vertically = true});
}

void touching_grid(benchmark::State& state) {
    const auto objects = farfield::support::grid_boxes(static_cast<std::size_t>(state.range(0)));
    build(state, objects, objects.size(), {});
}

void clusters(benchmark::State& state) {
    const auto objects =
        farfield::support::clustered_boxes(static_cast<std::size_t>(state.range(0)), 1);
    build(state, objects, objects.size(), {});
}

/// One object of many primitives, which lie as the tiles of `touching_grid` do.
void touching_primitives(benchmark::State& state) {
    const auto tiles = farfield::support::grid_boxes(static_cast<std::size_t>(state.range(0)));
    Object object;
    object.primitives = tiles.size();
    object.splittable = true;
    for (const Object& tile : tiles) {
        object.bounds = unite(object.bounds, tile.bounds);
    }
    build(state, {&object, 1}, tiles.size(), {}, [&](std::uint32_t, std::uint32_t primitive) {
        return tiles[primitive].bounds;
    });
}

void kdtree_random_boxes(benchmark::State& state) {
    build_kdtree(
        state, farfield::support::random_boxes(static_cast<std::size_t>(state.range(0)), 1)
    );
}

void kdtree_touching_grid(benchmark::State& state) {
    build_kdtree(state, farfield::support::grid_boxes(static_cast<std::size_t>(state.range(0))));
}

void kdtree_clusters(benchmark::State& state) {
    build_kdtree(
        state, farfield::support::clustered_boxes(static_cast<std::size_t>(state.range(0)), 1)
    );
}

/// A height field of about so many triangles: hills of 50 m on squares of 1 m.
struct Ground {
    explicit Ground(std::size_t triangles)
        : posts(static_cast<std::size_t>(std::sqrt(static_cast<double>(triangles) / 2.0)) + 1) {
        for (std::size_t index = 0; index < posts * posts; ++index) {
            const std::size_t row = index / posts;
            const auto x = static_cast<double>(index % posts);
            const auto z = static_cast<double>(row);
            const double height = 25.0 * (std::sin(0.05 * x) + std::sin(0.031 * z + 1.0));
            vertices.emplace_back(x, height, z);
        }
        object.splittable = true;
        object.primitives = 2 * (posts - 1) * (posts - 1);
        for (const glm::dvec3& vertex : vertices) {
            object.bounds = unite(object.bounds, vertex);
        }
    }

    [[nodiscard]] farfield::Triangle3d triangle(std::uint32_t index) const {
        const std::size_t cell = index / 2;
        const std::size_t corner = cell / (posts - 1) * posts + cell % (posts - 1);
        const std::size_t half = index % 2 == 0 ? corner : corner + posts + 1;
        return {vertices[half], vertices[corner + 1], vertices[corner + posts]};
    }

    std::size_t posts;
    std::vector<glm::dvec3> vertices;
    Object object;
};

/// Ground cut to leaves of `max_primitives` triangles: by the BSP, which takes their boxes and
/// cuts none; by k-d tree and octree, which take the triangles, or for comparison their boxes.
enum class GroundBuilder { bsp, kdtree, kdtree_boxes, octree };

void build_ground(benchmark::State& state, GroundBuilder builder) {
    const Ground ground(static_cast<std::size_t>(state.range(0)));
    const auto most = static_cast<std::uint32_t>(state.range(1));
    const std::span<const Object> objects(&ground.object, 1);
    const farfield::PrimitiveBounds boxes = [&](std::uint32_t, std::uint32_t primitive) {
        return farfield::bounds(ground.triangle(primitive));
    };
    const farfield::PrimitiveTriangle triangles = [&](std::uint32_t, std::uint32_t primitive) {
        return ground.triangle(primitive);
    };
    const farfield::partition::KdTreeOptions options{
        .branching = 4, .max_primitives = most, .max_depth = 12};
    measure(state, ground.object.primitives, [&] {
        switch (builder) {
        case GroundBuilder::bsp:
            return farfield::partition::build_bsp(objects, {.max_piece_primitives = most}, boxes);
        case GroundBuilder::kdtree:
            return farfield::partition::build_kdtree(objects, options, triangles);
        case GroundBuilder::kdtree_boxes:
            return farfield::partition::build_kdtree(objects, options, boxes);
        case GroundBuilder::octree:
            break;
        }
        return farfield::partition::build_octree(
            objects, {.max_primitives = most, .max_depth = 12}, triangles
        );
    });
}

void ground_bsp(benchmark::State& state) {
    build_ground(state, GroundBuilder::bsp);
}

void ground_kdtree(benchmark::State& state) {
    build_ground(state, GroundBuilder::kdtree);
}

void ground_kdtree_boxes(benchmark::State& state) {
    build_ground(state, GroundBuilder::kdtree_boxes);
}

void ground_octree(benchmark::State& state) {
    build_ground(state, GroundBuilder::octree);
}

/// 1117 trees and nothing else, then with a terrain of 131,072 triangles; on discs of two sizes.
void island(benchmark::State& state) {
    const auto island =
        farfield::support::make_island(1117, static_cast<double>(state.range(0)), 12.0, 1);
    const bool terrain = state.range(1) != 0;
    const std::span<const Object> objects(island.objects);
    build(
        state,
        terrain ? objects : objects.subspan(1),
        island.objects.size() - 1 + (terrain ? farfield::support::Island::kTriangles : 0U),
        {.directions = static_cast<std::uint32_t>(state.range(2))},
        island.primitive_bounds()
    );
}

/// Random boxes in a tree with eight in a leaf at most, and one after the other of them.
class ChangingWorld {
  public:
    explicit ChangingWorld(const benchmark::State& state)
        : objects_(farfield::support::random_boxes(static_cast<std::size_t>(state.range(0)), 1)),
          tree(farfield::partition::build_bsp(objects_, {.split_vertically = true}).value()) {
        tree.moving.reserve(objects_.size());
    }

    /// Far from the one before: what it needs is in no cache.
    [[nodiscard]] farfield::ItemId next() {
        constexpr std::size_t kStride = 7919;
        at_ = (at_ + kStride) % objects_.size();
        return farfield::make_id<farfield::ItemId>(at_);
    }
    [[nodiscard]] const farfield::Box3d& box(farfield::ItemId item) const {
        return objects_[index_of(item)].bounds;
    }

  private:
    std::vector<Object> objects_;
    std::size_t at_ = 0;

  public:
    farfield::Hierarchy tree;
};

void mark_item(benchmark::State& state) {
    ChangingWorld world(state);
    while (state.KeepRunning()) {
        farfield::partition::mark_changed(world.tree, world.next());
    }
    state.SetItemsProcessed(state.iterations());
}

void mark_box(benchmark::State& state) {
    ChangingWorld world(state);
    while (state.KeepRunning()) {
        farfield::partition::mark_changed(
            world.tree, inflate(world.box(world.next()), glm::dvec3(10.0))
        );
    }
    state.SetItemsProcessed(state.iterations());
}

void leave_and_settle(benchmark::State& state) {
    ChangingWorld world(state);
    while (state.KeepRunning()) {
        const farfield::ItemId item = world.next();
        if (!farfield::partition::update_bounds(world.tree, item, world.box(item)) ||
            !farfield::partition::settle(world.tree, item)) {
            state.SkipWithError("an item did not find its way home");
        }
    }
    state.SetItemsProcessed(state.iterations());
}

/// Once all items are on their way.
void keep_moving(benchmark::State& state) {
    ChangingWorld world(state);
    for (std::int64_t i = 0; i < state.range(0); ++i) {
        const farfield::ItemId item = world.next();
        static_cast<void>(farfield::partition::update_bounds(world.tree, item, world.box(item)));
    }
    while (state.KeepRunning()) {
        const farfield::ItemId item = world.next();
        if (!farfield::partition::update_bounds(world.tree, item, world.box(item))) {
            state.SkipWithError("an item did not move");
        }
    }
    state.SetItemsProcessed(state.iterations());
}

#if FARFIELD_BENCH_EMBREE

/// Node of the tree that the callbacks of `rtcBuildBVH` make.
struct BvhNode {
    std::array<BvhNode*, 2> children{};
    std::array<RTCBounds, 2> child_bounds{};
    std::size_t items = 0; ///< of a leaf

    [[nodiscard]] bool is_leaf() const { return children[0] == nullptr; }
};

template <typename Handle, void (*Release)(Handle)>
struct Released {
    void operator()(Handle handle) const { Release(handle); }
};

template <typename Handle, void (*Release)(Handle)>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, Released<Handle, Release>>;

BvhNode* new_node(RTCThreadLocalAllocator allocator) {
    return new (rtcThreadLocalAlloc(allocator, sizeof(BvhNode), alignof(BvhNode))) BvhNode;
}

/// Boxes as Embree takes them: float, numbered.
void fill(std::vector<RTCBuildPrimitive>& primitives, std::span<const Object> objects) {
    for (std::size_t index = 0; index < objects.size(); ++index) {
        const farfield::Box3d& box = objects[index].bounds;
        RTCBuildPrimitive& primitive = primitives[index];
        primitive = {};
        primitive.lower_x = static_cast<float>(box.lo.x);
        primitive.lower_y = static_cast<float>(box.lo.y);
        primitive.lower_z = static_cast<float>(box.lo.z);
        primitive.upper_x = static_cast<float>(box.hi.x);
        primitive.upper_y = static_cast<float>(box.hi.y);
        primitive.upper_z = static_cast<float>(box.hi.z);
        primitive.primID = static_cast<unsigned>(index);
    }
}

RTCBuildArguments bvh_arguments(RTCBVH bvh, RTCBuildQuality quality) {
    RTCBuildArguments arguments = rtcDefaultBuildArguments();
    arguments.buildQuality = quality;
    arguments.maxBranchingFactor = 2;
    arguments.minLeafSize = 1;
    arguments.maxLeafSize = 1; // as our trees, which split down to single items
    arguments.bvh = bvh;
    arguments.createNode = [](RTCThreadLocalAllocator allocator, unsigned, void*) -> void* {
        return new_node(allocator);
    };
    arguments.setNodeChildren = [](void* node, void** children, unsigned count, void*) {
        for (unsigned child = 0; child < count; ++child) {
            static_cast<BvhNode*>(node)->children.at(child) =
                static_cast<BvhNode*>(children[child]);
        }
    };
    arguments.setNodeBounds = [](void* node, const RTCBounds** bounds, unsigned count, void*) {
        for (unsigned child = 0; child < count; ++child) {
            static_cast<BvhNode*>(node)->child_bounds.at(child) = *bounds[child];
        }
    };
    arguments.createLeaf = [](RTCThreadLocalAllocator allocator,
                              const RTCBuildPrimitive*,
                              std::size_t count,
                              void*) -> void* {
        BvhNode* leaf = new_node(allocator);
        leaf->items = count;
        return leaf;
    };
    arguments.splitPrimitive = [](const RTCBuildPrimitive* primitive,
                                  unsigned axis,
                                  float position,
                                  RTCBounds* low,
                                  RTCBounds* high,
                                  void*) {
        const RTCBounds whole = {
            primitive->lower_x,
            primitive->lower_y,
            primitive->lower_z,
            0.0F,
            primitive->upper_x,
            primitive->upper_y,
            primitive->upper_z,
            0.0F};
        *low = whole;
        *high = whole;
        (axis == 0 ? low->upper_x : axis == 1 ? low->upper_y : low->upper_z) = position;
        (axis == 0 ? high->lower_x : axis == 1 ? high->lower_y : high->lower_z) = position;
    };
    return arguments;
}

/// What `report` tells of our trees.
void report(benchmark::State& state, const BvhNode& root, std::size_t objects) {
    struct Visit {
        const BvhNode* node;
        std::uint32_t depth;
        double area;
    };
    const auto area_of = [](const RTCBounds& box) {
        return SurfaceCost::area(
            {box.upper_x - box.lower_x, box.upper_y - box.lower_y, box.upper_z - box.lower_z}
        );
    };
    RTCBounds around = root.child_bounds[0];
    const RTCBounds& other = root.child_bounds[1];
    around.lower_x = std::min(around.lower_x, other.lower_x);
    around.lower_y = std::min(around.lower_y, other.lower_y);
    around.lower_z = std::min(around.lower_z, other.lower_z);
    around.upper_x = std::max(around.upper_x, other.upper_x);
    around.upper_y = std::max(around.upper_y, other.upper_y);
    around.upper_z = std::max(around.upper_z, other.upper_z);
    SurfaceCost cost{0.0, area_of(around)};
    std::uint32_t depth = 0;
    std::size_t leaves = 0;
    std::size_t nodes = 0;
    std::vector<Visit> open = {{&root, 0, cost.root}};
    while (!open.empty()) {
        const Visit visit = open.back();
        open.pop_back();
        ++nodes;
        depth = std::max(depth, visit.depth);
        cost.sum +=
            visit.area * (visit.node->is_leaf() ? static_cast<double>(visit.node->items) : 1.0);
        if (visit.node->is_leaf()) {
            ++leaves;
            continue;
        }
        for (std::size_t child = 0; child < 2; ++child) {
            open.push_back(
                {visit.node->children.at(child),
                 visit.depth + 1,
                 area_of(visit.node->child_bounds.at(child))}
            );
        }
    }
    using benchmark::Counter;
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(objects));
    state.counters["depth"] = Counter(depth);
    state.counters["leaves"] = Counter(static_cast<double>(leaves));
    state.counters["surface_cost"] = Counter(cost.value());
    state.counters["tree_bytes"] = Counter(static_cast<double>(nodes * sizeof(BvhNode)));
}

/// Low, medium and high quality are Morton codes, binned surface areas, and those with spatial
/// splits, for which there is room to double the number of boxes.
void build_embree(benchmark::State& state, std::span<const Object> objects) {
    constexpr std::array<RTCBuildQuality, 3> kQualities = {
        RTC_BUILD_QUALITY_LOW, RTC_BUILD_QUALITY_MEDIUM, RTC_BUILD_QUALITY_HIGH};
    const RTCBuildQuality quality = kQualities.at(static_cast<std::size_t>(state.range(1)));
    const Owned<RTCDevice, rtcReleaseDevice> device(rtcNewDevice("threads=1"));
    if (!device) {
        state.SkipWithError("Embree cannot open a device");
        return;
    }
    const Owned<RTCBVH, rtcReleaseBVH> bvh(rtcNewBVH(device.get()));
    const bool splits = quality == RTC_BUILD_QUALITY_HIGH;
    std::vector<RTCBuildPrimitive> primitives(objects.size() * (splits ? 2 : 1));
    RTCBuildArguments arguments = bvh_arguments(bvh.get(), quality);
    arguments.primitives = primitives.data();
    arguments.primitiveCount = objects.size();
    arguments.primitiveArrayCapacity = primitives.size();
    const BvhNode* root = nullptr;
    while (state.KeepRunning()) {
        fill(primitives, objects); // the builder sorts them
        root = static_cast<const BvhNode*>(rtcBuildBVH(&arguments));
        if (root == nullptr) {
            state.SkipWithError("Embree built no tree");
            return;
        }
    }
    report(state, *root, objects.size());
}

void embree_random_boxes(benchmark::State& state) {
    build_embree(
        state, farfield::support::random_boxes(static_cast<std::size_t>(state.range(0)), 1)
    );
}

void embree_touching_grid(benchmark::State& state) {
    build_embree(state, farfield::support::grid_boxes(static_cast<std::size_t>(state.range(0))));
}

void embree_clusters(benchmark::State& state) {
    build_embree(
        state, farfield::support::clustered_boxes(static_cast<std::size_t>(state.range(0)), 1)
    );
}

#endif

const std::vector<std::int64_t> kCounts = {1'000, 10'000, 100'000, 1'000'000};

BENCHMARK(random_boxes)
    ->ArgNames({"objects"})
    ->ArgsProduct({kCounts})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(touching_grid)
    ->ArgNames({"objects"})
    ->ArgsProduct({kCounts})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(clusters)->ArgNames({"objects"})->ArgsProduct({kCounts})->Unit(benchmark::kMillisecond);
BENCHMARK(touching_primitives)
    ->ArgNames({"primitives"})
    ->ArgsProduct({kCounts})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(kdtree_random_boxes)
    ->ArgNames({"objects"})
    ->ArgsProduct({kCounts})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(kdtree_touching_grid)
    ->ArgNames({"objects"})
    ->ArgsProduct({kCounts})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(kdtree_clusters)
    ->ArgNames({"objects"})
    ->ArgsProduct({kCounts})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(ground_bsp)
    ->ArgNames({"triangles", "leaf"})
    ->ArgsProduct({{10'000, 100'000, 1'000'000}, {64, 4096}})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(ground_kdtree)
    ->ArgNames({"triangles", "leaf"})
    ->ArgsProduct({{10'000, 100'000, 1'000'000}, {64, 4096}})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(ground_kdtree_boxes)
    ->ArgNames({"triangles", "leaf"})
    ->ArgsProduct({{10'000, 100'000, 1'000'000}, {64, 4096}})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(ground_octree)
    ->ArgNames({"triangles", "leaf"})
    ->ArgsProduct({{10'000, 100'000, 1'000'000}, {64, 4096}})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(island)
    ->ArgNames({"radius", "terrain", "directions"})
    ->ArgsProduct({{400, 2000}, {0, 1}, {2, 4}})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(mark_item)->ArgNames({"objects"})->ArgsProduct({kCounts});
BENCHMARK(mark_box)->ArgNames({"objects"})->ArgsProduct({kCounts});
BENCHMARK(leave_and_settle)->ArgNames({"objects"})->ArgsProduct({kCounts});
BENCHMARK(keep_moving)->ArgNames({"objects"})->ArgsProduct({kCounts});

#if FARFIELD_BENCH_EMBREE
const std::vector<std::int64_t> kQualityLevels = {0, 1, 2};

BENCHMARK(embree_random_boxes)
    ->ArgNames({"objects", "quality"})
    ->ArgsProduct({kCounts, kQualityLevels})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(embree_touching_grid)
    ->ArgNames({"objects", "quality"})
    ->ArgsProduct({kCounts, kQualityLevels})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(embree_clusters)
    ->ArgNames({"objects", "quality"})
    ->ArgsProduct({kCounts, kQualityLevels})
    ->Unit(benchmark::kMillisecond);
#endif

} // namespace
