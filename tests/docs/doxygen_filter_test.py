"""The rule of scripts/doxygen_filter.py: which comment documents which names."""
import pathlib
import sys
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
import doxygen_filter  # noqa: E402


def filtered(text):
    return doxygen_filter.filtered(text.split("\n"))


class Rule(unittest.TestCase):
    def test_a_comment_above_documents_the_first_declaration_alone(self):
        self.assertEqual(filtered("// both\n// lines\nint f();\nint g();"), ["/// both", "/// lines", "int f();", "int g();"])

    def test_a_comment_above_an_empty_line_documents_nothing(self):
        self.assertEqual(filtered("// none\n\nint f();"), ["", "", "int f();"])

    def test_a_comment_at_the_end_documents_every_name_of_the_line(self):
        self.assertEqual(filtered("int a = f(1, 2), b{3};  // t"), ["/** t */ int a = f(1, 2); /** t */ int b{3};"])
        self.assertEqual(filtered("enum E { a, b };  // t"), ["/** t */ enum E { /** t */ a, /** t */ b };"])

    def test_in_c_names_stand_in_extern_c_and_structs_have_their_own_names(self):
        self.assertEqual(filtered('extern "C" {\n// t\nint f(void);\n}'), ['extern "C" {', "/// t", "int f(void);", "}"])
        self.assertEqual(filtered("typedef struct s s;"), ["/** %Without the word before it. */ typedef struct s s;"])

    def test_a_comment_above_several_names_documents_all_of_them(self):
        self.assertEqual(filtered("// t\nM<int, int> a, b;"), ["/// t", "M<int, int> a; /** t */ M<int, int> b;"])

    def test_both_comments_are_kept(self):
        self.assertEqual(filtered("// above\nint a;  // own"), ["/// above own", "int a;"])

    def test_what_begins_on_the_line_is_documented_not_what_is_in_it(self):
        self.assertEqual(filtered("struct S {  // t\n    int a;\n};"), ["/** t */ struct S {", "    int a;", "};"])
        self.assertEqual(filtered("enum class E {\n    a,  // t\n    b\n};")[1:3], ["    /** t */ a,", "    b"])

    def test_a_declaration_of_several_lines_has_the_comment_at_its_end(self):
        self.assertEqual(filtered("int a =\n    0;  // t\n        // more"), ["/** t more */ int a =", "    0;", ""])

    def test_comments_in_functions_and_parameters_document_nothing(self):
        self.assertEqual(filtered("int f(int a,  // t\n      int b) {\n    // t\n    return a;  // t\n}"),
                         ["int f(int a,", "      int b) {", "", "    return a;", "}"])

    def test_plain_members_need_no_comment(self):
        for member in ("bool operator==(const S&) const = default;", "S(const S&) = delete;", "~S();", "S() : a_(1) {}"):
            self.assertTrue(filtered(f"class S {{\n    {member}\n}};")[1].startswith("    /** "), member)
        for member in ("explicit S(int a);", "S(S&&) noexcept;", "void f();"):
            self.assertEqual(filtered(f"class S {{\n    {member}\n}};")[1], f"    {member}")

    def test_the_comment_on_top_documents_the_file(self):
        self.assertEqual(filtered("// t\n#pragma once\nint a;"), ["/// t", "/// @file", "int a;"])

    def test_markup_is_escaped_but_code_and_quotations(self):
        self.assertEqual(filtered('// a < 1 .. 2, `x<y>`, "A < B" of View\nint a;')[0],
                         '/// a \\< 1 ..&nbsp;2, `x<y>`, "A < B" of %View')


if __name__ == "__main__":
    unittest.main()
