#include "technique/geometry_pass.hpp"
#include <farfield/math/box3.hpp>
#include <farfield/math/frustum.hpp>
#include <farfield/technique/color_cubes.hpp>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

namespace farfield {

namespace {

/// Levels of a tree whose cells are judged by what lies under them. Below, a cell holds so little
/// that a wrong guess costs little.
constexpr std::uint32_t kJudgedLevels = 4;
constexpr std::uint32_t kNowhere = UINT32_MAX;
/// Most steps that depths of a frame are sorted by: what is in one step keeps its order.
constexpr std::uint32_t kDepthSteps = 1U << 16U;
/// Cubes have to be so much cheaper than the geometry that they stand for. What references take is
/// guessed from one of their trees, so they have to be cheaper still.
constexpr double kWorthIt = 0.9;
constexpr double kReferencesWorthIt = 0.65;
/// Picking a triangle and handing it over one by one, in triangles.
constexpr double kSelected = 0.45;
/// Of the deepest tree that `validate` lets pass, its root included.
constexpr std::size_t kLevels = 21;
/// Deepest stack of a walk: seven siblings wait on each level.
constexpr std::size_t kDeepest = 7 * kLevels + 8;

/// The lower corner of each octant, in edges.
constexpr std::array<glm::vec3, 8> kUpper = {
    glm::vec3(0, 0, 0),
    glm::vec3(1, 0, 0),
    glm::vec3(0, 1, 0),
    glm::vec3(1, 1, 0),
    glm::vec3(0, 0, 1),
    glm::vec3(1, 0, 1),
    glm::vec3(0, 1, 1),
    glm::vec3(1, 1, 1)};

constexpr std::array<unsigned, 8> kFarFirst = {7, 6, 5, 3, 4, 2, 1, 0};

/// What of a cell a frame has read.
constexpr std::uint8_t kCellRead = 1;
constexpr std::uint8_t kCubeRead = 2;
constexpr std::uint8_t kContentsRead = 4;

/// Of the entries of a leaf.
std::size_t contents_bytes(const ColorCubeTree& tree, const CubeCell& leaf) noexcept {
    std::size_t bytes = 0;
    for_each_content(tree, leaf, [&](std::uint32_t) { bytes += sizeof(std::uint32_t); });
    return bytes;
}

/// Children of a cell, by its octants.
constexpr std::array<std::uint8_t, 256> kBits = [] {
    std::array<std::uint8_t, 256> bits{};
    for (std::size_t i = 0; i < bits.size(); ++i) {
        bits[i] = static_cast<std::uint8_t>(std::popcount(i));
    }
    return bits;
}();

/// A premultiplied colour with 8 bits more than it will have, two components a word.
struct MixedColor {
    std::uint32_t red_blue = 0;
    std::uint32_t green_alpha = 0;

    [[nodiscard]] std::uint32_t alpha() const noexcept { return green_alpha >> 16U; }

    /// The same colour with another alpha in [0, 1]. @pre alpha() > 0
    void set_alpha(float wanted) noexcept {
        constexpr float kWhole = 255.0F * 256.0F;
        const auto factor =
            static_cast<std::uint64_t>(wanted * (kWhole * 65536.0F) / static_cast<float>(alpha()));
        const auto scaled = [&](std::uint32_t component) {
            return static_cast<std::uint32_t>(component * factor >> 16U);
        };
        red_blue = scaled(red_blue & 0xFFFFU) | scaled(red_blue >> 16U) << 16U;
        green_alpha = scaled(green_alpha & 0xFFFFU) | scaled(green_alpha >> 16U) << 16U;
    }

    [[nodiscard]] glm::u8vec4 rounded() const noexcept {
        const auto component = [](std::uint32_t value) {
            return static_cast<std::uint8_t>((value + 127U) >> 8U);
        };
        return {
            component(red_blue & 0xFFFFU),
            component(green_alpha & 0xFFFFU),
            component(red_blue >> 16U),
            component(green_alpha >> 16U)};
    }
};

/// @param weights [0, 1], of sum 1
MixedColor
mixed(const std::array<const glm::u8vec4*, 3>& colors, const glm::vec3& weights) noexcept {
    const auto rounded = [](float weight) {
        return (static_cast<std::uint32_t>(weight * 512.0F) + 1U) >> 1U;
    };
    const std::uint32_t first = rounded(weights.x);
    const std::uint32_t second = std::min(rounded(weights.y), 256U - first);
    const std::array<std::uint32_t, 3> parts = {first, second, 256U - first - second};
    constexpr std::uint32_t kEven = 0x00FF00FFU;
    MixedColor result;
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const auto packed = std::bit_cast<std::uint32_t>(*colors[i]);
        result.red_blue += (packed & kEven) * parts[i];
        result.green_alpha += (packed >> 8U & kEven) * parts[i];
    }
    return result;
}

} // namespace

/// One frame's way through the trees.
struct ColorCubes::Walk {
    /// A view as a tree sees it: in the tree's own frame, where its cells are axis-parallel.
    struct Frame {
        glm::vec3 eye{0.0F};
        glm::vec3 forward{0.0F};
        std::array<Plane, 6> planes{};
        std::array<float, 6> reach{}; ///< of a cube of edge 1 along the normals, from its middle
        glm::mat3 to_model{1.0F};     ///< with the scale
        glm::vec3 translation{0.0F};
        float scale = 1.0F;
        std::uint32_t cube_frame = 0; ///< into `FramePlan::cube_frames`
        /// Into `open_leaves_`: of a reference that is shown in some of its leaves only.
        std::uint32_t first_leaf = kNowhere;
    };

    ColorCubes& self;
    const View& view;
    float focal_px = 0.0F;
    float limit_sq = 0.0F; ///< square of the largest diameter over the focal length

    Walk(ColorCubes& technique, const View& seen) noexcept;

    [[nodiscard]] Frame model_frame() const noexcept;
    [[nodiscard]] Frame reference_frame(const Frame& model, const CubeReference& of) const noexcept;
    void tree(std::size_t index, const Frame& frame, const CubeReference* reference) noexcept;
    void references(const Frame& frame) noexcept;

  private:
    [[nodiscard]] double cost_s(
        const Profiles& profiles, const Profile& profile, float edge, float depth
    ) const noexcept;
    void show(
        const Frame& frame,
        const ColorCube& cube,
        const CubeGain* gain,
        const LevelFactors* factors,
        const glm::vec3& scale,
        const glm::vec3& offset,
        float depth,
        const glm::vec3& size
    ) noexcept;
    void contents(
        std::size_t index, std::uint32_t leaf, const Place& place, const CubeReference* reference
    ) noexcept;
    [[nodiscard]] bool is_open(const Frame& frame, const glm::vec3& point) const noexcept;
    void everything(std::size_t index, std::uint32_t root, const CubeReference* reference) noexcept;
    void entry(std::size_t index, std::uint32_t number, const CubeReference* reference) noexcept;
    [[nodiscard]] bool moves(ItemId item) const noexcept;
    void whole(ItemId item) noexcept;
    void
    count(std::size_t index, std::uint32_t cell, std::uint8_t what, std::size_t bytes) noexcept {
        if (self.options_.count_bytes && (self.read_[index][cell] & what) == 0) {
            self.read_[index][cell] |= what;
            self.statistics_.bytes += bytes;
        }
    }
};

ColorCubes::Walk::Walk(ColorCubes& technique, const View& seen) noexcept
    : self(technique), view(seen) {
    const double across = view.width / (view.lens.right - view.lens.left);
    const double upward = view.height / (view.lens.top - view.lens.bottom);
    focal_px = static_cast<float>(std::max(across, upward));
    const auto limit = static_cast<float>(self.options_.cell_px / std::max(across, upward));
    limit_sq = limit * limit;
}

ColorCubes::Walk::Frame ColorCubes::Walk::model_frame() const noexcept {
    Frame frame;
    const glm::dvec3& origin = self.model_->origin;
    frame.eye = local_point(view.eye, origin);
    frame.forward = -glm::vec3(view.camera_to_world[2]);
    frame.planes = make_frustum(view, origin).planes;
    for (std::size_t i = 0; i < frame.planes.size(); ++i) {
        const glm::vec3 normal = glm::abs(frame.planes[i].normal);
        frame.reach[i] = 0.5F * (normal.x + normal.y + normal.z);
    }
    return frame;
}

ColorCubes::Walk::Frame
ColorCubes::Walk::reference_frame(const Frame& model, const CubeReference& of) const noexcept {
    Frame frame;
    const glm::mat3 back = glm::transpose(of.rotation);
    const float per_scale = 1.0F / of.scale;
    frame.eye = back * (model.eye - of.translation) * per_scale;
    frame.forward = back * model.forward;
    for (std::size_t i = 0; i < frame.planes.size(); ++i) {
        const Plane& plane = model.planes[i];
        frame.planes[i].normal = back * plane.normal;
        frame.planes[i].offset =
            (plane.offset - glm::dot(plane.normal, of.translation)) * per_scale;
        const glm::vec3 normal = glm::abs(frame.planes[i].normal);
        frame.reach[i] = 0.5F * (normal.x + normal.y + normal.z);
    }
    frame.to_model = of.rotation * of.scale;
    frame.translation = of.translation;
    frame.scale = of.scale;
    return frame;
}

/// What a cell takes when it is shown by cubes as far as these are small enough, as far as its
/// levels tell. [s]
/// @param edge of the cell, @param depth along the view direction, in one unit
double ColorCubes::Walk::cost_s(
    const Profiles& profiles, const Profile& profile, float edge, float depth
) const noexcept {
    const CostModel& costs = self.options_.costs;
    const float diameter_px =
        std::numbers::sqrt3_v<float> * edge * focal_px / std::max(depth, edge * 0.5F);
    float size = diameter_px / static_cast<float>(self.options_.cell_px);
    const double cube_s =
        self.options_.drawing == CubeDrawing::splats ? costs.splat_s : costs.cube_s;
    double sum = 0.0;
    double references = 0.0; // [triangle] that are reached
    for (std::uint32_t i = 0; i < profile.level_count; ++i) {
        const Level& level = profiles.levels[profile.first_level + i];
        sum += level.cells * costs.cell_s;
        if (size <= 1.0F) {
            sum += level.cells * cube_s;
            break;
        }
        sum += double{level.leaf_cost} * costs.triangle_s * (1.0 + kSelected);
        references += double{level.reference_cost};
        size *= 0.5F;
    }
    if (references > 0.0) {
        const Profiles& common = self.profiles_[self.common_tree_];
        const Profile& root = common.cells.front();
        const double as_cubes = cost_s(common, root, self.common_edge_, depth);
        const double as_geometry = double{root.cost} * costs.triangle_s;
        sum += references * costs.triangle_s * std::min(1.0, as_cubes / as_geometry);
    }
    return sum;
}

void ColorCubes::Walk::show(
    const Frame& frame,
    const ColorCube& cube,
    const CubeGain* gain,
    const LevelFactors* factors,
    const glm::vec3& scale,
    const glm::vec3& offset,
    float depth,
    const glm::vec3& size
) noexcept {
    ++self.statistics_.cubes;
    // The faces seen are those that look back at the eye.
    const std::array<const glm::u8vec4*, 3> faces = {
        &cube.faces[face_of(0, offset.x < 0.0F)],
        &cube.faces[face_of(1, offset.y < 0.0F)],
        &cube.faces[face_of(2, offset.z < 0.0F)]};
    const glm::vec3 center = frame.translation + frame.to_model * (frame.eye + offset);
    if (self.options_.drawing == CubeDrawing::faces) {
        self.plan_.cubes.push_back(
            {center, size * frame.scale, frame.cube_frame, {*faces[0], *faces[1], *faces[2]}}
        );
        self.depths_.push_back(depth * frame.scale);
        return;
    }
    // Seen along d, the silhouette of a box is the sum over its axes of |d_a| / |d| times the area
    // of the face normal to a, each face being one term; the image plane, at an angle with d, shows
    // it |d| / depth times as large.
    const glm::vec3 areas(size.y * size.z, size.z * size.x, size.x * size.y);
    const glm::vec3 seen = glm::abs(offset) * areas;
    const float sum = seen.x + seen.y + seen.z;
    if (!(sum > 0.0F)) {
        return; // what rounding has left no extent
    }
    MixedColor color = mixed(faces, seen * (1.0F / sum));
    float area = sum / depth;
    if (gain != nullptr && color.alpha() > 0) {
        const glm::vec3 depths(
            self.optical_depths_[faces[0]->a],
            self.optical_depths_[faces[1]->a],
            self.optical_depths_[faces[2]->a]
        );
        const glm::vec3 gains(
            self.gains_[gain->stored[0] & 0x7FU],
            self.gains_[gain->stored[1]],
            self.gains_[gain->stored[2]]
        );
        const bool sheet = is_sheet(*gain);
        const float factor =
            factors == nullptr || sheet ? 1.0F : level_factor(*factors, offset, scale);
        const float alpha = oblique_alpha(depths, offset, size, gains, factor);
        if (self.options_.sheets == CubeSheets::opaque && sheet) {
            color.set_alpha(1.0F);
            area *= std::sqrt(std::sqrt(alpha)); // see docs/color-cubes.md
        } else {
            color.set_alpha(alpha);
        }
    }
    const glm::u8vec4 rounded = color.rounded();
    if (rounded.a != 0) {
        // In place: what is put together on the stack first waits for its parts.
        Splat& splat = self.plan_.splats.emplace_back();
        splat.center = center;
        splat.side = frame.scale * std::sqrt(area);
        splat.color = rounded;
        self.depths_.push_back(depth * frame.scale);
    }
}

/// What moves is drawn where it is now, with all that does.
bool ColorCubes::Walk::moves(ItemId item) const noexcept {
    const Hierarchy& hierarchy = *self.hierarchy_;
    const std::size_t index = index_of(item);
    return index < hierarchy.item_places.size() &&
           hierarchy.item_places[index] >= hierarchy.items.size() &&
           hierarchy.item_places[index] != Hierarchy::kNoPlace;
}

void ColorCubes::Walk::whole(ItemId item) noexcept {
    if (!moves(item)) {
        self.plan_.items.push_back(item);
        ++self.statistics_.items;
    }
}

/// Draws one of the contents of a tree as geometry, unless it is shown already.
void ColorCubes::Walk::entry(
    std::size_t index, std::uint32_t number, const CubeReference* reference
) noexcept {
    if (self.drawn_[index][number]) {
        return;
    }
    self.drawn_[index][number] = true;
    const ColorCubeTree& tree = self.model_->trees[index];
    if (number < tree.reference_count) {
        whole(self.model_->references[number].item);
        return;
    }
    const std::size_t rest = number - tree.reference_count;
    if (rest < tree.items.size()) {
        whole(tree.items[rest]);
        return;
    }
    ++self.statistics_.triangles;
    if (reference != nullptr) {
        self.plan_.selected.push_back(number - tree.primitives.front().first);
        return;
    }
    std::size_t group = 0;
    while (number - tree.primitives[group].first >= tree.primitives[group].count) {
        ++group;
    }
    self.selected_[group].push_back(number - tree.primitives[group].first);
}

void ColorCubes::Walk::contents(
    std::size_t index, std::uint32_t leaf, const Place& place, const CubeReference* reference
) noexcept {
    ++self.statistics_.leaves;
    const ColorCubeTree& of = self.model_->trees[index];
    for_each_content(of, of.cells[leaf], [&](std::uint32_t number) {
        if (number >= of.reference_count) {
            entry(index, number, reference);
        } else if (!moves(self.model_->references[number].item)) {
            OpenReference& open = self.references_[number];
            if (open.open_leaves == 0) {
                self.open_references_.push_back(number);
            }
            ++open.open_leaves;
            self.open_leaves_.push_back({place.lo, place.edge, open.first_leaf});
            open.first_leaf = static_cast<std::uint32_t>(self.open_leaves_.size() - 1);
        }
    });
}

/// Shows the references that open leaves have, each as far as it is in them.
void ColorCubes::Walk::references(const Frame& frame) noexcept {
    for (const std::uint32_t number : self.open_references_) {
        const CubeReference& found = self.model_->references[number];
        OpenReference& open = self.references_[number];
        if (!self.drawn_.back()[number]) {
            ++self.statistics_.references;
            if (self.options_.count_bytes) {
                self.statistics_.bytes += sizeof(CubeReference);
            }
            Frame turned = reference_frame(frame, found);
            turned.first_leaf = open.open_leaves < open.leaves ? open.first_leaf : kNowhere;
            if (self.options_.drawing == CubeDrawing::faces) {
                turned.cube_frame = static_cast<std::uint32_t>(self.plan_.cube_frames.size());
                self.plan_.cube_frames.push_back(found.rotation);
            }
            tree(found.tree, turned, &found);
        }
        open.first_leaf = kNowhere;
        open.open_leaves = 0;
    }
    self.open_references_.clear();
    self.open_leaves_.clear();
}

/// Whether a point of a reference is in one of its open leaves: in the others, it is shown by their
/// colour cubes or those above them.
/// @param point relative to the eye, in the frame of the reference
bool ColorCubes::Walk::is_open(const Frame& frame, const glm::vec3& point) const noexcept {
    if (frame.first_leaf == kNowhere) {
        return true;
    }
    const glm::vec3 at = frame.translation + frame.to_model * (frame.eye + point);
    for (std::uint32_t i = frame.first_leaf; i != kNowhere; i = self.open_leaves_[i].next) {
        const OpenLeaf& leaf = self.open_leaves_[i];
        const glm::vec3 from = at - leaf.lo;
        if (std::min({from.x, from.y, from.z}) >= 0.0F &&
            std::max({from.x, from.y, from.z}) < leaf.edge) {
            return true;
        }
    }
    return false;
}

/// Draws all contents under a cell as geometry.
void ColorCubes::Walk::everything(
    std::size_t index, std::uint32_t root, const CubeReference* reference
) noexcept {
    const ColorCubeTree& of = self.model_->trees[index];
    std::array<std::uint32_t, kDeepest> open{};
    std::size_t size = 0;
    open[size++] = root;
    while (size > 0) {
        const CubeCell& cell = of.cells[open[--size]];
        if (cell.octants != 0) {
            for (std::uint32_t i = child_count(cell); i-- > 0;) {
                open[size++] = cell.first + i;
            }
            continue;
        }
        for_each_content(of, cell, [&](std::uint32_t number) { entry(index, number, reference); });
    }
}

void ColorCubes::Walk::tree(
    std::size_t index, const Frame& frame, const CubeReference* reference
) noexcept {
    const ColorCubeTree& of = self.model_->trees[index];
    const Profiles& profiles = self.profiles_[index];
    const ColorCube* cubes =
        of.cubes.data() + (reference == nullptr ? 0 : reference->light_set) * of.cells.size();
    const std::size_t first_selected = self.plan_.selected.size();
    Visit* const open = self.open_.data();
    Place* const path = self.path_.data();
    std::size_t size = 0;
    open[size++] = {0, 0, 0, 0, false};
    path[0] = {of.lo, of.edge, root_range(of)};
    while (size > 0) {
        const Visit visit = open[--size];
        const CubeCell& cell = of.cells[visit.cell];
        ++self.statistics_.cells;
        count(index, visit.cell, kCellRead, sizeof(CubeCell));
        // Whatever was visited between a cell and its last child is below it.
        const Place& parent = path[visit.depth];
        const float edge = visit.depth == 0 ? parent.edge : parent.edge * 0.5F;
        const glm::vec3 lo = parent.lo + kUpper[visit.octant] * edge;
        const Box3f box = contents_box(cell, parent.contents, lo, edge);
        const glm::vec3 middle = lo + edge * 0.5F;
        bool inside = visit.inside;
        if (!inside) {
            inside = true;
            bool outside = false;
            for (std::size_t i = 0; i < frame.planes.size(); ++i) {
                const float distance = signed_distance(frame.planes[i], middle);
                const float reach = frame.reach[i] * (edge + 2.0F * of.overhang);
                outside = outside || distance < -reach;
                inside = inside && distance >= reach;
            }
            if (outside) {
                continue;
            }
        }
        const glm::vec3 offset = center(box) - frame.eye;
        const glm::vec3 extents = extent(box);
        const float depth = glm::dot(offset, frame.forward);
        // 2 R sqrt(d^2 - R^2) / (z^2 - R^2) <= limit, where z > R.
        const float radius_sq = 0.25F * glm::dot(extents, extents);
        const float ahead = depth * depth - radius_sq;
        if (depth > 0.0F && ahead > 0.0F &&
            4.0F * radius_sq * (glm::dot(offset, offset) - radius_sq) <= limit_sq * ahead * ahead) {
            if (!is_open(frame, offset)) {
                continue;
            }
            const CubeGain* gain = of.gains.empty() ? nullptr : &of.gains[visit.cell];
            count(
                index,
                visit.cell,
                kCubeRead,
                sizeof(ColorCube) + (gain == nullptr ? 0 : sizeof(CubeGain))
            );
            const LevelFactors* factors =
                of.level_factors.empty() ? nullptr : &of.level_factors[visit.depth];
            show(
                frame,
                cubes[visit.cell],
                gain,
                factors,
                self.level_scales_[index],
                offset,
                depth,
                extents
            );
            continue;
        }
        if (visit.profile != kNowhere && self.options_.never_slower) {
            const Profile& profile = profiles.cells[visit.profile];
            // Around the eye, cells of all sizes would be needed: those below are judged instead.
            const bool around = glm::dot(offset, offset) <= radius_sq && profile.first_child != 0;
            const double geometry_s = double{profile.cost} * self.options_.costs.triangle_s;
            if (!around &&
                cost_s(profiles, profile, edge * frame.scale, depth * frame.scale) >=
                    (of.reference_count > 0 ? kReferencesWorthIt : kWorthIt) * geometry_s) {
                if (visit.cell == 0 && reference == nullptr) {
                    self.statistics_.geometry = true;
                    return;
                }
                if (visit.cell == 0) {
                    whole(reference->item);
                } else {
                    everything(index, visit.cell, reference);
                }
                continue;
            }
        }
        if (cell.octants == 0) {
            if (self.options_.count_bytes) {
                count(index, visit.cell, kContentsRead, contents_bytes(of, cell));
            }
            if (is_open(frame, offset)) {
                contents(index, visit.cell, {lo, edge, box}, reference);
            }
            continue;
        }
        const unsigned nearest = (frame.eye.x > middle.x ? 1U : 0U) |
                                 (frame.eye.y > middle.y ? 2U : 0U) |
                                 (frame.eye.z > middle.z ? 4U : 0U);
        const std::uint32_t first_profile =
            visit.profile == kNowhere ? 0 : profiles.cells[visit.profile].first_child;
        path[visit.depth + 1] = {lo, edge, box};
        // The last to be pushed is the first to be visited.
        for (std::size_t i = 8; i-- > 0;) {
            const unsigned octant = nearest ^ kFarFirst[i];
            if ((cell.octants >> octant & 1U) == 0U) {
                continue;
            }
            const auto before = std::uint32_t{kBits[cell.octants & ((1U << octant) - 1U)]};
            open[size++] = {
                cell.first + before,
                first_profile == 0 ? kNowhere : first_profile + before,
                static_cast<std::uint8_t>(octant),
                static_cast<std::uint8_t>(visit.depth + 1),
                inside};
        }
    }
    if (reference != nullptr && self.plan_.selected.size() > first_selected) {
        const auto first = static_cast<std::uint32_t>(first_selected);
        const auto count = static_cast<std::uint32_t>(self.plan_.selected.size()) - first;
        for (std::size_t i = first_selected; i < self.plan_.selected.size(); ++i) {
            self.drawn_[index][self.plan_.selected[i] + of.primitives.front().first] = false;
        }
        self.plan_.selections.push_back({reference->item, first, count});
    }
}

ColorCubes::ColorCubes(
    const Hierarchy& hierarchy, const ColorCubeModel& model, const ColorCubesOptions& options
)
    : hierarchy_(&hierarchy), model_(&model), options_(options), geometry_(hierarchy),
      drawn_(model.trees.size()), open_(kDeepest), path_(kLevels + 1),
      references_(model.references.size()), step_begins_(kDepthSteps + 1) {
    for (std::size_t i = 0; i < model.trees.size(); ++i) {
        profiles_.push_back(profiles_of(i));
        const ColorCubeTree& tree = model.trees[i];
        level_scales_.push_back(level_scale(tree));
        std::size_t contents = tree.reference_count + tree.items.size();
        for (const CubePrimitives& primitives : tree.primitives) {
            contents += primitives.count;
        }
        drawn_[i].resize(contents);
        if (options.count_bytes) {
            read_.emplace_back(tree.cells.size());
        }
    }
    for (const std::uint32_t entry : model.trees.back().contents) {
        const std::uint32_t number = entry & ~ColorCubeTree::kLast;
        if (number < model.references.size()) {
            ++references_[number].leaves;
        }
    }
    selected_.resize(model.trees.back().primitives.size());
    for (std::size_t i = 0; i < optical_depths_.size(); ++i) {
        optical_depths_[i] = optical_depth(static_cast<std::uint8_t>(i));
    }
    for (std::size_t i = 0; i < gains_.size(); ++i) {
        gains_[i] = gain_of({{static_cast<std::uint8_t>(i), 0, 0}}).x;
    }
    find_common_tree();
}

void ColorCubes::find_common_tree() {
    std::vector<double> triangles(model_->trees.size(), 0.0);
    std::vector<double> edges(model_->trees.size(), 0.0);
    std::vector<double> counts(model_->trees.size(), 0.0);
    for (const CubeReference& reference : model_->references) {
        const ColorCubeTree& tree = model_->trees[reference.tree];
        triangles[reference.tree] += tree.primitives.front().count;
        edges[reference.tree] += double{tree.edge} * reference.scale;
        counts[reference.tree] += 1.0;
    }
    const auto most = std::max_element(triangles.begin(), triangles.end());
    common_tree_ = static_cast<std::size_t>(most - triangles.begin());
    common_edge_ = static_cast<float>(edges[common_tree_] / std::max(counts[common_tree_], 1.0));
}

Result<ColorCubes> ColorCubes::create(
    const Hierarchy& hierarchy, const ColorCubeModel& model, const ColorCubesOptions& options
) {
    if (!(options.cell_px > 0.0) || !std::isfinite(options.cell_px)) {
        return fail(
            ErrorCode::invalid_argument,
            "colour cubes: cell_px is " + std::to_string(options.cell_px) +
                ", expected a finite value above 0 pixels"
        );
    }
    if (options.drawing > CubeDrawing::faces) {
        return fail(
            ErrorCode::invalid_argument,
            "colour cubes: unknown drawing " +
                std::to_string(static_cast<unsigned>(options.drawing))
        );
    }
    if (options.sheets > CubeSheets::opaque) {
        return fail(
            ErrorCode::invalid_argument,
            "colour cubes: unknown sheets " + std::to_string(static_cast<unsigned>(options.sheets))
        );
    }
    if (Result<void> valid = validate(options.costs); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    return ColorCubes(hierarchy, model, options);
}

/// Walks a tree from the back, where children come before their parents, and adds up.
ColorCubes::Profiles ColorCubes::profiles_of(std::size_t index) const {
    const ColorCubeTree& tree = model_->trees[index];
    // What each of the contents costs every leaf that it is in.
    std::size_t numbers = tree.reference_count + tree.items.size();
    for (const CubePrimitives& primitives : tree.primitives) {
        numbers += primitives.count;
    }
    std::vector<std::uint32_t> copies(numbers, 0);
    for (const std::uint32_t entry : tree.contents) {
        ++copies[entry & ~ColorCubeTree::kLast];
    }
    const auto cost_of = [&](std::uint32_t number) {
        double cost = 1.0;
        if (number < tree.reference_count) {
            const ColorCubeTree& of = model_->trees[model_->references[number].tree];
            cost = of.primitives.front().count;
        } else if (number - tree.reference_count < tree.items.size()) {
            cost = tree.item_primitives[number - tree.reference_count];
        }
        return cost / copies[number];
    };
    Profiles result;
    struct Open {
        std::uint32_t cell = 0;
        std::uint32_t depth = 0;
    };
    std::vector<Level> levels;
    const auto add_profile = [&](std::uint32_t root, Profile& profile) {
        levels.clear();
        std::vector<Open> open = {{root, 0}};
        double whole = 0.0;
        while (!open.empty()) {
            const Open visit = open.back();
            open.pop_back();
            const CubeCell& cell = tree.cells[visit.cell];
            levels.resize(std::max<std::size_t>(levels.size(), visit.depth + 1));
            ++levels[visit.depth].cells;
            for (std::uint32_t i = 0; i < child_count(cell); ++i) {
                open.push_back({cell.first + i, visit.depth + 1});
            }
            if (cell.octants != 0) {
                continue;
            }
            for_each_content(tree, cell, [&](std::uint32_t number) {
                const double cost = cost_of(number);
                Level& level = levels[visit.depth];
                (number < tree.reference_count ? level.reference_cost : level.leaf_cost) +=
                    static_cast<float>(cost);
                whole += cost;
            });
        }
        profile.first_level = static_cast<std::uint32_t>(result.levels.size());
        profile.level_count = static_cast<std::uint32_t>(levels.size());
        profile.cost = static_cast<float>(whole);
        result.levels.insert(result.levels.end(), levels.begin(), levels.end());
    };
    // Level by level, so that the profiles of children follow each other.
    std::vector<Open> judged = {{0, 0}};
    result.cells.resize(1);
    for (std::size_t i = 0; i < judged.size(); ++i) {
        const Open of = judged[i];
        add_profile(of.cell, result.cells[i]);
        const CubeCell& cell = tree.cells[of.cell];
        if (of.depth + 1 < kJudgedLevels && cell.octants != 0) {
            result.cells[i].first_child = static_cast<std::uint32_t>(judged.size());
            for (std::uint32_t k = 0; k < child_count(cell); ++k) {
                judged.push_back({cell.first + k, of.depth + 1});
            }
            result.cells.resize(judged.size());
        }
    }
    return result;
}

template <typename Cell>
void ColorCubes::sort_from_the_back(std::vector<Cell>& cells, std::vector<Cell>& sorted) noexcept {
    if (cells.size() < 2 || cells.size() != depths_.size()) {
        return;
    }
    // Counting in steps of depth, of which there are more than cells.
    const auto step_count = std::min<std::uint32_t>(
        kDepthSteps, std::bit_ceil(static_cast<std::uint32_t>(cells.size())) * 8U
    );
    const auto [nearest, farthest] = std::minmax_element(depths_.begin(), depths_.end());
    const float last = *farthest;
    const float steps = static_cast<float>(step_count - 1) / std::max(last - *nearest, 1e-30F);
    const auto step_of = [&](float depth) {
        return std::min(static_cast<std::uint32_t>((last - depth) * steps), step_count - 1);
    };
    std::fill_n(step_begins_.begin(), step_count + 1, 0U);
    for (const float depth : depths_) {
        ++step_begins_[step_of(depth) + 1];
    }
    for (std::size_t i = 1; i <= step_count; ++i) {
        step_begins_[i] += step_begins_[i - 1];
    }
    sorted.resize(cells.size());
    for (std::size_t i = 0; i < cells.size(); ++i) {
        sorted[step_begins_[step_of(depths_[i])]++] = cells[i];
    }
    cells.swap(sorted);
}

const FramePlan& ColorCubes::plan(const View& view) noexcept {
    clear(plan_);
    statistics_ = {};
    depths_.clear();
    for (std::vector<std::uint8_t>& read : read_) {
        std::fill(read.begin(), read.end(), std::uint8_t{0});
    }
    plan_.origin = model_->origin;
    plan_.cube_frames.emplace_back(1.0F);
    Walk walk(*this, view);
    const Walk::Frame frame = walk.model_frame();
    walk.tree(model_->trees.size() - 1, frame, nullptr);
    const std::size_t of_scene = depths_.size();
    walk.references(frame);
    const ColorCubeTree& scene = model_->trees.back();
    for (std::size_t group = 0; group < selected_.size(); ++group) {
        std::vector<std::uint32_t>& selected = selected_[group];
        if (!selected.empty()) {
            plan_.selections.push_back(
                {scene.primitives[group].item,
                 static_cast<std::uint32_t>(plan_.selected.size()),
                 static_cast<std::uint32_t>(selected.size())}
            );
            plan_.selected.insert(plan_.selected.end(), selected.begin(), selected.end());
            selected.clear();
        }
    }
    std::fill(drawn_.back().begin(), drawn_.back().end(), false);
    if (statistics_.geometry || (options_.never_slower && statistics_.cubes == 0)) {
        statistics_.geometry = true;
        return geometry_.plan(view);
    }
    const Frustum frustum = make_frustum(view, hierarchy_->origin);
    for (const MovingItem& moving : hierarchy_->moving) {
        if (!is_empty(moving.box) && classify(frustum, moving.box) != Overlap::outside) {
            plan_.items.push_back(moving.item);
        }
    }
    // Octants come from the back, but references overlap, and come after the scene's own cells.
    const bool of_references = depths_.size() > of_scene;
    if (of_references && (of_scene > 0 || statistics_.references > 1)) {
        sort_from_the_back(plan_.splats, sorted_splats_);
        sort_from_the_back(plan_.cubes, sorted_cubes_);
    }
    // Cells came from the back; geometry is best drawn from the front.
    std::reverse(plan_.items.begin(), plan_.items.end());
    Command geometry;
    geometry.count = static_cast<std::uint32_t>(plan_.items.size());
    geometry.selection_count = static_cast<std::uint32_t>(plan_.selections.size());
    if (geometry.count > 0 || geometry.selection_count > 0) {
        plan_.commands.push_back(geometry);
    }
    Command cubes;
    const bool splats = options_.drawing == CubeDrawing::splats;
    cubes.kind = splats ? Command::Kind::splats : Command::Kind::cubes;
    cubes.count = static_cast<std::uint32_t>(splats ? plan_.splats.size() : plan_.cubes.size());
    if (cubes.count > 0) {
        plan_.commands.push_back(cubes);
    }
    Pass pass = frame_pass(view, 0);
    pass.command_count = static_cast<std::uint32_t>(plan_.commands.size());
    plan_.passes.push_back(pass);
    return plan_;
}

} // namespace farfield
