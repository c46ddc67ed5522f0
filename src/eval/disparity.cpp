#include "picture_checks.hpp"
#include <farfield/eval/disparity.hpp>

#include <glm/common.hpp>
#include <glm/ext/matrix_double3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <unordered_map>

namespace farfield::eval {

namespace {

using glm::dvec2;
using glm::dvec3;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Projects to pixels from the upper left corner of the window.
class Projection {
  public:
    explicit Projection(const View& view)
        : eye_(view.eye), world_to_camera_(glm::transpose(view.camera_to_world)),
          corner_(view.lens.left, view.lens.top),
          px_per_tangent_(
              view.width / (view.lens.right - view.lens.left),
              view.height / (view.lens.bottom - view.lens.top)
          ) {}

    /// Distance of a point from a place on the image, infinite where it is not in front of the eye.
    /// [px]
    [[nodiscard]] double
    distance_px(const glm::dmat4x3& frame, const glm::vec3& point, const dvec2& from) const {
        const dvec3 local(point);
        // The translation loses the eye before it meets the point, which is small beside it.
        const dvec3 from_eye =
            frame[0] * local.x + frame[1] * local.y + frame[2] * local.z + (frame[3] - eye_);
        const dvec3 camera = world_to_camera_ * from_eye;
        const double depth = -camera.z;
        if (depth <= 0.0) {
            return kInfinity;
        }
        const dvec2 tangent(camera.x / depth, camera.y / depth);
        const dvec2 off = (tangent - corner_) * px_per_tangent_ - from;
        return std::hypot(off.x, off.y);
    }

  private:
    dvec3 eye_;
    glm::dmat3 world_to_camera_;
    dvec2 corner_;
    dvec2 px_per_tangent_;
};

bool is_finite(const glm::vec3& point) noexcept {
    return std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z);
}

/// Nodes in the order in which they are met; pixels of one mostly come together.
class NodeTable {
  public:
    NodeDisparity& at(std::uint32_t node) {
        if (nodes_.empty() || nodes_[last_].node != node) {
            const auto [found, is_new] = places_.try_emplace(node, nodes_.size());
            if (is_new) {
                nodes_.emplace_back().node = node;
            }
            last_ = found->second;
        }
        return nodes_[last_];
    }

    [[nodiscard]] std::vector<NodeDisparity> sorted() && {
        std::sort(nodes_.begin(), nodes_.end(), [](const auto& a, const auto& b) {
            return a.node < b.node;
        });
        return std::move(nodes_);
    }

  private:
    std::vector<NodeDisparity> nodes_;
    std::unordered_map<std::uint32_t, std::size_t> places_;
    std::size_t last_ = 0;
};

Result<void>
check(const PositionPicture& picture, const View& view, std::optional<double> error_px) {
    if (auto checked = detail::check("position picture", picture); !checked) {
        return checked;
    }
    if (auto checked = validate(view); !checked) {
        return checked;
    }
    if (picture.width != view.width || picture.height != view.height) {
        return fail(
            ErrorCode::invalid_argument,
            "position picture is " + detail::size_text(picture.width, picture.height) +
                " pixels, the view " + detail::size_text(view.width, view.height)
        );
    }
    if (error_px && !(*error_px > 0.0 && std::isfinite(*error_px))) {
        return fail(
            ErrorCode::invalid_argument,
            "disparity: promised error is " + std::to_string(*error_px) +
                " pixels, expected a finite value above 0"
        );
    }
    return {};
}

} // namespace

Result<FrameDisparity> measure_disparity(
    const PositionPicture& picture,
    const View& view,
    std::span<const glm::dmat4x3> frames,
    std::optional<double> error_px
) {
    if (auto checked = check(picture, view, error_px); !checked) {
        return tl::unexpected(checked.error());
    }
    FrameDisparity result;
    result.error_px = error_px;
    result.map = PixelMap{picture.width, picture.height, {}};
    result.map.values.assign(picture.texels.size(), std::numeric_limits<float>::quiet_NaN());
    if (error_px) {
        result.over_bound = 0;
    }
    const Projection projection(view);
    NodeTable nodes;
    std::size_t pixel = 0;
    for (int y = 0; y < picture.height; ++y) {
        for (int x = 0; x < picture.width; ++x, ++pixel) {
            const PositionTexel& texel = picture.texels[pixel];
            if (texel.item == kNone<ItemId>) {
                continue;
            }
            const bool sound = is_finite(texel.point) && std::isfinite(texel.texel_px) &&
                               texel.texel_px >= 0.0F && index_of(texel.item) < frames.size();
            const double disparity =
                sound ? projection.distance_px(
                            frames[index_of(texel.item)], texel.point, dvec2(x + 0.5, y + 0.5)
                        )
                      : std::numeric_limits<double>::quiet_NaN();
            if (std::isnan(disparity)) {
                ++result.unmeasured_pixels;
                continue;
            }
            result.map.values[pixel] = static_cast<float>(disparity);
            if (texel.node == UINT32_MAX) {
                ++result.geometry_pixels;
                result.geometry_max_px = std::max(result.geometry_max_px.value_or(0.0), disparity);
                continue;
            }
            ++result.image_pixels;
            result.infinite_pixels += std::isinf(disparity) ? 1 : 0;
            result.histogram.add(disparity);
            const double sampling = kSamplingShare * static_cast<double>(texel.texel_px);
            NodeDisparity& node = nodes.at(texel.node);
            if (node.pixels == 0 || disparity - sampling > node.less_sampling_px()) {
                node.x = x;
                node.y = y;
                node.disparity_px = disparity;
                node.sampling_px = sampling;
            }
            ++node.pixels;
            if (error_px) {
                const double promise = *error_px + sampling;
                const bool over = disparity > promise;
                node.over_bound += over ? 1 : 0;
                *result.over_bound += over ? 1 : 0;
                result.bound_px = std::max(result.bound_px.value_or(0.0), promise);
            }
        }
    }
    result.nodes = std::move(nodes).sorted();
    return result;
}

} // namespace farfield::eval
