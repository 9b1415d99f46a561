// The page that shows a tileset in a browser: it lies beside tileset.json and draws by a viewer from elsewhere.
#pragma once

#include <string>
#include <string_view>

namespace lodestone::tiles {

extern const std::string_view view_html;  // view.html, embedded at build time

// The page. title: for people. viewer: address of a folder that holds viewers as npm lays them out, absolute or from
// the page; empty where it is named by the page's own address, view.html?viewer=.
std::string view_page(const std::string& title, const std::string& viewer);

}  // namespace lodestone::tiles
