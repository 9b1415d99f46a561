#include "base/process/confined.h"

#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>

#include "base/sanitized.h"

namespace lodestone {

namespace {

constexpr size_t most_words = 496;  // of what the decoder says, bytes

// Of the process that calls it.
void limit_process(const ConfinedWork& work) {
    if constexpr (!LODE_SANITIZED) {
        // Of the address space, besides what is mapped already. Sanitizers map terabytes.
        uint64_t pages = 0;
        if (std::FILE* file = std::fopen("/proc/self/statm", "r")) {
            unsigned long long read = 0;
            if (std::fscanf(file, "%llu", &read) == 1) pages = read;
            std::fclose(file);
        }
        const uint64_t mapped = pages * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
        const rlimit memory{mapped + work.memory_bytes, RLIM_INFINITY};
        setrlimit(RLIMIT_AS, &memory);
    }
    const auto seconds = static_cast<rlim_t>(work.seconds + 1);
    const rlimit time{seconds, seconds + 1};
    setrlimit(RLIMIT_CPU, &time);
    const rlimit no_core{0, 0};
    setrlimit(RLIMIT_CORE, &no_core);
    alarm(static_cast<unsigned>(std::min<rlim_t>(seconds * 20, 1u << 30)));  // where it waits
}

// Waits for the process; what its death says, or nothing.
std::string death_of(pid_t child, const std::string& library) {
    const std::string decoder = "the decoder of " + library;
    int status = 0;
    while (waitpid(child, &status, 0) < 0) {
        if (errno != EINTR) return decoder + " was lost";
    }
    if (!WIFSIGNALED(status)) return WEXITSTATUS(status) == 0 ? "" : decoder + " failed";
    const int signal = WTERMSIG(status);
    if (signal == SIGXCPU || signal == SIGALRM) return decoder + " takes longer than so much needs";
    return decoder + " crashed (signal " + std::to_string(signal) + ")";
}

}  // namespace

// Before the result, in memory that both processes see.
struct alignas(16) ConfinedResult::Head {
    enum State : uint32_t { running, refused, done };
    uint32_t state = running;
    char words[most_words] = {};
};

ConfinedResult::ConfinedResult(uint64_t bytes) : bytes_(bytes) {
    void* made =
        mmap(nullptr, sizeof(Head) + bytes_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (made != MAP_FAILED) at_ = new (made) Head;
}

ConfinedResult::~ConfinedResult() {
    if (at_ != nullptr) munmap(at_, sizeof(Head) + bytes_);
}

std::span<std::byte> ConfinedResult::bytes() const { return {reinterpret_cast<std::byte*>(at_ + 1), bytes_}; }

Result<std::shared_ptr<const ConfinedResult>> run_confined(
    const ConfinedWork& work, const std::function<std::string(std::span<std::byte>)>& run) {
    auto result = std::make_shared<ConfinedResult>(work.result_bytes);
    if (!result->mapped())
        return fail(Fault::machine, "there is no memory for what " + work.library + " has compressed");
    ConfinedResult::Head& head = *result->at_;
    const pid_t child = fork();
    if (child < 0)
        return fail(Fault::machine, "the decoder of " + work.library + " cannot be started: " + std::strerror(errno));
    if (child == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        for (const int signal : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGALRM, SIGXCPU, SIGTERM, SIGINT})
            std::signal(signal, SIG_DFL);
        limit_process(work);
        std::string wrong;
        try {
            wrong = run(result->bytes());
        } catch (const std::bad_alloc&) {
            wrong = work.library + " takes more memory than so much needs";
        } catch (const std::exception& e) { wrong = work.library + ": " + e.what(); }
        std::ranges::replace_if(
            wrong, [](char c) { return static_cast<unsigned char>(c) < ' ' || c == 127; }, ' ');
        std::strncpy(head.words, wrong.c_str(), most_words - 1);
        head.state = wrong.empty() ? ConfinedResult::Head::done : ConfinedResult::Head::refused;
        _exit(0);
    }
    if (const std::string death = death_of(child, work.library); !death.empty())
        return fail(Fault::format, death + "; the file is damaged");
    if (head.state == ConfinedResult::Head::done) return result;
    head.words[most_words - 1] = 0;
    return fail(Fault::format, head.words);
}

}  // namespace lodestone
