#include "base/files/chunk_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <thread>

namespace lodestone {
namespace {

namespace fs = std::filesystem;

class ChunkFileTest : public testing::Test {
protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / fs::path("lodestone-chunk-file-test-" + std::to_string(getpid()));
        fs::create_directories(folder_);
        path_ = folder_ / "asset.lode";
        std::iota(values_.begin(), values_.end(), 0u);
        auto writer = ChunkWriter::create(path_, {{1, 2}, {3, 4}});
        ASSERT_TRUE(writer);
        ASSERT_TRUE(writer->add_array<uint32_t>("numbers", values_));
        ASSERT_TRUE(writer->add_text("words", "stone"));
        ASSERT_TRUE(writer->add("nothing", {}));
        ASSERT_TRUE(writer->commit());
    }
    void TearDown() override { fs::remove_all(folder_); }
    std::string content() const {
        std::ifstream in(path_, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    void replace(const std::string& bytes) const { std::ofstream(path_, std::ios::binary) << bytes; }

    fs::path folder_, path_;
    std::vector<uint32_t> values_ = std::vector<uint32_t>(1000);
};

TEST_F(ChunkFileTest, GivesBackWhatWasWritten) {
    const auto file = ChunkFile::open(path_);
    ASSERT_TRUE(file) << file.error().message;
    EXPECT_EQ(file->provenance().source, (Hash128{1, 2}));
    EXPECT_EQ(file->provenance().options, (Hash128{3, 4}));
    const auto numbers = file->array<uint32_t>("numbers");
    ASSERT_TRUE(numbers);
    EXPECT_THAT(*numbers, testing::ElementsAreArray(values_));
    EXPECT_EQ(reinterpret_cast<uintptr_t>(numbers->data()) % chunk_alignment, 0u);
    EXPECT_EQ(*file->text("words"), "stone");
    EXPECT_TRUE(file->bytes("nothing")->empty());
    EXPECT_TRUE(file->verify());
    EXPECT_EQ(file->bytes("absent").error().fault, Fault::format);
}

TEST_F(ChunkFileTest, AnyFlippedBitIsFoundByOneLineThatNamesThePlace) {
    const std::string good = content();
    for (size_t at = 0; at < good.size(); at += 7) {
        std::string bad = good;
        bad[at] = static_cast<char>(bad[at] ^ (1 << (at % 8)));
        replace(bad);
        const auto file = ChunkFile::open(path_);
        Result<void> verdict = file ? file->verify() : Result<void>(tl::unexpected(file.error()));
        ASSERT_FALSE(verdict) << "byte " << at;
        EXPECT_EQ(verdict.error().fault, Fault::format);
        EXPECT_THAT(verdict.error().message, testing::HasSubstr(path_.string()));
        EXPECT_THAT(verdict.error().message, testing::Not(testing::HasSubstr("\n")));
    }
}

TEST_F(ChunkFileTest, AnyTruncationIsFound) {
    const std::string good = content();
    for (size_t length = 0; length < good.size(); length += 13) {
        replace(good.substr(0, length));
        const auto file = ChunkFile::open(path_);
        ASSERT_FALSE(file) << length;
        EXPECT_EQ(file.error().fault, Fault::format);
    }
}

TEST_F(ChunkFileTest, APrefixHasTheChunksThatAreThere) {
    const std::string good = content();
    const auto whole = ChunkFile::open(path_, Extent::prefix);
    ASSERT_TRUE(whole);
    EXPECT_FALSE(whole->is_prefix());
    EXPECT_TRUE(whole->contains("words"));
    const ChunkInfo numbers = whole->chunks()[0], words = whole->chunks()[1];
    replace(good.substr(0, words.offset + 2));
    auto file = ChunkFile::open(path_, Extent::prefix);
    ASSERT_TRUE(file) << file.error().message;
    EXPECT_TRUE(file->is_prefix());
    EXPECT_EQ(file->whole_bytes(), good.size());
    EXPECT_THAT(*file->array<uint32_t>("numbers"), testing::ElementsAreArray(values_));
    EXPECT_FALSE(file->contains("words"));
    EXPECT_EQ(file->bytes_there("words"), 2u);
    EXPECT_THAT(file->bytes("words").error().message, testing::HasSubstr("cut short"));
    EXPECT_EQ(file->bytes_there("nothing"), 0u);
    replace(good.substr(0, numbers.offset - 1));
    file = ChunkFile::open(path_, Extent::prefix);
    ASSERT_TRUE(file);
    EXPECT_TRUE(file->chunks().empty());
    replace(good.substr(0, 50));
    EXPECT_FALSE(ChunkFile::open(path_, Extent::prefix));
    replace(good + "x");
    EXPECT_FALSE(ChunkFile::open(path_, Extent::prefix));
}

TEST_F(ChunkFileTest, OtherVersionsAreRefusedByName) {
    std::string bytes = content();
    const auto refused = [&](uint32_t version) {
        bytes[12] = static_cast<char>(version);
        replace(bytes);
        const auto opened = ChunkFile::open(path_);
        EXPECT_FALSE(opened);
        return opened ? "" : opened.error().message;
    };
    EXPECT_THAT(refused(chunk_file_version + 1), testing::HasSubstr("newer"));
    EXPECT_THAT(refused(chunk_file_version - 1), testing::HasSubstr("no longer read"));
}

// A mapping would end the program here.
TEST_F(ChunkFileTest, AFileThatIsCutShortWhileItIsOpenIsAnError) {
    const auto file = ChunkFile::open(path_);
    ASSERT_TRUE(file);
    ASSERT_TRUE(file->text("words"));
    fs::resize_file(path_, 256);
    const auto numbers = file->bytes("numbers");
    ASSERT_FALSE(numbers);
    EXPECT_EQ(numbers.error().fault, Fault::format);
    EXPECT_THAT(numbers.error().message, testing::HasSubstr("cut short"));
    EXPECT_FALSE(file->verify());
    std::array<std::byte, 64> part{};
    EXPECT_TRUE(file->read_part("numbers", 0, part));
    EXPECT_FALSE(file->read_part("numbers", 1000, part));
    EXPECT_EQ(*file->text("words"), "stone");  // what was read stays
}

TEST_F(ChunkFileTest, WhatWasReadStaysWhateverIsWrittenIntoTheFile) {
    const auto file = ChunkFile::open(path_);
    ASSERT_TRUE(file->bytes("numbers"));
    std::fstream(path_, std::ios::in | std::ios::out | std::ios::binary).write(std::string(2000, 'x').data(), 2000);
    EXPECT_THAT(*file->array<uint32_t>("numbers"), testing::ElementsAreArray(values_));
    EXPECT_FALSE(file->verify());
}

TEST_F(ChunkFileTest, PartsOfAChunkAreReadAlone) {
    const auto file = ChunkFile::open(path_);
    std::array<uint32_t, 3> part{};
    ASSERT_TRUE(file->read_part("numbers", 40, std::as_writable_bytes(std::span(part))));
    EXPECT_THAT(part, testing::ElementsAre(10, 11, 12));
    EXPECT_FALSE(file->read_part("numbers", 3992, std::as_writable_bytes(std::span(part))));
    EXPECT_FALSE(file->read_part("numbers", ~uint64_t{0}, std::as_writable_bytes(std::span(part))));
    EXPECT_FALSE(file->read_part("absent", 0, std::as_writable_bytes(std::span(part))));
}

// Whatever tells of an asset shows its chunks' names.
TEST_F(ChunkFileTest, NamesThatATerminalTakesForCommandsAreRefused) {
    for (const std::string name : {"\x1b[2J", "two\nlines", "two words", "\xff", "\x7f"}) {
        auto writer = ChunkWriter::create(path_, {});
        ASSERT_TRUE(writer);
        ASSERT_TRUE(writer->add_text("words", "stone"));
        ASSERT_TRUE(writer->add_text(name, "lost"));
        ASSERT_TRUE(writer->commit());
        const auto file = ChunkFile::open(path_);
        ASSERT_FALSE(file);
        EXPECT_EQ(file.error().fault, Fault::format);
        EXPECT_THAT(file.error().message, testing::HasSubstr("asset.lode: entry of chunk 1: "));
        EXPECT_THAT(file.error().message, testing::Not(testing::HasSubstr(name)));
    }
}

// Under a thread sanitizer this is a race where reading a chunk marks it without a lock.
TEST_F(ChunkFileTest, ThreadsReadTheSameChunkOfCopies) {
    const auto file = ChunkFile::open(path_);
    std::vector<const std::byte*> seen(8);
    {
        std::vector<std::jthread> threads;
        for (size_t i = 0; i < seen.size(); ++i)
            threads.emplace_back([copy = *file, &seen, i] { seen[i] = copy.bytes("numbers")->data(); });
    }
    EXPECT_THAT(seen, testing::Each(seen[0]));
}

TEST_F(ChunkFileTest, AnAbandonedWriterLeavesNothing) {
    const std::string before = content();
    {
        auto writer = ChunkWriter::create(path_, {});
        ASSERT_TRUE(writer->add_text("words", "lost"));
    }
    EXPECT_EQ(content(), before);
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
}

}  // namespace
}  // namespace lodestone
