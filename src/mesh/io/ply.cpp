// PLY: Turk, "The PLY polygon file format", 1994. ascii, binary of both byte orders, tristrips, any further elements
// and properties. Photogrammetry stores texture coordinates and textures with faces (`texcoord`, `texnumber`), and
// names of textures in comments (`TextureFile`), as MeshLab does.
#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <optional>
#include <utility>

#include "base/check.h"
#include "base/none.h"
#include "mesh/io/formats.h"
#include "mesh/io/text_cursor.h"

namespace lodestone {

namespace {

static_assert(std::endian::native == std::endian::little);

enum class Number : uint8_t { i8, u8, i16, u16, i32, u32, f32, f64 };
constexpr std::array<size_t, 8> number_bytes = {1, 1, 2, 2, 4, 4, 4, 8};

std::optional<Number> number_named(std::string_view name) {
    static constexpr std::pair<std::string_view, Number> names[] = {
        {"char", Number::i8},   {"int8", Number::i8},     {"uchar", Number::u8},   {"uint8", Number::u8},
        {"short", Number::i16}, {"int16", Number::i16},   {"ushort", Number::u16}, {"uint16", Number::u16},
        {"int", Number::i32},   {"int32", Number::i32},   {"uint", Number::u32},   {"uint32", Number::u32},
        {"float", Number::f32}, {"float32", Number::f32}, {"double", Number::f64}, {"float64", Number::f64}};
    for (const auto& [known, number] : names) {
        if (name == known) return number;
    }
    return std::nullopt;
}

// What a property means to us.
enum class Role : uint8_t {
    none,
    x,
    y,
    z,
    nx,
    ny,
    nz,
    u,
    v,
    red,
    green,
    blue,
    alpha,
    material,
    indices,
    corner_uvs,
    texture
};

struct Property {
    std::string name;
    Number type = Number::f32;
    std::optional<Number> count_type;  // of lists
    Role role = Role::none;
};

struct Element {
    std::string name;
    uint64_t count = 0;
    std::vector<Property> properties;
    size_t fixed_bytes = 0;  // of one item, 0 where lists make it vary
    size_t least_bytes = 0;  // of one item, in binary
    // Nothing in it matters, and it can be stepped over.
    bool role_free() const {
        return fixed_bytes > 0 && std::all_of(properties.begin(), properties.end(),
                                              [](const Property& p) { return p.role == Role::none; });
    }
    bool has(Role role) const {
        return std::any_of(properties.begin(), properties.end(), [&](const Property& p) { return p.role == role; });
    }
};

Role vertex_role(std::string_view name) {
    static constexpr std::pair<std::string_view, Role> roles[] = {{"x", Role::x},
                                                                  {"y", Role::y},
                                                                  {"z", Role::z},
                                                                  {"nx", Role::nx},
                                                                  {"ny", Role::ny},
                                                                  {"nz", Role::nz},
                                                                  {"u", Role::u},
                                                                  {"v", Role::v},
                                                                  {"s", Role::u},
                                                                  {"t", Role::v},
                                                                  {"texture_u", Role::u},
                                                                  {"texture_v", Role::v},
                                                                  {"red", Role::red},
                                                                  {"green", Role::green},
                                                                  {"blue", Role::blue},
                                                                  {"alpha", Role::alpha},
                                                                  {"diffuse_red", Role::red},
                                                                  {"diffuse_green", Role::green},
                                                                  {"diffuse_blue", Role::blue},
                                                                  {"material_index", Role::material}};
    for (const auto& [known, role] : roles) {
        if (name == known) return role;
    }
    return Role::none;
}

template <class T>
double load(const std::byte* at, bool swap) {
    std::array<std::byte, sizeof(T)> raw;
    std::memcpy(raw.data(), at, sizeof(T));
    if (swap) std::reverse(raw.begin(), raw.end());
    return static_cast<double>(std::bit_cast<T>(raw));
}

double load(Number type, const std::byte* at, bool swap) {
    switch (type) {
        case Number::i8:
            return load<int8_t>(at, false);
        case Number::u8:
            return load<uint8_t>(at, false);
        case Number::i16:
            return load<int16_t>(at, swap);
        case Number::u16:
            return load<uint16_t>(at, swap);
        case Number::i32:
            return load<int32_t>(at, swap);
        case Number::u32:
            return load<uint32_t>(at, swap);
        case Number::f32:
            return load<float>(at, swap);
        case Number::f64:
            return load<double>(at, swap);
    }
    return 0;
}

// Scale that brings a colour channel of this type to 0 .. 255.
double colour_scale(Number type) {
    switch (type) {
        case Number::f32:
        case Number::f64:
            return 255;
        case Number::u16:
        case Number::i16:
            return 255.0 / 65535;
        default:
            return 1;
    }
}

// What a triangle has, and its vertices may have otherwise.
struct OwnOfTriangle {
    std::array<glm::vec2, 3> uvs{};  // of its corners
    bool has_uvs = false;
    std::optional<uint16_t> texture;  // into the table of materials
};

class PlyStream final : public MeshStream {
public:
    PlyStream(const SourceFile& file, ReadReport& report) : file_(file), report_(report) {}

    Result<void> read_header() {
        TextCursor cursor(file_.text());
        if (cursor.word() != "ply") return file_.wrong_line(1, "does not begin with 'ply'");
        cursor.next_line();
        bool format_known = false;
        for (;;) {
            if (cursor.at_end())
                return file_.wrong_line(cursor.line(), "the header has no end_header; the file is cut or is no PLY");
            const std::string_view key = cursor.word();
            if (key == "end_header") break;
            if (key == "format") {
                const std::string_view kind = cursor.word();
                ascii_ = kind == "ascii";
                swap_ = kind == "binary_big_endian";
                if (!ascii_ && !swap_ && kind != "binary_little_endian")
                    return file_.wrong_line(cursor.line(), "unknown format '" + std::string(kind) + "'");
                format_known = true;
            } else if (key == "element") {
                Element element;
                element.name = cursor.word();
                int64_t count = 0;
                if (!cursor.number(count) || count < 0)
                    return file_.wrong_line(cursor.line(), "element '" + element.name + "' has no count");
                element.count = static_cast<uint64_t>(count);
                elements_.push_back(std::move(element));
            } else if (key == "property") {
                if (auto done = add_property(cursor); !done) return done;
            } else if (key == "comment") {
                if (cursor.word() == "TextureFile") texture_names_.emplace_back(cursor.rest());
            } else if (!key.empty() && key != "obj_info") {
                return file_.wrong_line(cursor.line(), "unknown header line '" + std::string(key) + "'");
            }
            cursor.next_line();
        }
        cursor.next_line();
        if (!format_known) return file_.wrong_line(cursor.line(), "the header names no format");
        at_ = static_cast<size_t>(cursor.position() - file_.text().data());
        text_line_ = cursor.line();
        return check_elements();
    }

    Size size() const override { return {vertices_, faces_, true}; }

    // Whether faces have texture coordinates of their own: with_corner_uvs() then makes the mesh what it is.
    bool has_corner_uvs() const { return has_corner_uvs_; }

    // Of the whole stream as one mesh: a wedge for every set of texture coordinates and texture at a vertex. Where a
    // face has none of its own, they are those of its vertices.
    void with_corner_uvs(TriMesh& mesh) const {
        LODE_CHECK(own_.size() == mesh.triangle_count(), own_.size(), mesh.triangle_count());
        const TriMesh plain = std::move(mesh);
        mesh = {};
        mesh.positions = plain.positions;
        mesh.material_table = plain.material_table;
        mesh.images = plain.images;
        const bool with_materials = !plain.material_table.empty();
        std::vector<uint32_t> first(plain.vertex_count(), none), next;  // wedges of a vertex, as a list
        for (size_t t = 0; t < plain.triangle_count(); ++t) {
            Triangle made;
            for (size_t k = 0; k < 3; ++k) {
                const uint32_t v = plain.triangles[t][k];
                const glm::vec2 uv = own_[t].has_uvs ? own_[t].uvs[k] : plain.uvs.empty() ? glm::vec2(0) : plain.uvs[v];
                const uint16_t material = with_materials ? own_[t].texture.value_or(plain.materials[v]) : uint16_t{0};
                uint32_t w = first[v];
                while (w != none && (mesh.uvs[w] != uv || (with_materials && mesh.materials[w] != material)))
                    w = next[w];
                if (w == none) {
                    w = static_cast<uint32_t>(mesh.wedge_vertex.size());
                    next.push_back(std::exchange(first[v], w));
                    mesh.wedge_vertex.push_back(v);
                    mesh.uvs.push_back(uv);
                    if (with_materials) mesh.materials.push_back(material);
                    if (!plain.normals.empty()) mesh.normals.push_back(plain.normals[v]);
                    if (!plain.colours.empty()) mesh.colours.push_back(plain.colours[v]);
                }
                made[k] = w;
            }
            mesh.triangles.push_back(made);
        }
    }

    void read_textures(bool decode) {
        TriMesh holder;
        for (size_t i = 0; i < texture_names_.size(); ++i) {
            materials_[i].name = texture_names_[i];
            if (decode)
                materials_[i].base_colour_texture.image = load_texture(file_, texture_names_[i], holder, report_);
        }
        images_ = std::move(holder.images);
    }

    Result<bool> next(MeshBatch& batch, size_t max_items) override {
        batch = {};
        batch_ = &batch;
        size_t budget = max_items;
        while (budget > 0 && element_ < elements_.size()) {
            const Element& element = elements_[element_];
            if (item_ == element.count) {
                ++element_;
                item_ = 0;
                continue;
            }
            const auto items = static_cast<size_t>(std::min<uint64_t>(budget, element.count - item_));
            auto done = ascii_ ? read_ascii(element, items) : read_binary(element, items);
            if (!done) return tl::unexpected(done.error());
            item_ += items;
            budget -= items;
        }
        // Faces may only be handed out once all vertices are.
        if (vertices_done_ == vertices_ && !early_faces_.empty()) {
            batch.triangles.insert(batch.triangles.begin(), early_faces_.begin(), early_faces_.end());
            early_faces_ = {};
        }
        return !batch.positions.empty() || !batch.triangles.empty() || element_ < elements_.size();
    }

    const std::vector<Material>& material_table() const override { return materials_; }
    const std::vector<Image>& images() const override { return images_; }

private:
    Result<void> add_property(TextCursor& cursor) {
        if (elements_.empty()) return file_.wrong_line(cursor.line(), "a property comes before any element");
        Property property;
        std::string_view type = cursor.word();
        if (type == "list") {
            property.count_type = number_named(cursor.word());
            if (!property.count_type || *property.count_type >= Number::f32)
                return file_.wrong_line(cursor.line(), "a list's count must be an integer type");
            type = cursor.word();
        }
        const auto number = number_named(type);
        if (!number) return file_.wrong_line(cursor.line(), "unknown type '" + std::string(type) + "'");
        property.type = *number;
        property.name = cursor.word();
        if (property.name.empty()) return file_.wrong_line(cursor.line(), "a property has no name");
        Element& element = elements_.back();
        if (element.name == "vertex" && !property.count_type) property.role = vertex_role(property.name);
        if ((element.name == "face" || element.name == "tristrips") && property.count_type &&
            (property.name == "vertex_indices" || property.name == "vertex_index")) {
            property.role = Role::indices;
        }
        if (element.name == "face" && property.count_type && property.name == "texcoord")
            property.role = Role::corner_uvs;
        if (element.name == "face" && !property.count_type && property.name == "texnumber")
            property.role = Role::texture;
        if (property.role != Role::none && element.has(property.role)) property.role = Role::none;
        element.properties.push_back(std::move(property));
        return {};
    }

    Result<void> check_elements() {
        size_t least = 0;  // bytes the body must have at least
        for (Element& element : elements_) {
            bool lists = false;
            for (const Property& p : element.properties) {
                const size_t bytes = number_bytes[static_cast<size_t>(p.count_type.value_or(p.type))];
                element.least_bytes += ascii_ ? 2 : bytes;
                lists = lists || p.count_type.has_value();
            }
            if (!lists) element.fixed_bytes = element.least_bytes;
            const size_t left = file_.size() - at_ + 1;  // the last number of a text needs no blank after it
            if (element.least_bytes > 0 && element.count > (left - std::min(left, least)) / element.least_bytes) {
                return file_.wrong("header", "promises " + std::to_string(element.count) + " of element '" +
                                                 element.name + "', and only " + std::to_string(left - 1) +
                                                 " bytes follow; the file is cut or its header is wrong");
            }
            if (element.least_bytes == 0) element.count = 0;
            least += element.count * element.least_bytes;
            if (element.name == "vertex") {
                if (vertex_element_ != nullptr) return file_.wrong("header", "has two vertex elements");
                vertex_element_ = &element;
                vertices_ = element.count;
                if (!element.has(Role::x) || !element.has(Role::y) || !element.has(Role::z))
                    return file_.wrong("header", "vertices have no x, y and z");
                has_normals_ = element.has(Role::nx) && element.has(Role::ny) && element.has(Role::nz);
                has_uvs_ = element.has(Role::u) && element.has(Role::v);
                has_colours_ = element.has(Role::red) && element.has(Role::green) && element.has(Role::blue);
                has_materials_ = element.has(Role::material);
            } else if (element.has(Role::indices)) {
                faces_ += element.count;
            }
            has_corner_uvs_ = has_corner_uvs_ || (element.has(Role::indices) && element.has(Role::corner_uvs));
        }
        if (vertex_element_ == nullptr || vertices_ == 0)
            return file_.wrong("header", "has no vertices; there is nothing to read");
        if (faces_ == 0) return file_.wrong("header", "has no faces; point clouds are not read");
        if (auto done = file_.within("vertices", vertices_, file_.limits.vertices); !done) return done;
        if (texture_names_.size() > file_.limits.materials)
            return file_.wrong("header", over_limit("textures", texture_names_.size(), file_.limits.materials));
        has_materials_ = has_materials_ || !texture_names_.empty();
        if (has_materials_) materials_.resize(std::max<size_t>(1, texture_names_.size()));
        return {};
    }

    std::string place(const Element& element, uint64_t item) const { return element.name + " " + std::to_string(item); }

    struct Vertex {
        glm::vec3 position{0}, normal{0};
        glm::vec2 uv{0};
        glm::vec4 colour{0, 0, 0, 255};
        uint32_t material = 0;
        void set(const Property& p, double value) {
            const auto f = static_cast<float>(value);
            const auto channel = [&] { return static_cast<float>(value * colour_scale(p.type)); };
            switch (p.role) {
                case Role::x:
                    position.x = f;
                    break;
                case Role::y:
                    position.y = f;
                    break;
                case Role::z:
                    position.z = f;
                    break;
                case Role::nx:
                    normal.x = f;
                    break;
                case Role::ny:
                    normal.y = f;
                    break;
                case Role::nz:
                    normal.z = f;
                    break;
                case Role::u:
                    uv.x = f;
                    break;
                case Role::v:
                    uv.y = f;
                    break;
                case Role::red:
                    colour.x = channel();
                    break;
                case Role::green:
                    colour.y = channel();
                    break;
                case Role::blue:
                    colour.z = channel();
                    break;
                case Role::alpha:
                    colour.w = channel();
                    break;
                case Role::material:
                    material = value >= 0 && value <= 65535 ? static_cast<uint32_t>(value) : 0;
                    break;
                default:
                    break;
            }
        }
    };

    Result<void> add(const Vertex& v) {
        if (!finite(v.position))
            return file_.wrong("vertex " + std::to_string(vertices_done_),
                               "has a coordinate that is not finite; mend or remove it");
        batch_->positions.push_back(v.position);
        if (has_normals_) {
            const float length = std::sqrt(v.normal.x * v.normal.x + v.normal.y * v.normal.y + v.normal.z * v.normal.z);
            batch_->normals.push_back(length > 0 && std::isfinite(length) ? v.normal / length : glm::vec3(0, 0, 1));
        }
        // PLY's texture origin is at the bottom, ours at the top.
        if (has_uvs_)
            batch_->uvs.push_back(std::isfinite(v.uv.x) && std::isfinite(v.uv.y) ? glm::vec2(v.uv.x, 1 - v.uv.y)
                                                                                 : glm::vec2(0));
        if (has_colours_) {
            const auto byte = [](float c) { return static_cast<uint8_t>(c >= 0 ? std::min(c, 255.0f) + 0.5f : 0.0f); };
            batch_->colours.emplace_back(byte(v.colour.x), byte(v.colour.y), byte(v.colour.z), byte(v.colour.w));
        }
        if (has_materials_) {
            batch_->materials.push_back(static_cast<uint16_t>(v.material));
            if (v.material >= materials_.size()) materials_.resize(v.material + 1);
        }
        ++vertices_done_;
        return {};
    }

    // The one place where triangles are added: own_ is in step with them where it is needed.
    void add_triangle(const Triangle& triangle, const OwnOfTriangle& own = {}) {
        (vertices_done_ == vertices_ ? batch_->triangles : early_faces_).push_back(triangle);
        if (has_corner_uvs_) own_.push_back(own);
    }

    // corners_: as read. Faces of fewer than three corners are dropped.
    Result<void> add_face(const Element& element, uint64_t item) {
        const auto outside = [&](int64_t index) {
            return file_.wrong(place(element, item), "refers to vertex " + std::to_string(index) + "; the file has " +
                                                         std::to_string(vertices_));
        };
        if (element.name == "tristrips") {
            size_t run = 0;  // corners of this strip so far
            for (size_t i = 0; i < corners_.size(); ++i) {
                if (corners_[i] == -1) {
                    run = 0;
                    continue;
                }
                if (corners_[i] < 0 || static_cast<uint64_t>(corners_[i]) >= vertices_) return outside(corners_[i]);
                if (++run < 3) continue;
                const auto a = static_cast<uint32_t>(corners_[i - 2]), b = static_cast<uint32_t>(corners_[i - 1]),
                           c = static_cast<uint32_t>(corners_[i]);
                if (a == b || b == c || c == a) continue;  // a strip's stitches
                add_triangle(run % 2 == 1 ? Triangle{a, b, c} : Triangle{b, a, c});
            }
            return {};
        }
        fan_.clear();
        for (const int64_t index : corners_) {
            if (index < 0 || static_cast<uint64_t>(index) >= vertices_) return outside(index);
            fan_.push_back(static_cast<uint32_t>(index));
        }
        add_face_fan();
        return {};
    }

    // fan_: its corners. As add_fan(), with what the face has of its own.
    void add_face_fan() {
        if (fan_.size() > 3) ++report_.polygons;
        const auto uv_at = [&](size_t corner) {
            const glm::vec2 uv(face_uvs_[corner * 2], face_uvs_[corner * 2 + 1]);
            return std::isfinite(uv.x) && std::isfinite(uv.y) ? glm::vec2(uv.x, 1 - uv.y) : glm::vec2(0);
        };
        OwnOfTriangle own;
        own.has_uvs = face_uvs_.size() >= fan_.size() * 2;  // else it has too few numbers
        own.texture = face_texture_;
        for (size_t k = 2; k < fan_.size(); ++k) {
            if (own.has_uvs) own.uvs = {uv_at(0), uv_at(k - 1), uv_at(k)};
            add_triangle({fan_[0], fan_[k - 1], fan_[k]}, own);
        }
    }

    // The usual face: a byte, then three 32-bit indices.
    bool plain_triangles(const Element& element) const {
        return element.properties.size() == 1 && element.properties[0].role == Role::indices &&
               number_bytes[static_cast<size_t>(*element.properties[0].count_type)] == 1 &&
               number_bytes[static_cast<size_t>(element.properties[0].type)] == 4 &&
               element.properties[0].type < Number::f32 && element.name == "face" && !swap_;
    }

    tl::unexpected<Error> cut(const Element& element, uint64_t item) const {
        return file_.wrong(place(element, item), "the file ends inside it; the file is cut");
    }

    Result<void> read_binary(const Element& element, size_t items) {
        if (&element == vertex_element_ && element.fixed_bytes > 0) return read_vertices(element, items);
        if (element.role_free()) {
            if ((file_.size() - at_) / element.fixed_bytes < items) return cut(element, item_);
            at_ += items * element.fixed_bytes;
            return {};
        }
        const bool plain = plain_triangles(element);
        for (uint64_t item = item_; item < item_ + items; ++item) {
            if (plain && read_plain_triangle()) continue;
            if (auto done = read_item(element, item); !done) return done;
        }
        return {};
    }

    // A list of three 32-bit numbers of vertices and nothing else; false, with nothing read, where it is something
    // else.
    bool read_plain_triangle() {
        const std::byte* data = file_.content.bytes.data();
        if (file_.size() - at_ < 13 || data[at_] != std::byte{3}) return false;
        uint32_t i[3];
        std::memcpy(i, data + at_ + 1, 12);
        if (i[0] >= vertices_ || i[1] >= vertices_ || i[2] >= vertices_) return false;
        add_triangle({i[0], i[1], i[2]});
        at_ += 13;
        return true;
    }

    Result<void> read_item(const Element& element, uint64_t item) {
        Vertex vertex;
        bool has_indices = false;
        begin_face();
        for (const Property& p : element.properties) {
            if (p.count_type) {
                if (!read_list(p)) return cut(element, item);
                has_indices = has_indices || p.role == Role::indices;
                continue;
            }
            const size_t bytes = number_bytes[static_cast<size_t>(p.type)];
            if (file_.size() - at_ < bytes) return cut(element, item);
            const std::byte* from = file_.content.bytes.data() + at_;
            if (&element == vertex_element_) vertex.set(p, load(p.type, from, swap_));
            if (p.role == Role::texture) set_texture(load(p.type, from, swap_));
            at_ += bytes;
        }
        if (&element == vertex_element_) return add(vertex);
        return has_indices ? add_face(element, item) : Result<void>{};
    }

    void begin_face() {
        face_uvs_.clear();
        face_texture_.reset();
    }
    // One of a number that is not there is the first.
    void set_texture(double number) {
        const bool there = number >= 0 && number < static_cast<double>(materials_.size());
        face_texture_ = there ? static_cast<uint16_t>(number) : uint16_t{0};
    }

    // Indices go to corners_, texture coordinates to face_uvs_. False where the file ends before.
    bool read_list(const Property& p) {
        const std::byte* data = file_.content.bytes.data();
        const size_t end = file_.size(), bytes = number_bytes[static_cast<size_t>(p.type)],
                     count_bytes = number_bytes[static_cast<size_t>(*p.count_type)];
        if (end - at_ < count_bytes) return false;
        const double count = load(*p.count_type, data + at_, swap_);
        at_ += count_bytes;
        if (count < 0 || count * static_cast<double>(bytes) > static_cast<double>(end - at_)) return false;
        const auto length = static_cast<size_t>(count);
        if (p.role == Role::indices) {
            corners_.clear();
            for (size_t k = 0; k < length; ++k)
                corners_.push_back(static_cast<int64_t>(load(p.type, data + at_ + k * bytes, swap_)));
        }
        for (size_t k = 0; k < length && p.role == Role::corner_uvs; ++k)
            face_uvs_.push_back(static_cast<float>(load(p.type, data + at_ + k * bytes, swap_)));
        at_ += length * bytes;
        return true;
    }

    Result<void> read_vertices(const Element& element, size_t items) {
        const std::byte* data = file_.content.bytes.data();
        if ((file_.size() - at_) / element.fixed_bytes < items) return cut(element, item_);
        std::vector<std::pair<size_t, const Property*>> wanted;
        size_t offset = 0;
        bool plain_position = !swap_;
        size_t place_of_x = 0;
        for (const Property& p : element.properties) {
            if (p.role == Role::x) place_of_x = offset;
            if (p.role == Role::y) plain_position = plain_position && offset == place_of_x + 4;
            if (p.role == Role::z) plain_position = plain_position && offset == place_of_x + 8;
            if (p.role == Role::x || p.role == Role::y || p.role == Role::z)
                plain_position = plain_position && p.type == Number::f32;
            if (p.role != Role::none) wanted.emplace_back(offset, &p);
            offset += number_bytes[static_cast<size_t>(p.type)];
        }
        const bool only_position = plain_position && wanted.size() == 3;
        for (size_t i = 0; i < items; ++i, at_ += element.fixed_bytes) {
            Vertex vertex;
            if (plain_position) std::memcpy(&vertex.position, data + at_ + place_of_x, 12);
            if (!only_position) {
                for (const auto& [where, property] : wanted)
                    vertex.set(*property, load(property->type, data + at_ + where, swap_));
            }
            if (auto done = add(vertex); !done) return done;
        }
        return {};
    }

    Result<void> read_ascii(const Element& element, size_t items) {
        TextCursor cursor(file_.text().substr(at_));
        const auto line = [&] { return text_line_ + cursor.line() - 1; };
        for (uint64_t item = item_; item < item_ + items; ++item) {
            Vertex vertex;
            bool has_indices = false;
            begin_face();
            for (const Property& p : element.properties) {
                if (!p.count_type) {
                    float value = 0;
                    const std::string_view word = cursor.word_anywhere();
                    if (!TextCursor::parse(word, value)) return bad_word(line(), word, element, item);
                    if (&element == vertex_element_) vertex.set(p, static_cast<double>(value));
                    if (p.role == Role::texture) set_texture(static_cast<double>(value));
                    continue;
                }
                int64_t count = 0;
                const std::string_view word = cursor.word_anywhere();
                if (!TextCursor::parse(word, count) || count < 0) return bad_word(line(), word, element, item);
                if (static_cast<uint64_t>(count) > cursor.left()) return cut(element, item);
                if (p.role == Role::indices) {
                    has_indices = true;
                    corners_.clear();
                }
                for (int64_t k = 0; k < count; ++k) {
                    const std::string_view entry = cursor.word_anywhere();
                    if (p.role != Role::indices) {
                        float value = 0;
                        const bool good = p.role == Role::corner_uvs ? TextCursor::parse(entry, value) : !entry.empty();
                        if (!good) return bad_word(line(), entry, element, item);
                        if (p.role == Role::corner_uvs) face_uvs_.push_back(value);
                        continue;
                    }
                    int64_t index = 0;
                    if (!TextCursor::parse(entry, index)) return bad_word(line(), entry, element, item);
                    corners_.push_back(index);
                }
            }
            if (&element == vertex_element_) {
                if (auto done = add(vertex); !done) return done;
            } else if (has_indices) {
                if (auto done = add_face(element, item); !done) return done;
            }
        }
        text_line_ = line();
        at_ = static_cast<size_t>(cursor.position() - file_.text().data());
        return {};
    }

    tl::unexpected<Error> bad_word(uint64_t line, std::string_view word, const Element& element, uint64_t item) const {
        if (word.empty()) return cut(element, item);
        return file_.wrong_line(line,
                                "'" + std::string(word.substr(0, 40)) + "' is no number of " + place(element, item));
    }

    SourceFile file_;
    ReadReport& report_;
    bool ascii_ = false, swap_ = false;
    std::vector<Element> elements_;
    const Element* vertex_element_ = nullptr;
    uint64_t vertices_ = 0, faces_ = 0, vertices_done_ = 0;
    bool has_normals_ = false, has_uvs_ = false, has_colours_ = false, has_materials_ = false;
    size_t at_ = 0;
    uint64_t text_line_ = 1;
    size_t element_ = 0;
    uint64_t item_ = 0;
    MeshBatch* batch_ = nullptr;
    std::vector<int64_t> corners_;
    std::vector<uint32_t> fan_;
    std::vector<Triangle> early_faces_;
    bool has_corner_uvs_ = false;
    std::vector<std::string> texture_names_;
    std::vector<float> face_uvs_;           // of the face being read
    std::optional<uint16_t> face_texture_;  // its texture
    std::vector<OwnOfTriangle> own_;        // one per triangle, in the order of the file, where has_corner_uvs_
    std::vector<Material> materials_;
    std::vector<Image> images_;
};

}  // namespace

Result<std::unique_ptr<MeshStream>> open_ply(const SourceFile& file, const ReadOptions& options, ReadReport& report) {
    auto stream = std::make_unique<PlyStream>(file, report);
    if (auto done = stream->read_header(); !done) return tl::unexpected(done.error());
    if (stream->has_corner_uvs()) return nullptr;
    stream->read_textures(options.load_images);
    return stream;
}

Result<TriMesh> read_ply(const SourceFile& file, const ReadOptions& options, ReadReport& report) {
    PlyStream stream(file, report);
    if (auto done = stream.read_header(); !done) return tl::unexpected(done.error());
    stream.read_textures(options.load_images);
    auto mesh = collect(stream);
    if (mesh && stream.has_corner_uvs()) stream.with_corner_uvs(*mesh);
    return mesh;
}

Result<void> name_files_of_ply(const SourceFile& file, const ReadOptions& options, ReadReport& report) {
    PlyStream stream(file, report);
    if (auto done = stream.read_header(); !done) return done;
    stream.read_textures(options.load_images);
    return {};
}

}  // namespace lodestone
