#include "vgi/asset/atlas_chunks.h"

#include <algorithm>
#include <bit>
#include <nlohmann/json.hpp>

#include "base/check.h"
#include "base/threads.h"
#include "mesh/io/material_chunks.h"
#include "vgi/asset/pages.h"
#include "vgi/asset/saturation.h"

namespace lodestone::vgi {

namespace {
using Json = nlohmann::json;

struct LayerName {
    Layer layer;
    const char *ends, *bytes;  // chunks
};
const LayerName layers[] = {{Layer::geometry, "vgi/geometry_ends", "vgi/geometry_pages"},
                            {Layer::attributes, "vgi/attribute_ends", "vgi/attribute_pages"}};

Result<void> write_layer(const Atlas& atlas, const LayerName& name, ChunkWriter& writer) {
    const PageTree tree = tree_of(atlas, name.layer);
    const std::vector<Channel> channels = channels_of(atlas.attributes, name.layer);
    std::vector<std::vector<std::byte>> packed(size_t{atlas.charts()} * tree.families());
    parallel_for(atlas.charts(), 1, [&](size_t begin, size_t end) {
        for (size_t c = begin; c < end; ++c) {
            const PageTree own = tree_of(atlas, name.layer, static_cast<uint32_t>(c));
            const std::vector<Page> pages = read_pages(atlas, name.layer, static_cast<uint32_t>(c));
            for (uint32_t f = 0; f < own.families(); ++f)  // the others are left out
                packed[c * tree.families() + f] = encode_family(own, channels, f, pages);
        }
    });
    std::vector<uint64_t> ends;
    std::vector<std::byte> bytes;
    for (auto& family : packed) {
        bytes.insert(bytes.end(), family.begin(), family.end());
        ends.push_back(bytes.size());
        family = {};
    }
    if (auto done = writer.add_array(name.ends, std::span<const uint64_t>(ends)); !done) return done;
    return writer.add_array(name.bytes, std::span<const std::byte>(bytes));
}

}  // namespace

Result<void> write_chunks(const Atlas& atlas, ChunkWriter& writer) {
    const Json about = {{"cells", atlas.cells},
                        {"attribute_cells", atlas.attribute_cells},
                        {"charts", atlas.charts()},
                        {"origin", {atlas.origin.x, atlas.origin.y, atlas.origin.z}},
                        {"step", atlas.step},
                        {"uv_low", {atlas.uv_low.x, atlas.uv_low.y}},
                        {"uv_step", {atlas.uv_step.x, atlas.uv_step.y}},
                        {"attributes",
                         {{"normals", atlas.attributes.normals},
                          {"uvs", atlas.attributes.uvs},
                          {"colours", atlas.attributes.colours},
                          {"materials", atlas.attributes.materials}}}};
    Result<void> done = writer.add_text("vgi/atlas", about.dump());
    if (done) done = writer.add_array("vgi/sides", std::span(atlas.sides));
    if (done) done = writer.add_array("vgi/clusters", std::span(atlas.cluster));
    if (done) done = writer.add_array("vgi/left_out", std::span(atlas.trimmed_levels));
    if (done) done = writer.add_array("vgi/errors", std::span(atlas.errors));
    if (done) done = writer.add_array("vgi/bounds", std::span(atlas.bounds));
    for (const LayerName& layer : layers) {
        if (done) done = write_layer(atlas, layer, writer);
    }
    if (done) done = write_materials(writer, atlas.material_table, atlas.images);
    return done;
}

namespace {

Error wrong_asset(const ChunkFile& file, const std::string& what) {
    return {Fault::format, file.path().string() + ": " + what + "; bake the asset again"};
}

// Cells, lattice and attributes; returns the number of charts.
Result<uint32_t> read_about(const ChunkFile& file, Atlas& atlas) {
    const auto wrong = [&](const std::string& what) { return tl::unexpected(wrong_asset(file, "vgi/atlas: " + what)); };
    auto text = file.text("vgi/atlas");
    if (!text) return tl::unexpected(text.error());
    uint32_t charts = 0;
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
        const Json& has = about.at("attributes");
        atlas.attributes = {has.at("normals").get<bool>(), has.at("uvs").get<bool>(), has.at("colours").get<bool>(),
                            has.at("materials").get<bool>()};
    } catch (const Json::exception& e) { return wrong(e.what()); }
    const auto good_cells = [](uint32_t cells) { return cells >= 2 && cells <= 4096 && std::has_single_bit(cells); };
    if (!good_cells(atlas.cells) || !good_cells(atlas.attribute_cells) || atlas.cells > atlas.attribute_cells)
        return wrong("cells are no powers of two, 2 to 4096, those of attributes the larger");
    if (!(atlas.step > 0)) return wrong("the lattice has no step");
    return charts;
}

// What is told of every chart, once the cells are known.
Result<void> read_charts(const ChunkFile& file, uint32_t charts, Atlas& atlas) {
    const auto wrong = [&](const std::string& what) { return tl::unexpected(wrong_asset(file, what)); };
    auto sides = file.array<GluedSide>("vgi/sides");
    auto clusters = file.array<uint32_t>("vgi/clusters");
    auto trimmed_levels = file.array<uint8_t>("vgi/left_out");
    auto errors = file.array<float>("vgi/errors");
    auto bounds = file.array<PageBounds>("vgi/bounds");
    if (!sides) return tl::unexpected(sides.error());
    if (!clusters) return tl::unexpected(clusters.error());
    if (!trimmed_levels) return tl::unexpected(trimmed_levels.error());
    if (!errors) return tl::unexpected(errors.error());
    if (!bounds) return tl::unexpected(bounds.error());
    const uint32_t most_trimmed = tree_of(atlas, Layer::geometry).base_level();
    if (std::ranges::any_of(*trimmed_levels, [&](uint8_t levels) { return levels > most_trimmed; }))
        return wrong("vgi/left_out: a chart has no pages");
    if (clusters->size() != charts || trimmed_levels->size() != charts || sides->size() != size_t{charts} * 4 ||
        errors->size() != atlas.levels() || bounds->size() != size_t{charts} * tree_of(atlas, Layer::geometry).pages())
        return wrong("vgi/atlas: the number of charts does not fit the other chunks");
    atlas.sides.assign(sides->begin(), sides->end());
    atlas.lay_out({trimmed_levels->begin(), trimmed_levels->end()});
    atlas.cluster.assign(clusters->begin(), clusters->end());
    atlas.errors.assign(errors->begin(), errors->end());
    atlas.bounds.assign(bounds->begin(), bounds->end());
    if (auto good = atlas.validate_gluing(); !good) return wrong(good.error().message);
    return {};
}

}  // namespace

Result<void> AtlasFile::find_pages(Layer layer, const char* ends_chunk, const char* bytes_chunk) {
    const auto wrong = [&](const std::string& what) {
        return tl::unexpected(wrong_asset(file_, std::string(ends_chunk) + ": " + what));
    };
    auto ends = file_.array<uint64_t>(ends_chunk);
    if (!ends) return tl::unexpected(ends.error());
    auto bytes = file_.unchecked_bytes(bytes_chunk);  // pages may be more than memory holds
    if (!bytes) return tl::unexpected(bytes.error());
    if (ends->size() != size_t{about_.charts()} * tree_of(about_, layer).families())
        return wrong("is not one per family of pages");
    uint64_t before = 0;
    for (const uint64_t end : *ends) {
        if (end < before || end > bytes->size()) return wrong("a family of pages has no end");
        before = end;
    }
    ends_[static_cast<size_t>(layer)] = *ends;
    pages_[static_cast<size_t>(layer)] = *bytes;
    return {};
}

Result<AtlasFile> AtlasFile::open(const ChunkFile& file) {
    AtlasFile opened(file);
    Atlas& atlas = opened.about_;
    const auto charts = read_about(file, atlas);
    if (!charts) return tl::unexpected(charts.error());
    if (auto read = read_charts(file, *charts, atlas); !read) return tl::unexpected(read.error());
    for (const LayerName& layer : layers) {
        if (auto found = opened.find_pages(layer.layer, layer.ends, layer.bytes); !found)
            return tl::unexpected(found.error());
    }
    auto shared = read_materials(file);
    if (!shared) return tl::unexpected(shared.error());
    atlas.material_table = std::move(shared->table);
    atlas.images = std::move(shared->images);
    return opened;
}

AtlasFile::ByteRange AtlasFile::place(Layer layer, uint32_t chart, uint32_t page) const {
    const auto l = static_cast<size_t>(layer);
    const PageTree tree = tree_of(about_, layer);
    const size_t i = size_t{chart} * tree.families() + tree.family(page);
    LODE_CHECK(i < ends_[l].size(), chart, page);
    const uint64_t first = i == 0 ? 0 : ends_[l][i - 1];
    return {layers[l].bytes, first, ends_[l][i] - first};
}

bool AtlasFile::has(Layer layer, uint32_t chart, uint32_t page) const {
    return page < tree_of(about_, layer, chart).pages();
}

std::span<const std::byte> AtlasFile::bytes(Layer layer, uint32_t chart, uint32_t page) const {
    const ByteRange at = place(layer, chart, page);
    return pages_[static_cast<size_t>(layer)].subspan(at.offset, at.bytes);
}

Result<Atlas> open_atlas(const ChunkFile& file) {
    const auto opened = AtlasFile::open(file);
    if (!opened) return tl::unexpected(opened.error());
    Atlas atlas = opened->about();
    atlas.make_room();
    for (const LayerName& name : layers) {
        const std::vector<Channel> channels = channels_of(atlas.attributes, name.layer);
        std::vector<std::string> faults(atlas.charts());
        parallel_for(atlas.charts(), 1, [&](size_t begin, size_t end) {
            for (auto c = static_cast<uint32_t>(begin); c < end; ++c) {
                const PageTree tree = tree_of(atlas, name.layer, c);
                std::vector<Page> pages;
                pages.resize(tree.pages());
                for (uint32_t f = 0; f < tree.families(); ++f) {
                    const auto family =
                        PageFamily::unpack(tree, channels, f, opened->bytes(name.layer, c, tree.member(f, 0)));
                    if (!family) {
                        faults[c] = "chart " + std::to_string(c) + ", " + family.error().message;
                        break;
                    }
                    for (uint32_t k = 0; k < PageTree::members(f); ++k) {
                        const uint32_t p = tree.member(f, k);
                        pages[p] = family->page(p, p == 0 ? nullptr : &pages[tree.parent(p)]);
                        write_page(atlas, name.layer, c, p, pages[p]);
                    }
                }
            }
        });
        for (const std::string& fault : faults) {
            if (!fault.empty())
                return fail_at(file.path().string(), {Fault::format, std::string(name.bytes) + ": " + fault});
        }
    }
    for (const auto& good : {atlas.validate(), validate_errors(atlas)}) {
        if (!good)
            return fail_at(file.path().string(), {Fault::format, good.error().message + "; bake the asset again"});
    }
    return atlas;
}

}  // namespace lodestone::vgi
