#include "apps/scene/page_reader.h"

#include <new>
#include <utility>

#include "base/cpu_meter.h"

namespace lodestone {

PageReader::PageReader(std::vector<ChunkFile> files) : files_(std::move(files)), thread_([this] { run(); }) {}

PageReader::~PageReader() {
    {
        const std::lock_guard lock(mutex_);
        ending_ = true;
    }
    wake_.notify_one();
    thread_.join();
}

bool PageReader::LessWanted::operator()(const PageRequest& a, const PageRequest& b) const {
    return a.priority != b.priority ? a.priority < b.priority : a.id > b.id;
}

void PageReader::request(const std::vector<PageRequest>& requests) {
    if (requests.empty()) return;
    {
        const std::lock_guard lock(mutex_);
        for (const PageRequest& request : requests) waiting_.push(request);
    }
    wake_.notify_one();
}

std::vector<Arrival> PageReader::arrivals() {
    const std::lock_guard lock(mutex_);
    return std::exchange(arrived_, {});
}

void PageReader::wait() {
    std::unique_lock lock(mutex_);
    idle_.wait(lock, [this] { return waiting_.empty() && !reading_; });
}

Arrival PageReader::read(const PageRequest& request) const {
    try {
        std::vector<std::byte> bytes(request.bytes);
        if (files_[request.asset].read_part(request.chunk, request.offset, bytes))
            return {request.id, Blob(std::move(bytes))};
    } catch (const std::bad_alloc&) {}  // as good as unreadable; it is asked for again
    return {request.id, {}};
}

void PageReader::run() {
    const CountedThread counted;
    std::unique_lock lock(mutex_);
    for (;;) {
        wake_.wait(lock, [this] { return ending_ || !waiting_.empty(); });
        if (ending_) return;
        const PageRequest request = waiting_.top();
        waiting_.pop();
        reading_ = true;
        lock.unlock();
        Arrival arrival = read(request);
        lock.lock();
        arrived_.push_back(std::move(arrival));
        reading_ = false;
        if (waiting_.empty()) idle_.notify_all();
    }
}

}  // namespace lodestone
