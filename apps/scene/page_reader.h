// Reads the pages that plans ask for, on a thread of its own, those wanted most first.
#pragma once

#include <condition_variable>
#include <mutex>
#include <queue>
#include <thread>
#include <vector>

#include "base/files/chunk_file.h"
#include "frame/frame_source.h"

namespace lodestone {

class PageReader {
public:
    // files: by PageRequest::asset.
    explicit PageReader(std::vector<ChunkFile> files);
    ~PageReader();
    PageReader(const PageReader&) = delete;
    PageReader& operator=(const PageReader&) = delete;

    void request(const std::vector<PageRequest>& requests);
    // What has been read since the last call, in the order it was read; an empty blob where reading failed.
    std::vector<Arrival> arrivals();
    // Waits until everything asked for has been read.
    void wait();

private:
    struct LessWanted {
        bool operator()(const PageRequest& a, const PageRequest& b) const;  // of two as much wanted, the later one
    };
    void run();
    Arrival read(const PageRequest& request) const;

    std::vector<ChunkFile> files_;
    std::mutex mutex_;
    std::condition_variable wake_, idle_;
    std::priority_queue<PageRequest, std::vector<PageRequest>, LessWanted> waiting_;
    std::vector<Arrival> arrived_;
    bool reading_ = false, ending_ = false;
    std::thread thread_;
};

}  // namespace lodestone
