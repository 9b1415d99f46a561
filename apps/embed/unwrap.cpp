#include "apps/embed/unwrap.h"

#include "apps/options/unwrap_options.h"
#include "mesh/repair.h"

namespace lodestone {

namespace {

template <class Parse>
Result<UnwrapChoices> choices_parsed(Parse&& parse) {
    CLI::App command;
    command.set_help_flag();
    UnwrapChoices choices;
    add_unwrap_options(command, choices);
    try {
        parse(command);
    } catch (const CLI::ParseError& e) { return fail(Fault::usage, std::string("options: ") + e.what()); }
    return choices;
}

}  // namespace

Result<UnwrapChoices> unwrap_choices_of(const std::vector<std::string>& words) {
    return choices_parsed(
        [&](CLI::App& command) { command.parse(std::vector<std::string>(words.rbegin(), words.rend())); });
}

Result<UnwrapChoices> unwrap_choices_of_text(const std::string& text) {
    return choices_parsed([&](CLI::App& command) { command.parse(text, false); });
}

Result<UnwrapDone> unwrap(TriMesh mesh, const UnwrapChoices& choices, const Progress& progress) {
    progress.at("repair", 0);
    if (auto repaired = repair(mesh); !repaired) return tl::unexpected(repaired.error());
    if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
    return unwrap_mesh(mesh, choices, progress);
}

}  // namespace lodestone
