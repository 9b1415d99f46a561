#include "base/files/file.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <chrono>
#include <fstream>
#include <numeric>

namespace lodestone {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class FileTest : public testing::Test {
protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / ("lodestone_file_" + std::to_string(::getpid()));
        fs::create_directories(folder_ / "inner");
    }
    void TearDown() override { fs::remove_all(folder_); }
    fs::path put(const std::string& name, const std::string& content) {
        std::ofstream(folder_ / name, std::ios::binary) << content;
        return folder_ / name;
    }
    static size_t sum(std::span<const std::byte> bytes) {
        return std::accumulate(bytes.begin(), bytes.end(), size_t{0},
                               [](size_t s, std::byte b) { return s + std::to_integer<size_t>(b); });
    }
    fs::path folder_;
};

TEST_F(FileTest, AFileCutWhileItIsMappedReadsAsZerosAndSaysSo) {
    const size_t size = 5 << 20;
    const fs::path path = put("large", std::string(size, '\1'));
    auto file = MappedFile::open(path);
    ASSERT_TRUE(file) << file.error().message;
    EXPECT_EQ(sum((*file)->bytes().first(100)), 100u);
    EXPECT_TRUE((*file)->intact());
    fs::resize_file(path, 1 << 20);
    EXPECT_EQ((*file)->bytes().size(), size);
    EXPECT_EQ(sum((*file)->bytes()), size_t{1} << 20) << "what is gone is zeros";
    const auto whole = (*file)->intact();
    ASSERT_FALSE(whole);
    EXPECT_EQ(whole.error().fault, Fault::format);
    EXPECT_THAT(whole.error().message, HasSubstr(path.string() + ": was cut short"));
    // Other files are not touched by it.
    auto other = MappedFile::open(put("other", "abc"));
    ASSERT_TRUE(other);
    EXPECT_EQ(sum((*other)->bytes()), size_t{'a' + 'b' + 'c'});
    EXPECT_TRUE((*other)->intact());
}

TEST_F(FileTest, AFileWrittenToWhileItIsMappedIsNotIntact) {
    const fs::path path = put("a", "before");
    auto file = MappedFile::open(path);
    ASSERT_TRUE(file);
    ::timespec times[2] = {{1, 0}, {1, 0}};
    ASSERT_EQ(utimensat(AT_FDCWD, path.c_str(), times, 0), 0);
    const auto whole = (*file)->intact();
    ASSERT_FALSE(whole);
    EXPECT_THAT(whole.error().message, HasSubstr("was changed while it was read"));
    // Another file in its place does not matter: this one is still what it was.
    auto again = MappedFile::open(path);
    ASSERT_TRUE(again);
    fs::rename(put("b", "after"), path);
    EXPECT_TRUE((*again)->intact());
}

TEST_F(FileTest, OnlyRegularFilesAreOpened) {
    const fs::path pipe = folder_ / "pipe";
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    for (const fs::path& path : {folder_, pipe, fs::path("/dev/zero")}) {
        const auto file = MappedFile::open(path);
        ASSERT_FALSE(file) << path;
        EXPECT_THAT(file.error().message, HasSubstr("is not a regular file"));
    }
}

TEST_F(FileTest, AGzipStreamUnpacksToNoMoreThanIsAllowed) {
    const fs::path path = folder_ / "a.gz";
    const gzFile zip = gzopen(path.c_str(), "wb");
    const std::string content(1 << 20, 'x');
    gzwrite(zip, content.data(), static_cast<unsigned>(content.size()));
    gzclose(zip);
    const auto all = read_file(path);
    ASSERT_TRUE(all);
    EXPECT_EQ(all->bytes.size(), content.size());
    const auto less = read_file(path, 1000);
    ASSERT_FALSE(less);
    EXPECT_THAT(less.error().message, HasSubstr("limit of 1000 bytes"));
}

TEST_F(FileTest, NamesInFilesStayInTheirFolder) {
    put("outside.txt", "o");
    put("inner/a.txt", "a");
    fs::create_directories(folder_ / "inner/deeper");
    fs::create_symlink(folder_ / "outside.txt", folder_ / "inner/link.txt");
    fs::create_directory_symlink("..", folder_ / "inner/up");
    fs::create_symlink("a.txt", folder_ / "inner/near.txt");
    const fs::path file = folder_ / "inner/mesh.obj";
    for (const std::string name :
         {"a.txt", "./a.txt", "deeper/../a.txt", "not there.txt", "deeper/none.txt", "near.txt", "..a.txt"}) {
        const auto path = path_named_by(file, name);
        ASSERT_TRUE(path) << path.error().message;
        EXPECT_EQ(*path, folder_ / "inner" / name);
    }
    for (const std::string& name :
         {std::string("/etc/passwd"), std::string("../outside.txt"), std::string("deeper/../../outside.txt"),
          std::string("link.txt"), std::string("up/outside.txt"), std::string(".."), std::string("a.txt\0b", 7),
          (folder_ / "inner/a.txt").string()}) {
        const auto path = path_named_by(file, name);
        ASSERT_FALSE(path) << name;
        EXPECT_EQ(path.error().fault, Fault::format);
        EXPECT_THAT(path.error().message, HasSubstr("--allow-outside"));
        EXPECT_TRUE(path_named_by(file, name, true)) << name;
    }
    // The folder itself may be reached by a link.
    fs::create_directory_symlink("inner", folder_ / "same");
    EXPECT_TRUE(path_named_by(folder_ / "same/mesh.obj", "a.txt"));
}

TEST_F(FileTest, WhatTheMachineCannotOpenIsNotTheFilesFault) {
    const fs::path path = put("a", "bytes");
    // Sanitizers look at types that they meet for the first time through a pipe.
    ASSERT_TRUE(MappedFile::open(path));
    ASSERT_FALSE(MappedFile::open(folder_ / "nothing"));
    ASSERT_TRUE(InputFile::open(path));
    ASSERT_FALSE(InputFile::open(folder_ / "nothing"));
    rlimit before{};
    ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
    rlimit none = before;
    none.rlim_cur = 0;
    ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
    const auto mapped = MappedFile::open(path);
    const auto input = InputFile::open(path);
    ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
    ASSERT_FALSE(mapped);
    EXPECT_EQ(mapped.error().fault, Fault::machine) << mapped.error().message;
    ASSERT_FALSE(input);
    EXPECT_EQ(input.error().fault, Fault::machine);
    for (const fs::path& wrong : {folder_ / "nothing", folder_, path / "below"}) {
        const auto opened = MappedFile::open(wrong);
        ASSERT_FALSE(opened);
        EXPECT_EQ(opened.error().fault, Fault::format) << opened.error().message;
    }
}

TEST_F(FileTest, WhatAKilledProgramHasLeftIsTold) {
    const auto old = [&](const std::string& name) {
        const fs::path path = put(name, "half");
        fs::last_write_time(path, fs::file_time_type::clock::now() - std::chrono::minutes(1));
        return path;
    };
    EXPECT_TRUE(abandoned_part(old("a.lode.part-x1Y2z3")));
    EXPECT_TRUE(abandoned_part(old("a.lode.part123-0")));
    EXPECT_FALSE(abandoned_part(put("new.lode.part-x1Y2z3", "half"))) << "somebody may be about to lock it";
    EXPECT_FALSE(abandoned_part(old("a.lode")));
    EXPECT_FALSE(abandoned_part(old("a.part1.ply"))) << "a name that somebody chose";
    const fs::path held = old("held.lode.part-x1Y2z3");
    const int descriptor = ::open(held.c_str(), O_RDONLY);
    ASSERT_EQ(::flock(descriptor, LOCK_EX), 0);
    EXPECT_FALSE(abandoned_part(held));
    ::close(descriptor);
    EXPECT_TRUE(abandoned_part(held));
}

}  // namespace
}  // namespace lodestone
