"""Light and dark pages: what the system prefers, what the reader chooses, and what is printed."""

import re
import shutil
from pathlib import Path

import matplotlib.figure
import pytest

from command_runner import run_command
from conftest import ROOT
from kr5_tools.pages import plot_style, rendering

DATA = Path(__file__).parent / "data"
TEMPLATES = ROOT / "tools/kr5_tools/pages/templates"
GROUND = "getComputedStyle(document.body).backgroundColor"
PICTURE = "document.getElementById('scene').toDataURL()"
PLOT = "getComputedStyle(document.querySelector('svg.plot text')).fill"
CLICK = "document.getElementById('theme').click()"


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """A page with a drawing in 3D and plots."""
    folder = tmp_path_factory.mktemp("theme")
    shutil.copy(DATA / "hand_eye.json", folder)
    done = run_command("report", "hand_eye.json", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder / "report.html"


def is_dark(browser):
    return sum(map(int, browser.evaluate(GROUND)[4:-1].split(","))) < 200


def test_a_page_follows_the_system_until_the_reader_chooses_and_remembers_the_choice(page, browser):
    for theme, other in (("light", "dark"), ("dark", "light")):
        browser.open_whole(page, 1400, theme)
        assert is_dark(browser) == (theme == "dark")
        assert browser.evaluate("document.getElementById('theme').textContent") == f"{other.capitalize()} mode"
        drawn, plotted = browser.evaluate(PICTURE), browser.evaluate(PLOT)
        browser.evaluate(CLICK)
        assert is_dark(browser) == (other == "dark")
        assert browser.evaluate(PICTURE) != drawn and browser.evaluate(PLOT) != plotted
        browser.open_whole(page, 390, theme)  # as after a reload
        assert is_dark(browser) == (other == "dark")
        browser.evaluate("localStorage.clear()")
    assert browser.illegible() == []


def test_a_page_without_storage_has_both_themes(page, browser):
    denied = "Object.defineProperty(window, 'localStorage', {get() { throw new Error('denied'); }})"
    script = browser.call("Page.addScriptToEvaluateOnNewDocument", source=denied)["identifier"]
    try:
        browser.open_whole(page, 1400, "dark")
        assert is_dark(browser)
        browser.evaluate(CLICK)
        assert not is_dark(browser) and browser.complaints() == []
    finally:
        browser.call("Page.removeScriptToEvaluateOnNewDocument", identifier=script)


def test_a_page_is_printed_light(page, browser):
    browser.open_whole(page, 1400, "light")
    light = browser.evaluate(PICTURE), browser.evaluate(PLOT)
    browser.open_whole(page, 1400, "dark")
    dark = browser.evaluate(PICTURE), browser.evaluate(PLOT)
    assert dark != light
    browser.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert (browser.evaluate(PICTURE), browser.evaluate(PLOT)) == light
    browser.evaluate("dispatchEvent(new Event('afterprint'))")
    assert (browser.evaluate(PICTURE), browser.evaluate(PLOT)) == dark
    browser.evaluate(CLICK)
    browser.evaluate(CLICK)  # dark by choice
    browser.call(
        "Emulation.setEmulatedMedia", media="print", features=[{"name": "prefers-color-scheme", "value": "dark"}]
    )
    assert browser.evaluate(GROUND) == "rgb(255, 255, 255)"
    assert browser.evaluate("getComputedStyle(document.getElementById('theme')).display") == "none"
    browser.call("Emulation.setEmulatedMedia", media="")
    browser.evaluate("localStorage.clear()")


def test_every_colour_of_plots_with_two_themes_has_both():
    css = (TEMPLATES / "report.css").read_text()
    light, dark = css[: css.index("{% set dark %}")], css[css.index("{% set dark %}") : css.index("{% endset %}")]
    for name in plot_style.THEMED.values():
        assert re.search(rf"--{name}: #[0-9a-fA-F]{{6}};", light) and re.search(rf"--{name}: #", dark), name
    names = set(re.findall(r"--[a-z-]+(?=: )", light))
    assert names == set(re.findall(r"--[a-z-]+(?=: )", dark))
    used = {
        n for f in TEMPLATES.iterdir() for n in re.findall(r'(?:var\(|themeColour\(|["\'])(--[a-z-]+)', f.read_text())
    }
    assert used <= names, used - names


def test_a_plot_in_a_page_refers_to_the_theme_and_keeps_other_colours():
    with plot_style.plt.rc_context(plot_style.STYLE):
        figure = matplotlib.figure.Figure(figsize=(2, 2))
        axes = figure.subplots()
        axes.plot([0, 1], color=plot_style.BLUE)
        axes.plot([1, 0], color="#123456")
        axes.set_title("<b> & #0072B2")

    class Plot:
        name, title, text, wide = "p", 'a "title"', "what it shows", False

    Plot.figure = figure
    svg = str(rendering.embed_plot(Plot)["svg"])
    assert "stroke: var(--plot-blue)" in svg and "stroke: #123456" in svg
    assert svg.startswith("<svg ") and 'aria-label="a &#34;title&#34;. what it shows"' in svg
    assert "&lt;b&gt; &amp; #0072B2" in svg and "<metadata" not in svg and "<?xml" not in svg
