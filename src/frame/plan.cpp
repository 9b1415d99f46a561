#include "frame/plan.h"

#include <cstring>
#include <sstream>

namespace lodestone {

const char* name_of(Stage stage) {
    static constexpr const char* names[stage_count] = {"update", "shadow", "depth", "effect", "colour", "composite"};
    return names[static_cast<int>(stage)];
}

Blob::Blob(std::vector<std::byte> bytes) {
    const auto owner = std::make_shared<const std::vector<std::byte>>(std::move(bytes));
    data_ = owner->data();
    size_ = owner->size();
    owner_ = owner;
}

Blob::Blob(std::shared_ptr<const void> owner, const std::byte* data, size_t size)
    : owner_(std::move(owner)), data_(data), size_(size) {}

bool Blob::operator==(const Blob& other) const {
    return size_ == other.size_ && (size_ == 0 || data_ == other.data_ || std::memcmp(data_, other.data_, size_) == 0);
}

namespace {

template <class... Visitors>
struct Overloaded : Visitors... {
    using Visitors::operator()...;
};
template <class... Visitors>
Overloaded(Visitors...) -> Overloaded<Visitors...>;

void print(std::ostream& out, const Words& words) {
    out << " words";
    for (const uint32_t word : words) out << ' ' << word;
}

void print(std::ostream& out, const Draw& d) {
    out << "draw pipeline " << d.pipeline << " view " << d.view << " vertices " << static_cast<int32_t>(d.vertex_buffer)
        << '+' << d.vertex_offset << " indices " << static_cast<int32_t>(d.index_buffer) << '+' << d.index_offset
        << " count " << d.count << " from " << d.first_vertex << " ids " << d.first_id << '+' << d.instances;
    print(out, d.words);
}

void print(std::ostream& out, const Dispatch& d) {
    out << "dispatch pipeline " << d.pipeline << " groups ";
    if (d.arguments != no_buffer) {
        out << "of buffer " << d.arguments << '+' << d.offset;
    } else {
        out << d.groups[0] << 'x' << d.groups[1] << 'x' << d.groups[2];
    }
    out << " view " << d.view;
    print(out, d.words);
}

}  // namespace

std::string dump(const Plan& plan) {
    std::ostringstream out;
    out << "generation " << plan.generation << '\n';
    for (const Command& command : plan.commands) {
        out << name_of(command.stage) << ": ";
        std::visit(Overloaded{
                       [&](const Upload& u) {
                           out << "upload buffer " << u.buffer << '+' << u.offset << " bytes " << u.blob.size()
                               << " hash " << hash_bytes({u.blob.data(), u.blob.size()}).hex();
                       },
                       [&](const Copy& c) {
                           out << "copy buffer " << c.source << '+' << c.source_offset << " to " << c.destination << '+'
                               << c.destination_offset << " bytes " << c.bytes;
                       },
                       [&](const Resize& r) {
                           out << "resize buffer " << r.buffer << " to " << r.bytes << " keep " << r.kept;
                       },
                       [&](const Dispatch& d) { print(out, d); },
                       [&](const Draw& d) { print(out, d); },
                       [&](const DrawIndirect& d) {
                           out << "indirect buffer " << d.arguments << '+' << d.offset << " draws " << d.draws
                               << " stride " << d.stride << " count " << static_cast<int32_t>(d.count_buffer) << '+'
                               << d.count_offset << ' ';
                           print(out, d.draw);
                       },
                       [&](const Readback& r) {
                           out << "readback buffer " << r.buffer << '+' << r.offset << " bytes " << r.bytes << " tag "
                               << r.tag;
                       },
                   },
                   command.what);
        out << '\n';
    }
    out << "instances";
    for (const uint32_t id : plan.instance_ids) out << ' ' << id;
    out << '\n';
    for (const PageRequest& r : plan.requests) {
        out << "request " << r.id << " asset " << r.asset << " chunk " << r.chunk << '+' << r.offset << " bytes "
            << r.bytes << " priority " << r.priority << '\n';
    }
    return out.str();
}

Hash128 hash_of_plan(const Plan& plan) {
    const std::string text = dump(plan);
    return hash_of(std::span(text.data(), text.size()));
}

}  // namespace lodestone
