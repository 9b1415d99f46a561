// What Draco compressed, through the program: its decoder runs in a copy of the program, and whatever becomes of that
// is one line and exit code 3.
#include <csignal>
#include <glm/common.hpp>
#include <glm/vector_relational.hpp>
#include <vector>

#include "apps/program.h"
#include "base/sanitized.h"
#include "fixtures/gltf_files.h"
#include "fixtures/meshes.h"
#include "mesh/io/image_file.h"
#include "mesh/io/write.h"

namespace lodestone {
namespace {

class DracoTest : public ProgramTest {
protected:
    void SetUp() override {
        ProgramTest::SetUp();
        torus_ = fixtures::torus(20, 12);
        packed_ = fixtures::draco_of(torus_);
        ASSERT_FALSE(packed_.empty());
    }
    void put(const char* name, const std::vector<unsigned char>& packed) const {
        std::ofstream(folder_ / name, std::ios::binary) << fixtures::draco_glb(torus_, packed);
    }
    // By a command; what went wrong is one line, and leaves no asset.
    Ended bake(const std::string& by) const {
        const Ended e = run("-q bake a.glb --backends full -o a.lode", by);
        if (e.code != 0) {
            EXPECT_EQ(std::count(e.err.begin(), e.err.end(), '\n'), 1) << e.err;
            EXPECT_FALSE(fs::exists(folder_ / "a.lode"));
        }
        fs::remove(folder_ / "a.lode");
        return e;
    }
    // A command under which the decoder ends at an allocation, by a signal; 0: that fails.
    static std::string ending(int signal, int at) {
        return "env LD_PRELOAD=" LODESTONE_FAIL_SYSTEM " LODESTONE_END_COPY=" + std::to_string(signal) +
               " LODESTONE_END_AT=" + std::to_string(at) + " ";
    }
    TriMesh torus_;
    std::vector<unsigned char> packed_;
};

TEST_F(DracoTest, DamageAnywhereIsOneLine) {
    put("a.glb", packed_);
    EXPECT_EQ(bake("").code, 0);
    for (size_t keep = 1; keep < packed_.size(); keep += packed_.size() / 4) {
        SCOPED_TRACE(keep);
        put("a.glb", {packed_.begin(), packed_.begin() + static_cast<ptrdiff_t>(keep)});
        const Ended e = bake("");
        EXPECT_EQ(e.code, 3);
        EXPECT_THAT(e.err, HasSubstr("a.glb: mesh 0 primitive 0: Draco"));
    }
    int refused = 0;
    for (size_t at = 8; at < 100; at += 8) {
        SCOPED_TRACE(at);
        std::vector<unsigned char> damaged = packed_;
        damaged[at] ^= 0x5a;
        put("a.glb", damaged);
        // Another mesh may come of it, which is as good.
        const Ended e = bake("");
        if (e.code == 0) continue;
        ++refused;
        EXPECT_EQ(e.code, 3);
        EXPECT_THAT(e.err, HasSubstr("a.glb: "));
    }
    EXPECT_GT(refused, 3);
}

// Into the viewer, as the plain file is.
TEST_F(DracoTest, IsShownWhereItIsDropped) {
    if (!has_device()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    if (std::system("command -v xvfb-run > /dev/null") != 0)
        GTEST_SKIP() << "no display; install xvfb to run this test";
    put("a.glb", packed_);
    ASSERT_TRUE(write_mesh(torus_, folder_ / "plain.glb"));
    succeeds("generate rock --triangles 1000 -o rock.ply");
    const Ended e =
        run("view rock.ply --backend full --size 160x120 --keys H,F12,load:a.glb,F12,load:plain.glb,F12", own_display);
    ASSERT_EQ(e.code, 0) << e.err;
    EXPECT_EQ(e.err, "");
    std::vector<Image> seen;
    for (const char* name : {"lodestone-1.png", "lodestone-2.png", "lodestone-3.png"}) {
        auto image = read_image(folder_ / name);
        ASSERT_TRUE(image) << image.error().message;
        seen.push_back(std::move(*image));
    }
    const auto unlike = [&](const Image& a, const Image& b) {
        size_t count = 0;
        for (size_t i = 0; i < a.texels.size(); ++i)
            count +=
                glm::any(glm::greaterThan(glm::abs(glm::ivec4(a.texels[i]) - glm::ivec4(b.texels[i])), glm::ivec4(8)));
        return count;
    };
    EXPECT_GT(unlike(seen[0], seen[1]), 500u);
    EXPECT_LT(unlike(seen[1], seen[2]), 60u);
}

#if !LODE_SANITIZED  // which bring an allocation of their own, and take terabytes of addresses
TEST_F(DracoTest, ADecoderThatEndsAnywhereIsOneLine) {
    put("a.glb", packed_);
    for (const auto& [signal, line] :
         {std::pair{SIGKILL, "the decoder of Draco crashed (signal 9); the file is damaged"},
          {SIGSEGV, "the decoder of Draco crashed (signal 11); the file is damaged"},
          {SIGXCPU, "the decoder of Draco takes longer than so much needs"}}) {
        int ended = 0;
        for (int at = 1;; at = at * 3 / 2 + 1) {
            SCOPED_TRACE(std::string(line) + " at " + std::to_string(at));
            const Ended e = bake(ending(signal, at));
            if (e.code == 0) break;
            // Before it came to decode it was not the file that ended it.
            const bool began = e.err.find("before it began") == std::string::npos;
            EXPECT_EQ(e.code, began ? 3 : 4) << e.err;
            if (began) { EXPECT_THAT(e.err, HasSubstr(std::string("a.glb: mesh 0 primitive 0: ") + line)); }
            ended += began;
        }
        EXPECT_GT(ended, 3) << line;
    }
}

// Which is how its limit makes itself felt.
TEST_F(DracoTest, ADecoderThatGetsNoMoreMemoryIsOneLine) {
    put("a.glb", packed_);
    int ended = 0;
    for (int at = 5; at < 300; at = at * 4 / 3) {
        SCOPED_TRACE(at);
        const Ended e = bake(ending(0, at));
        if (e.code == 0) continue;
        ++ended;
        EXPECT_EQ(e.code, 3);
        EXPECT_THAT(e.err, HasSubstr("a.glb: mesh 0 primitive 0: Draco takes more memory than so much needs"));
    }
    EXPECT_GT(ended, 3);
}
#endif

}  // namespace
}  // namespace lodestone
