#include "vgi/atlas_chunks.h"

#include <bit>
#include <nlohmann/json.hpp>

#include "base/threads.h"
#include "mesh/io/material_chunks.h"
#include "vgi/pages.h"

namespace lodestone::vgi {

namespace {
using Json = nlohmann::json;
}

Result<void> write_chunks(const Atlas& atlas, ChunkWriter& writer) {
    const PageTree tree{atlas.cells};
    const Json about = {
        {"cells", atlas.cells},
        {"charts", atlas.charts()},
        {"origin", {atlas.origin.x, atlas.origin.y, atlas.origin.z}},
        {"step", atlas.step},
        {"uv_low", {atlas.uv_low.x, atlas.uv_low.y}},
        {"uv_step", {atlas.uv_step.x, atlas.uv_step.y}},
        {"images",
         {{"uvs", !atlas.uvs.empty()}, {"colours", !atlas.colours.empty()}, {"materials", !atlas.materials.empty()}}},
        {"attributes",
         {{"normals", atlas.attributes.normals},
          {"uvs", atlas.attributes.uvs},
          {"colours", atlas.attributes.colours},
          {"materials", atlas.attributes.materials}}}};
    std::vector<std::vector<std::byte>> pages(size_t{atlas.charts()} * tree.pages());
    parallel_for(pages.size(), 16, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i)
            pages[i] =
                encode_page(atlas, static_cast<uint32_t>(i / tree.pages()), static_cast<uint32_t>(i % tree.pages()));
    });
    std::vector<uint64_t> ends;
    std::vector<std::byte> bytes;
    for (auto& page : pages) {
        bytes.insert(bytes.end(), page.begin(), page.end());
        ends.push_back(bytes.size());
        page = {};
    }
    Result<void> done = writer.add_text("vgi/atlas", about.dump());
    if (done) done = writer.add_array("vgi/sides", std::span(atlas.sides));
    if (done) done = writer.add_array("vgi/clusters", std::span(atlas.cluster));
    if (done) done = writer.add_array("vgi/errors", std::span(atlas.errors));
    if (done) done = writer.add_array("vgi/page_ends", std::span<const uint64_t>(ends));
    if (done) done = writer.add_array("vgi/page_bytes", std::span<const std::byte>(bytes));
    if (done) done = write_materials(writer, atlas.material_table, atlas.images);
    return done;
}

Result<Atlas> open_atlas(const ChunkFile& file) {
    const auto named = [&](const std::string& what) {
        return fail_at(file.path().string(), {Fault::format, what + "; bake the asset again"});
    };
    auto text = file.text("vgi/atlas");
    if (!text) return tl::unexpected(text.error());
    Atlas atlas;
    uint32_t charts = 0;
    bool uvs = false, colours = false, materials = false;
    try {
        const Json about = Json::parse(*text);
        atlas.cells = about.at("cells").get<uint32_t>();
        charts = about.at("charts").get<uint32_t>();
        for (int k = 0; k < 3; ++k) atlas.origin[k] = about.at("origin").at(static_cast<size_t>(k)).get<double>();
        atlas.step = about.at("step").get<double>();
        for (int k = 0; k < 2; ++k) {
            atlas.uv_low[k] = about.at("uv_low").at(static_cast<size_t>(k)).get<float>();
            atlas.uv_step[k] = about.at("uv_step").at(static_cast<size_t>(k)).get<float>();
        }
        uvs = about.at("images").at("uvs").get<bool>();
        colours = about.at("images").at("colours").get<bool>();
        materials = about.at("images").at("materials").get<bool>();
        const Json& has = about.at("attributes");
        atlas.attributes = {has.at("normals").get<bool>(), has.at("uvs").get<bool>(), has.at("colours").get<bool>(),
                            has.at("materials").get<bool>()};
    } catch (const Json::exception& e) { return named(std::string("vgi/atlas: ") + e.what()); }
    if (atlas.cells == 0 || atlas.cells > 4096 || !std::has_single_bit(atlas.cells))
        return named("vgi/atlas: cells are no power of two up to 4096");
    auto sides = file.array<GluedSide>("vgi/sides");
    auto clusters = file.array<uint32_t>("vgi/clusters");
    auto errors = file.array<float>("vgi/errors");
    auto ends = file.array<uint64_t>("vgi/page_ends");
    auto bytes = file.bytes("vgi/page_bytes");
    if (!sides) return tl::unexpected(sides.error());
    if (!clusters) return tl::unexpected(clusters.error());
    if (!errors) return tl::unexpected(errors.error());
    if (!ends) return tl::unexpected(ends.error());
    if (!bytes) return tl::unexpected(bytes.error());
    const PageTree tree{atlas.cells};
    if (clusters->size() != charts || sides->size() != size_t{charts} * 4 || errors->size() != atlas.levels() ||
        ends->size() != size_t{charts} * tree.pages())
        return named("vgi/atlas: the number of charts does not fit the other chunks");
    uint64_t before = 0;
    for (const uint64_t end : *ends) {
        if (end < before || end > bytes->size()) return named("vgi/page_ends: a page has no end");
        before = end;
    }
    atlas.sides.assign(sides->begin(), sides->end());
    atlas.cluster.assign(clusters->begin(), clusters->end());
    atlas.errors.assign(errors->begin(), errors->end());
    const size_t texels = size_t{charts} * atlas.texels_per_chart();
    atlas.positions.resize(texels);
    atlas.normals.resize(texels);
    if (uvs) atlas.uvs.resize(texels);
    if (colours) atlas.colours.resize(texels);
    if (materials) atlas.materials.resize(texels);
    std::vector<std::string> faults(charts);
    parallel_for(charts, 1, [&](size_t begin, size_t end) {
        for (size_t c = begin; c < end; ++c) {
            for (uint32_t p = 0; p < tree.pages() && faults[c].empty(); ++p) {
                const size_t i = c * tree.pages() + p;
                const uint64_t first = i == 0 ? 0 : (*ends)[i - 1];
                if (auto good =
                        decode_page(atlas, static_cast<uint32_t>(c), p, bytes->subspan(first, (*ends)[i] - first));
                    !good)
                    faults[c] = good.error().message;
            }
        }
    });
    for (const std::string& fault : faults) {
        if (!fault.empty()) return fail_at(file.path().string(), {Fault::format, "vgi/page_bytes: " + fault});
    }
    auto shared = read_materials(file);
    if (!shared) return tl::unexpected(shared.error());
    atlas.material_table = std::move(shared->table);
    atlas.images = std::move(shared->images);
    if (auto good = atlas.validate(); !good) return named(good.error().message);
    return atlas;
}

}  // namespace lodestone::vgi
