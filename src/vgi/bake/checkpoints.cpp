#include "vgi/bake/checkpoints.h"

#include <algorithm>
#include <cstring>

namespace lodestone::vgi {

namespace {

template <class T>
Result<void> put(ChunkWriter& writer, const char* name, const std::vector<T>& values) {
    return writer.add_array(name, std::span<const T>(values));
}
template <class T>
bool get(const ChunkFile& file, const char* name, std::vector<T>& values) {
    const auto found = file.array<T>(name);
    if (found) values.assign(found->begin(), found->end());
    return found.has_value();
}
// One value that is no array.
template <class T>
Result<void> put_one(ChunkWriter& writer, const char* name, const T& value) {
    return writer.add_array(name, std::span<const T>(&value, 1));
}
template <class T>
bool get_one(const ChunkFile& file, const char* name, T& value) {
    const auto found = file.array<T>(name);
    if (!found || found->size() != 1) return false;
    value = (*found)[0];
    return true;
}

// Every image of the atlas that is there, as (name, vector, first texel of every chart and the end).
template <class AtlasType, class Visit>
void for_images(AtlasType& atlas, Visit&& visit) {
    const std::vector<size_t>&texels = atlas.first_texel, &attributes = atlas.first_attribute_texel;
    visit("positions", atlas.positions, texels);
    visit("errors", atlas.sample_errors, texels);
    visit("radii", atlas.sample_radii, texels);
    visit("normals", atlas.normals, attributes);
    visit("uvs", atlas.uvs, attributes);
    visit("colours", atlas.colours, attributes);
    visit("surfaces", atlas.surfaces, attributes);
    visit("emissions", atlas.emissions, attributes);
    visit("materials", atlas.materials, attributes);
}

}  // namespace

Result<void> write_checkpoint(const Clusters& clusters, ChunkWriter& writer) {
    if (auto done = put(writer, "label", clusters.label); !done) return done;
    if (auto done = put(writer, "ready", clusters.ready); !done) return done;
    return put(writer, "counts", std::vector<uint32_t>{clusters.count, clusters.buckets});
}

std::optional<Clusters> read_clusters(const ChunkFile& file) {
    Clusters clusters;
    std::vector<uint32_t> counts;
    if (!get(file, "label", clusters.label) || !get(file, "ready", clusters.ready) || !get(file, "counts", counts) ||
        counts.size() != 2)
        return std::nullopt;
    clusters.count = counts[0];
    clusters.buckets = counts[1];
    return clusters;
}

Result<void> write_checkpoint(const StraightQuads& straight, ChunkWriter& writer) {
    const Quads& quads = straight.quads;
    if (auto done = put(writer, "positions", quads.surface.positions); !done) return done;
    if (auto done = put(writer, "triangles", quads.surface.triangles); !done) return done;
    if (auto done = put(writer, "places", quads.surface.places.entries()); !done) return done;
    if (auto done = put(writer, "label", quads.label); !done) return done;
    if (auto done = put(writer, "quads", quads.quads); !done) return done;
    if (auto done = put(writer, "failed", quads.failed); !done) return done;
    if (auto done = writer.add_text("fault", quads.fault); !done) return done;
    return put(writer, "counts",
               std::vector<uint32_t>{quads.uniform_clusters, straight.not_recentred, quads.surface.uncut});
}

std::optional<StraightQuads> read_quads(const ChunkFile& file) {
    StraightQuads straight;
    Quads& quads = straight.quads;
    std::vector<CutPlaces::Corners> places;
    std::vector<uint32_t> counts;
    if (!get(file, "positions", quads.surface.positions) || !get(file, "triangles", quads.surface.triangles) ||
        !get(file, "places", places) || !get(file, "label", quads.label) || !get(file, "quads", quads.quads) ||
        !get(file, "failed", quads.failed) || !get(file, "counts", counts) || counts.size() != 3)
        return std::nullopt;
    quads.surface.places = CutPlaces(std::move(places));
    if (const auto fault = file.text("fault")) quads.fault = *fault;
    quads.uniform_clusters = counts[0];
    straight.not_recentred = counts[1];
    quads.surface.uncut = counts[2];
    return straight;
}

namespace {

// Leaves of charts one after another.
struct StoredLeaves {
    std::vector<double> measured;  // of each leaf: error, radius, errors of its sides
    std::vector<uint32_t> squares, parts, sizes;
    std::vector<std::byte> bytes;
    size_t chart = 0, square = 0, part = 0, byte = 0;  // the next to take

    void add(const ChartLeaves& of) {
        squares.push_back(static_cast<uint32_t>(of.parts.size()));
        parts.insert(parts.end(), of.parts.begin(), of.parts.end());
        for (size_t i = 0; i < of.parts.size(); ++i) {
            measured.insert(measured.end(), {of.errors[i], of.radii[i]});
            measured.insert(measured.end(), of.sides[i].begin(), of.sides[i].end());
        }
        for (size_t i = 0; i < of.coded.size(); ++i) sizes.push_back(static_cast<uint32_t>(of.coded[i].size()));
        bytes.insert(bytes.end(), of.coded.bytes().begin(), of.coded.bytes().end());
    }
    Result<void> write(ChunkWriter& writer) const {
        auto done = put(writer, "leaves_measured", measured);
        if (done) done = put(writer, "leaf_squares", squares);
        if (done) done = put(writer, "leaf_parts", parts);
        if (done) done = put(writer, "leaf_sizes", sizes);
        if (done) done = put(writer, "leaf_bytes", bytes);
        return done;
    }
    bool read(const ChunkFile& file) {
        return get(file, "leaves_measured", measured) && get(file, "leaf_squares", squares) &&
               get(file, "leaf_parts", parts) && get(file, "leaf_sizes", sizes) && get(file, "leaf_bytes", bytes);
    }
    // Those of the next chart; false where they are not there.
    bool take(ChartLeaves& of) {
        of = {};
        if (chart == squares.size()) return false;
        const size_t count = squares[chart++];
        if (parts.size() - square < count || measured.size() < 6 * (square + count)) return false;
        for (const size_t end = square + count; square < end; ++square) {
            const double* its = &measured[6 * square];
            of.errors.push_back(its[0]);
            of.radii.push_back(its[1]);
            of.sides.push_back({its[2], its[3], its[4], its[5]});
            of.parts.push_back(parts[square]);
            for (uint32_t p = 0; p < parts[square]; ++p, ++part) {
                if (part == sizes.size() || bytes.size() - byte < sizes[part]) return false;
                of.coded.add(std::span(bytes).subspan(byte, sizes[part]));
                byte += sizes[part];
            }
        }
        return true;
    }
};

}  // namespace

Result<void> write_checkpoint(std::span<const uint32_t> charts, const std::vector<ChartResult>& results,
                              const Atlas& atlas, ChunkWriter& writer) {
    std::vector<ChartResult::Figures> figures;
    std::vector<double> errors;
    std::vector<uint32_t> error_counts;
    std::vector<SourceSample> samples;
    StoredLeaves leaves;
    std::string faults;
    for (const uint32_t q : charts) {
        const ChartResult& r = results[q];
        figures.push_back(r.figures);
        figures.back().samples = static_cast<uint32_t>(r.samples.size());
        for (const auto* list : {&r.errors.levels, &r.errors.pages}) {
            error_counts.push_back(static_cast<uint32_t>(list->size()));
            errors.insert(errors.end(), list->begin(), list->end());
        }
        samples.insert(samples.end(), r.samples.begin(), r.samples.end());
        faults += r.fault + '\n';
        leaves.add(r.leaves);
    }
    if (auto done = writer.add_array("charts", charts); !done) return done;
    if (auto done = put(writer, "figures", figures); !done) return done;
    if (auto done = put(writer, "measured", errors); !done) return done;
    if (auto done = put(writer, "measured_counts", error_counts); !done) return done;
    if (auto done = put(writer, "samples", samples); !done) return done;
    if (auto done = writer.add_text("faults", faults); !done) return done;
    if (auto done = leaves.write(writer); !done) return done;
    Result<void> all{};
    for_images(atlas, [&](const char* name, const auto& image, const std::vector<size_t>& first) {
        if (image.empty() || !all) return;
        std::remove_cvref_t<decltype(image)> part;
        for (const uint32_t q : charts)
            part.insert(part.end(), image.begin() + static_cast<ptrdiff_t>(first[q]),
                        image.begin() + static_cast<ptrdiff_t>(first[q + 1]));
        all = put(writer, name, part);
    });
    return all;
}

namespace {

// The images of these charts; false where one is not whole.
bool read_images(const ChunkFile& file, std::span<const uint32_t> charts, Atlas& atlas) {
    bool whole = true;
    for_images(atlas, [&](const char* name, auto& image, const std::vector<size_t>& first) {
        if (image.empty()) return;
        std::remove_cvref_t<decltype(image)> part;
        size_t count = 0, at = 0;
        for (const uint32_t q : charts) count += first[q + 1] - first[q];
        whole = whole && get(file, name, part) && part.size() == count;
        for (size_t i = 0; i < charts.size() && whole; ++i) {
            const size_t texels = first[charts[i] + 1] - first[charts[i]];
            std::copy_n(part.begin() + static_cast<ptrdiff_t>(at), texels,
                        image.begin() + static_cast<ptrdiff_t>(first[charts[i]]));
            at += texels;
        }
    });
    return whole;
}

}  // namespace

bool read_charts(const ChunkFile& file, std::span<const uint32_t> charts, std::vector<ChartResult>& results,
                 Atlas& atlas) {
    std::vector<ChartResult::Figures> figures;
    std::vector<double> errors;
    std::vector<uint32_t> error_counts, of;
    std::vector<SourceSample> samples;
    StoredLeaves leaves;
    if (!leaves.read(file)) return false;
    const auto faults = file.text("faults");
    if (!get(file, "charts", of) || !std::ranges::equal(of, charts) || !get(file, "figures", figures) ||
        figures.size() != charts.size() || !get(file, "measured", errors) ||
        !get(file, "measured_counts", error_counts) || error_counts.size() != 2 * charts.size() ||
        !get(file, "samples", samples) || !faults ||
        std::ranges::count(*faults, '\n') != static_cast<ptrdiff_t>(charts.size()))
        return false;
    if (!read_images(file, charts, atlas)) return false;
    auto error = errors.begin();
    auto sample = samples.begin();
    size_t text = 0;
    for (size_t i = 0; i < charts.size(); ++i) {
        ChartResult& r = results[charts[i]];
        r.figures = figures[i];
        for (auto* list : {&r.errors.levels, &r.errors.pages}) {
            const uint32_t count = error_counts[2 * i + (list == &r.errors.pages ? 1 : 0)];
            if (errors.end() - error < static_cast<ptrdiff_t>(count)) return false;
            list->assign(error, error + count);
            error += count;
        }
        if (samples.end() - sample < static_cast<ptrdiff_t>(figures[i].samples)) return false;
        r.samples.assign(sample, sample + figures[i].samples);
        sample += figures[i].samples;
        if (!leaves.take(r.leaves)) return false;
        const size_t end = faults->find('\n', text);
        r.fault = faults->substr(text, end - text);
        text = end + 1;
    }
    return true;
}

}  // namespace lodestone::vgi
