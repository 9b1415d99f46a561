#include "vgi/asset/atlas_chunks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>

#include "fixtures/crafted.h"
#include "fixtures/meshes.h"
#include "vgi/asset/codec/page_family.h"
#include "vgi/small_atlas.h"

namespace lodestone::vgi {
namespace {

namespace fs = std::filesystem;

class AtlasFileTest : public testing::Test {
protected:
    static void SetUpTestSuite() {
        TriMesh mesh = fixtures::repaired(Shape::rock, 3000);
        mesh.material_table.resize(3);
        mesh.materials.resize(mesh.wedge_count());
        for (size_t w = 0; w < mesh.materials.size(); ++w) mesh.materials[w] = static_cast<uint16_t>(w % 3);
        good_ = small_atlas(mesh, 64, 6);
    }
    void SetUp() override {
        path_ = fs::temp_directory_path() / ("lodestone-atlas-file-" + std::to_string(getpid()) + ".lode");
    }
    void TearDown() override { fs::remove(path_); }
    void write(const Atlas& atlas) const {
        auto writer = ChunkWriter::create(path_, {});
        ASSERT_TRUE(writer);
        ASSERT_TRUE(write_chunks(atlas, *writer));
        ASSERT_TRUE(writer->commit());
    }
    Result<AtlasFile> opened(const Limits& limits = {}) const {
        return AtlasFile::open(*ChunkFile::open(path_), limits);
    }
    void refused(const std::string& expect, const Limits& limits = {}) const {
        const auto file = opened(limits);
        ASSERT_FALSE(file) << expect;
        EXPECT_EQ(file.error().fault, Fault::format);
        EXPECT_THAT(file.error().message, testing::HasSubstr(expect));
        EXPECT_THAT(file.error().message, testing::HasSubstr(path_.string()));
    }
    // visit(name of the family's first page).
    template <class Visit>
    static void for_families(const AtlasFile& file, Visit&& visit) {
        for (const Layer layer : {Layer::geometry, Layer::attributes}) {
            for (uint32_t chart = 0; chart < file.about().charts(); ++chart) {
                const PageTree tree = tree_of(file.about(), layer, chart);
                for (uint32_t f = 0; f < tree.families(); ++f)
                    visit(AtlasFile::PageName{layer, chart, tree.member(f, 0)});
            }
        }
    }
    static Atlas good_;
    fs::path path_;
};
Atlas AtlasFileTest::good_;

TEST_F(AtlasFileTest, AFlippedBitOfAPageIsDamage) {
    write(good_);
    const auto file = opened();
    ASSERT_TRUE(file) << file.error().message;
    uint32_t at = 0;
    for_families(*file, [&](const AtlasFile::PageName& name) {
        auto bytes = *file->read(name);
        ASSERT_TRUE(file->unpack(name, bytes));
        at = at * 7 + 5;
        bytes[at % bytes.size()] ^= static_cast<std::byte>(1u << at % 8);
        const auto family = file->unpack(name, bytes);
        ASSERT_FALSE(family) << name.chart << ", " << name.page;
        EXPECT_EQ(family.error().fault, Fault::format);
        EXPECT_THAT(family.error().message, testing::HasSubstr("chart " + std::to_string(name.chart) + ", page " +
                                                               std::to_string(name.page) + ": is damaged"));
        // What is cut, or empty.
        EXPECT_FALSE(file->unpack(name, std::span(bytes).first(bytes.size() - 1)));
        EXPECT_FALSE(file->unpack(name, {}));
    });
}

TEST_F(AtlasFileTest, OnePageInThePlaceOfAnotherIsDamage) {
    write(good_);
    const auto file = opened();
    ASSERT_TRUE(file);
    std::vector<std::byte> before;
    for_families(*file, [&](const AtlasFile::PageName& name) {
        const auto bytes = *file->read(name);
        if (before != bytes) { EXPECT_FALSE(file->unpack(name, before)); }
        before = bytes;
    });
}

TEST_F(AtlasFileTest, APageWithAMaterialThatThereIsNotIsRefused) {
    Atlas bad = good_;
    ASSERT_FALSE(bad.materials.empty());
    bad.materials[bad.attribute_texel(1, 3, 5)] = 3;
    write(bad);
    const auto file = opened();
    ASSERT_TRUE(file) << file.error().message;
    uint32_t refused = 0;
    for (uint32_t chart = 0; chart < bad.charts(); ++chart) {
        const PageTree tree = tree_of(file->about(), Layer::attributes, chart);
        std::vector<Page> pages(tree.pages());
        for (uint32_t p = 0; p < tree.pages(); ++p) {
            const AtlasFile::PageName name{Layer::attributes, chart, p};
            const auto family = file->unpack(name, *file->read(name));
            ASSERT_TRUE(family);
            auto page = file->decode(name, *family, p == 0 ? nullptr : &pages[tree.parent(p)]);
            if (page) {
                pages[p] = std::move(*page);
                continue;
            }
            ++refused;
            EXPECT_EQ(chart, 1u);
            EXPECT_THAT(page.error().message, testing::HasSubstr("material"));
            pages[p] = family->page(p, p == 0 ? nullptr : &pages[tree.parent(p)]);
        }
    }
    EXPECT_GT(refused, 0u);
    EXPECT_THAT(open_atlas(*ChunkFile::open(path_)).error().message, testing::HasSubstr("material"));
}

TEST_F(AtlasFileTest, MoreThanCanBeNumberedIsRefusedByLimitAndNumber) {
    write(good_);
    const uint64_t charts = good_.charts(), pages = charts * tree_of(good_, Layer::geometry).pages();
    Limits limits;
    limits.charts = charts;
    limits.pages = pages;
    limits.samples = good_.texels();
    EXPECT_TRUE(opened(limits));
    const auto past = [&](const char* what, uint64_t Limits::*limit) {
        Limits smaller = limits;
        const uint64_t is = smaller.*limit;
        smaller.*limit -= 1;
        refused("has " + std::to_string(is) + " " + what + "; the limit is " + std::to_string(is - 1), smaller);
    };
    past("charts", &Limits::charts);
    past("pages", &Limits::pages);
    past("samples", &Limits::samples);
}

TEST_F(AtlasFileTest, ContentThatIsNoNumberOrGluedWronglyIsRefused) {
    const auto spoilt = [&](const std::string& expect, auto&& spoil) {
        Atlas bad = good_;
        spoil(bad);
        write(bad);
        refused(expect);
    };
    const float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
    spoilt("vgi/errors", [&](Atlas& a) { a.errors[2] = nan; });
    spoilt("vgi/errors", [&](Atlas& a) { a.errors.back() = infinite; });
    spoilt("vgi/errors", [&](Atlas& a) { std::swap(a.errors.front(), a.errors.back()); });
    spoilt("vgi/bounds", [&](Atlas& a) { a.bounds[3].centre.y = nan; });
    spoilt("vgi/bounds", [&](Atlas& a) { a.bounds[3].radius = -1; });
    spoilt("vgi/bounds", [&](Atlas& a) { a.bounds[3].error = infinite; });
    spoilt("glued to itself", [&](Atlas& a) {
        const GluedSide other = a.sides[1];
        a.sides[1] = {0, 1};
        if (other.chart != ~0u) a.sides[other.chart * 4 + other.side] = {};
    });
    spoilt("glued to nothing", [&](Atlas& a) { a.sides[1] = {a.charts(), 0}; });
    spoilt("glued to nothing", [&](Atlas& a) { a.sides[1] = {0, 4}; });
    spoilt("vgi/atlas", [&](Atlas& a) { a.step = 0; });
}

TEST_F(AtlasFileTest, FamiliesThatDoNotLieBehindOneAnotherAreRefused) {
    write(good_);
    const auto with_ends = [&](const std::string& expect, auto&& spoil) {
        write(good_);
        auto bytes = fixtures::chunk_of(path_, "vgi/geometry_ends");
        std::vector<uint64_t> ends(bytes.size() / 8);
        std::memcpy(ends.data(), bytes.data(), bytes.size());
        spoil(ends);
        fixtures::replace_chunk(path_, "vgi/geometry_ends", std::as_bytes(std::span(ends)), path_);
        refused(expect);
    };
    with_ends("no end", [](auto& ends) { ends[4] = 0; });
    with_ends("no end", [](auto& ends) { ends.back() += 1; });
    with_ends("no end", [](auto& ends) { ends[4] = ~uint64_t{0}; });
    with_ends("not there", [](auto& ends) { ends[4] = ends[3]; });
    with_ends("one per family", [](auto& ends) { ends.pop_back(); });
    write(good_);
    const std::vector<uint32_t> sums(3);
    fixtures::replace_chunk(path_, "vgi/attribute_sums", std::as_bytes(std::span(sums)), path_);
    refused("vgi/attribute_ends");
}

TEST_F(AtlasFileTest, SizesThatChartsCannotHaveAreRefused) {
    const auto with = [&](const std::string& chunk, uint8_t value, const std::string& expect) {
        write(good_);
        std::vector<uint8_t> values(good_.charts(), value);
        fixtures::replace_chunk(path_, chunk, std::as_bytes(std::span(values)), path_);
        refused(expect);
        values.assign(good_.charts(), 0);
        values.pop_back();
        write(good_);
        fixtures::replace_chunk(path_, chunk, std::as_bytes(std::span(values)), path_);
        refused("one per chart");
    };
    with("vgi/attributes_left_out", 200, "no pages");
    with("vgi/left_out", 200, "no pages");
    with("vgi/dense", 2, "neither 0 nor 1");
    // One chart that is dense beside others that are not.
    write(good_);
    std::vector<uint8_t> dense(good_.charts(), 0);
    dense[0] = 1;
    fixtures::replace_chunk(path_, "vgi/dense", std::as_bytes(std::span(dense)), path_);
    refused("is dense where it is not");
}

TEST_F(AtlasFileTest, APageOfAFileThatWasCutMeanwhileCannotBeRead) {
    write(good_);
    const auto file = opened();
    ASSERT_TRUE(file);
    fs::resize_file(path_, 1000);
    const auto bytes = file->read({Layer::geometry, 0, 0});
    ASSERT_FALSE(bytes);
    EXPECT_THAT(bytes.error().message, testing::HasSubstr("cannot be read"));
    EXPECT_FALSE(open_atlas(file->file()));
}

// A corner where very many charts meet: each chart is looked at a bounded number of times.
TEST_F(AtlasFileTest, CornersOfAnyValenceAreCheckedInLinearTime) {
    Atlas atlas;
    const uint32_t charts = 200000;
    atlas.lay_out(std::vector<uint8_t>(charts, 0), std::vector<uint8_t>(charts, 0));
    atlas.sides.resize(size_t{charts} * 4);
    // A fan: side 3 of each, which ends at its first corner, to side 0 of the next.
    for (uint32_t c = 0; c < charts; ++c) {
        atlas.sides[c * 4 + 3] = {(c + 1) % charts, 0};
        atlas.sides[(c + 1) % charts * 4] = {c, 3};
    }
    EXPECT_TRUE(atlas.validate_gluing());
}

}  // namespace
}  // namespace lodestone::vgi
