#include "apps/terminal.h"

#include <gtest/gtest.h>

namespace lodestone {
namespace {

TEST(Terminal, TellsTheTimeThatIsLeftOnceItMeansSomething) {
    EXPECT_EQ(time_left(10, 0.25), ", 30 s left");
    EXPECT_EQ(time_left(60, 0.1), ", 9 min left");
    EXPECT_EQ(time_left(9.9, 0.99), ", 1 s left");
    EXPECT_EQ(time_left(1, 0.5), "");     // too soon
    EXPECT_EQ(time_left(10, 0.001), "");  // too little
    EXPECT_EQ(time_left(10, 1), "");      // done
}

}  // namespace
}  // namespace lodestone
