// A persistent pool of threads; the caller of a loop works at it too, so a loop ends even if no other thread is free.
// Source: M. Pharr, W. Jakob, G. Humphreys, Physically Based Rendering (4th ed.), util/parallel, for the scheme.
#include "base/threads.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <limits>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "base/check.h"
#include "base/cpu_meter.h"

namespace lodestone {

namespace {

using Body = std::function<void(size_t, size_t)>;

std::atomic<unsigned> g_thread_count{0};
thread_local bool t_inside_loop = false;

// Marks the calling thread as working at a loop while it lives.
class InsideLoop {
public:
    InsideLoop() : nested_(std::exchange(t_inside_loop, true)) {}
    ~InsideLoop() { t_inside_loop = nested_; }
    InsideLoop(const InsideLoop&) = delete;
    InsideLoop& operator=(const InsideLoop&) = delete;
    bool nested() const { return nested_; }

private:
    const bool nested_;
};

// One call of parallel_for, on its caller's stack. Chunks are claimed in ascending order. So every chunk before one
// that throws has been claimed and runs to its end, and the first chunk that throws is the same for any number of
// threads.
class Loop {
public:
    Loop(size_t count, size_t grain, const Body& body)
        : count_(count), grain_(grain), chunks_(count / grain + (count % grain > 0 ? 1 : 0)), body_(body) {}

    size_t chunks() const { return chunks_; }
    bool has_chunks() const { return next_ < chunks_; }

    // Runs chunks until none is left to claim.
    void work() noexcept {
        for (size_t chunk = next_++; chunk < chunks_; chunk = next_++) {
            try {
                const size_t begin = chunk * grain_;
                body_(begin, begin + std::min(grain_, count_ - begin));
            } catch (...) {
                next_ = chunks_;
                const std::lock_guard lock(mutex_);
                if (chunk < first_thrown_) exception_ = std::current_exception();
                first_thrown_ = std::min(first_thrown_, chunk);
            }
        }
    }

    // Call it when all threads have left work().
    void rethrow() const {
        if (exception_) std::rethrow_exception(exception_);
    }

    unsigned wanted = 0, helpers = 0;  // threads that may still join, threads inside; guarded by the pool's mutex

private:
    const size_t count_, grain_, chunks_;
    const Body& body_;
    std::atomic<size_t> next_{0};
    std::mutex mutex_;
    size_t first_thrown_ = std::numeric_limits<size_t>::max();
    std::exception_ptr exception_;
};

class ThreadPool {
public:
    ThreadPool() = default;
    ThreadPool(const ThreadPool&) = delete;
    ThreadPool& operator=(const ThreadPool&) = delete;
    ~ThreadPool() {
        {
            const std::lock_guard lock(mutex_);
            ending_ = true;
        }
        wake_.notify_all();
        for (std::thread& thread : threads_) thread.join();
    }

    // Runs the loop on the calling thread and at most `helpers` others.
    void run(Loop& loop, unsigned helpers) {
        {
            const std::lock_guard lock(mutex_);
            grow(helpers);
            loop.wanted = helpers;
            open_.push_back(&loop);
        }
        wake_some(helpers);
        loop.work();
        std::unique_lock lock(mutex_);
        std::erase(open_, &loop);
        left_.wait(lock, [&] { return loop.helpers == 0; });
    }

private:
    // Makes threads until there are `count`. If the system allows no more, loops have those that are there.
    void grow(unsigned count) {
        try {
            while (threads_.size() < count) threads_.emplace_back([this] { serve(); });
        } catch (const std::system_error&) { return; }
    }

    // Those that wake wake others: to wake a thread costs a system call, and whoever opened the loop has better to do.
    void wake_some(unsigned wanted) {
        for (unsigned i = 0; i < std::min(wanted, 2u); ++i) wake_.notify_one();
    }

    void serve() {
        const CountedThread counted;
        const InsideLoop inside;
        std::unique_lock lock(mutex_);
        for (;;) {
            const auto joinable = [](const Loop* loop) { return loop->wanted > 0 && loop->has_chunks(); };
            auto found = open_.end();
            wake_.wait(lock, [&] { return ending_ || (found = std::ranges::find_if(open_, joinable)) != open_.end(); });
            if (ending_) return;
            Loop& loop = **found;
            --loop.wanted;
            ++loop.helpers;
            const unsigned more = loop.has_chunks() ? loop.wanted : 0;
            lock.unlock();
            wake_some(more);
            loop.work();
            lock.lock();
            if (--loop.helpers == 0) left_.notify_all();
        }
    }

    std::mutex mutex_;
    std::condition_variable wake_, left_;  // a loop has come or the pool ends; a loop has lost its last helper
    std::vector<Loop*> open_;              // loops that threads may join
    std::vector<std::thread> threads_;
    bool ending_ = false;
};

ThreadPool& pool() {
    static ThreadPool the;
    return the;
}

}  // namespace

void set_thread_count(unsigned count) { g_thread_count = count; }

unsigned thread_count() {
    const unsigned count = g_thread_count;
    return count > 0 ? count : std::max(1u, std::thread::hardware_concurrency());
}

void parallel_for(size_t count, size_t grain, const Body& body) {
    LODE_CHECK(grain > 0);
    Loop loop(count, grain, body);
    // One chunk is no loop: loops in it are for all threads.
    if (loop.chunks() == 1) return body(0, count);
    const InsideLoop inside;
    const size_t threads = inside.nested() ? 1 : std::min<size_t>(thread_count(), loop.chunks());
    if (threads > 1) {
        pool().run(loop, static_cast<unsigned>(threads - 1));
    } else {
        loop.work();
    }
    loop.rethrow();
}

}  // namespace lodestone
