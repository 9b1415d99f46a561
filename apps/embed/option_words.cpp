#include "apps/embed/option_words.h"

namespace lodestone {

namespace {

template <class Parse>
Result<void> parsed(CLI::App& command, Parse&& parse) {
    command.set_help_flag();
    try {
        parse();
    } catch (const CLI::ParseError& e) { return fail(Fault::usage, std::string("options: ") + e.what()); }
    return {};
}

}  // namespace

Result<void> parse_options(CLI::App& command, const std::vector<std::string>& words) {
    // CLI11 takes them from the back.
    return parsed(command, [&] { command.parse(std::vector<std::string>(words.rbegin(), words.rend())); });
}

Result<void> parse_options(CLI::App& command, const std::string& text) {
    return parsed(command, [&] { command.parse(text, false); });
}

}  // namespace lodestone
