// The parts of the report's page, embedded at build time: src/report/page/, and Chart.js as Debian ships it.
#pragma once

#include <string_view>

namespace lodestone::page_texts {

extern const std::string_view page_html, page_css, page_js, chart_js, library_html, library_js;

}  // namespace lodestone::page_texts
