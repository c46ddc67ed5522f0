#include "pipe_network.hpp"

#include <farfield/io/mesh_tools.hpp>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

namespace farfield::scenes {

namespace {

using glm::dvec2;
using glm::dvec3;
using glm::ivec3;

constexpr double kHalf = kPipeSpacing / 2.0;
// Shares of nodes where a pipe that could go on does so, and of straight pieces of each kind.
constexpr double kGoesOn = 0.84;
constexpr double kFlanged = 0.30;
constexpr double kValve = 0.035;
// A turn upwards or down is half as likely as a level one.
constexpr double kSteep = 0.5;

const dvec3 kAhead(0.0, 0.0, 1.0); // of a piece in its own frame
const dvec3 kSide(1.0, 0.0, 0.0);
const dvec3 kSteel(148.0, 150.0, 154.0);
const dvec3 kWheel(196.0, 48.0, 40.0);

constexpr std::array<PipeService, kPipeServices> kServices = {
    {{{202.0, 204.0, 208.0}, 0.42, 32, true},
     {{62.0, 126.0, 88.0}, 0.34, 28},
     {{56.0, 104.0, 170.0}, 0.26, 24},
     {{182.0, 50.0, 44.0}, 0.20, 24},
     {{148.0, 188.0, 214.0}, 0.16, 20},
     {{218.0, 172.0, 48.0}, 0.22, 24},
     {{124.0, 82.0, 52.0}, 0.18, 20},
     {{130.0, 92.0, 152.0}, 0.14, 20},
     {{214.0, 206.0, 186.0}, 0.30, 28, true}}};

/// All directions along the lattice.
constexpr std::array<ivec3, 6> kDirections = {
    {{1, 0, 0}, {-1, 0, 0}, {0, 0, 1}, {0, 0, -1}, {0, 1, 0}, {0, -1, 0}}};

/// A shallow ring around a pipe, as a weld or a band of sheet metal, across the way at a place.
void add_band(
    Solids& solids, double at, double radius, double width, int sides, const dvec3& color
) {
    const double raised = radius + 0.012;
    const std::array<dvec2, 4> profile = {
        {{radius, -width / 2.0},
         {raised, -width / 2.0},
         {raised, width / 2.0},
         {radius, width / 2.0}}};
    solids.add_lathe(kAhead * at, kAhead, profile, sides, color);
}

void add_straight(Solids& solids, const PipeService& service, const dvec3& color) {
    const std::array<dvec3, 2> points = {-kAhead * kHalf, kAhead * kHalf};
    solids.add_tube(
        points,
        {.radius = service.radius, .sides = service.sides, .longest = kHalf, .capped = false},
        color
    );
    if (service.insulated) {
        for (const double at : {-0.5 * kHalf, 0.5 * kHalf}) {
            add_band(solids, at, service.radius, 0.05, service.sides, color * 0.82);
        }
    }
}

void add_valve(Solids& solids, const PipeService& service, const dvec3& color) {
    const double r = service.radius;
    const dvec3 body = color * 0.72;
    const std::array<dvec2, 12> profile = {
        {{r, -0.34},
         {1.32 * r, -0.34},
         {1.32 * r, -0.29},
         {1.08 * r, -0.29},
         {1.12 * r, -0.20},
         {1.34 * r, -0.09},
         {1.34 * r, 0.09},
         {1.12 * r, 0.20},
         {1.08 * r, 0.29},
         {1.32 * r, 0.29},
         {1.32 * r, 0.34},
         {r, 0.34}}};
    solids.add_lathe(dvec3(0.0), kAhead, profile, service.sides, body);
    const double top = 1.34 * r;
    const std::array<dvec2, 8> bonnet = {
        {{0.0, 0.5 * r},
         {0.62 * r, 0.5 * r},
         {0.62 * r, top},
         {0.86 * r, top},
         {0.86 * r, top + 0.03},
         {0.024, top + 0.05},
         {0.024, 0.69},
         {0.0, 0.69}}};
    solids.add_lathe(dvec3(0.0), kSide, bonnet, 16, body);
    const dvec3 hub = kSide * 0.66;
    constexpr double kWheelRadius = 0.2;
    solids.add_ring(hub, kSide, kWheelRadius, 0.016, 24, 8, kWheel);
    for (int spoke = 0; spoke < 4; ++spoke) {
        const double angle = std::numbers::pi / 2.0 * spoke;
        const dvec3 outwards(0.0, std::cos(angle), std::sin(angle));
        solids.add_bar(hub + outwards * 0.018, hub + outwards * kWheelRadius, 0.016, 0.016, kWheel);
    }
}

/// In along +z at the face of the cell, out along +x.
void add_elbow(Solids& solids, const PipeService& service, const dvec3& color) {
    const std::array<dvec3, 3> points = {-kAhead * kHalf, dvec3(0.0), kSide * kHalf};
    solids.add_tube(
        points,
        {.radius = service.radius,
         .bend = kHalf,
         .sides = service.sides,
         .arc_segments = 9,
         .capped = false},
        color
    );
    const std::array<dvec2, 4> weld = {
        {{service.radius, 0.0},
         {service.radius + 0.016, 0.0},
         {service.radius + 0.016, 0.05},
         {service.radius, 0.05}}};
    solids.add_lathe(-kAhead * kHalf, kAhead, weld, service.sides, color * 0.8);
    solids.add_lathe(kSide * kHalf, -kSide, weld, service.sides, color * 0.8);
}

/// In along +z and closed by a dished head a little after the middle of the cell.
void add_end(Solids& solids, const PipeService& service, const dvec3& color) {
    const double r = service.radius;
    const std::array<dvec3, 2> points = {-kAhead * kHalf, kAhead * 0.06};
    solids.add_tube(
        points, {.radius = r, .sides = service.sides, .longest = kHalf, .capped = false}, color
    );
    const std::array<dvec2, 6> head = {
        {{r, 0.06},
         {0.92 * r, 0.06 + 0.22 * r},
         {0.72 * r, 0.06 + 0.38 * r},
         {0.42 * r, 0.06 + 0.48 * r},
         {0.2 * r, 0.06 + 0.51 * r},
         {0.0, 0.06 + 0.52 * r}}};
    solids.add_lathe(dvec3(0.0), kAhead, head, service.sides, color);
    add_flanges(solids, -kAhead * (0.4 * kHalf), kAhead, r, service.sides, color * 0.85);
}

/// Closes a pipe that comes out along +z, at the face of the cell.
void add_lid(Solids& solids, const PipeService& service, const dvec3& color) {
    const double rim = 1.22 * service.radius + 0.06;
    const std::array<dvec2, 4> lid = {
        {{service.radius, kHalf - 0.1}, {rim, kHalf - 0.1}, {rim, kHalf}, {0.0, kHalf}}};
    solids.add_lathe(dvec3(0.0), kAhead, lid, service.sides, color * 0.85);
}

} // namespace

const std::array<PipeService, kPipeServices>& pipe_services() noexcept {
    return kServices;
}

void add_flanges(
    Solids& solids, const dvec3& at, const dvec3& axis, double radius, int sides, const dvec3& color
) {
    const double rim = 1.22 * radius + 0.06;
    const double gasket = 0.5 * (radius + rim);
    const std::array<dvec2, 8> profile = {
        {{radius, -0.06},
         {rim, -0.06},
         {rim, -0.012},
         {gasket, -0.012},
         {gasket, 0.012},
         {rim, 0.012},
         {rim, 0.06},
         {radius, 0.06}}};
    solids.add_lathe(at, axis, profile, sides, color);
    const dvec3 u = std::abs(axis.y) < 0.9 ? glm::normalize(glm::cross(dvec3(0.0, 1.0, 0.0), axis))
                                           : dvec3(1.0, 0.0, 0.0);
    const dvec3 v = glm::cross(axis, u);
    const double circle = rim - 0.035;
    constexpr int kBolts = 8;
    for (int bolt = 0; bolt < kBolts; ++bolt) {
        const double angle = 2.0 * std::numbers::pi * (bolt + 0.5) / kBolts;
        const dvec3 foot = at + (u * std::cos(angle) + v * std::sin(angle)) * circle - axis * 0.085;
        solids.add_cylinder(foot, axis, 0.02, 0.17, 6, kSteel);
    }
}

std::size_t PipeLattice::index_of(const ivec3& node) const noexcept {
    const int row = node.z * nodes.y + node.y;
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(nodes.x) +
           static_cast<std::size_t>(node.x);
}

bool PipeLattice::contains(const ivec3& node) const noexcept {
    return node.x >= 0 && node.y >= 0 && node.z >= 0 && node.x < nodes.x && node.y < nodes.y &&
           node.z < nodes.z;
}

bool PipeLattice::is_free(const ivec3& node) const noexcept {
    return contains(node) && !taken[index_of(node)];
}

/// Where a pipe begins and how it goes on.
struct PipeLayer::Run {
    ivec3 node{0};
    ivec3 ahead{0};
    std::size_t service = 0;
    bool from_outside = true; ///< or else it begins with an end of its own
};

PipeLayer::PipeLayer(Scene& scene, Random& random) {
    constexpr std::array<const char*, kPieces> kNames = {
        "straight pipe", "flanged pipe", "valve", "elbow", "end of a pipe", "lid of a pipe"};
    for (std::size_t service = 0; service < kPipeServices; ++service) {
        const PipeService& made = kServices[service];
        const dvec3 color = made.color * random.between(0.94, 1.06);
        for (std::size_t piece = 0; piece < kPieces; ++piece) {
            Solids solids;
            switch (static_cast<Piece>(piece)) {
            case plain:
                add_straight(solids, made, color);
                break;
            case flanged:
                add_straight(solids, made, color);
                add_flanges(solids, dvec3(0.0), kAhead, made.radius, made.sides, color * 0.85);
                break;
            case valve:
                add_straight(solids, made, color);
                add_valve(solids, made, color);
                break;
            case elbow:
                add_elbow(solids, made, color);
                break;
            case end:
                add_end(solids, made, color);
                break;
            case lid:
                add_lid(solids, made, color);
                break;
            }
            triangles_[service][piece] = solids.count();
            meshes_[service][piece] = make_id<MeshId>(scene.meshes.size());
            Mesh mesh = solids.finish(kNames[piece], false);
            io::optimize_for_drawing(mesh);
            scene.meshes.push_back(std::move(mesh));
        }
    }
}

int PipeLayer::place(
    Scene& scene,
    const PipeLattice& lattice,
    const ivec3& node,
    std::size_t service,
    Piece piece,
    const ivec3& ahead,
    const ivec3& side
) const {
    const double scale = lattice.spacing / kPipeSpacing;
    // Whole numbers, so that no entry is -0 and quarter turns are exact.
    const ivec3 up(
        ahead.y * side.z - ahead.z * side.y,
        ahead.z * side.x - ahead.x * side.z,
        ahead.x * side.y - ahead.y * side.x
    );
    const dvec3 middle = lattice.corner + (dvec3(node) + 0.5) * lattice.spacing;
    scene.instances.push_back(
        {meshes_[service][piece],
         glm::dmat4x3(dvec3(side) * scale, dvec3(up) * scale, dvec3(ahead) * scale, middle)}
    );
    return triangles_[service][piece];
}

bool PipeLayer::begin(const PipeLattice& lattice, Random& random, Run& run) const {
    run.service = random.bits() % kPipeServices;
    // From outside, at a node of a side or of the ground, in a few tries.
    constexpr int kTries = 24;
    const auto any = [&](int count) {
        return static_cast<int>(random.bits() % static_cast<std::uint64_t>(count));
    };
    for (int attempt = 0; attempt < kTries; ++attempt) {
        const ivec3 last = lattice.nodes - 1;
        run.node = {any(lattice.nodes.x), any(lattice.nodes.y), any(lattice.nodes.z)};
        run.ahead = kDirections[random.bits() % 5]; // no pipe comes from above
        for (int axis = 0; axis < 3; ++axis) {
            if (run.ahead[axis] != 0) {
                run.node[axis] = run.ahead[axis] > 0 ? 0 : last[axis];
            }
        }
        if (lattice.is_free(run.node)) {
            run.from_outside = true;
            return true;
        }
    }
    // Anywhere: the next free node with a free one beside it.
    const auto nodes = static_cast<int>(lattice.taken.size());
    const int first = any(nodes);
    for (int i = 0; i < nodes; ++i) {
        const int index = (first + i) % nodes;
        run.node = {
            index % lattice.nodes.x,
            index / lattice.nodes.x % lattice.nodes.y,
            index / lattice.nodes.x / lattice.nodes.y};
        if (!lattice.is_free(run.node)) {
            continue;
        }
        for (const ivec3& direction : kDirections) {
            if (lattice.is_free(run.node + direction)) {
                run.ahead = direction;
                run.from_outside = false;
                return true;
            }
        }
    }
    return false;
}

int PipeLayer::lay_one(
    Scene& scene, PipeLattice& lattice, const Run& run, int triangles, Random& random
) const {
    int laid = 0;
    ivec3 node = run.node;
    ivec3 ahead = run.ahead;
    const auto any_side = [&] {
        ivec3 side = ahead;
        while (side == ahead || side == -ahead) {
            side = kDirections[random.bits() % kDirections.size()];
        }
        return side;
    };
    const auto put = [&](Piece piece, const ivec3& forward, const ivec3& side) {
        lattice.taken[lattice.index_of(node)] = true;
        laid += place(scene, lattice, node, run.service, piece, forward, side);
    };
    const auto close = [&](const ivec3& outwards) {
        if (outwards.y == 0) { // none in the ground
            laid += place(scene, lattice, node, run.service, lid, outwards, any_side());
        }
    };
    if (run.from_outside) {
        close(-ahead);
    } else {
        put(end, -ahead, any_side());
        node += ahead;
    }
    while (true) {
        // Pipes may come out at the sides and into the ground, not at the top.
        const ivec3 next = node + ahead;
        const bool comes_out = !lattice.contains(next) && ahead.y <= 0;
        const bool goes_on = comes_out || lattice.is_free(next);
        if (laid >= triangles) {
            put(end, ahead, any_side());
            return laid;
        }
        if (goes_on && random.unit() < kGoesOn) {
            const double kind = random.unit();
            put(kind < kValve              ? valve
                : kind < kValve + kFlanged ? flanged
                                           : plain,
                ahead,
                any_side());
            if (comes_out) {
                close(ahead);
                return laid;
            }
            node = next;
            continue;
        }
        ivec3 side(0);
        double best = 0.0;
        for (const ivec3& direction : kDirections) {
            if (direction != ahead && direction != -ahead && lattice.is_free(node + direction)) {
                const double weight = random.unit() * (direction.y == 0 ? 1.0 : kSteep);
                if (weight > best) {
                    best = weight;
                    side = direction;
                }
            }
        }
        if (best > 0.0) {
            put(elbow, ahead, side);
            ahead = side;
            node += side;
        } else if (goes_on) {
            put(plain, ahead, any_side());
            if (comes_out) {
                close(ahead);
                return laid;
            }
            node = next;
        } else {
            put(end, ahead, any_side());
            return laid;
        }
    }
}

int PipeLayer::lay(Scene& scene, PipeLattice& lattice, int triangles, Random& random) const {
    int laid = 0;
    Run run;
    while (laid < triangles && begin(lattice, random, run)) {
        laid += lay_one(scene, lattice, run, triangles - laid, random);
    }
    return laid;
}

} // namespace farfield::scenes
