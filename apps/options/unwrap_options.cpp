#include "apps/options/unwrap_options.h"

namespace lodestone {

void add_unwrap_options(CLI::App& command, UnwrapChoices& o) {
    command.add_option("--charts", o.squares.charts, "Charts wanted; 0 for as many as suit the mesh")
        ->check(CLI::Range(0, 1 << 20))
        ->capture_default_str();
    command
        .add_option("--worst-stretch", o.squares.worst_stretch,
                    "Charts that are stretched more than this are cut finer, L2; 1 is even")
        ->check(CLI::Range(1.1, 1e6))
        ->capture_default_str();
    command.add_option("--textures", o.squares.textures, "Squares that charts are spread over, a material for each")
        ->check(CLI::Range(1, 64))
        ->capture_default_str();
    command.add_option("--resolution", o.resolution, "Texels along a side of a square")
        ->check(CLI::Range(16, 16384))
        ->capture_default_str();
    command.add_option("--gutter", o.gutter, "Texels between charts, at least")
        ->check(CLI::Range(0.0, 256.0))
        ->capture_default_str();
    command.add_flag("--bake", o.bake, "Bring colours and textures of the materials over into the new squares");
}

}  // namespace lodestone
