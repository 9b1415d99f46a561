// Order statistics of small samples.
#pragma once

#include <span>

namespace lodestone {

// Linear interpolation between closest ranks; fraction in [0, 1]; samples need not be sorted; 0 for an empty span.
double percentile(std::span<const double> samples, double fraction);
inline double median(std::span<const double> samples) { return percentile(samples, 0.5); }
double mean(std::span<const double> samples);

}  // namespace lodestone
