#include "vgi/draw/pages/page_decoder.h"

#include <algorithm>

#include "base/check.h"
#include "base/threads.h"

namespace lodestone::vgi {

// Of 64 x 64 cells of textures, each takes 0.1 MB.
static constexpr size_t most_families = 256;

static DecodedPage broken(const PageId& id, const Error& error) {
    return {id, nullptr, nullptr, nullptr, nullptr, error.message, error.fault};
}

uint64_t DecodedPage::bytes() const {
    return geometry != nullptr     ? geometry->size() * sizeof(GeometryTexel)
           : blocks != nullptr     ? blocks->size() * sizeof(uint32_t)
           : attributes != nullptr ? attributes->size() * sizeof(uint32_t)
           : leaf != nullptr       ? leaf->words.size() * sizeof(leaf->words[0])
                                   : 0;
}

DecodedPage PageDecoder::decode(const DecodeTask& task) const {
    if (task.id.layer == Layer::leaves) return decode_leaf(task);
    const auto family = task.atlas->file->unpack(task.name, std::span(task.blob.data(), task.blob.size()));
    return family ? decode(task, *family) : broken(task.id, family.error());
}

DecodedPage PageDecoder::decode_leaf(const DecodeTask& task) const {
    auto part = task.atlas->file->decode_leaf(task.id.number, std::span(task.blob.data(), task.blob.size()));
    if (!part) return broken(task.id, part.error());
    DecodedPage decoded;
    decoded.id = task.id;
    decoded.leaf = std::make_shared<const DrawnLeafPart>(
        packed_leaf(*task.atlas->topology, task.id.number, std::move(*part), *task.parent_geometry, words_.leaf_uvs));
    return decoded;
}

DecodedPage PageDecoder::decode(const DecodeTask& task, const PageFamily& family) const {
    const AtlasFile& file = *task.atlas->file;
    const Atlas& about = file.about();
    const PageTree tree = tree_of(about, task.id.layer, task.name.chart);
    std::optional<Page> parent;
    if (task.parent_geometry != nullptr) parent = unpacked_geometry(*task.parent_geometry);
    if (task.parent_attributes != nullptr)
        parent = unpacked_attributes(*task.parent_attributes, task.atlas->trees[index_of(Layer::attributes)],
                                     about.attributes);
    const auto plain = file.decode(task.name, family, parent ? &*parent : nullptr);
    if (!plain) return broken(task.id, plain.error());
    DecodedPage decoded;
    decoded.id = task.id;
    if (task.id.layer == Layer::geometry) {
        decoded.geometry = std::make_shared<const GeometryPage>(packed_geometry(*plain, tree));
        return decoded;
    }
    decoded.attributes =
        std::make_shared<const AttributePage>(packed_attributes(*plain, tree, about.attributes, words_.of_sample));
    if (words_.in_blocks())
        decoded.blocks = std::make_shared<const AttributeBlocks>(
            attribute_blocks(*decoded.attributes, tree, about.attributes, words_.blocks()));
    return decoded;
}

void PageDecoder::start(std::vector<DecodeTask> tasks) {
    LODE_CHECK(!decoding_.valid());
    ++started_;
    decoding_ = worker_.start<std::vector<DecodedPage>>([this, tasks = std::move(tasks)] { return run(tasks); });
}

std::vector<DecodedPage> PageDecoder::take() {
    return decoding_.valid() ? decoding_.get() : std::vector<DecodedPage>();
}

std::vector<PageDecoder::Siblings> PageDecoder::grouped(const std::vector<DecodeTask>& tasks) const {
    std::map<FamilyId, Siblings> families;
    std::vector<Siblings> all;
    for (size_t k = 0; k < tasks.size(); ++k) {
        const auto& [id, name, atlas, blob, geometry, attributes] = tasks[k];
        if (id.layer == Layer::leaves) {
            all.push_back({{}, nullptr, {k}});
            continue;
        }
        const FamilyId family{id.layer, id.atlas, name.chart, atlas->trees[index_of(id.layer)].family(name.page)};
        families[family].tasks.push_back(k);
    }
    for (auto& [id, siblings] : families) {
        siblings.id = id;
        if (const auto kept = families_.find(id); kept != families_.end()) siblings.family = kept->second.family;
        all.push_back(std::move(siblings));
    }
    return all;
}

void PageDecoder::decode(Siblings& siblings, const std::vector<DecodeTask>& tasks,
                         std::vector<DecodedPage>& decoded) const {
    for (const size_t k : siblings.tasks) {
        const DecodeTask& task = tasks[k];
        if (task.id.layer == Layer::leaves) {
            decoded[k] = decode_leaf(task);
            continue;
        }
        if (siblings.family == nullptr) {
            auto family = task.atlas->file->unpack(task.name, std::span(task.blob.data(), task.blob.size()));
            if (!family) {
                decoded[k] = broken(task.id, family.error());
                continue;
            }
            siblings.family = std::make_shared<const PageFamily>(std::move(*family));
        }
        decoded[k] = decode(task, *siblings.family);
    }
}

std::vector<DecodedPage> PageDecoder::run(const std::vector<DecodeTask>& tasks) {
    std::vector<Siblings> groups = grouped(tasks);
    std::vector<DecodedPage> decoded(tasks.size());
    // All at once would be too many to keep.
    const size_t kept_from = groups.size() - std::min(groups.size(), most_families);
    parallel_for(groups.size(), 1, [&](size_t begin, size_t end) {
        for (size_t g = begin; g < end; ++g) {
            decode(groups[g], tasks, decoded);
            if (g < kept_from) groups[g].family = nullptr;
        }
    });
    for (const Siblings& siblings : groups) {
        if (siblings.family != nullptr) families_[siblings.id] = {siblings.family, started_};
    }
    forget_oldest();
    return decoded;
}

// Those used last by the earliest starts.
void PageDecoder::forget_oldest() {
    if (families_.size() <= most_families) return;
    std::vector<std::pair<uint64_t, FamilyId>> by_use;
    for (const auto& [id, kept] : families_) by_use.emplace_back(kept.used, id);
    std::ranges::sort(by_use);
    by_use.resize(families_.size() - most_families);
    for (const auto& [used, id] : by_use) families_.erase(id);
}

}  // namespace lodestone::vgi
