"""What a new user types wrong: one line that names the place, exit code 2, and nothing written."""

import pytest
from test_cli import geomech

PLAIN = '[medium]\nname = "glass-0.3mm-loose"\n[body]\nkind = "chain"\n[gait]\nkind = "circle"\n'
EFFECT = PLAIN + "[[effects]]\n"
LAW = ('name = "glass-0.3mm-loose"', 'law = "granular"\nC = 1.8\n')

# What is replaced in PLAIN and by what, or a whole file and None; and a word or two of what is said.
SCENES = [
    ("", None, "[medium] is missing"), ("kind = 1", None, "'kind' is unknown"), ('{"medium": {}}', None, "is not TOML"),
    ("medium:\n  name: coulomb\n", None, "is not TOML"), ("[medium]", "[meduim]", "did you mean 'medium'"),
    ("[medium]", "[Medium]", "did you mean 'medium'"), ("[gait]", "[gaits]", "did you mean 'gait'"),
    ("[gait]", "[[gait]]", "gait must be a table [gait]"), ("[gait]", "[numeric]\n[gait]", "did you mean 'numerics'"),
    ('"circle"', '"Circle"', "did you mean 'circle'"), ('"circle"', '"cïrcle"', "did you mean 'circle'"),
    ('kind = "circle"', "", "[gait] has no 'kind'"), ('kind = "circle"', 'type = "circle"', "[gait] has no 'kind'"),
    ('"circle"', '"circle"\ncenter = [0, 0]', "did you mean 'centre'"), ('"circle"', '"circle"\ncentre = 0.5', "a list"),
    ('"circle"', '"circle"\ncentre = [0, 0, 0]', "centre must have 2"), ('"circle"', '"circle"\nradius = 1', "'radius'"),
    ('"circle"', '"circle"\namplitude = [1, 2]', "a number"), ('"circle"', '"circle"\namplitude = true', "a number"),
    ('"circle"', '"circle"\namplitude = nan', "amplitude must"), ('"circle"', '"circle"\namplitude = inf', "amplitude"),
    ('"circle"', '"circle"\namplitude = "30deg"', "'30deg'"), ('"circle"', '"circle"\namplitude = 1' + "0" * 400, "range"),
    ('"circle"', '"circle"\namplitude_deg = 1e400', "got inf"), ('"circle"', '"circle"\namplitude = 2024-01-01', "a number"),
    ('"circle"', '"circle"\namplitude = ' + "[" * 2000, "is not TOML"), ('"circle"', '"circle"\n[gait]', "is not TOML"),
    ('"circle"', '"circle"\n' + "x" * 5000 + " = 1", "is unknown"), ('"circle"', '"circle"\n\0', "is not TOML"),
    ('"circle"', '"ellipse"\nsemi_axes = 1', "a list"), ('"circle"', '"ellipse"\nsemi_axes = [1, 2, 3]', "length 2"),
    ('"circle"', '"fourier"\ncos = [1, 0]\nsin = [0, 1]', ".cos[0]"), ('"circle"', '"points"', "add points"),
    ('"circle"', '"points"\npoints = [[0, 1], [1, 0]]', "at least 3"), ('"circle"', '"sine"', "99 joints"),
    ('"circle"', '"centreline"\nfile = "no.csv"', "no.csv"), ('"circle"', '"centreline"\nfile = "."', "no ordinary file"),
    ('"circle"', '"centreline"\nfile = 3', "give text in"), ('"circle"', '"circle"\n[numerics]\nphases = 1e3', "whole number"),
    ('"circle"', '"circle"\n[numerics]\ngrid = [31, 31]', "whole number"),
    ('"circle"', '"circle"\n[numerics]\ngrid = 100000', "from 4 to 4096"),
    ('"circle"', '"circle"\n[numerics]\nloads = "exat"', "loads must be"),
    ('"circle"', '"circle"\n[numerics]\nphases = ' + "9" * 5000, "is not TOML"), ('"chain"', "chain", "put text in"),
    ('"chain"', '"chain"\nlengths = "1,1,1"', "a list"), ('"chain"', '"chain"\nlengths = [1, 1]', "moves 2 joints"),
    ('"chain"', '"chain"\nlengths = [1, 1, -1]', "> 0"), ('"chain"', '"chain"\nlengths = []', "at least two"),
    ('"chain"', '"chain"\nlengths = [[1, 1, 1]]', "give a number"), ('"chain"', '"chain"\nlength = "0.3 m"', "'0.3 m'"),
    ('"chain"', '"chain"\nlinks = 3', "did you mean 'lengths'"), ('"chain"', '"chain"\nframe = "midle"', "'mean' or"),
    ('"chain"', '"backbone"\nelements = 2.5', "whole number"), ("loose", "lose", "did you mean 'glass-0.3mm-loose'"),
    ('[medium]\nname = "glass-0.3mm-loose"', 'medium = "coulomb"', "medium must be a table"),
    (LAW[0], LAW[1] + "gamma0 = 17", "write gamma0_deg"), (LAW[0], LAW[1] + "gamma0_deg = 0", "between 0 and 90"),
    (LAW[0], LAW[1] + "gamma0_deg = [14]", "a number"), (LAW[0], "C = 1.8", "has no 'law'"),
    (LAW[0], LAW[0] + "\nC = 1.8", "(no 'law')"), (LAW[0], 'law = "viscous"\nratio = "2:1"', "'2:1'"),
    (EFFECT + "radius = 0.1", None, "has no 'kind'"), (EFFECT + 'kind = "endcaps"', None, "did you mean 'end-caps'"),
    (EFFECT + 'kind = "end-caps"', None, "add radius"), (EFFECT + 'kind = "end-caps"\nradius = "6 cm"', None, "'6 cm'"),
    (PLAIN + '[effects]\nkind = "end-caps"', None, "[[effects]]"), ("effects = 3\n" + PLAIN, None, "[[effects]]"),
    ("frame = 2\n" + PLAIN, None, "text in"), (PLAIN + "[physical]\nlenght = 1", None, "did you mean 'length'"),
    (PLAIN + '[system]\nkind = "no-slip-snake"', None, "takes no 'body'"),
    ("[system]\n[gait]\nkind='circle'", None, "no 'kind'"),
    ("\ufeff" + PLAIN.replace("chain", "chian"), None, "did you mean 'chain'"),
    (PLAIN.replace("\n", "\r\n").replace("circle", "cirle"), None, "did you mean 'circle'"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "said"), SCENES, ids=range(len(SCENES)))
def test_a_wrong_scene(old, new, said, tmp_path):
    text = old if new is None else PLAIN.replace(old, new)
    (tmp_path / "s.toml").write_text(text, encoding="utf-8", newline="")
    code, out, err = geomech("explain", "s.toml", cwd=tmp_path)
    assert (code, out, err.count("\n")) == (2, "", 1), err
    assert err.startswith("error: s.toml")
    assert said in err
    assert len(err) < 450


VELOCITY, D, S = ["velocity", "s.toml", "--alphadot", "1,0", "--alpha"], ["displacement", "s.toml", "--amplitudes"], [
    "sweep", "s.toml", "-o", "s.nc", "--over"
]  # fmt: skip
COMMANDS = [
    *([*VELOCITY, x] for x in ("", "0 0", "[0,0]", "0,5;0", "0,,0", "0,0,0", "0", "1e400,0", "nan,0", "pi/2,0", "30 rad,0")),
    [*VELOCITY[:3], "1e300,0", "--alpha", "0,0"], [*VELOCITY[:3], "1", "--alpha", "0,0"], VELOCITY[:4], VELOCITY,
    ["velocity", "no-slip-snake", "--alphadot", "1,0", "--alpha", "0.5,0.5"],
    ["velocity", "no-slip-snake", "--alphadot", "1,0", "--alpha", "0.5,inf"],
    *([*D, x] for x in ("", "0.2-2", "0.2:2", "0.2:2:0", "0.2:2:1.5", "0.2:2:-3", "1:2:3:4", ":", "inf", "1e9", "x", "1,,2")),
    *([*D, "1", "--methods", x] for x in ("", "area path", "Direct", "direct,", "all")), ["displacement", "s.toml"],
    *([*D, "1", "--tol", x] for x in ("0", "-1", "nan", "1%")), [*D, "1", "--tol", "0.1", "--methods", "area"],
    *([*D, "1", "--grid", x] for x in ("0", "3", "31x31", "9" * 5000, "5000", "7.5")),
    *([*D, "1", "--extent", x] for x in ("", "nan", "0", "-2", "wide", "200")), [*D[:2], "--amplitude", "1"],
    *([*D, "1", "--plot", x] for x in ("", "x", "x.jpg", "folder", "folder.png", "s.toml/x.png", "loop/x.png", "no/x.png")),
    *([*D, "1", "--plot", x] for x in ("a" * 300 + ".png", "s.toml")),
    *(["connection", "s.toml", "-o", x] for x in ("", "x", "x.NC", "s.toml", "folder.nc", "no/x.nc", "loop/x.nc")),
    ["connection", "s.toml"], ["connection", "sandfish-loose", "-o", "x.nc"], ["connection", "sandfish-heavy", "-o", "x.nc"],
    ["ccf", "s.toml"], ["ccf", "s.toml", "--plot", "c"], ["ccf", "sandfish-loose", "--plot", "c.png"],
    ["run", "s.toml", "-o", "s.toml"], ["run", "s.toml", "-o", "loop"], ["run", "s.toml", "out"], ["run", "nope"],
    ["accuracy", "s.toml", "-o", "s.toml"], ["accuracy"],
    *([*S, x] for x in ("gait.amplitude", "amplitude=1", "gait.amplitude=", "gait.amplitud=1", "gate.amplitude=1", "=1")),
    *([*S, x] for x in ("medium.D=1", "gait.kind=1", "gait.centre=1", "gait..amplitude=1", "effects.x.y=1", "body.lengths=1")),
    *([*S, x] for x in ("numerics.grid=2.5", "frame.x=1", "physical.mass=1", "gait.amplitude=0:1:99999999")),
    [*S, "gait.amplitude=1", "--over", "gait.amplitude=2"], [*S[:3], "s.txt", "--over", "gait.amplitude=1"],
    [*S[:3], "folder.nc", "--over", "gait.amplitude=1"], [*S[:3], "..", "--over", "gait.amplitude=1"],
    *(["explain", x] for x in ("", " ", "-", "folder", "loop", "dangling.toml", "three link glass", "~/x.toml", "a" * 5000)),
    ["explain", "s.toml", "more"], ["scenes", "--show", ""], ["scenes", "x"], ["Run"], ["geomech", "run"], [""], ["--verson"],
]  # fmt: skip


@pytest.fixture
def place(tmp_path):
    (tmp_path / "s.toml").write_text(PLAIN)
    for name in ("folder", "folder.nc", "folder.png"):
        (tmp_path / name).mkdir()
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "dangling.toml").symlink_to("nowhere.toml")
    return tmp_path


@pytest.mark.parametrize("args", COMMANDS, ids=range(len(COMMANDS)))
def test_a_wrong_command(args, place):
    before = {p: p.lstat().st_mtime_ns for p in place.rglob("*") if not p.is_dir()}
    code, out, err = geomech(*args, cwd=place)
    assert (code, out, err.count("\n")) == (2, "", 1), err
    assert err.startswith("error: ")
    assert len(err) < 600
    assert {p: p.lstat().st_mtime_ns for p in place.rglob("*") if not p.is_dir()} == before
