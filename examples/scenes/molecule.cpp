#include "molecule.hpp"

#include "random.hpp"

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

namespace farfield::scenes {

namespace {

using glm::dvec2;
using glm::dvec3;

// [angstrom] and [rad] throughout.
constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kDegree = std::numbers::pi / 180.0;
constexpr int kMaxAtoms = 1'000'000;

constexpr double kAlphaGap = 3.80; // between alpha carbons of neighbours, across a flat peptide
constexpr double kHelixRadius = 2.29;
constexpr double kHelixRise = 1.50 / (100.0 * kDegree); // along the axis, for a radian
constexpr double kHelixGap = 9.4;                       // between axes of neighbours
constexpr double kLeastGap = 3.0;      // between an atom of a side chain and other residues
constexpr double kOwnGap = 2.3;        // and its own, less than across two bonds
constexpr double kVolumeOfAtom = 15.5; // of a protein, side chains and all

constexpr std::uint8_t kHydrogen = 1;
constexpr std::uint8_t kCarbon = 6;
constexpr std::uint8_t kNitrogen = 7;
constexpr std::uint8_t kOxygen = 8;
constexpr std::uint8_t kSulphur = 16;

/// Any unit vector at a right angle to a unit vector.
dvec3 perpendicular(const dvec3& axis) {
    const dvec3 other = std::abs(axis.y) < 0.9 ? dvec3(0.0, 1.0, 0.0) : dvec3(1.0, 0.0, 0.0);
    return glm::normalize(glm::cross(axis, other));
}

/// Uniform on the unit sphere.
dvec3 random_direction(Random& random) {
    const double y = random.between(-1.0, 1.0);
    const double azimuth = random.between(0.0, kTwoPi);
    const double across = std::sqrt(1.0 - y * y);
    return {across * std::cos(azimuth), y, across * std::sin(azimuth)};
}

/// A point of the curve that the chain follows, and where oxygens point there.
struct CurvePoint {
    dvec3 place{0.0};
    dvec3 oxygen{0.0, 1.0, 0.0};
    bool loop = false; ///< oxygens point there and back in turns
};

/// Things by place, to find those that are near.
class Grid {
  public:
    /// @param radius of a ball around 0 that holds nearly all of them
    /// @param reach how near is near
    Grid(double radius, double reach)
        : reach_(reach), half_(static_cast<int>(std::ceil(radius / reach)) + 1),
          side_(2 * half_ + 1), cells_(index(0, 0, side_)) {}

    void add(const dvec3& place, std::size_t owner) {
        const std::array<int, 3> cell = cell_of(place);
        cells_[index(cell[0], cell[1], cell[2])].push_back({place, owner});
    }

    /// Whether one of those within reach is in the way: `in_way(place, owner, gap)`.
    template <typename InWay>
    [[nodiscard]] bool any_near(const dvec3& place, InWay in_way) const {
        const std::array<int, 3> cell = cell_of(place);
        for (int z = std::max(cell[2] - 1, 0); z <= std::min(cell[2] + 1, side_ - 1); ++z) {
            for (int y = std::max(cell[1] - 1, 0); y <= std::min(cell[1] + 1, side_ - 1); ++y) {
                for (int x = std::max(cell[0] - 1, 0); x <= std::min(cell[0] + 1, side_ - 1); ++x) {
                    for (const Entry& other : cells_[index(x, y, z)]) {
                        const double gap = glm::distance(other.place, place);
                        if (gap < reach_ && in_way(other.place, other.owner, gap)) {
                            return true;
                        }
                    }
                }
            }
        }
        return false;
    }

  private:
    struct Entry {
        dvec3 place{0.0};
        std::size_t owner = 0;
    };

    [[nodiscard]] std::array<int, 3> cell_of(const dvec3& place) const {
        const auto along = [this](double coordinate) {
            const int cell = static_cast<int>(std::floor(coordinate / reach_)) + half_;
            return std::clamp(cell, 0, side_ - 1);
        };
        return {along(place.x), along(place.y), along(place.z)};
    }

    [[nodiscard]] std::size_t index(int x, int y, int z) const {
        const auto side = static_cast<std::size_t>(side_);
        return (static_cast<std::size_t>(z) * side + static_cast<std::size_t>(y)) * side +
               static_cast<std::size_t>(x);
    }

    double reach_;
    int half_;
    int side_;
    std::vector<std::vector<Entry>> cells_;
};

/// Rods of helices that fill a ball, in the order in which the chain runs through them.
class Fold {
  public:
    Fold(double radius, Random& random)
        : radius_(radius), random_(random), grid_(radius, kCurveGap) {
        bool up = true;
        for (const dvec2& axis : order_axes()) {
            add_helix(axis, up);
            up = !up;
        }
        for (std::size_t i = 0; i < helices_.size(); ++i) {
            if (i > 0) {
                add_loop(i - 1);
            }
            curve_.insert(curve_.end(), helices_[i].curve.begin(), helices_[i].curve.end());
        }
    }

    /// Points of the curve at chords of `kAlphaGap` from one to the next.
    [[nodiscard]] std::vector<CurvePoint> alpha_carbons() const {
        std::vector<CurvePoint> chain = {curve_.front()};
        for (std::size_t i = 1; i < curve_.size(); ++i) {
            const dvec3 last = chain.back().place;
            const double after = glm::distance(curve_[i].place, last);
            if (after < kAlphaGap) {
                continue;
            }
            // Somewhere on this piece the chord has its length; over so short a piece it grows so
            // evenly that three steps along its mean slope are exact to a millionth.
            const double before = glm::distance(curve_[i - 1].place, last);
            double share = (kAlphaGap - before) / (after - before);
            const dvec3 piece = curve_[i].place - curve_[i - 1].place;
            for (int step = 0; step < 3; ++step) {
                const double reached = glm::distance(curve_[i - 1].place + piece * share, last);
                share += (kAlphaGap - reached) / (after - before);
            }
            const bool back = curve_[i].loop && chain.size() % 2 == 0;
            const dvec3 oxygen = back ? -curve_[i].oxygen : curve_[i].oxygen;
            chain.push_back({curve_[i - 1].place + piece * share, oxygen});
        }
        return chain;
    }

  private:
    struct Helix {
        std::vector<CurvePoint> curve;
        dvec3 arriving{0.0}; ///< unit, of the curve at its first point
        dvec3 leaving{0.0};  ///< and at its last
        dvec3 along{0.0};    ///< unit, of its axis
    };

    /// Axes of a hexagonal lattice that meet the ball, each beside the one before: row by row, to
    /// and fro.
    [[nodiscard]] std::vector<dvec2> order_axes() {
        const double row_gap = kHelixGap * std::sqrt(0.75);
        const double reach = std::max(radius_ - 4.0, 0.1); // side chains reach further out
        const int rows = static_cast<int>(reach / row_gap);
        std::vector<dvec2> axes;
        bool forth = true;
        for (int row = -rows; row <= rows; ++row) {
            const double z = row * row_gap;
            const double shift = row % 2 == 0 ? 0.0 : 0.5;
            const double half = std::sqrt(std::max(reach * reach - z * z, 0.0)) / kHelixGap;
            std::vector<dvec2> of_row;
            const int columns = static_cast<int>(half) + 1;
            for (int column = -columns; column <= columns; ++column) {
                if (std::abs(column + shift) <= half) {
                    const dvec2 moved(random_.between(-0.4, 0.4), random_.between(-0.4, 0.4));
                    of_row.push_back(dvec2((column + shift) * kHelixGap, z) + moved);
                }
            }
            if (!forth) {
                std::reverse(of_row.begin(), of_row.end());
            }
            forth = !forth;
            axes.insert(axes.end(), of_row.begin(), of_row.end());
        }
        return axes;
    }

    /// Half the length of a helix around an axis.
    [[nodiscard]] double half_length(const dvec2& axis) const {
        const double square = radius_ * radius_ - glm::dot(axis, axis);
        return std::max(std::sqrt(std::max(square, 0.0)) - 3.0, 3.0);
    }

    void add_helix(const dvec2& axis, bool up) {
        const double sign = up ? 1.0 : -1.0;
        const double begin = -half_length(axis) + random_.between(-1.5, 1.5);
        const double end = half_length(axis) + random_.between(-1.5, 1.5);
        const double phase = random_.between(0.0, kTwoPi);
        const dvec3 along(0.0, sign, 0.0);
        const auto at = [&](double angle) {
            // Right-handed around the way it goes.
            const double turn = phase + angle;
            return dvec3(axis.x, sign * (begin + kHelixRise * angle), axis.y) +
                   kHelixRadius * dvec3(std::cos(turn), 0.0, -sign * std::sin(turn));
        };
        const auto tangent = [&](double angle) {
            const double turn = phase + angle;
            return kHelixRise * along +
                   kHelixRadius * dvec3(-std::sin(turn), 0.0, -sign * std::cos(turn));
        };
        const double last = (end - begin) / kHelixRise;
        const int steps = static_cast<int>(std::ceil(last / kAngleStep));
        Helix helix;
        helix.arriving = glm::normalize(tangent(0.0));
        helix.leaving = glm::normalize(tangent(last));
        helix.along = along;
        for (int step = 0; step <= steps; ++step) {
            helix.curve.push_back({at(last * step / steps), along});
            if (step % kGridSteps == 0) {
                grid_.add(helix.curve.back().place, helices_.size());
            }
        }
        helices_.push_back(std::move(helix));
    }

    /// A cubic Bezier curve from the end of a helix to the beginning of the next one: of several,
    /// the one that keeps off other helices and loops most.
    void add_loop(std::size_t before) {
        const Helix& from = helices_[before];
        const Helix& to = helices_[before + 1];
        const dvec3 begin = from.curve.back().place;
        const dvec3 end = to.curve.front().place;
        const double gap = glm::distance(begin, end);
        const dvec3 across = glm::cross(glm::normalize(end - begin), from.along);
        std::vector<CurvePoint> best;
        int fewest = std::numeric_limits<int>::max();
        for (const double sway : {0.0, 0.3, -0.3, 0.6, -0.6, 0.9, -0.9}) {
            for (const double height : {0.3, 0.15, 0.45, 0.6}) {
                const dvec3 aside = across * (sway * gap);
                const dvec3 first =
                    begin + from.leaving * (0.25 * gap) + from.along * (height * gap) + aside;
                const dvec3 second =
                    end - to.arriving * (0.25 * gap) - to.along * (height * gap) + aside;
                std::vector<CurvePoint> loop;
                int in_way = 0;
                for (int step = 1; step < kLoopSteps; ++step) {
                    const double t = static_cast<double>(step) / kLoopSteps;
                    const double s = 1.0 - t;
                    const dvec3 place = begin * (s * s * s) + first * (3.0 * s * s * t) +
                                        second * (3.0 * s * t * t) + end * (t * t * t);
                    loop.push_back({place, across, true});
                    in_way += step % kGridSteps == 0 && is_crowded(place, before) ? 1 : 0;
                }
                if (in_way < fewest) {
                    fewest = in_way;
                    best = std::move(loop);
                }
            }
        }
        for (std::size_t i = 0; i < best.size(); i += kGridSteps) {
            grid_.add(best[i].place, kLoop);
        }
        curve_.insert(curve_.end(), best.begin(), best.end());
    }

    /// Whether more of the chain than a helix and the next one are near a place.
    [[nodiscard]] bool is_crowded(const dvec3& place, std::size_t helix) const {
        return grid_.any_near(place, [helix](const dvec3&, std::size_t owner, double) {
            return owner != helix && owner != helix + 1;
        });
    }

    static constexpr double kAngleStep = 0.02;
    static constexpr int kLoopSteps = 400;
    static constexpr int kGridSteps = 20;    // of points that are looked for by place
    static constexpr double kCurveGap = 5.0; // between parts of the chain
    static constexpr std::size_t kLoop = std::numeric_limits<std::size_t>::max();

    double radius_;
    Random& random_;
    Grid grid_;
    std::vector<Helix> helices_;
    std::vector<CurvePoint> curve_;
};

/// A flat peptide group between two alpha carbons: x along them, y towards the oxygen.
struct Peptide {
    dvec2 carbon{0.0};
    dvec2 oxygen{0.0};
    dvec2 nitrogen{0.0};
    dvec2 hydrogen{0.0};
};

/// Bonds and angles: Engh and Huber, 1991.
Peptide make_peptide() {
    constexpr double kAlphaToCarbon = 1.525;
    constexpr double kCarbonToNitrogen = 1.329;
    constexpr double kNitrogenToAlpha = 1.458;
    constexpr double kCarbonToOxygen = 1.231;
    constexpr double kNitrogenToHydrogen = 1.01;
    constexpr double kAtCarbon = 116.2 * kDegree;     // from alpha carbon to nitrogen
    constexpr double kAtNitrogen = 121.7 * kDegree;   // from carbon to alpha carbon
    constexpr double kOxygenBend = 123.0 * kDegree;   // from nitrogen to oxygen
    constexpr double kHydrogenBend = 119.2 * kDegree; // from carbon to hydrogen
    const auto direction = [](double angle) { return dvec2(std::cos(angle), std::sin(angle)); };
    // Laid out along x and turned so that the second alpha carbon is on the axis: the chain bends
    // one way at the carbon and back at the nitrogen.
    const double to_nitrogen = -(180.0 * kDegree - kAtCarbon);
    const double to_alpha = to_nitrogen + (180.0 * kDegree - kAtNitrogen);
    const dvec2 carbon(kAlphaToCarbon, 0.0);
    const dvec2 nitrogen = carbon + kCarbonToNitrogen * direction(to_nitrogen);
    const dvec2 alpha = nitrogen + kNitrogenToAlpha * direction(to_alpha);
    const dvec2 oxygen = carbon + kCarbonToOxygen * direction(to_nitrogen + kOxygenBend);
    const dvec2 hydrogen =
        nitrogen + kNitrogenToHydrogen * direction(to_nitrogen + 180.0 * kDegree + kHydrogenBend);
    const dvec2 axis = glm::normalize(alpha);
    const auto turned = [&](const dvec2& at) {
        return dvec2(glm::dot(at, axis), at.y * axis.x - at.x * axis.y);
    };
    return {turned(carbon), turned(oxygen), turned(nitrogen), turned(hydrogen)};
}

/// Atoms of a side chain beyond the beta carbon, in the order in which they grow: an element and
/// the atom that bears it, 0 being the beta carbon.
struct SideAtom {
    std::uint8_t element = kCarbon;
    std::size_t bearer = 0;
};

/// Chains like those of glycine (none), alanine, valine, leucine, serine, threonine, aspartate,
/// glutamine, lysine, arginine, methionine, cysteine and one of a ring's length.
const std::vector<std::optional<std::vector<SideAtom>>>& side_chains() {
    static const std::vector<std::optional<std::vector<SideAtom>>> chains = {
        std::nullopt,
        std::vector<SideAtom>{},
        {{{kCarbon, 0}, {kCarbon, 0}}},
        {{{kCarbon, 0}, {kCarbon, 1}, {kCarbon, 1}}},
        {{{kOxygen, 0}}},
        {{{kOxygen, 0}, {kCarbon, 0}}},
        {{{kCarbon, 0}, {kOxygen, 1}, {kOxygen, 1}}},
        {{{kCarbon, 0}, {kCarbon, 1}, {kOxygen, 2}, {kNitrogen, 2}}},
        {{{kCarbon, 0}, {kCarbon, 1}, {kCarbon, 2}, {kNitrogen, 3}}},
        {{{kCarbon, 0},
          {kCarbon, 1},
          {kNitrogen, 2},
          {kCarbon, 3},
          {kNitrogen, 4},
          {kNitrogen, 4}}},
        {{{kCarbon, 0}, {kSulphur, 1}, {kCarbon, 2}}},
        {{{kSulphur, 0}}},
        {{{kCarbon, 0}, {kCarbon, 1}, {kCarbon, 1}, {kCarbon, 2}, {kCarbon, 3}}},
    };
    return chains;
}

/// Hangs peptides and side chains on a trace of alpha carbons.
class Builder {
  public:
    Builder(const std::vector<CurvePoint>& trace, double radius, Random& random)
        : trace_(trace), random_(random), grid_(radius, kLeastGap), residues_(trace.size()) {
        build_backbone();
        for (std::size_t residue = 0; residue < trace_.size(); ++residue) {
            grow_side_chain(residue);
        }
    }

    /// Residue after residue.
    [[nodiscard]] std::vector<io::Atom> atoms() const {
        std::vector<io::Atom> chain;
        for (const Residue& residue : residues_) {
            chain.insert(chain.end(), residue.atoms.begin(), residue.atoms.end());
        }
        return chain;
    }

  private:
    struct Residue {
        std::vector<io::Atom> atoms;
        std::optional<dvec3> nitrogen;
        std::optional<dvec3> carbon;
    };

    /// An atom of a side chain.
    struct Grown {
        dvec3 place{0.0};
        dvec3 along{0.0};  ///< unit, of the bond from its bearer
        dvec3 before{0.0}; ///< of a bond of its bearer, from which turns are counted
    };

    void add(std::size_t residue, std::uint8_t element, const dvec3& place) {
        residues_[residue].atoms.push_back({place, element});
        grid_.add(place, residue);
    }

    void build_backbone() {
        const Peptide peptide = make_peptide();
        for (std::size_t i = 0; i < trace_.size(); ++i) {
            add(i, kCarbon, trace_[i].place);
            if (i + 1 == trace_.size()) {
                break;
            }
            const dvec3 along = glm::normalize(trace_[i + 1].place - trace_[i].place);
            const dvec3 wanted = trace_[i].oxygen - along * glm::dot(trace_[i].oxygen, along);
            const dvec3 aside =
                glm::length(wanted) > 0.1 ? glm::normalize(wanted) : perpendicular(along);
            const auto at = [&](const dvec2& flat) {
                return trace_[i].place + along * flat.x + aside * flat.y;
            };
            residues_[i].carbon = at(peptide.carbon);
            residues_[i + 1].nitrogen = at(peptide.nitrogen);
            add(i, kCarbon, at(peptide.carbon));
            add(i, kOxygen, at(peptide.oxygen));
            add(i + 1, kNitrogen, at(peptide.nitrogen));
            add(i + 1, kHydrogen, at(peptide.hydrogen));
        }
    }

    void grow_side_chain(std::size_t residue) {
        const auto& nitrogen = residues_[residue].nitrogen;
        const auto& carbon = residues_[residue].carbon;
        const auto& kinds = side_chains();
        const auto drawn = random_.unit() * static_cast<double>(kinds.size());
        const auto& kind = kinds[static_cast<std::size_t>(drawn)];
        if (!kind || !nitrogen || !carbon) { // glycine, or an end of the chain
            return;
        }
        const dvec3 alpha = trace_[residue].place;
        const dvec3 to_nitrogen = glm::normalize(*nitrogen - alpha);
        const dvec3 to_carbon = glm::normalize(*carbon - alpha);
        // The one of the two places of a tetrahedron left by the backbone that life uses.
        const dvec3 away = -glm::normalize(to_nitrogen + to_carbon);
        const dvec3 aside = glm::normalize(glm::cross(to_nitrogen, to_carbon));
        const dvec3 along = glm::normalize(away * 0.58 + aside * 0.815);
        const dvec3 beta = alpha + kCarbonBond * along;
        if (!has_room(beta, residue, alpha, kOwnGap)) {
            return;
        }
        std::vector<Grown> grown = {{beta, along, to_nitrogen}};
        add(residue, kCarbon, grown[0].place);
        for (const SideAtom& next : *kind) {
            const auto place = find_room(residue, next.element, grown[next.bearer]);
            if (!place) {
                return;
            }
            add(residue, next.element, place->place);
            grown.push_back(*place);
        }
    }

    /// Whether a new atom of a residue is no nearer than `others` to other residues.
    [[nodiscard]] bool has_room(
        const dvec3& place, std::size_t residue, const dvec3& bearer, double others = kLeastGap
    ) const {
        return !grid_.any_near(place, [&](const dvec3& other, std::size_t owner, double gap) {
            return other != bearer && gap < (owner == residue ? kOwnGap : others);
        });
    }

    /// A place at a bond and an angle from a bearer, turned to where there is room.
    std::optional<Grown> find_room(std::size_t residue, std::uint8_t element, const Grown& bearer) {
        constexpr double kBend = 68.0 * kDegree; // 180 less 112 degrees, the angle between bonds
        const double bond = element == kSulphur ? 1.81 : element == kCarbon ? kCarbonBond : 1.43;
        const dvec3 flat = bearer.before - bearer.along * glm::dot(bearer.before, bearer.along);
        const dvec3 first = glm::normalize(flat);
        const dvec3 second = glm::cross(bearer.along, first);
        // Staggered turns first, beginning with any of them, then what lies between them.
        const double begin = std::floor(random_.between(0.0, 3.0)) * 120.0;
        for (const double turn_deg : {60.0, 180.0, 300.0, 90.0, 210.0, 330.0, 30.0, 150.0, 270.0}) {
            const double turn = (begin + turn_deg + random_.between(-12.0, 12.0)) * kDegree;
            const dvec3 aside = first * std::cos(turn) + second * std::sin(turn);
            const dvec3 along = bearer.along * std::cos(kBend) + aside * std::sin(kBend);
            const dvec3 place = bearer.place + bond * along;
            if (has_room(place, residue, bearer.place)) {
                return Grown{place, along, -bearer.along};
            }
        }
        return std::nullopt;
    }

    static constexpr double kCarbonBond = 1.53;

    const std::vector<CurvePoint>& trace_;
    Random& random_;
    Grid grid_;
    std::vector<Residue> residues_;
};

std::vector<io::Atom> fold(double radius, std::uint64_t seed) {
    Random random(seed);
    const std::vector<CurvePoint> trace = Fold(radius, random).alpha_carbons();
    double reach = 0.0;
    for (const CurvePoint& alpha : trace) {
        reach = std::max(reach, glm::length(alpha.place));
    }
    constexpr double kLongestSideChain = 12.0;
    return Builder(trace, reach + kLongestSideChain, random).atoms();
}

/// Turned at random around 0.
void turn(std::vector<io::Atom>& atoms, Random random) {
    const dvec3 y = random_direction(random);
    const dvec3 x = perpendicular(y);
    const glm::dmat3 rotation(x, y, glm::cross(x, y));
    for (io::Atom& atom : atoms) {
        atom.position = rotation * atom.position;
    }
}

} // namespace

Result<std::vector<io::Atom>> fold_molecule(const MoleculeOptions& options) {
    if (options.atoms < 1 || options.atoms > kMaxAtoms) {
        return fail(
            ErrorCode::invalid_argument,
            "molecule: atoms is " + std::to_string(options.atoms) + ", expected 1 to 1000000"
        );
    }
    const auto count = static_cast<std::size_t>(options.atoms);
    const double volume = kVolumeOfAtom * options.atoms;
    double radius = std::cbrt(volume * 3.0 / (2.0 * kTwoPi));
    std::vector<io::Atom> atoms = fold(radius, options.seed);
    while (atoms.size() < count) {
        constexpr double kGrowth = 1.01;
        radius *= kGrowth;
        atoms = fold(radius, options.seed);
    }
    atoms.resize(count); // what is left of the chain's end
    turn(atoms, Random(mix(options.seed)));
    return atoms;
}

Result<Scene> make_molecule(const MoleculeOptions& options) {
    const auto atoms = fold_molecule(options);
    if (!atoms) {
        return tl::unexpected(atoms.error());
    }
    auto scene = io::make_balls(*atoms);
    if (scene) {
        scene->sky = glm::vec3(0.90F, 0.92F, 0.95F);
    }
    return scene;
}

} // namespace farfield::scenes
