#include "eval/json_text.hpp"
#include "eval/text_file.hpp"
#include <farfield/eval/cost_model_file.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <utility>

namespace farfield::eval {

namespace {

using nlohmann::ordered_json;

constexpr std::pair<const char*, double CostModel::*> kFields[] = {
    {"triangle_s", &CostModel::triangle_s},
    {"draw_call_s", &CostModel::draw_call_s},
    {"image_quad_s", &CostModel::image_quad_s},
    {"image_pixel_s", &CostModel::image_pixel_s},
    {"pass_s", &CostModel::pass_s},
    {"texel_s", &CostModel::texel_s},
    {"geometry_pixel_s", &CostModel::geometry_pixel_s},
    {"splat_s", &CostModel::splat_s},
    {"cube_s", &CostModel::cube_s},
    {"cell_s", &CostModel::cell_s}};

} // namespace

Result<CostModel> parse_cost_model(std::string_view text, std::string_view name) {
    const auto bad = [&](const std::string& message) {
        return fail(ErrorCode::bad_data, std::string(name) + ": " + message);
    };
    ordered_json root;
    // The parser tells line and column only by its exception; nothing leaves this function.
    try {
        root = ordered_json::parse(text);
    } catch (const ordered_json::exception& exception) {
        return bad(std::string("not JSON: ") + exception.what());
    }
    if (!root.is_object()) {
        return bad("the file is " + detail::shown(root) + ", expected an object");
    }
    CostModel model;
    for (const auto& [key, field] : kFields) {
        if (!root.contains(key)) {
            return bad(std::string("no \"") + key + "\"");
        }
        const ordered_json& value = root[key];
        if (!value.is_number()) {
            return bad(std::string(key) + " is " + detail::shown(value) + ", expected a number");
        }
        model.*field = value.get<double>();
    }
    for (const auto& member : root.items()) {
        const bool known =
            std::any_of(std::begin(kFields), std::end(kFields), [&](const auto& field) {
                return member.key() == field.first;
            });
        if (!known) {
            return bad("unknown key \"" + member.key() + "\": " + detail::shown(member.value()));
        }
    }
    if (auto valid = validate(model); !valid) {
        return bad(valid.error().message);
    }
    return model;
}

Result<CostModel> load_cost_model(const std::filesystem::path& file) {
    const auto text = detail::read_text(file);
    if (!text) {
        return tl::unexpected(text.error());
    }
    return parse_cost_model(*text, file.string());
}

std::string to_json(const CostModel& model) {
    ordered_json root;
    for (const auto& [key, field] : kFields) {
        root[key] = model.*field;
    }
    constexpr int kIndent = 1;
    return root.dump(kIndent) + "\n";
}

Result<void> save(const CostModel& model, const std::filesystem::path& file) {
    if (auto valid = validate(model); !valid) {
        return valid;
    }
    return detail::write_text(file, to_json(model));
}

} // namespace farfield::eval
