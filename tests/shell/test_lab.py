"""The gait lab: charts against the studies they come from, what stands in the page, and the page in a real browser.

The browser is Debian's chromium with chromium-driver, driven by selenium; without them those tests are skipped."""

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
from geomech.scenes.write import text_of, without_gait
from geomech.shell.describe.lab import lines
from geomech.studies.maps import charts
from geomech.studies.maps.lab import GALLERY, Lab
from geomech.studies.scene_tables import SceneTables
from rft.core.refusal import Refusal

pytestmark = [
    pytest.mark.usefixtures("fastest"),
    pytest.mark.filterwarnings("ignore:.*leaves the polygon"),
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
    study, found = SceneTables(scene), charts.tiers(charts.chart(scene), OFF_CENTRE)
    for tier, (net, _) in found.items():
        near = (
            2e-6 if scene.system.traits.linear else 1e-7
        )  # there a study solves, and looks nothing up
        np.testing.assert_allclose(net, study.poses(tier, OFF_CENTRE), atol=near)


def test_tiers_in_the_minimum_perturbation_frame(glass):
    study, found = (
        SceneTables(glass.scene).in_frame(MINIMUM_PERTURBATION),
        charts.tiers(glass, OFF_CENTRE, MINIMUM_PERTURBATION),
    )
    for tier, near in (
        ("path", 1e-7),
        ("area", 1e-7),
        ("harmonic", 3e-5),
    ):  # the study fits its harmonics in that frame
        np.testing.assert_allclose(
            found[tier].net, study.poses(tier, OFF_CENTRE), atol=near
        )
    own = charts.tiers(glass, OFF_CENTRE)
    assert np.abs(found["harmonic"].net - own["harmonic"].net).max() > 1e-3


@pytest.mark.parametrize("name", ["three-link-glass", "three-link-viscous"])
def test_errors_hold_and_are_not_idle(name):
    """Against the force balance, for loops other than those by which the grid's error is measured."""
    scene = scenes.load(name)
    chart, study, held, ratios = charts.chart(scene), SceneTables(scene), [], []
    for gait in charts.loops(chart.axes, 40, seed=11):
        found, truth = charts.tiers(chart, gait), study.poses("direct", gait)
        off = {
            tier: (np.hypot(*(net - truth)[:2]), abs(net[2] - truth[2]))
            for tier, (net, _) in found.items()
        }
        held.append(
            [x <= e for tier, p in found.items() for x, e in zip(off[tier], p.error)]
        )
        ratios.append(found["harmonic"].error[0] / off["harmonic"][0])
    assert (np.mean(held, 0) >= 0.9).all(), np.mean(held, 0)
    assert np.median(ratios) < 12


def test_harmonics_that_are_next_to_nothing_are_left_out(monkeypatch):
    monkeypatch.setattr(charts, "SMALLEST_HARMONIC", 0.05)
    series = SceneTables(
        scenes.load("three-link-glass").with_numerics(grid=9)
    ).compute_harmonics()
    size = np.abs(series.coefficients).max((0, 2, 3)).reshape(-1, 2).max(-1)
    found = charts.chart(scenes.load("three-link-glass").with_numerics(grid=9))
    assert (
        found.highest
        == 1 + 2 * np.flatnonzero(size > 0.05 * size.max()).max()
        == 7
        < series.highest
    )


def test_a_gait_that_is_no_series_is_one_for_the_page():
    gait = Points(points=((1.0, 0.2), (0.3, 0.9), (-0.8, 0.1), (-0.2, -0.7)))
    mean, cos, sin = charts.fourier_series(gait)
    t = np.linspace(0, 2 * np.pi, 50)
    kt = np.outer(t, np.arange(1, cos.shape[1] + 1))
    assert np.abs(mean).min() > 0.01
    np.testing.assert_allclose(
        mean + np.cos(kt) @ cos.T + np.sin(kt) @ sin.T, gait.unit(t), atol=2e-4
    )


def test_a_loop_that_leaves_the_chart(glass):
    with pytest.raises(
        Refusal, match=r"alpha_1 = 2.7 rad lies outside the field's -2.5 to 2.5"
    ):
        charts.tiers(glass, Circle(amplitude=2.7))


@pytest.fixture(scope="module")
def family():
    scene = scenes.load("three-link-glass").with_numerics(grid=21, harmonics=9)
    done = []
    found = Lab((scene,), {"medium.C": [1.0, 1.5, 2.2, 3.0]}).charts(done.append)
    assert done == sorted(done) and done[-1] == 1.0 and len(done) == 10
    return found


def test_a_family_has_the_scene_as_a_member(family):
    (chart,) = family
    assert (chart.shapes, chart.highest) == (441, 9)
    assert chart.family.values.tolist() == [1.0, 1.5, 1.8, 2.2, 3.0]
    line = f"three-link-glass over medium.C: 5 members, interpolated between them to {chart.family.error:.1e} BL"
    assert lines(family) == [
        "three-link-glass  441 shapes, harmonics to 9",
        line,
    ]
    own = charts.tiers(charts.chart(chart.scene), OFF_CENTRE)
    for tier, (net, _) in charts.tiers(chart.member(1.8), OFF_CENTRE).items():
        np.testing.assert_allclose(net, own[tier].net, atol=1e-6)


def test_between_members_the_error_says_how_far_off(family):
    (chart,) = family
    other = Lab((chart.scene,), {"medium.C": [2.6]})._grid.scene_factory((2.6,))
    true, guess = (
        charts.tiers(charts.chart(other), OFF_CENTRE)["harmonic"],
        charts.tiers(chart.member(2.6), OFF_CENTRE)["harmonic"],
    )
    off = np.hypot(*(true.net - guess.net)[:2])
    assert 1e-7 < off < chart.family.error < 1e-3
    member = charts.tiers(chart.member(2.2), OFF_CENTRE)["harmonic"]
    assert (
        chart.member(2.6).between == chart.family.error
        and chart.member(2.2).between == 0.0
    )
    assert (
        guess.error[0] > chart.family.error > abs(guess.error[0] - member.error[0]) / 3
    )
    moved = (
        charts.tiers(chart.member(3.0), OFF_CENTRE)["harmonic"].net
        - charts.tiers(chart.member(1.0), OFF_CENTRE)["harmonic"].net
    )
    assert np.hypot(*moved[:2]) > 20 * chart.family.error
    with pytest.raises(Refusal, match="one scene, and not of a family"):
        chart.member(2.0).member(2.0)


def test_one_file_without_network_markup_or_repetition(glass):
    """Scripts and styles are those whose hashes the policy allows; what a scene says is data; equal tables stand once."""
    name = "</script><img src=x onerror=alert(1)>\u2028'\""
    odd = dataclasses.replace(glass, scene=glass.scene.changed(name=name))
    text = lab.page([glass, odd])
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text)[1]
    assert (
        policy.startswith("default-src 'none'; script-src 'sha256-")
        and "unsafe" not in policy
    )
    for element, kind in (("script", "script-src"), ("style", "style-src")):
        inside = re.findall(rf"<{element}>(.*?)</{element}>", text, re.DOTALL)
        assert len(inside) == 1
        assert (
            f"{kind} 'sha256-{base64.b64encode(hashlib.sha256(inside[0].encode()).digest()).decode()}'"
            in policy
        )
    assert "<img" not in text and "://" not in re.sub(
        r"http://www.w3.org/2000/svg", "", text
    )
    data = json.loads(re.search(r'id="data">(.*?)</script>', text, re.DOTALL)[1])
    assert [s["name"] for s in data["scenes"]] == ["three-link-glass", name]
    assert len(data["tables"]) == 10  # three of the scene, three and four of its frames
    assert len(text) < 600_000
    harmonics = np.frombuffer(
        base64.b64decode(data["tables"][data["scenes"][0]["harmonics"]]), "<f4"
    )
    np.testing.assert_array_equal(harmonics, glass.harmonics.ravel())


@pytest.mark.parametrize(
    "name", ["seven-link-wave", "no-slip-snake", "differential-drive"]
)
def test_scenes_without_a_chart_are_refused_before_others_are_computed(name):
    with pytest.raises(Refusal, match=f"^{name}: "):
        Lab((scenes.load("three-link-glass"), scenes.load(name))).check()


def test_the_command(tmp_path):
    code, out, _ = geomech(
        "lab", "three-link-viscous", "seven-link-modes", "-o", "lab.html", cwd=tmp_path
    )
    assert (
        code == 0
        and "three-link-viscous  961 shapes, harmonics to 1\n" in out
        and "page in lab.html" in out
    )
    assert (
        (tmp_path / "lab.html")
        .read_text(encoding="utf-8")
        .startswith("<!DOCTYPE html>")
    )


def test_without_a_file_a_browser_opens_the_gallery(monkeypatch, tmp_path):
    opened = []
    monkeypatch.setattr("geomech.studies.maps.lab.GALLERY", GALLERY[3:4])
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setattr("tempfile.mkdtemp", lambda prefix: str(tmp_path))
    code, out, _ = geomech("lab")
    assert code == 0 and opened == [(tmp_path / "lab.html").as_uri()]
    assert all(name in out for name in GALLERY[3:4])
    assert (tmp_path / "lab.html").exists()


# In a browser ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def page(family, tmp_path_factory):
    path = tmp_path_factory.mktemp("lab") / "lab.html"
    odd = dataclasses.replace(
        family[0],
        scene=family[0].scene.changed(name="<b onclick=alert(1)>"),
    )
    made = [
        *family,
        *(charts.chart(scenes.load(name)) for name in GALLERY[1:]),
        odd,
    ]
    path.write_text(lab.page(made), encoding="utf-8")
    assert path.stat().st_size < 4_000_000
    return path, {chart.scene.name: chart for chart in made}


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    if not NEEDS:
        pytest.skip("needs selenium, chromium and chromedriver")
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium")
    folder = tmp_path_factory.mktemp("browser")
    for argument in (
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-dev-shm-usage",
        "--window-size=1400,1400",
    ):
        options.add_argument(argument)
    options.add_argument(f"--user-data-dir={folder / 'profile'}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    options.add_experimental_option(
        "prefs", {"download.default_directory": str(folder), **ALLOWED}
    )
    driver = webdriver.Chrome(
        options=options, service=Service(shutil.which("chromedriver"))
    )
    driver.folder = folder
    yield driver
    driver.quit()


@pytest.fixture
def opened(browser, page):
    """The page anew, with an empty address; afterwards its console has no message."""
    browser.get("about:blank")
    browser.get(page[0].as_uri())
    yield browser
    assert browser.get_log("browser") == []


def state(browser):
    return browser.execute_script("return lab.state()")


def until(condition, seconds=10):
    end = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < end
        time.sleep(0.01)
    return found


def said(browser):
    return browser.execute_script("return document.getElementById('said').textContent")


def click(browser, selector):
    browser.execute_script("document.querySelector(arguments[0]).click()", selector)


def test_the_page_computes_what_python_does(opened, page):
    """50 loops of six scenes, half of which cross themselves, in both frames, at members of a family and between."""
    worst, rng = 0.0, np.random.default_rng(5)
    for name, chart in page[1].items():
        values = [None] if chart.family is None else [1.8, 3.0, 2.45]
        for k, (gait, frame) in enumerate(
            itertools.product(charts.loops(chart.axes, 25, seed=8), chart.frames)
        ):
            value = values[k % len(values)]
            gait = Points(
                points=gait.points,
                amplitude=round(rng.uniform(0.4, 1.0), 3),
                reverse=bool(k % 2),
            )
            points = [list(p) for p in gait.points]
            got = opened.execute_script(
                "return lab.predict(...arguments)",
                name,
                frame,
                points,
                gait.amplitude,
                [0, 0],
                gait.reverse,
                value,
            )
            expected = charts.tiers(
                chart if value is None else chart.member(value), gait, frame
            )
            for tier, numbers in zip(("harmonic", "path", "area"), got):
                worst = max(
                    worst,
                    np.abs(
                        np.subtract(
                            numbers, [*expected[tier].net, *expected[tier].error]
                        )
                    ).max(),
                )
    assert worst < 1e-6


def test_dragging_keys_and_undo(opened):
    from selenium.webdriver import ActionChains, Keys
    from selenium.webdriver.common.by import By

    first, handle = (
        state(opened),
        opened.find_element(By.CSS_SELECTOR, "[data-handle='2'] .hit"),
    )
    ActionChains(opened, duration=0).click_and_hold(handle).move_by_offset(
        15, -30
    ).move_by_offset(5, -3).release().perform()
    dragged = until(lambda: state(opened) != first and state(opened))
    assert "loop=points" in dragged
    moved = [
        float(x)
        for x in re.search(r"points=([^&]*)", dragged)[1].split(";")[2].split(",")
    ]
    assert (
        moved[0] > 0.05 and moved[1] > 1.1
    )  # it was at (0, 1), the pixels are some 0.01 rad
    click(opened, "#undo")
    assert state(opened) == first
    ActionChains(opened).key_down(Keys.CONTROL).send_keys("y").key_up(
        Keys.CONTROL
    ).perform()
    assert state(opened) == dragged
    opened.execute_script("document.querySelector(\"[data-handle='1']\").focus()")
    ActionChains(opened).send_keys(Keys.ARROW_LEFT, Keys.ARROW_LEFT).perform()
    arrowed = state(opened)
    assert arrowed != dragged
    count = lambda: opened.execute_script(
        "return document.querySelectorAll('.handle').length"
    )
    assert count() == 9
    ActionChains(opened).send_keys(Keys.INSERT).perform()
    assert count() == 10
    ActionChains(opened).send_keys(Keys.DELETE).perform()
    click(opened, "#undo"), click(opened, "#undo")
    assert state(opened) == arrowed
    click(opened, "#undo")
    assert state(opened) == dragged  # both arrows at once
    x, y = opened.execute_script(
        "const line = document.querySelector('.target'), p = line.getPointAtLength(line.getTotalLength() * .55),"
        "box = line.ownerSVGElement.getBoundingClientRect(); return [box.x + p.x, box.y + p.y]"
    )
    press = ActionChains(opened, duration=0)
    press.w3c_actions.pointer_action.move_to_location(int(x), int(y)).click()
    press.perform()
    assert count() == 10


def test_component_frame_family_and_play(opened):
    first = opened.execute_script(
        "return document.querySelector('#map image').getAttribute('href')"
    )
    click(opened, "#component button:nth-child(3)")
    assert "component=heading" in state(opened)
    choose = (
        "const box = document.getElementById(arguments[0]); box.value = arguments[1];"
        "box.dispatchEvent(new Event(arguments[2]))"
    )
    opened.execute_script(choose, "frame", MINIMUM_PERTURBATION, "change")
    opened.execute_script(choose, "value", "2.5", "input")
    assert f"frame={MINIMUM_PERTURBATION}&value=2.5" in state(opened)
    assert (
        opened.execute_script(
            "return document.querySelector('#map image').getAttribute('href')"
        )
        != first
    )
    assert "C" in opened.execute_script(
        "return document.getElementById('family').innerText"
    )
    phase = opened.execute_script("return lab.player.phase")
    until(lambda: opened.execute_script("return lab.player.phase") != phase)
    click(opened, "#play")
    phase = opened.execute_script("return lab.player.phase")
    time.sleep(0.1)
    assert opened.execute_script("return lab.player.phase") == phase


def test_climbing_goes_further(opened):
    own = lambda: float(
        opened.execute_script(
            "return document.querySelector('tr.best td').textContent"
        ).split(" ")[0]
    )
    start = own()
    click(opened, "#climb")
    until(lambda: own() > 3 * start, 30)
    click(opened, "#climb")
    click(opened, "#undo")
    assert own() == start


def test_files_and_back(opened, page):
    opened.get(
        f"{page[0].as_uri()}#scene=three-link-glass&loop=butterfly&amplitude=0.9&centre=0.1,-0.2&reverse=0&value=2.5"
    )
    until(lambda: "butterfly" in state(opened))
    before = state(opened)
    for kind, file in (
        ("toml", "loop.toml"),
        ("svg", "map.svg"),
        ("png", "map.png"),
        ("csv", "loop.csv"),
    ):
        click(opened, f"#save-{kind}")
        until(
            lambda file=file: (
                (opened.folder / file).exists()
                and (opened.folder / file).stat().st_size
            )
        )
    saved = scenes.load(opened.folder / "loop.toml")
    assert (
        saved.system.medium.C == 2.5
        and saved.gait.amplitude == 0.9
        and saved.gait.centre == (0.1, -0.2)
    )
    assert (opened.folder / "map.png").read_bytes().startswith(b"\x89PNG")
    assert "loop=butterfly" in (opened.folder / "map.svg").read_text(encoding="utf-8")
    rows = (opened.folder / "loop.csv").read_text().splitlines()
    harmonic = [float(x) for x in rows[2].split(",")[1:]]
    expected = charts.tiers(page[1]["three-link-glass"].member(2.5), saved.gait)[
        "harmonic"
    ]
    np.testing.assert_allclose(harmonic, [*expected.net, *expected.error], atol=1e-6)
    click(opened, "[data-loop='circle']")
    opened.find_element("id", "open").send_keys(str(opened.folder / "loop.toml"))
    until(lambda: said(opened).startswith("Read the loop"))
    assert state(opened) == before
    python = opened.execute_script(
        "return document.getElementById('python').textContent"
    )
    assert "from geomech.mathematics.gaits import Butterfly" in python
    until(lambda: opened.current_url.endswith(before))
    opened.refresh()  # the state is in the address
    assert state(opened) == before


@pytest.mark.parametrize("loop", ["ellipse", "figure-eight", "circle"])
def test_loops_of_the_page_are_saved_as_they_are(opened, loop):
    (opened.folder / "loop.toml").unlink(missing_ok=True)
    click(opened, f"[data-loop='{loop}']")
    before = state(opened)
    assert f"loop={loop}" in before
    click(opened, "#save-toml")
    until(
        lambda: (
            (opened.folder / "loop.toml").exists()
            and (opened.folder / "loop.toml").stat().st_size
        )
    )
    saved = scenes.load(opened.folder / "loop.toml")
    assert saved.frequency is None  # the page chooses one to play it at
    click(opened, "[data-loop='butterfly']")
    opened.find_element("id", "open").send_keys(str(opened.folder / "loop.toml"))
    until(lambda: said(opened).startswith("Read the loop"))
    assert state(opened) == before


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
    (opened.folder / "bad.toml").write_text(text)
    opened.find_element("id", "open").send_keys(str(opened.folder / "bad.toml"))
    until(lambda: said(opened).startswith("Cannot use bad.toml"))
    assert reason in said(opened) and state(opened) == before


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


def test_a_scene_is_saved_whose_gait_no_file_can_name(glass):
    class Own(Circle):
        pass

    scene = glass.scene.changed(gait=Own(0.5, frequency=2.0))
    saved = text_of(without_gait(scene) | {"gait": {"kind": "circle"}})
    assert scenes.parse(saved, scene.name) == scene.changed(gait=Circle())


@pytest.mark.parametrize("key", ["medium.C", "medium.gamma0_deg"])
def test_a_family_of_any_key_is_saved_with_its_value(family, key):
    scene = scenes.parse(
        "[gait]\nkind = 'circle'\n[medium]\nlaw = 'granular'\nC = 1.8\ngamma0_deg = 13\n"
        "[body]\nkind = 'chain'\n"
    )
    (chart,) = family
    changed = dataclasses.replace(chart.family, key=key)
    chart = dataclasses.replace(chart, scene=scene, family=changed)
    parts = lab.data([chart])["scenes"][0]["toml"]
    saved = tomllib.loads("1.25".join(parts))
    section, name = key.split(".")
    assert len(parts) == 2 and saved[section][name] == 1.25


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


def test_the_page_reads_the_toml_that_python_reads(opened):
    read = (
        "try { return JSON.stringify(lab.tables(arguments[0])) }"
        "catch (error) { return String(error.message) }"
    )
    for text in TOML:
        found = opened.execute_script(read, text)
        try:
            expected = tomllib.loads(text)
        except (ValueError, RecursionError):
            assert found.startswith("it is not TOML"), text
        else:
            assert json.loads(found) == expected, text


@pytest.mark.parametrize(
    "kind", ["circle", "ellipse", "butterfly", "fourier", "points"]
)
@pytest.mark.filterwarnings("ignore::geomech.core.errors.UnitWarning")
def test_the_page_takes_and_refuses_what_the_reader_does(opened, kind):
    """Values of every key in turn, of right and of wrong types, within and beyond bounds."""
    good = {
        "fourier": {"cos": [[1.0], [0.5]], "sin": [[0.0], [1.0]]},
        "points": {"points": [[0, 0], [1, 0], [0, 1], [0, 0]]},
    }.get(kind, {})
    odd = [
        0, 1, -1, 0.5, 1e4, 1.1e4, 1e7, -1e7, math.inf, math.nan, True, False, "true",
        "", [], [0.1, -0.2], [0.1], [0.1, "a"], [0.1, True], [1, 2, 3], [[0.1, 0.2]], {},
    ]  # fmt: skip
    rows = [[], [[]], [[1], [2]], [[1, 2], [3]], [[0, 1], [0, 1], [1, 0]], [["1"], [0]]]
    keys = ["amplitude", "centre", "reverse", "frequency", "tilt", "semi_axes", "cos"]
    keys += ["points", "centre_deg", "amplitude_deg", "frequency_deg", "nothing"]
    tried, differing = 0, []
    read = (
        "try { lab.opened(arguments[0]); return true } catch (error) { return false }"
    )
    for key, value in itertools.product(keys, odd + rows):
        rest = {name: x for name, x in good.items() if name != key}
        text = text_of({"gait": {"kind": kind, **rest, key: value}})
        try:
            scenes.parse(text + REST_OF_SCENE)
            expected = True
        except Refusal:
            expected = False
        tried += expected
        if opened.execute_script(read, text) != expected:
            differing.append((key, value, expected))
    assert tried > 10 and differing == []


def test_long_files_are_read_at_once(opened):
    """Of a loop after many blank lines, and of texts that are nearly TOML."""
    read = "try { return lab.opened(arguments[0])[0].loop } catch (error) { return '' }"
    many = 60_000
    for filler in ("\n", " ", "\t\n", "#", "a = 1\n#\n", "0", "1_", "a.", "'", "["):
        text = filler * (many // len(filler))
        assert opened.execute_script(read, text + "\n[gait]\nkind = 'circle'\n") in (
            "",
            "circle",
        )
    text = "\n" * many + "[gait]\nkind = 'circle'" + "\n" * many
    assert opened.execute_script(read, text) == "circle"


def test_gaits_of_files_in_all_their_forms(opened):
    """As TOML writes them: comments, lists over lines, signs, exponents."""
    points = "[\n  [+1.0, 5e-1],\n  [-1.0, 0.5],\n  [0.0, -1.0],\n]"
    text = f"[medium]\nzeta = 1\n[gait]\nkind = 'points' # three\npoints = {points}\n"
    text += "amplitude = 1.2\nfrequency = 2\n[numerics]\n"
    (opened.folder / "good.toml").write_text(text)
    opened.find_element("id", "open").send_keys(str(opened.folder / "good.toml"))
    until(lambda: said(opened).startswith("Read"))
    gait = tomllib.loads(text)["gait"]
    assert opened.execute_script("return lab.player.frequency") == 2
    assert (
        f"points={';'.join(','.join(f'{x:g}' for x in p) for p in gait['points'])}&amplitude=1.2"
        in state(opened)
    )


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
    opened.get("about:blank")
    opened.get(f"{page[0].as_uri()}#{address}")
    assert state(opened).startswith("scene=three-link-glass&loop=circle")
    assert said(opened).startswith("The address is not used") or address.startswith("%")


def test_points_at_the_edge_stay_in_the_address(opened, page):
    """Of a small loop, whose unit curve reaches far; and rest, where no point moves."""
    from selenium.webdriver import ActionChains, Keys

    opened.get(f"{page[0].as_uri()}#loop=circle&amplitude=0.05&centre=2.3,0")
    until(lambda: "amplitude=0.05" in state(opened))
    opened.execute_script("document.querySelector(\"[data-handle='2']\").focus()")
    keys = ActionChains(opened).key_down(Keys.SHIFT)
    keys.send_keys(*[Keys.ARROW_DOWN] * 30).key_up(Keys.SHIFT).perform()
    moved = state(opened)
    points = re.search(r"points=([^&]*)", moved)[1].split(";")
    assert float(points[2].split(",")[1]) == -50
    until(lambda: opened.current_url.endswith(moved))
    opened.refresh()
    assert state(opened) == moved and said(opened) == ""
    opened.get(f"{page[0].as_uri()}#loop=circle&amplitude=0")
    until(lambda: "amplitude=0&" in state(opened))
    opened.execute_script("document.querySelector(\"[data-handle='2']\").focus()")
    ActionChains(opened).send_keys(Keys.ARROW_DOWN, Keys.DELETE).perform()
    assert "raise the amplitude" in said(opened)


def test_points_that_meet_are_refused_and_leave_nothing_to_undo(opened, page):
    from selenium.webdriver import ActionChains, Keys

    opened.get(f"{page[0].as_uri()}#loop=points&points=0,0;0.02,0;0,1&amplitude=1")
    until(lambda: "0.02,0" in state(opened))
    before = state(opened)
    opened.execute_script("document.querySelector(\"[data-handle='1']\").focus()")
    ActionChains(opened).send_keys(Keys.ARROW_LEFT, Keys.DELETE).perform()
    assert state(opened) == before and "3 to 60 points" in said(opened)
    click(opened, "#undo")
    assert "loop=circle" in state(opened)  # before the address was given


def test_a_frequency_belongs_to_the_state(opened):
    first = state(opened)
    (opened.folder / "f.toml").write_text("gait = {kind = 'circle', frequency = 0}")
    opened.find_element("id", "open").send_keys(str(opened.folder / "f.toml"))
    until(lambda: said(opened).startswith("Read"))
    still = state(opened)
    assert still.endswith("&frequency=0")
    until(lambda: opened.current_url.endswith(still))
    opened.refresh()
    assert state(opened) == still
    assert opened.execute_script("return lab.player.frequency") == 0
    opened.execute_script("location.hash = arguments[0]", first)
    until(lambda: state(opened) == first)
    click(opened, "#undo")
    assert state(opened) == still


def test_another_address_stops_a_climb(opened):
    click(opened, "#climb")
    other = "scene=three-link-viscous&loop=circle&amplitude=0.5"
    opened.execute_script("location.hash = arguments[0]", other)
    until(lambda: state(opened).startswith(other))
    assert opened.execute_script(
        "return document.getElementById('climb').textContent"
    ) == ("Climb")


def test_deleting_the_last_point_keeps_the_focus(opened):
    from selenium.webdriver import ActionChains, Keys

    opened.execute_script("document.querySelector(\"[data-handle='7']\").focus()")
    ActionChains(opened).send_keys(Keys.DELETE, Keys.DELETE).perform()
    assert len(re.search(r"points=([^&]*)", state(opened))[1].split(";")) == 6


def test_a_refusal_leaves_no_folder_behind(monkeypatch, tmp_path):
    (tmp_path / "page").mkdir()
    monkeypatch.setattr("tempfile.mkdtemp", lambda prefix: str(tmp_path / "page"))
    assert geomech("lab", "no-slip-snake")[0] == 2 and not (tmp_path / "page").exists()


def test_a_loop_that_leaves_the_map(opened, page):
    opened.get(f"{page[0].as_uri()}#loop=circle&amplitude=2.7")
    until(lambda: "amplitude=2.7" in state(opened))
    assert opened.execute_script(
        "return document.getElementById('verdict').textContent"
    ).startswith("The loop leaves the map")
    click(opened, "#save-csv")
    assert said(opened) == "The loop leaves the map."


def test_a_vertical_drag_by_touch_does_not_scroll(opened):
    command = opened.execute_cdp_cmd
    command(
        "Emulation.setDeviceMetricsOverride",
        {"width": 420, "height": 700, "deviceScaleFactor": 1, "mobile": True},
    )
    command("Emulation.setTouchEmulationEnabled", {"enabled": True})
    try:
        box = (
            "const r = document.querySelector(\"[data-handle='0'] .hit\").getBoundingClientRect();"
            "return [r.x + r.width / 2, r.y + r.height / 2]"
        )
        before, (x, y) = state(opened), opened.execute_script(box)
        touch = lambda kind, *at: command(
            "Input.dispatchTouchEvent",
            {"type": kind, "touchPoints": [{"x": p, "y": q} for p, q in at]},
        )
        touch("touchStart", (x, y))
        for k in range(1, 13):
            touch("touchMove", (x, y - 3 * k))
        touch("touchEnd")
        until(lambda: state(opened) != before)
        assert opened.execute_script("return scrollY") == 0
    finally:
        command("Emulation.setTouchEmulationEnabled", {"enabled": False})
        command("Emulation.clearDeviceMetricsOverride", {})


def test_names_are_text_and_controls_have_labels(opened, page):
    opened.get(f"{page[0].as_uri()}#scene=%3Cb%20onclick%3Dalert(1)%3E")
    until(lambda: "onclick" in state(opened))
    assert opened.execute_script("return document.querySelectorAll('b').length") == 0
    assert "<b onclick=alert(1)>" in opened.execute_script(
        "return document.getElementById('foot').textContent"
    )
    nameless = opened.execute_script(
        "return [...document.querySelectorAll('button, input, select, [tabindex]')].filter((e) => e.getClientRects().length"
        " && !(e.textContent.trim() || e.ariaLabel || (e.labels && e.labels[0].textContent.trim()))).map((e) => e.outerHTML)"
    )
    assert nameless == []


def test_what_a_series_leaves_is_summed_along_the_loop():
    """Of a circle that goes round steadily where what is left is linear, the value at its centre; the error of the grid is
    that of its length, and that between members of a family counts besides."""
    axes = np.linspace(-2, 2, 9), np.linspace(-1.5, 2.5, 9)
    first, second = np.meshgrid(*axes, indexing="ij")
    left = 1 + 0.2 * first - 0.1 * second
    residual = np.stack([0.03 * left, 0.04 * left, 0.07 * (1 + 0.3 * second)], -1)
    chart = types.SimpleNamespace(
        axes=axes, residual=residual, grid_error=(1e-3, 2e-3), between=0.5
    )
    length, (a, b) = 2 * np.pi * 0.6, (0.4, 0.7)
    found = charts.harmonic_error(
        chart, *Circle(amplitude=0.6, centre=(a, b)).cycle(64)
    )
    assert found == pytest.approx(
        (
            length * (0.35 * 0.05 * (1 + 0.2 * a - 0.1 * b) + 1e-3) + 0.5,
            length * (0.45 * 0.07 * (1 + 0.3 * b) + 2e-3),
        )
    )


def test_loops_of_a_chart_fill_its_field_and_stay_within():
    """Curves through three to nine shapes within 0.85 of either side about the middle."""
    axes = np.linspace(-1.0, 3.0, 5), np.linspace(-0.5, 0.1, 5)
    found = charts.loops(axes, 20, seed=3)
    shares = [(np.array(gait.points) - [1.0, -0.2]) / [2.0, 0.3] for gait in found]
    counts = sorted(map(len, shares))
    assert len(counts) == 20 and counts[0] == 3 and 7 <= counts[-1] <= 9
    every = np.concatenate(shares)
    np.testing.assert_allclose(
        [every.min(0), every.max(0)], [[-0.85, -0.85], [0.85, 0.85]], atol=0.06
    )
    inside = np.array(
        [
            (np.abs(gait.cycle(300)[0] - [1.0, -0.2]) / [2.0, 0.3]).max()
            for gait in found
        ]
    )
    assert inside.max() < 1.001 and (inside > 0.9).any()
