// What decodes in a process of its own: what is told where it does not come to that, and how it ends.
#include "base/process/confined.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>

namespace lodestone {
namespace {

using testing::HasSubstr;

ConfinedWork some_work() {
    ConfinedWork work;
    work.library = "Some";
    work.result_bytes = 16;
    work.memory_bytes = uint64_t{1} << 30;
    work.seconds = 1;
    return work;
}

TEST(Confined, AProgramThatIsNotThereOrDoesNotLoadIsTheMachinesFault) {
    for (const auto& [program, line] :
         {std::pair{"/nonexistent", "the decoder of Some cannot be started: No such file"},
          {"/bin/false", "the decoder of Some cannot be loaded"}}) {
        const auto result = run_confined(some_work(), program, {});
        ASSERT_FALSE(result) << program;
        EXPECT_EQ(result.error().fault, Fault::machine) << program;
        EXPECT_THAT(result.error().message, HasSubstr(line));
    }
}

TEST(Confined, EndsAreToldAsWhatTheyAre) {
    const auto ended_by = [](int signal) {
        const auto result = run_confined(some_work(), [signal](std::span<std::byte>) {
            std::raise(signal);
            return std::string();
        });
        EXPECT_FALSE(result) << signal;
        return result ? Error{} : result.error();
    };
    EXPECT_EQ(ended_by(SIGINT).fault, Fault::interrupted);
    EXPECT_EQ(ended_by(SIGXCPU).fault, Fault::format);
    EXPECT_THAT(ended_by(SIGXCPU).message, HasSubstr("takes longer than so much needs"));
    EXPECT_THAT(ended_by(SIGSEGV).message, HasSubstr("crashed (signal 11); the file is damaged"));
}

// A host may block what ends a decoder that takes too long.
TEST(Confined, SignalsThatTheCallerBlocksAreNotBlockedInIt) {
    sigset_t all, before;
    sigfillset(&all);
    ASSERT_EQ(pthread_sigmask(SIG_SETMASK, &all, &before), 0);
    const auto result = run_confined(some_work(), [](std::span<std::byte>) {
        std::raise(SIGALRM);
        return std::string("goes on");
    });
    ASSERT_EQ(pthread_sigmask(SIG_SETMASK, &before, nullptr), 0);
    ASSERT_FALSE(result);
    EXPECT_THAT(result.error().message, HasSubstr("takes longer than so much needs"));
}

}  // namespace
}  // namespace lodestone
