"""Bodies in three dimensions: stress and force on meshes by the law of Agarwal, Goldman
and Kamrin (2023), and their errors.

Top: stress on meshes at the time when the force is largest, as `geomech intrude` draws
it. Bottom: error of the force on a sphere and a cylinder against the number of
triangles, deep below the surface and half out of the ground; and the law in the
vertical plane (psi = 0) compared with the generic map of two dimensions, both over
their stress on a plate that is pushed straight down, for plates of all tilts.
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
DASHES = {"deep": "-", "half out": "--"}
# of a body that moves aside and down while it rotates, m/s and rad/s
VELOCITY = [0.03, 0.05, -0.1]
ROTATION = [2.0, -1.0, 3.0]
STEP = 4  # degrees


def compute(ladder=(80, 320, 1280, 5120, 20480, 327680)) -> dict:
    """Return the faces of the pictures, errors of forces, and the laws of two and three
    dimensions.

    ladder: numbers of triangles; the last is the reference. pictures: {scene: (faces,
    above)}. errors: {(body, depth): (triangles, error, order)}. angles: (2, B, G), beta
    and gamma, rad. two, three: (2, B, G), alpha_x against the motion and alpha_z
    upwards over that straight down.
    """
    pictures = {}
    for name in SCENES:
        scene = load(name)
        run = scene.run()
        largest = np.linalg.norm(run.force, axis=-1).argmax()
        pictures[name] = scene.faces(run, int(largest))
    errors = {}
    for body in BODIES:
        for name, depth in DEPTHS.items():
            errors[body, name] = force_errors(body, depth, ladder)
    tilts = np.radians(np.arange(STEP / 2 - 90, 90, STEP))
    angles = np.stack(np.meshgrid(tilts, tilts, indexing="ij"))
    two = np.stack(VERTICAL["generic"].stress(*angles))
    alpha = law.alpha_of_angles(*angles, 0.0)[..., [0, 2]] * [-1, 1]
    three = alpha / Spatial(1.0).plate
    return {
        "pictures": pictures,
        "errors": errors,
        "angles": angles,
        "two": two / VERTICAL["generic"].stress(0.0, np.pi / 2)[1],
        "three": np.moveaxis(three, -1, 0),
    }


def force_errors(body: str, depth: float, ladder):
    """Return triangles (L - 1,), relative errors of the force (L - 1,) against that of
    the last mesh, and their order, of a body at a depth, m."""
    medium = Spatial(3e5, 0.3)
    place = [0, 0, -depth]
    meshes = [BODIES[body].mesh(n) for n in ladder]
    forces = []
    for mesh in meshes:
        load_on_body = wrench(medium, mesh, np.eye(3), place, VELOCITY, ROTATION)
        forces.append(load_on_body.force)
    triangles = np.array([len(mesh.faces) for mesh in meshes[:-1]])
    reference = forces[-1]
    differences = np.linalg.norm(np.array(forces[:-1]) - reference, axis=-1)
    error = differences / np.linalg.norm(reference)
    slope = np.polyfit(np.log(triangles), np.log(error), 1)[0]
    return triangles, error, float(-slope)


def correlation(two: np.ndarray, three: np.ndarray) -> float:
    """Return the correlation of both laws over all angles."""
    return np.corrcoef(two.ravel(), three.ravel())[0, 1]


def table(numbers: dict) -> str:
    """Return orders of convergence, and how well the two laws agree."""
    lines = []
    for (body, depth), (triangles, error, order) in numbers["errors"].items():
        lines.append(
            f"{body}, {depth}: order {order:.2f} in the number of triangles,"
            f" error {error[-1]:.1e} at {triangles[-1]}"
        )
    beta, gamma = np.degrees(numbers["angles"]).reshape(2, -1)
    for name, two, three in zip("xz", numbers["two"], numbers["three"]):
        difference = np.abs(three - two)
        k = difference.argmax()
        lines.append(
            f"alpha_{name}: correlation {correlation(two, three):.2f}, most apart,"
            f" by {difference.max():.2f}, at beta = {beta[k]:.0f},"
            f" gamma = {gamma[k]:.0f}"
        )
    return "\n".join(lines)


@plots.styled
def draw(numbers: dict):
    """Draw the pictures above, and convergence and the two laws below."""
    fig, axes = plots.figure(12.0, 6.0, 4, 2)
    for k, (name, (faces, above)) in enumerate(numbers["pictures"].items()):
        axes[0, k].remove()
        ax = fig.add_subplot(2, 4, k + 1, projection="3d")
        plots.draw_stress(ax, faces, above)
        ax.set_title(name, fontsize=9)
    draw_convergence(axes[1, 0], numbers["errors"])
    draw_tilts(axes[1, 1], numbers)
    laws = zip("xz", numbers["two"], numbers["three"])
    for ax, (name, two, three) in zip(axes[1, 2:], laws):
        draw_agreement(ax, name, two, three)
    return fig


def draw_convergence(ax, errors: dict) -> None:
    """Draw the errors of forces against the number of triangles."""
    for (body, depth), (triangles, error, order) in errors.items():
        colour, marker = LOOKS[body]
        line = marker + DASHES[depth]
        label = f"{body}, {depth}: {order:.2f}"
        ax.loglog(triangles, error, line, lw=1.0, color=colour, label=label)
    ax.set(xlabel="triangles", ylabel="error of the force", ylim=(None, 10))
    ax.set_title("order in 1 / triangles (declared: 1)", fontsize=8)
    ax.legend(fontsize=7, loc="upper right", handlelength=2.6)


def draw_tilts(ax, numbers: dict) -> None:
    """Draw alpha_z against tilt for three directions of motion, by both laws."""
    beta, gamma = numbers["angles"]
    for degrees, colour in zip((88, 44, 0), style.shades(3)):
        k = int(np.abs(np.degrees(gamma[0]) - degrees).argmin())
        tilt = np.degrees(beta[:, k])
        label = rf"$\gamma$ = {np.degrees(gamma[0, k]):.0f}°"
        look = {"lw": 1.0, "color": colour}
        ax.plot(tilt, numbers["two"][1][:, k], "--", **look)
        ax.plot(tilt, numbers["three"][1][:, k], label=label, **look)
    style.draw_zero_line(ax)
    ax.set(
        xlabel=r"tilt $\beta$ (degrees)",
        ylabel=r"$\alpha_z$ / that straight down",
        xticks=[-90, -45, 0, 45, 90],
    )
    ax.set_title("dashed: two dimensions; solid: three", fontsize=8)
    ax.set_ylim(-0.15, 1.6)
    ax.legend(fontsize=7, loc="upper left")


def draw_agreement(ax, name: str, two: np.ndarray, three: np.ndarray) -> None:
    """Draw a component of the law of three dimensions against that of two."""
    ax.plot(two.ravel(), three.ravel(), ".", ms=1.5, color="0.3", rasterized=True)
    ends = np.array([min(two.min(), three.min()), max(two.max(), three.max())])
    ax.plot(ends, ends, **style.GUIDE)
    ax.set(
        xlabel=rf"$\alpha_{name}$, map of two dimensions",
        ylabel=rf"$\alpha_{name}$, law of three",
    )
    ax.set_title(f"all angles, r = {correlation(two, three):.2f}", fontsize=8)


if __name__ == "__main__":
    main("meshes", compute, draw, table)
