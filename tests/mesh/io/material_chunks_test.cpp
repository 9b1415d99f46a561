#include "mesh/io/material_chunks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "fixtures/crafted.h"
#include "fixtures/materials.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

class MaterialChunksTest : public testing::Test {
protected:
    void SetUp() override {
        path_ = fs::temp_directory_path() / ("lodestone_chunks_" + std::to_string(::getpid()) + ".lode");
        auto writer = ChunkWriter::create(path_, {});
        ASSERT_TRUE(writer);
        ASSERT_TRUE(write_materials(*writer, fixtures::every_material(), fixtures::role_images()));
        ASSERT_TRUE(writer->commit());
        const auto bytes = fixtures::chunk_of(path_, "mesh/materials");
        text_ = json::parse(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
    }
    void TearDown() override { fs::remove(path_); }

    // What is said of the asset with another chunk.
    std::string said_of(const json& changed) {
        const std::string text = changed.dump();
        const fs::path bad = path_.string() + ".bad";
        fixtures::replace_chunk(path_, "mesh/materials", std::as_bytes(std::span(text)), bad);
        const auto file = ChunkFile::open(bad);
        EXPECT_TRUE(file);
        const auto read = read_materials(*file);
        fs::remove(bad);
        if (read) return "nothing";
        EXPECT_EQ(read.error().fault, Fault::format);
        EXPECT_THAT(read.error().message, HasSubstr("bake the asset again"));
        return read.error().message;
    }
    fs::path path_;
    json text_;
};

TEST_F(MaterialChunksTest, KeepEveryMember) {
    const auto file = ChunkFile::open(path_);
    ASSERT_TRUE(file);
    const auto read = read_materials(*file);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->table, fixtures::every_material());
    EXPECT_EQ(read->images.size(), fixtures::role_images().size());
}

TEST_F(MaterialChunksTest, WhatCannotBeIsRefused) {
    EXPECT_EQ(said_of(text_), "nothing");
    const auto with = [&](const std::string& member, const json& value) {
        json changed = text_;
        changed["materials"][1][json::json_pointer(member)] = value;
        return said_of(changed);
    };
    EXPECT_THAT(with("/textures/2/image", 99), HasSubstr("material 'all' has no such image"));
    EXPECT_THAT(with("/textures/2/image", -1), HasSubstr("no such image"));
    EXPECT_THAT(with("/textures/2/wrap/0", "round"), HasSubstr("unknown word 'round'"));
    EXPECT_THAT(with("/textures/2/place/5", 1e300), HasSubstr("not finite"));
    EXPECT_THAT(with("/textures/2/second", 7), HasSubstr("mesh/materials"));
    EXPECT_THAT(with("/textures/0/second", true), HasSubstr("base colour on the second set"));
    EXPECT_THAT(with("/shading", "wet"), HasSubstr("unknown word 'wet'"));
    EXPECT_THAT(with("/alpha", 3), HasSubstr("mesh/materials"));
    for (const char* number : {"/alpha_cutoff", "/metallic", "/roughness", "/normal_scale", "/occlusion_strength",
                               "/emission/2", "/base_colour/0"}) {
        EXPECT_THAT(with(number, -1e300), HasSubstr("not finite")) << number;
        EXPECT_THAT(with(number, "one"), HasSubstr("mesh/materials")) << number;
    }
    for (const auto& member : text_["materials"][1].items()) {
        json changed = text_;
        changed["materials"][1].erase(member.key());
        EXPECT_THAT(said_of(changed), HasSubstr(member.key())) << "as in assets that had less";
    }
}

}  // namespace
}  // namespace lodestone
