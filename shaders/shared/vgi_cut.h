// A grid cut made by the device (shaders/vgi/cut_*.comp), declared once for C++ and GLSL: what it reads, and the
// arithmetic of its tests. Both compile the same lines; they add and multiply and do nothing that a device may round in
// its own way, so both choose the same nodes, bit for bit.
#ifndef LODESTONE_VGI_CUT_H
#define LODESTONE_VGI_CUT_H

// Bindings of descriptor set 1, beside those of vgi_texels.h.
#define LODE_CUT_INSTANCES 8  // VgiCutInstance records
#define LODE_CUT_BOUNDS 9     // VgiCutPage per page of positions
#define LODE_CUT_SIDES 10     // four per chart: chart | side << 30; LODE_CUT_ABSENT where the surface ends
#define LODE_CUT_STATES 11    // per node of every instance; 0 of nodes that are in no list
#define LODE_CUT_LEAVES 12    // per chart of every instance: nodes that are drawn
#define LODE_CUT_RECORDS 13   // VkDrawIndirectCommand
#define LODE_CUT_FINDINGS 14  // triangles of views[0], nodes, then two words per page: 1 where it is used, and a wish
#define LODE_CUT_LISTS 15     // VgiCutList
#define LODE_CUT_ENTRIES 16   // of all lists: numbers of nodes' states

#define LODE_CUT_VIEWS 8  // as LODE_MOST_VIEWS
#define LODE_CUT_ABSENT 0xffffffffu
#define LODE_CUT_GROUP 64            // invocations of a workgroup
#define LODE_CUT_MOST_GROUPS 65535u  // of a dispatch
#define LODE_CUT_RECORD_PATCHES 128  // to a draw: lavapipe takes time by their square
#define LODE_CUT_RECORD_WORDS 4
#define LODE_CUT_FIRST_FINDING 2  // word of the first page

// Lists: one for each depth, nodes of level L - depth where L is their atlas' coarsest level; then of what is drawn.
#define LODE_CUT_DEPTHS 14
#define LODE_CUT_DRAWN 14
#define LODE_CUT_ALL 15  // has no entries of its own: workgroups of the lists by depth, all together
#define LODE_CUT_LIST_COUNT 16

// Dispatch words.
#define LODE_CUT_WORD_LIST 0       // whose entries are worked on
#define LODE_CUT_WORD_INSTANCES 1  // that are cut
#define LODE_CUT_WORD_FINDINGS 2   // words of the findings
#define LODE_CUT_WORD_STATES 3     // words to set to 0, by the one who makes all ready
#define LODE_CUT_WORD_RECORDS 4    // the same of records

// Specialisation constants: places of an instance.
#define LODE_CUT_SLOT_STATES 0
#define LODE_CUT_SLOT_RECORDS 1

// Bits of a node's state; then the views that see it, and how many nodes that are drawn it is divided into.
#define LODE_NODE_LISTED 1u  // it is in the list of its depth
#define LODE_NODE_LOOKED 2u  // the views are known
#define LODE_NODE_WANTED 4u  // it is to be divided
#define LODE_NODE_DIVIDED 8u
#define LODE_NODE_EXISTS 16u  // what it is part of is divided
#define LODE_NODE_VIEWS_SHIFT 5
#define LODE_NODE_COUNT_SHIFT 13  // at most 4^9: charts have 4096 cells along a side, nodes 8

#ifdef __cplusplus
#include <algorithm>
#include <cmath>
#include <cstdint>
namespace lodestone {
namespace gpu {
using uint = uint32_t;
#define LODE_FUNCTION inline
#define LODE_EXACT  // our flags let nothing be contracted
using std::max;
using std::sqrt;
#else
#define LODE_FUNCTION
#define LODE_EXACT precise
#endif

// 40 bytes, object units.
struct VgiCutPage {
    float centre_x, centre_y, centre_z, radius;
    float axis_x, axis_y, axis_z;  // of the normals' cone, of length 1
    float cosine, sine_squared;    // of its half angle; a cosine of at most 0: no cone
    uint codes;  // sample_error | sample_radius << 8 of PageBounds | error << 16 | radius << 24 of Residency::below
};

// A list of nodes, and a dispatch over it.
struct VgiCutList {
    uint groups_x, groups_y, groups_z;  // VkDispatchIndirectCommand
    uint entries;
    uint first;  // word of the entries
};

// An instance to cut.
struct VgiCutInstance {
    float lattice[12];                  // columns: a lattice point as lode_metric_within takes it
    float object[12];                   // the same of object space
    float ahead, cosine, sine_squared;  // as lode_metric_within takes them
    float magnification, scale;         // as CutRequest's and magnification_of
    float eye_x, eye_y, eye_z;          // of views[0], object space
    uint asset;
    uint first_page, pages;        // of positions: its first one, and how many a chart has
    uint first_chart, charts;      // among all atlases'
    uint first_state, first_leaf;  // of its nodes, of its charts
    uint first_patch;              // word of the draw lists
    uint first_id;                 // as Draw::first_id
    uint views;                    // a bit each
    uint cones;                    // 1: views[0] leaves out back faces
    int forced_level;
    float planes[LODE_CUT_VIEWS * 24];  // per view six of four, object space
};

// One coordinate of a point: columns of an affine map times the point.
LODE_FUNCTION float lode_mapped(float offset, float a, float b, float c, float x, float y, float z) {
    LODE_EXACT float mapped = offset + a * x + b * y + c * z;
    return mapped;
}
LODE_FUNCTION float lode_dot(float ax, float ay, float az, float bx, float by, float bz) {
    LODE_EXACT float sum = ax * bx + ay * by + az * bz;
    return sum;
}
// How far an error matters, world units; 0 of none, which no eye sees, however near.
LODE_FUNCTION float lode_reach(float error, float magnification, float scale, float margin) {
    LODE_EXACT float reach = error * magnification * scale + margin;
    return error > 0.0f ? reach : 0.0f;
}
// How far away something counts for the errors of a picture, and whether that is within a reach. In the picture it is
// the depth, for errors are seen as large as that makes them: c distances at its corners, where c is their cosine.
// Farther aside, up to twice the corners' angle, as much as on the other side of the corners; beyond, the distance
// itself. No faster than a point moves does it change, and no such rule gives more there. x, y, z: seen from the eye, z
// ahead. ahead: 1, or less for views that may turn; cosine, sine_squared: of that angle.
LODE_FUNCTION bool lode_metric_within(float reach, float x, float y, float z, float ahead, float cosine,
                                      float sine_squared) {
    // Mostly it is neither nearer than the depth nor farther than the distance that tells.
    LODE_EXACT float squared = lode_dot(x, y, z, x, y, z);
    LODE_EXACT float reach_squared = reach * reach;
    if (reach_squared > squared) return true;
    LODE_EXACT float depth = z * ahead;
    if (reach <= depth) return false;
    LODE_EXACT float along_squared = z * z;
    LODE_EXACT float cone = cosine * cosine * squared;
    // z < cosine * distance
    bool beyond = cosine > 0.0f ? z < 0.0f || along_squared < cone : z < 0.0f && along_squared > cone;
    if (beyond) return false;
    // z * cosine and the distance from the axis times the sine.
    LODE_EXACT float left = reach - z * cosine;
    LODE_EXACT float left_squared = left * left;
    LODE_EXACT float needed = (squared - along_squared) * sine_squared;
    return left > 0.0f && left_squared > needed;
}
// That distance itself, for what need not be the same bit for bit. along: of the place, ahead of the eye; away: from
// it.
LODE_FUNCTION float lode_distance_metric(float along, float away, float ahead, float cosine, float sine_squared) {
    if (along < cosine * away) return away;
    return max(along * ahead, along * cosine + sqrt(max((away * away - along * along) * sine_squared, 0.0f)));
}
// Whether a sphere lies wholly outside a plane.
LODE_FUNCTION bool lode_outside(float plane_x, float plane_y, float plane_z, float plane_w, float x, float y, float z,
                                float radius) {
    LODE_EXACT float distance = lode_dot(plane_x, plane_y, plane_z, x, y, z) + plane_w;
    return distance < -radius;
}
// Whether every normal of a cone turns away from the eye, wherever in a sphere of `radius` it stands.
// x, y, z: from the eye to the sphere's centre.
LODE_FUNCTION bool lode_turned_away(float axis_x, float axis_y, float axis_z, float cosine, float sine_squared, float x,
                                    float y, float z, float radius) {
    LODE_EXACT float along = lode_dot(axis_x, axis_y, axis_z, x, y, z);
    LODE_EXACT float across_squared = lode_dot(x, y, z, x, y, z) - along * along;
    LODE_EXACT float ahead = along * cosine - radius;
    LODE_EXACT float ahead_squared = ahead * ahead;
    LODE_EXACT float needed = across_squared * sine_squared;
    return ahead > 0.0f && ahead_squared > needed;
}

#ifdef __cplusplus
#undef LODE_FUNCTION
#undef LODE_EXACT
static_assert(sizeof(VgiCutPage) == 40);
static_assert(sizeof(VgiCutList) == 20);
}  // namespace gpu
}  // namespace lodestone
#endif

#endif
