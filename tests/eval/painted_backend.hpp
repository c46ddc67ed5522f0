#pragma once

#include <farfield/gpu/backend.hpp>

#include <glm/ext/vector_uint3_sized.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace farfield::test {

/// What painted backends were asked for, in order, all of them in one list.
struct Event {
    enum class Kind : std::uint8_t { planned, executed };
    Kind kind = Kind::executed;
    std::string who;
    std::uint32_t cache = 0; ///< `FramePlan::cache`, by which plans are told apart
    double eye_x = 0.0;      ///< [m] of the frame's view, by which frames are told apart

    friend bool operator==(const Event&, const Event&) = default;
};

/// Draws nothing: its pictures have one colour, that of the plan executed last. So errors are known
/// in closed form, and what a walk asks of a backend is written down.
class PaintedBackend final : public Backend {
  public:
    using Paint = std::function<glm::u8vec3(const FramePlan& plan)>;

    PaintedBackend(std::string name, std::vector<Event>& events, Paint paint)
        : name_(std::move(name)), events_(&events), paint_(std::move(paint)) {}

    std::size_t fail_at = SIZE_MAX;   ///< the execution that fails, from 0
    std::int32_t samples = 16;        ///< most a pixel
    std::vector<std::uint64_t> bytes; ///< of images after each execution, the last one for ever

    [[nodiscard]] Result<void>
    execute(const FramePlan& plan, TargetId target, const FrameClear& /*clear*/) noexcept override {
        if (executed_ == fail_at) {
            return fail(ErrorCode::device, "the device is gone");
        }
        ++executed_;
        events_->push_back({Event::Kind::executed, name_, plan.cache, plan.passes.back().view.eye.x}
        );
        targets_.at(target).color = paint_(plan);
        return {};
    }
    void finish() noexcept override {}
    [[nodiscard]] Result<TargetId>
    create_target(std::int32_t width, std::int32_t height, std::int32_t asked) noexcept override {
        if (asked > samples) {
            return fail(ErrorCode::unsupported, std::to_string(asked) + " samples are too many");
        }
        ++made_;
        const auto id = TargetId{made_};
        targets_[id] = {width, height, {}};
        return id;
    }
    void destroy_target(TargetId target) noexcept override { targets_.erase(target); }
    [[nodiscard]] Result<Picture> read_target(TargetId target) override {
        const Target& read = targets_.at(target);
        Picture picture{read.width, read.height, {}};
        for (int pixel = 0; pixel < read.width * read.height; ++pixel) {
            picture.rgba.insert(
                picture.rgba.end(), {read.color.r, read.color.g, read.color.b, 255}
            );
        }
        return picture;
    }
    /// Background everywhere.
    [[nodiscard]] Result<PositionPicture> read_positions(TargetId target) override {
        const Target& read = targets_.at(target);
        const auto pixels =
            static_cast<std::size_t>(read.width) * static_cast<std::size_t>(read.height);
        return PositionPicture{read.width, read.height, std::vector<PositionTexel>(pixels)};
    }
    [[nodiscard]] Limits limits() const noexcept override { return {4096, samples, true}; }
    [[nodiscard]] std::string device() const override { return name_; }
    [[nodiscard]] std::uint64_t image_bytes() const noexcept override {
        if (bytes.empty() || executed_ == 0) {
            return 0;
        }
        return bytes[std::min(executed_, bytes.size()) - 1];
    }
    [[nodiscard]] std::uint64_t position_bytes() const noexcept override {
        return 7 * image_bytes();
    }

    [[nodiscard]] std::size_t executed() const noexcept { return executed_; }
    [[nodiscard]] std::uint32_t targets_made() const noexcept { return made_; }
    [[nodiscard]] std::size_t targets_left() const noexcept { return targets_.size(); }

  private:
    struct Target {
        int width = 0;
        int height = 0;
        glm::u8vec3 color{0};
    };

    std::string name_;
    std::vector<Event>* events_;
    Paint paint_;
    std::size_t executed_ = 0;
    std::uint32_t made_ = 0;
    std::map<TargetId, Target> targets_;
};

} // namespace farfield::test
