#include "vgi/asset/atlas_chunks.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/check.h"
#include "base/hash.h"
#include "base/json.h"
#include "base/threads.h"
#include "mesh/io/material_chunks.h"
#include "vgi/asset/codec/leaf_codec.h"
#include "vgi/asset/codec/page_family.h"
#include "vgi/asset/corners.h"
#include "vgi/asset/leaves/leaves.h"
#include "vgi/asset/saturation.h"

namespace lodestone::vgi {

namespace {

struct LayerName {
    Layer layer;
    const char *ends, *sums, *bytes;  // chunks
};
const LayerName layers[] = {{Layer::geometry, "vgi/geometry_ends", "vgi/geometry_sums", "vgi/geometry_pages"},
                            {Layer::attributes, "vgi/attribute_ends", "vgi/attribute_sums", "vgi/attribute_pages"}};
const LayerName& name_of(Layer layer) { return layers[static_cast<size_t>(layer)]; }

// Chunks of leaves.
constexpr const char *leaf_table = "vgi/leaves", *leaf_ends = "vgi/leaf_ends", *leaf_sums = "vgi/leaf_sums",
                     *leaf_bytes = "vgi/leaf_parts";
constexpr uint64_t most_part_bytes = uint64_t{1} << 15;  // a part of a leaf takes less: 24 bytes a vertex, 3 a triangle

// A family takes less: eight streams of 32 kB at most.
constexpr uint64_t most_family_bytes = uint64_t{1} << 19;

// Per chart, and the end: the number of its first family.
std::vector<size_t> first_families(const Atlas& atlas, Layer layer) {
    std::vector<size_t> first{0};
    for (uint32_t c = 0; c < atlas.charts(); ++c) first.push_back(first.back() + tree_of(atlas, layer, c).families());
    return first;
}

Result<void> write_layer(const Atlas& atlas, const LayerName& name, ChunkWriter& writer) {
    const std::vector<size_t> first = first_families(atlas, name.layer);
    const std::array<std::vector<Channel>, 2> channels{channels_of(atlas.attributes, name.layer),
                                                       channels_of(atlas.attributes, name.layer, true)};
    std::vector<std::vector<std::byte>> packed(first.back());
    parallel_for(atlas.charts(), 1, [&](size_t begin, size_t end) {
        for (size_t c = begin; c < end; ++c) {
            const PageTree own = tree_of(atlas, name.layer, static_cast<uint32_t>(c));
            std::vector<Page> pages = read_pages(atlas, name.layer, static_cast<uint32_t>(c));
            for (uint32_t f = 0; f < own.families(); ++f)
                packed[first[c] + f] = encode_family(own, channels[atlas.dense[c]], f, pages);
        }
    });
    std::vector<uint64_t> ends;
    std::vector<uint32_t> sums;
    std::vector<std::byte> bytes;
    for (auto& family : packed) {
        bytes.insert(bytes.end(), family.begin(), family.end());
        ends.push_back(bytes.size());
        sums.push_back(checksum(family));
        family = {};
    }
    if (auto done = writer.add_array(name.ends, std::span<const uint64_t>(ends)); !done) return done;
    if (auto done = writer.add_array(name.sums, std::span<const uint32_t>(sums)); !done) return done;
    return writer.add_array(name.bytes, std::span<const std::byte>(bytes));
}

Result<void> write_leaves(const Atlas& atlas, ChunkWriter& writer) {
    LODE_CHECK(atlas.leaf_parts.size() == atlas.leaf_part_count(), atlas.leaf_parts.size());
    std::vector<uint32_t> sums;
    for (size_t p = 0; p < atlas.leaf_parts.size(); ++p) sums.push_back(checksum(atlas.leaf_parts[p]));
    Result<void> done = writer.add_array(leaf_table, std::span(atlas.leaves));
    if (done) done = writer.add_array(leaf_ends, atlas.leaf_parts.ends());
    if (done) done = writer.add_array(leaf_sums, std::span<const uint32_t>(sums));
    if (done) done = writer.add_array(leaf_bytes, atlas.leaf_parts.bytes());
    return done;
}

}  // namespace

Result<void> write_chunks(const Atlas& atlas, ChunkWriter& writer) {
    const Json about = {{"cells", atlas.cells},
                        {"attribute_cells", atlas.attribute_cells},
                        {"charts", atlas.charts()},
                        {"origin", {atlas.origin.x, atlas.origin.y, atlas.origin.z}},
                        {"step", atlas.step},
                        {"leaf_shift", atlas.leaf_shift},
                        {"uv_low", {atlas.uv_low.x, atlas.uv_low.y}},
                        {"uv_step", {atlas.uv_step.x, atlas.uv_step.y}},
                        {"attributes",
                         {{"normals", atlas.attributes.normals},
                          {"uvs", atlas.attributes.uvs},
                          {"colours", atlas.attributes.colours},
                          {"materials", atlas.attributes.materials},
                          {"surfaces", atlas.attributes.surfaces},
                          {"emissions", atlas.attributes.emissions},
                          {"baked", atlas.attributes.baked},
                          {"mapped_normals", atlas.attributes.mapped_normals},
                          {"texture_quality", atlas.attributes.texture_quality},
                          {"dense_quality", atlas.attributes.dense_quality}}}};
    Result<void> done = writer.add_text("vgi/atlas", about.dump());
    if (done) done = writer.add_array("vgi/sides", std::span(atlas.sides));
    if (done) done = writer.add_array("vgi/clusters", std::span(atlas.cluster));
    if (done) done = writer.add_array("vgi/left_out", std::span(atlas.trimmed_levels));
    if (done) done = writer.add_array("vgi/attributes_left_out", std::span(atlas.trimmed_attribute_levels));
    if (done) done = writer.add_array("vgi/unsampled", std::span(atlas.unsampled_levels));
    if (done) done = writer.add_array("vgi/attributes_unsampled", std::span(atlas.unsampled_attribute_levels));
    if (done) done = writer.add_array("vgi/dense", std::span(atlas.dense));
    if (done) done = writer.add_array("vgi/errors", std::span(atlas.errors));
    if (done) done = writer.add_array("vgi/bounds", std::span(atlas.bounds));
    if (done) done = writer.add_array("vgi/corners", std::span(atlas.corners));
    if (done) done = writer.add_array("vgi/chart_corners", std::span(atlas.chart_corners));
    for (const LayerName& layer : layers) {
        if (done) done = write_layer(atlas, layer, writer);
    }
    if (done && !atlas.leaves.empty()) done = write_leaves(atlas, writer);
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
        atlas.leaf_shift = about.at("leaf_shift").get<uint32_t>();
        for (int k = 0; k < 2; ++k) {
            atlas.uv_low[k] = about.at("uv_low").at(static_cast<size_t>(k)).get<float>();
            atlas.uv_step[k] = about.at("uv_step").at(static_cast<size_t>(k)).get<float>();
        }
        const Json& has = about.at("attributes");
        const auto flag = [&](const char* name) { return has.at(name).get<bool>(); };
        atlas.attributes = {{flag("normals"), flag("uvs"), flag("colours"), flag("materials")},
                            flag("surfaces"),
                            flag("emissions"),
                            flag("baked"),
                            flag("mapped_normals"),
                            has.at("texture_quality").get<uint8_t>(),
                            has.at("dense_quality").get<uint8_t>()};
    } catch (const Json::exception& e) { return wrong(e.what()); }
    const auto good_cells = [](uint32_t cells) { return cells >= 2 && cells <= 4096 && std::has_single_bit(cells); };
    if (!good_cells(atlas.cells) || !good_cells(atlas.attribute_cells) || atlas.cells > atlas.attribute_cells)
        return wrong("cells are no powers of two, 2 to 4096, those of attributes the larger");
    if (!(atlas.step > 0)) return wrong("the lattice has no step");
    const AtlasAttributes& attributes = atlas.attributes;
    if (attributes.texture_quality > 100 || attributes.dense_quality > 100 ||
        (attributes.texture_quality == 0) != (attributes.dense_quality == 0))
        return wrong("textures have no quality from 0 to 100");
    if (atlas.leaf_shift > most_leaf_shift) return wrong("the leaves' lattice is too fine");
    bool numbers = std::isfinite(atlas.step);
    for (int k = 0; k < 3; ++k) numbers = numbers && std::isfinite(atlas.origin[k]);
    for (int k = 0; k < 2; ++k) numbers = numbers && std::isfinite(atlas.uv_low[k]) && std::isfinite(atlas.uv_step[k]);
    if (!numbers) return wrong("the lattice is not made of numbers");
    return charts;
}

tl::unexpected<Error> past(const char* what, uint64_t is, uint64_t most) {
    return fail(Fault::format, "has " + std::to_string(is) + " " + what + "; the limit is " + std::to_string(most) +
                                   "; bake with fewer clusters or a lower resolution");
}
Result<void> check_counts(uint32_t charts, const Atlas& atlas, const Limits& limits) {
    if (charts == 0) return fail(Fault::format, "vgi/atlas: there are no charts; bake the asset again");
    if (charts > limits.charts) return past("charts", charts, limits.charts);
    for (const LayerName& name : layers) {
        const uint64_t pages = uint64_t{charts} * tree_of(atlas, name.layer).pages();
        if (pages > limits.pages) return past("pages", pages, limits.pages);
    }
    return {};
}

// Errors that never fall and spheres that are some.
Result<void> check_numbers(const Atlas& atlas) {
    const auto wrong = [](const char* what) { return fail(Fault::format, what); };
    for (size_t level = 0; level < atlas.errors.size(); ++level) {
        const float below = level == 0 ? 0 : atlas.errors[level - 1];
        if (!(atlas.errors[level] >= below) || !std::isfinite(atlas.errors[level]))
            return wrong("vgi/errors: errors fall, or are no numbers");
    }
    for (const PageBounds& b : atlas.bounds) {
        const float sum = b.centre.x + b.centre.y + b.centre.z + b.radius + b.error;
        if (!std::isfinite(sum) || !(b.radius >= 0) || !(b.error >= 0))
            return wrong("vgi/bounds: bounds are no numbers, or below 0");
    }
    return {};
}

Result<void> read_corners(const ChunkFile& file, Atlas& atlas) {
    auto corners = file.array<Corner>("vgi/corners");
    if (!corners) return tl::unexpected(corners.error());
    auto of_charts = file.array<std::array<uint32_t, 4>>("vgi/chart_corners");
    if (!of_charts) return tl::unexpected(of_charts.error());
    atlas.corners.assign(corners->begin(), corners->end());
    atlas.chart_corners.assign(of_charts->begin(), of_charts->end());
    if (auto good = validate_corners(atlas); !good)
        return tl::unexpected(wrong_asset(file, "vgi/corners: " + good.error().message));
    return {};
}

// How deep charts are sampled.
Result<void> read_depths(const ChunkFile& file, uint32_t charts, Atlas& atlas) {
    auto positions = file.array<uint8_t>("vgi/unsampled");
    if (!positions) return tl::unexpected(positions.error());
    auto attributes = file.array<uint8_t>("vgi/attributes_unsampled");
    if (!attributes) return tl::unexpected(attributes.error());
    if (positions->size() != charts || attributes->size() != charts)
        return tl::unexpected(wrong_asset(file, "vgi/unsampled: is not one per chart"));
    atlas.unsampled_levels.assign(positions->begin(), positions->end());
    atlas.unsampled_attribute_levels.assign(attributes->begin(), attributes->end());
    if (auto good = atlas.validate_depths(); !good)
        return tl::unexpected(wrong_asset(file, "vgi/unsampled: " + good.error().message));
    return {};
}

// What charts leave out, and which are dense.
Result<void> read_sizes(const ChunkFile& file, uint32_t charts, Atlas& atlas) {
    const auto wrong = [&](const std::string& what) { return tl::unexpected(wrong_asset(file, what)); };
    auto positions = file.array<uint8_t>("vgi/left_out");
    auto attributes = file.array<uint8_t>("vgi/attributes_left_out");
    auto dense = file.array<uint8_t>("vgi/dense");
    if (!positions) return tl::unexpected(positions.error());
    if (!attributes) return tl::unexpected(attributes.error());
    if (!dense) return tl::unexpected(dense.error());
    if (positions->size() != charts || attributes->size() != charts || dense->size() != charts)
        return wrong("vgi/left_out: is not one per chart");
    for (uint32_t c = 0; c < charts; ++c) {
        if ((*positions)[c] > tree_of(atlas, Layer::geometry).base_level())
            return wrong("vgi/left_out: a chart has no pages");
        if ((*attributes)[c] > tree_of(atlas, Layer::attributes).base_level())
            return wrong("vgi/attributes_left_out: a chart has no pages");
        if (atlas.attribute_cells >> (*attributes)[c] < atlas.cells >> (*positions)[c])
            return wrong("vgi/attributes_left_out: a chart has fewer samples of attributes than of positions");
        if ((*dense)[c] > 1) return wrong("vgi/dense: is neither 0 nor 1");
    }
    atlas.lay_out({positions->begin(), positions->end()}, {attributes->begin(), attributes->end()});
    atlas.dense.assign(dense->begin(), dense->end());
    return read_depths(file, charts, atlas);
}

// What is told of every chart, once the cells are known.
Result<void> read_charts(const ChunkFile& file, uint32_t charts, const Limits& limits, Atlas& atlas) {
    const auto wrong = [&](const std::string& what) { return tl::unexpected(wrong_asset(file, what)); };
    const std::string path = file.path().string();
    if (auto good = check_counts(charts, atlas, limits); !good) return fail_at(path, good.error());
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
        return wrong("vgi/atlas: the number of charts does not fit the other chunks");
    atlas.sides.assign(sides->begin(), sides->end());
    if (auto read = read_sizes(file, charts, atlas); !read) return read;
    for (const uint64_t samples : {atlas.texels(), atlas.attribute_texels()}) {
        if (samples > limits.samples) return fail_at(path, past("samples", samples, limits.samples).value());
    }
    atlas.cluster.assign(clusters->begin(), clusters->end());
    atlas.errors.assign(errors->begin(), errors->end());
    atlas.bounds.assign(bounds->begin(), bounds->end());
    if (auto good = check_numbers(atlas); !good) return wrong(good.error().message);
    if (auto good = atlas.validate_gluing(); !good) return wrong(good.error().message);
    return read_corners(file, atlas);
}

// What errors call a page.
std::string text_of(const AtlasFile::PageName& name) {
    return std::string(name_of(name.layer).bytes) + ": chart " + std::to_string(name.chart) + ", page " +
           std::to_string(name.page);
}
tl::unexpected<Error> wrong_page(const AtlasFile::PageName& name, const char* what) {
    return fail(Fault::format, text_of(name) + ": " + what + "; bake the asset again");
}

}  // namespace

// Families lie behind one another, and a chart has those of its own pages.
Result<void> AtlasFile::find_pages(Layer layer) {
    const LayerName& name = name_of(layer);
    const auto wrong = [&](const std::string& what) {
        return tl::unexpected(wrong_asset(file_, std::string(name.ends) + ": " + what));
    };
    auto ends = file_.array<uint64_t>(name.ends);
    if (!ends) return tl::unexpected(ends.error());
    auto sums = file_.array<uint32_t>(name.sums);
    if (!sums) return tl::unexpected(sums.error());
    const auto pages = std::ranges::find(file_.chunks(), name.bytes, &ChunkInfo::name);
    if (pages == file_.chunks().end()) return wrong("there are no pages");
    std::vector<size_t>& first = first_[static_cast<size_t>(layer)] = first_families(about_, layer);
    if (ends->size() != first.back() || sums->size() != ends->size()) return wrong("is not one per family of pages");
    uint64_t before = 0;
    for (uint32_t chart = 0; chart < about_.charts(); ++chart) {
        const PageTree tree = tree_of(about_, layer, chart);
        for (uint32_t family = 0; family < tree.families(); ++family) {
            const uint64_t end = (*ends)[first[chart] + family];
            if (end < before || end > pages->bytes || end - before > most_family_bytes)
                return wrong("a family of pages has no end");
            if (end == before && tree.has_samples(family)) return wrong("a family of pages is not there");
            before = end;
        }
    }
    ends_[static_cast<size_t>(layer)] = *ends;
    sums_[static_cast<size_t>(layer)] = *sums;
    return {};
}

// Squares have rising numbers of parts, and parts lie behind one another.
Result<void> AtlasFile::find_leaves(const Limits& limits) {
    const auto& chunks = file_.chunks();
    const auto bytes = std::ranges::find(chunks, leaf_bytes, &ChunkInfo::name);
    if (bytes == chunks.end()) return {};
    const auto wrong = [&](const std::string& what) { return tl::unexpected(wrong_asset(file_, what)); };
    auto leaves = file_.array<Leaf>(leaf_table);
    if (!leaves) return tl::unexpected(leaves.error());
    auto ends = file_.array<uint64_t>(leaf_ends);
    if (!ends) return tl::unexpected(ends.error());
    auto sums = file_.array<uint32_t>(leaf_sums);
    if (!sums) return tl::unexpected(sums.error());
    if (leaves->size() != about_.first_leaf.back()) return wrong("vgi/leaves: is not one per square");
    uint32_t parts = 0;
    for (const Leaf& leaf : *leaves) {
        if (leaf.parts_end < parts || (leaf.error > 0) != (leaf.parts_end > parts))
            return wrong("vgi/leaves: a leaf has parts without an error, or an error without parts");
        parts = leaf.parts_end;
    }
    if (parts > limits.pages)
        return fail_at(file_.path().string(), past("parts of leaves", parts, limits.pages).value());
    if (ends->size() != parts || sums->size() != parts) return wrong("vgi/leaf_ends: is not one per part");
    uint64_t before = 0;
    for (const uint64_t end : *ends) {
        if (end <= before || end > bytes->bytes || end - before > most_part_bytes)
            return wrong("vgi/leaf_ends: a part has no end");
        before = end;
    }
    about_.leaves.assign(leaves->begin(), leaves->end());
    leaf_ends_ = *ends;
    leaf_sums_ = *sums;
    return {};
}

Result<AtlasFile> AtlasFile::open(const ChunkFile& file, const Limits& limits) {
    AtlasFile opened(file);
    Atlas& atlas = opened.about_;
    const auto charts = read_about(file, atlas);
    if (!charts) return tl::unexpected(charts.error());
    if (auto read = read_charts(file, *charts, limits, atlas); !read) return tl::unexpected(read.error());
    for (const LayerName& layer : layers) {
        for (const bool dense : {false, true})
            opened.channels_[static_cast<size_t>(layer.layer)][dense] =
                channels_of(atlas.attributes, layer.layer, dense);
        if (auto found = opened.find_pages(layer.layer); !found) return tl::unexpected(found.error());
    }
    if (auto found = opened.find_leaves(limits); !found) return tl::unexpected(found.error());
    auto shared = read_materials(file);
    if (!shared) return tl::unexpected(shared.error());
    atlas.material_table = std::move(shared->table);
    atlas.images = std::move(shared->images);
    return opened;
}

size_t AtlasFile::number(Layer layer, uint32_t chart, uint32_t page) const {
    LODE_CHECK(has(layer, chart, page), chart, page);
    return first_[static_cast<size_t>(layer)][chart] + tree_of(about_, layer, chart).family(page);
}

AtlasFile::ByteRange AtlasFile::place(Layer layer, uint32_t chart, uint32_t page) const {
    const auto l = static_cast<size_t>(layer);
    const size_t i = number(layer, chart, page);
    const uint64_t first = i == 0 ? 0 : ends_[l][i - 1];
    return {layers[l].bytes, first, ends_[l][i] - first};
}

bool AtlasFile::has(Layer layer, uint32_t chart, uint32_t page) const {
    return page < tree_of(about_, layer, chart).pages();
}

Result<std::vector<std::byte>> AtlasFile::read(const PageName& name) const {
    const ByteRange at = place(name.layer, name.chart, name.page);
    std::vector<std::byte> bytes(at.bytes);
    if (auto read = file_.read_part(at.chunk, at.offset, bytes); !read)
        return fail(read.error().fault, text_of(name) + ": cannot be read");
    return bytes;
}

Result<PageFamily> AtlasFile::unpack(const PageName& name, std::span<const std::byte> bytes) const {
    const PageTree tree = tree_of(about_, name.layer, name.chart);
    const uint32_t family = tree.family(name.page);
    if (checksum(bytes) != sums_[static_cast<size_t>(name.layer)][number(name.layer, name.chart, name.page)])
        return wrong_page(name, "is damaged");
    auto unpacked = PageFamily::unpack(tree, channels(name.layer, name.chart), family, bytes);
    if (!unpacked) return wrong_page(name, "cannot be unpacked");
    return unpacked;
}

Result<Page> AtlasFile::decode(const PageName& name, const PageFamily& family, const Page* parent) const {
    Page page = family.page(name.page, parent);
    if (name.layer == Layer::geometry || !about_.attributes.materials) return page;
    // They are the last channel (channels_of).
    const uint32_t side = tree_of(about_, name.layer, name.chart).samples_per_side();
    const size_t materials = std::max<size_t>(1, about_.material_table.size());
    const auto numbers = std::span(page.values).last(size_t{side} * side);
    if (std::ranges::any_of(numbers, [&](uint16_t material) { return material >= materials; }))
        return wrong_page(name, "names a material that there is not");
    return page;
}

AtlasFile::ByteRange AtlasFile::leaf_place(uint32_t part) const {
    LODE_CHECK(part < leaf_ends_.size(), part);
    const uint64_t first = part == 0 ? 0 : leaf_ends_[part - 1];
    return {leaf_bytes, first, leaf_ends_[part] - first};
}

Result<uint64_t> AtlasFile::leaf_triangles() const {
    const std::lock_guard lock(leaf_count_->mutex);
    if (!leaf_count_->triangles) {
        Result<uint64_t> count = count_leaf_triangles();
        if (!count) return count;
        leaf_count_->triangles = *count;
    }
    return *leaf_count_->triangles;
}

Result<uint64_t> AtlasFile::count_leaf_triangles() const {
    uint64_t count = 0;
    for (uint32_t part = 0; part < about_.leaf_part_count(); ++part) {
        const ByteRange at = leaf_place(part);
        std::vector<std::byte> begin(std::min<uint64_t>(at.bytes, leaf_header_bytes));
        if (auto read = file_.read_part(at.chunk, at.offset, begin); !read) return tl::unexpected(read.error());
        count += triangles_in_leaf(begin);
    }
    return count;
}

Result<std::vector<std::byte>> AtlasFile::read_leaf(uint32_t part) const {
    const ByteRange at = leaf_place(part);
    std::vector<std::byte> bytes(at.bytes);
    if (auto read = file_.read_part(at.chunk, at.offset, bytes); !read)
        return fail(read.error().fault,
                    std::string(leaf_bytes) + ": part " + std::to_string(part) + ": cannot be read");
    return bytes;
}

Result<LeafPart> AtlasFile::decode_leaf(uint32_t part, std::span<const std::byte> bytes) const {
    const auto wrong = [&](const std::string& what) {
        return fail(Fault::format, std::string(leaf_bytes) + ": part " + std::to_string(part) + ": " + what +
                                       "; bake the asset again");
    };
    if (checksum(bytes) != leaf_sums_[part]) return wrong("is damaged");
    auto decoded = vgi::decode_leaf(bytes, about_.attributes);
    if (!decoded) return wrong(decoded.error().message);
    if (auto good = decoded->validate(about_, tree_of(about_, Layer::geometry).cells_per_page()); !good)
        return wrong(good.error().message);
    return decoded;
}

namespace {

// All parts of leaves, which are looked at and kept as they are.
Result<void> read_leaves(const AtlasFile& file, Atlas& atlas) {
    constexpr uint32_t at_a_time = 4096;
    const uint32_t count = atlas.leaf_part_count();
    std::vector<Result<std::vector<std::byte>>> parts;
    for (uint32_t first = 0; first < count; first += at_a_time) {
        parts.assign(std::min(at_a_time, count - first), std::vector<std::byte>{});
        parallel_for(parts.size(), 16, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; ++i) {
                const uint32_t p = first + static_cast<uint32_t>(i);
                parts[i] = file.read_leaf(p);
                if (!parts[i]) continue;
                if (const auto part = file.decode_leaf(p, *parts[i]); !part) parts[i] = tl::unexpected(part.error());
            }
        });
        for (const auto& part : parts) {
            if (!part) return tl::unexpected(part.error());
            atlas.leaf_parts.add(*part);
        }
    }
    return {};
}

// All pages of one chart, into the images.
Result<void> read_chart(const AtlasFile& file, Layer layer, uint32_t chart, Atlas& atlas) {
    const PageTree tree = tree_of(atlas, layer, chart);
    std::vector<Page> pages(tree.pages());
    for (uint32_t f = 0; f < tree.families(); ++f) {
        const AtlasFile::PageName first{layer, chart, tree.member(f, 0)};
        const auto bytes = file.read(first);
        if (!bytes) return tl::unexpected(bytes.error());
        const auto family = file.unpack(first, *bytes);
        if (!family) return tl::unexpected(family.error());
        for (uint32_t k = 0; k < PageTree::members(f); ++k) {
            const uint32_t p = tree.member(f, k);
            auto page = file.decode({layer, chart, p}, *family, p == 0 ? nullptr : &pages[tree.parent(p)]);
            if (!page) return tl::unexpected(page.error());
            pages[p] = std::move(*page);
            write_page(atlas, layer, chart, p, pages[p]);
        }
    }
    return {};
}

}  // namespace

Result<Atlas> open_atlas(const ChunkFile& file) {
    const auto opened = AtlasFile::open(file);
    if (!opened) return tl::unexpected(opened.error());
    const std::string path = file.path().string();
    Atlas atlas = opened->about();
    atlas.make_room();
    for (const LayerName& name : layers) {
        std::vector<Result<void>> charts(atlas.charts());
        parallel_for(atlas.charts(), 1, [&](size_t begin, size_t end) {
            for (auto c = static_cast<uint32_t>(begin); c < end; ++c)
                charts[c] = read_chart(*opened, name.layer, c, atlas);
        });
        const auto failed = std::ranges::find_if(charts, [](const Result<void>& chart) { return !chart; });
        if (failed != charts.end()) return fail_at(path, failed->error());
    }
    if (auto read = read_leaves(*opened, atlas); !read) return fail_at(path, read.error());
    Result<void> good = atlas.validate();
    if (good) good = validate_errors(atlas);
    if (good) good = validate_leaves(atlas);
    if (!good) return fail_at(path, {Fault::format, good.error().message + "; bake the asset again"});
    return atlas;
}

}  // namespace lodestone::vgi
