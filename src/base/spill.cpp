#include "base/spill.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <mutex>
#include <new>
#include <optional>
#include <thread>

namespace lodestone {

namespace {

constexpr size_t most_blocks = 1 << 16;
constexpr auto watch_every = std::chrono::milliseconds(5);
// Blocks are dropped until so much less is resident than allowed: threads go on meanwhile.
constexpr uint64_t headroom_bytes = uint64_t{160} << 20;
constexpr double most_headroom = 0.6, drop_further = 0.75;  // shares of what is allowed, and of what is then left

struct Block {
    void* begin;
    size_t bytes;
    bool own;  // to be given out and unmapped; others are mappings of somebody's files
};

// Nothing here allocates: it is called by operator new.
struct Spill {
    std::mutex mutex;
    std::array<Block, most_blocks> blocks;  // sorted by address
    size_t count = 0, next_dropped = 0;
    SpillStatistics statistics;
    char folder[4096] = {};
    uint64_t resident_bytes = 0;
    size_t least = 0;
    int statm = -1;  // /proc/self/statm
    std::atomic<bool> begun{false};
};
Spill& spill() {
    static Spill the;
    return the;
}

Block* find(Spill& s, const void* begin) {
    return std::lower_bound(s.blocks.data(), s.blocks.data() + s.count, begin,
                            [](const Block& b, const void* at) { return b.begin < at; });
}

size_t whole_pages(size_t bytes) {
    static const auto page = static_cast<size_t>(sysconf(_SC_PAGESIZE));
    return (bytes + page - 1) / page * page;
}

bool add(Spill& s, const Block& block) {
    if (s.count == most_blocks) return false;
    Block* at = find(s, block.begin);
    Block* end = s.blocks.data() + s.count++;
    std::move_backward(at, end, end + 1);
    *at = block;
    return true;
}

// Of those that are own, or of those that are not; nothing where none begins there.
std::optional<Block> take(Spill& s, const void* begin, bool own) {
    Block* at = find(s, begin);
    Block* end = s.blocks.data() + s.count;
    if (at == end || at->begin != begin || at->own != own) return std::nullopt;
    const Block block = *at;
    std::move(at + 1, end, at);
    --s.count;
    return block;
}

// Mapped from a file without a name, whose room on the disk is taken at once: a full disk is noticed here and not when
// the block is written. Null where that fails.
void* map_file(const char* folder, size_t bytes) {
    int file = open(folder, O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    if (file < 0) {
        char name[sizeof(Spill::folder) + 32];
        const size_t length = std::strlen(folder);
        std::memcpy(name, folder, length);  // NOLINT(bugprone-not-null-terminated-result): the end comes next
        std::memcpy(name + length, "/spill-XXXXXX", sizeof "/spill-XXXXXX");
        file = mkostemp(name, O_CLOEXEC);
        if (file < 0) return nullptr;
        unlink(name);
    }
    void* block = MAP_FAILED;
    if (posix_fallocate(file, 0, static_cast<off_t>(bytes)) == 0)
        block = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    close(file);
    return block == MAP_FAILED ? nullptr : block;
}

uint64_t resident_now(int statm) {
    char text[128];
    const ssize_t length = pread(statm, text, sizeof text, 0);
    uint64_t whole = 0, resident = 0;
    if (length <= 0) return 0;
    const char* end = text + length;
    const auto first = std::from_chars(text, end, whole);
    std::from_chars(std::min(first.ptr + 1, end), end, resident);
    return resident * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

// Where too much is resident, drops blocks in turn, each at most once: what is in use comes back at once, and what is
// not stays out.
void drop_where_needed(Spill& s) {
    const auto allowed = static_cast<double>(s.resident_bytes);
    const double drop_from = allowed - std::min(headroom_bytes + 0.1 * allowed, most_headroom * allowed);
    if (static_cast<double>(resident_now(s.statm)) < drop_from) return;
    const std::lock_guard lock(s.mutex);
    for (size_t tried = 0; tried < s.count; ++tried) {
        s.next_dropped = s.next_dropped + 1 < s.count ? s.next_dropped + 1 : 0;
        const Block& block = s.blocks[s.next_dropped];
        madvise(block.begin, block.bytes, MADV_DONTNEED);
        ++s.statistics.dropped;
        if (static_cast<double>(resident_now(s.statm)) < drop_further * drop_from) break;
    }
}

[[noreturn]] void watch() {
    for (;;) {
        std::this_thread::sleep_for(watch_every);
        drop_where_needed(spill());
        const std::lock_guard lock(spill().mutex);
        ++spill().statistics.looks;
    }
}

}  // namespace

Result<void> begin_spilling(const SpillOptions& options) {
    Spill& s = spill();
    const std::string folder = options.folder.string();
    if (s.begun || folder.size() >= sizeof s.folder || options.resident_bytes == 0)
        return fail(Fault::machine, folder + ": cannot be spilled to");
    void* probe = map_file(folder.c_str(), whole_pages(1));
    if (probe == nullptr) return fail(Fault::machine, folder + ": cannot be spilled to: " + std::strerror(errno));
    munmap(probe, whole_pages(1));
    s.statm = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
    if (s.statm < 0) return fail(Fault::machine, "/proc/self/statm cannot be read, so memory cannot be watched");
    std::memcpy(s.folder, folder.c_str(), folder.size() + 1);
    s.resident_bytes = options.resident_bytes;
    s.least = std::max<size_t>(options.least, 1);
    s.begun = true;
    std::thread(watch).detach();
    return {};
}

SpillStatistics spill_statistics() {
    Spill& s = spill();
    const std::lock_guard lock(s.mutex);
    return s.statistics;
}

void* spill_allocate(size_t bytes) {
    Spill& s = spill();
    if (!s.begun.load(std::memory_order_relaxed) || bytes < s.least) return nullptr;
    // Whoever asks for more also makes room, however late the watching thread gets its turn.
    drop_where_needed(s);
    const size_t mapped = whole_pages(bytes);
    void* begin = map_file(s.folder, mapped);
    const std::lock_guard lock(s.mutex);
    if (begin == nullptr || !add(s, {begin, mapped, true})) {
        if (begin != nullptr) munmap(begin, mapped);
        s.statistics.full = true;
        throw std::bad_alloc();
    }
    ++s.statistics.blocks;
    s.statistics.bytes += mapped;
    s.statistics.most_bytes = std::max(s.statistics.most_bytes, s.statistics.bytes);
    return begin;
}

bool spill_release(void* block) noexcept {
    Spill& s = spill();
    // Only few other blocks begin where a page does.
    if (!s.begun.load(std::memory_order_relaxed) || reinterpret_cast<uintptr_t>(block) % 4096 != 0) return false;
    const std::lock_guard lock(s.mutex);
    const auto taken = take(s, block, true);
    if (!taken) return false;
    munmap(taken->begin, taken->bytes);
    --s.statistics.blocks;
    s.statistics.bytes -= taken->bytes;
    return true;
}

void spill_mapping(const void* begin, size_t bytes) noexcept {
    Spill& s = spill();
    const std::lock_guard lock(s.mutex);
    // One too many stays in memory, that is all.
    if (bytes > 0) add(s, {const_cast<void*>(begin), whole_pages(bytes), false});
}

void end_spill_mapping(const void* begin) noexcept {
    Spill& s = spill();
    const std::lock_guard lock(s.mutex);
    take(s, begin, false);
}

}  // namespace lodestone
