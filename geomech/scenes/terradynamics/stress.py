"""The [medium] of scenes without a swimmer: stress maps of the vertical plane and the
law of three dimensions, by name, by their numbers, or from files."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, get_args, get_type_hints

import numpy as np

from geomech.core.errors import choose
from geomech.io.files import read_text
from geomech.io.rows import ENDINGS
from geomech.io.toml import tables_of
from geomech.mathematics.systems.swimmer import MEDIA
from geomech.scenes.format.columns import columns
from geomech.scenes.format.reader import Source, build
from geomech.scenes.format.sections import Alternatives
from rft.core.checks import Number, Word
from rft.core.refusal import Refusal, located, place_prefix
from rft.terradynamics.meshes import Spatial
from rft.terradynamics.plates import VERTICAL, PlateDrags, PlateStress, StressMap
from rft.terradynamics.plates.stress import COEFFICIENTS

LARGEST = 10_000_000  # bytes of a TOML file
LARGEST_RADIANS = 3.2  # angles that are all smaller are likely not in degrees
Named = Annotated[
    str | None,
    Word(VERTICAL, f"{', '.join(VERTICAL)}; 'geomech scenes --show NAME' prints one"),
]


def _optional_field(kind: type, name: str):
    """Return the type of a field of a class, which may also be None."""
    hint = get_type_hints(kind, include_extras=True)[name]
    return Annotated[(get_args(hint)[0] | None, *hint.__metadata__)]


def _strengths(
    *groups: Collection[str], more: Collection[str], cure: str
) -> Alternatives:
    """Return the keys by which a strength is given: a name or a file, with those of
    ``more`` if wanted; or one of the groups."""
    by_name = [({key}, {*more}) for key in ("name", "file")]
    by_numbers = [({*group}, set()) for group in groups]
    return Alternatives((*by_name, *by_numbers), cure, "strength")


_Coefficients = dataclasses.make_dataclass(
    "_Coefficients",
    [(key, _optional_field(StressMap, key), None) for key in COEFFICIENTS],
    bases=(StressMap,),
    frozen=True,
)


@dataclass(frozen=True)
class StressKeys(_Coefficients):
    """Give one of name, file and all nine coefficients, or zeta alone, which then
    multiplies the generic set.

    file (-): name of a TOML file with such a table, or of a CSV file of plate drags
    with the header beta,gamma,alpha_x,alpha_z (degrees, N/cm^3). tension (-): "keep",
    or "cut" for no stress on faces on which the map pulls.
    """

    zeta: Annotated[
        float,
        Number(
            0,
            1e6,
            "-",
            "strength of the medium, by which its other coefficients are multiplied",
        ),
    ] = 1.0
    name: Named = None
    file: str | None = None
    aliases = {key: key.replace("m", "-") for key in COEFFICIENTS if "m" in key}
    makes = StressMap
    # One is required: an empty table, as of a file that was cut off, is no medium.
    alternatives = Alternatives(
        (
            ({"name"}, {"zeta"}),
            ({"file"}, {"zeta"}),
            ({*COEFFICIENTS}, {"zeta"}),
            ({"zeta"}, set()),
        ),
        "use one of 'name', 'file' and the nine coefficients, in N/cm^3; or zeta "
        "alone, which multiplies the generic set (zeta = 1 is the generic set itself)",
        "strength",
    )

    def to_part(
        self, source: Source, place: str, given: Collection[str]
    ) -> PlateStress:
        """Return the stress map. Other keys that are given replace those of a name or a
        file."""
        if self.name:
            base: PlateStress = VERTICAL[self.name].stress
        elif self.file is not None:
            base = _read_stress(source, place, self.file)
        else:
            coefficients = [key for key in COEFFICIENTS if key in given]
            base = StressMap(**{key: getattr(self, key) for key in coefficients})
        changed = {"zeta": base.zeta * self.zeta}
        for key in ("grazing", "tension"):
            if key in given:
                changed[key] = getattr(self, key)
        return dataclasses.replace(base, **changed)


@dataclass(frozen=True)
class SpatialKeys(Spatial):
    """Give one of name or file (optionally with zeta), xi_n, and density with
    internal_friction.

    file (-): name of a TOML file with a table [medium] of the vertical plane, or of a
    CSV file of plate drags with the header beta,gamma,alpha_x,alpha_z (degrees,
    N/cm^3).
    """

    xi_n: _optional_field(Spatial, "xi_n") = None  # type: ignore[valid-type]
    name: Named = None
    file: str | None = None
    zeta: Annotated[
        float,
        Number(
            0, 1e6, "-", "factor on the strength of the medium given by name or file"
        ),
    ] = 1.0
    density: Annotated[
        float | None,
        Number(
            1,
            1e5,
            "kg/m^3",
            "critical density of the grains, 1 to 1e5; together with "
            "internal_friction, instead of xi_n",
        ),
    ] = None
    internal_friction: Annotated[
        float | None,
        Number(
            0.05,
            1.5,
            "-",
            "mu, the tangent of the angle of repose of the grains, 0.05 to 1.5; "
            "together with density, instead of xi_n",
        ),
    ] = None
    makes = Spatial
    alternatives = _strengths(
        ["xi_n"],
        ["density", "internal_friction"],
        more=["zeta"],
        cure="give 'xi_n' (N/m^3), or 'density' and 'internal_friction', or 'name' or "
        "'file', which may be combined with 'zeta'",
    )

    def to_part(self, source: Source, place: str, given: Collection[str]) -> Spatial:
        """Return the medium. Its strength is that of the grains, or that of a map of
        the vertical plane on a plate pushed down, or xi_n."""
        more = {
            key: getattr(self, key)
            for key in ("surface_friction", "tension", "grazing")
        }
        if self.density is not None:
            return Spatial.from_grains(self.density, self.internal_friction, **more)
        strength = {*given} & {"name", "file", "zeta"}
        if strength:
            table = {key: getattr(self, key) for key in strength}
            vertical = build(source, place, table, StressKeys)
            return Spatial(matched_strength(vertical), **more)
        return Spatial(self.xi_n, **more)


class MatchedKeys(SpatialKeys):
    __doc__ = SpatialKeys.__doc__

    def to_part(self, source: Source, place: str, given: Collection[str]) -> dict:
        """Return the medium and, if its strength is that of a map of the vertical
        plane, a text about the match; else ""."""
        medium = super().to_part(source, place, given)
        source_name = self.name or Path(self.file or "").name
        if not source_name:
            return {"medium": medium, "matched": ""}
        times = f"{self.zeta:g} times " if self.zeta != 1.0 else ""
        match = (
            f"xi_n = {medium.xi_n:.4g} N/m^3, matched to {times}alpha_z(0, 90 degrees) "
            f"of {source_name} in the vertical plane"
        )
        return {"medium": medium, "matched": match}


def matched_strength(stress: PlateStress) -> float:
    """Return xi_n, N/m^3, with which a flat plate pushed straight down bears the same
    load as with a map of the vertical plane."""
    normal = (0.0, -1.0)
    direction = (0.0, -1.0)
    return 1e6 * float(stress.alpha(normal, direction)[1]) / Spatial(1.0).plate


def plate_rows(place: str, file) -> np.ndarray:
    """Return plate drags of a CSV file, (4, N): beta, gamma, degrees; alpha_x, alpha_z,
    N/cm^3."""
    drags = columns(place, file, ("beta", "gamma", "alpha_x", "alpha_z"))
    rows = np.stack(list(drags.values()))
    largest = np.abs(rows[:2]).max(initial=0.0)
    if rows.size and largest < LARGEST_RADIANS:
        raise Refusal(
            "beta and gamma appear to be in radians",
            where=(place, Path(file).name),
            instead="give degrees",
        )
    if largest > 360:
        raise Refusal(
            f"beta and gamma must be from -360 to 360 degrees, got {largest:g}",
            where=(place, Path(file).name),
        )
    return rows


def plate_drags(place: str, file) -> PlateDrags:
    """Return the stress map through the plate drags of a CSV file (`plate_rows`)."""
    beta, gamma, a_x, a_z = plate_rows(place, file)
    with located(f"{place_prefix(place)}{Path(file).name}"):
        return PlateDrags(*map(tuple, (np.radians(beta), np.radians(gamma), a_x, a_z)))


def stress_map(name: str) -> PlateStress:
    """Return a stress map of the vertical plane.

    name: of a medium of the catalogue, or of a file: TOML with a table [medium], or
    with the keys of one alone, or CSV of plate drags. Refusal for anything else.

    Examples
    --------
    >>> from geomech.scenes.terradynamics.stress import stress_map
    >>> stress_map("poppy-seeds-loose").zeta  # or of "own.toml"
    1.0
    """
    name = str(name)
    if name in VERTICAL:
        return VERTICAL[name].stress
    if name in MEDIA:
        raise Refusal(
            f"{name!r} is a force law for bodies that undulate",
            where="medium",
            instead=f"give a stress map: {', '.join(VERTICAL)}, or your own file",
        )
    if Path(name).suffix.lower() not in (".toml", *ENDINGS) and not Path(name).exists():
        choose("medium", name, VERTICAL, ".toml")
    return _read_stress(Source("medium"), "medium", name)


def _read_stress(source: Source, place: str, file: str) -> PlateStress:
    """Return the stress map of a TOML file, or of plate drags if the file's name ends
    as that of a table (`ENDINGS`)."""
    path = Path(file)
    if path.suffix.lower() in ENDINGS:
        return plate_drags(place, file)
    try:
        tables = tables_of(read_text(path, LARGEST))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it is not TOML"
        raise Refusal(
            f"cannot read {file!r}",
            where=place,
            because=reason,
            instead=f"give a TOML or CSV file or one of {', '.join(VERTICAL)}",
        ) from None
    table = tables.get("medium", tables)
    if not isinstance(table, Mapping):
        raise Refusal(
            f"medium must be a table [medium], got {type(table).__name__}",
            where=(place, path.name),
        )
    if "law" in table:
        raise Refusal(
            f"{path.name} has the force law of a rod, for bodies that undulate",
            where=place,
            instead="give plate drags (beta, gamma, alpha_x, alpha_z) in a CSV file, "
            "or the stress map that 'geomech fit-medium' fits to pushes of a plate",
        )
    if isinstance(table.get("file"), str):
        drags = path.absolute().parent / table["file"]
        if drags.suffix.lower() not in ENDINGS:
            raise Refusal(
                f"{path.name} names another file, {drags.name}",
                where=place,
                instead="copy the coefficients",
            )
        table = {**table, "file": str(drags)}
    return build(source, f"{place_prefix(place)}{path.name}", table, StressKeys)
