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

}  // namespace lodestone
