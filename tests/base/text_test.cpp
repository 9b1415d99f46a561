#include "base/text.h"

#include <gtest/gtest.h>

namespace lodestone {
namespace {

TEST(Printable, KeepsWordsOfAnyLanguageAndEscapesWhatMovesATerminal) {
    for (const char* same : {"", "rock.ply: line 3: 'a' is no number", "Größe, 岩, \U0001f5ff", "a\\b", "é"})
        EXPECT_EQ(printable(same), same);
    EXPECT_EQ(printable("a\x1b[2Jb\rc\nd\te\x7f"), "a\\x1b[2Jb\\x0dc\\x0ad\\x09e\\x7f");
    EXPECT_EQ(printable("\u009b31m"), "\\xc2\\x9b31m") << "a control character of eight bits";
    EXPECT_EQ(printable("gpj.\u202egnp"), "gpj.\\xe2\\x80\\xaegnp") << "text that runs the other way";
    EXPECT_EQ(printable("\xe9t\xe9"), "été") << "Latin-1";
    EXPECT_EQ(printable("\x9b"), "\\xc2\\x9b") << "a control character of Latin-1";
    EXPECT_EQ(printable(std::string("a\0b", 3)), "a\\x00b");
}

}  // namespace
}  // namespace lodestone
