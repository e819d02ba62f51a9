"""A page for each module of the C++ library: what every public header declares, with its documentation.

Doxygen reads the headers; its XML becomes pages of the guide, which so have one look, one search and dark mode.
"""

import re
import subprocess
import tempfile
import xml.etree.ElementTree as xml
from pathlib import Path

from guide_markdown import code, escape, table

DOXYFILE = """\
INPUT = {inputs}
RECURSIVE = YES
STRIP_FROM_PATH = {root}
FILE_PATTERNS = *.hpp
GENERATE_HTML = NO
GENERATE_LATEX = NO
GENERATE_XML = YES
XML_PROGRAMLISTING = NO
XML_OUTPUT = {output}
EXTRACT_ALL = YES
JAVADOC_AUTOBRIEF = NO
MACRO_EXPANSION = NO
QUIET = YES
WARNINGS = NO
WARN_IF_UNDOCUMENTED = NO
"""
VISIT = re.compile(r'visit\(\s*"(\w+)",\s*self\.\w+,\s*((?:"(?:[^"\\]|\\.)*"\s*)+)\)')


def cpp_pages(root: Path) -> dict[str, str]:
    """Pages by their place in the guide."""
    folders = [root / "libkr5/include", root / "sim/include"]
    with tempfile.TemporaryDirectory() as folder:
        text = DOXYFILE.format(inputs=" ".join(map(str, folders)), root=root, output=folder)
        subprocess.run(["doxygen", "-"], input=text, text=True, check=True, capture_output=True)
        return _pages(Reader(Path(folder), root), folders)


def _pages(reader: "Reader", folders: list[Path]) -> dict[str, str]:
    by_module: dict[str, list[tuple[str, str, str]]] = {}
    for file in sorted(f for folder in folders for f in folder.rglob("*.hpp")):
        folder = next(f for f in folders if file.is_relative_to(f))
        header = str(file.relative_to(folder))
        module = header.split("/")[1] if header.count("/") > 1 else "kr5"
        brief, section = reader.header(file, header)
        by_module.setdefault(module, []).append((header, brief, section))
    pages, rows = {}, []
    for module, headers in by_module.items():
        listed = [(f"[`{h}`](#{_anchor(h)})", escape(brief)) for h, brief, _ in headers]
        sections = "\n\n".join(section for *_, section in headers)
        pages[f"cpp-api/{module}.md"] = f"# {module} (C++)\n\n{table(('header', 'holds'), listed)}\n\n{sections}"
        rows += [(f"[`{h}`]({module}.md#{_anchor(h)})", escape(brief)) for h, brief, _ in headers]
    pages["cpp-api/index.md"] = (
        "# C++ reference\n\nEvery public header, by module, with what it declares. Public headers show Eigen and the"
        " standard library only. How to build and link: [C++](../cpp.md).\n\n" + table(("header", "holds"), rows)
    )
    return pages


def _anchor(header: str) -> str:
    return re.sub(r"\W+", "-", header)


class Reader:
    """Doxygen's XML of the headers."""

    def __init__(self, folder: Path, root: Path):
        self.folder = folder
        self.files: dict[str, xml.Element] = {}
        for file in folder.glob("*.xml"):
            compound = xml.parse(file).getroot().find("compounddef")
            if compound is not None and compound.get("kind") == "file":
                place = compound.find("location")
                if place is not None:
                    self.files[str(root / place.get("file", ""))] = compound

    def header(self, file: Path, header: str) -> tuple[str, str]:
        """Its description, and a section with all it declares."""
        compound = self.files[str(file)]
        source = file.read_text(encoding="utf-8")
        description = _described(compound)
        parts = [f"## `{header}` {{ #{_anchor(header)} }}", escape(description)]
        declared: list[tuple[int, str]] = []
        for member in compound.iter("memberdef"):
            if member.get("kind") in ("function", "enum", "typedef", "variable"):
                declared.append((_line(member), _member(member)))
        for inner in compound.findall("innerclass"):
            if inner.get("prot", "public") == "public" and "detail" not in (inner.text or ""):
                found = self._class(inner.get("refid", ""), source)
                if found:
                    declared.append(found)
        parts += [text for _, text in sorted(declared) if text]
        return description.split("\n")[0], "\n\n".join(parts)

    def _class(self, refid: str, source: str) -> tuple[int, str] | None:
        compound = xml.parse(self.folder / f"{refid}.xml").getroot().find("compounddef")
        if compound is None or compound.get("kind") not in ("struct", "class"):
            return None
        name = _text(compound.find("compoundname")).removeprefix("kr5::")
        parts = [f"### `{compound.get('kind')} {name}`", escape(_described(compound))]
        docs = _field_docs(compound, source)
        rows, methods = [], []
        for member in compound.iter("memberdef"):
            if member.get("prot") != "public":
                continue
            if member.get("kind") == "variable" and member.get("static") == "no":
                word = _text(member.find("name"))
                initial = _text(member.find("initializer")).removeprefix("=").strip()
                rows.append(
                    (
                        code(word),
                        code(_text(member.find("type"))),
                        code(initial) if initial else "",
                        escape(docs.get(word) or _described(member)),
                    )
                )
            elif member.get("kind") == "function" and _text(member.find("name")) != "each_field":
                methods.append(_member(member, level="####"))
        if rows:
            parts.append(table(("field", "type", "default", "meaning"), rows))
        return _line(compound), "\n\n".join([*parts, *(m for m in methods if m)])


def _line(element: xml.Element) -> int:
    place = element.find("location")
    return int(place.get("line", "0")) if place is not None else 0


def _text(element: xml.Element | None) -> str:
    return "" if element is None else " ".join("".join(element.itertext()).split())


def _paragraphs(*elements: xml.Element | None) -> str:
    """Text of descriptions, a line a paragraph; parameters and exceptions follow."""
    out: list[str] = []
    for element in elements:
        if element is None:
            continue
        for para in element.findall("para"):
            lead = "".join([para.text or "", *(_inline(c) for c in para)])
            if lead.strip():
                out.append(" ".join(lead.split()))
            for kinds in para.iter("parameterlist"):
                word = {"exception": "Throws", "retval": "Returns"}.get(kinds.get("kind", ""), "")
                for item in kinds.findall("parameteritem"):
                    names = ", ".join(f"`{_text(n)}`" for n in item.iter("parametername"))
                    said = _text(item.find("parameterdescription"))
                    out.append(f"{word + ' ' if word else ''}{names}: {said}")
            for section in para.iter("simplesect"):
                word = {"return": "Returns", "note": "Note:"}.get(section.get("kind", ""), "")
                out.append(f"{word} {_text(section)}".strip())
    return "\n".join(dict.fromkeys(out))


def _inline(child: xml.Element) -> str:
    if child.tag in ("parameterlist", "simplesect", "programlisting"):
        return child.tail or ""
    text = _text(child)
    shown = f"`{text}`" if child.tag in ("computeroutput", "verbatim") and text else f" {text}" if text else ""
    return shown + (child.tail or "")


def _described(element: xml.Element) -> str:
    return _paragraphs(element.find("briefdescription"), element.find("detaileddescription"))


def _field_docs(compound: xml.Element, source: str) -> dict[str, str]:
    """Documentation of the fields in the list of a struct, which the command and Python show, too."""
    place = compound.find("location")
    if place is None or place.get("bodystart") is None:
        return {}
    lines = source.split("\n")[int(place.get("bodystart", "1")) - 1 : int(place.get("bodyend", "1"))]
    found = VISIT.findall("\n".join(lines))
    return {name: "".join(re.findall(r'"((?:[^"\\]|\\.)*)"', texts)) for name, texts in found}


def _member(member: xml.Element, level: str = "###") -> str:
    """A function, an enumeration, a type or a constant; what is not documented is of no use to others."""
    name, kind = _text(member.find("name")), member.get("kind")
    said = _described(member)
    if kind == "enum":
        rows = [(code(_text(v.find("name"))), escape(_described(v))) for v in member.findall("enumvalue")]
        return f"{level} `enum {name}`\n\n{escape(said)}\n\n{table(('value', 'meaning'), rows)}"
    if not said or name == "enum_names" or name.startswith("operator"):
        return ""
    if kind == "function":
        template = member.find("templateparamlist")
        before = "" if template is None else "template <...> "
        shown = f"{before}{_text(member.find('type'))} {name}{_text(member.find('argsstring'))}".strip()
    else:
        shown = _text(member.find("definition")) or name
    return f"{level} `{name}`\n\n```cpp\n{shown.replace('kr5::', '')}\n```\n\n" + "\n\n".join(
        escape(line) for line in said.split("\n")
    )
