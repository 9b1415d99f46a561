#include "report/rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "report/markdown.h"
#include "report/page.h"

namespace lodestone {
namespace {

Row row(const std::string& backend, double pixel_error, double ms, double similarity, double deviation) {
    Row r;
    r.backend = backend;
    r.pixel_error = pixel_error;
    r.fps_mean = 1000 / ms;
    r.ssim = similarity;
    r.max_pixel_deviation = deviation;
    return r;
}

const EqualError& found(const std::vector<EqualError>& all, uint32_t of, const std::string& metric,
                        const std::string& backend) {
    return *std::ranges::find_if(
        all, [&](const EqualError& e) { return e.row == of && e.metric == metric && e.backend == backend; });
}

TEST(Rows, TheTableHasALinePerRow) {
    const std::vector<Row> rows(3, row("lod", 1, 10, 0.9, 1));
    const std::string table = report_table(rows);
    EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 3);
}

TEST(EqualErrors, ReadsACurveWhereItIsAsGoodAsTheRow) {
    const std::vector<Row> rows{row("full", 1, 100, 0.97, 0), row("vgi", 1, 10, 0.9, 1.5),
                                row("discrete", 1, 40, 0.95, 1), row("discrete", 4, 10, 0.85, 4)};
    const auto all = at_equal_error(rows);
    // Half way between two rows, times and errors geometrically.
    const EqualError& e = found(all, 1, "ssim", "discrete");
    EXPECT_EQ(e.where, "between");
    EXPECT_NEAR(e.pixel_error, 2, 1e-9);
    EXPECT_NEAR(e.ms, 20, 1e-9);
    EXPECT_NEAR(e.ratio, 2, 1e-9);
    EXPECT_EQ(e.value, 0.9);
    EXPECT_NEAR(found(all, 1, "max_pixel_deviation", "discrete").ms, 40 * std::pow(0.25, 1.0 / 6), 1e-9);
    // A curve that is better even at its end, and one that never gets there.
    EXPECT_EQ(found(all, 3, "ssim", "vgi").where, "at least");
    EXPECT_EQ(found(all, 0, "ssim", "vgi").where, "never");
    EXPECT_NEAR(found(all, 0, "ssim", "vgi").ratio, 0.1, 1e-9);
    // Nobody is compared with itself, and nobody with `full`'s deviation from itself.
    for (const EqualError& one : all) {
        EXPECT_NE(one.backend, rows[one.row].backend);
        EXPECT_FALSE(one.row == 0 && one.metric == "max_pixel_deviation");
    }
}

TEST(Page, HoldsTheNumbersOfTheJsonAndThePictures) {
    Report report;
    report.machine.device = "a </script> device";
    report.scene = "rock";
    report.rows = {row("full", 1, 100, 0.97, 0), row("vgi", 1, 10, 0.9, 1.5)};
    report.references = {"r.png"};
    report.pictures = {{1, 0, "p.png", "d.png"}};
    const std::vector<std::byte> bytes{std::byte{'M'}, std::byte{'a'}, std::byte{'n'}, std::byte{'M'}};
    const std::vector<PageImage> images{{"p.png", "image/jpeg", bytes}};
    const std::string page = report_page(report, images);
    for (const char* part : {"{{style}}", "{{chart library}}", "{{data}}", "{{script}}"})
        EXPECT_EQ(page.find(part), std::string::npos) << part;
    EXPECT_EQ(page.find("</script> device"), std::string::npos);
    const std::string mark = "id=\"data\">";
    const size_t begin = page.find(mark) + mark.size();
    const auto data = nlohmann::ordered_json::parse(page.substr(begin, page.find("</script>", begin) - begin));
    EXPECT_EQ(data["report"], json_of(report));
    EXPECT_EQ(data["images"]["p.png"], "data:image/jpeg;base64,TWFuTQ==");
    EXPECT_NE(page.find("Chart.js v3"), std::string::npos);
    EXPECT_EQ(page.find("http-equiv"), std::string::npos);
    EXPECT_EQ(page.find("src=\"http"), std::string::npos) << "the page opens offline";
}

TEST(Page, NamesDoNotLeaveTheirPlace) {
    Report report;
    report.scene = "<!--<script>{{script}}";
    const std::string page = report_page(report, {});
    EXPECT_EQ(page.find("<!--<script>"), std::string::npos) << "after that, </script> would end nothing";
    const std::string mark = "id=\"data\">";
    const size_t begin = page.find(mark) + mark.size();
    const auto data = nlohmann::ordered_json::parse(page.substr(begin, page.find("</script>", begin) - begin));
    EXPECT_EQ(data["report"]["scene"], report.scene);
    EXPECT_NE(page.find("document.getElementById('data')", begin), std::string::npos);
    const std::string text = report_markdown(report);
    EXPECT_EQ(text.find('<'), std::string::npos) << text;
    EXPECT_EQ(text.find("## &lt;!--&lt;script&gt;{{script}}\n"), 0u) << text;
}

}  // namespace
}  // namespace lodestone
