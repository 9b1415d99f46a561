#include "vgi/atlas_chunks.h"

#include <bit>
#include <nlohmann/json.hpp>

#include "base/threads.h"
#include "mesh/io/material_chunks.h"
#include "vgi/pages.h"
#include "vgi/sample_errors.h"

namespace lodestone::vgi {

namespace {
using Json = nlohmann::json;

struct LayerName {
    Layer layer;
    std::string ends, bytes;  // chunks
};
const LayerName layers[] = {{Layer::geometry, "vgi/geometry_ends", "vgi/geometry_pages"},
                            {Layer::attributes, "vgi/attribute_ends", "vgi/attribute_pages"}};

Result<void> write_layer(const Atlas& atlas, const LayerName& name, ChunkWriter& writer) {
    const PageTree tree = tree_of(atlas, name.layer);
    const std::vector<Channel> channels = channels_of(atlas, name.layer);
    std::vector<std::vector<std::byte>> packed(size_t{atlas.charts()} * tree.pages());
    parallel_for(atlas.charts(), 1, [&](size_t begin, size_t end) {
        for (size_t c = begin; c < end; ++c) {
            std::vector<Page> pages;
            for (uint32_t p = 0; p < tree.pages(); ++p) {
                pages.push_back(read_page(atlas, name.layer, static_cast<uint32_t>(c), p));
                packed[c * tree.pages() + p] =
                    encode_page(tree, channels, p, pages[p], p == 0 ? nullptr : &pages[tree.parent(p)]);
            }
        }
    });
    std::vector<uint64_t> ends;
    std::vector<std::byte> bytes;
    for (auto& page : packed) {
        bytes.insert(bytes.end(), page.begin(), page.end());
        ends.push_back(bytes.size());
        page = {};
    }
    if (auto done = writer.add_array(name.ends, std::span<const uint64_t>(ends)); !done) return done;
    return writer.add_array(name.bytes, std::span<const std::byte>(bytes));
}

Result<void> read_layer(const ChunkFile& file, const LayerName& name, Atlas& atlas) {
    const PageTree tree = tree_of(atlas, name.layer);
    const std::vector<Channel> channels = channels_of(atlas, name.layer);
    auto ends = file.array<uint64_t>(name.ends);
    if (!ends) return tl::unexpected(ends.error());
    auto bytes = file.bytes(name.bytes);
    if (!bytes) return tl::unexpected(bytes.error());
    const auto wrong = [&](const std::string& what) {
        return fail_at(file.path().string(), {Fault::format, name.ends + ": " + what + "; bake the asset again"});
    };
    if (ends->size() != size_t{atlas.charts()} * tree.pages()) return wrong("is not one per page");
    uint64_t before = 0;
    for (const uint64_t end : *ends) {
        if (end < before || end > bytes->size()) return wrong("a page has no end");
        before = end;
    }
    std::vector<std::string> faults(atlas.charts());
    parallel_for(atlas.charts(), 1, [&](size_t begin, size_t end) {
        for (size_t c = begin; c < end; ++c) {
            std::vector<Page> pages;
            for (uint32_t p = 0; p < tree.pages() && faults[c].empty(); ++p) {
                const size_t i = c * tree.pages() + p;
                const uint64_t first = i == 0 ? 0 : (*ends)[i - 1];
                auto page = decode_page(tree, channels, p, bytes->subspan(first, (*ends)[i] - first),
                                        p == 0 ? nullptr : &pages[tree.parent(p)]);
                if (!page) {
                    faults[c] = "chart " + std::to_string(c) + ", " + page.error().message;
                    break;
                }
                write_page(atlas, name.layer, static_cast<uint32_t>(c), p, *page);
                pages.push_back(std::move(*page));
            }
        }
    });
    for (const std::string& fault : faults) {
        if (!fault.empty()) return fail_at(file.path().string(), {Fault::format, name.bytes + ": " + fault});
    }
    return {};
}

}  // namespace

Result<void> write_chunks(const Atlas& atlas, ChunkWriter& writer) {
    const Json about = {
        {"cells", atlas.cells},
        {"attribute_cells", atlas.attribute_cells},
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
    Result<void> done = writer.add_text("vgi/atlas", about.dump());
    if (done) done = writer.add_array("vgi/sides", std::span(atlas.sides));
    if (done) done = writer.add_array("vgi/clusters", std::span(atlas.cluster));
    if (done) done = writer.add_array("vgi/errors", std::span(atlas.errors));
    if (done) done = writer.add_array("vgi/bounds", std::span(atlas.bounds));
    for (const LayerName& layer : layers) {
        if (done) done = write_layer(atlas, layer, writer);
    }
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
        atlas.attribute_cells = about.at("attribute_cells").get<uint32_t>();
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
    const auto good_cells = [](uint32_t cells) { return cells >= 2 && cells <= 4096 && std::has_single_bit(cells); };
    if (!good_cells(atlas.cells) || !good_cells(atlas.attribute_cells) || atlas.cells > atlas.attribute_cells)
        return named("vgi/atlas: cells are no powers of two, 2 to 4096, those of attributes the larger");
    if (!(atlas.step > 0)) return named("vgi/atlas: the lattice has no step");
    auto sides = file.array<GluedSide>("vgi/sides");
    auto clusters = file.array<uint32_t>("vgi/clusters");
    auto errors = file.array<float>("vgi/errors");
    auto bounds = file.array<PageBounds>("vgi/bounds");
    if (!sides) return tl::unexpected(sides.error());
    if (!clusters) return tl::unexpected(clusters.error());
    if (!errors) return tl::unexpected(errors.error());
    if (!bounds) return tl::unexpected(bounds.error());
    if (clusters->size() != charts || sides->size() != size_t{charts} * 4 || errors->size() != atlas.levels() ||
        bounds->size() != size_t{charts} * tree_of(atlas, Layer::geometry).pages())
        return named("vgi/atlas: the number of charts does not fit the other chunks");
    atlas.sides.assign(sides->begin(), sides->end());
    atlas.cluster.assign(clusters->begin(), clusters->end());
    atlas.errors.assign(errors->begin(), errors->end());
    atlas.bounds.assign(bounds->begin(), bounds->end());
    const size_t texels = size_t{charts} * atlas.texels_per_chart(),
                 attribute_texels = atlas.attribute_texel(charts, 0, 0);
    atlas.positions.resize(texels);
    atlas.sample_errors.resize(texels);
    atlas.sample_radii.resize(texels);
    atlas.normals.resize(attribute_texels);
    if (uvs) atlas.uvs.resize(attribute_texels);
    if (colours) atlas.colours.resize(attribute_texels);
    if (materials) atlas.materials.resize(attribute_texels);
    for (const LayerName& layer : layers) {
        if (auto done = read_layer(file, layer, atlas); !done) return tl::unexpected(done.error());
    }
    auto shared = read_materials(file);
    if (!shared) return tl::unexpected(shared.error());
    atlas.material_table = std::move(shared->table);
    atlas.images = std::move(shared->images);
    if (auto good = atlas.validate(); !good) return named(good.error().message);
    if (auto good = validate_errors(atlas); !good) return named(good.error().message);
    return atlas;
}

}  // namespace lodestone::vgi
