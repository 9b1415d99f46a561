// Where the renderer is not built: the subcommands that draw say so.
#include "apps/commands/commands.h"

namespace lodestone {

namespace {

void add_missing(CLI::App& app, Run& run, const char* name) {
    CLI::App* command = app.add_subcommand(name, "Not in this build: it was made without Vulkan");
    command->fallthrough(false);
    command->allow_extras();
    command->callback([&run, name] {
        run = [name]() -> Result<int> {
            return fail(
                Fault::machine,
                std::string(name) + ": this build was made without Vulkan; configure with -DLODESTONE_RENDER=ON");
        };
    });
}

}  // namespace

void add_render(CLI::App& app, Run& run) { add_missing(app, run, "render"); }
void add_bench(CLI::App& app, Run& run) { add_missing(app, run, "bench"); }
void add_tune(CLI::App& app, Run& run) { add_missing(app, run, "tune"); }
void add_view(CLI::App& app, Run& run) { add_missing(app, run, "view"); }
void add_probe(CLI::App& app, Run& run) { add_missing(app, run, "probe"); }

}  // namespace lodestone
