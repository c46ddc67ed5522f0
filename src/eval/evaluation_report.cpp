#include "compared_runs.hpp"
#include "page_text.hpp"
#include "report_plots.hpp"
#include "results_table.hpp"
#include "text_file.hpp"
#include <farfield/eval/evaluation_report.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

namespace farfield::eval {

namespace {

using detail::ComparedRun;
using detail::ComparedWalk;
using detail::escaped;
using detail::figure_text;
using detail::fixed_text;
using detail::ReportPlot;
using detail::whole_text;

constexpr std::string_view kDash = detail::kNotMeasured;

// Checks.

struct PictureSize {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
};

std::uint32_t big_endian(const std::vector<std::uint8_t>& bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t byte = 0; byte < 4; ++byte) {
        value = value << 8U | bytes[at + byte];
    }
    return value;
}

/// Size of a PNG file, which begins with its signature and its header; none for other bytes.
std::optional<PictureSize> png_size(const std::vector<std::uint8_t>& bytes) {
    constexpr std::array<std::uint8_t, 16> kStart = {
        0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n', 0, 0, 0, 13, 'I', 'H', 'D', 'R'};
    constexpr std::size_t kHeaderEnd = kStart.size() + 8;
    if (bytes.size() < kHeaderEnd || !std::equal(kStart.begin(), kStart.end(), bytes.begin())) {
        return std::nullopt;
    }
    const PictureSize size{big_endian(bytes, kStart.size()), big_endian(bytes, kStart.size() + 4)};
    constexpr std::uint32_t kMost = 0x7FFFFFFFU;
    const bool valid =
        size.width > 0 && size.height > 0 && size.width <= kMost && size.height <= kMost;
    return valid ? std::optional(size) : std::nullopt;
}

Result<void> check(const Evaluation& evaluation) {
    const auto invalid = [](const std::string& message) {
        return fail(ErrorCode::invalid_argument, "evaluation: " + message);
    };
    std::set<std::pair<std::string_view, std::string_view>> names;
    for (std::size_t index = 0; index < evaluation.runs.size(); ++index) {
        const EvaluatedRun& run = evaluation.runs[index];
        const std::string place = "runs[" + std::to_string(index) + "]";
        if (run.walk.empty() || run.name.empty()) {
            return invalid(place + "." + (run.walk.empty() ? "walk" : "name") + " is empty");
        }
        if (!names.emplace(run.walk, run.name).second) {
            return invalid(
                place + ": walk '" + run.walk + "' has another run of the name '" + run.name + "'"
            );
        }
        for (std::size_t picture = 0; picture < run.pictures.size(); ++picture) {
            if (!png_size(run.pictures[picture].png)) {
                return fail(
                    ErrorCode::bad_data,
                    "evaluation: " + place + ".pictures[" + std::to_string(picture) + "] ('" +
                        run.name + "', '" + run.pictures[picture].caption + "'), " +
                        std::to_string(run.pictures[picture].png.size()) +
                        " bytes, is not a PNG file"
                );
            }
        }
    }
    return {};
}

// The page.

/// Rules of the page; those of plots come beside them.
constexpr std::string_view kStyleSheet = R"css(
:root{color-scheme:light dark;--paper:#ffffff;--ink:#1f2933;--quiet:#5b6773;--line:#d8dfe6;
--band:#f3f6f8;--link:#0061a8;--warn:#b23a00}
@media (prefers-color-scheme:dark){:root{--paper:#14191f;--ink:#e4e9ee;--quiet:#9aa6b2;
--line:#2f3942;--band:#1b2229;--link:#79bdf2;--warn:#ff9a5c}}
*{box-sizing:border-box}
body{margin:0 auto;padding:1.2rem clamp(.8rem,3vw,2.5rem) 4rem;max-width:120rem;
background:var(--paper);color:var(--ink);
font:16px/1.5 system-ui,Arial,"Liberation Sans",Helvetica,sans-serif}
h1{font-size:1.75rem;line-height:1.2;margin:.5rem 0}
h2{font-size:1.35rem;margin:0 0 .6rem}
h3{font-size:1.1rem;margin:2rem 0 .6rem}
h4{font-size:1rem;margin:1.2rem 0 .3rem}
p,ul,dl{max-width:75ch}
ul{padding-left:1.2rem}
a{color:var(--link)}
.walk{border-top:2px solid var(--line);margin-top:2.5rem;padding-top:1.2rem}
.quiet{color:var(--quiet)}
dl.facts{display:grid;grid-template-columns:max-content 1fr;gap:.15rem 1rem;margin:0}
dl.facts dt{color:var(--quiet)}
dl.facts dd{margin:0;overflow-wrap:anywhere}
.wide{overflow-x:auto}
table{border-collapse:collapse;font-size:.85rem;font-variant-numeric:tabular-nums}
th,td{padding:.3rem .6rem;text-align:right;white-space:nowrap;border-bottom:1px solid var(--line)}
thead th{font-weight:600;vertical-align:bottom;white-space:normal;max-width:7.5em}
thead .groups th{text-align:left;border-bottom:none;color:var(--quiet);font-weight:400}
th.group,td.group{border-left:1px solid var(--line)}
tbody th{font-weight:600;text-align:left;position:sticky;left:0;background:var(--paper)}
tbody tr:nth-child(even) th,tbody tr:nth-child(even) td{background:var(--band)}
tbody .dominated th,tbody .dominated td{color:var(--quiet)}
.mark{font-weight:400;font-size:.75rem;color:var(--warn)}
tbody tr td.over{color:var(--warn)}
.plots{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,40rem),1fr));gap:1rem}
figure{margin:0;min-width:0}
.chart{overflow-x:auto;border:1px solid var(--line);border-radius:4px}
.chart svg{display:block;width:100%;min-width:42rem;height:auto}
figcaption{color:var(--quiet);font-size:.85rem}
.pictures{display:flex;flex-wrap:wrap;gap:1rem;margin-top:.4rem}
.pictures figure{max-width:100%}
.pictures .wide{max-height:90vh}
.pictures img{display:block;max-width:none;image-rendering:pixelated;background:#888}
.zoom:checked~.pictures img{width:calc(var(--width)*4);height:auto}
@media print{@page{size:landscape;margin:10mm}body{font-size:10pt;padding:0}
table{font-size:6.5pt}th,td{padding:.12rem .25rem}.wide,.chart{overflow:visible}
.plots{grid-template-columns:1fr 1fr}h2,h3,h4{break-after:avoid}
.chart svg{min-width:0}figure,tr,.worst{break-inside:avoid}.zoom,.zoom+label{display:none}
.pictures{flex-wrap:nowrap}.pictures figure{flex:1 1 0}
.pictures img,.zoom:checked~.pictures img{width:100%;height:auto}}
)css";

std::string element(std::string_view name, std::string_view text) {
    std::string result = "<";
    result += name;
    result += ">" + escaped(text) + "</";
    result += name;
    return result + ">\n";
}

/// The values of runs, each once, in their order; a dash where none has one.
template <typename Text>
std::string distinct(const ComparedWalk& walk, const Text& text_of) {
    std::vector<std::string> values;
    for (const ComparedRun& run : walk.runs) {
        const std::string value = text_of(run.run->figures);
        if (!value.empty() && std::find(values.begin(), values.end(), value) == values.end()) {
            values.push_back(value);
        }
    }
    std::string result;
    for (const std::string& value : values) {
        result += (result.empty() ? "" : ", ") + value;
    }
    return result.empty() ? std::string(kDash) : result;
}

std::string fact(std::string_view name, const std::string& value) {
    return element("dt", name) + element("dd", value);
}

std::string facts(const ComparedWalk& walk) {
    const auto count = [](const std::optional<std::uint64_t>& value) {
        return value ? whole_text(*value) : std::string();
    };
    std::string html = "<dl class=\"facts\">\n";
    html += fact("scene", distinct(walk, [](const RunReport& run) { return run.scene.name; }));
    html += fact("triangles", distinct(walk, [&](const RunReport& run) {
                     return count(run.scene.triangles);
                 }));
    html += fact("frames", distinct(walk, [](const RunReport& run) {
                     return whole_text(static_cast<std::uint64_t>(std::max(0, run.frames)));
                 }));
    html += fact("picture", distinct(walk, [](const RunReport& run) {
                     return std::to_string(run.width) + " x " + std::to_string(run.height) +
                            " pixels, " + figure_text(run.fov_deg) + "\u00B0 from top to bottom";
                 }));
    for (std::size_t device = 0; device < walk.devices.size(); ++device) {
        const bool alone = walk.devices.size() == 1;
        html += fact(
            alone ? "device" : "device " + detail::device_letter(device), walk.devices[device]
        );
    }
    return html + "</dl>\n";
}

std::string percent_text(const std::optional<double>& fraction) {
    return fraction ? figure_text(100.0 * *fraction) : std::string(kDash);
}

std::string mebibytes_text(const std::optional<std::uint64_t>& bytes) {
    constexpr double kMebibyte = 1024.0 * 1024.0;
    return bytes ? figure_text(static_cast<double>(*bytes) / kMebibyte) : std::string(kDash);
}

std::string decimals_text(const std::optional<double>& value, int decimals) {
    return value ? fixed_text(*value, decimals) : std::string(kDash);
}

/// Share of the pixels that are further off than promised, of all pixels of the frames that showed
/// an image; where those frames are not known, the number of pixels.
std::string over_bound_text(const EvaluatedRun& run) {
    const RunReport& figures = run.figures;
    if (!figures.disparity_px.over_bound) {
        return std::string(kDash);
    }
    const auto frames = static_cast<double>(std::count_if(
        run.disparity_p99_px.begin(),
        run.disparity_p99_px.end(),
        [](const std::optional<double>& value) { return value.has_value(); }
    ));
    const double pixels = frames * figures.width * figures.height;
    const std::uint64_t over = *figures.disparity_px.over_bound;
    if (pixels < 1.0) {
        return whole_text(over) + " px";
    }
    return figure_text(100.0 * static_cast<double>(over) / pixels) + " %";
}

/// One column of the table of runs.
struct Column {
    std::string group; ///< as that of the column before: one heading over both
    std::string title;
    std::string (*text)(const ComparedRun&);
};

const std::vector<Column>& columns() {
    using Run = const ComparedRun&;
    static const std::vector<Column> kColumns = {
        {"frame [ms]", "mean", [](Run r) { return figure_text(r.run->figures.frame_ms.mean); }},
        {"frame [ms]", "median", [](Run r) { return figure_text(r.run->figures.frame_ms.median); }},
        {"frame [ms]", "p99", [](Run r) { return figure_text(r.run->figures.frame_ms.p99); }},
        {"frame [ms]", "max", [](Run r) { return figure_text(r.run->figures.frame_ms.max); }},
        {"speed-up [x]",
         "overall",
         [](Run r) { return figure_text(r.run->figures.speedup.overall); }},
        {"speed-up [x]",
         "without first",
         [](Run r) { return figure_text(r.run->figures.speedup.without_first); }},
        {"disparity [px]",
         "p99",
         [](Run r) { return figure_text(r.run->figures.disparity_px.p99); }},
        {"disparity [px]",
         "max",
         [](Run r) { return figure_text(r.run->figures.disparity_px.max); }},
        {"disparity [px]",
         "promised",
         [](Run r) { return figure_text(r.run->figures.disparity_px.bound); }},
        {"disparity [px]", "pixels beyond", [](Run r) { return over_bound_text(*r.run); }},
        {"against plain geometry",
         "PSNR [dB]",
         [](Run r) { return decimals_text(r.run->figures.image.psnr_db_median, 1); }},
        {"against plain geometry",
         "SSIM",
         [](Run r) { return decimals_text(r.run->figures.image.ssim_median, 3); }},
        {"against plain geometry",
         "FLIP",
         [](Run r) { return decimals_text(r.run->figures.image.flip_mean, 4); }},
        {"against plain geometry",
         "missing [%]",
         [](Run r) { return percent_text(r.run->figures.image.missing_fraction); }},
        {"against plain geometry",
         "extra [%]",
         [](Run r) { return percent_text(r.run->figures.image.extra_fraction); }},
        {"against the truth",
         "PSNR [dB]",
         [](Run r) { return decimals_text(r.run->figures.truth.psnr_db_median, 1); }},
        {"against the truth",
         "that of geometry",
         [](Run r) { return decimals_text(r.run->figures.truth.reference_psnr_db_median, 1); }},
        {"against the truth",
         "SSIM",
         [](Run r) { return decimals_text(r.run->figures.truth.ssim_median, 3); }},
        {"against the truth",
         "FLIP",
         [](Run r) { return decimals_text(r.run->figures.truth.flip_mean, 4); }},
        {"against the truth",
         "missing [%]",
         [](Run r) { return percent_text(r.run->figures.truth.missing_fraction); }},
        {"against the truth",
         "extra [%]",
         [](Run r) { return percent_text(r.run->figures.truth.extra_fraction); }},
        {"memory [MiB]",
         "images",
         [](Run r) { return mebibytes_text(r.run->figures.memory.image_bytes_peak); }},
        {"memory [MiB]", "AOV", [](Run r) {
             return mebibytes_text(r.run->figures.memory.aov_bytes);
         }}};
    return kColumns;
}

/// Columns of a walk: with several devices, their speeds on one scale as well.
std::vector<Column> columns_of(const ComparedWalk& walk) {
    std::vector<Column> all = columns();
    if (walk.devices.size() > 1 && walk.geometry) {
        const auto after = std::find_if(all.begin(), all.end(), [](const Column& column) {
            return column.title == "without first";
        });
        all.insert(
            after + 1,
            {"speed-up [x]",
             "over the fastest geometry",
             [](const ComparedRun& run) { return figure_text(run.speedup); }}
        );
    }
    return all;
}

std::string table(const ComparedWalk& walk) {
    const std::vector<Column> all = columns_of(walk);
    const auto starts_group = [&](std::size_t index) {
        return index == 0 || all[index].group != all[index - 1].group;
    };
    std::string groups;
    std::string titles;
    for (std::size_t index = 0; index < all.size(); ++index) {
        const std::string group_class = starts_group(index) ? " class=\"group\"" : "";
        if (starts_group(index)) {
            std::size_t end = index + 1;
            while (end < all.size() && !starts_group(end)) {
                ++end;
            }
            groups += "<th class=\"group\" scope=\"colgroup\" colspan=\"" +
                      std::to_string(end - index) + "\">" + escaped(all[index].group) + "</th>";
        }
        titles += "<th scope=\"col\"" + group_class + ">" + escaped(all[index].title) + "</th>";
    }
    std::string html = "<div class=\"wide\"><table>\n<thead>\n<tr class=\"groups\"><td></td>" +
                       groups + "</tr>\n<tr><th scope=\"col\" style=\"text-align:left\">run</th>" +
                       titles + "</tr>\n</thead>\n<tbody>\n";
    for (const ComparedRun& run : walk.runs) {
        html += run.dominated ? "<tr class=\"dominated\">" : "<tr>";
        html += "<th scope=\"row\">" + escaped(detail::label(walk, run)) +
                (run.dominated ? " <span class=\"mark\">dominated</span>" : "") + "</th>";
        const std::uint64_t over = run.run->figures.disparity_px.over_bound.value_or(0);
        for (std::size_t index = 0; index < all.size(); ++index) {
            const bool warns = over > 0 && all[index].title == "pixels beyond";
            std::string classes = starts_group(index) ? "group" : "";
            if (warns) {
                classes += classes.empty() ? "over" : " over";
            }
            html += classes.empty() ? "<td>" : "<td class=\"" + classes + "\">";
            html += escaped(all[index].text(run)) + "</td>";
        }
        html += "</tr>\n";
    }
    return html + "</tbody>\n</table></div>\n";
}

/// What is said of a run that another dominates.
std::string domination_text(const ComparedWalk& walk, const ComparedRun& run) {
    const ComparedRun& other = walk.runs[run.dominated->by];
    const detail::Nearness& nearness = *run.dominated->nearness;
    std::string text = "\u201C" + detail::label(walk, run) + "\u201D is slower than ";
    text += detail::is_baseline(other.run->figures) ? "the baseline \u201C" : "\u201C";
    text += detail::label(walk, other) + "\u201D ";
    text += run.dominated->equal ? "at equal measured error"
                                 : "and further from " + std::string(nearness.target);
    text += ": " + figure_text(run.mean_ms) + " and " + figure_text(other.mean_ms) +
            " ms a frame; " + std::string(nearness.figure) + " " +
            figure_text(nearness.value(run.run->figures)) + " and " +
            figure_text(nearness.value(other.run->figures));
    return text + ".";
}

/// What the figures say, in plain words.
std::string findings(const ComparedWalk& walk) {
    std::vector<std::string> said;
    if (walk.devices.size() > 1) {
        said.push_back(
            "The runs were measured on " + std::to_string(walk.devices.size()) +
            " devices. Speed-ups \u201Coverall\u201D and \u201Cwithout first\u201D are over plain "
            "geometry on the run\u2019s own device: compare runs of different devices by "
            "milliseconds alone."
        );
        if (walk.geometry) {
            said.push_back(
                "Plain geometry is fastest on device " +
                detail::device_letter(walk.geometry->device) + ": " +
                figure_text(walk.geometry->mean_ms) + " ms a frame."
            );
        }
    }
    bool judged = false;
    std::string silent;
    for (const ComparedRun& run : walk.runs) {
        if (run.dominated) {
            said.push_back(domination_text(walk, run));
        }
        if (!run.mean_ms || detail::lacks_nearness(run.run->figures)) {
            silent +=
                (silent.empty() ? "\u201C" : ", \u201C") + detail::label(walk, run) + "\u201D";
        } else {
            judged = true;
        }
    }
    const bool none = std::none_of(walk.runs.begin(), walk.runs.end(), [](const ComparedRun& run) {
        return run.dominated.has_value();
    });
    if (none && judged && walk.runs.size() > 1) {
        said.emplace_back("No run is dominated: what is slower is nearer.");
    }
    if (!silent.empty()) {
        said.push_back("Time or error was not measured, so nothing is said of: " + silent + ".");
    }
    std::string html;
    for (const std::string& line : said) {
        html += element("li", line);
    }
    return html.empty() ? html : "<ul>\n" + html + "</ul>\n";
}

std::string figures_of(const std::vector<ReportPlot>& plots) {
    if (plots.empty()) {
        return {};
    }
    std::string html = "<div class=\"plots\">\n";
    for (const ReportPlot& plot : plots) {
        html += "<figure><div class=\"chart\">\n" + plot.element + "</div></figure>\n";
    }
    return html + "</div>\n";
}

std::string pictures_of(const EvaluatedRun& run, const std::string& title, const std::string& id) {
    std::string html = "<div class=\"worst\">\n" + element("h4", title);
    std::string told;
    const auto frame = static_cast<std::size_t>(std::max(0, run.worst_frame));
    if (run.worst_frame >= 0 && frame < run.frame_ms.size()) {
        told += figure_text(run.frame_ms[frame]) + " ms";
    }
    if (run.worst_frame >= 0 && frame < run.disparity_p99_px.size() &&
        run.disparity_p99_px[frame]) {
        told += (told.empty() ? "" : ", ") + std::string("disparity p99 ") +
                figure_text(run.disparity_p99_px[frame]) + " px";
    }
    if (!told.empty()) {
        html += "<p class=\"quiet\">" + escaped(told) + "</p>\n";
    }
    html += "<input class=\"zoom\" type=\"checkbox\" id=\"" + id + "\"/><label for=\"" + id +
            "\"> four times as large</label>\n<div class=\"pictures\">\n";
    for (const ReportPicture& picture : run.pictures) {
        const PictureSize size = *png_size(picture.png);
        const std::string width = std::to_string(size.width);
        const std::string caption = escaped(picture.caption);
        html += "<figure><div class=\"wide\"><img alt=\"" + caption + "\"";
        html += " width=\"" + width + "\" height=\"" + std::to_string(size.height) + "\"";
        html += " style=\"--width:" + width + "px\"";
        html += " src=\"data:image/png;base64," + detail::base64(picture.png) + "\"/></div>";
        html += "<figcaption>" + caption + "</figcaption></figure>\n";
    }
    return html + "</div>\n</div>\n";
}

std::string worst_frames(const ComparedWalk& walk, const std::string& id) {
    std::string html;
    std::size_t number = 0;
    for (const ComparedRun& run : walk.runs) {
        if (run.run->pictures.empty()) {
            continue;
        }
        std::string title = detail::label(walk, run);
        if (run.run->worst_frame >= 0) {
            title += ": frame " + whole_text(static_cast<std::uint64_t>(run.run->worst_frame));
        }
        html += pictures_of(*run.run, title, id + "-zoom-" + std::to_string(++number));
    }
    return html.empty() ? html : "<h3>Worst frames</h3>\n" + html;
}

constexpr std::string_view kExplanation = R"html(<section class="walk">
<h2>What the figures mean</h2>
<ul>
<li><b>Speed-up</b>: time of plain geometry over the time of the run, summed over all frames of the
walk, the first included; geometry is drawn on a sample of the frames, in between with the run.</li>
<li><b>Disparity</b>: how far from where it belongs a surface point is shown, over all pixels that
show an image. <b>Promised</b> is the largest that the technique allows any pixel, threshold and
sampling of textures together; <b>pixels beyond</b> are further off than their own promise, as a
share of all pixels of the frames that show an image.</li>
<li><b>Plain geometry</b> is the same view without images, one sample a pixel; <b>the truth</b> is
the same with many samples. <b>That of geometry</b> is how far plain geometry itself is from the
truth. PSNR and SSIM are medians over frames, and high is near; FLIP is a mean, and low is near.</li>
<li><b>Missing</b>: pixels that show background where geometry is; <b>extra</b> the reverse; both as
shares of the pixels that geometry covers.</li>
<li><b>Dominated</b>: another run of the walk takes at most 0.95 times the time and is nearer to the
truth, or as near (FLIP within 2 %, PSNR within 0.1 dB).</li>
<li>A dash is a figure that was not measured.</li>
</ul>
</section>
)html";

struct WalkPart {
    const ComparedWalk* walk = nullptr;
    std::string id;
    std::vector<ReportPlot> plots;
};

std::string page(
    const Evaluation& evaluation,
    const std::vector<WalkPart>& parts,
    const std::vector<ReportPlot>& across
) {
    const std::string title = evaluation.title.empty() ? "Evaluation" : evaluation.title;
    std::string html = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
                       "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
                       "<meta name=\"color-scheme\" content=\"light dark\"/>\n";
    html += element("title", title) + "<style>" + std::string(kStyleSheet) +
            detail::plot_style_sheet() + "</style>\n</head>\n<body>\n<header>\n" +
            element("h1", title);
    std::string notes;
    for (const std::string& note : evaluation.notes) {
        notes += element("li", note);
    }
    html += notes.empty() ? "" : "<ul>\n" + notes + "</ul>\n";
    html += "<p>All figures: <a href=\"results.csv\">results.csv</a></p>\n</header>\n";
    if (parts.empty()) {
        html += "<p>There are no runs.</p>\n";
    }
    if (parts.size() > 1) {
        html += "<nav>\n<ul>\n";
        for (const WalkPart& part : parts) {
            html += "<li><a href=\"#" + part.id + "\">" + escaped(part.walk->name) + "</a>, " +
                    whole_text(part.walk->runs.size()) +
                    (part.walk->runs.size() == 1 ? " run" : " runs") + "</li>\n";
        }
        html += "</ul>\n</nav>\n";
    }
    if (!across.empty()) {
        html += "<section class=\"walk\">\n<h2>Across walks</h2>\n" + figures_of(across) +
                "</section>\n";
    }
    for (const WalkPart& part : parts) {
        html += "<section class=\"walk\" id=\"" + part.id + "\">\n" +
                element("h2", part.walk->name) + facts(*part.walk) +
                "<h3>Runs, the fastest first</h3>\n" + table(*part.walk) + findings(*part.walk) +
                (part.plots.empty() ? "" : "<h3>Plots</h3>\n") + figures_of(part.plots) +
                worst_frames(*part.walk, part.id) + "</section>\n";
    }
    return html + std::string(kExplanation) + "</body>\n</html>\n";
}

/// Beginning of the names of a walk's files: small letters, digits and `_`, unlike all before.
std::string file_stem(const std::string& walk, std::set<std::string>& taken) {
    std::string stem;
    for (const char letter : walk) {
        const bool capital = letter >= 'A' && letter <= 'Z';
        const bool plain = (letter >= 'a' && letter <= 'z') || (letter >= '0' && letter <= '9');
        if (plain || capital) {
            stem += capital ? static_cast<char>(letter - 'A' + 'a') : letter;
        } else if (!stem.empty() && stem.back() != '_') {
            stem += '_';
        }
    }
    constexpr std::size_t kLongest = 60; // with what follows well below what file systems take
    stem = stem.substr(0, kLongest);
    while (stem.ends_with('_')) {
        stem.pop_back();
    }
    stem = stem.empty() ? "walk" : stem;
    std::string result = stem;
    for (int number = 2; !taken.insert(result).second; ++number) {
        result = stem + "_" + std::to_string(number);
    }
    return result;
}

Result<void>
write_plots(const std::vector<ReportPlot>& plots, const std::filesystem::path& folder) {
    for (const ReportPlot& plot : plots) {
        if (auto written = detail::write_text(folder / plot.file, plot.document); !written) {
            return written;
        }
    }
    return {};
}

} // namespace

Result<void> write_report(const Evaluation& evaluation, const std::filesystem::path& folder) {
    if (auto valid = check(evaluation); !valid) {
        return valid;
    }
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error || !std::filesystem::is_directory(folder, error)) {
        return fail(
            ErrorCode::device,
            folder.string() + ": cannot be made a folder" +
                (error ? ": " + error.message() : std::string())
        );
    }
    const std::vector<ComparedWalk> walks = detail::compare(evaluation);
    std::vector<WalkPart> parts;
    parts.reserve(walks.size());
    std::set<std::string> stems;
    for (const ComparedWalk& walk : walks) {
        parts.push_back(
            {&walk,
             "walk-" + std::to_string(parts.size() + 1),
             detail::plots_of_walk(walk, file_stem(walk.name, stems))}
        );
    }
    const std::vector<ReportPlot> across = detail::plots_across_walks(walks);
    for (const WalkPart& part : parts) {
        if (auto written = write_plots(part.plots, folder); !written) {
            return written;
        }
    }
    if (auto written = write_plots(across, folder); !written) {
        return written;
    }
    const std::string table = detail::results_csv(evaluation);
    if (auto written = detail::write_text(folder / "results.csv", table); !written) {
        return written;
    }
    const std::string overshoots = detail::overshoots_csv(evaluation);
    if (auto written = detail::write_text(folder / "overshoots.csv", overshoots); !written) {
        return written;
    }
    return detail::write_text(folder / "report.html", page(evaluation, parts, across));
}

} // namespace farfield::eval
