#include "apps/library/crew.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <list>
#include <optional>

#include "apps/library/child.h"
#include "base/json.h"

namespace lodestone {

namespace fs = std::filesystem;

namespace {

using Clock = std::chrono::steady_clock;

constexpr unsigned most_tries = 3;
constexpr uint64_t least_bake_memory = uint64_t{192} << 20;  // what bake --memory takes at least
constexpr auto patience = std::chrono::seconds(20);          // with bakes that were asked to stop

struct Waiting {
    Job job;
    uint64_t memory = 0;
    unsigned tries = 0;
    Clock::time_point not_before;
};

struct Running {
    Waiting of;
    unsigned threads = 1;
    Stamp source;
    Child child;
};

bool may_be_tried_again(int code) { return code == 4 || code >= 128; }

std::string last_line(const std::string& text) {
    const size_t end = text.find_last_not_of("\n ");
    if (end == std::string::npos) return "";
    const size_t begin = text.find_last_of('\n', end);
    return text.substr(begin == std::string::npos ? 0 : begin + 1,
                       end - (begin == std::string::npos ? 0 : begin + 1) + 1);
}

std::string without(const std::string& text, const std::string& begin) {
    return text.starts_with(begin) ? text.substr(begin.size()) : text;
}

// Wakes where a process ends.
class ChildSignals {
public:
    ChildSignals() {
        sigemptyset(&set_);
        sigaddset(&set_, SIGCHLD);
        pthread_sigmask(SIG_BLOCK, &set_, &before_);
    }
    ~ChildSignals() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
    void wait() const {
        const timespec most{0, 200'000'000};
        sigtimedwait(&set_, nullptr, &most);
    }

private:
    sigset_t set_{}, before_{};
};

class Baking {
public:
    Baking(const Crew& crew, const Shelf& shelf, const std::function<Result<void>(Record)>& done,
           const Progress& progress)
        : crew_(crew), shelf_(shelf), done_(done), progress_(progress) {}

    Result<void> all(std::span<const Job> jobs) {
        for (const Job& job : jobs) {
            waiting_.push_back({job, job.item->memory, 0, {}});
            cost_ += job.item->cost;
        }
        waiting_.sort([](const Waiting& a, const Waiting& b) { return a.job.item->cost > b.job.item->cost; });
        const ChildSignals signals;
        while (!waiting_.empty() || !running_.empty()) {
            if (progress_.stopped()) return stop();
            if (auto good = start_some(); !good) return good;
            signals.wait();
            if (auto good = collect(); !good) return good;
            progress_.at("library", cost_ > 0 ? std::min(1.0, baked_cost_ / cost_) : 1.0);
        }
        return {};
    }

private:
    uint64_t share_of(const Waiting& one) const { return std::min(one.memory, crew_.memory); }

    std::list<Waiting>::iterator next_to_start() {
        const auto now = Clock::now();
        return std::ranges::find_if(waiting_, [&](const Waiting& one) {
            return one.not_before <= now && (running_.empty() || used_memory_ + share_of(one) <= crew_.memory);
        });
    }

    Result<void> start_some() {
        while (used_cores_ < crew_.cores) {
            const auto next = next_to_start();
            if (next == waiting_.end()) break;
            Waiting one = *next;
            waiting_.erase(next);
            if (auto good = start(one); !good) return good;
        }
        return {};
    }

    // As many as are free, where nothing else will want them.
    unsigned threads_for(const Waiting& one) const {
        const unsigned free = crew_.cores - used_cores_;
        if (used_memory_ + share_of(one) + least_bake_memory / 4 > crew_.memory) return free;
        return std::max<unsigned>(1, free / static_cast<unsigned>(std::min<size_t>(free, waiting_.size() + 1)));
    }

    std::vector<std::string> words_for(const Waiting& one, unsigned threads) const {
        const Item& item = *one.job.item;
        std::vector<std::string> words = {"bake",        "--json",
                                          "-o",          shelf_.asset_of(item.name),
                                          "--thumbnail", shelf_.thumbnail_of(item.name),
                                          "--threads",   std::to_string(threads)};
        if (crew_.memory_given && one.memory > crew_.memory) {
            words.insert(words.end(), {"--memory", std::to_string(std::max(crew_.memory, least_bake_memory) >> 20)});
        }
        words.insert(words.end(), crew_.words.begin(), crew_.words.end());
        words.insert(words.end(), one.job.recipe->words.begin(), one.job.recipe->words.end());
        words.insert(words.end(), {"--", item.path.string()});
        return words;
    }

    Result<void> start(Waiting one) {
        for (const fs::path& file : {shelf_.asset_of(one.job.item->name), shelf_.thumbnail_of(one.job.item->name)}) {
            std::error_code error;
            fs::create_directories(file.parent_path(), error);
            if (error)
                return fail(Fault::machine, file.parent_path().string() + ": cannot be made: " + error.message());
        }
        const unsigned threads = threads_for(one);
        auto child = Child::start(crew_.program, words_for(one, threads));
        if (!child) return tl::unexpected(child.error());
        used_cores_ += threads;
        used_memory_ += share_of(one);
        ++one.tries;
        const Stamp source = stamp_of(one.job.item->path);
        running_.push_back({one, threads, source, std::move(*child)});
        return {};
    }

    Result<void> collect() {
        for (auto one = running_.begin(); one != running_.end();) {
            auto ended = one->child.ended();
            if (!ended) {
                ++one;
                continue;
            }
            used_cores_ -= one->threads;
            used_memory_ -= share_of(one->of);
            auto good = settle(*one, *ended);
            one = running_.erase(one);
            if (!good) return good;
        }
        return {};
    }

    Result<void> settle(const Running& one, const Ended& ended) {
        if (may_be_tried_again(ended.code) && one.of.tries < most_tries) {
            Waiting again = one.of;
            again.not_before = Clock::now() + std::chrono::milliseconds(500) * again.tries;
            if (ended.code == 137) again.memory *= 2;
            waiting_.push_front(again);
            return {};
        }
        baked_cost_ += one.of.job.item->cost;
        return done_(record_of(one, ended));
    }

    Record record_of(const Running& one, const Ended& ended) const {
        const Item& item = *one.of.job.item;
        Record record;
        if (auto found = ended.code == 0 ? shelf_.from_asset(item, *one.of.job.recipe) : std::nullopt) {
            record = std::move(*found);
        } else {
            record.outcome = ended.code == 3                  ? Outcome::refused
                             : may_be_tried_again(ended.code) ? Outcome::again
                             : ended.code == 0                ? Outcome::again  // the mesh has changed meanwhile
                                                              : Outcome::failed;
            record.name = item.name;
            record.path = item.path;
            record.recipe = one.of.job.recipe->hash.hex();
            record.message = without(last_line(ended.err), "lodestone: ");
            record.source = one.source;
            shelf_.add_sources(record, *one.of.job.recipe);
        }
        record.code = ended.code;
        record.tries = one.of.tries;
        record.seconds = ended.seconds;
        record.cpu_seconds = ended.cpu_seconds;
        record.peak_rss_bytes = ended.peak_rss_bytes;
        if (record.message.empty() && ended.code > 128)
            record.message = "ended by signal " + std::to_string(ended.code - 128);
        const Json report = Json::parse(ended.out, nullptr, false);
        if (report.is_object()) record.warnings = report.value("warnings", std::vector<std::string>());
        return record;
    }

    // Bakes stop by themselves, soon; what was ready is recorded.
    Result<void> stop() {
        for (const Running& one : running_) one.child.signal(SIGTERM);
        const auto until = Clock::now() + patience;
        const ChildSignals signals;
        while (!running_.empty() && Clock::now() < until) {
            for (auto one = running_.begin(); one != running_.end();) {
                const auto ended = one->child.ended();
                if (ended && (ended->code == 0 || ended->code == 3)) {
                    if (auto good = done_(record_of(*one, *ended)); !good) return good;
                }
                one = ended ? running_.erase(one) : std::next(one);
            }
            if (!running_.empty()) signals.wait();
        }
        running_.clear();
        return fail(Fault::interrupted, "interrupted; the same command goes on");
    }

    const Crew& crew_;
    const Shelf& shelf_;
    const std::function<Result<void>(Record)>& done_;
    const Progress& progress_;
    std::list<Waiting> waiting_;
    std::list<Running> running_;
    unsigned used_cores_ = 0;
    uint64_t used_memory_ = 0;
    double cost_ = 0, baked_cost_ = 0;
};

}  // namespace

Result<void> bake_all(const Crew& crew, const Shelf& shelf, std::span<const Job> jobs,
                      const std::function<Result<void>(Record)>& done, const Progress& progress) {
    return Baking(crew, shelf, done, progress).all(jobs);
}

}  // namespace lodestone
