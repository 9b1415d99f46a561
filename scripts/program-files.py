#!/usr/bin/env python3
"""Writes what is installed beside the program, from what the program says of itself: scripts/program-files.py PROGRAM FOLDER

FOLDER/lodestone.1    the manual page, from --help of the program and of every subcommand
FOLDER/lodestone.bash completion for bash: subcommands, options, the values that options name, and files
"""
import pathlib
import re
import subprocess
import sys

OPTION = re.compile(r"  ((?:-\w,)?--[\w-]+)(.*?)(?:  +|$)(.*)")
# What follows an option that takes a file or a folder.
FILES = {"--out", "--report", "--thumbnail", "--stats", "--camera", "--tmp", "--plan", "--merge", "--list"}


def help_of(program, *subcommand):
    return subprocess.run([program, *subcommand, "--help"], check=True, capture_output=True, text=True).stdout


def subcommands_of(text):
    listed = text.split("\nSubcommands:\n")[1].split("\n\n")[0]
    return dict(re.match(r"  (\S+)\s+(.*)", line).groups() for line in listed.splitlines())


def sections_of(text):
    """The paragraphs of a help text: the title ("" for those without) and the lines."""
    found = []
    for paragraph in text.strip("\n").split("\n\n"):
        lines = paragraph.splitlines()
        if re.fullmatch(r"\w+:", lines[0]):
            found.append((lines[0][:-1], lines[1:]))
        else:
            found.append(("", lines))
    return found


def options_of(text):
    """(names, argument, description) of each option of a help text; the argument is "" for a flag."""
    options = []
    for title, lines in sections_of(text):
        if title != "Options":
            continue
        for line in lines:
            option = OPTION.match(line)
            if option:
                options.append([option[1].split(","), option[2].strip(), option[3]])
            elif options:
                options[-1][2] = (options[-1][2] + " " + line.strip()).strip()
    return options


def escaped(text):
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return "\\&" + text if text.startswith((".", "'")) else text


def options_page(text, macro):
    """The options and positionals of a help text as a part of a manual page."""
    out = []
    for title, lines in sections_of(text):
        if title == "Positionals":
            for line in lines:
                name, about = re.match(r"  (\S+)(?: .*?)?  +(.*)", line).groups()
                out.append(f".TP\n.I {escaped(name)}\n{escaped(about)}")
        elif title == "Options":
            for names, argument, about in options_of(text):
                shown = ", ".join(f"\\fB{escaped(name)}\\fR" for name in names)
                out.append(f".TP\n{shown} {escaped(argument.replace(' REQUIRED', ''))}".rstrip() + f"\n{escaped(about)}")
        elif title == "Examples":
            out.append(f"{macro} Examples\n.nf\n" + "\n".join(escaped(line.strip()) for line in lines) + "\n.fi")
    return "\n".join(out)


def manual(program, version):
    text = help_of(program)
    about, footer = text.splitlines()[0], [lines for title, lines in sections_of(text) if title == ""][1:]
    parts = [f'.TH LODESTONE 1 "" "{version}" "User Commands"', f".SH NAME\nlodestone \\- {escaped(about.split(', ', 1)[1])}",
             ".SH SYNOPSIS\n.B lodestone\n[\\fIoptions\\fR] \\fIsubcommand\\fR [\\fIoptions\\fR] [\\fIfiles\\fR]", ".SH DESCRIPTION"]
    parts += ["\n".join(escaped(line) for line in lines) + "\n.PP" for lines in footer]
    parts += [".SH OPTIONS", options_page(text, ".SS"), ".SH SUBCOMMANDS"]
    for name, about in subcommands_of(text).items():
        parts += [f".SS {name}\n{escaped(about)}.", options_page(help_of(program, name), ".PP\n.B")]
    return "\n".join(parts) + "\n"


def choices_of(argument, about):
    """The words that an option can be given, where its help names them."""
    listed = re.search(r"\{([\w,.-]+)\}", argument)
    if listed:
        return listed[1].split(",")
    head = re.match(r"(?:\w+: )?(?:[\w ]+: )?((?:[a-z]+(?: \([^)]*\))?, )*[a-z]+(?: \([^)]*\))? or [a-z]+)(?: \([^)]*\))?$", about)
    return re.findall(r"([a-z]+)(?: \([^)]*\))?(?:, | or |$)", head[1]) if head else []


COMPLETION = """\
# Completion of lodestone for bash; made by scripts/program-files.py from the program's help.
_lodestone() {{
    local word=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} command= each
    for each in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
        case $each in {names}) command=$each; break ;; esac
    done
    case $command,$before in
{values}
        {files}) COMPREPLY=($(compgen -f -- "$word")); compopt -o filenames 2>/dev/null; return ;;
    esac
    local options='{general}'
    case $command in
{options}
    esac
    if [[ $word == -* ]]; then
        COMPREPLY=($(compgen -W "$options" -- "$word"))
    elif [[ -z $command ]]; then
        COMPREPLY=($(compgen -W '{words}' -- "$word"))
    else
        COMPREPLY=($(compgen -f -- "$word"))
        compopt -o filenames 2>/dev/null
    fi
}}
complete -F _lodestone lodestone
"""


def completion(program):
    text = help_of(program)
    names = subcommands_of(text)
    values, options = [], []
    for name in names:
        found = options_of(help_of(program, name))
        options.append(f"        {name}) options+=' {' '.join(n for names_of, _, _ in found for n in names_of if n.startswith('--'))}' ;;")
        for names_of, argument, about in found:
            choices = choices_of(argument, about)
            if choices:
                patterns = "|".join(f"{name},{n}" for n in names_of)
                values.append(f"        {patterns}) COMPREPLY=($(compgen -W '{' '.join(choices)}' -- \"$word\")); return ;;")
    general = [n for names_of, _, _ in options_of(text) for n in names_of if n.startswith("--")]
    return COMPLETION.format(names="|".join(names), values="\n".join(values), options="\n".join(options), general=" ".join(general),
                             words=" ".join(names), files="|".join(f"*,{o}" for o in ["-o", *sorted(FILES)]))


def main():
    program, folder = str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(sys.argv[2])
    version = subprocess.run([program, "--version"], check=True, capture_output=True, text=True).stdout.strip()
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "lodestone.1").write_text(manual(program, version), encoding="utf-8")
    (folder / "lodestone.bash").write_text(completion(program), encoding="utf-8")


if __name__ == "__main__":
    main()
