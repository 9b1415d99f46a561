#include "base/process/process.h"

#include <sys/prctl.h>
#include <unistd.h>

#include <csignal>

namespace lodestone {

Result<std::filesystem::path> this_program() {
    std::error_code error;
    auto program = std::filesystem::read_symlink("/proc/self/exe", error);
    if (error) return fail(Fault::machine, "/proc/self/exe: cannot be read: " + error.message());
    return program;
}

void begin_as_child_of(pid_t parent) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(137);
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, nullptr);
}

}  // namespace lodestone
