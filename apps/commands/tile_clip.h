// `tile --clip`: one piece of a mesh, whose tileset closes with those of the pieces beside it.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "apps/scene/scene.h"
#include "base/progress.h"
#include "base/result.h"
#include "mesh/clip.h"
#include "tiles/cut_rims.h"
#include "tiles/tile_glb.h"

namespace lodestone {

// words: as they were given, each "x<NUMBER", "x>NUMBER" (x, y or z), or "EAST,NORTH,EAST,NORTH".
void add_clip_option(CLI::App& command, std::vector<std::string>& words);

// up: which way lines are looked at. Fault::usage names a word that is none.
Result<std::vector<ClipPlane>> clip_planes_of(const std::vector<std::string>& words, tiles::UpAxis up);

// The scene of one mesh, all of its file, and of it the piece. Fault::usage where it is none of a mesh.
Result<Scene> scene_of_piece(Scene scene, const std::vector<ClipPlane>& planes, const std::string& input);
// scene: from scene_of_piece(). The mesh is read anew, as its bake read it.
Result<tiles::PieceOfSource> read_piece(const Scene& scene, const Progress& progress);

}  // namespace lodestone
