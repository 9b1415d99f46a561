// The report as one HTML file that opens offline: plots, pictures and every number of the JSON inside it.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "report/rows.h"

namespace lodestone {

// A picture that the page holds.
struct PageImage {
    std::string name;              // as Report::pictures and Report::references call it
    std::string type;              // "image/png" or "image/jpeg"
    std::vector<std::byte> bytes;  // the file as it is
};

// The whole page, every picture in it. What the page shows it computes from json_of(report) alone, so the two agree.
std::string report_page(const Report& report, std::span<const PageImage> images);

// The page of a library, beside its folders `assets` and `thumbnails`: a table that can be sorted and searched.
// rows: JSON, a list of objects with name, outcome, triangles, components, levels, bytes, seconds, peak_rss_bytes,
// message, warnings, repaired.
std::string library_page(const std::string& rows);

}  // namespace lodestone
