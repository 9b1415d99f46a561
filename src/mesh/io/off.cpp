// OFF (Geomview): OFF, COFF, NOFF, STOFF and their combinations, as text.
#include <tuple>

#include "mesh/io/formats.h"
#include "mesh/io/text_cursor.h"

namespace lodestone {

namespace {

class OffReader {
public:
    OffReader(const SourceFile& file, ReadReport& report) : file_(file), report_(report), cursor_(file.text(), '#') {}

    Result<TriMesh> read() {
        if (auto done = read_header(); !done) return tl::unexpected(done.error());
        if (auto done = read_counts(); !done) return tl::unexpected(done.error());
        for (int64_t v = 0; v < vertices_; ++v) {
            if (auto done = read_vertex("vertex " + std::to_string(v)); !done) return tl::unexpected(done.error());
        }
        for (int64_t f = 0; f < faces_; ++f) {
            if (auto done = read_face("face " + std::to_string(f)); !done) return tl::unexpected(done.error());
            if (f + 1 < faces_) cursor_.next_line();  // a face's colour
        }
        mesh_.set_identity_wedges();
        return std::move(mesh_);
    }

private:
    auto wrong(const std::string& what) const { return file_.wrong_line(cursor_.line(), what); }
    bool integer(int64_t& value) { return TextCursor::parse(cursor_.word_anywhere(), value); }
    bool floats(float* values, int count) {
        for (int k = 0; k < count; ++k) {
            if (!TextCursor::parse(cursor_.word_anywhere(), values[k])) return false;
        }
        return true;
    }

    // The keyword: what vertices have besides positions.
    Result<void> read_header() {
        const std::string keyword(cursor_.word_anywhere());
        const size_t off = keyword.rfind("OFF");
        if (off == std::string::npos || off + 3 != keyword.size()) return wrong("does not begin with OFF");
        const std::string prefix = keyword.substr(0, off);
        uvs_ = prefix.find("ST") != std::string::npos;
        colours_ = prefix.find('C') != std::string::npos;
        normals_ = prefix.find('N') != std::string::npos;
        if (prefix.find('4') != std::string::npos || prefix.find('n') != std::string::npos)
            return file_.wrong_line(1, "'" + keyword + "' is of other than three dimensions; not read");
        return {};
    }

    Result<void> read_counts() {
        int64_t edges = 0;
        const std::string_view first = cursor_.word_anywhere();
        if (first == "BINARY") return file_.wrong_line(1, "binary OFF is not read; save it as text");
        if (!TextCursor::parse(first, vertices_) || !integer(faces_) || !integer(edges) || vertices_ < 0 || faces_ < 0)
            return wrong("needs three counts: vertices, faces, edges");
        // A vertex is at least "0 0 0" and a face at least "3 0 1 2".
        const size_t left = cursor_.left();
        if (static_cast<uint64_t>(vertices_) > left / 5 || static_cast<uint64_t>(faces_) > left / 3) {
            return wrong("promises " + std::to_string(vertices_) + " vertices and " + std::to_string(faces_) +
                         " faces, and only " + std::to_string(left) +
                         " bytes follow; the file is cut or its header is wrong");
        }
        for (const auto& [what, number, limit] : {std::tuple("vertices", vertices_, file_.limits.vertices),
                                                  std::tuple("faces", faces_, file_.limits.triangles)}) {
            if (auto done = file_.within(what, static_cast<uint64_t>(number), limit); !done) return done;
        }
        if (vertices_ == 0 || faces_ == 0) return wrong("has no vertices or no faces; there is nothing to read");
        return {};
    }

    // name: for errors.
    Result<void> read_vertex(const std::string& name) {
        glm::vec3 p, n;
        if (!floats(&p.x, 3) || (normals_ && !floats(&n.x, 3)))
            return wrong(name + " is not all numbers; the file is cut or its header is wrong");
        if (!finite(p)) return wrong(name + " has a coordinate that is not finite; mend or remove it");
        mesh_.positions.push_back(p);
        if (normals_) {
            const float length = std::sqrt(n.x * n.x + n.y * n.y + n.z * n.z);
            mesh_.normals.push_back(length > 0 && std::isfinite(length) ? n / length : glm::vec3(0, 0, 1));
        }
        if (colours_) {
            if (auto done = read_colour(name); !done) return done;
        }
        if (uvs_) {
            glm::vec2 uv;
            if (!floats(&uv.x, 2)) return wrong(name + " lacks texture coordinates");
            mesh_.uvs.emplace_back(std::isfinite(uv.x) && std::isfinite(uv.y) ? glm::vec2(uv.x, 1 - uv.y)
                                                                              : glm::vec2(0));
        }
        return {};
    }

    // Three or four numbers up to the end of the line, 0 .. 255 or, with a point, 0 .. 1.
    Result<void> read_colour(const std::string& name) {
        float c[4] = {0, 0, 0, -1};
        bool fractions = false;
        for (float& channel : c) {
            const std::string_view word = cursor_.word();
            if (word.empty()) break;
            if (!TextCursor::parse(word, channel)) return wrong(name + " has a colour that is no number");
            fractions = fractions || word.find('.') != std::string_view::npos;
        }
        if (c[3] < 0) c[3] = fractions ? 1 : 255;
        const auto byte = [&](float x) {
            return static_cast<uint8_t>(std::clamp(fractions ? x * 255 : x, 0.0f, 255.0f) + 0.5f);
        };
        mesh_.colours.emplace_back(byte(c[0]), byte(c[1]), byte(c[2]), byte(c[3]));
        return {};
    }

    Result<void> read_face(const std::string& name) {
        int64_t corners = 0;
        if (!integer(corners) || corners < 0 || static_cast<uint64_t>(corners) > cursor_.left())
            return wrong(name + " has no count of corners; the file is cut or its header is wrong");
        fan_.clear();
        for (int64_t k = 0; k < corners; ++k) {
            int64_t index = 0;
            if (!integer(index)) return wrong(name + " is not all numbers; the file is cut or its header is wrong");
            if (index < 0 || index >= vertices_) {
                return wrong(name + " refers to vertex " + std::to_string(index) + "; the file has " +
                             std::to_string(vertices_));
            }
            fan_.push_back(static_cast<uint32_t>(index));
        }
        add_fan(mesh_.triangles, fan_, report_);
        if (mesh_.triangles.size() > file_.limits.triangles)
            return file_.within("triangles", mesh_.triangles.size(), file_.limits.triangles);
        return {};
    }

    const SourceFile& file_;
    ReadReport& report_;
    TextCursor cursor_;
    bool uvs_ = false, colours_ = false, normals_ = false;
    int64_t vertices_ = 0, faces_ = 0;
    TriMesh mesh_;
    std::vector<uint32_t> fan_;
};

}  // namespace

Result<TriMesh> read_off(const SourceFile& file, ReadReport& report) { return OffReader(file, report).read(); }

}  // namespace lodestone
