#include "report/markdown.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/statistics.h"
#include "base/text.h"

namespace lodestone {

namespace {

// With so many digits behind the point.
std::string number(double value, int digits) {
    char text[64];
    std::snprintf(text, sizeof text, "%.*f", digits, value);
    return text;
}

// With three digits that count.
std::string rounded(double value) {
    char text[64];
    std::snprintf(text, sizeof text, "%.3g", value);
    return text;
}

// Text as it is meant: what would be markup, or end a line or a cell, is escaped.
std::string plain(const std::string& text) {
    std::string out;
    for (const char c : printable(text)) {
        if (c == '<')
            out += "&lt;";
        else if (c == '>')
            out += "&gt;";
        else if (c == '&')
            out += "&amp;";
        else if (std::string_view("\\`*[]|").find(c) != std::string_view::npos)
            out += {'\\', c};
        else
            out += c;
    }
    return out;
}

std::string line(const std::vector<std::string>& cells) {
    std::string text = "|";
    for (const std::string& cell : cells) text += " " + plain(cell) + " |";
    return text + "\n";
}

std::string headings(const std::vector<std::string>& cells) {
    std::string text = line(cells) + "|";
    for (size_t i = 0; i < cells.size(); ++i) text += "---|";
    return text + "\n";
}

std::string rows_table(const Report& report) {
    std::string text = headings({"drawn by", "pixel error", "triangles", "ms, median", "p99", "device ms",
                                 "frames/s, overlapping", "least", "most", "plan, CPU ms", "other threads, CPU ms",
                                 "ACMR", "PSNR, dB", "SSIM", "deviation, px", "leaks", "MB held"});
    for (const Row& row : report.rows) {
        const auto of_pictures = [&](const std::string& cell) { return row.compared ? cell : "-"; };
        text += line({name_of(row), row.backend == "full" ? "-" : rounded(row.pixel_error), number(row.triangles, 0),
                      rounded(row.ms_median), rounded(row.ms_p99), rounded(row.gpu_ms), number(row.throughput_fps, 1),
                      number(row.throughput_fps_min, 1), number(row.throughput_fps_max, 1), number(row.cpu_plan_ms, 2),
                      number(row.cpu_ms, 2), number(row.acmr, 3), of_pictures(number(row.psnr_db, 2)),
                      of_pictures(number(row.ssim, 4)), of_pictures(number(row.max_pixel_deviation, 2)),
                      of_pictures(std::to_string(row.background_leaks)),
                      number(static_cast<double>(row.resident_bytes) / 1e6, 0)});
    }
    return text;
}

// What the others need to look as good as each row of the backends the project is about.
std::string equal_table(const Report& report) {
    std::string text;
    for (const EqualError& e : at_equal_error(report.rows)) {
        const Row& row = report.rows[e.row];
        if (e.metric != "ssim" || row.backend == "full" || row.backend == "discrete" || row.backend == e.backend)
            continue;
        if (text.empty())
            text = "\nAt equal SSIM:\n\n" +
                   headings({"against", "pixel error", "SSIM", "drawn by", "pixel error", "its time, of the first's"});
        const std::string ratio = e.where == "never"      ? "never as good"
                                  : e.where == "at least" ? "at most " + number(e.ratio, 2)
                                                          : number(e.ratio, 2);
        text += line({name_of(row), rounded(row.pixel_error), number(e.value, 4), name_of(e),
                      e.backend == "full" ? "-" : rounded(e.pixel_error), ratio});
    }
    return text;
}

std::string steered_table(const Report& report) {
    if (report.steered.empty()) return {};
    std::string text = "\nSteered to hold a frame time:\n\n" +
                       headings({"drawn by", "ms wanted", "ms, median", "p99", "pixel error, median"});
    for (const SteeredFlight& flight : report.steered) {
        text += line({name_of(flight), rounded(flight.target_ms), number(median(flight.ms), 1),
                      number(percentile(flight.ms, 0.99), 1), rounded(median(flight.pixel_error))});
    }
    return text;
}

}  // namespace

std::string report_markdown(const Report& report) {
    const Machine& m = report.machine;
    const uint32_t frames = report.rows.empty() ? 0 : report.rows[0].frames;
    return "## " + plain(report.scene) + "\n\n" + plain(m.device) + (m.software ? " (software rasteriser)" : "") +
           ", " + plain(m.driver) + "; " + plain(m.cpu) + "; commit " + m.commit + "; " + report.size + ", " +
           std::to_string(frames) + " frames\n\n" + rows_table(report) + equal_table(report) + steered_table(report);
}

}  // namespace lodestone
