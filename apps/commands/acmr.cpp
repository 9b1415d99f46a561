#include <cstdio>

#include "apps/commands/commands.h"
#include "apps/options/common_options.h"
#include "apps/scene/asset.h"
#include "apps/terminal.h"
#include "base/json.h"
#include "base/text.h"
#include "lod/bake/orders/order_statistics.h"

namespace lodestone {

namespace {

struct AcmrArguments {
    std::string asset, cache = "fifo16", order, spacing = "uniform";
    uint32_t levels = 60;
    bool compare = false, json = false;
};

Json to_json(const OrderCost& cost, const AcmrArguments& o, const CacheModel& model, const std::string& order) {
    Json json = {{"cache", name_of(model)},
                 {"order", order},
                 {"spacing", o.spacing},
                 {"atvr_mean", cost.atvr_mean},
                 {"acmr_mean", cost.acmr_mean},
                 {"atvr_worst", cost.atvr_worst},
                 {"moved_per_ecol", cost.moved_per_ecol},
                 {"cache_lines_per_ecol", cost.cache_lines_per_ecol},
                 {"bytes_per_ecol", cost.bytes_per_ecol}};
    for (const LevelCost& level : cost.levels) {
        json["levels"].push_back(
            {{"triangles", level.triangles}, {"vertices", level.vertices}, {"atvr", level.atvr}, {"acmr", level.acmr}});
    }
    return json;
}

Result<int> acmr(const AcmrArguments& o) {
    const auto model = cache_model_named(o.cache);
    if (!model) return fail_at("--cache", model.error());
    auto asset = open_asset(o.asset);
    if (!asset) return tl::unexpected(asset.error());
    if (asset->lod == nullptr)
        return fail(Fault::format, o.asset + ": holds no progressive mesh; bake it with --backends lod");
    const ProgressiveMesh& pm = *asset->lod;
    const FaceOrder* order = o.order.empty() ? pm.orders.data() : pm.order_named(o.order);
    if (order == nullptr)
        return fail(Fault::usage,
                    "--order " + o.order + ": the asset does not hold it; bake it with --order " + o.order);
    const auto levels = sample_levels(pm, o.levels, o.spacing == "log" ? LevelSpacing::log : LevelSpacing::uniform);
    const Progress progress = terminal_progress();
    progress.at("simulate " + o.cache, 0);
    const OrderCost cost = cost_of_order(pm, static_cast<uint32_t>(order - pm.orders.data()), *model, levels);
    Json json = to_json(cost, o, *model, order->name);
    if (o.compare) {
        progress.at("compare", 0);
        const auto add = [&](const char* name, double atvr) { json["compare"][name] = {{"atvr_mean", atvr}}; };
        if (const FaceOrder* classic = pm.order_named("classic")) {
            add("classic",
                cost_of_order(pm, static_cast<uint32_t>(classic - pm.orders.data()), *model, levels).atvr_mean);
        }
        if (pm.order_named("static") != nullptr) add("static_meshoptimizer", atvr_of_static_order(pm, *model, levels));
        add("fresh_meshoptimizer", atvr_of_fresh_order(pm, FreshOrder::meshoptimizer, *model, levels));
        add("fresh_meshoptimizer_fifo", atvr_of_fresh_order(pm, FreshOrder::meshoptimizer_fifo, *model, levels));
        add("fresh_tipsify", atvr_of_fresh_order(pm, FreshOrder::tipsify, *model, levels));
        add("random", atvr_of_fresh_order(pm, FreshOrder::random, *model, levels));
        add("worst_case", worst_atvr(pm, levels));
    }
    end_progress();
    if (o.json) {
        print_line(json.dump(2));
        return 0;
    }
    std::printf("order %s, %s, %u levels (%s)\n", printable(order->name).c_str(), name_of(*model).c_str(), o.levels,
                o.spacing.c_str());
    std::printf("  transforms per vertex (ATVR) %.4f mean, %.4f worst; per triangle (ACMR) %.4f mean\n", cost.atvr_mean,
                cost.atvr_worst, cost.acmr_mean);
    std::printf("  per ecol: %.3f faces moved, %.2f cache lines written, %.2f bytes of permutation\n",
                cost.moved_per_ecol, cost.cache_lines_per_ecol, cost.bytes_per_ecol);
    if (json.contains("compare")) {
        for (const auto& [name, value] : json["compare"].items())
            std::printf("  %-26s ATVR %.4f\n", name.c_str(), value["atvr_mean"].get<double>());
    }
    return 0;
}

}  // namespace

void add_acmr(CLI::App& app, Run& run) {
    const auto o = std::make_shared<AcmrArguments>();
    CLI::App* command = app.add_subcommand("acmr", "Simulate the vertex cache over the levels of a progressive mesh");
    command->add_option("asset", o->asset, "Asset file, .lode")->required();
    command->add_option("--cache", o->cache, "Cache model: fifoN, lruN, nvidia, amd or intel")->capture_default_str();
    command->add_option("--order", o->order, "Face order to simulate; the asset's first unless given");
    command->add_option("--levels", o->levels, "How many levels to simulate")
        ->check(CLI::Range(1, 100000))
        ->capture_default_str();
    command
        ->add_option("--spacing", o->spacing,
                     "How triangle counts of these levels are spaced: evenly (uniform) or by a constant factor (log)")
        ->check(CLI::IsMember({"uniform", "log"}))
        ->capture_default_str();
    command->add_flag(
        "--compare", o->compare,
        "Also simulate classic, static, orders made anew for each level (meshoptimizer, tipsify) and faces in "
        "random order; and the worst case, three transforms for each triangle");
    command->add_flag("--json", o->json, "Print as JSON");
    command->footer(
        examples("lodestone acmr bunny.lode --cache fifo16 --compare\n"
                 "lodestone acmr bunny.lode --order classic --levels 20 --json"));
    command->callback([o, &run] { run = [o] { return acmr(*o); }; });
}

}  // namespace lodestone
