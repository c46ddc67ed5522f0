#pragma once

#include "technique/image_camera.hpp"
#include <farfield/image/proxy_pair.hpp>
#include <farfield/math/frustum.hpp>

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace farfield {

/// A part of a model as a survey sees it: a few samples, told by where they are on the whole.
struct SurveyPoint {
    glm::vec3 point{0.0F};  ///< relative to the hierarchy's origin [m]
    glm::vec3 normal{0.0F}; ///< unit
    float radius = 0.0F;    ///< [m] of the part
    float height = 0.0F;    ///< [m] how far its samples are from their facets, about
    float weight = 0.0F;    ///< [px^2] that it takes on the screen, about; 0: hidden
};

/// The nearest depth in each cell of a window, so that what stands far behind it is hidden.
class SurveyDepths {
  public:
    void clear() noexcept;
    void add(const SurveyPoint& point, const ImageCamera& camera) noexcept;
    /// True where a part stands behind what is in its cell and in all cells around. Parts in the
    /// same cell may stand one above the other, so one cell alone says nothing.
    [[nodiscard]] bool hides(const SurveyPoint& point, const ImageCamera& camera) const noexcept;

  private:
    static constexpr int kSide = 64;
    std::array<float, std::size_t{kSide} * kSide> nearest_{};
};

/// Which keyframes lose parts of a window that another one serves: a bit for each.
class SurveyMask {
  public:
    void clear() noexcept;
    void add(const SurveyPoint& point, std::uint8_t bits, const ImageCamera& camera) noexcept;
    /// All bits of what a sphere may cover.
    /// @param center relative to the hierarchy's origin [m]
    [[nodiscard]] std::uint8_t
    bits(const glm::vec3& center, float radius, const ImageCamera& camera) const noexcept;

  private:
    static constexpr int kSide = 64;
    std::array<std::uint8_t, std::size_t{kSide} * kSide> bits_{};
    std::uint8_t everywhere_ = 0; ///< of what reaches up to the eye
    std::uint8_t any_ = 0;        ///< of anything
};

/// A model of a pair in the frame of the hierarchy.
struct SurveyModel {
    const ProxyPair* pair = nullptr;
    glm::vec3 offset{0.0F}; ///< of its origin from the hierarchy's
};

/// What a view shows of the models of pairs, in parts of a few pixels: an estimate to weigh
/// keyframes by, never a promise.
class SpriteSurvey {
  public:
    SpriteSurvey();

    /// Looks through a camera; hidden parts have no weight afterwards.
    void look(std::span<const SurveyModel> models, const ImageCamera& camera) noexcept;

    [[nodiscard]] std::span<const SurveyPoint> points() const noexcept { return points_; }
    [[nodiscard]] const SurveyDepths& depths() const noexcept { return depths_; }
    [[nodiscard]] float total_weight() const noexcept { return total_weight_; }

    /// Most parts of a view.
    static constexpr std::size_t kMostPoints = 4096;

  private:
    void visit(
        const SurveyModel& model, std::uint32_t node, const ImageCamera& camera, bool inside
    ) noexcept;

    Frustum frustum_; ///< in the frame of the model being looked at
    std::vector<SurveyPoint> points_;
    SurveyDepths depths_;
    float total_weight_ = 0.0F;
};

} // namespace farfield
