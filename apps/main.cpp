#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <optional>
#include <string>

#include "apps/commands/commands.h"
#include "apps/machine.h"
#include "apps/terminal.h"
#include "base/spill.h"
#include "base/text.h"

using namespace lodestone;

namespace {

void describe(CLI::App& app) {
    app.description(
        "Lodestone, a continuous level-of-detail engine: progressive meshes, virtual geometry images and two baselines "
        "on one renderer.");
    app.footer(
        "Backends are lod (progressive meshes), vgi (virtual geometry images), discrete (a chain of simplified\n"
        "meshes) and full (the source mesh).\n"
        "Meshes are PLY, OBJ, STL, OFF, glTF or GLB, or height maps (16-bit PNG, GeoTIFF) as terrain; .gz of any of "
        "them.\n"
        "A mesh or a scene given to render, bench, tune or view is baked on first use into the cache folder\n"
        "($XDG_CACHE_HOME/lodestone, or ~/.cache/lodestone).\n\n"
        "Results go to stdout, progress and warnings to stderr. Exit codes: 0 done; 1 an invariant or comparison "
        "failed;\n"
        "2 wrong usage; 3 bad input or unreadable asset; 4 machine, device or disk cannot; 130 interrupted.\n\n"
        "lodestone SUBCOMMAND --help lists the options of a subcommand.");
}

void add_subcommands(CLI::App& app, Run& run) {
    app.require_subcommand(1);
    app.fallthrough();
    add_bake(app, run);
    add_library(app, run);
    add_info(app, run);
    add_verify(app, run);
    add_acmr(app, run);
    add_extract(app, run);
    add_tile(app, run);
    add_unwrap(app, run);
    add_generate(app, run);
    add_render(app, run);
    add_bench(app, run);
    add_tune(app, run);
    add_view(app, run);
    add_probe(app, run);
}

// The exit code, where the words end the program.
std::optional<int> parse(CLI::App& app, int argc, char** argv) {
    const char* const* named = std::find_if(argv + 1, argv + argc, [](const char* word) { return word[0] != '-'; });
    const auto is_named = [&](const CLI::App* command) { return command->get_name() == *named; };
    if (named != argv + argc && app.get_subcommands(is_named).empty()) {
        std::fprintf(stderr, "lodestone: there is no subcommand '%s'; see lodestone --help\n",
                     printable(*named).c_str());
        return static_cast<int>(Fault::usage);
    }
    try {
        app.parse(argc, argv);
    } catch (const CLI::Success& e) {
        return app.exit(e);  // --help, --version
    } catch (const CLI::ParseError& e) {
        std::fprintf(stderr, "lodestone: %s; see lodestone --help\n", printable(e.what()).c_str());
        return static_cast<int>(Fault::usage);
    }
    return std::nullopt;
}

// Allocates nothing.
int report_out_of_memory() {
    end_progress();
    std::fputs(
        spill_statistics().full
            ? "lodestone: what does not fit --memory has no room in the folder for temporary files; name another by "
              "--tmp, or allow more\n"
            : "lodestone: out of memory; use a smaller mesh, or bake with --memory\n",
        stderr);
    return static_cast<int>(Fault::machine);
}

// Libraries allocate where nothing may be thrown, as nlohmann's JSON does in its destructor.
std::terminate_handler terminate_otherwise = nullptr;
[[noreturn]] void end_where_nothing_may_be_thrown() {
    try {
        if (const auto thrown = std::current_exception()) std::rethrow_exception(thrown);
    } catch (const std::bad_alloc&) { std::_Exit(report_out_of_memory()); } catch (...) {
        terminate_otherwise();
    }
    std::abort();
}

int run_program(int argc, char** argv) {
    CLI::App app("", "lodestone");
    describe(app);
    app.set_version_flag("--version", "lodestone " LODESTONE_VERSION " (" + source_commit() + ")");
    bool verbose = false, quiet = false;
    app.add_flag("-v,--verbose", verbose, "Say more on stderr");
    app.add_flag("-q,--quiet", quiet, "No progress and no warnings");
    Run run;
    add_subcommands(app, run);
    if (const std::optional<int> ended = parse(app, argc, argv)) return *ended;
    set_verbosity(quiet ? Verbosity::quiet : verbose ? Verbosity::verbose : Verbosity::normal);
    catch_interrupts();
    const Result<int> code = run();
    end_progress();
    return code ? *code : report_error(code.error());
}

}  // namespace

int main(int argc, char** argv) {
    terminate_otherwise = std::set_terminate(end_where_nothing_may_be_thrown);
    try {
        return run_program(argc, argv);
    } catch (const std::bad_alloc&) { return report_out_of_memory(); } catch (const std::exception& e) {
        return report_error({Fault::machine, std::string("an operation of the system failed: ") + e.what()});
    } catch (...) { return report_error({Fault::machine, "an operation failed for a reason that is not known"}); }
}
