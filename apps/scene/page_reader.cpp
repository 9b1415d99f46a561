#include "apps/scene/page_reader.h"

#include <algorithm>

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

void PageReader::request(const std::vector<PageRequest>& requests) {
    if (requests.empty()) return;
    {
        const std::lock_guard lock(mutex_);
        waiting_.insert(waiting_.end(), requests.begin(), requests.end());
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

// The mapping's bytes are copied here, so that it is this thread that waits for the disk.
Arrival PageReader::read(const PageRequest& request) const {
    const auto bytes = files_[request.asset].unchecked_bytes(request.chunk);
    if (!bytes || request.offset > bytes->size() || request.bytes > bytes->size() - request.offset)
        return {request.id, {}};
    const auto part = bytes->subspan(request.offset, request.bytes);
    return {request.id, Blob(std::vector<std::byte>(part.begin(), part.end()))};
}

void PageReader::run() {
    const CountedThread counted;
    std::unique_lock lock(mutex_);
    for (;;) {
        wake_.wait(lock, [this] { return ending_ || !waiting_.empty(); });
        if (ending_) return;
        const auto most =
            std::ranges::max_element(waiting_, {}, [](const PageRequest& r) { return std::pair(r.priority, ~r.id); });
        const PageRequest request = std::move(*most);
        waiting_.erase(most);
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
