// STL, ascii and binary. Triangles come as soup: repair welds them.
#include <algorithm>
#include <cstring>

#include "mesh/io/formats.h"
#include "mesh/io/text_cursor.h"

namespace lodestone {

namespace {

constexpr size_t header_bytes = 84, facet_bytes = 50;

class BinaryStl final : public MeshStream {
public:
    BinaryStl(const SourceFile& file, uint32_t count) : file_(file), count_(count) {}
    Size size() const override { return {uint64_t{count_} * 3, count_, true}; }
    Result<bool> next(MeshBatch& batch, size_t max_items) override {
        batch = {};
        const auto facets = static_cast<uint32_t>(std::min<size_t>(std::max<size_t>(max_items / 4, 1), count_ - done_));
        for (uint32_t i = 0; i < facets; ++i, ++done_) {
            float corner[9];
            std::memcpy(corner, file_.content.bytes.data() + header_bytes + size_t{done_} * facet_bytes + 12,
                        sizeof corner);
            for (int k = 0; k < 3; ++k) {
                const glm::vec3 p(corner[3 * k], corner[3 * k + 1], corner[3 * k + 2]);
                if (!finite(p))
                    return file_.wrong("facet " + std::to_string(done_),
                                       "has a coordinate that is not finite; mend or remove it");
                batch.positions.push_back(p);
            }
            batch.triangles.push_back({done_ * 3, done_ * 3 + 1, done_ * 3 + 2});
        }
        return facets > 0;
    }
    const std::vector<Material>& material_table() const override { return materials_; }
    const std::vector<Image>& images() const override { return images_; }

private:
    SourceFile file_;
    uint32_t count_, done_ = 0;
    std::vector<Material> materials_;
    std::vector<Image> images_;
};

class AsciiStl final : public MeshStream {
public:
    explicit AsciiStl(const SourceFile& file) : file_(file), cursor_(file_.text()) {}
    // A facet takes about 250 bytes.
    Size size() const override { return {file_.size() / 250 * 3, file_.size() / 250, false}; }
    Result<bool> next(MeshBatch& batch, size_t max_items) override {
        batch = {};
        const size_t facets = std::max<size_t>(max_items / 4, 1);
        while (batch.triangles.size() < facets) {
            std::string_view key;
            // Names of solids may be any words, so the rest of such lines is not looked at.
            while (!cursor_.at_end() && (key = cursor_.word()) != "facet" && key != "FACET") cursor_.next_line();
            if (cursor_.at_end()) break;
            cursor_.next_line();
            if (auto done = read_facet(batch); !done) return tl::unexpected(done.error());
        }
        return !batch.triangles.empty();
    }
    const std::vector<Material>& material_table() const override { return materials_; }
    const std::vector<Image>& images() const override { return images_; }

private:
    Result<void> read_facet(MeshBatch& batch) {
        const uint64_t first_line = cursor_.line() - 1;
        int corners = 0;
        for (;;) {
            if (cursor_.at_end())
                return file_.wrong_line(first_line, "the file ends inside this facet; the file is cut");
            const std::string_view key = cursor_.word();
            if (key == "endfacet" || key == "ENDFACET") break;
            if (key == "vertex" || key == "VERTEX") {
                glm::vec3 p;
                if (!cursor_.number(p.x) || !cursor_.number(p.y) || !cursor_.number(p.z))
                    return file_.wrong_line(cursor_.line(), "a vertex needs three numbers");
                if (!finite(p))
                    return file_.wrong_line(cursor_.line(), "a coordinate is not finite; mend or remove it");
                if (++corners > 3) return file_.wrong_line(cursor_.line(), "a facet has more than three vertices");
                batch.positions.push_back(p);
            }
            cursor_.next_line();
        }
        if (corners != 3)
            return file_.wrong_line(cursor_.line(),
                                    "a facet has " + std::to_string(corners) + " vertices; it needs three");
        if (uint64_t{vertices_} + 3 > file_.limits.vertices)
            return file_.within("vertices", uint64_t{vertices_} + 3, file_.limits.vertices);
        batch.triangles.push_back({vertices_, vertices_ + 1, vertices_ + 2});
        vertices_ += 3;
        return {};
    }

    SourceFile file_;
    TextCursor cursor_;
    uint32_t vertices_ = 0;
    std::vector<Material> materials_;
    std::vector<Image> images_;
};

}  // namespace

Result<std::unique_ptr<MeshStream>> open_stl(const SourceFile& file, ReadReport&) {
    const size_t size = file.size();
    uint32_t count = 0;
    if (size >= header_bytes) std::memcpy(&count, file.content.bytes.data() + 80, 4);
    const bool fits = size >= header_bytes && size == header_bytes + uint64_t{count} * facet_bytes;
    const std::string_view text = file.text();
    // Binary files may begin with "solid" too: what fits its count is binary; what says facet early on is text.
    const bool says_facet = text.substr(0, 1024).find("facet") != std::string_view::npos ||
                            text.substr(0, 1024).find("FACET") != std::string_view::npos;
    if (!fits && says_facet) return std::make_unique<AsciiStl>(file);
    if (size < header_bytes) return file.wrong("", "is too short for an STL file");
    if (size < header_bytes + uint64_t{count} * facet_bytes) {
        return file.wrong("header", "promises " + std::to_string(count) + " facets and holds bytes for " +
                                        std::to_string((size - header_bytes) / facet_bytes) +
                                        "; the file is cut or its header is wrong");
    }
    if (count == 0) return file.wrong("header", "promises no facets; there is nothing to read");
    if (auto done = file.within("vertices", uint64_t{count} * 3, file.limits.vertices); !done)
        return tl::unexpected(done.error());
    return std::make_unique<BinaryStl>(file, count);
}

}  // namespace lodestone
