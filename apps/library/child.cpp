#include "apps/library/child.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

#include "base/process/process.h"

namespace lodestone {

namespace {

constexpr off_t most_read = 16 << 20;  // bytes of what a process wrote

std::string content_of(int descriptor) {
    const off_t bytes = std::min(most_read, ::lseek(descriptor, 0, SEEK_END));
    std::string text(static_cast<size_t>(std::max<off_t>(0, bytes)), '\0');
    const ssize_t got = ::pread(descriptor, text.data(), text.size(), 0);
    text.resize(static_cast<size_t>(std::max<ssize_t>(0, got)));
    return text;
}

double seconds_of(const timeval& time) { return static_cast<double>(time.tv_sec) + time.tv_usec * 1e-6; }

// In the child: only what is allowed between fork and exec.
[[noreturn]] void become(const char* program, char* const* words, int out, int err, pid_t parent) {
    begin_as_child_of(parent);
    const int in = ::open("/dev/null", O_RDONLY);
    if (in < 0 || dup2(in, STDIN_FILENO) < 0 || dup2(out, STDOUT_FILENO) < 0 || dup2(err, STDERR_FILENO) < 0)
        _exit(static_cast<int>(Fault::machine));
    execv(program, words);
    _exit(127);
}

}  // namespace

Result<Child> Child::start(const std::filesystem::path& program, const std::vector<std::string>& words) {
    Child child;
    child.out_ = memfd_create("out", MFD_CLOEXEC);
    child.err_ = memfd_create("err", MFD_CLOEXEC);
    std::vector<char*> pointers = {const_cast<char*>(program.c_str())};
    for (const std::string& word : words) pointers.push_back(const_cast<char*>(word.c_str()));
    pointers.push_back(nullptr);
    const pid_t parent = getpid();
    if (child.out_ >= 0 && child.err_ >= 0) child.pid_ = fork();
    if (child.pid_ == 0) become(program.c_str(), pointers.data(), child.out_, child.err_, parent);
    if (child.pid_ < 0)
        return fail(Fault::machine, std::string("a process cannot be started: ") + std::strerror(errno));
    return child;
}

Child::Child(Child&& other) noexcept { swap(other); }

Child& Child::operator=(Child&& other) noexcept {
    Child taken(std::move(other));
    swap(taken);
    return *this;
}

void Child::swap(Child& other) noexcept {
    std::swap(pid_, other.pid_);
    std::swap(out_, other.out_);
    std::swap(err_, other.err_);
    std::swap(begun_, other.begun_);
}

Child::~Child() {
    if (pid_ > 0) {
        kill(pid_, SIGKILL);
        waitpid(pid_, nullptr, 0);
    }
    if (out_ >= 0) ::close(out_);
    if (err_ >= 0) ::close(err_);
}

std::optional<Ended> Child::ended() {
    int status = 0;
    rusage used{};
    if (pid_ < 0 || wait4(pid_, &status, WNOHANG, &used) != pid_) return std::nullopt;
    pid_ = -1;
    Ended end;
    end.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    end.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun_).count();
    end.cpu_seconds = seconds_of(used.ru_utime) + seconds_of(used.ru_stime);
    end.peak_rss_bytes = static_cast<uint64_t>(used.ru_maxrss) << 10;
    end.out = content_of(out_);
    end.err = content_of(err_);
    return end;
}

void Child::signal(int number) const {
    if (pid_ > 0) kill(pid_, number);
}

}  // namespace lodestone
