#include <farfield/core/assert.hpp>
#include <farfield/eval/disparity_series.hpp>

#include <algorithm>

namespace farfield {

namespace {

double overshoot(const NodeOvershoot& node) noexcept {
    return node.disparity_px - node.promise_px;
}

/// The larger of what there is.
void raise(std::optional<double>& largest, const std::optional<double>& value) noexcept {
    if (value && (!largest || *value > *largest)) {
        largest = value;
    }
}

} // namespace

void DisparitySeries::add(
    int frame, const FrameDisparity& disparity, std::span<const std::uint32_t> remade
) {
    FARFIELD_ASSERT(sums_.frames == 0 || frame > last_frame_);
    for (const std::uint32_t node : remade) {
        const auto found = nodes_.find(node);
        if (found == nodes_.end() || found->second.frame != frame - 1 || !found->second.used) {
            continue;
        }
        used_.add(std::max(*found->second.used, 0.0));
        found->second.used.reset(); // counted
    }

    last_frame_ = frame;
    ++sums_.frames;
    sums_.image_pixels += disparity.image_pixels;
    sums_.infinite_pixels += disparity.infinite_pixels;
    sums_.geometry_pixels += disparity.geometry_pixels;
    sums_.unmeasured_pixels += disparity.unmeasured_pixels;
    raise(sums_.bound_px, disparity.bound_px);
    raise(sums_.geometry_max_px, disparity.geometry_max_px);
    if (disparity.over_bound) {
        sums_.over_bound = sums_.over_bound.value_or(0) + *disparity.over_bound;
    }
    sums_.histogram.add(disparity.histogram);

    for (const NodeDisparity& node : disparity.nodes) {
        Shown& shown = nodes_[node.node];
        shown.frame = frame;
        shown.used.reset();
        if (!disparity.error_px) {
            continue;
        }
        shown.used = node.less_sampling_px() / *disparity.error_px;
        const NodeOvershoot here{
            node.node,
            frame,
            node.disparity_px,
            *disparity.error_px + node.sampling_px,
            node.over_bound};
        if (node.over_bound > 0 && (!shown.worst || overshoot(here) > overshoot(*shown.worst))) {
            shown.worst = here;
        }
    }
}

DisparitySummary DisparitySeries::summary(std::size_t worst_nodes) const {
    DisparitySummary result = sums_;
    result.median_px = sums_.histogram.percentile(0.5);
    result.p99_px = sums_.histogram.percentile(0.99);
    result.max_px = sums_.histogram.max();
    result.remade_images = used_.count();
    result.tightness = used_.percentile(0.5);
    for (const auto& [node, shown] : nodes_) {
        if (shown.worst) {
            result.worst.push_back(*shown.worst);
        }
    }
    // Nodes come in ascending order, which a stable sort keeps among equals.
    std::stable_sort(result.worst.begin(), result.worst.end(), [](const auto& a, const auto& b) {
        return overshoot(a) > overshoot(b);
    });
    result.worst.resize(std::min(result.worst.size(), worst_nodes));
    return result;
}

namespace eval {

std::vector<std::uint32_t> images_made(const FramePlan& plan) {
    std::vector<std::uint32_t> nodes;
    for (const Pass& pass : plan.passes) {
        if (pass.node != UINT32_MAX) {
            nodes.push_back(pass.node);
        }
    }
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    return nodes;
}

} // namespace eval
} // namespace farfield
