#include "mesh/io/compressed/draco.h"

#include <draco/compression/decode.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <string>

#include "base/sanitized.h"

namespace lodestone {

namespace {

constexpr uint64_t bytes_per_element = 512;  // of a vertex or a triangle, while it is decoded
constexpr double elements_per_second = 1e5;  // at least
constexpr uint64_t most_per_byte = 4096;     // elements of a byte that are believed
constexpr size_t most_words = 200;           // of what the decoder says

// Memory that both processes see: state, words, indices, values.
struct Shared {
    enum State : uint32_t { running, refused, done };
    uint32_t state = running;
    char words[most_words] = {};
    float* values(uint64_t indices) { return reinterpret_cast<float*>(this->indices() + indices); }
    uint32_t* indices() { return reinterpret_cast<uint32_t*>(this + 1); }
};

uint64_t values_of(const DracoPromise& promise) {
    uint64_t components = 0;
    for (const auto& attribute : promise.attributes) components += attribute.components;
    return components * promise.vertices;
}

// Returns what is wrong, or nothing.
std::string decode_into(std::span<const unsigned char> bytes, const DracoPromise& promise, Shared& shared) {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    draco::Decoder decoder;
    auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
    if (!decoded.ok()) return std::string("Draco: ") + decoded.status().error_msg();
    const std::unique_ptr<draco::Mesh> mesh = std::move(decoded).value();
    if (mesh->num_points() != promise.vertices || uint64_t{mesh->num_faces()} * 3 != promise.indices)
        return "Draco holds " + std::to_string(mesh->num_points()) + " vertices and " +
               std::to_string(mesh->num_faces()) + " triangles; the accessors say " + std::to_string(promise.vertices) +
               " and " + std::to_string(promise.indices / 3);
    uint32_t* index = shared.indices();
    for (uint32_t f = 0; f < mesh->num_faces(); ++f) {
        for (const draco::PointIndex& point : mesh->face(draco::FaceIndex(f))) *index++ = point.value();
    }
    float* value = shared.values(promise.indices);
    for (const auto& wanted : promise.attributes) {
        const draco::PointAttribute* attribute = mesh->GetAttributeByUniqueId(wanted.id);
        if (attribute == nullptr) return "Draco has no attribute " + std::to_string(wanted.id);
        double scale = 1;
        if (wanted.normalised && !attribute->normalized()) {
            const int bits = 8 * draco::DataTypeLength(attribute->data_type());
            const bool is_signed =
                attribute->data_type() == draco::DT_INT8 || attribute->data_type() == draco::DT_INT16;
            if (draco::IsDataTypeIntegral(attribute->data_type()))
                scale = 1 / static_cast<double>((uint64_t{1} << (is_signed ? bits - 1 : bits)) - 1);
        }
        for (uint32_t p = 0; p < promise.vertices; ++p, value += wanted.components) {
            const auto at = attribute->mapped_index(draco::PointIndex(p));
            if (!attribute->ConvertValue(at, static_cast<int8_t>(wanted.components), value))
                return "Draco has an attribute of another kind than the accessor";
            for (uint32_t k = 0; k < wanted.components; ++k)
                value[k] = static_cast<float>(static_cast<double>(value[k]) * scale);
        }
    }
    return {};
}

// bytes: of the compressed mesh, which cannot make any number of triangles.
void limit_process(const DracoPromise& promise, uint64_t bytes, const DracoLimits& limits) {
    const uint64_t elements = std::min(promise.vertices + promise.indices / 3, most_per_byte * bytes);
    if constexpr (!LODE_SANITIZED) {
        // Of the address space, besides what is mapped already. Sanitizers map terabytes.
        uint64_t pages = 0;
        if (std::FILE* file = std::fopen("/proc/self/statm", "r")) {
            unsigned long long read = 0;
            if (std::fscanf(file, "%llu", &read) == 1) pages = read;
            std::fclose(file);
        }
        const uint64_t mapped = pages * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
        const rlimit memory{mapped + limits.memory_bytes + bytes_per_element * elements, RLIM_INFINITY};
        setrlimit(RLIMIT_AS, &memory);
    }
    const auto seconds = static_cast<rlim_t>(limits.seconds + static_cast<double>(elements) / elements_per_second + 1);
    const rlimit time{seconds, seconds + 1};
    setrlimit(RLIMIT_CPU, &time);
    const rlimit no_core{0, 0};
    setrlimit(RLIMIT_CORE, &no_core);
    alarm(static_cast<unsigned>(std::min<rlim_t>(seconds * 20, 1u << 30)));  // where it waits
}

[[noreturn]] void decode_and_end(std::span<const unsigned char> bytes, const DracoPromise& promise,
                                 const DracoLimits& limits, Shared& shared) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    for (const int signal : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGALRM, SIGXCPU, SIGTERM, SIGINT})
        std::signal(signal, SIG_DFL);
    limit_process(promise, bytes.size(), limits);
    std::string wrong;
    try {
        wrong = decode_into(bytes, promise, shared);
    } catch (const std::bad_alloc&) {
        wrong = "Draco takes more memory than so many vertices and triangles need";
    } catch (const std::exception& e) { wrong = std::string("Draco: ") + e.what(); }
    std::replace(wrong.begin(), wrong.end(), '\n', ' ');
    std::strncpy(shared.words, wrong.c_str(), most_words - 1);
    shared.state = wrong.empty() ? Shared::done : Shared::refused;
    _exit(0);
}

// Memory that goes with the object.
class SharedMemory {
public:
    explicit SharedMemory(uint64_t bytes) : bytes_(bytes) {
        void* made = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
        if (made != MAP_FAILED) at_ = new (made) Shared;
    }
    ~SharedMemory() {
        if (at_ != nullptr) munmap(at_, bytes_);
    }
    SharedMemory(const SharedMemory&) = delete;
    SharedMemory& operator=(const SharedMemory&) = delete;
    Shared* get() const { return at_; }

private:
    uint64_t bytes_;
    Shared* at_ = nullptr;
};

// Waits for the process; what its death says, or nothing.
std::string death_of(pid_t child) {
    int status = 0;
    while (waitpid(child, &status, 0) < 0) {
        if (errno != EINTR) return "its decoder was lost";
    }
    if (!WIFSIGNALED(status)) return WEXITSTATUS(status) == 0 ? "" : "the decoder of Draco failed";
    const int signal = WTERMSIG(status);
    if (signal == SIGXCPU || signal == SIGALRM) return "the decoder of Draco takes longer than so many triangles need";
    return "the decoder of Draco crashed (signal " + std::to_string(signal) + ")";
}

}  // namespace

Result<DracoMesh> decode_draco(std::span<const unsigned char> bytes, const DracoPromise& promise,
                               const DracoLimits& limits) {
    const uint64_t values = values_of(promise);
    const SharedMemory memory(sizeof(Shared) + 4 * (promise.indices + values));
    if (memory.get() == nullptr) return fail(Fault::machine, "there is no memory for a mesh that Draco compressed");
    Shared& shared = *memory.get();
    const pid_t child = fork();
    if (child < 0)
        return fail(Fault::machine, std::string("the decoder of Draco cannot be started: ") + std::strerror(errno));
    if (child == 0) decode_and_end(bytes, promise, limits, shared);
    if (const std::string death = death_of(child); !death.empty())
        return fail(Fault::format, death + "; the file is damaged");
    if (shared.state != Shared::done) {
        shared.words[most_words - 1] = 0;
        return fail(Fault::format, shared.words);
    }
    DracoMesh mesh;
    mesh.indices.assign(shared.indices(), shared.indices() + promise.indices);
    if (std::ranges::any_of(mesh.indices, [&](uint32_t i) { return i >= promise.vertices; }))
        return fail(Fault::format, "Draco refers to a vertex that is not there");
    const float* from = shared.values(promise.indices);
    for (const auto& attribute : promise.attributes) {
        const uint64_t count = attribute.components * promise.vertices;
        mesh.values.emplace_back(from, from + count);
        from += count;
    }
    return mesh;
}

}  // namespace lodestone
