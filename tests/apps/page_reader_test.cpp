#include "apps/scene/page_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <numeric>

namespace lodestone {
namespace {

class PageReaderTest : public testing::Test {
protected:
    void SetUp() override {
        path_ = std::filesystem::temp_directory_path() / ("lodestone_reader_" + std::to_string(getpid()) + ".lode");
        std::vector<uint8_t> bytes(10000);
        std::iota(bytes.begin(), bytes.end(), uint8_t{0});
        auto writer = ChunkWriter::create(path_, {});
        ASSERT_TRUE(writer->add_array("pages", std::span<const uint8_t>(bytes)));
        ASSERT_TRUE(writer->commit());
    }
    void TearDown() override { std::filesystem::remove(path_); }
    static std::vector<uint64_t> ids(const std::vector<Arrival>& arrivals) {
        std::vector<uint64_t> all;
        for (const Arrival& arrival : arrivals) all.push_back(arrival.request);
        return all;
    }
    std::filesystem::path path_;
};

TEST_F(PageReaderTest, ReadsWhatIsWantedMostFirst) {
    PageReader reader({*ChunkFile::open(path_)});
    std::vector<PageRequest> requests;
    for (uint64_t id = 0; id < 200; ++id)
        requests.push_back({id, 0, "pages", id * 10, 10, static_cast<float>(id * 37 % 50)});
    reader.request(requests);
    reader.wait();
    const auto arrivals = reader.arrivals();
    ASSERT_EQ(arrivals.size(), requests.size());
    for (size_t i = 0; i < arrivals.size(); ++i) {
        const PageRequest& r = requests[arrivals[i].request];
        ASSERT_EQ(arrivals[i].blob.size(), 10u);
        EXPECT_EQ(std::to_integer<uint64_t>(arrivals[i].blob.data()[3]), (r.offset + 3) % 256);
        if (i == 0) continue;
        const PageRequest& before = requests[arrivals[i - 1].request];
        EXPECT_TRUE(before.priority > r.priority || (before.priority == r.priority && before.id < r.id));
    }
    EXPECT_TRUE(reader.arrivals().empty());
}

// From a mapping that would end the program.
TEST_F(PageReaderTest, WhatCannotBeReadArrivesEmpty) {
    PageReader reader({*ChunkFile::open(path_)});
    std::filesystem::resize_file(path_, 4096);
    reader.request({{0, 0, "pages", 100, 50, 5},
                    {1, 0, "pages", 9000, 50, 4},
                    {2, 0, "pages", 9990, 50, 3},
                    {3, 0, "nosuch", 0, 50, 2},
                    {4, 0, "pages", ~uint64_t{0} - 10, 50, 1}});
    reader.wait();
    const auto arrivals = reader.arrivals();
    EXPECT_THAT(ids(arrivals), testing::ElementsAre(0, 1, 2, 3, 4));
    EXPECT_EQ(arrivals[0].blob.size(), 50u);
    for (size_t i = 1; i < arrivals.size(); ++i) EXPECT_EQ(arrivals[i].blob.size(), 0u) << i;
}

}  // namespace
}  // namespace lodestone
