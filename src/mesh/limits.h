// How large things may be that come from outside, and why no larger. Every limit is checked where data enters: at a
// reader's end, before a stage numbers what it makes, when an asset is opened. What is larger is refused by a line that
// names the limit and the number. Tests make limits small.
#pragma once

#include <cstdint>
#include <string>

namespace lodestone {

// Each can be made small by a test, and not larger than it is here.
struct Limits {
    // Vertices and wedges of a mesh: they are numbered by 32 bits, and the last numbers are marks.
    uint64_t vertices = 0xfffffff0u;
    // Triangles of a mesh: their corners are numbered by 32 bits, and the last number is a mark.
    uint64_t triangles = (0xffffffffu - 1) / 3;
    // Indices of both halves of a progressive mesh's index buffer: places in it have 32 bits. The first half holds
    // every triangle; where the second has no room for an order, the order comes at a coarser level.
    uint64_t lod_indices = 0xffffffffu;
    // Slots that the tswaps of a face order move, cycle after cycle: they are numbered by 32 bits.
    uint64_t lod_entries = 0xffffffffu;
    // Face orders of a progressive mesh: each is checked whole, and a few bytes of text can name one again and again.
    uint64_t lod_orders = 64;
    // Charts of an atlas, and of all that are drawn together: vertices of leaves, and what is kept of a pixel, name
    // them by 20 bits.
    uint64_t charts = (uint64_t{1} << 20) - 1;
    // Pages of an atlas, of positions or of attributes, and of all that are drawn together: numbered by 32 bits.
    uint64_t pages = (uint64_t{1} << 32) - 2;
    // Samples of an atlas' positions: a mesh of its finest level numbers them by 32 bits.
    uint64_t samples = (uint64_t{1} << 32) - 2;
    // Materials of a mesh: wedges refer to them by 16 bits.
    uint64_t materials = 65536;
    // Texels along a side of a texture: a gigabyte decoded, and the largest that every device can draw.
    uint32_t image_side = 16384;
    // Texels of all textures of a mesh: 8 GiB decoded.
    uint64_t texels = uint64_t{1} << 31;
    // Files that a mesh names: as many as it can have materials. Each is looked for on the disk.
    uint64_t side_files = 65536;
    // Warnings about a file: more tell nobody anything.
    uint64_t warnings = 1000;
    // Samples along a side of a height map: its square is half of what corners can be numbered for.
    uint32_t height_side = 32768;
    // Nodes of a glTF file in each other: each takes a step of the stack.
    uint32_t gltf_depth = 256;
    // Bytes that a gzip stream may unpack to: 64 GiB, as much as 4 G vertices take. A stream may unpack to 1032 times
    // its size.
    uint64_t unpacked_bytes = uint64_t{1} << 36;
    // Bytes of a material library, unpacked: they are names and a few numbers.
    uint64_t library_bytes = uint64_t{1} << 28;
    // Bytes of a scene or a camera path.
    uint64_t scene_bytes = uint64_t{1} << 30;
};

// "has 5 vertices; the limit is 4; ...", for errors.
inline std::string over_limit(const std::string& what, uint64_t number, uint64_t limit) {
    return "has " + std::to_string(number) + " " + what + "; the limit is " + std::to_string(limit) +
           "; cut it into pieces";
}

}  // namespace lodestone
