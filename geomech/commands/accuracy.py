"""geomech accuracy."""

from __future__ import annotations

import json
from pathlib import Path

from geomech import terminal
from geomech.commands.asked import allow, loaded, storing
from geomech.commands.options import EitherArgument, FolderOption, JsonOption, YesOption, with_workers
from geomech.io.files import whole_folder


@with_workers
def accuracy(
    name: EitherArgument,
    out: FolderOption = Path("accuracy"),
    as_json: JsonOption = False,
    yes: YesOption = False,
):
    """What accuracy costs in this scene: error against time for every tier and knob, and the cheapest settings; of an intruder
    scene, for the number of elements or triangles; of a walking robot, for steps, elements and rounding."""
    from geomech.output import plots, walks
    from geomech.scene import Intruding, WalkerScene, inputs, load
    from geomech.study import accuracy as study
    from geomech.study import intrusion, walking

    scene = load(name)
    if isinstance(scene, Intruding):
        study, draw = intrusion, plots.elements_figure
    elif isinstance(scene, WalkerScene):
        study, draw = walking, walks.accuracy_figure
    else:
        scene, draw = loaded(scene), plots.work_precision_figure
    kept, told = storing(scene, out, command="accuracy"), terminal.progress(f"accuracy of {scene.name}")
    with kept, whole_folder(out, inputs(scene)) as folder, told as bar:
        allow(scene, study.cost(scene), yes)
        results = study.study(scene, bar)
        text = "\n".join([study.table(results), "", *study.sentences(results)])
        (folder / "accuracy.json").write_text(json.dumps(results, indent=1) + "\n")
        (folder / "accuracy.txt").write_text(text + "\n", encoding="utf-8", errors="backslashreplace")
        fig = draw(results)
        plots.save(fig, *(folder / f"accuracy.{ending}" for ending in ("png", "pdf")))
    print(json.dumps(results) if as_json else f"{text}\nfiles in {out}: accuracy.json, .txt, .png, .pdf")
