"""Shows doxygen the plain // comments of a header as documentation: filtered(lines). scripts/reference.py calls it.

The rule, for whoever writes a header:
- A comment directly above a declaration documents it: that one alone, with all its names where it has several (int a, b;).
- A comment at the end of a line documents every name declared on that line: a field, an enumerator, a function, the struct
  or enum that begins there. Where no name begins on the line, it documents the declaration that goes on there.
- A comment below one at the end of a line, in the same column, goes on with it.
- The comment on top of a file documents the file.
- Every other comment is for those who read the source: above an empty line, in a function, in a list of parameters.

Nothing needs to be said of defaulted and deleted members, destructors, comparison operators, plain default constructors,
forward declarations, and in C of a typedef that gives a struct its own name.

Lines keep their numbers, so doxygen's warnings point at the source.
"""
import re

# What is said of members that need no comment; the first that fits the declaration.
PLAIN_MEMBERS = [
    (r"=\s*delete$", "Deleted."),
    (r"operator\s*(==|!=|<=>|<|>|<=|>=)\s*\(.*=\s*default$", "Compares member by member."),
    (r"operator\s*(==|!=|<=>|<|>|<=|>=)\s*\(", "Compares."),
    (r"^(virtual )?~", "Destructor."),
    (r"^\w+\(\)( noexcept)?( = default| :.*)?$", "Default constructor."),
    (r"^typedef (struct|union|enum) (\w+) \2$", "Without the word before it."),
    (r"=\s*default$", "Defaulted."),
]
NO_NAME = re.compile(r"(static_assert|friend|using namespace)\b")
FORWARD = re.compile(r"(template ?<.*> ?)?(enum |class |struct |union )+[\w:]+( : \w+)?$")


class Name:
    """A declared name: where its declaration begins, or the comma before it."""

    def __init__(self, line, column, after_comma=False):
        self.line, self.column, self.after_comma = line, column, after_comma
        self.kind = ""  # for names after a comma: the type before the first
        self.above, self.own = [], []  # lines of the comment above, texts at the ends of lines
        self.head = ""  # the declaration as far as it goes without initialisers and bodies


class Scanner:
    """Finds names in lines without comments and literals; for each line, the names and the one that goes on there."""

    def __init__(self, lines):
        self.stack = ["names"]  # of names, enum, body, init, (
        self.names = []
        self.statement = None  # its names
        self.head, self.angles = "", 0
        self.going_on, self.at_start, self.in_parameters = [], [], []
        for number, line in enumerate(lines):
            going_on = self.statement[-1] if self.statement and "body" not in self.stack else None
            self.at_start.append(self.statement is None and self.stack[-1] in ("names", "enum"))
            for column, ch in enumerate(line):
                self.step(ch, number, column)
            if self.statement:
                self.head += " "
            self.going_on.append(going_on)
            self.in_parameters.append(self.stack[-1] == "(")

    def end(self, forward=False):
        if self.statement:
            for name in self.statement:
                name.head = re.sub(r"\s+", " ", self.head).strip()
            head = self.statement[0].head
            if not NO_NAME.match(head) and not (forward and FORWARD.match(head)):
                self.names += self.statement
        self.statement, self.head, self.angles = None, "", 0

    def step(self, ch, number, column):
        top = self.stack[-1]
        if top in ("names", "enum"):
            self.declare(ch, number, column, top)
            return
        if ch in "([{":
            self.stack.append("(" if ch != "{" else "body" if top == "body" else "init")
        elif ch in ")]}":
            self.stack.pop()
            if top == "body" and "body" not in self.stack:
                self.end()
        if top == "(" and "body" not in self.stack and "init" not in self.stack:
            self.head += ch

    def declare(self, ch, number, column, top):
        if self.statement is None:
            if ch == "}":
                self.stack.pop()
            if ch.isspace() or ch in ";},":
                return
            self.statement, self.head = [Name(number, column)], ""
        if ch == "{":
            self.open_brace()
        elif ch in "([":
            self.head += ch
            self.stack.append("(")
        elif ch == ";" or (top == "enum" and ch == ","):
            self.end(forward=top == "names")
        elif ch == "}":
            self.end()
            self.stack.pop()
        elif ch == ":" and re.match(r"(public|private|protected)$", self.head.strip()):
            self.statement = None
        elif ch == "," and self.angles == 0 and self.declares_variables():
            name = Name(number, column, after_comma=True)
            first = re.match(r"(.*?)\w+\s*(\[.*\])?\s*(=.*)?$", self.head.strip())
            name.kind = self.statement[1].kind if len(self.statement) > 1 else first[1]
            self.statement.append(name)
            self.head += ch
        else:
            if ch == "<" and re.search(r"(\w|template )$", self.head) and not self.head.endswith("operator"):
                self.angles += 1
            elif ch == ">" and self.angles > 0:
                self.angles -= 1
            self.head += ch

    def open_brace(self):
        head = re.sub(r"^template\s*<.*?>\s*", "", self.head).strip()
        kind = re.match(r"(inline\s+)?(namespace|class|struct|union|enum)\b", head)
        if re.match(r"extern x+$", head):  # extern "C", its literal blanked: names stand in it as around it
            self.statement, self.head = None, ""
            self.stack.append("names")
        elif kind and "=" not in head:
            self.end()
            self.stack.append("enum" if kind[2] == "enum" else "names")
        elif "(" in head and not re.search(r"=", re.sub(r"operator\S+", "", re.sub(r"\(.*\)", "", head))):
            self.stack.append("body")
        else:
            self.stack.append("init")

    def declares_variables(self):
        return not re.match(r"(class|struct|union|enum|using|template)\b", self.head) and "(" not in self.head.split("=")[0]


def split(lines):
    """Per line: code without its comment, the same with literals and preprocessor lines blanked, text and column of the comment."""
    code, bare, text, column = [], [], [], []
    in_directive = False
    for line in lines:
        masked = re.sub(r'"(?:[^"\\]|\\.)*"|(?<!\w)\'(?:[^\'\\]|\\.)+\'', lambda m: "x" * len(m[0]), line)
        at = masked.find("//")
        directive = in_directive or masked.startswith("#")
        in_directive = directive and masked.endswith("\\")
        code.append(line if at < 0 else line[:at].rstrip())
        masked = re.sub(r"/\*.*?\*/", lambda m: " " * len(m[0]), masked if at < 0 else masked[:at])
        bare.append("" if directive else masked)
        text.append(None if at < 0 else line[at + 2 :].removeprefix(" "))
        column.append(at)
    return code, bare, text, column


def for_doxygen(text):
    """A comment with what doxygen and Markdown would take for markup escaped; `code` and "quotations" stay."""
    parts = re.split(r'(`[^`]*`|"[^"]*")', text.replace("*/", "* /"))
    for i in range(0, len(parts), 2):
        part = re.sub(r"([\\`<>@#&|])", r"\\\1", parts[i])
        part = re.sub(r"(?<=\.\.) |(?<=\bal\.) |(?<=\bRec\.) ", "&nbsp;", part)  # not the end of a sentence
        # Links go to TwoWords, A::b and f(); a single word that is also the name of a type is mostly only a word.
        parts[i] = re.sub(r"(?<![\w:%])([A-Z][a-z0-9]+)(?![\w:(])", r"%\1", part)
    return "".join(parts)


def rows_of(lines):
    """Lines of a comment above a declaration; rows of a table (indented, name and text apart) on lines of their own."""
    out, in_table = for_doxygen("\n".join(lines)).split("\n"), False
    for i, line in enumerate(out):
        row = re.match(r" {2,}(\w+)  +(\S.*)$", line)
        if row:
            out[i] = f"<br>&emsp;<b>{row[1]}</b> {row[2]}"
        elif in_table:
            out[i] = "<br>" + line
        in_table = row is not None
    return out


def attach(scanner, code, text, column):
    """Gives names their comments. Returns for lines that are comments above a name that name's number of lines."""
    begins = {}
    for name in scanner.names:
        begins.setdefault(name.line, []).append(name)
    blocks = {}
    line, end_of_line = 0, None  # whom the comment at the end of the line before is of, and its column
    while line < len(code):
        if text[line] is None:
            end_of_line = None
        elif code[line].strip():
            of = begins.get(line) or [scanner.going_on[line]]
            of = [] if scanner.in_parameters[line] or of == [None] else of
            for name in of:
                name.own.append(text[line])
            end_of_line = (of, column[line])
        elif end_of_line and column[line] == end_of_line[1]:
            for name in end_of_line[0]:
                name.own.append(text[line])
        else:
            end_of_line = None
            first = line
            while line + 1 < len(code) and not code[line + 1].strip() and column[line + 1] == column[first]:
                line += 1
            below = [n for n in begins.get(line + 1, []) if not n.after_comma]
            if scanner.at_start[first] and below and below[0].column == column[first]:
                below[0].above = text[first : line + 1]
                blocks[first] = below[0]
        line += 1
    return blocks


def insertion(name, siblings):
    above = siblings[0].above if name.after_comma else []
    said = " ".join(above + name.own)
    if not said and not name.above:
        said = next((phrase for pattern, phrase in PLAIN_MEMBERS if re.search(pattern, name.head)), "")
    doc = f"/** {for_doxygen(said)} */ " if said and not name.above else ""
    return "; " + doc + name.kind if name.after_comma else doc


def filtered(lines):
    code, bare, text, column = split(lines)
    scanner = Scanner(bare)
    blocks = attach(scanner, code, text, column)
    out = list(code)
    siblings = []
    inserted = []
    for name in scanner.names:
        siblings = siblings + [name] if name.after_comma else [name]
        inserted.append((name.line, name.column, insertion(name, siblings), name.after_comma))
    for line, at, doc, comma in sorted(inserted, reverse=True):
        out[line] = out[line][:at] + doc + out[line][at + comma :].removeprefix(" " if comma else "")
    for first, name in blocks.items():
        rows = rows_of(name.above)
        if name.own:
            rows[-1] += " " + for_doxygen(" ".join(name.own))
        for i, row in enumerate(rows):
            out[first + i] = f"/// {row}"
    on_top = 0
    while on_top < len(lines) and lines[on_top].startswith("//"):
        on_top += 1
    if on_top > 0 and lines[on_top].strip() == "#pragma once":
        out[:on_top] = [f"/// {row}" for row in rows_of(text[:on_top])]
        out[on_top] = "/// @file"
    return out
