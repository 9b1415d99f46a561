#include "apps/embed/unwrap.h"

#include "apps/embed/option_words.h"
#include "apps/options/unwrap_options.h"
#include "mesh/repair.h"

namespace lodestone {

namespace {

// given: words or a text.
template <class Given>
Result<UnwrapChoices> unwrap_choices_given(const Given& given) {
    CLI::App command;
    UnwrapChoices choices;
    add_unwrap_options(command, choices);
    if (auto done = parse_options(command, given); !done) return tl::unexpected(done.error());
    return choices;
}

}  // namespace

Result<UnwrapChoices> unwrap_choices_of(const std::vector<std::string>& words) { return unwrap_choices_given(words); }

Result<UnwrapChoices> unwrap_choices_of_text(const std::string& text) { return unwrap_choices_given(text); }

Result<UnwrapDone> unwrap(TriMesh mesh, const UnwrapChoices& choices, const Progress& progress) {
    progress.at("repair", 0);
    if (auto repaired = repair(mesh, {}, progress); !repaired) return tl::unexpected(repaired.error());
    if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
    return unwrap_mesh(mesh, choices, progress);
}

}  // namespace lodestone
