// Loaded before the program (LD_PRELOAD): what it asks of the system fails. Each is off unless its variable is given.
// - LODESTONE_FAIL_MALLOC: of what the program's code allocates by malloc, and so by operator new, counted from 1, this
// one
//   fails, or the next that no driver asks for. Memory by calloc and realloc does not fail.
// - LODESTONE_FAIL_READS: reads of files whose name ends so fail with EIO, from number LODESTONE_FAIL_FROM (1) on,
//   LODESTONE_FAIL_TIMES (1) times; or where LODESTONE_STALL_MS is given, they take as many milliseconds longer.
// - LODESTONE_END_COPY: a copy of the program (fork) ends by this signal at its allocation number LODESTONE_END_AT (1);
//   where it is 0, that allocation fails.
#include <dlfcn.h>
#include <elf.h>
#include <execinfo.h>
#include <link.h>
#include <sys/auxv.h>
#include <sys/types.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <string_view>
#include <thread>

extern "C" void* __libc_malloc(size_t bytes);

namespace {

long number(const char* name, long otherwise) {
    const char* given = std::getenv(name);
    return given != nullptr ? std::atol(given) : otherwise;
}

// Where the program's own code lies. Nothing here allocates.
struct Code {
    uintptr_t begin = ~uintptr_t{0}, end = 0;
};
Code find_code() {
    Code code;
    const auto* headers = reinterpret_cast<const ElfW(Phdr)*>(getauxval(AT_PHDR));
    const auto count = getauxval(AT_PHNUM);
    uintptr_t base = 0;
    for (size_t i = 0; i < count; ++i) {
        if (headers[i].p_type == PT_PHDR) base = reinterpret_cast<uintptr_t>(headers) - headers[i].p_vaddr;
    }
    for (size_t i = 0; i < count; ++i) {
        if (headers[i].p_type != PT_LOAD || (headers[i].p_flags & PF_X) == 0) continue;
        code.begin = base + headers[i].p_vaddr;
        code.end = code.begin + headers[i].p_memsz;
    }
    return code;
}

bool is_own(const void* address) {
    static const Code code = find_code();
    const auto at = reinterpret_cast<uintptr_t>(address);
    return at >= code.begin && at < code.end;
}

// Libraries in C++ allocate by the program's operator new, too, and by strings that are its code: an exception would go
// through what is C, as a driver and its loader are. So none of those that called each other is in a driver.
bool is_asked_for_by_own_code() {
    static thread_local bool looking = false;  // what looks allocates, too
    if (looking) return false;
    looking = true;
    void* frames[64];
    const int depth = backtrace(frames, 64);
    bool own = true;
    for (int i = 0; own && i < depth; ++i) {
        dl_find_object object{};  // found without a lock
        if (is_own(frames[i]) || _dl_find_object(frames[i], &object) != 0) continue;
        const std::string_view name = object.dlfo_link_map->l_name;
        for (const char* driver : {"vulkan", "LLVM", "libGL", "libEGL"}) own = own && name.find(driver) == name.npos;
    }
    looking = false;
    return own;
}

bool fails_now(const void* caller) {
    static const long at = number("LODESTONE_FAIL_MALLOC", 0);
    static std::atomic<long> asked{0};
    static std::atomic<bool> failed{false};
    return at > 0 && is_own(caller) && ++asked >= at && !failed && is_asked_for_by_own_code() && !failed.exchange(true);
}

std::atomic<bool> is_copy{false};

// Of a copy, which has one thread. Whether this allocation fails.
bool ends_now() {
    static const long ending = number("LODESTONE_END_COPY", -1), at = number("LODESTONE_END_AT", 1);
    static long asked = 0;
    if (!is_copy || ending < 0 || ++asked != at) return false;
    if (ending > 0) std::raise(static_cast<int>(ending));
    return true;
}

bool is_named(int file) {
    static const char* const ending = std::getenv("LODESTONE_FAIL_READS");
    if (ending == nullptr) return false;
    char link[] = "/proc/self/fd/0123456789", path[4096];
    char* digit = link + sizeof "/proc/self/fd/" - 1;
    char reversed[10];
    int digits = 0;
    for (; file > 0 || digits == 0; file /= 10) reversed[digits++] = static_cast<char>('0' + file % 10);
    while (digits > 0) *digit++ = reversed[--digits];
    *digit = 0;
    const ssize_t length = readlink(link, path, sizeof path);
    return length > 0 && std::string_view(path, static_cast<size_t>(length)).ends_with(ending);
}

// Whether this read fails; where it only takes longer, it does so here.
bool read_fails(int file) {
    if (!is_named(file)) return false;
    static const long from = number("LODESTONE_FAIL_FROM", 1), times = number("LODESTONE_FAIL_TIMES", 1),
                      stall = number("LODESTONE_STALL_MS", 0);
    static std::atomic<long> reads{0};
    const long read = ++reads;
    if (read < from || read >= from + times) return false;
    if (stall == 0) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(stall));
    return false;
}

}  // namespace

extern "C" {

pid_t fork() {
    static const auto real = reinterpret_cast<pid_t (*)()>(dlsym(RTLD_NEXT, "fork"));
    const pid_t child = real();
    if (child == 0) is_copy = true;
    return child;
}

void* malloc(size_t bytes) {
    if (ends_now() || fails_now(__builtin_return_address(0))) {
        errno = ENOMEM;
        return nullptr;
    }
    return __libc_malloc(bytes);
}

ssize_t pread64(int file, void* into, size_t bytes, off64_t offset) {
    static const auto real = reinterpret_cast<ssize_t (*)(int, void*, size_t, off64_t)>(dlsym(RTLD_NEXT, "pread64"));
    if (!read_fails(file)) return real(file, into, bytes, offset);
    errno = EIO;
    return -1;
}
ssize_t pread(int file, void* into, size_t bytes, off_t offset) { return pread64(file, into, bytes, offset); }

}  // extern "C"
