"""The guide: it builds without a broken link, and its commands run as typed and print what is quoted."""

import os
import re
import subprocess
import sys
from types import SimpleNamespace

import pytest

from conftest import ROOT

sys.path[:0] = [str(ROOT / "tools/guide")]

import page_blocks

GUIDE = ROOT / "share/doc"
PAGES = [
    p
    for p in page_blocks.pages(GUIDE)
    if any(b.language in page_blocks.RUN for b in page_blocks.read_blocks(p.read_text()))
]
MOST_NOT_RUN = 0.3  # of the blocks of the guide


def blocks(page):
    return page_blocks.read_blocks(page.read_text(encoding="utf-8"))


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(GUIDE)))
def test_the_commands_of_a_page_run_and_print_what_it_quotes(page, tmp_path, share):
    environment = page_blocks.prepare(tmp_path, share)
    for block in blocks(page):
        if block.title:
            (tmp_path / block.title).write_text(block.text + "\n", encoding="utf-8")
        elif block.language in page_blocks.RUN and not block.not_run:
            printed = page_blocks.run_block(block, tmp_path, environment)
            if block.output is not None:
                problem = page_blocks.differences(block.output, printed)
                assert not problem, f"{page.name}, line {block.line}: {problem}\n{printed}"


def test_few_commands_are_not_run():
    every = [b for page in PAGES for b in blocks(page) if b.language in page_blocks.RUN]
    assert len(every) > 60
    assert sum(bool(b.not_run) for b in every) < MOST_NOT_RUN * len(every)


def build(folder, config=ROOT / "tools/guide/mkdocs.yml"):
    environment = {**os.environ, "KR5_GUIDE_DRAFT": "1", "NO_MKDOCS_2_WARNING": "1"}
    words = [sys.executable, "-m", "mkdocs", "build", "--strict", "-f", str(config), "-d", str(folder)]
    return subprocess.run(words, capture_output=True, text=True, env=environment, timeout=300)


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    pytest.importorskip("mkdocs", reason="MkDocs is not installed") if not os.environ.get("CI") else None
    folder = tmp_path_factory.mktemp("guide")
    done = build(folder)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def test_the_guide_has_its_pages(built):
    for name in ("index", "effects", "formats/cell", "commands/gap", "python-api/kr5.gap", "cpp-api/gap", "benchmarks"):
        assert (built / f"{name}.html").is_file(), name
    cell = (built / "formats/cell.html").read_text()
    for key in ("natural_frequency", "T_B_W", "joint_torque", "stand_off"):
        assert f"<code>{key}</code>" in cell
    assert "make:" not in re.sub(r"<script.*?</script>", "", cell, flags=re.DOTALL)


def test_a_broken_link_fails(tmp_path):
    """Of a guide of one page with the settings of the guide."""
    (tmp_path / "doc").mkdir()
    settings = (ROOT / "tools/guide/mkdocs.yml").read_text()
    validation = re.search(r"^validation:\n(?:  .*\n)+", settings, re.MULTILINE)[0]
    (tmp_path / "mkdocs.yml").write_text(f"site_name: x\ndocs_dir: doc\nplugins: []\n{validation}")
    page = tmp_path / "doc/index.md"
    page.write_text("# A\n\n[here](#a)\n")
    assert build(tmp_path / "site", tmp_path / "mkdocs.yml").returncode == 0
    for link in ("[away](nowhere.md)", "[there](#b)", "![none](none.png)"):
        page.write_text(f"# A\n\n{link}\n")
        assert build(tmp_path / "site", tmp_path / "mkdocs.yml").returncode != 0, link


LINK = re.compile(r"\]\((?![a-z]+:|#)([^)\s#]+)")  # to another file
LINKED = [*sorted(GUIDE.rglob("*.md")), *(ROOT / f"{name}.md" for name in ("README", "CONTRIBUTING", "CONVENTIONS"))]


@pytest.mark.parametrize("page", LINKED, ids=lambda p: str(p.relative_to(ROOT)))
def test_the_links_of_a_page_lead_somewhere_in_a_checkout(page):
    words = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)  # no code
    dead = [link for link in LINK.findall(words) if not (page.parent / link).exists()]
    assert dead == []


def test_links_into_the_checkout_lead_to_pages_of_the_guide():
    pytest.importorskip("mkdocs", reason="MkDocs is not installed") if not os.environ.get("CI") else None
    import hooks

    assert all((ROOT / place).exists() for place in hooks.PLACES)
    for source, link, expected in (
        ("a.md", "../../CONVENTIONS.md#frames", "conventions.md#frames"),
        ("formats/a.md", "../../../libkr5/include/kr5/force", "../cpp-api/force.md"),
        ("formats/a.md", "../../../libkr5/include/kr5", "../cpp-api/index.md"),
        ("a.md", "../../README.md", "../../README.md"),
    ):
        page = SimpleNamespace(file=SimpleNamespace(src_uri=source))
        assert hooks.on_page_markdown(f"see [it]({link}).", page, None, None) == f"see [it]({expected})."


def test_pages_need_no_network(built, browser):
    for name in ("index.html", "formats/cell.html", "sim-and-robot.html"):
        for width, theme in ((390, "light"), (1400, "dark")):
            browser.open(built / name, width, theme)
            assert [url for url in browser.requests() if not url.startswith(("file:", "data:", "blob:"))] == []
            assert browser.complaints() == []
            assert browser.evaluate("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize(
    ("quoted", "printed", "same"),
    [
        ("a 1.25 b", "a 1.26 b", True),
        ("a 1.25 b", "a 1.27 b", False),
        ("a 3 b", "a 4 b", False),
        ("a 3 b", "c 3 b", False),
        ("…\nb", "x\ny\nb", True),
        ("a …\nb", "a x y\nb", True),
        ("a\nb", "a\nx\nb", False),
        ("a", "a\nb", False),
        ("a\n…", "a\nb", True),
        ("2.1e-05 m", "2.2e-05 m", True),
        ("2.1e-05 m", "2.1e-04 m", False),
    ],
)
def test_quoted_output_is_compared(quoted, printed, same):
    assert (page_blocks.differences(quoted, printed) == "") == same


def test_blocks_are_read():
    page = (
        "# A\n\n<!-- not run: why -->\n```sh\na\n```\n\n```sh\nb\n```\n\n```text\nc\n```\n\n"
        'text\n\n```text\nd\n```\n\n```yaml title="x.yaml"\ne\n```\n'
    )
    found = page_blocks.read_blocks(page)
    assert [(b.language, b.text, b.not_run, b.output, b.title) for b in found] == [
        ("sh", "a", "why", None, ""),
        ("sh", "b", "", "c", ""),
        ("text", "d", "", None, ""),
        ("yaml", "e", "", None, "x.yaml"),
    ]
