"""The gait lab: charts against the studies they come from, and the page in a browser.

The browser is Debian's chromium with chromium-driver, driven by selenium; without them
those tests are skipped."""

import base64
import dataclasses
import hashlib
import importlib.util
import itertools
import json
import math
import re
import shutil
import time
import tomllib
import types

import numpy as np
import pytest
from commands import geomech

from geomech import lab, scenes
from geomech.mathematics.gaits import Butterfly, Circle, Points
from geomech.mathematics.systems.framed import NAME as MINIMUM_PERTURBATION
from geomech.scenes.write import text_of
from geomech.studies.maps import charts
from geomech.studies.maps.lab import GALLERY, Lab
from geomech.studies.scene_tables import SceneTables
from rft.core.refusal import Refusal

pytestmark = [
    pytest.mark.usefixtures("fastest"),
    pytest.mark.filterwarnings("ignore:.*departs from the polygon"),
]
OFF_CENTRE = Circle(amplitude=0.7, centre=(0.3, -0.4))
ALLOWED = {
    "profile.default_content_setting_values.automatic_downloads": 1
}  # more than one file
NEEDS = (
    importlib.util.find_spec("selenium")
    and shutil.which("chromium")
    and shutil.which("chromedriver")
)


@pytest.fixture(scope="module")
def glass():
    return charts.chart(scenes.load("three-link-glass"))


@pytest.mark.parametrize(
    "name", ["three-link-glass", "three-link-viscous", "serpenoid-glass"]
)
def test_tiers_are_those_of_the_study(name):
    scene = scenes.load(name).with_numerics(grid=15)
    study = SceneTables(scene)
    # Where it is nonlinear a study looks up what it otherwise solves for.
    near = 2e-6 if scene.system.traits.linear else 1e-7
    for tier, (net, _) in charts.tiers(charts.chart(scene), OFF_CENTRE).items():
        np.testing.assert_allclose(net, study.poses(tier, OFF_CENTRE), atol=near)


@pytest.mark.parametrize(
    ("tier", "near"), [("path", 1e-7), ("area", 1e-7), ("harmonic", 3e-5)]
)
def test_tiers_in_the_minimum_perturbation_frame(tier, near, glass):
    """The study fits its harmonics in that frame."""
    study = SceneTables(glass.scene).in_frame(MINIMUM_PERTURBATION)
    found = charts.tiers(glass, OFF_CENTRE, MINIMUM_PERTURBATION)[tier]
    np.testing.assert_allclose(found.net, study.poses(tier, OFF_CENTRE), atol=near)


@pytest.mark.parametrize("name", ["three-link-glass", "three-link-viscous"])
def test_errors_hold_and_are_not_idle(name):
    """For loops other than those by which the grid's error is measured."""
    scene = scenes.load(name)
    chart = charts.chart(scene)
    study = SceneTables(scene)
    held = []
    ratios = []
    for gait in charts.loops(chart.axes, 20, seed=11):
        truth = study.poses("direct", gait)
        found = charts.tiers(chart, gait)
        off = {tier: distances(net, truth) for tier, (net, _) in found.items()}
        held.append([(off[tier] <= found[tier].error).tolist() for tier in found])
        ratios.append(found["harmonic"].error[0] / off["harmonic"][0])
    assert (np.mean(held, 0) >= 0.9).all(), np.mean(held, 0)
    assert np.median(ratios) < 12


def test_a_gait_that_is_no_series_is_one_for_the_page():
    gait = Points(points=((1.0, 0.2), (0.3, 0.9), (-0.8, 0.1), (-0.2, -0.7)))
    mean, cos, sin = charts.fourier_series(gait)
    t = np.linspace(0, 2 * np.pi, 50)
    kt = np.outer(t, np.arange(1, cos.shape[1] + 1))
    assert np.abs(mean).min() > 0.01
    np.testing.assert_allclose(
        mean + np.cos(kt) @ cos.T + np.sin(kt) @ sin.T, gait.unit(t), atol=2e-4
    )


def distances(net, truth):
    x, y, heading = net - truth
    return np.array([np.hypot(x, y), abs(heading)])


@pytest.fixture(scope="module")
def family():
    scene = scenes.load("three-link-glass").with_numerics(grid=21, harmonics=9)
    return Lab((scene,), {"medium.C": [1.0, 1.5, 2.2, 3.0]}).charts(
        lambda fraction: None
    )


def test_a_family_has_the_scene_as_a_member(family):
    (chart,) = family
    assert chart.family.values.tolist() == [1.0, 1.5, 1.8, 2.2, 3.0]
    own = charts.tiers(charts.chart(chart.scene), OFF_CENTRE)
    for tier, (net, _) in charts.tiers(chart.member(1.8), OFF_CENTRE).items():
        np.testing.assert_allclose(net, own[tier].net, atol=1e-6)


def harmonic(chart):
    return charts.tiers(chart, OFF_CENTRE)["harmonic"]


def test_between_members_the_error_says_how_far_off(family):
    (chart,) = family
    medium = dataclasses.replace(chart.scene.system.medium, C=2.6)
    true = harmonic(charts.chart(chart.scene.changed(medium=medium)))
    guess = harmonic(chart.member(2.6))
    assert 1e-7 < distances(true.net, guess.net)[0] < chart.family.error < 1e-3
    assert guess.error[0] > chart.family.error


def test_one_file_without_network_or_markup(glass):
    """Scripts and styles are those whose hashes the policy allows; the text of a scene
    is data."""
    name = "</script><img src=x onerror=alert(1)>\u2028'\""
    odd = dataclasses.replace(glass, scene=glass.scene.changed(name=name))
    text = lab.page([glass, odd])
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text)[1]
    assert policy.startswith("default-src 'none'; ") and "unsafe" not in policy
    for element in ("script", "style"):
        (inside,) = re.findall(rf"<{element}>(.*?)</{element}>", text, re.DOTALL)
        sha = base64.b64encode(hashlib.sha256(inside.encode()).digest()).decode()
        assert f"{element}-src 'sha256-{sha}'" in policy
    assert "<img" not in text
    assert "://" not in text.replace("http://www.w3.org/2000/svg", "")
    data = json.loads(re.search(r'id="data">(.*?)</script>', text, re.DOTALL)[1])
    assert [s["name"] for s in data["scenes"]] == ["three-link-glass", name]


@pytest.mark.parametrize(
    "name", ["seven-link-wave", "no-slip-snake", "differential-drive"]
)
def test_scenes_without_a_chart_are_refused_before_others_are_computed(name):
    with pytest.raises(Refusal, match=f"^{name}: "):
        Lab((scenes.load("three-link-glass"), scenes.load(name))).check()


# In a browser


@pytest.fixture(scope="module")
def page(family, tmp_path_factory):
    """The address of a page of seven scenes, and their charts by name."""
    path = tmp_path_factory.mktemp("lab") / "lab.html"
    scene = family[0].scene.changed(name="<b onclick=alert(1)>")
    odd = dataclasses.replace(family[0], scene=scene)
    gallery = [charts.chart(scenes.load(name)) for name in GALLERY[1:]]
    shown = [*family, *gallery, odd]
    path.write_text(lab.page(shown), encoding="utf-8")
    assert path.stat().st_size < 4_000_000
    return path.as_uri(), {chart.scene.name: chart for chart in shown}


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    if not NEEDS:
        pytest.skip("needs selenium, chromium and chromedriver")
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    folder = tmp_path_factory.mktemp("browser")
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium")
    for argument in (*ARGUMENTS, f"--user-data-dir={folder / 'profile'}"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    preferences = {"download.default_directory": str(folder), **ALLOWED}
    options.add_experimental_option("prefs", preferences)
    service = Service(shutil.which("chromedriver"))
    driver = webdriver.Chrome(options=options, service=service)
    driver.folder = folder
    yield driver
    driver.quit()


ARGUMENTS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--window-size=1400,1400",
)


@pytest.fixture
def opened(browser, page):
    """The page anew, with an empty address; afterwards its console has no message."""
    go(browser, page[0])
    yield browser
    assert browser.get_log("browser") == []


def go(browser, address):
    browser.get("about:blank")
    browser.get(address)


def js(browser, expression, *arguments):
    """Return an expression of JavaScript, with `arguments`."""
    return browser.execute_script(f"return {expression}", *arguments)


def state(browser):
    return js(browser, "lab.state()")


def until(condition, seconds=10):
    end = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < end
        time.sleep(0.01)
    return found


def text_of_element(browser, name):
    return js(browser, "document.getElementById(arguments[0]).textContent", name)


def said(browser):
    return text_of_element(browser, "said")


def click(browser, *selectors):
    for selector in selectors:
        js(browser, "document.querySelector(arguments[0]).click()", selector)


def choose_file(browser, name, text=None):
    """Give the page a file, and wait until it says what it made of it."""
    if text is not None:
        (browser.folder / name).write_text(text)
    browser.find_element("id", "open").send_keys(str(browser.folder / name))
    return until(lambda: said(browser))


def saved(browser, kind):
    """Save a file from the page, and return it."""
    name = "map" if kind in ("svg", "png") else "loop"
    file = browser.folder / f"{name}.{kind}"
    file.unlink(missing_ok=True)
    click(browser, f"#save-{kind}")
    until(lambda: file.exists() and file.stat().st_size)
    return file


def points_in(state):
    pairs = re.search(r"points=([^&]*)", state)[1].split(";")
    return [[float(x) for x in pair.split(",")] for pair in pairs]


def test_the_page_computes_what_python_does(opened, page):
    """Loops of all scenes, half of which cross themselves, in both frames, at members
    of a family and between."""
    rng = np.random.default_rng(5)
    asked = []
    expected = []
    for name, chart in page[1].items():
        values = [None] if chart.family is None else [1.8, 3.0, 2.45]
        loops = itertools.product(charts.loops(chart.axes, 6, seed=8), chart.frames)
        for k, (gait, frame) in enumerate(loops):
            value = values[k % len(values)]
            member = chart if value is None else chart.member(value)
            size = round(rng.uniform(0.4, 1.0), 3)
            gait = Points(points=gait.points, amplitude=size, reverse=bool(k % 2))
            asked.append([name, frame, gait.points, size, [0, 0], gait.reverse, value])
            found = charts.tiers(member, gait, frame)
            tiers = [found[tier] for tier in ("harmonic", "path", "area")]
            expected.append([[*net, *error] for net, error in tiers])
    got = js(opened, "arguments[0].map((a) => lab.predict(...a))", asked)
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-6)


CHOOSE = (
    "const box = document.getElementById(arguments[0]); box.value = arguments[1];"
    "box.dispatchEvent(new Event(arguments[2]))"
)


def test_component_frame_and_family_are_chosen(opened):
    click(opened, "#component button:nth-child(3)")
    opened.execute_script(CHOOSE, "frame", MINIMUM_PERTURBATION, "change")
    opened.execute_script(CHOOSE, "value", "2.5", "input")
    now = state(opened)
    assert "component=heading" in now
    assert f"frame={MINIMUM_PERTURBATION}&value=2.5" in now


def test_climbing_goes_further(opened):
    best = "parseFloat(document.querySelector('tr.best td').textContent)"
    start = js(opened, best)
    click(opened, "#climb")
    until(lambda: js(opened, best) > 3 * start, 30)
    click(opened, "#climb", "#undo")
    assert js(opened, best) == start


@pytest.mark.parametrize("loop", ["butterfly&reverse=0&value=2.5", "circle"])
def test_a_loop_is_saved_and_read_again(opened, page, loop):
    go(opened, f"{page[0]}#loop={loop}&amplitude=0.9&centre=0.1,-0.2")
    before = state(opened)
    scene = scenes.load(saved(opened, "toml"))
    assert scene.gait.centre == (0.1, -0.2)
    assert scene.frequency is None  # the page chooses one to play it at
    assert scene.system.medium.C == (2.5 if "value" in loop else 1.8)
    click(opened, "[data-loop='own']")
    assert choose_file(opened, "loop.toml").startswith("Read the loop")
    assert state(opened) == before


def test_predictions_and_pictures_are_saved(opened, page):
    loop = "loop=butterfly&amplitude=0.9&centre=0.1,-0.2&reverse=0&value=2.5"
    go(opened, f"{page[0]}#scene=three-link-glass&{loop}")
    assert saved(opened, "png").read_bytes().startswith(b"\x89PNG")
    assert "loop=butterfly" in saved(opened, "svg").read_text(encoding="utf-8")
    row = saved(opened, "csv").read_text().splitlines()[2]
    member = page[1]["three-link-glass"].member(2.5)
    gait = Butterfly(amplitude=0.9, centre=(0.1, -0.2))
    expected = charts.tiers(member, gait)["harmonic"]
    numbers = [float(x) for x in row.split(",")[1:]]
    np.testing.assert_allclose(numbers, [*expected.net, *expected.error], atol=1e-6)


@pytest.fixture
def preferring(opened):
    """A function that lets the browser prefer light or dark colours."""

    def prefer(colours):
        features = [{"name": "prefers-color-scheme", "value": colours}]
        opened.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})

    yield prefer
    prefer("")


# Of the page, and of its texts but for those of pressed buttons, as CSS defines it.
LUMINANCES = """(() => {
  const luminance = (colour) => {
    const [r, g, b] = colour.match(/[\\d.]+/g).map((x) => x / 255)
      .map((x) => (x > 0.04045 ? ((x + 0.055) / 1.055) ** 2.4 : x / 12.92));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const page = getComputedStyle(document.body).backgroundColor;
  const texts = [...document.querySelectorAll("main :not([aria-pressed=true])")].filter((element) =>
    [...element.childNodes].some((node) => node.nodeType === 3 && node.data.trim()));
  return [page, ...texts.map((element) => {
    const style = getComputedStyle(element);
    return element.namespaceURI.endsWith("svg") ? style.fill : style.color;
  })].map(luminance);
})()"""


def test_dark_where_the_browser_prefers_it_and_the_saved_map_is_not(opened, preferring):
    click(opened, "#play")  # the map has a dot that moves with the swimmer
    preferring("light")
    light = saved(opened, "svg").read_text(encoding="utf-8")
    preferring("dark")
    background, *texts = js(opened, LUMINANCES)
    assert background < 0.05
    assert (min(texts) + 0.05) / (background + 0.05) > 4.5
    assert saved(opened, "svg").read_text(encoding="utf-8") == light
    assert "var(" not in light


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("nothing", "it is not TOML"),
        ("[medium]\nlaw = 'viscous'\n", "no [gait] in it"),
        ("[gait]\nkind = 'spiral'\n", "a loop is one of"),
        (
            "[gait]\nkind = 'points'\npoints = [[1e999, 0], [0, 1], [1, 1]]\n",
            "points is a number from",
        ),
        (
            "[gait]\nkind = 'points'\npoints = [[0, 0], [<img src=x onerror=alert(1)>\n",
            "a value cannot be read in line 3",
        ),
        (
            "[gait]\nkind = 'points'\npoints = [[0, 0], [0, 1]]\n",
            "a loop has 3 to 60 points",
        ),
        ("[gait]\nkind = 'butterfly'\namplitude_deg = 30\n", "cannot use"),
    ],
)
def test_files_that_are_none(opened, text, reason):
    before = state(opened)
    told = choose_file(opened, "bad.toml", text)
    assert told.startswith("Cannot use bad.toml") and reason in told
    assert state(opened) == before


SPELLED = (
    "[gait]\nkind = 'points'\npoints = [\n[1, 0],\n[0, 1],  # ]\n[-1, -1]\n]\n",
    "gait = { kind = 'circle', amplitude = 0.5 }\n",
    "gait.kind = 'circle'\ngait.'amplitude' = 5e-1\n",
    "['gait']  # [medium]\n'kind' = 'circle'\namplitude_deg = +30\n",
    ' [ gait ]\n\tkind = """\\\n  \\u0063ircle"""\n',
    "[gait]\nkind = '''\ncircle'''\namplitude = 1_0e-1 # [[x]]\n",
)
REST_OF_SCENE = "\n[medium]\nlaw = 'viscous'\n[body]\nkind = 'chain'\n"


@pytest.mark.parametrize("spelled", SPELLED)
def test_a_scene_is_saved_without_its_gait_however_that_is_spelled(glass, spelled):
    scene = scenes.parse(spelled + REST_OF_SCENE)
    chart = dataclasses.replace(glass, scene=scene)
    (text,) = lab.data([chart])["scenes"][0]["toml"]
    saved = scenes.parse(text + "[gait]\nkind = 'butterfly'\n")
    assert saved == scene.changed(gait=Butterfly())


TOML = (
    *SPELLED,
    "",
    "a.b.c = 1\na.b.d = 2\n[a.e]\nf = 'x'",
    "[[a]]\nb = 1\n[[a]]\n[a.c]\nd = [[], [1, [2.5]],]\n[[a.e]]\n",
    "a = {b = {c = 1}, d.e = 2}\nb = [{}, {x = 1}]",
    "a = '''\n'x\ny'''''\nb = \"\"\"a\\\n\n   b\\\"\"\"\"\"\"",
    "a = [0x_1]",
    "a = [0xff, 0o17, 0b1_0, 1_000, -0, +1.5e-3, 1e6]\r\nb = true",
    "[a.b]\n[a]\nc = 1",
    "a = \"\\u00e9\\U0001F600\\t\"\n'' = 1\n__proto__ = 2\nconstructor = 3",
    "[a]\n[a]",
    "a = 1\na = 2",
    "a = 1\na.b = 2",
    "[a]\nb.c = 1\n[a.b]",
    "a.b = 1\n[a]",
    "a = {b = 1}\n[a.c]",
    "a = []\n[[a]]",
    "[a.b]\n[[a]]",
    "a = {b = 1,}",
    "a = {b = 1\n}",
    "a = 01",
    "a = 1.",
    "a = .5",
    "a = 1__0",
    "a = 'x\ny'",
    'a = "\\x41"',
    'a = "\\uD800"',
    "a = 1 b = 2",
    "a = [1 2]",
    "a = [1, , 2]",
    "a",
    "= 1",
    "a = ",
    "[a",
    "[]",
    'a = "\x00"',
    "# \x7f",
    "a = tru",
    "a = [" * 300 + "]" * 300,
)


def of_each(browser, expression, texts):
    """Return an expression of JavaScript in ``text`` for each of some texts; "" where
    it fails."""
    told = f"try {{ return {expression} }} catch (error) {{ return '' }}"
    return js(browser, f"arguments[0].map((text) => {{ {told} }})", texts)


def test_the_page_reads_the_toml_that_python_reads(opened):
    read = of_each(opened, "JSON.stringify(lab.tables(text))", TOML)
    for text, found in zip(TOML, read, strict=True):
        try:
            expected = tomllib.loads(text)
        except (ValueError, RecursionError):
            assert found == "", text
        else:
            assert json.loads(found) == expected, text


def is_a_gait(text):
    try:
        scenes.parse(text + REST_OF_SCENE)
    except Refusal:
        return False
    return True


GOOD = {
    "fourier": {"cos": [[1.0], [0.5]], "sin": [[0.0], [1.0]]},
    "points": {"points": [[0, 0], [1, 0], [0, 1], [0, 0]]},
}


KEYS = ["amplitude", "centre", "reverse", "frequency", "tilt", "semi_axes", "cos"]


KEYS += ["points", "centre_deg", "amplitude_deg", "frequency_deg", "nothing"]


VALUES = [
    0, 1, -1, 0.5, 1e4, 1.1e4, 1e7, -1e7, math.inf, math.nan, True, False, "true",
    "", [], [0.1, -0.2], [0.1], [0.1, "a"], [0.1, True], [1, 2, 3], [[0.1, 0.2]], {},
    [[]], [[1], [2]], [[1, 2], [3]], [[0, 1], [0, 1], [1, 0]], [["1"], [0]],
]  # fmt: skip


@pytest.mark.parametrize(
    "kind", ["circle", "ellipse", "butterfly", "fourier", "points"]
)
@pytest.mark.filterwarnings("ignore::geomech.core.errors.UnitWarning")
def test_the_page_takes_and_refuses_what_the_reader_does(opened, kind):
    """Values of every key in turn, of right and of wrong types, within and beyond
    bounds."""
    texts = []
    for key, value in itertools.product(KEYS, VALUES):
        gait = {"kind": kind, **GOOD.get(kind, {}), key: value}
        texts.append(text_of({"gait": gait}))
    loops = of_each(opened, "lab.opened(text)[0].loop", texts)
    taken = {text for text, loop in zip(texts, loops, strict=True) if loop}
    assert taken == {text for text in texts if is_a_gait(text)}
    assert len(taken) > 10


def test_long_files_are_read_at_once(opened):
    """Of a loop after many blank lines, and of texts that are nearly TOML."""
    texts = []
    for filler in ("\n", " ", "\t\n", "#", "a = 1\n#\n", "0", "1_", "a.", "'", "["):
        head = filler * (60_000 // len(filler))
        texts.append(f"{head}\n[gait]\nkind = 'circle'\n")
    assert {*of_each(opened, "lab.opened(text)[0].loop", texts)} == {"", "circle"}


@pytest.mark.parametrize(
    "address",
    [
        "scene=%3Cimg%20src=x%20onerror=alert(1)%3E",
        "loop=points&points=1,2;3",
        "loop=__proto__",
        "amplitude=1e99",
        "%E0%A4%A",
        "centre=NaN,0",
        "reverse=true",
        "amplitude=0x1",
        "amplitude=+%201",
    ],
)
def test_addresses_that_say_nothing(opened, page, address):
    go(opened, f"{page[0]}#{address}")
    assert state(opened).startswith("scene=three-link-glass&loop=circle")
    assert said(opened).startswith("The address is not used") or address.startswith("%")


def test_a_dragged_point_is_undone_and_redone(opened):
    from selenium.webdriver import ActionChains

    first = state(opened)
    handle = opened.find_element("css selector", "[data-handle='2'] .hit")
    drag = ActionChains(opened, duration=0).click_and_hold(handle)
    drag.move_by_offset(15, -30).move_by_offset(5, -3).release().perform()
    dragged = until(lambda: state(opened) != first and state(opened))
    x, y = points_in(dragged)[2]
    assert x > 0.05 and y > 1.1  # it was at (0, 1), pixels are some 0.01 rad
    click(opened, "#undo")
    assert state(opened) == first
    click(opened, "#redo")
    assert state(opened) == dragged


def test_keys_move_insert_and_delete_points(opened):
    from selenium.webdriver import ActionChains, Keys

    handles = "document.querySelectorAll('.handle').length"
    first = state(opened)
    js(opened, "document.querySelector(\"[data-handle='1']\").focus()")
    ActionChains(opened).send_keys(Keys.ARROW_LEFT).perform()
    assert state(opened) != first
    before = js(opened, handles)
    ActionChains(opened).send_keys(Keys.INSERT).perform()
    assert js(opened, handles) == before + 1
    ActionChains(opened).send_keys(Keys.DELETE).perform()
    assert js(opened, handles) == before


def test_without_a_file_a_browser_opens_the_page(monkeypatch, tmp_path):
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setattr("tempfile.mkdtemp", lambda prefix: str(tmp_path))
    assert geomech("lab", "three-link-viscous")[0] == 0
    assert opened == [(tmp_path / "lab.html").as_uri()]
    assert (tmp_path / "lab.html").exists()


def test_a_loop_that_leaves_the_map(opened, page):
    go(opened, f"{page[0]}#loop=circle&amplitude=2.7")
    assert text_of_element(opened, "verdict").startswith("The loop leaves the map")
    click(opened, "#save-csv")
    assert said(opened) == "The loop leaves the map."


NAMELESS = (
    "[...document.querySelectorAll('button, input, select, [tabindex]')]"
    ".filter((e) => e.getClientRects().length && !(e.textContent.trim() || e.ariaLabel"
    " || (e.labels && e.labels[0].textContent.trim()))).map((e) => e.outerHTML)"
)


def test_controls_have_labels(opened):
    assert js(opened, NAMELESS) == []


def test_the_name_of_a_scene_is_text(opened, page):
    go(opened, f"{page[0]}#scene=%3Cb%20onclick%3Dalert(1)%3E")
    assert js(opened, "document.querySelectorAll('b').length") == 0
    assert "<b onclick=alert(1)>" in text_of_element(opened, "foot")


def test_what_a_series_leaves_is_summed_along_the_loop():
    """Of a circle that goes round steadily where what is left is linear, the value at
    its centre; the error of the grid is that of its length, and that between members of
    a family counts besides."""
    axes = np.linspace(-2, 2, 9), np.linspace(-1.5, 2.5, 9)
    first, second = np.meshgrid(*axes, indexing="ij")
    left = 1 + 0.2 * first - 0.1 * second
    residual = np.stack([0.03 * left, 0.04 * left, 0.07 * (1 + 0.3 * second)], -1)
    errors = {"grid_error": (1e-3, 2e-3), "between": 0.5}
    chart = types.SimpleNamespace(axes=axes, residual=residual, **errors)
    loop = Circle(amplitude=0.6, centre=(0.4, 0.7)).cycle(64)
    length = 2 * np.pi * 0.6
    place = length * (0.35 * 0.05 * (1 + 0.2 * 0.4 - 0.1 * 0.7) + 1e-3) + 0.5
    heading = length * (0.45 * 0.07 * (1 + 0.3 * 0.7) + 2e-3)
    assert charts.harmonic_error(chart, *loop) == pytest.approx((place, heading))


def test_loops_of_a_chart_fill_its_field_and_stay_within():

    axes = np.linspace(-1.0, 3.0, 5), np.linspace(-0.5, 0.1, 5)
    loops = charts.loops(axes, 20, seed=3)
    assert {len(gait.points) for gait in loops} >= {3, 7}
    curves = np.array([gait.cycle(300)[0] for gait in loops])
    reach = (np.abs(curves - [1.0, -0.2]) / [2.0, 0.3]).max((1, 2))
    assert reach.max() < 1.001 and (reach > 0.9).any()
