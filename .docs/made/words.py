"""Words that users type into the search, and the page or section that answers each.

The search finds the words of a page by itself. An entry here puts a page first, or
leads to it by a word that it does not use. A word may stand for several pages; an entry
of a page that does not exist does nothing.
"""

from __future__ import annotations

import re

WORDS = {
    "coming-from": "PyElastica, ElegansBot, Newton, Warp, GPU, C. elegans, worm",
    "start#install": "install, pip, conda, requirements",
    "start": "units, degrees, conventions, body length",
    "tiers": "accuracy, exact, which method",
    "lab": "interactive, app, browser, lecture",
    "how-to/figures": "font, figure size, DPI, colormap, legend, mplstyle, SVG, PDF",
    "how-to/mujoco": "MJCF, sand in MuJoCo",
    "how-to/mujoco#urdf": "URDF, ROS, xacro",
    "how-to/learning": "learning, reinforcement learning, RL, gymnasium",
    "how-to/feet": "Isaac, Isaac Lab, IsaacLab, humanoid, foot, resistance, MPM",
    "how-to/own-sand": "drag coefficient, drag test, calibrate, own robot",
    "how-to/sysplotter": "MATLAB, Octave",
    "how-to/trials": "DeepLabCut, DLC, SLEAP, tracking, video, camera, pixels, h5",
    "how-to/midlines": "midline, centreline, fish, kinematics",
    "topics/bodies": "snake, sandfish, lizard, muscle",
    "topics/bodies#fig-10-muscle-activation": "activation, muscle activation, EMG",
    "topics/best-gaits": "optimise, optimize, optimization, best gait",
    "topics/displacements#figures": "plot, measured points",
    "topics/displacements#json-and-files": "Excel, spreadsheet, CSV, JSON, NetCDF, export",
    "topics/effects": "slope, incline, hill, mass, inertia, head drag",
    "topics/frames": "cost of transport, power, work, torque",
    "topics/long-runs": "parallel, cores, resume, cluster, memory",
    "topics/media": "isotropic, friction, viscous, water, agar, drag law",
    "topics/meshes": "STL, mesh, CAD, OBJ",
    "topics/motion": "film, animation, movie, gif, mp4, video",
    "topics/python": "pandas, DataFrame, xarray",
    "topics/terradynamics": "RFT, intruder, plate, penetration, depth",
    "topics/walking": "legs, wheel, rover, screw, hexapod",
    "topics/grains": "DEM, LAMMPS, discrete elements",
    "citing": "cite, BibTeX, licence, license, DOI",
}


def with_entries(docname: str, text: str) -> str:
    """Return a page with its entries below their headings; ValueError where a section
    does not exist."""
    for place, words in WORDS.items():
        page, _, anchor = place.partition("#")
        if page == docname:
            end = _end_of_heading(text, anchor, place)
            # Only the main entries of a word stand before other results.
            main = ", ".join(f"!{word}" for word in words.split(", "))
            entry = f"\n```{{index}} {main}\n```\n"
            text = text[:end] + entry + text[end:]
    return text


def _end_of_heading(text: str, anchor: str, place: str) -> int:
    """Return where the line of a heading ends: of the first, or of an anchor."""
    for heading in re.finditer(r"(?m)^#+ (.+)\n", text):
        words = re.sub(r"[^\w -]", "", heading[1].lower()).replace(" ", "-")
        if anchor in ("", words):
            return heading.end()
    raise ValueError(f"{place}: the page has no such section")
