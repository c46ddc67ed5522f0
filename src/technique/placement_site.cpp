#include "technique/placement_site.hpp"

#include "technique/placement_search.hpp"
#include <farfield/image/layered_depth_image.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace farfield {

namespace {

constexpr double kPi = std::numbers::pi;

/// A corner of a box, seen from an eye along the axes of a `YawFrame`.
struct Corner {
    double right = 0.0;
    double up = 0.0;
    double forward = 0.0;
};

std::array<Corner, 8>
corners_of(const YawFrame& frame, const glm::dvec3& lo, const glm::dvec3& hi) noexcept {
    std::array<Corner, 8> corners;
    for (unsigned i = 0; i < 8; ++i) {
        const glm::dvec3 at = corner(Box3d{lo, hi}, i);
        corners[i] = {
            glm::dot(at, frame.right), glm::dot(at, frame.up), glm::dot(at, frame.forward)};
    }
    return corners;
}

/// At which yaw which cells come into view or leave it.
struct YawEvent {
    double yaw = 0.0;
    bool enters = false;
    std::uint32_t cell = 0;
};

/// The views of a site: yaws between which the same cells are in view, and what that costs.
class SiteViews {
  public:
    SiteViews(const PlacementTask& task, const Box3d& eyes) {
        const glm::dvec3 middle = center(eyes) - task.origin;
        const glm::dvec3 half = extent(eyes) * 0.5 + task.margin;
        sets_.reserve(task.cells.size());
        for (std::size_t i = 0; i < task.cells.size(); ++i) {
            const Box3f& box = task.cells[i].box;
            sets_.push_back(directions_of(
                task, glm::dvec3(box.lo) - half - middle, glm::dvec3(box.hi) + half - middle
            ));
            const auto cell = static_cast<std::uint32_t>(i);
            for (const YawArc& arc : sets_.back().arcs()) {
                events_.push_back({arc.from, true, cell});
                // Seen up to pi: there is no view after it.
                if (arc.to < kPi) {
                    events_.push_back({arc.to, false, cell});
                }
            }
        }
        std::sort(events_.begin(), events_.end(), [](const YawEvent& a, const YawEvent& b) {
            return std::pair(a.yaw, a.cell) < std::pair(b.yaw, b.cell);
        });
        yaws_.push_back(-kPi);
        for (const YawEvent& event : events_) {
            if (event.yaw > yaws_.back()) {
                yaws_.push_back(event.yaw);
            }
        }
    }

    [[nodiscard]] std::size_t count() const noexcept { return yaws_.size(); }

    /// The first yaw of a view. @param view up to `count()`, where it is pi
    [[nodiscard]] double from(std::size_t view) const noexcept {
        return view < yaws_.size() ? yaws_[view] : kPi;
    }
    [[nodiscard]] double middle(std::size_t view) const noexcept {
        return 0.5 * from(view) + 0.5 * from(view + 1);
    }

    /// As `count_into` counts, however little two ends of arcs are apart.
    [[nodiscard]] bool sees(std::size_t view, std::size_t cell) const noexcept {
        const std::span<const YawArc> arcs = sets_[cell].arcs();
        return std::any_of(arcs.begin(), arcs.end(), [&](const YawArc& arc) {
            return arc.from <= yaws_[view] && (yaws_[view] < arc.to || arc.to == kPi);
        });
    }

    /// Primitives in each view but those of some cells.
    void count_into(
        std::span<const PlacementCell> cells,
        const std::vector<bool>& without,
        std::vector<std::uint64_t>& counts
    ) const {
        counts.assign(yaws_.size(), 0);
        std::uint64_t now = 0;
        std::size_t next = 0;
        for (std::size_t view = 0; view < yaws_.size(); ++view) {
            for (; next < events_.size() && events_[next].yaw <= yaws_[view]; ++next) {
                const YawEvent& event = events_[next];
                if (!without[event.cell]) {
                    const std::uint64_t primitives = cells[event.cell].primitives;
                    now = event.enters ? now + primitives : now - primitives;
                }
            }
            counts[view] = now;
        }
    }

  private:
    std::vector<YawSet> sets_; ///< by cell
    std::vector<YawEvent> events_;
    std::vector<double> yaws_; ///< ascending, the first is -pi
};

/// Makes the images of one site.
class SitePlacer {
  public:
    SitePlacer(const PlacementTask& task, const Box3d& eyes)
        : task_(task), middle_(center(eyes)), half_(extent(eyes) * 0.5), views_(task, eyes),
          without_(task.cells.size(), false) {}

    SitePlacement run() {
        SitePlacement placed;
        placed.views = views_.count();
        views_.count_into(task_.cells, without_, all_);
        left_ = all_;
        image_of_.assign(views_.count(), UINT32_MAX);
        const std::uint64_t most = task_.options.max_primitives;
        placed.worst_before = *std::max_element(all_.begin(), all_.end());
        while (true) {
            const auto worst = std::max_element(left_.begin(), left_.end());
            if (*worst <= most) {
                break;
            }
            const auto view = static_cast<std::size_t>(worst - left_.begin());
            if (!place_image(view, placed)) {
                placed.feasible = false;
                placed.yaw = views_.middle(view);
                return placed;
            }
        }
        placed.worst = *std::max_element(left_.begin(), left_.end());
        add_ranges(placed);
        return placed;
    }

  private:
    /// An image for a view, and for all others that are over the budget and within it with the
    /// image. False where it cannot be.
    bool place_image(std::size_t view, SitePlacement& placed) {
        const PlacementOptions& options = task_.options;
        const View central = level_view(
            task_.frame,
            middle_,
            views_.middle(view),
            0.0,
            {.lens = options.lens, .width = options.width, .height = options.height}
        );
        gather(central, view);
        std::uint64_t replaceable = 0;
        for (const SeenCell& cell : seen_) {
            replaceable += cell.primitives;
        }
        const std::uint64_t least = all_[view] - replaceable;
        if (least > options.max_primitives) {
            placed.nearby = least;
            return false;
        }
        SubsetTask search;
        search.cells = seen_;
        search.total = all_[view];
        search.target = std::max(*options.target_primitives, least);
        search.lens = options.lens;
        search.width = options.width;
        search.height = options.height;
        search.model_extent = task_.model_extent;
        search.weights = options.weights;
        search.lookahead = options.lookahead;
        const Subset subset = search_subset(search);

        const auto index = static_cast<std::uint32_t>(placed.images.size());
        add_image(central, subset, placed);
        const double remaining = static_cast<double>(all_[view] - subset.primitives);
        const auto target = static_cast<double>(search.target);
        placed.miss += std::abs(remaining - target) / std::max(target, 1.0);

        for (const std::uint32_t cell : subset.cells) {
            without_[cells_[cell]] = true;
        }
        views_.count_into(task_.cells, without_, with_image_);
        for (const std::uint32_t cell : subset.cells) {
            without_[cells_[cell]] = false;
        }
        for (std::size_t i = 0; i < views_.count(); ++i) {
            if (left_[i] > options.max_primitives && with_image_[i] <= options.max_primitives) {
                left_[i] = with_image_[i];
                image_of_[i] = index;
            }
        }
        return true;
    }

    /// The cells of a view that are far enough from all eyes of the site to be replaced.
    void gather(const View& central, std::size_t view) {
        seen_.clear();
        cells_.clear();
        far_.clear();
        const glm::dmat3& axes = central.camera_to_world;
        const glm::dvec3 forward = -axes[2];
        const double reach = glm::dot(glm::abs(forward), half_);
        const double least = reach + task_.options.clearance * glm::length(half_);
        const glm::dvec3 eye = middle_ - task_.origin;
        for (std::size_t i = 0; i < task_.cells.size(); ++i) {
            const PlacementCell& cell = task_.cells[i];
            if (!views_.sees(view, i)) {
                continue;
            }
            SeenCell seen;
            seen.left = std::numeric_limits<double>::infinity();
            seen.bottom = seen.left;
            seen.near_depth = seen.left;
            seen.right = -seen.left;
            seen.top = -seen.left;
            double farthest = 0.0;
            for (unsigned c = 0; c < 8; ++c) {
                const glm::dvec3 at = glm::dvec3(corner(cell.box, c)) - eye;
                const double depth = glm::dot(at, forward);
                const double x = glm::dot(at, axes[0]) / depth;
                const double y = glm::dot(at, axes[1]) / depth;
                seen.left = std::min(seen.left, x);
                seen.right = std::max(seen.right, x);
                seen.bottom = std::min(seen.bottom, y);
                seen.top = std::max(seen.top, y);
                seen.near_depth = std::min(seen.near_depth, depth);
                farthest = std::max(farthest, depth);
            }
            // Tangents are right where all corners are before the eye.
            if (seen.near_depth >= least) {
                seen.primitives = cell.primitives;
                seen_.push_back(seen);
                cells_.push_back(static_cast<std::uint32_t>(i));
                far_.push_back(farthest);
            }
        }
    }

    void add_image(const View& central, const Subset& subset, SitePlacement& placed) const {
        PlacedImage image;
        image.view = central;
        image.primitives = subset.primitives;
        image.first_cell = static_cast<std::uint32_t>(placed.replaced.size());
        image.cell_count = static_cast<std::uint32_t>(subset.cells.size());
        Lens window{
            .left = std::numeric_limits<double>::infinity(),
            .right = -std::numeric_limits<double>::infinity(),
            .bottom = std::numeric_limits<double>::infinity(),
            .top = -std::numeric_limits<double>::infinity()};
        image.near_depth = std::numeric_limits<double>::infinity();
        for (const std::uint32_t cell : subset.cells) {
            const SeenCell& seen = seen_[cell];
            window.left = std::min(window.left, seen.left);
            window.right = std::max(window.right, seen.right);
            window.bottom = std::min(window.bottom, seen.bottom);
            window.top = std::max(window.top, seen.top);
            image.near_depth = std::min(image.near_depth, seen.near_depth);
            image.far_depth = std::max(image.far_depth, far_[cell]);
            placed.replaced.push_back(cells_[cell]);
        }
        set_window(window, image);
        placed.images.push_back(image);
    }

    /// Texels as large as the frame's pixels, the window widened to whole ones, or larger where
    /// that would be too many.
    void set_window(const Lens& window, PlacedImage& image) const {
        const PlacementOptions& options = task_.options;
        const Lens& lens = options.lens;
        const double per_tangent_x = options.width / (lens.right - lens.left);
        const double per_tangent_y = options.height / (lens.top - lens.bottom);
        double density = options.texels_per_pixel;
        const double width = window.right - window.left;
        const double height = window.top - window.bottom;
        density = std::min(
            density,
            kMostLayeredTexels / std::max({width * per_tangent_x, height * per_tangent_y, 1.0})
        );
        const auto texels = [&](double tangents, double per_tangent) {
            return std::clamp(
                static_cast<std::int32_t>(std::ceil(tangents * per_tangent * density)),
                1,
                kMostLayeredTexels
            );
        };
        image.view.width = texels(width, per_tangent_x);
        image.view.height = texels(height, per_tangent_y);
        const double wide = std::max(width, image.view.width / (per_tangent_x * density));
        const double high = std::max(height, image.view.height / (per_tangent_y * density));
        const double middle_x = 0.5 * (window.left + window.right);
        const double middle_y = 0.5 * (window.bottom + window.top);
        image.view.lens = {
            .left = middle_x - 0.5 * wide,
            .right = middle_x + 0.5 * wide,
            .bottom = middle_y - 0.5 * high,
            .top = middle_y + 0.5 * high,
            .near_distance = 0.5 * image.near_depth,
            .far_distance = 2.0 * image.far_depth};
        // A flat model has one depth; images need two.
        image.near_depth *= 1.0 - kDepthMargin;
        image.far_depth *= 1.0 + kDepthMargin;
    }

    void add_ranges(SitePlacement& placed) const {
        for (std::size_t i = 0; i < views_.count(); ++i) {
            if (placed.ranges.empty() || placed.ranges.back().image != image_of_[i]) {
                placed.ranges.push_back({views_.from(i), image_of_[i], left_[i]});
            } else {
                PlacementRange& range = placed.ranges.back();
                range.primitives = std::max(range.primitives, left_[i]);
            }
        }
    }

    static constexpr double kDepthMargin = 1e-6;

    const PlacementTask& task_;
    glm::dvec3 middle_;
    glm::dvec3 half_;
    SiteViews views_;
    std::vector<std::uint64_t> all_;  ///< primitives of each view
    std::vector<std::uint64_t> left_; ///< with the images so far
    std::vector<std::uint64_t> with_image_;
    std::vector<std::uint32_t> image_of_; ///< by view
    std::vector<bool> without_;           ///< by cell
    // Of the view that an image is placed for:
    std::vector<SeenCell> seen_;
    std::vector<std::uint32_t> cells_;
    std::vector<double> far_; ///< [m]
};

} // namespace

// With R, U and F how far a corner is to the right of the eye, above it and before it, and T a
// tangent of the window, a corner is inside of the left plane where R - T F' >= 0, with the pitch p
// and F' = F cos p + U sin p; inside of the bottom where U' - T F' >= 0, with U' = U cos p - F sin
// p. R and F turn with the yaw, U does not. Over pitches up to m, F' is at most the larger of F and
// F cos m, and |U| sin m. What bounds the bottom and the top is a direction in the plane of U and
// F that turns with the pitch: if any is within a right angle of (U, F), the first or last is.
YawSet
directions_of(const PlacementTask& task, const glm::dvec3& lo, const glm::dvec3& hi) noexcept {
    const Lens& lens = task.options.lens;
    const double c = std::cos(task.options.max_pitch);
    const double s = std::sin(task.options.max_pitch);
    const auto corners = corners_of(task.frame, lo, hi);
    // At yaw y: F = forward cos y + right sin y, R = right cos y - forward sin y.
    const auto add =
        [](YawSet& set, const Corner& at, double of_right, double of_forward, double rest) {
            set.add(
                of_right * at.right + of_forward * at.forward,
                of_forward * at.right - of_right * at.forward,
                rest
            );
        };
    YawSet left;
    YawSet right;
    YawSet bottom;
    YawSet top;
    YawSet front;
    for (const Corner& at : corners) {
        for (const double share : {1.0, c}) {
            add(left, at, 1.0, -lens.left * share, std::abs(lens.left * at.up) * s);
            add(right, at, -1.0, lens.right * share, std::abs(lens.right * at.up) * s);
        }
        for (const double turn : {s, -s}) {
            add(bottom, at, 0.0, -turn - lens.bottom * c, at.up * (c - lens.bottom * turn));
            add(top, at, 0.0, turn + lens.top * c, at.up * (lens.top * turn - c));
            add(front, at, 0.0, c, at.up * turn);
        }
    }
    left.intersect(right);
    left.intersect(bottom);
    left.intersect(top);
    left.intersect(front);
    return left;
}

SitePlacement place_site(const PlacementTask& task, const Box3d& eyes) {
    return SitePlacer(task, eyes).run();
}

} // namespace farfield
