#!/usr/bin/env python3
"""Makes the reference of the public headers: scripts/reference.py DOXYFILE

Exit 1 and a line for each where a public name has no comment (scripts/doxygen_filter.py has the rule) or a comment confuses
doxygen. Doxygen itself does not miss comments of enumerators; those are looked for in its XML.
"""
import pathlib
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree

sys.dont_write_bytecode = True
import doxygen_filter  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parent.parent


def setting(doxyfile, name):
    return re.search(rf'^{name}\s*=\s*"?(.*?)"?$', doxyfile.read_text(), re.MULTILINE)[1]


def copy_headers(doxyfile, headers):
    """Makes the copies that the Doxyfile names, with comments as doxygen reads them. A filter that doxygen starts for each header is slow."""
    for name in re.findall(rf'"{re.escape(str(headers))}/(.*\.h)"', doxyfile.read_text()):
        copy = headers / name
        copy.parent.mkdir(parents=True, exist_ok=True)
        lines = (ROOT / name).read_text(encoding="utf-8").split("\n")
        copy.write_text("\n".join(doxygen_filter.filtered(lines)), encoding="utf-8")


def undocumented_enumerators(xml_folder):
    found = set()
    for path in xml_folder.glob("*.xml"):
        for enum in xml.etree.ElementTree.parse(path).iter("memberdef"):
            where = enum.find("location")
            for value in enum.findall("enumvalue"):
                text = "".join(d.strip() for part in ("brief", "detailed") for d in value.find(f"{part}description").itertext())
                if not text:
                    name = enum.findtext("qualifiedname") or enum.findtext("name")
                    line = f"{ROOT / 'src' / where.get('file')}:{where.get('line')}"
                    found.add(f"{line}: error: Enumerator {value.findtext('name')} of {name} is not documented.")
    return sorted(found)


def main():
    doxyfile = pathlib.Path(sys.argv[1])
    folder = pathlib.Path(setting(doxyfile, "OUTPUT_DIRECTORY"))
    headers = folder / "headers"
    for made in (folder / "html", folder / "xml", headers):  # what is gone would stay
        shutil.rmtree(made, ignore_errors=True)
    copy_headers(doxyfile, headers)
    run = subprocess.run(["doxygen", doxyfile.name], cwd=doxyfile.parent, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    faults = sorted(set(line.replace(str(headers), str(ROOT)) for line in run.stdout.splitlines() if line.strip()))
    if run.returncode != 0:
        faults.append(f"doxygen ended with {run.returncode}")
    faults += undocumented_enumerators(folder / "xml")
    print("\n".join(faults + [f"{len(faults)} faults" if faults else f"{folder}/html/index.html"]))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
