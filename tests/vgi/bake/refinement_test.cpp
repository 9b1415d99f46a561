#include "vgi/bake/charts/refinement.h"

#include <gtest/gtest.h>

namespace lodestone::vgi {
namespace {

RoundQuality judged(std::vector<double> stretch) {
    RoundQuality quality{{}, std::move(stretch)};
    for (const double s : quality.stretch) quality.bad.push_back(s > 3);
    return quality;
}

TEST(Refinement, OrdersOfMagnitudeCountAndWhatIsWithinTheBoundDoesNot) {
    EXPECT_EQ(RoundQuality::cost(10, 3, 3), 0);
    EXPECT_GT(RoundQuality::cost(10, 4, 3), 10);
    EXPECT_LT(RoundQuality::cost(10, 4, 3), 20);
    EXPECT_NEAR(RoundQuality::cost(1, 3e6, 3) / RoundQuality::cost(1, 3e3, 3), 1.9, 0.1);
    Refinement rounds(100, 3, 1000, 7);
    const RoundQuality one = judged({1e6, 1});
    rounds.begin(100);
    EXPECT_TRUE(rounds.improves(RoundQuality::cost(1, 1e6, 3), one));
    rounds.begin(100);
    EXPECT_TRUE(rounds.improves(RoundQuality::cost(1, 1e3, 3), one));  // as large, but not as bad
    rounds.begin(100);
    EXPECT_FALSE(rounds.improves(RoundQuality::cost(1, 0.9e3, 3), one));
}

TEST(Refinement, ArePatientWhereFewAreBad) {
    std::vector<double> stretch(100, 1.0);
    stretch[7] = 5;
    Refinement rounds(100, 3, 1000, 9);
    for (int round = 0; round < 4; ++round) {
        rounds.begin(100);
        EXPECT_TRUE(rounds.improves(1, judged(stretch))) << round;
    }
    rounds.begin(100);
    EXPECT_FALSE(rounds.improves(1, judged(stretch)));
}

TEST(Refinement, KnowsWhereLittleIsLeftAndThatSlightly) {
    Refinement rounds(100, 3, 1000, 9);
    rounds.begin(100);
    EXPECT_TRUE(rounds.leaves_little(0.002, judged({1, 4})));
    EXPECT_FALSE(rounds.leaves_little(0.02, judged({1, 4}))) << "much of the surface";
    EXPECT_FALSE(rounds.leaves_little(0.002, judged({1, 40}))) << "a chart is stretched ten times more than it may be";
}

TEST(Refinement, EndAtTheLastAndWhereClustersAreTooMany) {
    Refinement few(100, 3, 1000, 2);
    few.begin(100);
    EXPECT_FALSE(few.is_last());
    few.begin(100);
    EXPECT_TRUE(few.is_last());
    Refinement of_many_parts(100, 3, 1000, 7);  // components ask for them
    of_many_parts.begin(5000);
    EXPECT_EQ(of_many_parts.bound(), 3);
}

TEST(Refinement, EndsWhereCutsMakeTooMuch) {
    Refinement needles(100, 3, 20000, 7);
    needles.begin(100);
    needles.cut(1900000);
    EXPECT_FALSE(needles.is_last());
    needles.begin(200);
    needles.cut(1900000);
    EXPECT_TRUE(needles.is_last());
    Refinement scan(100, 3, 10'000'000, 7);
    for (int round = 0; round < 6; ++round) {
        scan.begin(200);
        scan.cut(14'000'000);
        EXPECT_FALSE(scan.is_last()) << round;
    }
}

TEST(Refinement, OnlyTheHopelessGoOnWhereClustersAreTooMany) {
    for (const size_t triangles : {size_t{1000}, size_t{10'000'000}}) {
        Refinement rounds(100, 3, triangles, 7);
        rounds.begin(90);
        rounds.begin(1000);
        EXPECT_EQ(rounds.bound(), 3);
        rounds.begin(2000);
        EXPECT_EQ(rounds.bound() > 3, triangles == 1000) << "ten million triangles may have twenty thousand clusters";
        rounds.begin(20000);
        EXPECT_GE(rounds.bound(), 10);
    }
    Refinement full(100, 3, 1000, 7);
    full.begin(100);
    EXPECT_TRUE(full.improves(5, judged({1e4})));
    full.begin(2000);
    EXPECT_TRUE(full.improves(5, judged({1e4}))) << "another bound is another measure";
    EXPECT_FALSE(full.is_last());
    full.begin(2100);
    EXPECT_FALSE(full.is_last());
    full.begin(2200);
    EXPECT_TRUE(full.is_last());
    std::vector<double> stretch(2200, 1e4);
    const std::vector<double> wanted(stretch.size(), 1.0), times = full.times_denser(judged(stretch), wanted);
    double more = 0;
    for (const double t : times) more += t - 1;
    EXPECT_GT(more, 0);
    EXPECT_LT(more, 400);
}

TEST(Refinement, MakeTheWorstDenserFirst) {
    Refinement rounds(100, 3, 1000, 7);
    rounds.begin(100);
    const std::vector<double> stretch{1, 4, 300, 0, 40}, wanted{1, 1, 1, 1, 0.01};
    RoundQuality quality = judged(stretch);
    quality.bad[3] = true;  // could not be made
    const std::vector<double> times = rounds.times_denser(quality, wanted);
    EXPECT_EQ(times[0], 1);
    EXPECT_GT(times[1], 3);
    EXPECT_GT(times[2], 2 * times[1]);
    EXPECT_EQ(times[3], 3);
    EXPECT_GE(times[4] * wanted[4], 4);  // or it would stay a cluster of its own
    // There is no room for all.
    const std::vector<double> many(3000, 1.0);
    std::vector<double> rising;
    for (size_t c = 0; c < many.size(); ++c) rising.push_back(4 + static_cast<double>(c));
    const std::vector<double> some = rounds.times_denser(judged(rising), many);
    EXPECT_EQ(some.front(), 1);
    EXPECT_GT(some.back(), 1);
    double clusters = 0;
    for (size_t c = 0; c + 1 < some.size(); ++c) {
        EXPECT_LE(some[c], some[c + 1]);
        clusters += some[c];
    }
    EXPECT_LT(clusters, 10000);
}

}  // namespace
}  // namespace lodestone::vgi
