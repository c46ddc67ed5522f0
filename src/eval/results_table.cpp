#include "results_table.hpp"

#include "page_text.hpp"

#include <nlohmann/json.hpp>

#include <cstddef>
#include <vector>

namespace farfield::eval::detail {

namespace {

using nlohmann::ordered_json;

/// Where a figure is in the JSON of a run.
struct Leaf {
    std::string group; ///< empty: at the top
    std::string key;

    [[nodiscard]] std::string column() const { return group.empty() ? key : group + "." + key; }
};

std::vector<Leaf> leaves() {
    // Of what may be missing as a whole, the keys show only where it is there.
    RunReport whole;
    whole.cost_model.emplace();
    const ordered_json json = ordered_json::parse(to_json(whole));
    std::vector<Leaf> result;
    for (const auto& [key, value] : json.items()) {
        if (!value.is_object()) {
            result.push_back({"", key});
            continue;
        }
        for (const auto& [inner, figure] : value.items()) {
            result.push_back({key, inner});
        }
    }
    return result;
}

std::string quoted(const std::string& text) {
    if (text.find_first_of(",\"\r\n") == std::string::npos) {
        return text;
    }
    std::string result = "\"";
    for (const char letter : text) {
        result += letter;
        if (letter == '"') {
            result += letter;
        }
    }
    return result + "\"";
}

/// A figure as a cell; what JSON cannot hold is empty.
std::string figure_text(const ordered_json& figure) {
    if (figure.is_string()) {
        return quoted(figure.get<std::string>());
    }
    const std::string text = figure.dump();
    return text == "null" ? std::string() : text;
}

std::string cell(const ordered_json& report, const Leaf& leaf) {
    const ordered_json& group = leaf.group.empty() ? report : report[leaf.group];
    if (group.is_null() || group[leaf.key].is_null()) {
        return {};
    }
    return figure_text(group[leaf.key]);
}

} // namespace

std::string results_csv(const Evaluation& evaluation) {
    const std::vector<Leaf> columns = leaves();
    std::string text = "walk,name";
    for (const Leaf& leaf : columns) {
        text += "," + leaf.column();
    }
    text += "\n";
    for (const EvaluatedRun& run : evaluation.runs) {
        text += quoted(valid_utf8(run.walk)) + "," + quoted(valid_utf8(run.name));
        ordered_json report = ordered_json::parse(to_json(run.figures));
        for (const Leaf& leaf : columns) {
            text += "," + cell(report, leaf);
        }
        text += "\n";
    }
    return text;
}

std::string overshoots_csv(const Evaluation& evaluation) {
    std::string text =
        "walk,run,node,level,kind,diagonal_m,distance_m,frame,disparity_px,promise_px,pixels\n";
    for (const EvaluatedRun& run : evaluation.runs) {
        for (const ReportOvershoot& overshoot : run.overshoots) {
            const NodeOvershoot& worst = overshoot.worst;
            text += quoted(valid_utf8(run.walk)) + "," + quoted(valid_utf8(run.name));
            for (const ordered_json& value :
                 {ordered_json(worst.node),
                  ordered_json(overshoot.level),
                  ordered_json(overshoot.leaf ? "leaf" : "interior"),
                  ordered_json(overshoot.diagonal_m),
                  ordered_json(overshoot.distance_m),
                  ordered_json(worst.frame),
                  ordered_json(worst.disparity_px),
                  ordered_json(worst.promise_px),
                  ordered_json(worst.pixels)}) {
                text += "," + figure_text(value);
            }
            text += "\n";
        }
    }
    return text;
}

} // namespace farfield::eval::detail
