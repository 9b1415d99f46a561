#include "base/process/confined.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
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

#include "base/process/process.h"
#include "base/sanitized.h"

namespace lodestone {

namespace {

constexpr size_t most_words = 496;                  // of what the decoder says, bytes
constexpr int program_file = 3;                     // where a program of its own finds the memory
constexpr uint64_t head_mark = 0x4c4f444543464431;  // its last byte changes with what both have in memory

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

// Waits for the process; why what it left is not to be used, or nothing. began: whether it came to decode.
Result<void> wait_for(pid_t child, const std::string& decoder, const std::function<bool()>& began) {
    int status = 0;
    while (waitpid(child, &status, 0) < 0) {
        if (errno != EINTR) return fail(Fault::machine, decoder + " was lost");
    }
    if (!WIFSIGNALED(status)) {
        if (!began()) return fail(Fault::machine, decoder + " cannot be loaded");
        return WEXITSTATUS(status) == 0 ? Result<void>{}
                                        : fail(Fault::format, decoder + " failed; the file is damaged");
    }
    const int signal = WTERMSIG(status);
    if (signal == SIGINT || signal == SIGTERM) return fail(Fault::interrupted, decoder + " was interrupted");
    const std::string crashed = decoder + " crashed (signal " + std::to_string(signal) + ")";
    if (!began()) return fail(Fault::machine, crashed + " before it began");
    if (signal == SIGXCPU || signal == SIGALRM)
        return fail(Fault::format, decoder + " takes longer than so much needs; the file is damaged");
    return fail(Fault::format, crashed + "; the file is damaged");
}

// Of so many bytes, which nobody can make shorter: they would not be there for the one that maps them. -1 and errno
// where it cannot be.
int shared_file(size_t bytes) {
    rlimit most{};
    if (getrlimit(RLIMIT_FSIZE, &most) == 0 && bytes > most.rlim_cur) {
        errno = EFBIG;  // ftruncate would end this process
        return -1;
    }
    const int file = memfd_create("confined", MFD_CLOEXEC | MFD_ALLOW_SEALING);
    if (file < 0) return -1;
    if (ftruncate(file, static_cast<off_t>(bytes)) == 0 &&
        fcntl(file, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) == 0)
        return file;
    const int error = errno;
    close(file);
    errno = error;
    return -1;
}

}  // namespace

// Before the result, in memory that both processes see.
struct alignas(16) ConfinedResult::Head {
    enum State : uint32_t { waiting, running, refused, done };
    uint64_t mark;  // that it is one
    uint64_t memory_bytes;
    double seconds;
    pid_t asker;
    uint32_t state = waiting;
    char library[44] = {};
    char words[most_words] = {};
};

// What works on the memory of a ConfinedResult, on either side.
struct Confined {
    using Head = ConfinedResult::Head;

    // In the process that decodes.
    static void work_on(Head& head, const std::function<std::string()>& run) {
        begin_as_child_of(head.asker);
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

    // In the one that asked. start(head, bytes, child): 0, or why no process was started. file: of both, or -1 where
    // the process is a copy of this one.
    template <class Start>
    static Result<std::shared_ptr<const ConfinedResult>> run(const ConfinedWork& work, int file, const Start& start) {
        const auto result = std::make_shared<ConfinedResult>(work, file);
        if (result->at_ == nullptr) return no_memory(work);
        const std::string decoder = "the decoder of " + work.library;
        Head& head = *result->at_;
        pid_t child = 0;
        if (const int error = start(head, result->bytes(), child); error != 0)
            return fail(Fault::machine, decoder + " cannot be started: " + std::strerror(error));
        if (auto ended = wait_for(child, decoder, [&] { return head.state != Head::waiting; }); !ended)
            return tl::unexpected(ended.error());
        if (head.state == Head::done) return result;
        head.words[most_words - 1] = 0;
        return fail(Fault::format, head.words);
    }
    static tl::unexpected<Error> no_memory(const ConfinedWork& work) {
        return fail(Fault::machine,
                    "there is no memory for what " + work.library + " has compressed: " + std::strerror(errno));
    }
    static size_t bytes_for(const ConfinedWork& work) { return sizeof(Head) + work.result_bytes; }
};

ConfinedResult::ConfinedResult(const ConfinedWork& work, int file) : bytes_(work.result_bytes) {
    const int of_none = file < 0 ? MAP_ANONYMOUS : 0;
    void* made =
        mmap(nullptr, Confined::bytes_for(work), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_NORESERVE | of_none, file, 0);
    if (made == MAP_FAILED) return;
    at_ = new (made) Head{head_mark, work.memory_bytes, work.seconds, getpid()};
    std::strncpy(at_->library, work.library.c_str(), sizeof at_->library - 1);
}

ConfinedResult::~ConfinedResult() {
    if (at_ != nullptr) munmap(at_, sizeof(Head) + bytes_);
}

std::span<std::byte> ConfinedResult::bytes() const { return {reinterpret_cast<std::byte*>(at_ + 1), bytes_}; }

Result<std::shared_ptr<const ConfinedResult>> run_confined(
    const ConfinedWork& work, const std::function<std::string(std::span<std::byte>)>& run) {
    return Confined::run(work, -1, [&](auto& head, std::span<std::byte> bytes, pid_t& child) {
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
    const int file = shared_file(Confined::bytes_for(work));
    if (file < 0) return Confined::no_memory(work);
    auto result = Confined::run(work, file, [&](auto&, auto, pid_t& child) {
        posix_spawn_file_actions_t files;
        posix_spawn_file_actions_init(&files);
        posix_spawn_file_actions_adddup2(&files, file, program_file);
        const int error = posix_spawn(&child, program.c_str(), &files, nullptr, words.data(), environ);
        posix_spawn_file_actions_destroy(&files);
        return error;
    });
    close(file);
    return result;
}

int confined_main(int argc, char** argv,
                  const std::function<std::string(std::span<char* const>, std::span<std::byte>)>& run) {
    using Head = Confined::Head;
    struct stat file {};
    const bool is_there = argc > 0 && fstat(program_file, &file) == 0 && file.st_size >= off_t{sizeof(Head)};
    const auto size = static_cast<size_t>(file.st_size);
    void* memory = is_there ? mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_NORESERVE, program_file, 0)
                            : MAP_FAILED;
    if (memory == MAP_FAILED || static_cast<Head*>(memory)->mark != head_mark) {
        std::fputs("this program is started by lodestone of the same version alone\n", stderr);
        return 2;
    }
    Head& head = *static_cast<Head*>(memory);
    const std::span<std::byte> bytes{reinterpret_cast<std::byte*>(&head + 1), size - sizeof head};
    Confined::work_on(head, [&] { return run({argv + 1, static_cast<size_t>(argc - 1)}, bytes); });
    return 0;
}

}  // namespace lodestone
