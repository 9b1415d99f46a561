// A thread of its own that does work in the order it was given.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <mutex>
#include <thread>

namespace lodestone::vgi {

class Worker {
public:
    Worker();
    ~Worker();
    Worker(const Worker&) = delete;
    Worker& operator=(const Worker&) = delete;

    // The work must not throw.
    template <class T>
    std::future<T> start(std::function<T()> work) {
        auto task = std::make_shared<std::packaged_task<T()>>(std::move(work));
        auto result = task->get_future();
        push([task] { (*task)(); });
        return result;
    }

private:
    void push(std::function<void()> work);
    void run();

    std::mutex mutex_;
    std::condition_variable wake_;
    std::deque<std::function<void()>> waiting_;
    bool ending_ = false;
    std::thread thread_;
};

}  // namespace lodestone::vgi
