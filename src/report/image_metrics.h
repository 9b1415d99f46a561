// How far a picture is from another: luminance metrics over covered pixels, holes, and geometric deviation in pixels.
// Pictures are compared as they are shown (sRGB values); alpha > 0 marks coverage.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <span>
#include <vector>

#include "frame/picture.h"
#include "frame/view.h"
#include "mesh/distance/distance.h"

namespace lodestone {

// Means of factor x factor pixels in linear light; alpha becomes the covered share, depth the nearest. Width and height
// are multiples of the factor.
Picture downsampled(const Picture& picture, uint32_t factor);

// 1 per pixel that either picture covers. Equal sizes, here and below.
std::vector<uint8_t> covered_union(const Picture& a, const Picture& b);

inline constexpr double most_psnr_db = 100;  // in place of infinity
// Peak signal-to-noise ratio of luminance (Rec. 709 weights) over the pixels of the mask, decibels; most_psnr_db where
// nothing differs or the mask is empty.
double psnr_db(const Picture& a, const Picture& b, const std::vector<uint8_t>& mask);

// Structural similarity, mean over the pixels of the mask, -1 .. 1; 1 for equal pictures. Windows are Gaussian, 11
// pixels wide. Wang, Bovik, Sheikh, Simoncelli, "Image quality assessment: from error visibility to structural
// similarity", IEEE TIP 2004.
double ssim(const Picture& a, const Picture& b, const std::vector<uint8_t>& mask);

// Where and how much luminance differs, as colours from black through red and yellow to white at a quarter of the
// range; pixels that neither covers are dark blue. Opaque.
Picture difference_map(const Picture& a, const Picture& b);

// Pixels that `picture` leaves uncovered though `full` covers all pixels around them to a distance of two more than the
// outline may be off by: cracks and holes. pixel_error: that, in pixels.
uint64_t background_leaks(const Picture& picture, const Picture& full, double pixel_error);
// The edges that one triangle alone has, as segments; nothing where there are none. corners: three per triangle.
std::unique_ptr<ClosestSurface> rims_of(std::span<const glm::vec3> corners);
// Those of background_leaks around which one sheet of `full` covers every pixel, and ends nowhere. Where a part
// ends in front of another, both outlines may be off by what was asked, and what is behind is seen between them: that
// leaks and is no crack. full_surface and its rims, or null: in world space; both pictures drawn from `view`.
uint64_t cracks(const Picture& picture, const Picture& full, const ClosestSurface& full_surface,
                const ClosestSurface* rims, const View& view, double pixel_error);

// Finds where the pixels of pictures drawn from a view lie, by their depth.
class PixelPlaces {
public:
    // view: with a camera; must outlive this.
    explicit PixelPlaces(const View& view);
    // Where a pixel lies.
    struct Place {
        glm::dvec3 world;            // the pixel's middle, in world space
        double pixels_per_unit = 0;  // how long a unit of world space is there, pixels
    };
    // x, y: within the picture; the pixel is covered.
    Place of(const Picture& picture, size_t x, size_t y) const;

private:
    const View* view_;
    glm::dmat4 world_to_view_, clip_to_world_;
};

// The largest distance, in pixels at its depth, from the surface one picture shows to the surface drawn in the other,
// both ways. A pixel shows the point of the surface drawn that is nearest to where its depth puts it. Surfaces in world
// space; both pictures drawn from `view`.
double max_pixel_deviation(const Picture& picture, const ClosestSurface& surface, const Picture& full,
                           const ClosestSurface& full_surface, const View& view);

}  // namespace lodestone
