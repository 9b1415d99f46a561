// The report as a page of Markdown: its numbers without plots and pictures, to be kept beside what it was made of.
#pragma once

#include <string>

#include "report/rows.h"

namespace lodestone {

// The whole page.
std::string report_markdown(const Report& report);

}  // namespace lodestone
