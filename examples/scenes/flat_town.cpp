#include "flat_town.hpp"

#include "facets.hpp"
#include "random.hpp"
#include <farfield/io/mesh_tools.hpp>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>

namespace farfield::scenes {

namespace {

using glm::dvec2;
using glm::dvec3;

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr int kMaxBlocks = 128;
// A block is built at its natural size and scaled with all that is in it.
constexpr double kNaturalBlock = 40.0;
constexpr double kStreet = 3.0; // half of one, on each side of a block
constexpr double kPavement = 2.0;
constexpr double kStorey = 2.9;
constexpr double kHighest = 13.0;

const dvec3 kAsphalt(92.0, 94.0, 98.0);
const dvec3 kPaving(172.0, 168.0, 158.0);
const dvec3 kLawn(104.0, 136.0, 68.0);
const dvec3 kGlass(66.0, 84.0, 104.0);
const dvec3 kBark(84.0, 70.0, 54.0);
const dvec3 kLeaf(74.0, 112.0, 48.0);

constexpr std::size_t kPalette = 5;
const std::array<dvec3, kPalette> kWalls = {
    {{226.0, 214.0, 190.0},
     {208.0, 178.0, 146.0},
     {214.0, 206.0, 200.0},
     {190.0, 152.0, 128.0},
     {222.0, 200.0, 150.0}}};
const std::array<dvec3, kPalette> kRoofs = {
    {{160.0, 78.0, 58.0},
     {138.0, 66.0, 52.0},
     {110.0, 104.0, 104.0},
     {174.0, 96.0, 66.0},
     {124.0, 88.0, 70.0}}};

/// Where a block lies, and what its parts are added to.
class Block {
  public:
    Block(const dvec2& corner, double scale, Random& random)
        : corner_(corner), scale_(scale), random_(random) {}

    /// Streets, pavements and lawn as a grid of quads whose colours meet at their sides.
    void add_ground(Facets& ground) {
        constexpr std::array<double, 11> kLines = {
            0.0, 3.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 37.0, 40.0};
        for (std::size_t row = 0; row + 1 < kLines.size(); ++row) {
            for (std::size_t column = 0; column + 1 < kLines.size(); ++column) {
                const dvec2 lo(kLines[column], kLines[row]);
                const dvec2 hi(kLines[column + 1], kLines[row + 1]);
                const double inwards =
                    std::min({lo.x, lo.y, kNaturalBlock - hi.x, kNaturalBlock - hi.y});
                const dvec3 color = inwards < kStreet               ? kAsphalt
                                    : inwards < kStreet + kPavement ? kPaving
                                                                    : kLawn;
                ground.add(
                    std::array{
                        place({lo.x, 0.0, lo.y}),
                        place({lo.x, 0.0, hi.y}),
                        place({hi.x, 0.0, hi.y}),
                        place({hi.x, 0.0, lo.y})},
                    color * random_.between(0.94, 1.06)
                );
            }
        }
    }

    /// One house in each quarter of the lot.
    void add_houses(Facets& houses) {
        constexpr double kLot = kStreet + kPavement;
        constexpr double kQuarter = (kNaturalBlock - 2.0 * kLot) / 2.0;
        for (int quarter = 0; quarter < 4; ++quarter) {
            const dvec2 size(random_.between(8.0, 11.0), random_.between(7.0, 10.0));
            const dvec2 low = dvec2(quarter % 2, quarter / 2) * kQuarter + kLot;
            const dvec2 room = dvec2(kQuarter) - size - 2.0; // a metre to the neighbour
            const dvec2 at = low + 1.0 + room * dvec2(random_.unit(), random_.unit());
            add_house(houses, at, size);
        }
    }

    /// Trees in the lanes between the houses and along the pavement.
    void add_trees(Facets& trees) {
        constexpr std::array<dvec2, 5> kPlaces = {
            {{20.0, 20.0}, {6.0, 20.0}, {34.0, 20.0}, {20.0, 6.0}, {20.0, 34.0}}};
        for (const dvec2& place : kPlaces) {
            add_tree(trees, place + dvec2(random_.between(-0.5, 0.5), random_.between(-0.5, 0.5)));
        }
    }

  private:
    [[nodiscard]] dvec3 place(const dvec3& local) const noexcept {
        return dvec3(corner_.x, 0.0, corner_.y) + local * scale_;
    }

    void add_house(Facets& houses, const dvec2& at, const dvec2& size) {
        const int storeys = random_.unit() < 0.6 ? 2 : 3;
        const double eaves = storeys * kStorey;
        const dvec3 wall = kWalls[pick()] * random_.between(0.92, 1.04);
        const std::array<dvec2, 4> corners = {
            at, at + dvec2(0.0, size.y), at + size, at + dvec2(size.x, 0.0)};
        for (std::size_t side = 0; side < 4; ++side) {
            add_wall(houses, corners[side], corners[(side + 1) % 4], storeys, wall);
        }
        add_roof(houses, at, at + size, eaves, kRoofs[pick()] * random_.between(0.9, 1.1), wall);
    }

    /// A wall of bays, each with a window in its frame. Outside is to the right of a to b.
    void add_wall(Facets& houses, const dvec2& a, const dvec2& b, int storeys, const dvec3& color) {
        constexpr double kBay = 2.8;
        const int bays = std::max(static_cast<int>(glm::distance(a, b) / kBay), 1);
        // The lines of a bay, as shares of its width and height.
        constexpr std::array<double, 4> kAcross = {0.0, 0.28, 0.72, 1.0};
        constexpr std::array<double, 4> kUpwards = {0.0, 0.30, 0.82, 1.0};
        for (int storey = 0; storey < storeys; ++storey) {
            for (int bay = 0; bay < bays; ++bay) {
                const auto point = [&](std::size_t across, std::size_t upwards) {
                    const dvec2 flat = glm::mix(a, b, (bay + kAcross[across]) / bays);
                    return place({flat.x, (storey + kUpwards[upwards]) * kStorey, flat.y});
                };
                const auto panel = [&](std::size_t left,
                                       std::size_t low,
                                       std::size_t right,
                                       std::size_t high,
                                       const dvec3& paint) {
                    houses.add(
                        std::array{
                            point(left, low),
                            point(right, low),
                            point(right, high),
                            point(left, high)},
                        paint
                    );
                };
                panel(0, 0, 3, 1, color * 0.97);
                panel(0, 1, 1, 2, color);
                panel(2, 1, 3, 2, color);
                panel(0, 2, 3, 3, color * 1.02);
                panel(1, 1, 2, 2, kGlass * random_.between(0.8, 1.3));
            }
        }
    }

    /// A gable roof along the longer side.
    void add_roof(
        Facets& houses,
        const dvec2& lo,
        const dvec2& hi,
        double eaves,
        const dvec3& color,
        const dvec3& wall
    ) {
        const bool along_x = hi.x - lo.x >= hi.y - lo.y;
        const double ridge = eaves + 0.40 * std::min(hi.x - lo.x, hi.y - lo.y);
        // In a frame whose first axis is the ridge's.
        const auto point = [&](double along, double across, double height) {
            const dvec2 from = along_x ? lo : dvec2(lo.y, lo.x);
            const dvec2 to = along_x ? hi : dvec2(hi.y, hi.x);
            const dvec2 flat(std::lerp(from.x, to.x, along), std::lerp(from.y, to.y, across));
            return along_x ? place({flat.x, height, flat.y}) : place({flat.y, height, flat.x});
        };
        const auto add = [&](std::array<dvec3, 4> corners, const dvec3& paint) {
            if (!along_x) {
                std::reverse(corners.begin(), corners.end()); // the frame is a mirrored one
            }
            houses.add(corners, paint);
        };
        constexpr int kStrips = 3;
        for (int strip = 0; strip < kStrips; ++strip) {
            const double begin = static_cast<double>(strip) / kStrips;
            const double end = (strip + 1.0) / kStrips;
            add({point(begin, 1.0, eaves),
                 point(end, 1.0, eaves),
                 point(end, 0.5, ridge),
                 point(begin, 0.5, ridge)},
                color);
            add({point(end, 0.0, eaves),
                 point(begin, 0.0, eaves),
                 point(begin, 0.5, ridge),
                 point(end, 0.5, ridge)},
                color * 0.96);
        }
        for (const double end : {0.0, 1.0}) {
            std::array<dvec3, 3> gable = {
                point(end, 0.0, eaves), point(end, 1.0, eaves), point(end, 0.5, ridge)};
            if ((end == 1.0) == along_x) {
                std::swap(gable[0], gable[1]);
            }
            houses.add(gable, wall);
        }
    }

    /// A trunk of four sides under a ball of 48 facets.
    void add_tree(Facets& trees, const dvec2& at) {
        const double height = random_.between(4.5, 7.0);
        const double radius = random_.between(1.5, 2.0);
        const dvec3 color = kLeaf * random_.between(0.85, 1.15);
        const dvec3 middle(at.x, height - radius, at.y);
        constexpr int kSides = 4;
        for (int side = 0; side < kSides; ++side) {
            const auto foot = [&](int corner, double y) {
                const double angle = kTwoPi * corner / kSides;
                return place({at.x + 0.2 * std::cos(angle), y, at.y + 0.2 * std::sin(angle)});
            };
            trees.add(
                std::array{
                    foot(side + 1, 0.0),
                    foot(side, 0.0),
                    foot(side, middle.y),
                    foot(side + 1, middle.y)},
                kBark
            );
        }
        constexpr int kAround = 8;
        constexpr int kRings = 4;
        const double turn = random_.between(0.0, kTwoPi);
        const auto on_ball = [&](int ring, int around) {
            const double polar = std::numbers::pi * ring / kRings;
            const double azimuth = turn + kTwoPi * around / kAround;
            return middle + radius * dvec3(
                                         std::sin(polar) * std::cos(azimuth),
                                         1.15 * std::cos(polar),
                                         std::sin(polar) * std::sin(azimuth)
                                     );
        };
        for (int around = 0; around < kAround; ++around) {
            for (int ring = 0; ring < kRings; ++ring) {
                const double shade = 1.12 - 0.16 * ring + random_.between(-0.08, 0.08);
                const std::array<dvec3, 4> quad = {
                    place(on_ball(ring, around)),
                    place(on_ball(ring, around + 1)),
                    place(on_ball(ring + 1, around + 1)),
                    place(on_ball(ring + 1, around))};
                if (ring == 0) {
                    trees.add(std::array{quad[0], quad[2], quad[3]}, color * shade);
                } else if (ring + 1 == kRings) {
                    trees.add(std::array{quad[0], quad[1], quad[2]}, color * shade);
                } else {
                    trees.add(quad, color * shade);
                }
            }
        }
    }

    [[nodiscard]] std::size_t pick() noexcept { return random_.bits() % kPalette; }

    dvec2 corner_;
    double scale_;
    Random& random_;
};

} // namespace

double flat_town_height(const FlatTownOptions& options) noexcept {
    return kHighest * options.block_m / kNaturalBlock;
}

Result<void> validate(const FlatTownOptions& options) {
    if (options.blocks < 1 || options.blocks > kMaxBlocks) {
        return fail(
            ErrorCode::invalid_argument,
            "flat: blocks is " + std::to_string(options.blocks) + ", expected 1 to " +
                std::to_string(kMaxBlocks)
        );
    }
    if (!(options.block_m > 0.0) || !std::isfinite(options.block_m)) {
        return fail(
            ErrorCode::invalid_argument,
            "flat: block_m is " + std::to_string(options.block_m) +
                ", expected a finite value above 0"
        );
    }
    return {};
}

Result<Scene> make_flat_town(const FlatTownOptions& options) {
    if (Result<void> valid = validate(options); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    Random random(options.seed);
    Facets ground;
    Facets houses;
    Facets trees;
    const double half = options.blocks * options.block_m / 2.0;
    for (int row = 0; row < options.blocks; ++row) {
        for (int column = 0; column < options.blocks; ++column) {
            const dvec2 corner = dvec2(column, row) * options.block_m - half;
            Block block(corner, options.block_m / kNaturalBlock, random);
            block.add_ground(ground);
            block.add_houses(houses);
            block.add_trees(trees);
        }
    }
    Scene scene;
    scene.name = "flat";
    scene.sky = glm::vec3(0.70F, 0.80F, 0.90F);
    scene.meshes.push_back(ground.finish("ground"));
    scene.meshes.push_back(houses.finish("houses"));
    scene.meshes.push_back(trees.finish("trees"));
    for (std::size_t mesh = 0; mesh < scene.meshes.size(); ++mesh) {
        io::optimize_for_drawing(scene.meshes[mesh]);
        scene.instances.push_back({make_id<MeshId>(mesh)});
    }
    return scene;
}

} // namespace farfield::scenes
