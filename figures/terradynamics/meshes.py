"""Bodies of three dimensions by the law of Agarwal, Goldman and Kamrin (2023).

Top: stress on meshes where the force is largest, as `geomech intrude` draws it. Bottom:
error of the force on a sphere and a cylinder against the number of triangles, deep and
half out of the ground; the law in the vertical plane (psi = 0) beside the generic map
of two dimensions, both over their stress on a plate pushed straight down, for plates of
all tilts.
"""

from __future__ import annotations

import numpy as np

from figures import main, style
from geomech import plots
from geomech.scenes import load
from rft.terradynamics.meshes import Cylinder, Spatial, Sphere, wrench
from rft.terradynamics.meshes.forces import law
from rft.terradynamics.plates import VERTICAL

SCENES = ("sphere", "cylinder", "screw", "extruded-c-leg")
BODIES = {"sphere": Sphere(0.02), "cylinder": Cylinder(0.02, 0.06)}
DEPTHS = {"deep": 0.1, "half out": 0.004}  # m, of the middle
LOOKS = {"sphere": (style.BLUE, "o"), "cylinder": (style.VERMILION, "s")}
STEP = 4  # degrees


def compute(ladder=(80, 320, 1280, 5120, 20480, 327680)) -> dict:
    """Return the faces of the pictures, errors of forces, and the laws of two and three
    dimensions.

    pictures: {scene: (faces, above)}. errors: {(body, depth): (triangles, error,
    order)}. angles: (2, B, G), beta and gamma, rad. two, three: (2, B, G), alpha_x
    against the motion and alpha_z upwards over that straight down.
    """
    pictures = {}
    for name in SCENES:
        scene = load(name)
        found = scene.run()
        pictures[name] = scene.faces(
            found, int(np.linalg.norm(found.force, axis=-1).argmax())
        )
    line = np.radians(np.arange(STEP / 2 - 90, 90, STEP))
    angles = np.stack(np.meshgrid(line, line, indexing="ij"))
    two = np.stack(VERTICAL["generic"].stress(*angles))
    three = (
        law.alpha_of_angles(*angles, 0.0)[..., [0, 2]] * [-1, 1] / Spatial(1.0).plate
    )
    return {
        "pictures": pictures,
        "errors": {
            (body, name): _errors(body, depth, ladder)
            for body in BODIES
            for name, depth in DEPTHS.items()
        },
        "angles": angles,
        "two": two / VERTICAL["generic"].stress(0.0, np.pi / 2)[1],
        "three": np.moveaxis(three, -1, 0),
    }


def _errors(body: str, depth: float, ladder):
    """Return triangles, errors and order of the force on a body that is dragged aside
    and down while it turns."""
    medium = Spatial(3e5, 0.3)
    meshes = [BODIES[body].mesh(n) for n in ladder]
    forces = [
        wrench(
            medium, m, np.eye(3), [0, 0, -depth], [0.03, 0.05, -0.1], [2.0, -1.0, 3.0]
        ).force
        for m in meshes
    ]
    triangles = np.array([len(m.faces) for m in meshes[:-1]])
    error = np.linalg.norm(
        np.array(forces[:-1]) - forces[-1], axis=-1
    ) / np.linalg.norm(forces[-1])
    return triangles, error, float(-np.polyfit(np.log(triangles), np.log(error), 1)[0])


def table(numbers: dict) -> str:
    """Return orders of convergence, and how the two laws agree."""
    lines = [f"{body}, {depth}: order {order:.2f} in the number of triangles, error {e[-1]:.1e} at {n[-1]}"
             for (body, depth), (n, e, order) in numbers["errors"].items()]  # fmt: skip
    for name, two, three in zip("xz", numbers["two"], numbers["three"]):
        r = np.corrcoef(two.ravel(), three.ravel())[0, 1]
        b, g = np.degrees(numbers["angles"]).reshape(2, -1)[
            :, np.abs(three - two).argmax()
        ]
        worst = np.abs(three - two).max()
        lines.append(
            f"alpha_{name}: correlation {r:.2f}, most apart, by {worst:.2f}, at beta = {b:.0f}, gamma = {g:.0f}"
        )
    return "\n".join(lines)


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(12.0, 6.0, 4, 2)
    for k, (name, (faces, above)) in enumerate(numbers["pictures"].items()):
        axes[0, k].remove()
        ax = fig.add_subplot(2, 4, k + 1, projection="3d")
        plots.draw_stress(ax, faces, above)
        ax.set_title(name, fontsize=9)
    _convergence(axes[1, 0], numbers["errors"])
    _tilts(axes[1, 1], numbers)
    for ax, name, two, three in zip(
        axes[1, 2:], "xz", numbers["two"], numbers["three"]
    ):
        ax.plot(two.ravel(), three.ravel(), ".", ms=1.5, color="0.3", rasterized=True)
        ends = np.array([min(two.min(), three.min()), max(two.max(), three.max())])
        ax.plot(ends, ends, **style.GUIDE)
        ax.set(
            xlabel=rf"$\alpha_{name}$, map of two dimensions",
            ylabel=rf"$\alpha_{name}$, law of three",
        )
        r = np.corrcoef(two.ravel(), three.ravel())[0, 1]
        ax.set_title(f"all angles, r = {r:.2f}", fontsize=8)
    return fig


def _convergence(ax, errors) -> None:
    for (body, depth), (n, e, order) in errors.items():
        (colour, marker), dashes = LOOKS[body], "-" if depth == "deep" else "--"
        ax.loglog(
            n,
            e,
            marker + dashes,
            lw=1.0,
            color=colour,
            label=f"{body}, {depth}: {order:.2f}",
        )
    ax.set(xlabel="triangles", ylabel="error of the force", ylim=(None, 10))
    ax.set_title("order in 1 / triangles (declared: 1)", fontsize=8)
    ax.legend(fontsize=7, loc="upper right", handlelength=2.6)


def _tilts(ax, numbers) -> None:
    beta, gamma = numbers["angles"]
    for degrees, colour in zip((88, 44, 0), style.shades(3)):
        k = int(np.abs(np.degrees(gamma[0]) - degrees).argmin())
        label = rf"$\gamma$ = {np.degrees(gamma[0, k]):.0f}°"
        ax.plot(
            np.degrees(beta[:, k]), numbers["two"][1][:, k], "--", lw=1.0, color=colour
        )
        ax.plot(
            np.degrees(beta[:, k]),
            numbers["three"][1][:, k],
            lw=1.0,
            color=colour,
            label=label,
        )
    style.zero_line(ax)
    ax.set(
        xlabel=r"tilt $\beta$ (degrees)",
        ylabel=r"$\alpha_z$ / that straight down",
        xticks=[-90, -45, 0, 45, 90],
    )
    ax.set_title("dashed: two dimensions; solid: three", fontsize=8)
    ax.set_ylim(-0.15, 1.6)
    ax.legend(fontsize=7, loc="upper left")


if __name__ == "__main__":
    main("meshes", compute, draw, table)
