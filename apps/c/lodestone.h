// The C interface of Lodestone: meshes from arrays and files, baking, levels, simplification, new texture coordinates,
// and cuts for a view as streams of vertices and indices for a renderer of one's own. docs/embedding.md tells how to
// use it.
//
// Errors. A function that can fail returns a lodestone_status. Where that is not LODESTONE_OK, lodestone_error() tells
// why, and nothing was written through the pointers given but NULL to handles. No C++ exception leaves a function.
// Arguments are checked: NULL where something must be, numbers out of range, indices that point nowhere. What cannot be
// checked is memory that is not there: pointers must lead to as many elements as is said, and handles must be alive.
//
// Threads. Functions may be called from any thread. Meshes and assets never change: threads may use one at the same
// time. A cutter is used by one thread at a time, and so is a handle that is being freed. lodestone_error() is of the
// calling thread. Loops inside run on threads that all calls share.
//
// Sizes of structs. `struct_size` is sizeof of the struct as the caller knows it, set by the caller, also where the
// struct is filled by the library; so later versions can add members at the end.
#pragma once

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif
#ifdef __GNUC__
#pragma GCC visibility push(default)
#endif

// How a function ended: one of the LODESTONE_... below; the exit codes of the program `lodestone`.
typedef int32_t lodestone_status;
// Values of lodestone_status.
enum {
    LODESTONE_OK = 0,             // done
    LODESTONE_INVARIANT = 1,      // a structure or a comparison is not as it must be
    LODESTONE_USAGE = 2,          // an argument is wrong
    LODESTONE_FORMAT = 3,         // bad input or an unreadable asset
    LODESTONE_MACHINE = 4,        // memory, device, disk or driver cannot
    LODESTONE_INTERRUPTED = 130,  // the caller cancelled the work
};

// Which technique of an asset is meant.
typedef int32_t lodestone_backend;
// Values of lodestone_backend.
enum {
    LODESTONE_LOD = 0,  // its progressive mesh
    LODESTONE_VGI = 1,  // its atlas of geometry images
};

// A triangle mesh. Never changes.
typedef struct lodestone_mesh lodestone_mesh;
// What a mesh was baked into, open for reading. Never changes.
typedef struct lodestone_asset lodestone_asset;
// Chooses what of an asset is drawn, view after view.
typedef struct lodestone_cutter lodestone_cutter;
// A flag by which any thread cancels work.
typedef struct lodestone_cancel lodestone_cancel;

// The version of the library, such as "0.2.0". Never NULL, never freed.
const char* lodestone_version(void);
// Why the last function that failed on this thread did: one line of UTF-8 without a newline; "" where none did. Valid
// until the next function fails on this thread.
const char* lodestone_error(void);
// How many threads loops use from now on, in all calls of the process; 0 means one per hardware thread, which is what
// is used unless this is called. Results do not depend on it. At most 1024.
lodestone_status lodestone_set_threads(uint32_t threads);

// A flag that is not set. NULL where there is no memory.
lodestone_cancel* lodestone_cancel_create(void);
// Sets the flag: work that was given it ends soon, with LODESTONE_INTERRUPTED. It stays set. NULL is ignored.
void lodestone_cancel_set(lodestone_cancel* cancel);
// Frees the flag; no work may still have it. NULL is ignored.
void lodestone_cancel_free(lodestone_cancel* cancel);

// How long work tells how far it is. Every member but struct_size may be NULL. Functions are called on the thread that
// called the library, and must return: no exception, no longjmp.
struct lodestone_progress {
    size_t struct_size;  // sizeof(lodestone_progress)
    void* user;          // handed to the functions
    // stage: a few words; fraction: of this stage, 0 .. 1. Anything but 0 cancels the work, and sets `cancel`.
    int (*report)(void* user, const char* stage, double fraction);
    void (*warn)(void* user, const char* line);  // a fact the user should know though the work goes on; one line
    lodestone_cancel* cancel;                    // is looked at between steps
};
typedef struct lodestone_progress lodestone_progress;

// 8-bit sRGB texels with alpha.
struct lodestone_image {
    uint32_t width, height;  // texels, 1 .. 16384 each
    const uint8_t* rgba;     // 4 * width * height, rows top to bottom, no padding
};
typedef struct lodestone_image lodestone_image;

// How a part of a surface looks, as far as this interface knows: its base colour. A mesh that was read from a file
// keeps all of its materials, and so does what is baked from it or written; its images are those of all their textures.
struct lodestone_material {
    const char* name;       // UTF-8; NULL stands for ""
    float base_colour[4];   // linear RGB and alpha, 0 .. 1; multiplies texture and vertex colour
    int32_t image;          // into the images, -1 for none
    uint32_t double_sided;  // 0 or 1
};
typedef struct lodestone_material lodestone_material;

// A mesh as arrays. Vertices are vertices as they are drawn: where a normal, a texture coordinate, a colour or a
// material jumps there are several at one position, equal bit for bit. Triangles are counter-clockwise seen from
// outside.
struct lodestone_arrays {
    size_t struct_size;                        // sizeof(lodestone_arrays)
    uint64_t vertex_count;                     // 1 .. 4294967280
    uint64_t triangle_count;                   // 1 .. 1431655764
    const float* positions;                    // 3 per vertex, object units, finite
    const uint32_t* triangles;                 // 3 per triangle, each below vertex_count
    const float* normals;                      // 3 per vertex, finite, any length; or NULL
    const float* uvs;                          // 2 per vertex, finite, origin at the top left; or NULL
    const uint8_t* colours;                    // 4 per vertex, sRGB and alpha; or NULL
    const uint16_t* materials;                 // 1 per vertex, each below material_count; or NULL for material 0
    const lodestone_material* material_table;  // material_count of them; NULL where that is 0
    uint32_t material_count;                   // 0 .. 65536
    uint32_t image_count;                      // 0 .. 65536
    const lodestone_image* images;             // image_count of them; NULL where that is 0
};
typedef struct lodestone_arrays lodestone_arrays;

// A mesh of these arrays, which are copied. Triangles may form any soup: it is repaired where it is used. Normals are
// brought to unit length; those of length 0 become (0, 0, 1).
lodestone_status lodestone_mesh_create(const lodestone_arrays* arrays, lodestone_mesh** mesh);
// A mesh from a file: PLY, OBJ, STL, OFF, glTF, GLB, or a height map; also gzipped. path: UTF-8.
// options: as lodestone_bake() takes them; those of height maps and --allow-outside count. NULL for none.
lodestone_status lodestone_mesh_read(const char* path, const char* options, lodestone_mesh** mesh);
// Writes a mesh to a .ply, .obj or .glb file, which appears whole or not at all.
lodestone_status lodestone_mesh_write(const lodestone_mesh* mesh, const char* path);
// The mesh as arrays, valid until it is freed. What it does not have is NULL.
lodestone_status lodestone_mesh_arrays(const lodestone_mesh* mesh, lodestone_arrays* arrays);
// Frees a mesh. NULL is ignored.
void lodestone_mesh_free(lodestone_mesh* mesh);

// How far a mesh is simplified. One of the two is given, the other is 0.
struct lodestone_target {
    size_t struct_size;  // sizeof(lodestone_target)
    uint64_t triangles;  // at most so many, or as few as topology allows; 0: not asked
    double error;        // object units: the coarsest level within this two-sided distance of the source; 0: not asked
    uint32_t openmesh;   // 1: by OpenMesh's decimater, positions alone; 0: by Lodestone's quadrics with attributes
};
typedef struct lodestone_target lodestone_target;

// A mesh of fewer triangles. The mesh is repaired first. An error takes as long as a bake of a progressive mesh: it is
// measured.
// progress: NULL for none. simplified: a new mesh.
lodestone_status lodestone_simplify(const lodestone_mesh* mesh, const lodestone_target* target,
                                    const lodestone_progress* progress, lodestone_mesh** simplified);

// What new texture coordinates are like.
struct lodestone_unwrap_report {
    size_t struct_size;         // sizeof(lodestone_unwrap_report)
    uint64_t charts;            // islands
    uint64_t source_triangles;  // of the repaired mesh
    uint64_t triangles;         // at least as many: some are cut
    uint64_t seam_edges;        // inner edges whose two triangles lie in different charts
    double seam_length;         // of these, object units
    double stretch_rms;         // L2, over all squares together; 1 where texels are spread evenly
    double stretch_worst;       // L2, of a chart
    double coverage;            // share of the squares that triangles cover, 0 .. 1
};
typedef struct lodestone_unwrap_report lodestone_unwrap_report;

// A mesh with new texture coordinates: charts that do not overlap, packed into squares of 0 .. 1, each with a material
// of its own. The mesh is repaired first.
// options: those of `lodestone unwrap` that say what becomes of the mesh (docs/cli.md), as there, for instance
// "--bake --resolution 2048", which brings its textures over into new ones; NULL for none. progress, report: NULL for
// none. unwrapped: a new mesh.
lodestone_status lodestone_unwrap(const lodestone_mesh* mesh, const char* options, const lodestone_progress* progress,
                                  lodestone_mesh** unwrapped, lodestone_unwrap_report* report);

// What an index order costs a vertex cache.
struct lodestone_cache_cost {
    size_t struct_size;   // sizeof(lodestone_cache_cost)
    uint64_t transforms;  // vertex shader runs
    uint64_t triangles;   // those that are not degenerate
    uint64_t vertices;    // distinct ones of these
    double acmr;          // transforms per triangle, 0.5 .. 3 on large meshes
    double atvr;          // transforms per vertex, >= 1
};
typedef struct lodestone_cache_cost lodestone_cache_cost;
// Draws triangles through a simulated cache.
// indices: index_count of them, three to a triangle, in drawing order. cache: "fifo16", "lru32", "nvidia", "amd",
// "intel" ...; NULL for fifo16.
lodestone_status lodestone_simulate_cache(const uint32_t* indices, uint64_t index_count, const char* cache,
                                          lodestone_cache_cost* cost);

// Bakes an asset.
// options: those of `lodestone bake` that say what the asset becomes (docs/cli.md), as there, for instance
// "--backends lod,vgi --resolution 65"; NULL for none. progress: NULL for none. path: UTF-8, the file to write, which
// appears whole or not at all; NULL: the asset is kept in a file without a name in the folder for temporary files.
// asset: where not NULL, the asset, open. One of path and asset is given.
lodestone_status lodestone_bake(const lodestone_mesh* mesh, const char* options, const lodestone_progress* progress,
                                const char* path, lodestone_asset** asset);
// Opens an asset file. path: UTF-8.
lodestone_status lodestone_asset_open(const char* path, lodestone_asset** asset);
// Opens an asset from the bytes of its file, which are copied.
lodestone_status lodestone_asset_open_memory(const void* bytes, size_t size, lodestone_asset** asset);
// Checks every invariant of an asset; slow. LODESTONE_INVARIANT where one fails, LODESTONE_FORMAT where it is damaged.
lodestone_status lodestone_asset_verify(const lodestone_asset* asset);
// What the asset tells of itself, a JSON object in UTF-8: name, program, options, input, repair, bounds, and what it
// was baked for (docs/cli.md, `info --json`). Valid until the asset is freed. NULL where asset is NULL.
const char* lodestone_asset_about(const lodestone_asset* asset);
// A sphere around the source mesh, object units.
lodestone_status lodestone_asset_bounds(const lodestone_asset* asset, float centre[3], float* radius);
// Materials and images that vertices of the asset refer to: of `arrays`, the members of them; the others are NULL or 0.
// Valid until the asset is freed.
lodestone_status lodestone_asset_materials(const lodestone_asset* asset, lodestone_arrays* arrays);
// How many levels there are, 0 where the asset was baked without the backend.
lodestone_status lodestone_asset_level_count(const lodestone_asset* asset, lodestone_backend backend, uint32_t* levels);
// A level: 0 is full detail, of an atlas the source itself, or its finest samples where it was baked without leaves.
// triangles, error: NULL where they are not asked for. error: two-sided distance to the source, object units; never
// decreasing with the level.
lodestone_status lodestone_asset_level(const lodestone_asset* asset, lodestone_backend backend, uint32_t level,
                                       uint64_t* triangles, double* error);
// The finest level of at most so many triangles; the coarsest where none is.
lodestone_status lodestone_asset_level_for_triangles(const lodestone_asset* asset, lodestone_backend backend,
                                                     uint64_t triangles, uint32_t* level);
// The coarsest level of at most this error, object units, or the source if that has fewer triangles; the finest where
// none is.
lodestone_status lodestone_asset_level_for_error(const lodestone_asset* asset, lodestone_backend backend, double error,
                                                 uint32_t* level);
// A level as a mesh, triangles in drawing order. Of an atlas, every page is decoded; where textures were baked into it,
// the mesh has colours of samples, and no texture coordinates.
lodestone_status lodestone_asset_extract(const lodestone_asset* asset, lodestone_backend backend, uint32_t level,
                                         lodestone_mesh** mesh);
// Frees an asset; cutters and meshes made from it live on. NULL is ignored.
void lodestone_asset_free(lodestone_asset* asset);

// A vertex of a cut, 40 bytes.
struct lodestone_vertex {
    float position[3];  // object units
    float normal[3];    // object space, unit length
    float uv[2];        // texture coordinates, origin at the top left; 0 where the asset has none
    uint8_t colour[4];  // sRGB and alpha; white where the asset has none
    uint32_t material;  // into the asset's materials
};
typedef struct lodestone_vertex lodestone_vertex;

// A cutter of one object: a place in a progressive mesh, or a cut through an atlas with the pages that it needs.
// resident_bytes: what the stated buffers of the technique may take, 0 for 1 GiB; a cutter takes about as much again
// for what it hands out. LODESTONE_MACHINE where the least that can be drawn needs more; LODESTONE_FORMAT where the
// asset was baked without the backend.
lodestone_status lodestone_cutter_create(const lodestone_asset* asset, lodestone_backend backend,
                                         uint64_t resident_bytes, lodestone_cutter** cutter);

// A perspective view of the object, and how exact the cut is.
struct lodestone_view {
    size_t struct_size;         // sizeof(lodestone_view)
    float eye[3];               // world units
    float target[3];            // a point in the middle of the picture, not the eye; world units
    float up[3];                // of the picture, any length; another is taken where the view looks along it
    float fov_y;                // radians from the bottom to the top of the picture, 0.001 .. 3.14
    float near_plane;           // world units, > 0
    float far_plane;            // world units, > near_plane
    uint32_t width, height;     // pixels, 1 .. 16384 each
    float object_to_world[16];  // columns; affine, of any scale but 0; all zeros stand for the identity
    double pixel_error;         // pixels, 1e-6 .. 1e6: how far what is drawn may be from the source on screen
    uint64_t max_triangles;     // 0 for no limit; above it the pixel error is raised
    uint32_t culls_back_faces;  // 1: faces away from the eye are drawn by nobody, and may be left out
    uint32_t wait;              // 1: pages that the cut needs are waited for; 0: it is as fine as what is there
};
typedef struct lodestone_view lodestone_view;

// What is to be drawn. Valid until the next cut of the cutter, or until that is freed.
struct lodestone_cut {
    size_t struct_size;                // sizeof(lodestone_cut)
    const lodestone_vertex* vertices;  // vertex_count of them
    const uint32_t* indices;           // index_count of them, three to a triangle, counter-clockwise seen from outside
    uint64_t vertex_count;             // 0 where nothing is seen
    uint64_t index_count;              // 0 where nothing is seen
    // Raised whenever `vertices` may differ from the cut before. Vertices of a progressive mesh never do: a coarser
    // level uses the first of them. vertex_count is then that of full detail.
    uint64_t vertices_version;
    int64_t level;            // of a progressive mesh; -1 of an atlas, and where nothing is seen
    double pixel_error;       // as asked; of an atlas raised where max_triangles asks for that
    uint64_t resident_bytes;  // of the technique's buffers
    uint32_t settled;         // 0: pages are on their way, and the same view will become finer
};
typedef struct lodestone_cut lodestone_cut;

// The cut for a view. What lies outside of the picture is left out as far as it is known; triangles share vertices, so
// that the surface is closed within a chart and positions agree bit for bit between charts.
// After LODESTONE_MACHINE or LODESTONE_INVARIANT the cutter can only be freed.
lodestone_status lodestone_cutter_cut(lodestone_cutter* cutter, const lodestone_view* view, lodestone_cut* cut);
// Frees a cutter. NULL is ignored.
void lodestone_cutter_free(lodestone_cutter* cutter);

#ifdef __GNUC__
#pragma GCC visibility pop
#endif
#ifdef __cplusplus
}
#endif
