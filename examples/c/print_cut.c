// Bakes a torus, cuts it for a flight towards it by both techniques, and prints what a renderer would draw. With the
// name of an asset, cuts that instead.
//
//   cc print_cut.c $(pkg-config --cflags --libs lodestone) -lm -o print_cut
//   ./print_cut [ASSET.lode]
#include <lodestone.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { around = 200, across = 100 };

static void check(lodestone_status status) {
    if (status == LODESTONE_OK) return;
    fprintf(stderr, "print_cut: %s\n", lodestone_error());
    exit(status);
}

// A closed torus of 2 * around * across triangles.
static lodestone_mesh* make_torus(void) {
    const double turn = 6.283185307179586;
    float* positions = malloc(sizeof(float) * 3 * around * across);
    uint32_t* triangles = malloc(sizeof(uint32_t) * 6 * around * across);
    if (positions == NULL || triangles == NULL) exit(LODESTONE_MACHINE);
    for (uint32_t i = 0; i < around; ++i) {
        for (uint32_t j = 0; j < across; ++j) {
            const double u = turn * i / around, v = turn * j / across, out = 2 + 0.7 * cos(v) + 0.05 * sin(9 * u) * cos(5 * v);
            float* p = positions + 3 * (i * across + j);
            p[0] = (float)(out * cos(u));
            p[1] = (float)(out * sin(u));
            p[2] = (float)(0.7 * sin(v));
            const uint32_t a = i * across + j, b = (i + 1) % around * across + j;
            const uint32_t c = (i + 1) % around * across + (j + 1) % across, d = i * across + (j + 1) % across;
            const uint32_t two[6] = {a, b, c, a, c, d};
            memcpy(triangles + 6 * a, two, sizeof two);
        }
    }
    lodestone_arrays arrays = {.struct_size = sizeof arrays};
    arrays.vertex_count = around * across;
    arrays.triangle_count = 2 * around * across;
    arrays.positions = positions;
    arrays.triangles = triangles;
    lodestone_mesh* mesh;
    check(lodestone_mesh_create(&arrays, &mesh));
    free(positions);
    free(triangles);
    return mesh;
}

static int tell(void* user, const char* stage, double fraction) {
    (void)user;
    fprintf(stderr, "\r\033[K%s %3.0f%%", stage, 100 * fraction);
    return 0;  // anything else cancels the bake
}

static lodestone_asset* bake_torus(void) {
    lodestone_mesh* mesh = make_torus();
    lodestone_progress progress = {.struct_size = sizeof progress, .report = tell};
    lodestone_asset* asset;
    check(lodestone_bake(mesh, "--backends lod,vgi --order static --resolution 65", &progress, NULL, &asset));
    fprintf(stderr, "\r\033[K");
    lodestone_mesh_free(mesh);
    return asset;
}

static void print_flight(const lodestone_asset* asset, lodestone_backend backend, const char* name) {
    float centre[3], radius;
    check(lodestone_asset_bounds(asset, centre, &radius));
    lodestone_cutter* cutter;
    check(lodestone_cutter_create(asset, backend, 0, &cutter));
    for (int step = 0; step < 4; ++step) {
        const float away = radius * 20 / powf(2, (float)step);
        lodestone_view view = {.struct_size = sizeof view};
        memcpy(view.eye, centre, sizeof centre);
        memcpy(view.target, centre, sizeof centre);
        view.eye[2] += away;
        view.up[1] = 1;
        view.fov_y = 0.8f;
        view.near_plane = radius / 1000;
        view.far_plane = radius * 100;
        view.width = 1280;
        view.height = 720;
        view.pixel_error = 1;
        view.wait = 1;
        lodestone_cut cut = {.struct_size = sizeof cut};
        check(lodestone_cutter_cut(cutter, &view, &cut));
        // Here a renderer uploads cut.vertices, where cut.vertices_version is new to it, and cut.indices, and draws.
        printf("%s from %6.2f: %7llu triangles of %7llu vertices", name, (double)away,
               (unsigned long long)(cut.index_count / 3), (unsigned long long)cut.vertex_count);
        if (cut.index_count > 0) {
            const lodestone_vertex* v = &cut.vertices[cut.indices[0]];
            printf(", the first at %.3f %.3f %.3f", (double)v->position[0], (double)v->position[1], (double)v->position[2]);
        }
        printf("\n");
    }
    lodestone_cutter_free(cutter);
}

int main(int argc, char** argv) {
    lodestone_asset* asset;
    if (argc > 1) {
        check(lodestone_asset_open(argv[1], &asset));
    } else {
        asset = bake_torus();
    }
    const char* names[] = {"lod", "vgi"};
    for (lodestone_backend backend = LODESTONE_LOD; backend <= LODESTONE_VGI; ++backend) {
        uint32_t levels;
        check(lodestone_asset_level_count(asset, backend, &levels));
        if (levels == 0) continue;
        uint64_t triangles;
        check(lodestone_asset_level(asset, backend, 0, &triangles, NULL));
        printf("%s: %u levels, %llu triangles in full detail\n", names[backend], levels, (unsigned long long)triangles);
        print_flight(asset, backend, names[backend]);
    }
    lodestone_asset_free(asset);
    return 0;
}
