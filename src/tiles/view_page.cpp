#include "tiles/view_page.h"

#include "base/json.h"
#include "base/text.h"

namespace lodestone::tiles {

namespace {

// Puts `text` wherever `mark` is.
void fill(std::string& page, std::string_view mark, const std::string& text) {
    for (size_t at = 0; (at = page.find(mark, at)) != std::string::npos; at += text.size())
        page.replace(at, mark.size(), text);
}
std::string for_html(const std::string& text) {
    std::string safe;
    for (const char c : text) {
        if (c == '<') {
            safe += "&lt;";
        } else if (c == '&') {
            safe += "&amp;";
        } else {
            safe += c;
        }
    }
    return safe;
}
// As a string of JavaScript, in which nothing looks like the end of the script.
std::string for_script(const std::string& text) {
    std::string safe;
    for (const char c : Json(as_utf8(text)).dump()) {
        if (c == '<') {
            safe += "\\u003c";
        } else {
            safe += c;
        }
    }
    return safe;
}

}  // namespace

std::string view_page(const std::string& title, const std::string& viewer) {
    std::string page(view_html);
    fill(page, "{{viewer}}", for_script(viewer));
    fill(page, "{{title}}", for_html(as_utf8(title)));
    return page;
}

}  // namespace lodestone::tiles
