#include "base/files/checkpoint_folder.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

namespace lodestone {
namespace {

namespace fs = std::filesystem;

class WorkFolderTest : public testing::Test {
protected:
    void SetUp() override {
        parent_ = fs::temp_directory_path() / ("lodestone_work_" + std::to_string(getpid()));
        fs::create_directories(parent_);
    }
    void TearDown() override { fs::remove_all(parent_); }

    // The number that the stage has kept, or `made`, kept now.
    static uint32_t number(const CheckpointFolder* work, uint32_t made) {
        const auto value = load_or_make<uint32_t>(
            work, "stage",
            [](const ChunkFile& file) -> std::optional<uint32_t> {
                const auto numbers = file.array<uint32_t>("number");
                return numbers && numbers->size() == 1 ? std::optional((*numbers)[0]) : std::nullopt;
            },
            [&]() -> Result<uint32_t> { return made; },
            [](const uint32_t& kept, ChunkWriter& writer) { return writer.add_array("number", std::span(&kept, 1)); });
        EXPECT_TRUE(value);
        return *value;
    }
    CheckpointFolder open(const std::string& key) const {
        return *CheckpointFolder::open(parent_, hash_of(std::span(key)));
    }
    fs::path parent_;
};

TEST_F(WorkFolderTest, KeepsAStageForTheSameComputationAlone) {
    {
        const CheckpointFolder work = open("one");
        EXPECT_FALSE(work.begun());
        EXPECT_EQ(number(&work, 7), 7u);
        EXPECT_TRUE(work.begun());
        EXPECT_EQ(number(&work, 8), 7u);
    }
    const CheckpointFolder again = open("one"), other = open("two");
    EXPECT_EQ(number(&again, 9), 7u);
    EXPECT_EQ(number(&other, 9), 9u);
    EXPECT_EQ(number(nullptr, 10), 10u);
    again.remove();
    EXPECT_FALSE(fs::exists(again.path()));
}

// Whoever was killed while it removed its folder left it under another name.
TEST_F(WorkFolderTest, TakesAwayWhatAKilledOneWasRemoving) {
    const fs::path one = open("one").path(), two = open("two").path();
    for (const fs::path& folder : {one, two}) fs::rename(folder, folder.string() + "-gone17");
    const CheckpointFolder again = open("one");
    EXPECT_FALSE(fs::exists(one.string() + "-gone17"));
    EXPECT_TRUE(fs::exists(two.string() + "-gone17")) << "that of another computation";
    again.remove();
    EXPECT_FALSE(fs::exists(one));
}

TEST_F(WorkFolderTest, IsOpenForOneAtATime) {
    const std::string key = "one";
    auto first = std::make_optional(open(key));
    const CheckpointFolder copy = *first;
    first.reset();
    const auto second = CheckpointFolder::open(parent_, hash_of(std::span(key)));
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().fault, Fault::machine);
    EXPECT_NE(second.error().message.find("in use"), std::string::npos) << second.error().message;
    // Who comes when it is removed has a new one, and nobody takes that away.
    copy.remove();
    const CheckpointFolder anew = open(key);
    EXPECT_FALSE(anew.begun());
    EXPECT_EQ(number(&anew, 5), 5u);
    copy.remove();
}

TEST_F(WorkFolderTest, MakesAStageAnewWhoseFileIsDamagedOrAnother) {
    const CheckpointFolder work = open("one");
    EXPECT_EQ(number(&work, 7), 7u);
    const fs::path file = work.path() / "stage.stage";
    for (const auto place : {70, -3}) {  // in the header's reach, and in the last bytes
        std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
        bytes.seekp(place, place < 0 ? std::ios::end : std::ios::beg);
        bytes.put('\x5a');
        bytes.close();
        const uint32_t made = 20 + static_cast<uint32_t>(place > 0);
        EXPECT_EQ(number(&work, made), made) << place;
        EXPECT_EQ(number(&work, 1), made);
    }
    // The same stage of another computation, put there by somebody.
    const CheckpointFolder other = open("two");
    EXPECT_EQ(number(&other, 9), 9u);
    fs::copy_file(other.path() / "stage.stage", file, fs::copy_options::overwrite_existing);
    EXPECT_EQ(number(&work, 11), 11u);
}

TEST_F(WorkFolderTest, SaysWhereItCannotBeMade) {
    std::ofstream(parent_ / "file") << "in the way";
    const std::string key = "one";
    const auto failed = CheckpointFolder::open(parent_ / "file", hash_of(std::span(key)));
    ASSERT_FALSE(failed);
    EXPECT_EQ(failed.error().fault, Fault::machine);
    EXPECT_NE(failed.error().message.find("--tmp"), std::string::npos);
}

}  // namespace
}  // namespace lodestone
