#include "eval/json_text.hpp"
#include "eval/text_file.hpp"
#include <farfield/core/assert.hpp>
#include <farfield/eval/camera_path.hpp>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <numbers>
#include <utility>

namespace farfield::eval {

namespace {

using glm::dvec3;
using nlohmann::ordered_json;

constexpr int kMaxFrames = 10'000'000;

tl::unexpected<Error> invalid(std::string message) {
    return fail(ErrorCode::invalid_argument, std::move(message));
}

/// Shortest text that reads back as the same number.
std::string text(double value) {
    std::array<char, 32> buffer{};
    const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
    return error == std::errc{} ? std::string(buffer.data(), end) : std::string("?");
}

std::string key_name(std::size_t index) {
    return "keys[" + std::to_string(index) + "]";
}

Result<void> check_finite(const std::string& where, const char* field, const dvec3& vector) {
    for (int axis = 0; axis < 3; ++axis) {
        if (!std::isfinite(vector[axis])) {
            return invalid(
                where + "." + field + "[" + std::to_string(axis) + "] is " + text(vector[axis]) +
                ", expected a finite number"
            );
        }
    }
    return {};
}

std::string vector_text(const dvec3& v) {
    return "(" + text(v.x) + ", " + text(v.y) + ", " + text(v.z) + ")";
}

/// Weights of the four control points of a segment at u in [0, 1].
std::array<double, 4> weights(double u) noexcept {
    const double v = 1.0 - u;
    return {
        v * v * v / 6.0,
        (u * u * (3.0 * u - 6.0) + 4.0) / 6.0,
        (v * v * (3.0 * v - 6.0) + 4.0) / 6.0,
        u * u * u / 6.0};
}

/// One of eye, target and up at a place between keys `segment` and `segment + 1`.
dvec3 spline(
    const std::vector<PathKey>& keys, std::size_t segment, double u, dvec3 PathKey::*field
) noexcept {
    const dvec3 first = keys[segment].*field;
    const dvec3 second = keys[segment + 1].*field;
    const dvec3 before = segment > 0 ? keys[segment - 1].*field : 2.0 * first - second;
    const dvec3 after = segment + 2 < keys.size() ? keys[segment + 2].*field : 2.0 * second - first;
    const std::array<double, 4> weight = weights(u);
    // Offsets from the first point keep the digits of a path far from 0.
    return first + weight[0] * (before - first) + weight[2] * (second - first) +
           weight[3] * (after - first);
}

/// Reading of one file; messages begin with its name.
class Reader {
  public:
    explicit Reader(std::string_view name) : name_(name) {}

    [[nodiscard]] Result<CameraPath> read(std::string_view json) const {
        ordered_json root;
        // The parser tells line and column only by its exception; nothing leaves this function.
        try {
            root = ordered_json::parse(json);
        } catch (const ordered_json::exception& exception) {
            return bad(std::string("not JSON: ") + exception.what());
        }
        if (auto checked = check_members(root, "the file", {"frame_count", "keys"}); !checked) {
            return tl::unexpected(checked.error());
        }
        CameraPath path;
        const ordered_json& frames = root["frame_count"];
        if (!frames.is_number_integer() || frames < 1 || frames > kMaxFrames) {
            return bad(
                "frame_count is " + detail::shown(frames) + ", expected a whole number from 1 to " +
                std::to_string(kMaxFrames)
            );
        }
        path.frame_count = frames.get<int>();
        const ordered_json& keys = root["keys"];
        if (!keys.is_array()) {
            return bad("keys is " + detail::shown(keys) + ", expected an array");
        }
        for (std::size_t i = 0; i < keys.size(); ++i) {
            auto key = read_key(keys[i], key_name(i));
            if (!key) {
                return tl::unexpected(key.error());
            }
            path.keys.push_back(*key);
        }
        if (auto checked = validate(path); !checked) {
            return bad(checked.error().message);
        }
        return path;
    }

  private:
    [[nodiscard]] tl::unexpected<Error> bad(const std::string& message) const {
        return fail(ErrorCode::bad_data, name_ + ": " + message);
    }

    [[nodiscard]] Result<void> check_members(
        const ordered_json& object,
        const std::string& where,
        std::initializer_list<const char*> members
    ) const {
        if (!object.is_object()) {
            return bad(where + " is " + detail::shown(object) + ", expected an object");
        }
        for (const char* member : members) {
            if (!object.contains(member)) {
                return bad(where + " has no \"" + member + "\"");
            }
        }
        for (const auto& [name, value] : object.items()) {
            if (std::find(members.begin(), members.end(), name) == members.end()) {
                std::string message = where;
                message += " has an unknown member \"";
                message += name;
                message += "\": ";
                message += detail::shown(value);
                return bad(message);
            }
        }
        return {};
    }

    [[nodiscard]] Result<PathKey>
    read_key(const ordered_json& object, const std::string& where) const {
        if (auto checked = check_members(object, where, {"frame", "eye", "target", "up"});
            !checked) {
            return tl::unexpected(checked.error());
        }
        PathKey key;
        const ordered_json& frame = object["frame"];
        if (!frame.is_number()) {
            return bad(where + ".frame is " + detail::shown(frame) + ", expected a number");
        }
        key.frame = frame.get<double>();
        const std::array<std::pair<const char*, dvec3*>, 3> fields = {
            {{"eye", &key.eye}, {"target", &key.target}, {"up", &key.up}}};
        for (const auto& [name, vector] : fields) {
            const ordered_json& array = object[name];
            if (!array.is_array() || array.size() != 3) {
                return bad(
                    where + "." + name + " is " + detail::shown(array) + ", expected three numbers"
                );
            }
            for (int axis = 0; axis < 3; ++axis) {
                const ordered_json& value = array[static_cast<std::size_t>(axis)];
                if (!value.is_number()) {
                    return bad(
                        where + "." + name + "[" + std::to_string(axis) + "] is " +
                        detail::shown(value) + ", expected a number"
                    );
                }
                (*vector)[axis] = value.get<double>();
            }
        }
        return key;
    }

    std::string name_;
};

/// Two unit vectors at right angles to `up` and to each other; x and z where y is up.
std::pair<dvec3, dvec3> horizontal_axes(const dvec3& up) noexcept {
    const dvec3 other = std::abs(up.x) < 0.9 ? dvec3(1.0, 0.0, 0.0) : dvec3(0.0, 0.0, 1.0);
    const dvec3 first = glm::normalize(other - up * glm::dot(up, other));
    return {first, glm::cross(first, up)};
}

} // namespace

Result<void> validate(const CameraPath& path) {
    if (path.frame_count < 1 || path.frame_count > kMaxFrames) {
        return invalid(
            "frame_count is " + std::to_string(path.frame_count) + ", expected 1 to " +
            std::to_string(kMaxFrames)
        );
    }
    if (path.keys.empty()) {
        return invalid("keys is empty, expected one at least");
    }
    for (std::size_t i = 0; i < path.keys.size(); ++i) {
        const PathKey& key = path.keys[i];
        const std::string where = key_name(i);
        if (!std::isfinite(key.frame)) {
            return invalid(where + ".frame is " + text(key.frame) + ", expected a finite number");
        }
        if (i > 0 && !(key.frame > path.keys[i - 1].frame)) {
            return invalid(
                where + ".frame is " + text(key.frame) + ", expected more than " +
                text(path.keys[i - 1].frame) + " of the key before"
            );
        }
        for (const auto& [field, vector] :
             {std::pair{"eye", key.eye}, {"target", key.target}, {"up", key.up}}) {
            if (auto checked = check_finite(where, field, vector); !checked) {
                return checked;
            }
        }
        if (key.eye == key.target) {
            return invalid(
                where + ".target is " + vector_text(key.target) + ", which is the eye itself"
            );
        }
        if (key.up == dvec3(0.0)) {
            return invalid(where + ".up is (0, 0, 0), expected a direction");
        }
    }
    if (path.keys.size() > 1) {
        if (path.keys.front().frame > 0.0) {
            return invalid(
                "keys[0].frame is " + text(path.keys.front().frame) + ", expected 0 or before"
            );
        }
        if (path.keys.back().frame < path.frame_count - 1) {
            return invalid(
                "frame_count is " + std::to_string(path.frame_count) +
                ", but the last key is at frame " + text(path.keys.back().frame)
            );
        }
    }
    return {};
}

PathPose pose_at(const CameraPath& path, double frame) noexcept {
    const std::vector<PathKey>& keys = path.keys;
    FARFIELD_ASSERT(!keys.empty());
    if (keys.size() == 1) {
        return {keys[0].eye, keys[0].target, keys[0].up};
    }
    const auto after = std::upper_bound(
        keys.begin() + 1,
        keys.end() - 1,
        frame,
        [](double value, const PathKey& key) { return value < key.frame; }
    );
    const auto segment = static_cast<std::size_t>(after - keys.begin()) - 1;
    const double length = keys[segment + 1].frame - keys[segment].frame;
    const double u = std::clamp((frame - keys[segment].frame) / length, 0.0, 1.0);
    PathPose pose{
        spline(keys, segment, u, &PathKey::eye),
        spline(keys, segment, u, &PathKey::target),
        spline(keys, segment, u, &PathKey::up)};
    if (pose.target == pose.eye) {
        pose.target = pose.eye + (keys[segment].target - keys[segment].eye);
    }
    return pose;
}

double whole_path_frame(const CameraPath& path, int index, int count) noexcept {
    FARFIELD_ASSERT(index >= 0 && index < count);
    if (index == 0) {
        return 0.0;
    }
    return static_cast<double>(path.frame_count - 1) * index / (count - 1);
}

Result<CameraPath> parse_camera_path(std::string_view text, std::string_view name) {
    return Reader(name).read(text);
}

Result<CameraPath> load_camera_path(const std::filesystem::path& file) {
    const auto content = detail::read_text(file);
    if (!content) {
        return tl::unexpected(content.error());
    }
    return parse_camera_path(*content, file.string());
}

std::string to_json(const CameraPath& path) {
    const auto array = [](const dvec3& v) { return ordered_json::array({v.x, v.y, v.z}); };
    ordered_json root;
    root["frame_count"] = path.frame_count;
    root["keys"] = ordered_json::array();
    for (const PathKey& key : path.keys) {
        ordered_json object;
        object["frame"] = key.frame;
        object["eye"] = array(key.eye);
        object["target"] = array(key.target);
        object["up"] = array(key.up);
        root["keys"].push_back(std::move(object));
    }
    return root.dump(1) + "\n";
}

Result<void> save(const CameraPath& path, const std::filesystem::path& file) {
    if (auto checked = validate(path); !checked) {
        return checked;
    }
    return detail::write_text(file, to_json(path));
}

Result<CameraPath> default_path(const Box3d& bounds, const DefaultPathOptions& options) {
    constexpr double kLongestStep = 1.0 / 20.0; // of the radius; the keys still follow the arc
    if (is_empty(bounds) || !is_finite(bounds) || bounds.lo == bounds.hi) {
        return invalid(
            "default path: the box from " + vector_text(bounds.lo) + " to " +
            vector_text(bounds.hi) + " has no radius"
        );
    }
    if (options.frames < 2 || options.frames > kMaxFrames) {
        return invalid(
            "default path: frames is " + std::to_string(options.frames) + ", expected 2 to " +
            std::to_string(kMaxFrames)
        );
    }
    const double up_length = glm::length(options.up);
    if (!(up_length > 0.0) || !std::isfinite(up_length)) {
        return invalid("default path: up is " + vector_text(options.up) + ", expected a direction");
    }

    const double radius = 0.5 * glm::length(extent(bounds));
    const double step = options.step_m.value_or(radius / 500.0);
    if (!(step > 0.0) || !(step <= kLongestStep * radius)) {
        return invalid(
            "default path: step_m is " + text(step) + ", expected above 0 and at most " +
            text(kLongestStep * radius) + ", a twentieth of the radius"
        );
    }
    const dvec3 up = options.up / up_length;
    const auto [first, second] = horizontal_axes(up);
    const dvec3 middle = center(bounds);
    double ground = std::numeric_limits<double>::infinity();
    for (unsigned i = 0; i < 8; ++i) {
        ground = std::min(ground, glm::dot(corner(bounds, i) - middle, up));
    }
    const double height = ground + 0.06 * radius;
    const double orbit = 1.15 * radius;

    // Keys so close that the spline keeps the step on the arc and cuts the corner narrowly.
    constexpr double kFramesPerKey = 10.0;
    const double last = options.frames - 1;
    const double corner_frame = std::max(0.6 * last, last - radius / step);
    const auto segments = std::max<std::int64_t>(1, std::llround(std::ceil(last / kFramesPerKey)));
    CameraPath path;
    path.frame_count = options.frames;
    path.keys.reserve(static_cast<std::size_t>(segments) + 1);
    for (std::int64_t i = 0; i <= segments; ++i) {
        const double frame = last * static_cast<double>(i) / static_cast<double>(segments);
        const double angle = std::min(frame, corner_frame) * step / orbit;
        const double inward = std::max(frame - corner_frame, 0.0) * step;
        const dvec3 direction = first * std::cos(angle) + second * std::sin(angle);
        const dvec3 eye = middle + direction * (orbit - inward) + up * height;
        path.keys.push_back({frame, eye, middle, up});
    }
    return path;
}

Result<CameraPath> height_field_path(const Box3d& bounds) {
    const dvec3 size = extent(bounds);
    if (is_empty(bounds) || !is_finite(bounds) || !(std::max(size.x, size.z) > 0.0)) {
        return invalid(
            "height field path: the box from " + vector_text(bounds.lo) + " to " +
            vector_text(bounds.hi) + " has no horizontal extent"
        );
    }
    constexpr int kFrames = 460;
    constexpr double kFramesPerKey = 5.0;
    constexpr double kRollBegins = 60.0;
    constexpr double kTurnBegins = 120.0;
    constexpr double kZoomBegins = 360.0;
    constexpr double kLast = kFrames - 1;
    const double reach = 0.5 * std::hypot(size.x, size.z);
    const double top = bounds.hi.y;
    const dvec3 middle(center(bounds).x, top, center(bounds).z);

    // From above the middle down to a low orbit; the eye's elevation tells the part of the walk.
    const double zenith = std::numbers::pi / 2.0;
    constexpr double kLow = 14.0 * std::numbers::pi / 180.0;
    const auto ease = [](double t) { return t * t * (3.0 - 2.0 * t); };
    CameraPath path;
    path.frame_count = kFrames;
    const auto segments = static_cast<int>(std::ceil(kLast / kFramesPerKey));
    for (int i = 0; i <= segments; ++i) {
        const double frame = kLast * i / segments;
        const auto part = [&](double begin, double end) {
            return std::clamp((frame - begin) / (end - begin), 0.0, 1.0);
        };
        const double elevation = std::lerp(zenith, kLow, ease(part(kRollBegins, kTurnBegins)));
        const double turn = 1.5 * std::numbers::pi * part(kTurnBegins, kZoomBegins);
        const double zoom = part(kZoomBegins, kLast);
        const double distance = reach * std::lerp(2.0 - 0.4 * part(0.0, kTurnBegins), 0.25, zoom);
        const dvec3 outward(std::cos(turn), 0.0, std::sin(turn));
        const dvec3 eye =
            middle +
            (outward * std::cos(elevation) + dvec3(0.0, std::sin(elevation), 0.0)) * distance;
        // Straight down there is no horizon to be level with: what is ahead later is up now.
        const dvec3 up =
            glm::normalize(-outward * std::sin(elevation) + dvec3(0.0, std::cos(elevation), 0.0));
        path.keys.push_back({frame, eye, middle, up});
    }
    return path;
}

} // namespace farfield::eval
