#include "image/layered_rays.hpp"
#include <farfield/image/build_layered_image.hpp>

#include <glm/common.hpp>
#include <glm/ext/matrix_double3x3.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

namespace farfield {

namespace {

using detail::tangents_per_step;
using glm::dvec2;
using glm::dvec3;
using glm::vec3;

constexpr std::uint32_t kNone32 = UINT32_MAX;
constexpr std::size_t kMostSamples = 255; // in one texel
/// Points of views are rounded to float in the frames of their meshes, so that two views see one
/// point at depths that differ by some 1e-7; a hundred times that is still nothing.
constexpr float kDepthRounding = 1e-5F;

tl::unexpected<Error> bad(const std::string& what) {
    return fail(ErrorCode::invalid_argument, "layered depth image: " + what);
}

std::string size_text(int width, int height) {
    return std::to_string(width) + " x " + std::to_string(height);
}

Result<void> check_option(const char* name, float value, float least, float most) {
    if (value >= least && value <= most) {
        return {};
    }
    return bad(
        std::string(name) + " is " + std::to_string(value) + ", expected " + std::to_string(least) +
        " to " + std::to_string(most)
    );
}

Result<void> check(
    const View& central, std::span<const ConstructionView> views, const LayeredImageOptions& options
) {
    if (Result<void> valid = validate(central); !valid) {
        return valid;
    }
    if (central.width > kMostLayeredTexels || central.height > kMostLayeredTexels) {
        return bad(size_text(central.width, central.height) + " texels, at most 4096 a side");
    }
    for (const Result<void>& valid :
         {check_option("merge_distance", options.merge_distance, 0.0F, 0.75F),
          check_option("overlap", options.overlap, 1.0F, 4.0F),
          check_option("most_stretch", options.most_stretch, 1.0F, 16.0F)}) {
        if (!valid) {
            return valid;
        }
    }
    for (std::size_t i = 0; i < views.size(); ++i) {
        const ConstructionView& made = views[i];
        const View& view = made.view;
        const std::string name = "construction view " + std::to_string(i) + ": ";
        if (const Result<void> valid = validate(view); !valid) {
            return bad(name + valid.error().message);
        }
        const std::size_t pixels =
            static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height);
        const Picture& colors = made.colors;
        if (colors.width != view.width || colors.height != view.height ||
            colors.rgba.size() != 4 * pixels) {
            return bad(
                name + "colours of " + size_text(colors.width, colors.height) + " pixels in " +
                std::to_string(colors.rgba.size()) + " bytes, the view has " +
                size_text(view.width, view.height)
            );
        }
        const PositionPicture& positions = made.positions;
        if (positions.width != view.width || positions.height != view.height ||
            positions.texels.size() != pixels) {
            return bad(
                name + "positions of " + size_text(positions.width, positions.height) +
                " pixels, " + std::to_string(positions.texels.size()) +
                " of them there, the view has " + size_text(view.width, view.height)
            );
        }
    }
    return {};
}

/// A sample that is kept, before depths are known to all.
struct Kept {
    float x = 0.0F; ///< [texel]
    float y = 0.0F;
    float depth = 0.0F;           ///< [m]
    float half = 0.0F;            ///< what is no farther along both axes is explained [texel]
    float half_depth = 0.0F;      ///< and along the ray [m]
    std::uint32_t next = kNone32; ///< in the same texel
    LayeredSample sample;
};

class Builder {
  public:
    Builder(
        const View& central,
        std::span<const glm::dmat4x3> frames,
        const LayeredImageOptions& options
    )
        : central_(central), frames_(frames), options_(options),
          world_to_camera_(glm::transpose(central.camera_to_world)),
          texel_(tangents_per_step(central)), per_tangent_(1.0 / texel_),
          corner_(central.lens.left, central.lens.bottom),
          texel_side_(static_cast<float>(std::max(texel_.x, texel_.y))),
          heads_(
              static_cast<std::size_t>(central.width) * static_cast<std::size_t>(central.height),
              kNone32
          ) {}

    Result<void> add(std::size_t number, const ConstructionView& made) {
        if (Result<void> found = find_points(number, made.positions); !found) {
            return found;
        }
        const View& view = made.view;
        const dvec2 pixel = tangents_per_step(view);
        pixel_side_ = static_cast<float>(std::max(pixel.x, pixel.y));
        eye_ = vec3(to_camera(view.eye - central_.eye));
        forward_ = vec3(to_camera(-view.camera_to_world[2]));
        std::size_t at = 0;
        for (int y = 0; y < view.height; ++y) {
            for (int x = 0; x < view.width; ++x, ++at) {
                if (made.positions.texels[at].item != ::farfield::kNone<ItemId>) {
                    ++quality_.seen;
                    add_pixel(made, x, y, at);
                }
            }
        }
        return {};
    }

    BuiltLayeredImage finish() {
        BuiltLayeredImage built;
        LayeredDepthImage& image = built.image;
        image.view = central_;
        set_depths(image);
        image.counts.reserve(heads_.size());
        image.rows.reserve(static_cast<std::size_t>(central_.height) + 1);
        image.rows.push_back(0);
        image.samples.reserve(kept_.size());
        image.points.reserve(points_.size());
        std::vector<std::uint32_t> order;
        std::uint64_t used = 0;
        for (std::size_t texel = 0; texel < heads_.size(); ++texel) {
            order.clear();
            for (std::uint32_t i = heads_[texel]; i != kNone32; i = kept_[i].next) {
                order.push_back(i);
            }
            std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
                return kept_[a].depth < kept_[b].depth ||
                       (kept_[a].depth == kept_[b].depth && a < b);
            });
            if (order.size() > kMostSamples) {
                quality_.crowded += order.size() - kMostSamples;
                order.resize(kMostSamples);
            }
            for (const std::uint32_t i : order) {
                image.samples.push_back(kept_[i].sample);
                image.samples.back().depth = depth_step(image, kept_[i].depth);
                if (options_.keep_points) {
                    image.points.push_back(points_[i]);
                }
            }
            image.counts.push_back(static_cast<std::uint8_t>(order.size()));
            used += order.empty() ? 0 : 1;
            quality_.most_layers =
                std::max(quality_.most_layers, static_cast<std::uint32_t>(order.size()));
            if ((texel + 1) % static_cast<std::size_t>(central_.width) == 0) {
                image.rows.push_back(static_cast<std::uint32_t>(image.samples.size()));
            }
        }
        quality_.samples = image.samples.size();
        if (used > 0) {
            quality_.mean_layers =
                static_cast<double>(quality_.samples) / static_cast<double>(used);
        }
        built.quality = quality_;
        return built;
    }

  private:
    /// From the world's axes to x to the right, y up, and depth.
    [[nodiscard]] dvec3 to_camera(const dvec3& v) const noexcept {
        const dvec3 seen = world_to_camera_ * v;
        return {seen.x, seen.y, -seen.z};
    }

    /// All points of a picture, seen from the central eye; not a number where there is none.
    Result<void> find_points(std::size_t number, const PositionPicture& positions) {
        found_.resize(positions.texels.size());
        ItemId item = ::farfield::kNone<ItemId>;
        glm::dmat4x3 frame(1.0);
        for (std::size_t i = 0; i < found_.size(); ++i) {
            const PositionTexel& texel = positions.texels[i];
            if (texel.item == ::farfield::kNone<ItemId>) {
                found_[i] = vec3(std::numeric_limits<float>::quiet_NaN());
                continue;
            }
            if (texel.item != item) {
                if (index_of(texel.item) >= frames_.size()) {
                    return bad(
                        at_pixel(number, positions, i) + "item " +
                        std::to_string(index_of(texel.item)) + ", there are frames of " +
                        std::to_string(frames_.size())
                    );
                }
                item = texel.item;
                const glm::dmat4x3& world = frames_[index_of(item)];
                frame = {
                    to_camera(world[0]),
                    to_camera(world[1]),
                    to_camera(world[2]),
                    to_camera(world[3] - central_.eye)};
            }
            const dvec3 local(texel.point);
            found_[i] =
                vec3(frame[0] * local.x + frame[1] * local.y + frame[2] * local.z + frame[3]);
            if (!std::isfinite(found_[i].x + found_[i].y + found_[i].z)) {
                return bad(
                    at_pixel(number, positions, i) + "the point " + std::to_string(local.x) + " " +
                    std::to_string(local.y) + " " + std::to_string(local.z) +
                    " is nowhere in the world"
                );
            }
        }
        return {};
    }

    static std::string
    at_pixel(std::size_t number, const PositionPicture& positions, std::size_t at) {
        const auto width = static_cast<std::size_t>(positions.width);
        return "construction view " + std::to_string(number) + ": pixel " +
               std::to_string(at % width) + ", " + std::to_string(at / width) +
               " from the upper left: ";
    }

    void add_pixel(const ConstructionView& made, int x, int y, std::size_t at) {
        const vec3& point = found_[at];
        const double depth = point.z;
        if (depth < central_.lens.near_distance || depth > central_.lens.far_distance) {
            ++quality_.outside;
            return;
        }
        const double place_x = (point.x / depth - corner_.x) * per_tangent_.x;
        const double place_y = (point.y / depth - corner_.y) * per_tangent_.y;
        if (!(place_x >= 0.0 && place_x < central_.width && place_y >= 0.0 &&
              place_y < central_.height)) {
            ++quality_.outside;
            return;
        }
        Kept kept;
        kept.sample.x = step_of(place_x, central_.width);
        kept.sample.y = step_of(place_y, central_.height);
        kept.x = static_cast<float>(kept.sample.x) / kLayeredSteps;
        kept.y = static_cast<float>(kept.sample.y) / kLayeredSteps;
        kept.depth = point.z;
        if (is_explained(kept)) {
            ++quality_.merged;
            return;
        }
        const float texel_m = texel_side_ * point.z;
        const float pixel_m = pixel_side_ * glm::dot(point - eye_, forward_);
        const float apart_m = std::max(
            spacing(at, 1, x, made.view.width),
            spacing(at, static_cast<std::size_t>(made.view.width), y, made.view.height)
        );
        const float side_m = std::clamp(apart_m, pixel_m, options_.most_stretch * pixel_m);
        kept.half = options_.merge_distance * pixel_m / texel_m;
        kept.half_depth = options_.merge_distance * side_m + kDepthRounding * point.z;
        kept.sample.extent = extent_of(options_.overlap * side_m / texel_m);
        const std::uint8_t* color = &made.colors.rgba[4 * at];
        kept.sample.color = {color[0], color[1], color[2], std::uint8_t{255}};
        std::uint32_t& head = heads_[texel_of(kept.sample)];
        kept.next = head;
        head = static_cast<std::uint32_t>(kept_.size());
        kept_.push_back(kept);
        if (options_.keep_points) {
            const PositionTexel& texel = made.positions.texels[at];
            points_.push_back({.point = texel.point, .item = texel.item});
        }
    }

    [[nodiscard]] static std::uint16_t step_of(double place, int texels) noexcept {
        const double step = std::floor(place * kLayeredSteps + 0.5);
        return static_cast<std::uint16_t>(std::min(step, texels * kLayeredSteps - 1.0));
    }

    [[nodiscard]] static std::uint16_t extent_of(float texels) noexcept {
        constexpr float kSteps = 256.0F;
        return static_cast<std::uint16_t>(std::clamp(texels * kSteps + 0.5F, 1.0F, 65535.0F));
    }

    [[nodiscard]] std::size_t texel_of(const LayeredSample& sample) const noexcept {
        return static_cast<std::size_t>(sample.y / kLayeredSteps) *
                   static_cast<std::size_t>(central_.width) +
               static_cast<std::size_t>(sample.x / kLayeredSteps);
    }

    /// True if a sample in the texel or in the three nearest to it stands for this one as well.
    [[nodiscard]] bool is_explained(const Kept& next) const noexcept {
        const int column = next.sample.x / kLayeredSteps;
        const int row = next.sample.y / kLayeredSteps;
        const int beside = next.sample.x % kLayeredSteps < kLayeredSteps / 2 ? -1 : 1;
        const int over = next.sample.y % kLayeredSteps < kLayeredSteps / 2 ? -1 : 1;
        return is_explained(next, column, row) || is_explained(next, column + beside, row) ||
               is_explained(next, column, row + over) ||
               is_explained(next, column + beside, row + over);
    }

    [[nodiscard]] bool is_explained(const Kept& next, int column, int row) const noexcept {
        if (column < 0 || column >= central_.width || row < 0 || row >= central_.height) {
            return false;
        }
        const std::size_t texel =
            static_cast<std::size_t>(row) * static_cast<std::size_t>(central_.width) +
            static_cast<std::size_t>(column);
        for (std::uint32_t i = heads_[texel]; i != kNone32; i = kept_[i].next) {
            const Kept& kept = kept_[i];
            if (std::abs(next.x - kept.x) <= kept.half && std::abs(next.y - kept.y) <= kept.half &&
                std::abs(next.depth - kept.depth) <= kept.half_depth) {
                return true;
            }
        }
        return false;
    }

    /// How far neighbours along one axis of a picture are apart on the surface of a pixel, 0 where
    /// that cannot be told. [m]
    /// @param stride from one pixel to the next, @param place along the axis, of `count` pixels
    [[nodiscard]] float
    spacing(std::size_t at, std::size_t stride, int place, int count) const noexcept {
        const vec3& point = found_[at];
        const bool has_before = place > 0;
        const bool has_after = place + 1 < count;
        if (has_before && has_after) {
            const float apart = step_between(found_[at - stride], point, found_[at + stride]);
            if (apart > 0.0F) {
                return apart;
            }
        }
        // At a rim the surface goes on to one side alone.
        float apart = 0.0F;
        if (place + 2 < count) {
            apart = step_between(point, found_[at + stride], found_[at + 2 * stride]);
        }
        if (place > 1) {
            const float other = step_between(point, found_[at - stride], found_[at - 2 * stride]);
            apart = apart > 0.0F && other > 0.0F ? std::min(apart, other) : std::max(apart, other);
        }
        return apart;
    }

    /// The mean step of three points that lie on one surface, else 0: where their steps differ by
    /// no more than half of their mean.
    [[nodiscard]] static float step_between(const vec3& a, const vec3& b, const vec3& c) noexcept {
        const vec3 step = (c - a) * 0.5F;
        const vec3 bend = (c - b) - (b - a);
        const float step_sq = glm::dot(step, step);
        // Of what is not a number no comparison is true.
        return glm::dot(bend, bend) <= 0.25F * step_sq ? std::sqrt(step_sq) : 0.0F;
    }

    /// The range that the samples have, a little wider where that is nothing.
    void set_depths(LayeredDepthImage& image) const noexcept {
        if (kept_.empty()) {
            return;
        }
        const auto [nearest, farthest] =
            std::minmax_element(kept_.begin(), kept_.end(), [](const Kept& a, const Kept& b) {
                return a.depth < b.depth;
            });
        constexpr double kLeastRange = 1.001;
        image.near_depth = double{nearest->depth};
        image.far_depth = std::max(double{farthest->depth}, image.near_depth * kLeastRange);
    }

    [[nodiscard]] static std::uint16_t
    depth_step(const LayeredDepthImage& image, float depth) noexcept {
        constexpr double kSteps = 65535.0;
        const double far = 1.0 / image.far_depth;
        const double share = (1.0 / double{depth} - far) / (1.0 / image.near_depth - far);
        return static_cast<std::uint16_t>(std::clamp(share * kSteps + 0.5, 0.0, kSteps));
    }

    const View& central_;
    std::span<const glm::dmat4x3> frames_;
    const LayeredImageOptions& options_;
    glm::dmat3 world_to_camera_;
    dvec2 texel_; ///< tangents
    dvec2 per_tangent_;
    dvec2 corner_;
    float texel_side_ = 0.0F; ///< tangent of the longer side
    // Of the view that is being added.
    float pixel_side_ = 0.0F;
    vec3 eye_{0.0F};
    vec3 forward_{0.0F};
    std::vector<vec3> found_;
    std::vector<std::uint32_t> heads_; ///< of each texel the kept sample that came last
    std::vector<Kept> kept_;
    std::vector<PositionTexel> points_; ///< of the kept ones, or none
    LayeredImageQuality quality_;
};

} // namespace

Result<BuiltLayeredImage> build_layered_image(
    const View& central,
    std::span<const ConstructionView> views,
    std::span<const glm::dmat4x3> item_frames,
    const LayeredImageOptions& options
) {
    if (Result<void> valid = check(central, views, options); !valid) {
        return tl::unexpected(valid.error());
    }
    std::vector<std::size_t> order(views.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto distance = [&](std::size_t i) {
        return glm::distance(views[i].view.eye, central.eye);
    };
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return distance(a) < distance(b);
    });
    Builder builder(central, item_frames, options);
    for (const std::size_t i : order) {
        if (Result<void> added = builder.add(i, views[i]); !added) {
            return tl::unexpected(added.error());
        }
    }
    return builder.finish();
}

} // namespace farfield
