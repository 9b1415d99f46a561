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

// Linux gives a process 65,530 mappings. Many small blocks would take them all, so once there are this many only large
// ones are files.
constexpr size_t most_blocks = 1 << 15, most_small_blocks = most_blocks / 2;
constexpr size_t large_block = size_t{1} << 20;
constexpr auto watch_every = std::chrono::milliseconds(5);
// Blocks are dropped until so much less is resident than allowed: threads go on meanwhile.
constexpr uint64_t headroom_bytes = uint64_t{160} << 20;
constexpr double most_headroom = 0.6, drop_further = 0.75;  // shares of what is allowed, and of what is then left
// Files cost a fault a page and an inode a block, so the first blocks are no files, and released ones wait to be given
// out again.
constexpr uint64_t in_memory_divisor = 4, kept_divisor = 8;  // of what is allowed
constexpr size_t most_kept = 64;
constexpr size_t largest_over_asked = 2;  // a block that waits is given out for half of its size, not for less

enum class Kind : uint8_t {
    memory,   // of our own, stays
    file,     // of our own, dropped where needed
    mapping,  // of somebody's file, dropped where needed
};
struct Block {
    void* begin;
    size_t bytes;
    Kind kind;
};

// Nothing here allocates: it is called by operator new.
struct Spill {
    std::mutex mutex;
    std::array<Block, most_blocks> blocks;  // sorted by address
    std::atomic<size_t> count{0};           // written under the mutex
    size_t next_dropped = 0;
    std::array<Block, most_kept> kept;  // released, the oldest first
    size_t kept_count = 0;
    uint64_t kept_bytes = 0, in_memory_bytes = 0;
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

// A block of our own, or a mapping; nothing where none begins there.
std::optional<Block> take(Spill& s, const void* begin, bool own) {
    Block* at = find(s, begin);
    Block* end = s.blocks.data() + s.count;
    if (at == end || at->begin != begin || (at->kind != Kind::mapping) != own) return std::nullopt;
    const Block block = *at;
    std::move(at + 1, end, at);
    --s.count;
    return block;
}

void give_back(Spill& s, const Block& block) {
    munmap(block.begin, block.bytes);
    if (block.kind == Kind::memory) s.in_memory_bytes -= block.bytes;
}

Block take_kept(Spill& s, size_t which) {
    Block* at = s.kept.data() + which;
    const Block block = *at;
    std::move(at + 1, s.kept.data() + s.kept_count, at);
    --s.kept_count;
    s.kept_bytes -= block.bytes;
    return block;
}

void give_back_kept(Spill& s) {
    const std::lock_guard lock(s.mutex);
    while (s.kept_count > 0) give_back(s, take_kept(s, 0));
}

void keep(Spill& s, const Block& block) {
    const uint64_t most = s.resident_bytes / kept_divisor;
    if (block.bytes > most) return give_back(s, block);
    while (s.kept_count == most_kept || s.kept_bytes + block.bytes > most) give_back(s, take_kept(s, 0));
    s.kept[s.kept_count++] = block;
    s.kept_bytes += block.bytes;
}

// The smallest that is large enough and not too large.
std::optional<Block> kept_block(Spill& s, size_t bytes) {
    size_t best = s.kept_count;
    for (size_t b = 0; b < s.kept_count; ++b) {
        const size_t has = s.kept[b].bytes;
        if (has >= bytes && has / largest_over_asked <= bytes && (best == s.kept_count || has < s.kept[best].bytes))
            best = b;
    }
    if (best == s.kept_count) return std::nullopt;
    return take_kept(s, best);
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
    give_back_kept(s);
    const std::lock_guard lock(s.mutex);
    for (size_t tried = 0; tried < s.count; ++tried) {
        s.next_dropped = s.next_dropped + 1 < s.count ? s.next_dropped + 1 : 0;
        const Block& block = s.blocks[s.next_dropped];
        if (block.kind == Kind::memory) continue;
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

bool spilling() noexcept { return spill().begun; }

SpillStatistics spill_statistics() {
    Spill& s = spill();
    const std::lock_guard lock(s.mutex);
    return s.statistics;
}

namespace {

// What waits, else memory while little of it is taken, else a file. Nothing where none of them has room.
std::optional<Block> block_of(Spill& s, size_t bytes) {
    {
        const std::lock_guard lock(s.mutex);
        if (const auto kept = kept_block(s, bytes)) return kept;
        if (s.in_memory_bytes + bytes <= s.resident_bytes / in_memory_divisor) {
            void* begin = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
            if (begin == MAP_FAILED) return std::nullopt;
            s.in_memory_bytes += bytes;
            return Block{begin, bytes, Kind::memory};
        }
    }
    void* begin = map_file(s.folder, bytes);
    if (begin == nullptr) {
        give_back_kept(s);  // they take room on the disk
        begin = map_file(s.folder, bytes);
    }
    if (begin == nullptr) return std::nullopt;
    return Block{begin, bytes, Kind::file};
}

}  // namespace

void* spill_allocate(size_t bytes) {
    Spill& s = spill();
    if (!s.begun.load(std::memory_order_relaxed) || bytes < s.least) return nullptr;
    if (bytes < large_block && s.count.load(std::memory_order_relaxed) >= most_small_blocks) return nullptr;
    // Whoever asks for more also makes room, however late the watching thread gets its turn.
    drop_where_needed(s);
    const auto block = block_of(s, whole_pages(bytes));
    const std::lock_guard lock(s.mutex);
    if (!block || !add(s, *block)) {
        if (block) give_back(s, *block);
        s.statistics.full = true;
        throw std::bad_alloc();
    }
    ++s.statistics.blocks;
    s.statistics.bytes += block->bytes;
    s.statistics.most_bytes = std::max(s.statistics.most_bytes, s.statistics.bytes);
    return block->begin;
}

bool spill_release(void* block) noexcept {
    Spill& s = spill();
    // Only few other blocks begin where a page does.
    if (!s.begun.load(std::memory_order_relaxed) || reinterpret_cast<uintptr_t>(block) % 4096 != 0) return false;
    const std::lock_guard lock(s.mutex);
    const auto taken = take(s, block, true);
    if (!taken) return false;
    --s.statistics.blocks;
    s.statistics.bytes -= taken->bytes;
    keep(s, *taken);
    return true;
}

void spill_mapping(const void* begin, size_t bytes) noexcept {
    Spill& s = spill();
    const std::lock_guard lock(s.mutex);
    // One too many stays in memory, that is all.
    if (bytes > 0) add(s, {const_cast<void*>(begin), whole_pages(bytes), Kind::mapping});
}

void end_spill_mapping(const void* begin) noexcept {
    Spill& s = spill();
    const std::lock_guard lock(s.mutex);
    take(s, begin, false);
}

}  // namespace lodestone
