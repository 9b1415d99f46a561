// OFF (Geomview): OFF, COFF, NOFF, STOFF and their combinations, as text.
#include "mesh/io/formats.h"
#include "mesh/io/text_cursor.h"

namespace lodestone {

Result<TriMesh> read_off(const SourceFile& file, ReadReport& report) {
    TextCursor cursor(file.text(), '#');
    std::string keyword(cursor.word_anywhere());
    const size_t off = keyword.rfind("OFF");
    if (off == std::string::npos || off + 3 != keyword.size())
        return file.wrong_line(cursor.line(), "does not begin with OFF");
    const std::string prefix = keyword.substr(0, off);
    const bool uvs = prefix.find("ST") != std::string::npos, colours = prefix.find('C') != std::string::npos,
               normals = prefix.find('N') != std::string::npos;
    if (prefix.find('4') != std::string::npos || prefix.find('n') != std::string::npos)
        return file.wrong_line(1, "'" + keyword + "' is of other than three dimensions; not read");
    const auto integer = [&](int64_t& value) { return TextCursor::parse(cursor.word_anywhere(), value); };
    int64_t counts[3] = {};
    std::string_view first = cursor.word_anywhere();
    if (first == "BINARY") return file.wrong_line(1, "binary OFF is not read; save it as text");
    if (!TextCursor::parse(first, counts[0]) || !integer(counts[1]) || !integer(counts[2]) || counts[0] < 0 ||
        counts[1] < 0) {
        return file.wrong_line(cursor.line(), "needs three counts: vertices, faces, edges");
    }
    // A vertex is at least "0 0 0" and a face at least "3 0 1 2".
    if (static_cast<uint64_t>(counts[0]) > cursor.left() / 5 || static_cast<uint64_t>(counts[1]) > cursor.left() / 3) {
        return file.wrong_line(cursor.line(), "promises " + std::to_string(counts[0]) + " vertices and " +
                                                  std::to_string(counts[1]) + " faces, and only " +
                                                  std::to_string(cursor.left()) +
                                                  " bytes follow; the file is cut or its header is wrong");
    }
    if (counts[0] == 0 || counts[1] == 0)
        return file.wrong_line(cursor.line(), "has no vertices or no faces; there is nothing to read");

    TriMesh mesh;
    const auto floats = [&](float* values, int count) {
        for (int k = 0; k < count; ++k) {
            if (!TextCursor::parse(cursor.word_anywhere(), values[k])) return false;
        }
        return true;
    };
    for (int64_t v = 0; v < counts[0]; ++v) {
        glm::vec3 p, n;
        if (!floats(&p.x, 3) || (normals && !floats(&n.x, 3)))
            return file.wrong_line(cursor.line(), "vertex " + std::to_string(v) +
                                                      " is not all numbers; the file is cut or its header is wrong");
        if (!finite(p))
            return file.wrong_line(cursor.line(), "vertex " + std::to_string(v) +
                                                      " has a coordinate that is not finite; mend or remove it");
        mesh.positions.push_back(p);
        if (normals) {
            const float length = std::sqrt(n.x * n.x + n.y * n.y + n.z * n.z);
            mesh.normals.push_back(length > 0 && std::isfinite(length) ? n / length : glm::vec3(0, 0, 1));
        }
        if (colours) {
            // Three or four numbers up to the end of the line, 0 .. 255 or, with a point, 0 .. 1.
            float c[4] = {0, 0, 0, -1};
            bool fractions = false;
            for (float& channel : c) {
                const std::string_view word = cursor.word();
                if (word.empty()) break;
                if (!TextCursor::parse(word, channel))
                    return file.wrong_line(cursor.line(),
                                           "vertex " + std::to_string(v) + " has a colour that is no number");
                fractions = fractions || word.find('.') != std::string_view::npos;
            }
            if (c[3] < 0) c[3] = fractions ? 1 : 255;
            const auto byte = [&](float x) {
                return static_cast<uint8_t>(std::clamp(fractions ? x * 255 : x, 0.0f, 255.0f) + 0.5f);
            };
            mesh.colours.emplace_back(byte(c[0]), byte(c[1]), byte(c[2]), byte(c[3]));
        }
        if (uvs) {
            glm::vec2 uv;
            if (!floats(&uv.x, 2))
                return file.wrong_line(cursor.line(), "vertex " + std::to_string(v) + " lacks texture coordinates");
            mesh.uvs.emplace_back(std::isfinite(uv.x) && std::isfinite(uv.y) ? glm::vec2(uv.x, 1 - uv.y)
                                                                             : glm::vec2(0));
        }
    }
    std::vector<uint32_t> fan;
    for (int64_t f = 0; f < counts[1]; ++f) {
        int64_t corners = 0;
        if (!integer(corners) || corners < 0 || static_cast<uint64_t>(corners) > cursor.left()) {
            return file.wrong_line(
                cursor.line(),
                "face " + std::to_string(f) + " has no count of corners; the file is cut or its header is wrong");
        }
        fan.clear();
        for (int64_t k = 0; k < corners; ++k) {
            int64_t index = 0;
            if (!integer(index))
                return file.wrong_line(
                    cursor.line(),
                    "face " + std::to_string(f) + " is not all numbers; the file is cut or its header is wrong");
            if (index < 0 || index >= counts[0]) {
                return file.wrong_line(cursor.line(), "face " + std::to_string(f) + " refers to vertex " +
                                                          std::to_string(index) + "; the file has " +
                                                          std::to_string(counts[0]));
            }
            fan.push_back(static_cast<uint32_t>(index));
        }
        add_fan(mesh.triangles, fan, report);
        if (f + 1 < counts[1]) cursor.next_line();  // a face's colour
    }
    mesh.set_identity_wedges();
    return mesh;
}

}  // namespace lodestone
