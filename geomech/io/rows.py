"""Tables of numbers in text files, as instruments, trackers and spreadsheets write them.

One reader for all commands, in six steps:

    decode      UTF-8 or UTF-16, with or without a mark at the start, else Windows-1252
    separator   of comma, semicolon, tab and blanks the one that parts the lines into
                most cells with numbers
    head        the header is the last line of words above the rows; what stands above
                it is kept with the comments, as are texts after #
    names       of columns, with a unit behind them: depth_mm, "Sinkage (mm)", F/N, or
                in a line of units below
    rows        lines below, without empty ones and a last one that is cut off
    numbers     with a decimal comma where the separator leaves no doubt

What is decided on the way is in ``notes``. `Rows.take` returns the columns that a
reader wants, by `Column`, in its units.
"""

from __future__ import annotations

import csv
import hashlib
import math
import re
import warnings
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from geomech.core.errors import Note
from geomech.io import files
from geomech.io.foreign import refuse_foreign
from rft.core.refusal import Refusal, formatted, located

LARGEST_NUMBER = 1e12
ENDINGS = (".csv", ".tsv", ".txt", ".dat")  # of the names of tables
SAMPLE = 400  # lines that separator and header are looked for in
SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", " ": "blanks"}
STACKED = ("scorer", "individuals", "bodyparts", "coords")  # DeepLabCut's header rows
MISSING = ("", "nan", "na", "n/a", "none", "null", "-")  # of a cell without a number
NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
WITH_COMMA = re.compile(r"[+-]?[0-9]*,[0-9]+(?:[eE][+-]?[0-9]+)?")
THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2}(?:,[0-9]{3})+")  # 1,234 or 1,234,567
LONGEST_NAME = 200  # letters of a column's name that may have a unit
CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f]")  # letters that no text has

UNITS: dict[str, dict[str, float]] = {  # by what is measured, in SI
    "time": {
        "s": 1.0, "sec": 1.0, "secs": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6,
        "ns": 1e-9, "min": 60.0,
    },
    "length": {
        "m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "metres": 1.0, "meters": 1.0,
    },
    "angle": {
        "rad": 1.0, "radians": 1.0, "deg": math.pi / 180, "degree": math.pi / 180,
        "degrees": math.pi / 180, "°": math.pi / 180,
    },
    "force": {"N": 1.0, "kN": 1e3, "mN": 1e-3, "MN": 1e6, "uN": 1e-6, "newton": 1.0},
    "area": {"m2": 1.0, "cm2": 1e-4, "mm2": 1e-6},
    "stress per depth": {"N/cm3": 1e6, "N/m3": 1.0, "N/mm3": 1e9},
}  # fmt: skip
PIXELS = ("px", "pixel", "pixels")
EPOCH = (9.4e8, 4.2e9)  # s since 1970, from 1999 to 2103: times within are such


class Column(NamedTuple):
    """A column that a reader wants.

    name: as messages spell it, such as psi_deg. kind: of `UNITS`, "" for a number
    without a unit. unit: in which the values are returned, and are where the header
    names none. names: that it may have in a file without the unit, in small letters
    with _ for blanks, the usual one first."""

    name: str
    kind: str = ""
    unit: str = ""
    names: tuple[str, ...] = ()

    def matches(self, word: str) -> str | None:
        """Return the unit that a header's word gives this column, "" for none, None if
        it is the word of another column."""
        if plain(word) in (self.name.lower(), *self.names):
            return self.unit if plain(word) == self.name.lower() else ""
        bare, unit = split_unit(word)
        return unit if plain(bare) in self.names else None

    def taken(self, word: str, unit: str) -> str:
        """Return a note if a word has no unit where the column's usual name has one."""
        if unit or not self.unit or split_unit(self.name)[1] != self.unit:
            return ""
        return f"{word} is taken to be in {self.unit}"

    def factor(self, word: str, unit: str) -> float:
        """Return what one of a unit is in the column's own; Refusal for another kind."""
        known = UNITS.get(self.kind, {})
        if unit == "":
            return 1.0
        if unit == "MN" and word.isupper():
            raise Refusal(
                f"column {word} may be in mN or in MN",
                instead="write the unit as it is",
            )
        if unit not in known:
            raise Refusal(
                f"column {word} is in {formatted(unit, 30)}",
                instead=f"give it in {' or '.join([*known][:4])}"
                if known
                else "it has no unit here",
            )
        return known[unit] / known[self.unit]


class Found(NamedTuple):
    """Where a column is: its index and unit in the file, the factor to the unit that is
    wanted, whether it is a time, and a note on what was taken for granted, or ""."""

    index: int
    unit: str
    factor: float
    is_time: bool = False
    note: str = ""


def plain(word: str) -> str:
    """Return a word in small letters with _ for blanks, dots and hyphens."""
    return re.sub(r"[\s.\-]+", "_", word.strip().lower()).strip("_")


def split_unit(word: str) -> tuple[str, str]:
    """Return the name of a column and its unit: x_mm, "x mm", "x (mm)", "x [mm]", x/mm;
    "" without one, as in names that no person writes."""
    word = word.strip()
    if len(word) > LONGEST_NAME:  # the patterns below take its square in steps
        return word, ""
    if match := re.fullmatch(r"(.+?)[\s_]*[(\[]\s*([^()\[\]]*?)\s*[)\]]", word):
        return match[1], unit_of(match[2]) or match[2]
    match = re.fullmatch(r"(.+?)(?:\s*/\s*|[\s_]+in[\s_]+|[\s_]+)([^\s_]+)", word)
    unit = unit_of(match[2]) if match else ""
    if match and unit:
        return match[1], unit
    return word, ""


def unit_of(text: str) -> str:
    """Return a unit as `UNITS` spells it, px for pixels, BL for body lengths; "" for
    what is none. Letters count as they stand, else in any size."""
    text = re.sub(r"\^|\*\*|\s", "", text.strip(" ()[]"))
    text = text.translate({0xB5: "u", 0x3BC: "u", 0xB2: "2", 0xB3: "3"})
    if text.lower() in PIXELS:
        return "px"
    if text.lower() in ("bl", "body_lengths"):
        return "BL"
    known = [unit for kind in UNITS.values() for unit in kind]
    if text in known:
        return text
    return next((unit for unit in known if unit.lower() == text.lower()), "")


@dataclass(frozen=True, eq=False)
class Rows:
    """A table of text.

    name, sha256: of the file. line, words: of the header, as written. rows: (line
    number, text) of the rows. separator, decimal: of cells, and of numbers. units: of
    columns by a line of units, "" elsewhere. comments: texts after #, and lines above
    the header. notes: what was decided."""

    name: str
    sha256: str
    line: int
    words: tuple[str, ...]
    rows: list[tuple[int, str]]
    comments: list[str]
    separator: str = ","
    decimal: str = "."
    notes: tuple[str, ...] = ()

    @property
    def header(self) -> tuple[int, tuple[str, ...]]:
        """Line number and words of the header, in small letters."""
        return self.line, tuple(word.lower() for word in self.words)

    @property
    def lines(self) -> np.ndarray:
        """Line numbers (N,) of the rows."""
        return np.array([k for k, _ in self.rows], int)

    @property
    def place(self) -> str:
        """The place of the header, for a Refusal."""
        return f"{self.name}, line {self.line}"

    @property
    def found(self) -> str:
        """What the header has, for a Refusal; "" for a file without rows of numbers,
        whose first line may be nobody's business."""
        if not any(self.number(x) is not None for x in self.first_cells()):
            return ""
        return f"it has {formatted(', '.join(self.words), 200)}"

    def first_cells(self) -> list[str]:
        """Return the cells of the first row; none without a row."""
        return self.cells(self.rows[0][1]) if self.rows else []

    def cells(self, text: str) -> list[str]:
        """Return the cells of a row, without blanks and quotes around them."""
        return split(text, self.separator)

    def number(self, cell: str) -> float | None:
        """Return the number in a cell, None if it is none: digits in groups as 1_000
        and digits of other scripts are none, nor are nan and inf."""
        if self.decimal == ",":
            if "." in cell:
                return None
            cell = cell.replace(",", ".")
        if "_" in cell or not cell.isascii():
            return None
        try:
            value = float(cell)
        except ValueError:
            return None
        return value if math.isfinite(value) else None

    def numbers(
        self, columns: Sequence[str], selected: Sequence[str] | None = None
    ) -> np.ndarray:
        """Return the numbers under the header (N, columns), or in ``selected`` columns;
        Refusal naming the line of a row with anything else."""
        selected = columns if selected is None else selected
        picks = [[*columns].index(name) for name in selected]
        return self._picked(picks)

    def _picked(self, picks: list[int]) -> np.ndarray:
        values = [self._row(line, text, picks) for line, text in self.rows]
        return np.array(values).reshape(-1, len(picks))

    def _row(self, line: int, text: str, picks: list[int]) -> list[float]:
        cells = self.cells(text)
        names = ",".join(self.words)
        expected = f"{len(self.words)} finite numbers ({names})"
        what = f"a row must be {expected}, at most {LARGEST_NUMBER:g}"
        if len(cells) != len(self.words):
            raise Refusal(what, value=text[:40], where=f"{self.name}, line {line}")
        row = []
        for k in picks:
            number = self.number(cells[k])
            if number is None or abs(number) > LARGEST_NUMBER:
                raise Refusal(
                    f"{what}, column {self.words[k]}",
                    value=text[:40],
                    where=f"{self.name}, line {line}",
                )
            row.append(number)
        return row

    def times(self, index: int, unit: str = "") -> tuple[np.ndarray, str]:
        """Return the times (N,) of a column in s, and a note or "".

        unit: as the header names it. Without one, times since 1970 are known by their
        size. Those are counted from the first row, in whole numbers, as a float does
        not hold ns since 1970."""
        cells = []
        for line, text in self.rows:
            row = self.cells(text)
            cell = row[index] if index < len(row) else ""
            if self.number(cell) is None:
                raise Refusal(
                    f"{formatted(cell, 30)} is no time",
                    where=f"{self.name}, line {line}, column {self.words[index]}",
                    instead="give the time in s as a number",
                )
            cells.append(cell)
        word = self.words[index]
        first = self.number(cells[0]) if cells else 0.0
        units = [unit] if unit else ["s", "ms", "us", "ns"]
        since = [
            x for x in units if EPOCH[0] < first * UNITS["time"].get(x, 0.0) < EPOCH[1]
        ]
        if not since:
            if first > LARGEST_NUMBER and not unit:
                raise Refusal(
                    f"{word} is {first:g}, in no unit that is known",
                    where=f"{self.name}, line {self.lines[0]}",
                    instead=f"name it, for example {word}_ns",
                )
            values = np.array([self.number(cell) for cell in cells], float)
            return values * UNITS["time"].get(unit, 1.0), ""
        if all(re.fullmatch("[0-9]+", cell) for cell in cells):
            start = int(cells[0])
            values = np.array([int(cell) - start for cell in cells], float)
        else:
            values = np.array([self.number(cell) for cell in cells], float) - first
        note = f"{word} is in {since[0]} since 1970, counted from the first row"
        return values * UNITS["time"][since[0]], note

    def find(
        self, columns: Sequence[Column], others: Sequence[Column] = ()
    ) -> dict[str, Found]:
        """Return where columns are, by name: ``columns``, which are needed, and those
        of ``others`` that the file has. Refusal for a column that is missing, there
        twice, or in a unit of another kind."""
        found = {}
        for column in (*columns, *others):
            matches = []
            for k, word in enumerate(self.words):
                unit = column.matches(word)
                if unit is not None:
                    matches.append((k, unit))
            if len(matches) > 1:
                raise Refusal(
                    f"the header has {len(matches)} columns {column.name}",
                    where=self.place,
                    because=self.found,
                    instead="keep one",
                )
            if matches:
                index, unit = matches[0]
                with located(self.place):
                    factor = column.factor(self.words[index], unit)
                found[column.name] = Found(
                    index,
                    unit,
                    factor,
                    is_time=column.kind == "time",
                    note=column.taken(self.words[index], unit),
                )
            elif column in columns:
                needed = ",".join(x.name for x in columns)
                raise Refusal(
                    f"the header has no column {column.name}",
                    where=self.place,
                    because=self.found,
                    instead=f"it must have {needed}",
                )
        return found

    def take(
        self, columns: Sequence[Column], others: Sequence[Column] = ()
    ) -> dict[str, np.ndarray]:
        """Return the values (N,), by name, of the columns that `find` finds, in their
        units, and note what was decided."""
        found = self.find(columns, others)
        values, notes = self.values(found)
        self.tell(notes)
        return values

    def values(
        self, found: Mapping[str, Found]
    ) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
        """Return the values (N,) of columns by name, and what was decided of them."""
        notes = [*self.notes, *(x.note for x in found.values() if x.note)]
        values = {}
        picks = [x.index for x in found.values() if not x.is_time]
        rest = iter(self._picked(picks).T)
        for name, column in found.items():
            if column.is_time:
                values[name], note = self.times(column.index, column.unit)
                notes += [note] if note else []
            elif column.factor == 1.0:
                values[name] = next(rest)
            else:
                values[name] = next(rest) * column.factor
        return values, tuple(notes)

    def tell(self, notes: Sequence[str] | None = None) -> None:
        """Warn in one `Note` of what was decided, by default ``self.notes``."""
        notes = self.notes if notes is None else notes
        if notes:
            warnings.warn(f"{self.name}: {'; '.join(notes)}", Note, stacklevel=4)


def read(path: str | Path, largest: int, what: str) -> Rows:
    """Return the table in a text file of at most ``largest`` bytes; Refusal with what
    the file should be (``what``) if it is none."""
    try:
        raw = files.read(path, largest)
    except (OSError, ValueError) as error:
        raise Refusal(
            f"cannot read {str(path)!r}",
            because=files.reason_of(error),
            instead=what,
        ) from None
    refuse_foreign(path, raw)
    text, notes = _decoded(raw)
    if text is None:
        raise Refusal(
            f"cannot read {str(path)!r}", because="it is not text", instead=what
        )
    filled, comments = _without_comments(text)
    separator = _separator([line for _, line in filled[:SAMPLE]])
    if separator != ",":
        notes.append(f"columns are parted by {SEPARATORS[separator]}")
    nothing = separator + ' "\t'
    filled = [(line, x) for line, x in filled if x.strip(nothing)]
    with located(Path(path).name):
        line, words, rows = _headed(filled, comments, separator, notes)
    if line is None:
        columns = len(split(filled[0][1], separator))
        raise Refusal(
            f"it has no header: its first line has {columns} numbers",
            where=f"{Path(path).name}, line {filled[0][0]}",
            instead=f"put a line with the names of its {columns} columns above; {what}",
        )
    words, rows = _without_empty_column(words, rows, separator)
    rows = _without_end(rows, len(words), separator, notes)
    decimal = _decimal(rows, separator, Path(path).name)
    if decimal == ",":
        notes.append("numbers have decimal commas")
    return Rows(
        Path(path).name,
        hashlib.sha256(raw).hexdigest(),
        line,
        tuple(words),
        rows,
        [_with_points(comment, decimal) for _, comment in comments],
        separator,
        decimal,
        tuple(notes),
    )


# The steps.


def _decoded(raw: bytes) -> tuple[str | None, list[str]]:
    """Return the text of a file with equal line ends, None if it has none, and notes.

    Excel writes UTF-16 with a mark at the start as "Unicode text", and Windows-1252 as
    CSV; without a mark every second byte of UTF-16 is 0."""
    notes = []
    encoding = "utf-8-sig"
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        encoding = "utf-16"
    elif len(raw) > 3 and not any(raw[1:200:2]) and all(raw[0:200:2]):
        encoding = "utf-16-le"
    elif len(raw) > 3 and not any(raw[0:200:2]) and all(raw[1:200:2]):
        encoding = "utf-16-be"
    try:
        text = raw.decode(encoding)
    except UnicodeDecodeError:
        if encoding != "utf-8-sig":
            return None, notes
        encoding = "cp1252"
        text = raw.decode(encoding, "replace")
    if CONTROL.search(text):
        return None, notes
    if encoding == "cp1252":
        notes.append("its letters are read as Windows-1252, as they are not UTF-8")
    elif encoding != "utf-8-sig":
        notes.append("it is UTF-16")
    return text.replace("\r\n", "\n").replace("\r", "\n"), notes


def _without_comments(
    text: str,
) -> tuple[list[tuple[int, str]], list[tuple[int, str]]]:
    """Return (line number, text) of the lines with something in them, and of the texts
    after #."""
    filled = []
    comments = []
    for number, line in enumerate(text.split("\n"), 1):
        line, _, comment = line.partition("#")
        if line.strip():
            filled.append((number, line.strip(" ")))
        if comment.strip():
            comments.append((number, comment.strip()))
    return filled, comments


def _with_points(comment: str, decimal: str) -> str:
    """Return a comment with decimal points, where the numbers have decimal commas."""
    if decimal == ",":
        return re.sub(r"(?<=[0-9]),(?=[0-9])", ".", comment)
    return comment


def split(text: str, separator: str) -> list[str]:
    """Return the cells of a line, without blanks and quotes around them. Many blanks
    part as one does, and none before a unit in parentheses."""
    if '"' in text:
        try:
            cells = next(
                csv.reader([text], delimiter=separator, skipinitialspace=True), []
            )
        except csv.Error:
            cells = text.split(separator)
    elif separator == " ":
        cells = re.split(r"[ \t]+(?![(\[])", text.strip())
    else:
        cells = text.split(separator)
    return [cell.strip(' \t"') for cell in cells]


def _is_number(cell: str) -> bool:
    """Return whether a cell looks like a number, with whatever decimal mark. A comma
    in a cell is one of a number or a text, as those that part cells are gone."""
    return any(form.fullmatch(cell) for form in (NUMBER, WITH_COMMA, THOUSANDS))


def _separator(lines: list[str]) -> str:
    """Return the separator that parts lines into most cells with numbers: those of the
    lines with the number of cells that most lines have, which must be two or more."""
    best = ","
    most = (0, 0)
    is_parted = False  # all lines alike, by another one than blanks
    for separator in SEPARATORS:
        rows = [split(line, separator) for line in lines]
        widths = Counter(len(row) for row in rows if len(row) > 1)
        if not widths or (separator == " " and is_parted):
            continue
        width, count = max(widths.items(), key=lambda item: (item[1], item[0]))
        numbers = sum(
            _is_number(cell) for row in rows if len(row) == width for cell in row
        )
        is_parted = is_parted or count == len(lines)
        if (numbers, count) > most:
            best = separator
            most = (numbers, count)
    return best


def _headed(
    filled: list[tuple[int, str]],
    comments: list[tuple[int, str]],
    separator: str,
    notes: list[str],
) -> tuple[int | None, list[str], list[tuple[int, str]]]:
    """Return line number and words of the header and the lines below it; None for the
    line if there is no header. What is above it is added to the comments."""
    if not filled:
        return 1, [""], []
    cells = [split(text, separator) for _, text in filled[:SAMPLE]]
    stacked = [k for k, row in enumerate(cells) if row[0].lower() in STACKED]
    if stacked:
        line, _ = filled[stacked[0]]
        return line, cells[stacked[0]], filled[stacked[0] + 1 :]
    body = _first_row(cells)
    if body == 0:
        return _commented(filled, comments, separator, notes)
    above = range(len(cells) if body is None else body)
    words = [k for k in above if len(cells[k]) > 1 and _is_words(cells[k])]
    if body is None or not words:
        head = 0
    else:
        head = words[-1]
    below = head + 1
    units: list[str] = []
    if head > 0 and head - 1 in words and _is_units(cells[head]):
        units = cells[head]
        head -= 1
    line = filled[head][0]
    if head > 0:
        notes.append(f"the lines above line {line}, its header, are no rows")
        comments[:0] = filled[:head]
    header = cells[head]
    if units and len(units) == len(header):
        notes.append(f"line {filled[below - 1][0]} is one of units")
        with located(f"line {filled[below - 1][0]}"):
            header = [_with_unit(*both) for both in zip(header, units)]
    if header and header[0].startswith("%"):  # of ROS
        header = [header[0][1:].strip(), *header[1:]]
    return line, header, filled[below:]


def _first_row(cells: list[list[str]]) -> int | None:
    """Return the index of the first line that has as many cells, and words in the same
    ones, as most lines with numbers; None if no line has a number."""
    kinds = []
    for row in cells:
        words = [
            k
            for k, cell in enumerate(row)
            if cell.lower() not in MISSING and not _is_number(cell)
        ]
        has_number = any(_is_number(cell) for cell in row)
        is_row = has_number and len(row) > 1
        kinds.append((len(row), tuple(words)) if is_row else None)
    counts = Counter(kind for kind in kinds if kind is not None)
    if not counts:
        return None
    usual = max(counts, key=lambda kind: counts[kind])
    return kinds.index(usual)


def _is_words(row: list[str]) -> bool:
    """Return whether a line may be a header: words, and no number."""
    return any(row) and not any(_is_number(cell) for cell in row)


def _is_units(row: list[str]) -> bool:
    """Return whether most words of a line are units."""
    words = [cell for cell in row if cell.strip("()[]- ")]
    known = [cell for cell in words if unit_of(cell)]
    return 2 * len(known) >= len(words) > 0


def _with_unit(word: str, unit: str) -> str:
    """Return the word of a header with the unit that stands below it; Refusal if it has
    another one."""
    unit = unit.strip("()[]- ")
    own = split_unit(word)[1]
    if own and unit_of(unit) not in ("", own):
        raise Refusal(f"{word} is in {unit} here", instead="keep one of the units")
    if own or not unit:
        return word
    return f"{word} ({unit})"


def _commented(
    filled: list[tuple[int, str]],
    comments: list[tuple[int, str]],
    separator: str,
    notes: list[str],
) -> tuple[int | None, list[str], list[tuple[int, str]]]:
    """Return what `_headed` does for a file that begins with numbers: the comment
    before them is the header if it has as many words, as numpy.savetxt writes it."""
    width = len(split(filled[0][1], separator))
    for line, text in reversed(comments):
        if line < filled[0][0]:
            words = split(text, separator)
            if len(words) == width and _is_words(words):
                notes.append(f"the comment in line {line} is its header")
                comments.remove((line, text))
                return line, words, filled
            break
    return None, [], filled


def _without_empty_column(
    words: list[str], rows: list[tuple[int, str]], separator: str
) -> tuple[list[str], list[tuple[int, str]]]:
    """Return header and rows without a last column in which nothing stands, as of lines
    that end with a separator, or of LabVIEW's comments."""
    if len(words) > 2 and words[-1].lower() == "comment":
        widths = {len(split(text, separator)) for _, text in rows}
        return (words[:-1], rows) if widths == {len(words) - 1} else (words, rows)
    width = len(words) + bool(words[-1])
    if separator == " " or not rows or width < 2:
        return words, rows
    if not all(
        text.rstrip().endswith(separator.strip() or separator) for _, text in rows
    ):
        return words, rows
    if any(len(split(text, separator)) != width for _, text in rows):
        return words, rows
    cut = [(line, text.rstrip().removesuffix(separator)) for line, text in rows]
    return words[: width - 1], cut


def _without_end(
    rows: list[tuple[int, str]], width: int, separator: str, notes: list[str]
) -> list[tuple[int, str]]:
    """Return the rows without lines of words at the end, and without a last row that is
    cut off, where there are others."""
    end = len(rows)
    while end > 1:
        cells = split(rows[end - 1][1], separator)
        is_cut = end == len(rows) and len(cells) < width
        if not is_cut and (len(cells) == width or any(_is_number(x) for x in cells)):
            break
        end -= 1
    whole = [
        k
        for k, (_, text) in enumerate(rows[:end])
        if len(split(text, separator)) == width
    ][:1]
    if end == len(rows) or not whole:
        return rows
    lines = " to ".join(dict.fromkeys(str(rows[k][0]) for k in (end, len(rows) - 1)))
    notes.append(f"line {lines} at its end is no whole row, and is left out")
    return rows[:end]


def _decimal(rows: list[tuple[int, str]], separator: str, name: str) -> str:
    """Return the decimal mark. A comma is one where it parts no cells, or stands in
    quotes, unless all may be groups of thousands; Refusal where these cannot be told
    apart."""
    thousands = None
    for line, text in rows:
        if "," not in text or (separator == "," and '"' not in text):
            continue
        for cell in split(text, separator):
            if WITH_COMMA.fullmatch(cell) and not THOUSANDS.fullmatch(cell):
                return ","
            if THOUSANDS.fullmatch(cell) and thousands is None:
                thousands = line, cell
    if thousands is None:
        return "."
    if (
        separator == ";"
    ):  # where a comma is decimal: a spreadsheet writes ; for that reason
        return ","
    line, cell = thousands
    raise Refusal(
        f"{formatted(cell, 30)} may have a decimal comma, or group thousands",
        where=f"{name}, line {line}",
        instead="write numbers with a decimal point, without groups",
    )
