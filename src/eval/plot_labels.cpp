#include "plot_labels.hpp"

#include "page_text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace farfield::eval::detail {

namespace {

struct Rectangle {
    glm::dvec2 low{0.0};
    glm::dvec2 high{0.0};
};

double overlap(const Rectangle& a, const Rectangle& b) noexcept {
    const double width = std::min(a.high.x, b.high.x) - std::max(a.low.x, b.low.x);
    const double height = std::min(a.high.y, b.high.y) - std::max(a.low.y, b.low.y);
    return width > 0.0 && height > 0.0 ? width * height : 0.0;
}

Rectangle label_at(const PointLabel& label, const glm::dvec2& corner) noexcept {
    return {corner, corner + label.size};
}

/// Corners that a label may take, the best first where nothing is in the way.
std::vector<glm::dvec2> candidates(const PointLabel& label, double radius) {
    constexpr std::array<double, 7> kDistances = {3.0, 9.0, 18.0, 30.0, 45.0, 64.0, 90.0};
    std::vector<glm::dvec2> corners;
    for (const double distance : kDistances) {
        const double gap = radius + distance;
        const glm::dvec2& size = label.size;
        const double right = gap;
        const double left = -gap - size.x;
        const double middle = -size.x / 2.0;
        const double above = -gap - size.y;
        const double level = -size.y / 2.0;
        const std::array<glm::dvec2, 8> places = {
            {{right, level},
             {middle, above},
             {middle, gap},
             {left, level},
             {gap / 2.0, above},
             {gap / 2.0, gap},
             {-gap / 2.0 - size.x, above},
             {-gap / 2.0 - size.x, gap}}};
        for (const glm::dvec2& place : places) {
            corners.push_back(label.point + place);
        }
    }
    return corners;
}

} // namespace

double text_width(std::string_view text, double size) noexcept {
    constexpr double kMeanWidth = 0.6; // of a character, in font sizes
    return kMeanWidth * size * static_cast<double>(character_count(text));
}

std::vector<std::string> wrapped(std::string_view text, std::size_t most) {
    std::vector<std::string> lines;
    std::string line;
    while (!text.empty()) {
        const std::size_t space = std::min(text.find(' '), text.size());
        const std::string word(text.substr(0, space));
        text.remove_prefix(std::min(space + 1, text.size()));
        std::string longer = line;
        longer += line.empty() ? "" : " ";
        longer += word;
        if (!line.empty() && character_count(longer) > most) {
            lines.push_back(line);
            line = word;
        } else {
            line = longer;
        }
    }
    if (!line.empty()) {
        lines.push_back(line);
    }
    return lines;
}

std::vector<double>
moved_apart(std::span<const double> wanted, double spacing, double top, double bottom) {
    // With the spacings taken out, heights may be equal but not descend: pools of neighbours that
    // do share their mean. Barlow, Bartholomew, Bremner, Brunk, Statistical Inference under Order
    // Restrictions, 1972.
    struct Pool {
        double sum = 0.0;
        std::size_t count = 0;
        [[nodiscard]] double mean() const { return sum / static_cast<double>(count); }
    };
    std::vector<Pool> pools;
    for (std::size_t index = 0; index < wanted.size(); ++index) {
        pools.push_back({wanted[index] - spacing * static_cast<double>(index), 1});
        while (pools.size() > 1 && pools.end()[-2].mean() > pools.back().mean()) {
            pools.end()[-2].sum += pools.back().sum;
            pools.end()[-2].count += pools.back().count;
            pools.pop_back();
        }
    }
    std::vector<double> heights;
    const double last = bottom - spacing * (static_cast<double>(wanted.size()) - 1.0);
    for (const Pool& pool : pools) {
        const double base = std::max(top, std::min(pool.mean(), last));
        for (std::size_t member = 0; member < pool.count; ++member) {
            heights.push_back(base + spacing * static_cast<double>(heights.size()));
        }
    }
    return heights;
}

std::vector<glm::dvec2>
places_beside(std::span<const PointLabel> labels, double radius, const LabelArea& area) {
    std::vector<glm::dvec2> corners(labels.size(), glm::dvec2(0.0));
    std::vector<bool> placed(labels.size(), false);
    const Rectangle room{area.low, area.high};
    const auto cost = [&](std::size_t index, const glm::dvec2& corner) {
        const Rectangle here = label_at(labels[index], corner);
        const double size = labels[index].size.x * labels[index].size.y;
        constexpr double kOutside = 1000.0;
        constexpr double kOnLabel = 20.0;
        constexpr double kOnPoint = 8.0;
        constexpr double kNearPoint = 0.04;
        double sum = kOutside * (size - overlap(here, room));
        for (std::size_t other = 0; other < labels.size(); ++other) {
            const glm::dvec2& point = labels[other].point;
            sum += kOnPoint * overlap(here, {point - radius, point + radius});
            if (other != index) {
                const double near = 2.5 * radius; // there it would seem to belong to the other
                sum += kNearPoint * overlap(here, {point - near, point + near});
            }
            if (other != index && placed[other]) {
                sum += kOnLabel * overlap(here, label_at(labels[other], corners[other]));
            }
        }
        return sum;
    };
    constexpr int kRounds = 4;
    for (int round = 0; round < kRounds; ++round) {
        for (std::size_t index = 0; index < labels.size(); ++index) {
            double least = std::numeric_limits<double>::infinity();
            double rank = 0.0;
            glm::dvec2 best(0.0);
            for (const glm::dvec2& corner : candidates(labels[index], radius)) {
                const double here = cost(index, corner) + rank;
                if (here < least) {
                    least = here;
                    best = corner;
                }
                rank += 1.0; // the later, the further away
            }
            corners[index] = best;
            placed[index] = true;
        }
    }
    return corners;
}

} // namespace farfield::eval::detail
