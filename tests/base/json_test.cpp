#include "base/json.h"

#include <gtest/gtest.h>

#include <array>

namespace lodestone {
namespace {

template <class T>
bool holds(const char* text) {
    try {
        Json::parse(text).get<T>();
        return true;
    } catch (const Json::exception&) { return false; }
}

TEST(JsonNumbers, AreWholeAndFitTheirTypeOrAreRefused) {
    EXPECT_EQ(Json::parse("255").get<uint8_t>(), 255);
    EXPECT_EQ(Json::parse("-128").get<int8_t>(), -128);
    EXPECT_EQ(Json::parse("3.0").get<int>(), 3);
    EXPECT_EQ(Json::parse("18446744073709551615").get<uint64_t>(), ~uint64_t{0});
    for (const char* wrong : {"5e23", "-5e23", "256", "-1", "3.5", "true", "null", "\"3\"", "[3]", "1e400"})
        EXPECT_FALSE(holds<uint8_t>(wrong)) << wrong;
    for (const char* wrong : {"5e23", "4294967296", "-1", "0.1"}) EXPECT_FALSE(holds<uint32_t>(wrong)) << wrong;
    for (const char* wrong : {"5e23", "2147483648", "-2147483649", "18446744073709551615"})
        EXPECT_FALSE(holds<int>(wrong)) << wrong;
    for (const char* wrong : {"-1", "18446744073709551616", "1e19"}) EXPECT_FALSE(holds<uint64_t>(wrong)) << wrong;
    EXPECT_FALSE(holds<int64_t>("18446744073709551615"));
}

TEST(JsonNumbers, InListsAndBesideDefaultsAreRefusedAlike) {
    EXPECT_TRUE((holds<std::array<uint32_t, 2>>("[1, 2]")));
    EXPECT_FALSE((holds<std::array<uint32_t, 2>>("[1, 4294967296]")));
    EXPECT_FALSE(holds<std::vector<uint32_t>>("[1, -2]"));
    const Json object = Json::parse(R"({"there": 4294967300, "half": 0.5})");
    EXPECT_EQ(object.value("absent", 7u), 7u);
    EXPECT_THROW(object.value("there", 7u), Json::exception);
    EXPECT_THROW(object.value("half", 7), Json::exception);
    EXPECT_EQ(object.value("half", 7.0), 0.5) << "numbers of other types are what they were";
    EXPECT_EQ(Json::parse("0.1").get<float>(), 0.1f);
    EXPECT_TRUE(Json::parse("true").get<bool>());
}

}  // namespace
}  // namespace lodestone
