#include "vgi/draw/pages/page_decoder.h"

#include <gtest/gtest.h>

#include <unistd.h>

#include <array>
#include <filesystem>
#include <set>

#include "base/random.h"
#include "fixtures/meshes.h"
#include "mesh/generate.h"
#include "mesh/repair.h"
#include "vgi/draw/memory_shares.h"
#include "vgi/small_atlas.h"

namespace lodestone::vgi {
namespace {

class PageDecoderTest : public testing::Test {
protected:
    void SetUp() override {
        TriMesh mesh = generate(Shape::rock, 5000, 3);
        ASSERT_TRUE(repair(mesh));
        auto writer = ChunkWriter::create(path_, {});
        ASSERT_TRUE(writer);
        ASSERT_TRUE(write_chunks(small_atlas(mesh, 128), *writer));
        ASSERT_TRUE(writer->commit());
        auto opened = AtlasFile::open(*ChunkFile::open(path_));
        ASSERT_TRUE(opened) << opened.error().message;
        Totals totals;
        atlases_ = open_atlases({std::make_shared<const AtlasFile>(std::move(*opened))}, {}, totals);
        words_ = totals.words;
    }
    void TearDown() override { std::filesystem::remove(path_); }

    const OpenAtlas& atlas() const { return atlases_[0]; }
    uint32_t pages_of(Layer layer) const { return atlas().trees[index_of(layer)].pages(); }
    DecodeTask task(Layer layer, uint32_t number) {
        const uint32_t per_chart = pages_of(layer), chart = number / per_chart, page = number % per_chart;
        DecodeTask made{{layer, 0, number}, {layer, chart, page}, &atlas(), {}, nullptr, nullptr};
        auto bytes = atlas().file->read(made.name);
        EXPECT_TRUE(bytes);
        made.blob = Blob(std::move(*bytes));
        if (page == 0) return made;
        const uint32_t parent = number - page + atlas().trees[index_of(layer)].parent(page);
        if (layer == Layer::geometry) made.parent_geometry = known(layer, parent).geometry;
        if (layer == Layer::attributes) made.parent_attributes = known(layer, parent).attributes;
        return made;
    }
    // Decoded alone.
    const DecodedPage& known(Layer layer, uint32_t number) {
        auto& page = known_[{layer, 0, number}];
        if (page.bytes() == 0) page = PageDecoder(words_).decode(task(layer, number));
        return page;
    }
    void expect_known(const DecodedPage& page) {
        const DecodedPage& alone = known(page.id.layer, page.id.number);
        ASSERT_GT(page.bytes(), 0u) << page.fault;
        if (page.id.layer == Layer::geometry) {
            EXPECT_EQ(*page.geometry, *alone.geometry);
        } else {
            EXPECT_EQ(*page.attributes, *alone.attributes);
        }
    }

    const std::filesystem::path path_ =
        std::filesystem::temp_directory_path() / ("lodestone-decoder-" + std::to_string(getpid()) + ".lode");
    std::vector<OpenAtlas> atlases_;
    PoolWords words_;
    std::map<PageId, DecodedPage> known_;
};

TEST_F(PageDecoderTest, DecodesSiblingsTogetherAndLaterAsAlone) {
    PageDecoder decoder(words_);
    EXPECT_TRUE(decoder.take().empty());
    Random random(5);
    std::vector<PageId> waiting;
    for (const Layer layer : both_layers) {
        for (uint32_t number = 0; number < atlas().pages(layer); ++number) waiting.push_back({layer, 0, number});
    }
    for (size_t i = waiting.size(); i > 1; --i)
        std::swap(waiting[i - 1], waiting[random.below(static_cast<uint32_t>(i))]);
    size_t batches = 0;
    for (; !waiting.empty(); ++batches) {
        std::vector<DecodeTask> tasks;
        for (size_t left = 1 + random.below(100); left > 0 && !waiting.empty(); --left) {
            tasks.push_back(task(waiting.back().layer, waiting.back().number));
            waiting.pop_back();
        }
        std::vector<PageId> ids;
        for (const DecodeTask& t : tasks) ids.push_back(t.id);
        decoder.start(std::move(tasks));
        const std::vector<DecodedPage> decoded = decoder.take();
        ASSERT_EQ(decoded.size(), ids.size());
        for (size_t k = 0; k < ids.size(); ++k) {
            EXPECT_EQ(decoded[k].id, ids[k]);
            expect_known(decoded[k]);
        }
    }
    EXPECT_GT(batches, 5u);
}

// A family that is known needs no bytes; one whose bytes are damaged is looked for in those of its other pages.
TEST_F(PageDecoderTest, UnpacksAFamilyOnceAndFailsOnlyWithoutAnyGoodBytes) {
    PageDecoder decoder(words_);
    const Blob damaged(std::vector<std::byte>(100, std::byte{7}));
    const auto with = [&](uint32_t number, bool good) {
        DecodeTask made = task(Layer::geometry, number);
        if (!good) made.blob = damaged;
        return made;
    };
    const auto decoded = [&](std::vector<DecodeTask> tasks) {
        decoder.start(std::move(tasks));
        return decoder.take();
    };
    // Pages 1 to 4 are the children of page 0.
    std::vector<DecodedPage> pages = decoded({with(1, false), with(2, false)});
    for (const DecodedPage& page : pages) {
        EXPECT_EQ(page.bytes(), 0u);
        EXPECT_FALSE(page.fault.empty());
    }
    pages = decoded({with(1, false), with(2, true), with(3, false)});
    EXPECT_EQ(pages[0].bytes(), 0u);
    expect_known(pages[1]);
    expect_known(pages[2]);
    pages = decoded({with(4, false), with(1, false), with(5, false)});
    expect_known(pages[0]);
    expect_known(pages[1]);
    EXPECT_EQ(pages[2].bytes(), 0u) << "of another family";
}

}  // namespace
}  // namespace lodestone::vgi
