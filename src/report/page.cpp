#include "report/page.h"

#include <nlohmann/json.hpp>
#include <string_view>

#include "report/page_texts.h"

namespace lodestone {

namespace {

std::string base64(std::span<const std::byte> bytes) {
    static constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (size_t i = 0; i < bytes.size(); i += 3) {
        const size_t have = std::min<size_t>(3, bytes.size() - i);
        uint32_t word = 0;
        for (size_t k = 0; k < 3; ++k) word = word << 8 | (k < have ? static_cast<uint32_t>(bytes[i + k]) : 0);
        for (size_t k = 0; k < 4; ++k) text += k <= have ? digits[word >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

// Inside <script> nothing may look like its end.
std::string for_script(std::string text) {
    for (size_t at = 0; (at = text.find("</", at)) != std::string::npos; at += 3) text.insert(at + 1, "\\");
    return text;
}

// JSON between <script> and </script>. Any "<" may begin what HTML takes for its own there: the end of the script, or
// a comment in which that end does not count. In JSON it can only be in a string.
std::string json_for_script(const std::string& json) {
    std::string text;
    text.reserve(json.size());
    for (const char c : json) {
        if (c == '<')
            text += "\\u003c";
        else
            text += c;
    }
    return text;
}

// A page's text with its marks filled in, from begin to end, so that no mark is looked for in what was put.
class Filling {
public:
    explicit Filling(std::string_view text) : rest_(text) {}
    void put(std::string_view mark, std::string_view text) {
        const size_t at = rest_.find(mark);
        page_.append(rest_.substr(0, at)).append(text);
        rest_.remove_prefix(at + mark.size());
    }
    std::string whole() { return page_.append(rest_); }

private:
    std::string_view rest_;
    std::string page_;
};

}  // namespace

std::string report_page(const Report& report, std::span<const PageImage> images) {
    nlohmann::ordered_json data;
    data["report"] = json_of(report);
    data["images"] = nlohmann::ordered_json::object();
    for (const PageImage& image : images)
        data["images"][image.name] = "data:" + image.type + ";base64," + base64(image.bytes);
    Filling page(page_texts::page_html);
    page.put("{{style}}", page_texts::page_css);
    page.put("{{chart library}}", for_script(std::string(page_texts::chart_js)));
    page.put("{{data}}", json_for_script(data.dump()));
    page.put("{{script}}", page_texts::page_js);
    return page.whole();
}

std::string library_page(const std::string& rows) {
    Filling page(page_texts::library_html);
    page.put("{{style}}", page_texts::page_css);
    page.put("{{data}}", json_for_script(rows));
    page.put("{{script}}", page_texts::library_js);
    return page.whole();
}

}  // namespace lodestone
