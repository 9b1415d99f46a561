#include "base/process/confined.h"

#include <spawn.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
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
constexpr int program_file = 3;     // where a program of its own finds the memory

// Of the process that calls it.
void limit_process(uint64_t memory_bytes, double most_seconds) {
    if constexpr (!LODE_SANITIZED) {
        // Of the address space, besides what is mapped already. Sanitizers map terabytes.
        uint64_t pages = 0;
        if (std::FILE* file = std::fopen("/proc/self/statm", "r")) {
            unsigned long long read = 0;
            if (std::fscanf(file, "%llu", &read) == 1) pages = read;
            std::fclose(file);
        }
        const uint64_t mapped = pages * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
        const rlimit memory{mapped + memory_bytes, RLIM_INFINITY};
        setrlimit(RLIMIT_AS, &memory);
    }
    const auto seconds = static_cast<rlim_t>(most_seconds + 1);
    const rlimit time{seconds, seconds + 1};
    setrlimit(RLIMIT_CPU, &time);
    const rlimit no_core{0, 0};
    setrlimit(RLIMIT_CORE, &no_core);
    alarm(static_cast<unsigned>(std::min<rlim_t>(seconds * 20, 1u << 30)));  // where it waits
}

// Waits for the process; what its death says, or nothing.
std::string death_of(pid_t child, const std::string& decoder) {
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
    enum State : uint32_t { waiting, running, refused, done };
    uint64_t memory_bytes;
    double seconds;
    uint32_t state = waiting;
    char library[44] = {};
    char words[most_words] = {};
};

// What works on the memory of a ConfinedResult, on either side.
struct Confined {
    using Head = ConfinedResult::Head;

    // In the process that decodes.
    static void work_on(Head& head, const std::function<std::string()>& run) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        for (const int signal : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGALRM, SIGXCPU, SIGTERM, SIGINT})
            std::signal(signal, SIG_DFL);
        limit_process(head.memory_bytes, head.seconds);
        head.state = Head::running;
        std::string wrong;
        try {
            wrong = run();
        } catch (const std::bad_alloc&) {
            wrong = std::string(head.library) + " takes more memory than so much needs";
        } catch (const std::exception& e) { wrong = std::string(head.library) + ": " + e.what(); }
        std::ranges::replace_if(
            wrong, [](char c) { return static_cast<unsigned char>(c) < ' ' || c == 127; }, ' ');
        std::strncpy(head.words, wrong.c_str(), most_words - 1);
        head.state = wrong.empty() ? Head::done : Head::refused;
        _exit(0);
    }

    // In the one that asked. start(head, bytes, file of both, child): 0, or why no process was started.
    template <class Start>
    static Result<std::shared_ptr<const ConfinedResult>> run(const ConfinedWork& work, const Start& start) {
        const auto result = std::make_shared<ConfinedResult>(work);
        if (result->at_ == nullptr)
            return fail(Fault::machine, "there is no memory for what " + work.library + " has compressed");
        const std::string decoder = "the decoder of " + work.library;
        Head& head = *result->at_;
        pid_t child = 0;
        if (const int error = start(head, result->bytes(), result->file_, child); error != 0)
            return fail(Fault::machine, decoder + " cannot be started: " + std::strerror(error));
        const std::string death = death_of(child, decoder);
        if (head.state == Head::waiting) return fail(Fault::machine, decoder + " cannot be loaded");
        if (!death.empty()) return fail(Fault::format, death + "; the file is damaged");
        if (head.state == Head::done) return result;
        head.words[most_words - 1] = 0;
        return fail(Fault::format, head.words);
    }
};

ConfinedResult::ConfinedResult(const ConfinedWork& work)
    : bytes_(work.result_bytes), file_(memfd_create("confined", MFD_CLOEXEC)) {
    const size_t all = sizeof(Head) + bytes_;
    if (file_ < 0 || ftruncate(file_, static_cast<off_t>(all)) != 0) return;
    void* made = mmap(nullptr, all, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_NORESERVE, file_, 0);
    if (made == MAP_FAILED) return;
    at_ = new (made) Head{work.memory_bytes, work.seconds};
    std::strncpy(at_->library, work.library.c_str(), sizeof at_->library - 1);
}

ConfinedResult::~ConfinedResult() {
    if (at_ != nullptr) munmap(at_, sizeof(Head) + bytes_);
    if (file_ >= 0) close(file_);
}

std::span<std::byte> ConfinedResult::bytes() const { return {reinterpret_cast<std::byte*>(at_ + 1), bytes_}; }

Result<std::shared_ptr<const ConfinedResult>> run_confined(
    const ConfinedWork& work, const std::function<std::string(std::span<std::byte>)>& run) {
    return Confined::run(work, [&](auto& head, std::span<std::byte> bytes, int, pid_t& child) {
        child = fork();
        if (child == 0) Confined::work_on(head, [&] { return run(bytes); });
        return child < 0 ? errno : 0;
    });
}

Result<std::shared_ptr<const ConfinedResult>> run_confined(const ConfinedWork& work,
                                                           const std::filesystem::path& program,
                                                           const std::vector<std::string>& arguments) {
    std::vector<char*> words{const_cast<char*>(program.c_str())};
    for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
    words.push_back(nullptr);
    return Confined::run(work, [&](auto&, auto, int file, pid_t& child) {
        posix_spawn_file_actions_t files;
        posix_spawn_file_actions_init(&files);
        posix_spawn_file_actions_adddup2(&files, file, program_file);
        const int error = posix_spawn(&child, program.c_str(), &files, nullptr, words.data(), environ);
        posix_spawn_file_actions_destroy(&files);
        return error;
    });
}

int confined_main(int argc, char** argv,
                  const std::function<std::string(std::span<char* const>, std::span<std::byte>)>& run) {
    using Head = Confined::Head;
    struct stat file {};
    if (fstat(program_file, &file) != 0 || static_cast<size_t>(file.st_size) < sizeof(Head)) {
        std::fputs("this program is started by lodestone alone\n", stderr);
        return 2;
    }
    const auto size = static_cast<size_t>(file.st_size);
    void* memory = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_NORESERVE, program_file, 0);
    if (memory == MAP_FAILED) return 1;
    Head& head = *static_cast<Head*>(memory);
    const std::span<std::byte> bytes{reinterpret_cast<std::byte*>(&head + 1), size - sizeof head};
    Confined::work_on(head, [&] { return run({argv + 1, static_cast<size_t>(argc - 1)}, bytes); });
    return 0;
}

}  // namespace lodestone
