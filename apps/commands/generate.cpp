#include "mesh/generate.h"
#include "apps/commands/commands.h"
#include "apps/options/common_options.h"
#include "apps/terminal.h"
#include "base/threads.h"
#include "mesh/io/write.h"

namespace lodestone {

void add_generate(CLI::App& app, Run& run) {
    struct Options {
        std::string shape, out;
        uint64_t triangles = 100000, seed = 1;
        unsigned threads = 0;
    };
    const auto o = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand(
        "generate", "Make a mesh by code: a rock, terrain, grid, sphere, torus, cliff, vase or scan");
    command->add_option("shape", o->shape, "rock, terrain, grid, sphere, torus, cliff, vase or scan")->required();
    command->add_option("--triangles", o->triangles, "Number of triangles; the mesh has it within 1%")
        ->required()
        ->check(CLI::Range(uint64_t{1}, uint64_t{1} << 31));
    command->add_option("--seed", o->seed, "Seed of the noise: each gives another rock, terrain, cliff, vase or scan")
        ->capture_default_str();
    command->add_option("--threads", o->threads, "Threads to use; 0 takes one per core")->capture_default_str();
    command->add_option("-o,--out", o->out, "Mesh to write: .ply, .obj or .glb")->required();
    command->footer(examples("lodestone generate rock --triangles 300000 --seed 7 -o rock.ply"));
    command->callback([o, &run] {
        run = [o]() -> Result<int> {
            set_thread_count(o->threads);
            const auto shape = shape_named(o->shape);
            if (!shape) return tl::unexpected(shape.error());
            terminal_progress().at("generate", 0);
            const TriMesh mesh = generate(*shape, o->triangles, o->seed);
            if (auto done = write_mesh(mesh, o->out); !done) return tl::unexpected(done.error());
            end_progress();
            note(std::to_string(mesh.triangle_count()) + " triangles written to " + o->out);
            return 0;
        };
    });
}

}  // namespace lodestone
