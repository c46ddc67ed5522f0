// Keyframes projected on coarse models: Chen, Swan, Kuo, "LOD-Sprite Technique for Accelerated
// Terrain Rendering", 1999. One decision a frame, as in the paper: is a picture of the fine models
// still right from here? What is different, and why, is in docs/lod-sprite.md.
#include "technique/geometry_pass.hpp"
#include "technique/image_camera.hpp"
#include "technique/keyframe_store.hpp"
#include "technique/plan_writer.hpp"
#include "technique/sprite_cut.hpp"
#include "technique/sprite_survey.hpp"
#include <farfield/core/assert.hpp>
#include <farfield/math/frustum.hpp>
#include <farfield/metric/pixel_angle.hpp>
#include <farfield/metric/pixel_conversion.hpp>
#include <farfield/metric/sprite_angle.hpp>
#include <farfield/partition/changes.hpp>
#include <farfield/technique/lod_sprite.hpp>
#include <farfield/technique/sprite_error.hpp>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace farfield {

namespace {

// Samples that a root of the mean square is taken of: it is known to some percent then, which is
// less than what a pixel more or less of the eye's way makes.
constexpr std::uint32_t kMostSamples = 4096;
// Errors below this share of the threshold are not told apart: nothing hangs on them.
constexpr double kSmallError = 1.0 / 16.0;
// A share of the picture that is not worth a second keyframe.
constexpr float kFewLost = 0.01F;
// A keyframe that serves less than the rest of the picture comes after those that serve more.
constexpr float kMostlyLost = 0.5F;
// While a foreseen keyframe is made that is needed earlier, so many times the share that may be
// without one is borne.
constexpr double kPatience = 3.0;
// Texels on a surface that is seen from along it are not measured finer than at this cosine.
constexpr float kLeastTexelCosine = 1.0F / 32.0F;
// As of samples: rays that graze a facet count as at this cosine.
constexpr float kLeastCosine = 1.0F / 16.0F;
// Pairs are drawn together where the offsets of their coarse models are within this factor, since
// a keyframe has one for all that it is projected on.
constexpr float kSameOffset = 4.0F;
// An extrapolated way is straight but for this share of it.
constexpr double kMostBend = 0.5;
// Farther than this an extrapolated turn is a guess.
constexpr double kMostTurn = std::numbers::pi / 3.0;
// A keyframe is foreseen for an eye this many times the horizon beyond it, halved until it is right
// at the horizon within this share of the threshold: eyes do not go quite as foreseen.
constexpr double kFarthestAhead = 4.0;
constexpr int kHalvings = 6;
constexpr double kSpare = 0.75;
// As `validate` has it.
constexpr std::size_t kMostTiles = 64;
// So many keyframes in a row that died before they paid, and none is made for a while: twice as
// long every time, up to 2^6 frames.
constexpr std::uint32_t kShortLives = 2;
constexpr std::uint32_t kMostPause = 6;
// Depths of keyframes reach this share beyond the boxes of what they show: what is at the far end
// must not be taken for nothing.
constexpr float kDepthMargin = 1e-3F;

// Keyframes are of all that there is: of the root, for those who measure.
constexpr std::uint32_t kKeyframeNode = 0;

/// What drawing something comes to.
struct Work {
    std::uint64_t primitives = 0;
    std::uint64_t draws = 0;
};

/// A view that is wider by `margin`, on the same pixels.
View widened(const View& view, double margin) noexcept {
    const auto pad = [&](int pixels) {
        return static_cast<int>(std::ceil((margin - 1.0) / 2.0 * pixels));
    };
    const int across = pad(view.width);
    const int up = pad(view.height);
    if (across == 0 && up == 0) {
        return view;
    }
    View wide = view;
    wide.lens = sub_lens(view, -across, -up, view.width + across, view.height + up);
    wide.width += 2 * across;
    wide.height += 2 * up;
    return wide;
}

/// The rotation by an angle around a unit axis.
glm::dmat3 rotation(const glm::dvec3& axis, double angle) noexcept {
    const double sine = std::sin(angle);
    const double versine = 1.0 - std::cos(angle);
    const auto column = [&](const glm::dvec3& unit) {
        return unit + sine * glm::cross(axis, unit) +
               versine * glm::cross(axis, glm::cross(axis, unit));
    };
    return {column({1, 0, 0}), column({0, 1, 0}), column({0, 0, 1})};
}

} // namespace

struct LodSprite::Impl {
    /// A pair, and what of it a frame needs to know.
    struct Model {
        const ProxyPair* pair = nullptr;
        Box3f box;                ///< around both models, relative to the hierarchy's origin
        Box3f built_box;          ///< of a whole item when the pair was given; empty of a split one
        glm::vec3 offset{0.0F};   ///< of the pair's origin from the hierarchy's
        float offset_m = 0.0F;    ///< of the coarse model as it is drawn without a cut
        std::uint64_t coarse = 0; ///< triangles of that
        std::vector<std::uint32_t> middles; ///< samples of the paper's error
        bool active = true; ///< the fine item is where it was when the pair was built
    };
    /// How right a keyframe is for a view.
    struct Judgement {
        double error_rad = 0.0;
        float lost = 0.0F; ///< share of the picture that it does not serve
        bool right = false;
    };
    /// What is asked of keyframes.
    struct Seen {
        const View* view = nullptr;
        ImageCamera camera;
        SpriteSurvey survey;
        bool surveyed = false;
    };

    const Hierarchy* hierarchy;
    LodSpriteOptions options;
    KeyframeStore store;
    FramePlan plan;
    PlanWriter writer;
    std::vector<Model> models;                 ///< by offset
    std::vector<std::uint32_t> model_of;       ///< by item; UINT32_MAX: none
    std::vector<std::uint8_t> has_models;      ///< by node: something with an active pair is below
    std::vector<std::uint8_t> has_others;      ///< by node: something without
    std::vector<SurveyModel> survey_models;    ///< all active ones
    std::vector<SurveyModel> visible;          ///< models in the frustum, active
    std::vector<std::uint32_t> visible_models; ///< the same, into `models`
    Seen now;
    Seen ahead;
    SpriteSurvey made_survey; ///< through a keyframe's own camera
    std::vector<glm::dvec3> cut_eyes;
    std::vector<Cut> cuts; ///< by place in `visible`
    /// Triangles that one of the keyframes shown serves as well as all of them, by that keyframe;
    /// in the last group those that need all.
    using Groups = std::array<std::uint32_t, kMostKeyframes + 1>;
    std::vector<Groups> groups;         ///< counts, by place in `visible`
    std::vector<std::uint32_t> sorted;  ///< triangles, while they are grouped
    std::vector<std::uint8_t> group_of; ///< of those
    SurveyMask mask;
    LodSpriteStatistics statistics;
    std::uint64_t frame_number = 0;
    std::uint64_t appearance = 0;
    std::uint64_t kept_appearance = 0;
    std::uint32_t content_version = 0;
    std::uint32_t surface_version = 0;
    double threshold_rad = 0.0;
    Frustum frustum;
    Motion motion;
    std::optional<glm::dmat3> last_rotation;
    std::optional<std::uint32_t> current;   ///< the keyframe in use
    std::optional<std::uint32_t> successor; ///< a foreseen one, to take over
    std::optional<std::uint32_t> building;
    std::array<std::int32_t, kMostTiles + 1> tile_edges{}; ///< [texel] of the one being made
    std::uint32_t short_lives = 0;
    std::uint64_t resume_frame = 0;
    std::array<std::uint32_t, kMostKeyframes> shown{};
    std::uint32_t shown_count = 0;

    Impl(const Hierarchy& tree, std::span<const ProxyPair> pairs, const LodSpriteOptions& chosen);
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;

    void begin_frame(const View& view, const Motion& how) noexcept;
    void follow_world() noexcept;
    void find_contents() noexcept;
    [[nodiscard]] bool is_model(ItemId item) const noexcept;
    /// Calls `use_item` and `use_piece` with what is in a frustum and has an active pair, or with
    /// the rest, nearer cells first.
    template <typename UseItem, typename UsePiece>
    void for_contents(
        std::uint32_t index,
        const Frustum& within,
        const glm::vec3& eye,
        bool of_models,
        const UseItem& use_item,
        const UsePiece& use_piece
    ) const noexcept;
    void write_contents(const Frustum& within, const glm::vec3& eye, bool of_models) noexcept;
    /// Triangles of a whole item, or what items of its leaf have on average. @param place of it
    [[nodiscard]] std::uint64_t
    primitives_of(const HierarchyNode& leaf, std::uint32_t place) const noexcept {
        return hierarchy->item_primitives.empty() ? leaf.item_primitives / leaf.item_count
                                                  : hierarchy->item_primitives[place];
    }
    [[nodiscard]] Work work_within(const Frustum& within) const noexcept;

    void look(Seen& seen) noexcept;
    [[nodiscard]] bool surveys() const noexcept {
        return options.max_own_share < 1.0 || options.keyframes_shown > 1;
    }
    /// Whether a keyframe, or several together, that lose a share of the picture may be shown.
    /// @param patience how many times `max_own_share` may be lost
    [[nodiscard]] bool serves(float lost, double patience = 1.0) const noexcept {
        return options.max_own_share >= 1.0 || double{lost} <= patience * options.max_own_share;
    }
    /// Whether frames may show less than asked for while a keyframe is made in tiles: where every
    /// fragment is held to the threshold, nothing is wrong then, and there is a place to make it.
    [[nodiscard]] bool may_wait() const noexcept {
        return options.guaranteed && options.predict_frames > 0 &&
               store.count() > options.keyframes_shown;
    }
    [[nodiscard]] SpriteEyes
    eyes_of(const Model& model, const View& drawn, const View& seen) const noexcept;
    /// @param ignore_rad as `sprite_error::largest`
    [[nodiscard]] double error_of(
        const View& drawn, const View& seen, SpriteCriterion criterion, double ignore_rad
    ) noexcept;
    [[nodiscard]] bool is_right(double error_rad) const noexcept;
    [[nodiscard]] bool loses(
        const KeyframeSlot& slot, const SurveyPoint& point, const ImageCamera& camera
    ) const noexcept;
    [[nodiscard]] Judgement judge(std::uint32_t index, Seen& seen) noexcept;
    [[nodiscard]] float lost_with(std::uint32_t index) const noexcept;

    [[nodiscard]] bool choose(double patience) noexcept;
    [[nodiscard]] bool complete_choice(std::uint32_t first, double patience) noexcept;
    [[nodiscard]] bool pays(const View& view) noexcept;
    [[nodiscard]] View foreseen(const View& view, double frames) const noexcept;

    void make_at_once(const View& view) noexcept;
    void begin_keyframe(KeyframeSlot& slot, const View& view) noexcept;
    void write_keyframe_pass(KeyframeSlot& slot, const Region& part, std::uint32_t batch) noexcept;
    void finish_keyframe(KeyframeSlot& slot) noexcept;
    void foresee(const View& view, bool late) noexcept;
    [[nodiscard]] View best_place(const View& view, const View& then, double horizon) noexcept;
    /// What a keyframe that is yet to be made is weighed by: with a promise for every fragment,
    /// what most of them are off.
    [[nodiscard]] SpriteCriterion life_criterion() const noexcept {
        return options.guaranteed ? SpriteCriterion::rms : options.criterion;
    }
    void place_tiles(const KeyframeSlot& slot) noexcept;
    void make_tile() noexcept;
    [[nodiscard]] bool finish_early() noexcept;

    [[nodiscard]] std::uint32_t next_batch() const noexcept {
        return plan.passes.empty() ? 0U : plan.passes.back().batch + 1U;
    }
    void write_geometry_frame(const View& view, SpriteRefusal refusal) noexcept;
    void write_image_frame(const View& view, std::uint32_t index) noexcept;
    void write_projected_frame(const View& view) noexcept;
    [[nodiscard]] bool cut_models() noexcept;
    void group_triangles() noexcept;
    void write_projected(std::size_t first, std::size_t last) noexcept;
    void
    write_group(std::size_t first, std::size_t last, std::uint32_t group, float offset_m) noexcept;
    void report() noexcept;
    void run(const View& view) noexcept;
    void forget_keyframes() noexcept;
};

LodSprite::Impl::Impl(
    const Hierarchy& tree, std::span<const ProxyPair> pairs, const LodSpriteOptions& chosen
)
    : hierarchy(&tree), options(chosen), store(
                                             {.budget_bytes = chosen.image_budget_bytes,
                                              .most = chosen.max_keyframes,
                                              .limit = chosen.keyframe_limit,
                                              .samples = chosen.keyframe_samples}
                                         ),
      writer(plan, tree), content_version(tree.nodes[0].content_version),
      surface_version(tree.surface_version) {
    for (const ProxyPair& pair : pairs) {
        Model model;
        model.pair = &pair;
        const glm::dvec3 shift = pair.origin - tree.origin;
        model.offset = glm::vec3(shift);
        model.offset_m = pair.offset_m;
        model.coarse = pair.facets.size();
        if (is_refinable(pair)) {
            model.offset_m = 0.0F;
            model.coarse = 0;
            for (std::size_t i = 0; i < pair.splits.size(); ++i) {
                if (pair.children[i] == UINT32_MAX) {
                    model.offset_m = std::max(model.offset_m, pair.splits[i].offset);
                    ++model.coarse;
                }
            }
        }
        const Box3f& samples = pair.nodes[0].bounds;
        Box3d world{glm::dvec3(samples.lo) + pair.origin, glm::dvec3(samples.hi) + pair.origin};
        model.box = local_box(inflate(world, glm::dvec3(double{pair.offset_m})), tree.origin);
        model.built_box = partition::item_box(tree, pair.fine);
        if (options.paper_theta) {
            model.middles = sprite_error::middle_samples(pair);
        }
        models.push_back(std::move(model));
    }
    std::stable_sort(models.begin(), models.end(), [](const Model& a, const Model& b) {
        return a.offset_m < b.offset_m;
    });
    for (std::size_t i = 0; i < models.size(); ++i) {
        const std::size_t item = index_of(models[i].pair->fine);
        model_of.resize(std::max(model_of.size(), item + 1), UINT32_MAX);
        model_of[item] = static_cast<std::uint32_t>(i);
    }
    survey_models.reserve(models.size());
    visible.reserve(models.size());
    visible_models.reserve(models.size());
    cuts.reserve(models.size());
    groups.reserve(models.size());
    cut_eyes.reserve(kMostKeyframes);
    has_models.resize(tree.nodes.size());
    has_others.resize(tree.nodes.size());
    find_contents();
}

bool LodSprite::Impl::is_model(ItemId item) const noexcept {
    const std::size_t index = index_of(item);
    return index < model_of.size() && model_of[index] != UINT32_MAX &&
           models[model_of[index]].active;
}

void LodSprite::Impl::find_contents() noexcept {
    survey_models.clear();
    for (const Model& model : models) {
        if (model.active) {
            survey_models.push_back({model.pair, model.offset});
        }
    }
    const std::vector<HierarchyNode>& nodes = hierarchy->nodes;
    for (std::size_t i = nodes.size(); i-- > 0;) {
        const HierarchyNode& node = nodes[i];
        bool with_models = false;
        bool with_others = false;
        if (is_leaf(node)) {
            for (std::uint32_t k = 0; k < node.item_count; ++k) {
                const ItemId item = hierarchy->items[node.first_item + k];
                with_models = with_models || is_model(item);
                with_others = with_others || (item != kNone<ItemId> && !is_model(item));
            }
            for (std::uint32_t k = 0; k < node.piece_count; ++k) {
                const bool model = is_model(hierarchy->pieces[node.first_piece + k].item);
                with_models = with_models || model;
                with_others = with_others || !model;
            }
        } else {
            with_models =
                has_models[node.first_child] != 0 || has_models[node.first_child + 1] != 0;
            with_others =
                has_others[node.first_child] != 0 || has_others[node.first_child + 1] != 0;
        }
        has_models[i] = with_models ? 1 : 0;
        has_others[i] = with_others ? 1 : 0;
    }
}

void LodSprite::Impl::follow_world() noexcept {
    const std::uint32_t content = hierarchy->nodes[0].content_version;
    if (content == content_version && surface_version == hierarchy->surface_version &&
        appearance == kept_appearance) {
        return;
    }
    content_version = content;
    surface_version = hierarchy->surface_version;
    kept_appearance = appearance;
    for (Model& model : models) {
        if (!is_empty(model.built_box)) {
            const ItemId item = model.pair->fine;
            const std::size_t place = hierarchy->item_places[index_of(item)];
            model.active =
                place < hierarchy->items.size() && hierarchy->item_boxes[place] == model.built_box;
        }
    }
    find_contents();
    store.release_all();
    forget_keyframes();
}

void LodSprite::Impl::begin_frame(const View& view, const Motion& how) noexcept {
    FARFIELD_ASSERT(farfield::validate(view).has_value());
    clear(plan);
    plan.cache = options.cache_id;
    plan.origin = hierarchy->origin;
    statistics = {};
    ++frame_number;
    shown_count = 0;
    motion = how;
    store.write_pending_updates(plan.pages);
    follow_world();

    threshold_rad = metric::angle_of_pixels(view, options.error_px, options.conversion);
    frustum = make_frustum(view, hierarchy->origin);
    now.view = &view;
    now.camera = make_image_camera(view, hierarchy->origin);
    now.surveyed = false;
    visible.clear();
    visible_models.clear();
    for (std::size_t i = 0; i < models.size(); ++i) {
        if (models[i].active && classify(frustum, models[i].box) != Overlap::outside) {
            visible.push_back({models[i].pair, models[i].offset});
            visible_models.push_back(static_cast<std::uint32_t>(i));
        }
    }
}

template <typename UseItem, typename UsePiece>
void LodSprite::Impl::for_contents(
    std::uint32_t index,
    const Frustum& within,
    const glm::vec3& eye,
    bool of_models,
    const UseItem& use_item,
    const UsePiece& use_piece
) const noexcept {
    if ((of_models ? has_models : has_others)[index] == 0) {
        return;
    }
    const HierarchyNode& node = hierarchy->nodes[index];
    const bool items =
        !is_empty(node.items_box) && classify(within, node.items_box) != Overlap::outside;
    const bool pieces = node.piece_count > 0 &&
                        classify(within, whole_pieces_box(*hierarchy, index)) != Overlap::outside;
    if (!items && !pieces) {
        return;
    }
    if (!is_leaf(node)) {
        const unsigned first =
            options.order == GeometryOrder::front_to_back ? 1U - far_child(node, eye) : 0U;
        for (const unsigned child : {first, 1U - first}) {
            for_contents(node.first_child + child, within, eye, of_models, use_item, use_piece);
        }
        return;
    }
    for (std::uint32_t k = 0; items && k < node.item_count; ++k) {
        const std::uint32_t place = node.first_item + k;
        const ItemId item = hierarchy->items[place];
        if (item != kNone<ItemId> && is_model(item) == of_models) {
            use_item(node, place);
        }
    }
    for (std::uint32_t k = 0; pieces && k < node.piece_count; ++k) {
        const Piece& piece = hierarchy->pieces[node.first_piece + k];
        if (is_model(piece.item) == of_models) {
            use_piece(node, piece);
        }
    }
}

void LodSprite::Impl::write_contents(
    const Frustum& within, const glm::vec3& eye, bool of_models
) noexcept {
    for_contents(
        0,
        within,
        eye,
        of_models,
        [&](const HierarchyNode& /*node*/, std::uint32_t place) {
            writer.item(hierarchy->items[place]);
        },
        [&](const HierarchyNode& /*node*/, const Piece& piece) {
            writer.piece(piece, Command::kNoClip);
        }
    );
}

Work LodSprite::Impl::work_within(const Frustum& within) const noexcept {
    Work work;
    for_contents(
        0,
        within,
        now.camera.eye,
        true,
        [&](const HierarchyNode& node, std::uint32_t place) {
            work.primitives += primitives_of(node, place);
            ++work.draws;
        },
        [&](const HierarchyNode& /*node*/, const Piece& piece) {
            work.primitives += piece.count;
            ++work.draws;
        }
    );
    return work;
}

void LodSprite::Impl::look(Seen& seen) noexcept {
    if (!seen.surveyed) {
        seen.survey.look(survey_models, seen.camera);
        seen.surveyed = true;
    }
}

SpriteEyes
LodSprite::Impl::eyes_of(const Model& model, const View& drawn, const View& seen) const noexcept {
    const glm::dvec3& origin = model.pair->origin;
    return {
        local_point(drawn.eye, origin),
        local_point(seen.eye, origin),
        make_frustum(drawn, origin),
        make_frustum(seen, origin)};
}

double LodSprite::Impl::error_of(
    const View& drawn, const View& seen, SpriteCriterion criterion, double ignore_rad
) noexcept {
    double largest = criterion == SpriteCriterion::largest ? ignore_rad : 0.0;
    double squares = 0.0;
    std::uint64_t count = 0;
    for (const std::uint32_t index : visible_models) {
        const Model& model = models[index];
        const SpriteEyes eyes = eyes_of(model, drawn, seen);
        SpriteError error;
        if (criterion == SpriteCriterion::largest) {
            error = sprite_error::largest(*model.pair, eyes, static_cast<float>(largest));
            largest = std::max(largest, error.largest_rad);
        } else {
            error = options.paper_theta ? sprite_error::paper(*model.pair, eyes, model.middles)
                                        : sprite_error::rms(*model.pair, eyes, kMostSamples);
            squares += error.rms_rad * error.rms_rad * error.samples;
            count += error.samples;
        }
        statistics.samples += error.samples;
        statistics.nodes += error.nodes;
    }
    if (criterion == SpriteCriterion::largest) {
        return largest;
    }
    return count == 0 ? 0.0 : std::sqrt(squares / static_cast<double>(count));
}

bool LodSprite::Impl::is_right(double error_rad) const noexcept {
    // Below, as the paper has it; a bound may be reached.
    return options.criterion == SpriteCriterion::rms ? error_rad < threshold_rad
                                                     : error_rad <= threshold_rad;
}

bool LodSprite::Impl::loses(
    const KeyframeSlot& slot, const SurveyPoint& point, const ImageCamera& camera
) const noexcept {
    const ImageCamera& from = slot.camera;
    const glm::vec3 drawn = point.point - from.eye;
    const float drawn_depth = glm::dot(drawn, from.forward);
    const Lens& lens = from.view.lens;
    if (drawn_depth <= static_cast<float>(lens.near_distance) ||
        drawn_depth >= static_cast<float>(lens.far_distance)) {
        return true;
    }
    const double x = double{glm::dot(drawn, from.right) / drawn_depth};
    const double y = double{glm::dot(drawn, from.up) / drawn_depth};
    if (x < lens.left || x > lens.right || y < lens.bottom || y > lens.top ||
        slot.depths.hides(point, from)) {
        return true;
    }
    const glm::vec3 seen = point.point - camera.eye;
    const float seen_depth = glm::dot(seen, camera.forward);
    const float drawn_distance = glm::length(drawn);
    const float seen_distance = glm::length(seen);
    if (seen_depth <= 0.0F || seen_distance <= 0.0F) {
        return false;
    }
    const float drawn_cosine = std::abs(glm::dot(point.normal, drawn)) / drawn_distance;
    const float seen_cosine = std::abs(glm::dot(point.normal, seen)) / seen_distance;
    const float texel_px = camera.pixels_per_tangent_y / from.pixels_per_tangent_y * drawn_depth /
                           seen_depth *
                           std::max(seen_cosine / std::max(drawn_cosine, kLeastTexelCosine), 1.0F);
    if (double{texel_px} > options.max_texel_px) {
        return true;
    }
    if (!options.guaranteed) {
        return false;
    }
    const float offset = point.height / std::max(drawn_cosine, kLeastCosine);
    return double{metric::sprite_angle_unchecked(from.eye, camera.eye, point.point, offset)} >
           threshold_rad;
}

LodSprite::Impl::Judgement LodSprite::Impl::judge(std::uint32_t index, Seen& seen) noexcept {
    KeyframeSlot& slot = store.slot(index);
    Judgement judgement;
    judgement.right = true;
    if (!options.guaranteed) {
        judgement.error_rad =
            error_of(slot.camera.view, *seen.view, options.criterion, kSmallError * threshold_rad);
        judgement.right = is_right(judgement.error_rad);
    }
    slot.lost.clear();
    if (judgement.right && surveys()) {
        look(seen);
        float lost = 0.0F;
        for (const SurveyPoint& point : seen.survey.points()) {
            const bool gone = point.weight > 0.0F && loses(slot, point, seen.camera);
            slot.lost.push_back(gone ? 1 : 0);
            lost += gone ? point.weight : 0.0F;
        }
        const float total = seen.survey.total_weight();
        judgement.lost = total > 0.0F ? lost / total : 0.0F;
    }
    return judgement;
}

float LodSprite::Impl::lost_with(std::uint32_t index) const noexcept {
    const std::span<const SurveyPoint> points = now.survey.points();
    float lost = 0.0F;
    for (std::size_t i = 0; i < points.size(); ++i) {
        bool gone = store.slot(index).lost[i] != 0;
        for (std::uint32_t k = 0; gone && k < shown_count; ++k) {
            gone = store.slot(shown[k]).lost[i] != 0;
        }
        lost += gone ? points[i].weight : 0.0F;
    }
    const float total = now.survey.total_weight();
    return total > 0.0F ? lost / total : 0.0F;
}

/// Adds keyframes to the first one while they serve more of the picture; true where the picture is
/// served well enough.
bool LodSprite::Impl::complete_choice(std::uint32_t first, double patience) noexcept {
    shown[0] = first;
    shown_count = 1;
    if (!surveys()) {
        return true;
    }
    float lost = store.slot(first).judged_lost;
    while (shown_count < options.keyframes_shown && lost > kFewLost) {
        std::optional<std::uint32_t> best;
        float least = lost - kFewLost;
        for (std::uint32_t i = 0; i < store.count(); ++i) {
            const KeyframeSlot& slot = store.slot(i);
            if (slot.state != KeyframeState::ready || slot.judged_frame != frame_number ||
                !slot.judged_right) {
                continue;
            }
            const float with = lost_with(i);
            if (with < least) {
                least = with;
                best = i;
            }
        }
        if (!best) {
            break;
        }
        shown[shown_count++] = *best;
        lost = least;
    }
    statistics.own_share = double{lost};
    return serves(lost, patience);
}

/// Finds the keyframes for the view; false where none serves.
bool LodSprite::Impl::choose(double patience) noexcept {
    const auto judge_now = [&](std::uint32_t index) {
        KeyframeSlot& slot = store.slot(index);
        if (slot.judged_frame != frame_number) {
            const Judgement judgement = judge(index, now);
            slot.judged_frame = frame_number;
            slot.judged_rad = judgement.error_rad;
            slot.judged_lost = judgement.lost;
            slot.judged_right = judgement.right;
        }
        return slot.judged_right;
    };
    if (successor && judge_now(*successor) && serves(store.slot(*successor).judged_lost)) {
        current = successor;
    }
    successor.reset();
    if (current && judge_now(*current) &&
        (options.keyframes_shown == 1 || store.slot(*current).judged_lost <= kFewLost) &&
        complete_choice(*current, patience)) {
        return true;
    }
    for (std::uint32_t i = 0; i < store.count(); ++i) {
        if (store.slot(i).state == KeyframeState::ready) {
            judge_now(i);
        }
    }
    // The one in use stays first while it serves most of the picture.
    if (current && store.slot(*current).judged_right &&
        store.slot(*current).judged_lost <= kMostlyLost && complete_choice(*current, patience)) {
        return true;
    }
    std::optional<std::uint32_t> best;
    double least = std::numeric_limits<double>::infinity();
    for (std::uint32_t i = 0; i < store.count(); ++i) {
        const KeyframeSlot& slot = store.slot(i);
        if (slot.state != KeyframeState::ready || !slot.judged_right) {
            continue;
        }
        const double share = options.max_own_share > 0.0
                                 ? double{slot.judged_lost} / options.max_own_share
                                 : double{slot.judged_lost};
        const double score = slot.judged_rad / threshold_rad + share;
        if (score < least) {
            least = score;
            best = i;
        }
    }
    if (best && complete_choice(*best, patience)) {
        statistics.keyframes_reused += best == current ? 0U : 1U;
        current = best;
        return true;
    }
    shown_count = 0;
    statistics.own_share = 0.0;
    return false;
}

View LodSprite::Impl::foreseen(const View& view, double frames) const noexcept {
    View then = view;
    const double seconds = frames * motion.frame_seconds;
    const glm::dvec3 straight = motion.velocity * seconds;
    const glm::dvec3 bend = 0.5 * motion.acceleration * (seconds * seconds);
    // Who has just set out seems to go faster and faster: a way bends, but does not run away.
    const double most = kMostBend * glm::length(straight);
    const double length = glm::length(bend);
    then.eye += straight + (length > most ? bend * (most / length) : bend);
    if (!last_rotation) {
        return then;
    }
    const glm::dmat3 turn = view.camera_to_world * glm::transpose(*last_rotation);
    const glm::dvec3 axis(
        turn[1][2] - turn[2][1], turn[2][0] - turn[0][2], turn[0][1] - turn[1][0]
    );
    const double twice_sine = glm::length(axis);
    if (twice_sine > 0.0) {
        const double twice_cosine = turn[0][0] + turn[1][1] + turn[2][2] - 1.0;
        const double angle = std::min(std::atan2(twice_sine, twice_cosine) * frames, kMostTurn);
        then.camera_to_world = rotation(axis / twice_sine, angle) * view.camera_to_world;
    }
    return then;
}

/// Whether a keyframe made now would save more than it costs, by the motion and by how those before
/// it fared.
bool LodSprite::Impl::pays(const View& view) noexcept {
    if (!options.never_slower) {
        return true;
    }
    const CostModel& costs = options.costs;
    const View wide = widened(view, options.keyframe_margin);
    const Work fine = work_within(frustum);
    const Work wide_fine = wide == view ? fine : work_within(make_frustum(wide, hierarchy->origin));
    const double pixels = static_cast<double>(view.width) * view.height;
    std::uint64_t coarse = 0;
    for (std::size_t i = 0; i < visible_models.size(); ++i) {
        const Model& model = models[visible_models[i]];
        coarse +=
            options.refine && is_refinable(*model.pair) ? model.pair->root_count : model.coarse;
    }
    const double fine_s = geometry_cost(costs, fine.primitives, fine.draws);
    const double shown_s =
        geometry_cost(costs, coarse, visible.size()) + costs.image_pixel_s * pixels;
    const double wide_s = geometry_cost(costs, wide_fine.primitives, wide_fine.draws);
    const std::uint64_t texels =
        static_cast<std::uint64_t>(wide.width) * static_cast<std::uint64_t>(wide.height);
    const double made_s = creation_cost(costs, wide_s, texels) + image_cost(costs, pixels);
    const double saved_s = fine_s - shown_s;
    if (!(saved_s > 0.0)) {
        return false;
    }
    // The first frame costs what making takes, each one after it saves.
    const double least_life = 1.0 + std::ceil(std::max(made_s - fine_s, 0.0) / saved_s);
    if (current) {
        const auto life = static_cast<double>(frame_number - store.slot(*current).made_frame);
        short_lives = life < least_life ? short_lives + 1 : 0;
        if (short_lives >= kShortLives) {
            resume_frame = frame_number + (std::uint64_t{1} << std::min(short_lives, kMostPause));
        }
        current.reset();
    }
    if (frame_number < resume_frame) {
        return false;
    }
    const View then = foreseen(view, least_life - 1.0);
    const SpriteCriterion criterion = options.guaranteed ? SpriteCriterion::rms : options.criterion;
    return is_right(error_of(wide, then, criterion, kSmallError * threshold_rad));
}

void LodSprite::Impl::begin_keyframe(KeyframeSlot& slot, const View& view) noexcept {
    const View wide = widened(view, options.keyframe_margin);
    slot.state = KeyframeState::building;
    slot.frame_view = view;
    slot.camera = make_image_camera(wide, hierarchy->origin);
    slot.tiles = 0;
    const Frustum within = make_frustum(wide, hierarchy->origin);
    float nearest = std::numeric_limits<float>::infinity();
    float farthest = 0.0F;
    for (const Model& model : models) {
        if (model.active && classify(within, model.box) != Overlap::outside) {
            nearest = std::min(nearest, nearest_depth(model.box, slot.camera));
            farthest = std::max(farthest, farthest_depth(model.box, slot.camera));
        }
    }
    const auto lens_near = static_cast<float>(wide.lens.near_distance);
    const auto lens_far = static_cast<float>(wide.lens.far_distance);
    slot.copy_near = std::clamp(nearest, lens_near, lens_far);
    // Where there is nothing in view, as may be foreseen, any depths do.
    slot.copy_far = std::clamp(farthest, slot.copy_near, lens_far);
    slot.copy_far += kDepthMargin * std::max(slot.copy_far - slot.copy_near, slot.copy_near);
    if (surveys()) {
        made_survey.look(survey_models, slot.camera);
        slot.depths = made_survey.depths();
    }
}

void LodSprite::Impl::write_keyframe_pass(
    KeyframeSlot& slot, const Region& part, std::uint32_t batch
) noexcept {
    const View& view = slot.camera.view;
    View tile = view;
    tile.lens = sub_lens(view, part.x, part.y, part.x + part.width, part.y + part.height);
    writer.open();
    write_contents(make_frustum(tile, hierarchy->origin), slot.camera.eye, true);
    Pass pass;
    pass.page = store.scratch_page();
    pass.viewport = {0, 0, view.width, view.height};
    pass.scissor = part;
    pass.view = view;
    pass.batch = batch;
    pass.copy_page = slot.page;
    pass.copy = part;
    pass.copy_near = slot.copy_near;
    pass.copy_far = slot.copy_far;
    pass.node = kKeyframeNode;
    writer.close(pass);
    statistics.texels_created += area(part);
}

void LodSprite::Impl::finish_keyframe(KeyframeSlot& slot) noexcept {
    slot.state = KeyframeState::ready;
    slot.made_frame = frame_number;
    slot.used_frame = frame_number;
    slot.judged_frame = 0;
}

void LodSprite::Impl::make_at_once(const View& view) noexcept {
    if (building) {
        store.release(*building);
        building.reset();
    }
    // No keyframe is used in this frame, so there is a place.
    const std::uint32_t index =
        store.take(frame_number, plan.pages, statistics.keyframes_evicted).value_or(0U);
    KeyframeSlot& slot = store.slot(index);
    begin_keyframe(slot, view);
    slot.whole = true;
    write_keyframe_pass(
        slot, {0, 0, slot.camera.view.width, slot.camera.view.height}, next_batch()
    );
    finish_keyframe(slot);
    current = index;
    ++statistics.keyframes_made;
}

void LodSprite::Impl::make_tile() noexcept {
    KeyframeSlot& slot = store.slot(*building);
    const View& view = slot.camera.view;
    const std::int32_t left = tile_edges[slot.tiles];
    const std::int32_t right = tile_edges[slot.tiles + 1];
    ++slot.tiles;
    if (right > left) {
        write_keyframe_pass(slot, {left, 0, right - left, view.height}, 0);
        ++statistics.tiles_made;
    }
    if (slot.tiles < options.keyframe_tiles) {
        return;
    }
    finish_keyframe(slot);
    ++statistics.keyframes_predicted;
    // Which of the two is better where the eye goes is for `choose` to find out; here, whether it
    // is worth asking at once rather than when the one in use fails.
    successor.reset();
    if (current && !options.guaranteed) {
        const View then = foreseen(*now.view, options.predict_frames / 2.0);
        const double ignore = kSmallError * threshold_rad;
        const double new_rad = error_of(view, then, options.criterion, ignore);
        const View& in_use = store.slot(*current).camera.view;
        if (new_rad < error_of(in_use, then, options.criterion, ignore)) {
            successor = building;
        }
    }
    building.reset();
}

/// Divides a keyframe into columns, each with about as many triangles as any other.
void LodSprite::Impl::place_tiles(const KeyframeSlot& slot) noexcept {
    constexpr std::size_t kBins = 128;
    std::array<std::uint64_t, kBins> bins{};
    const ImageCamera& camera = slot.camera;
    const Lens& lens = camera.view.lens;
    const auto bin_of = [&](const Box3f& box) {
        const glm::vec3 offset = center(box) - camera.eye;
        const double depth = double{glm::dot(offset, camera.forward)};
        // What is beside the eye is in view on one side or the other: it is near, and seldom much.
        const double tangent =
            double{glm::dot(offset, camera.right)} / std::max(depth, lens.near_distance);
        const double part = (tangent - lens.left) / (lens.right - lens.left);
        return static_cast<std::size_t>(std::clamp(part, 0.0, 1.0) * (kBins - 1));
    };
    for_contents(
        0,
        make_frustum(camera.view, hierarchy->origin),
        camera.eye,
        true,
        [&](const HierarchyNode& node, std::uint32_t place) {
            bins[bin_of(node.items_box)] += primitives_of(node, place);
        },
        [&](const HierarchyNode& node, const Piece& piece) {
            bins[bin_of(node.pieces_box)] += piece.count;
        }
    );
    std::uint64_t all = 0;
    for (const std::uint64_t count : bins) {
        all += count;
    }
    const std::uint64_t tiles = options.keyframe_tiles;
    const auto width = static_cast<std::uint64_t>(camera.view.width);
    std::uint64_t sum = 0;
    std::size_t bin = 0;
    for (std::uint64_t tile = 0; tile <= tiles; ++tile) {
        while (bin < kBins && sum * tiles < all * tile) {
            sum += bins[bin++];
        }
        const std::uint64_t edge = tile == tiles ? width : width * bin / kBins;
        tile_edges[tile] = static_cast<std::int32_t>(edge);
    }
}

/// Makes what is left of a foreseen keyframe that is right already, where it is needed earlier than
/// was foreseen; false where there is none.
bool LodSprite::Impl::finish_early() noexcept {
    if (!building) {
        return false;
    }
    const Judgement judgement = judge(*building, now);
    if (!judgement.right || !serves(judgement.lost)) {
        return false;
    }
    while (building) {
        make_tile();
    }
    return true;
}

/// Begins the next keyframe where none that there is will serve the view that is foreseen.
/// @param late it is needed now: it is made twice as fast, for where the eye is when it is done
void LodSprite::Impl::foresee(const View& view, bool late) noexcept {
    // Tiles that were finished early lie where those of another keyframe would.
    if (options.predict_frames == 0 || store.count() < 2 || statistics.tiles_made > 0) {
        return;
    }
    if (building) {
        make_tile();
        if (late && building) {
            make_tile();
        }
        return;
    }
    const double horizon = late ? options.keyframe_tiles / 2.0 : options.predict_frames;
    const View then = foreseen(view, horizon);
    ahead.view = &then;
    ahead.camera = make_image_camera(then, hierarchy->origin);
    ahead.surveyed = false;
    for (std::uint32_t i = 0; i < store.count(); ++i) {
        if (store.slot(i).state != KeyframeState::ready) {
            continue;
        }
        const Judgement judgement = judge(i, ahead);
        store.slot(i).judged_frame = 0;
        if (judgement.right && serves(judgement.lost)) {
            return;
        }
    }
    building = store.take(frame_number, plan.pages, statistics.keyframes_evicted);
    if (building) {
        KeyframeSlot& slot = store.slot(*building);
        begin_keyframe(slot, best_place(view, then, horizon));
        place_tiles(slot);
        slot.whole = false;
        make_tile();
    }
}

/// Where a keyframe is best drawn from that takes over at the view `then`: as far ahead of it as
/// it is right there with something to spare, so that it serves before and behind its place.
View LodSprite::Impl::best_place(const View& view, const View& then, double horizon) noexcept {
    double beyond = kFarthestAhead;
    for (int halving = 0; halving < kHalvings; ++halving, beyond /= 2.0) {
        const View place = foreseen(view, horizon * (1.0 + beyond));
        const View wide = widened(place, options.keyframe_margin);
        if (error_of(wide, then, life_criterion(), 0.0) <= kSpare * threshold_rad) {
            return place;
        }
    }
    return then;
}

void LodSprite::Impl::write_geometry_frame(const View& view, SpriteRefusal refusal) noexcept {
    writer.open();
    write_geometry(*hierarchy, frustum, now.camera.eye, options.order, writer);
    writer.close(frame_pass(view, next_batch()));
    statistics.frame = SpriteFrame::geometry;
    statistics.refusal = refusal;
}

void LodSprite::Impl::write_image_frame(const View& view, std::uint32_t index) noexcept {
    KeyframeSlot& slot = store.slot(index);
    slot.used_frame = frame_number;
    const ImageCamera& camera = slot.camera;
    const Lens& lens = camera.view.lens;
    // The plane is of no account but for rounding: so far away that the eye's digits are less than
    // those of a pixel.
    const float most = 16.0F * glm::length(camera.eye);
    const float plane = std::clamp(
        std::max(most, 1.0F),
        static_cast<float>(lens.near_distance),
        static_cast<float>(lens.far_distance)
    );
    ImageQuad quad;
    quad.page = slot.page;
    quad.node = kKeyframeNode;
    quad.source = {0, 0, camera.view.width, camera.view.height};
    quad.origin =
        camera.eye + plane * (camera.forward + static_cast<float>(lens.left) * camera.right +
                              static_cast<float>(lens.bottom) * camera.up);
    quad.edge_u = plane * static_cast<float>(lens.right - lens.left) * camera.right;
    quad.edge_v = plane * static_cast<float>(lens.top - lens.bottom) * camera.up;
    // Just behind the near plane at the nearest, or rounding would clip the quad.
    const float nearest = static_cast<float>(lens.near_distance) * 1.0001F;
    const auto farthest = static_cast<float>(lens.far_distance);
    quad.depth = std::min(std::max(slot.copy_near, nearest), farthest);
    quad.viewpoint = camera.eye;
    quad.near_ratio = slot.copy_near / plane;
    quad.far_ratio = slot.copy_far / plane;
    const bool alone = has_others[0] == 0 && hierarchy->moving.empty();
    const QuadDepth depth = alone ? QuadDepth::none : QuadDepth::texel;
    writer.open();
    writer.image(quad, depth);
    if (!alone) {
        writer.image_depths(plan.quads.size() - 1, depth);
        write_contents(frustum, now.camera.eye, false);
        write_moving(*hierarchy, frustum, writer);
    }
    writer.close(frame_pass(view, next_batch()));
    statistics.frame = SpriteFrame::image;
    statistics.keyframes_shown = 1;
}

/// Cuts what can be refined for the keyframes chosen; false where a cut is coarser than allowed.
bool LodSprite::Impl::cut_models() noexcept {
    cuts.clear();
    std::size_t left = options.max_triangles;
    bool fine_enough = true;
    for (const std::uint32_t index : visible_models) {
        const Model& model = models[index];
        Cut cut;
        cut.first = static_cast<std::uint32_t>(plan.selected.size());
        cut.offset_m = model.offset_m;
        cut.count = model.coarse;
        if (options.refine && is_refinable(*model.pair)) {
            cut_eyes.clear();
            // Where every fragment is held to the threshold, a second keyframe fills holes as well
            // as it can: it may be from far off, and would ask for the finest cut.
            const std::uint32_t held = options.guaranteed ? 1U : shown_count;
            for (std::uint32_t k = 0; k < held; ++k) {
                cut_eyes.push_back(store.slot(shown[k]).camera.view.eye - model.pair->origin);
            }
            CutQuery query;
            query.frustum = make_frustum(*now.view, model.pair->origin);
            query.seen_from = now.view->eye - model.pair->origin;
            query.drawn_from = cut_eyes;
            query.threshold_rad = options.refine_share * threshold_rad;
            query.most = std::max<std::size_t>(left, 1);
            cut = cut_coarse(*model.pair, query, plan.selected);
            left -= std::min(left, cut.count);
            fine_enough = fine_enough && cut.complete &&
                          (options.guaranteed || cut.threshold_rad <= threshold_rad);
        } else if (is_refinable(*model.pair)) {
            cut.count = finest_triangles(
                *model.pair, make_frustum(*now.view, model.pair->origin), plan.selected
            );
        }
        cuts.push_back(cut);
    }
    return fine_enough;
}

/// Sorts selections by the keyframe that serves what is there as well as all that are shown: every
/// keyframe that a fragment tries costs as much as the first.
void LodSprite::Impl::group_triangles() noexcept {
    groups.assign(visible.size(), Groups{});
    const std::uint32_t all = shown_count > 1 ? shown_count : 0;
    if (all > 0) {
        mask.clear();
        const std::span<const SurveyPoint> points = now.survey.points();
        const unsigned none_left = (1U << shown_count) - 1U;
        for (std::size_t i = 0; i < points.size(); ++i) {
            unsigned losing = 0;
            for (std::uint32_t k = 0; k < shown_count; ++k) {
                losing |= store.slot(shown[k]).lost[i] != 0 ? 1U << k : 0U;
            }
            if (losing != 0 && losing != none_left) {
                mask.add(points[i], static_cast<std::uint8_t>(losing), now.camera);
            }
        }
    }
    for (std::size_t i = 0; i < visible.size(); ++i) {
        const ProxyPair& pair = *visible[i].pair;
        const auto count = static_cast<std::uint32_t>(cuts[i].count);
        if (all == 0 || !is_refinable(pair)) {
            groups[i][all] = count;
            continue;
        }
        const auto begin = plan.selected.begin() + static_cast<std::ptrdiff_t>(cuts[i].first);
        sorted.assign(begin, begin + static_cast<std::ptrdiff_t>(count));
        group_of.clear();
        for (const std::uint32_t triangle : sorted) {
            const ProxySplit& split = pair.splits[triangle];
            const unsigned losing =
                mask.bits(split.center + visible[i].offset, split.radius, now.camera);
            const auto group = static_cast<std::uint8_t>(std::countr_one(losing));
            group_of.push_back(group);
            ++groups[i][group];
        }
        Groups next{};
        std::exclusive_scan(groups[i].begin(), groups[i].end(), next.begin(), cuts[i].first);
        for (std::uint32_t k = 0; k < count; ++k) {
            plan.selected[next[group_of[k]]++] = sorted[k];
        }
    }
}

/// The visible models `first` to `last`, in a command for each group.
void LodSprite::Impl::write_projected(std::size_t first, std::size_t last) noexcept {
    float offset_m = 0.0F;
    for (std::size_t i = first; i < last; ++i) {
        offset_m = std::max(offset_m, cuts[i].offset_m);
        statistics.coarse_triangles += cuts[i].count;
    }
    const std::uint32_t all = shown_count > 1 ? shown_count : 0;
    for (std::uint32_t group = 0; group <= all; ++group) {
        write_group(first, last, group, offset_m);
    }
}

void LodSprite::Impl::write_group(
    std::size_t first, std::size_t last, std::uint32_t group, float offset_m
) noexcept {
    Command command;
    command.kind = Command::Kind::projected;
    command.first = static_cast<std::uint32_t>(plan.items.size());
    command.first_piece = static_cast<std::uint32_t>(plan.pieces.size());
    command.first_selection = static_cast<std::uint32_t>(plan.selections.size());
    command.first_keyframe = static_cast<std::uint32_t>(plan.keyframes.size());
    command.whole_triangles = options.visibility == SpriteVisibility::triangles;
    for (std::size_t i = first; i < last; ++i) {
        const ProxyPair& pair = *visible[i].pair;
        const std::uint32_t count = groups[i][group];
        if (count == 0) {
            continue;
        }
        if (is_refinable(pair)) {
            const auto begin = groups[i].begin();
            const std::uint32_t before = std::accumulate(begin, begin + group, 0U);
            plan.selections.push_back({pair.coarse, cuts[i].first + before, count});
            ++command.selection_count;
        } else {
            plan.items.push_back(pair.coarse);
            ++command.count;
        }
    }
    if (command.count == 0 && command.selection_count == 0) {
        return;
    }
    const bool is_one = group < shown_count;
    command.keyframe_count = is_one ? 1U : shown_count;
    for (std::uint32_t k = 0; k < command.keyframe_count; ++k) {
        const KeyframeSlot& slot = store.slot(shown[is_one ? group : k]);
        Keyframe keyframe;
        keyframe.page = slot.page;
        keyframe.node = kKeyframeNode;
        keyframe.source = {0, 0, slot.camera.view.width, slot.camera.view.height};
        keyframe.view = slot.camera.view;
        keyframe.copy_near = slot.copy_near;
        keyframe.copy_far = slot.copy_far;
        keyframe.offset_m = offset_m;
        if (options.guaranteed) {
            keyframe.max_shift_px = static_cast<float>(options.error_px);
        }
        plan.keyframes.push_back(keyframe);
    }
    plan.commands.push_back(command);
}

void LodSprite::Impl::write_projected_frame(const View& view) noexcept {
    group_triangles();
    writer.open();
    for (std::size_t first = 0; first < visible.size();) {
        std::size_t last = first + 1;
        while (last < visible.size() &&
               cuts[last].offset_m <= kSameOffset * std::max(cuts[first].offset_m, 1e-6F)) {
            ++last;
        }
        write_projected(first, last);
        first = last;
    }
    write_contents(frustum, now.camera.eye, false);
    write_moving(*hierarchy, frustum, writer);
    writer.close(frame_pass(view, next_batch()));
    statistics.frame = SpriteFrame::projected;
    statistics.keyframes_shown = shown_count;
    statistics.error_px = options.guaranteed
                              ? 0.0
                              : options.error_px * store.slot(shown[0]).judged_rad / threshold_rad;
}

void LodSprite::Impl::report() noexcept {
    statistics.keyframes_kept = store.ready();
    statistics.image_bytes = store.bytes();
    statistics.image_bytes_peak = store.bytes_peak();
}

void LodSprite::Impl::run(const View& view) noexcept {
    if (visible.empty()) {
        write_geometry_frame(view, SpriteRefusal::empty);
        return;
    }
    const View wide = widened(view, options.keyframe_margin);
    if (!store.fit(wide.width, wide.height)) {
        forget_keyframes();
        store.write_pending_updates(plan.pages);
    }
    if (store.count() == 0) {
        write_geometry_frame(view, SpriteRefusal::memory);
        return;
    }
    for (std::uint32_t i = 0; i < store.count(); ++i) {
        const KeyframeSlot& slot = store.slot(i);
        if (slot.state == KeyframeState::ready && slot.whole && slot.frame_view == view) {
            statistics.keyframes_reused += current == i ? 0U : 1U;
            current = i;
            write_image_frame(view, i);
            return;
        }
    }
    const double corner =
        metric::pixel_scale(view.lens, view.width, view.height).scale.corner_tangent;
    const auto margin = static_cast<float>(view.lens.near_distance * std::hypot(1.0, corner));
    const bool near = std::any_of(visible.begin(), visible.end(), [&](const SurveyModel& model) {
        return sprite_error::is_near(
            *model.pair, local_point(view.eye, model.pair->origin), margin
        );
    });
    if (near) {
        write_geometry_frame(view, SpriteRefusal::near);
        return;
    }
    const bool served = choose(1.0);
    if (served || (may_wait() && choose(kPatience)) || (finish_early() && choose(1.0))) {
        if (cut_models()) {
            for (std::uint32_t k = 0; k < shown_count; ++k) {
                store.slot(shown[k]).used_frame = frame_number;
            }
            foresee(view, !served);
            write_projected_frame(view);
            return;
        }
        plan.selected.clear();
        shown_count = 0;
        statistics.own_share = 0.0;
    }
    if (!pays(view)) {
        write_geometry_frame(view, SpriteRefusal::too_dear);
        return;
    }
    make_at_once(view);
    write_image_frame(view, *current);
}

void LodSprite::Impl::forget_keyframes() noexcept {
    current.reset();
    successor.reset();
    building.reset();
}

namespace {

std::string name_of(std::size_t pair) {
    return "lod sprite: pair " + std::to_string(pair);
}

/// Checks pairs against each other and the hierarchy.
Result<void> check_items(const Hierarchy& hierarchy, std::span<const ProxyPair> pairs) {
    std::vector<ItemId> held;
    for (const ItemId item : hierarchy.items) {
        held.push_back(item);
    }
    for (const Piece& piece : hierarchy.pieces) {
        held.push_back(piece.item);
    }
    for (const MovingItem& moving : hierarchy.moving) {
        held.push_back(moving.item);
    }
    std::sort(held.begin(), held.end());
    const auto holds = [&](ItemId item) {
        return std::binary_search(held.begin(), held.end(), item);
    };
    std::vector<ItemId> seen;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        const std::string fine = std::to_string(index_of(pairs[i].fine));
        const std::string coarse = std::to_string(index_of(pairs[i].coarse));
        if (!holds(pairs[i].fine)) {
            return fail(
                ErrorCode::invalid_argument,
                name_of(i) + ": fine is item " + fine + ", which the hierarchy does not hold"
            );
        }
        if (holds(pairs[i].coarse)) {
            return fail(
                ErrorCode::invalid_argument,
                name_of(i) + ": coarse is item " + coarse +
                    ", which the hierarchy holds; coarse models do not belong into it"
            );
        }
        if (std::find(seen.begin(), seen.end(), pairs[i].fine) != seen.end()) {
            return fail(
                ErrorCode::invalid_argument,
                name_of(i) + ": fine is item " + fine + ", which has a pair already"
            );
        }
        seen.push_back(pairs[i].fine);
    }
    return {};
}

} // namespace

Result<LodSprite> LodSprite::create(
    const Hierarchy& hierarchy, std::span<const ProxyPair> pairs, const LodSpriteOptions& options
) {
    if (Result<void> valid = validate(options); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    if (hierarchy.nodes.empty()) {
        return fail(ErrorCode::invalid_argument, "lod sprite: the hierarchy has no nodes");
    }
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        if (Result<void> valid = validate(pairs[i]); !valid) {
            return fail(valid.error().code, name_of(i) + ": " + valid.error().message);
        }
    }
    if (Result<void> valid = check_items(hierarchy, pairs); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    return LodSprite(std::make_unique<Impl>(hierarchy, pairs, options));
}

LodSprite::LodSprite(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
LodSprite::LodSprite(LodSprite&& other) noexcept = default;
LodSprite& LodSprite::operator=(LodSprite&& other) noexcept = default;
LodSprite::~LodSprite() = default;

const FramePlan& LodSprite::plan(const View& view, const Motion& motion) noexcept {
    impl_->begin_frame(view, motion);
    impl_->run(view);
    impl_->last_rotation = view.camera_to_world;
    impl_->report();
    return impl_->plan;
}

void LodSprite::forget_images() noexcept {
    impl_->store.forget();
    impl_->forget_keyframes();
}

void LodSprite::set_appearance(std::uint64_t version) noexcept {
    impl_->appearance = version;
}

const LodSpriteStatistics& LodSprite::statistics() const noexcept {
    return impl_->statistics;
}

} // namespace farfield
