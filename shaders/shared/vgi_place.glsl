// Places on an atlas: pages that are there, where the ray through a pixel meets the surface itself, and the chart that lies
// where a triangle of moved corners is drawn.
#ifndef LODESTONE_VGI_PLACE_GLSL
#define LODESTONE_VGI_PLACE_GLSL

#include "shared/vgi.glsl"

// A point of the world, lattice units.
vec3 lattice_of(vec3 world, InstanceConstants instance, VgiAsset asset) {
    vec3 at = transpose(mat3(instance.normal_to_world)) * (world - instance.object_to_world[3].xyz);
    return (at - vec3(asset.origin_x, asset.origin_y, asset.origin_z)) / asset.step;
}

struct FoundPage {
    uint slot, level;
    vec2 place;  // in it, 0 .. 1
};

// The finest page there that covers a place of a chart (0 .. 1), no finer than `wanted`.
// first_entry: of the chart in the page table. base: the coarsest pages' level.
FoundPage find_page(uint first_entry, vec2 place, uint base, uint wanted) {
    uint before = base - wanted;
    uvec2 page = min(uvec2(place * float(1u << before)), uvec2((1u << before) - 1u));
    uint entry = page_at(first_entry + ((1u << (2u * before)) - 1u) / 3u + (page.y << before) + page.x);
    uint level = entry & 15u;
    page >>= level - wanted;
    return FoundPage(entry >> 4, level, clamp(place * float(1u << (base - level)) - vec2(page), 0.0, 1.0));
}

// What four samples of positions around a place tell, lattice units: the surface there, and its cell's edges.
struct SurfaceCell {
    vec3 at, along_x, along_y;
};
// first: the page's first sample; its cells are so many. at: in cells; outside of the page its last ones go on.
// stride: log2 of the cells that are taken as one.
SurfaceCell surface_cell(uint first, uint cells, vec2 at, uint stride) {
    vec2 local = at / float(1u << stride);
    uvec2 low = uvec2(clamp(local, vec2(0.0), vec2(float((cells >> stride) - 1u))));
    vec2 f = local - vec2(low);
    uint row = cells + 1u, corner = first + ((low.y * row + low.x) << stride);
    vec3 a = lattice(geometry_at(corner)), b = lattice(geometry_at(corner + (1u << stride)));
    vec3 c = lattice(geometry_at(corner + (row << stride))), d = lattice(geometry_at(corner + ((row + 1u) << stride)));
    return SurfaceCell(mix(mix(a, b, f.x), mix(c, d, f.x), f.y), mix(b - a, d - c, f.y), mix(c - a, d - b, f.x));
}

// A page of positions around a place of a chart, and how many of its cells, as a power of two, are taken as one for cells of
// level `fit` of the chart's own.
struct PositionPage {
    FoundPage found;
    uint first, stride;  // first: its first sample
};
PositionPage position_page(vec2 place, uint chart, int fit, VgiAsset asset) {
    uint shift = uint(findMSB(asset.page_cells)), base = uint(findMSB(asset.cells)) - shift;
    FoundPage found = find_page(asset.first_page + chart * asset.pages, place, base, uint(clamp(fit, 0, int(base))));
    return PositionPage(found, found.slot * LODE_VGI_PAGE_TEXELS(asset.page_cells), uint(clamp(fit - int(found.level), 0, int(shift))));
}
// The level of positions whose cells are as large as those of a level of attributes.
int level_of_positions(int of_attributes, VgiAsset asset) {
    return of_attributes - int(asset.attribute_cells) + findMSB(asset.cells);
}

// What is drawn is up to the pixel error away from the surface: whatever is looked up at the place that was drawn is seen
// as far from where it belongs. The surface itself is known better, from samples that no triangle was made of: this is
// the place where a pixel's ray meets what they tell, near the place that was drawn. As in relief mapping,
//   Policarpo, Oliveira, Comba, "Real-time relief mapping on arbitrary polygonal surfaces", I3D 2005,
// but nothing is searched for: how far the place has to move is read off the distance to the ray (Premecz, "Iterative
// parallax mapping with slope information", CESCG 2006), along a mean of the surface, for slopes of single cells lead
// astray; and steps that overshoot are mended by what the step before did (Anderson, "Iterative procedures for nonlinear
// integral equations", JACM 1965, with a memory of one).
//
// place: that was drawn, 0 .. 1. world: the same in the world. lod: log2 of samples of attributes that a pixel spans.
vec2 surface_place(vec2 place, uint chart, vec3 world, float lod, InstanceConstants instance, VgiAsset asset) {
    const uint mean_stride = 2u, most_steps = 12u;
    const float grazing = 0.02;  // square of a cosine, from which on steps are held back
    // Cells of pixels' size: steps that are shorter are the last; from farther away there is less and less of a way, from
    // twice as far none.
    const float near = 0.07, most_cells = 3.0;
    uint page_shift = uint(findMSB(asset.page_cells)), base = uint(findMSB(asset.cells)) - page_shift;
    PositionPage page = position_page(place, chart, level_of_positions(int(floor(lod - 0.3)), asset), asset);
    FoundPage found = page.found;
    uint first = page.first, stride = page.stride;
    // Lattice units.
    vec3 seen = lattice_of(world, instance, asset);
    ViewConstants view = frame.views[draw_constants.view];
    vec3 away = view.eye.w > 0.0 ? world - view.eye.xyz : view.forward.xyz;
    vec3 ray = normalize(transpose(mat3(instance.normal_to_world)) * away);

    vec2 start = found.place * float(asset.page_cells), at = start;
    uint mean = min(stride + mean_stride, page_shift);
    SurfaceCell around = surface_cell(first, asset.page_cells, at, mean);
    vec3 normal = cross(around.along_x, around.along_y);
    float facing = dot(normal, ray);
    // Where samples are one and the same there is no way to go.
    float by = float(1u << mean) * facing / max(facing * facing + grazing * dot(normal, normal), 1e-20);
    vec3 to_x = by * cross(around.along_y, ray), to_y = by * cross(ray, around.along_x);

    float size = float(1u << stride);
    vec2 last_at = at, last_way = vec2(0.0), best = at;
    float least = 1e30, first_side = 0.0;
    for (uint step = 0u; step < most_steps; ++step) {
        SurfaceCell cell = surface_cell(first, asset.page_cells, at, stride);
        vec3 off = seen - cell.at;
        vec2 way = vec2(dot(off, to_x), dot(off, to_y)), change = way - last_way;
        // The other side of a fold is not what was drawn.
        float side = dot(cross(cell.along_x, cell.along_y), ray);
        if (step == 0u) first_side = side;
        bool turned = side * first_side < 0.0;
        if (dot(way, way) < least && !turned) {
            least = dot(way, way);
            best = at;
        }
        float back = step == 0u ? 0.0 : clamp(dot(way, change) / max(dot(change, change), 1e-12), 0.0, 0.7);
        vec2 next = at + way - back * (at - last_at + change);
        last_at = at;
        last_way = way;
        at = next;
        if (length(way) < near * size) {
            if (!turned) best = at;
            break;
        }
    }
    // Where steps lead astray, the nearest place that they came by.
    vec2 moved = best - start;
    moved *= clamp(2.0 - length(moved) / (most_cells * size), 0.0, 1.0);
    return clamp(place + moved / float(asset.page_cells << (base - found.level)), 0.0, 1.0);
}

// The point of a triangle nearest to the origin, as weights of its corners.
//   Ericson, "Real-Time Collision Detection", 2005, 5.1.5.
vec3 nearest_on_triangle(vec3 a, vec3 b, vec3 c) {
    vec3 ab = b - a, ac = c - a;
    float d1 = -dot(ab, a), d2 = -dot(ac, a), d3 = -dot(ab, b), d4 = -dot(ac, b), d5 = -dot(ab, c), d6 = -dot(ac, c);
    float va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
    if (d1 <= 0.0 && d2 <= 0.0) return vec3(1.0, 0.0, 0.0);
    if (d3 >= 0.0 && d4 <= d3) return vec3(0.0, 1.0, 0.0);
    if (d6 >= 0.0 && d5 <= d6) return vec3(0.0, 0.0, 1.0);
    // Edges that are points are left to the others.
    if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && d1 > d3) return vec3(1.0 - d1 / (d1 - d3), d1 / (d1 - d3), 0.0);
    if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 && d2 > d6) return vec3(1.0 - d2 / (d2 - d6), 0.0, d2 / (d2 - d6));
    float along = d4 - d3, back = d5 - d6;
    if (va <= 0.0 && along >= 0.0 && back >= 0.0 && along + back > 0.0) return vec3(0.0, back, along) / (along + back);
    vec3 weight = max(vec3(va, vb, vc), vec3(0.0));
    float sum = weight.x + weight.y + weight.z;
    return sum > 0.0 ? weight / sum : vec3(1.0, 0.0, 0.0);
}

struct ChartPlace {
    uint chart;
    vec2 place;  // in it, 0 .. 1
};

// Square of how far a place is from a box of charts; lattice units.
float away_from(uvec4 box, vec3 at) {
    vec3 low = vec3(box.xyz & 0xffffu), high = vec3(box.xyz >> 16);
    vec3 off = max(max(low - at, at - high), vec3(0.0));
    return dot(off, off);
}

// The chart whose two triangles are nearest, and where they are that: boxes are looked into from the nearest on
// (vgi/draw/corners/chart_boxes.h). Where too many are as near, the best of those that were looked into.
// at: lattice units. facing: which way what is drawn there faces, object space, or 0. The other side of something thin is
// as near: a chart that faces another way counts for farther, by some times its size. enough: lattice units; nothing is
// looked for that is nearer by less.
ChartPlace chart_at(vec3 at, vec3 facing, float enough, VgiAsset asset) {
    const float other_side = 16.0;  // squares of a chart's diagonal
    const uint most_boxes = 256u;
    ChartPlace best = ChartPlace(0u, vec2(0.5));
    float least = 1e30, worth = least;  // squares; what boxes have to be nearer than
    uint stack[LODE_VGI_BOX_DEPTH + 1];
    stack[0] = 0u;
    uint looked_into = 0u;
    for (uint waiting = 1u; waiting > 0u && looked_into < most_boxes; ++looked_into) {
        uvec4 box = corner_at(asset.first_box + stack[--waiting]);
        if (!(away_from(box, at) < worth)) continue;
        if ((box.w & LODE_VGI_BOX_OF_CHART) == 0u) {
            bool second = away_from(corner_at(asset.first_box + box.w + 1u), at) < away_from(corner_at(asset.first_box + box.w), at);
            stack[waiting] = box.w + (second ? 0u : 1u);
            stack[waiting + 1u] = box.w + (second ? 1u : 0u);
            waiting += 2u;
            continue;
        }
        uint chart = box.w & ~LODE_VGI_BOX_OF_CHART;
        uvec4 corners = corner_at(asset.first_corners_of_charts + chart);
        vec3 p[4];
        for (uint i = 0u; i < 4u; ++i) p[i] = lattice(corner_at(asset.first_corner + corners[i]).xy) - at;
        vec3 falling = p[2] - p[0], rising = p[3] - p[1];
        float farther = other_side * max(dot(falling, falling), dot(rising, rising));
        for (uint upper = 0u; upper < 2u; ++upper) {
            vec3 b = p[1u + upper], c = p[2u + upper];
            vec3 weight = nearest_on_triangle(p[0], b, c);
            vec3 off = weight.x * p[0] + weight.y * b + weight.z * c;
            float away = dot(off, off);
            if (dot(cross(b - p[0], c - p[0]), facing) < 0.0) away += farther;
            if (away < least) {
                least = away;
                worth = max(sqrt(away) - enough, 0.0);
                worth *= worth;
                best = ChartPlace(chart, upper == 0u ? vec2(weight.y + weight.z, weight.z) : vec2(weight.y, weight.y + weight.z));
            }
        }
    }
    return best;
}

#endif
