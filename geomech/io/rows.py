"""Tables of numbers in text files, as instruments, trackers and spreadsheets write
them.

All commands use this reader. It works in six steps:

    decode      UTF-8 or UTF-16, with or without a byte order mark, else Windows-1252
    separator   comma, semicolon, tab or blanks: the one that splits the lines into most
                cells with numbers
    header      the last line of words above the rows; the lines above it, and texts
                after #, are comments
    names       of columns, with a unit behind them: depth_mm, "Sinkage (mm)", F/N, or
                in a line of units below
    rows        lines below, without empty ones and an incomplete last one
    numbers     with a decimal comma where the separator leaves no doubt

``notes`` tell what the reader decided for the user. `Rows.take` returns the columns
that a caller asks for, by `Column`, in its units.
"""

from __future__ import annotations

import csv
import hashlib
import itertools
import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from geomech.io import files
from geomech.io.foreign import refuse_foreign
from rft.core.notes import warn
from rft.core.refusal import Refusal, formatted, located

LARGEST_NUMBER = 1e12
ENDINGS = (".csv", ".tsv", ".txt", ".dat")  # of the names of tables
SAMPLE_LINES = 400  # in which separator and header are looked for
HEAD_LINES = 2000  # of a file whose header alone is asked for
SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", " ": "blanks"}
# First words of the header lines of DeepLabCut.
DEEPLABCUT_WORDS = ("scorer", "individuals", "bodyparts", "coords")
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
EPOCH = (9.4e8, 4.2e9)  # s since 1970 of the years 1999 to 2103


class Column(NamedTuple):
    """A column that a caller asks for.

    name: as messages spell it, such as psi_deg. kind: of `UNITS`, "" for a number
    without a unit. unit: of the values returned, and of the file's where the header
    names none. names: that it may have in a file, without the unit, in lower case with
    _ for blanks, the usual one first."""

    name: str
    kind: str = ""
    unit: str = ""
    names: tuple[str, ...] = ()

    def matches(self, word: str) -> str | None:
        """Return the unit that a word of the header gives this column, "" for none;
        None if it is the word of another column."""
        name = plain(word)
        if name == self.name.lower():
            return self.unit
        if name in self.names:
            return ""
        bare, unit = split_unit(word)
        return unit if plain(bare) in self.names else None

    def unit_note(self, word: str, unit: str) -> str:
        """Return a note if a word has no unit where the column's usual name has one;
        else ""."""
        if unit or not self.unit or split_unit(self.name)[1] != self.unit:
            return ""
        return f"{word} is assumed to be in {self.unit}"

    def factor(self, word: str, unit: str) -> float:
        """Return the factor from a unit of the file to the column's own; Refusal for a
        unit of another kind."""
        units = UNITS.get(self.kind, {})
        if unit == "":
            return 1.0
        if unit == "MN" and word.isupper():
            raise Refusal(
                f"the unit of column {word} may be mN or MN",
                instead="write the unit with its capital letters",
            )
        if unit not in units:
            cure = "leave the unit out, this column has none"
            if units:
                cure = f"give it in {' or '.join([*units][:4])}"
            raise Refusal(f"column {word} is in {formatted(unit, 30)}", instead=cure)
        return units[unit] / units[self.unit]


class ColumnPlace(NamedTuple):
    """Where a column is in a file.

    index: among the file's columns. unit: in the file. factor: to the unit that is
    asked for. note: on what was assumed, or ""."""

    index: int
    unit: str
    factor: float
    is_time: bool = False
    note: str = ""


def plain(word: str) -> str:
    """Return a word in lower case with _ for blanks, dots and hyphens."""
    return re.sub(r"[\s.\-]+", "_", word.strip().lower()).strip("_")


def split_unit(word: str) -> tuple[str, str]:
    """Return the name of a column and its unit, "" without one: of x_mm, "x mm",
    "x (mm)", "x [mm]" or x/mm."""
    word = word.strip()
    # The time of the patterns below grows with the square of the length.
    if len(word) > LONGEST_NAME:
        return word, ""
    match = re.fullmatch(r"(.+?)[\s_]*[(\[]\s*([^()\[\]]*?)\s*[)\]]", word)
    if match:
        return match[1], unit_of(match[2]) or match[2]
    match = re.fullmatch(r"(.+?)(?:\s*/\s*|[\s_]+in[\s_]+|[\s_]+)([^\s_]+)", word)
    if match:
        unit = unit_of(match[2])
        if unit:
            return match[1], unit
    return word, ""


def unit_of(text: str) -> str:
    """Return a unit as `UNITS` spells it, px for pixels, BL for body lengths; "" for a
    text that is no unit. A unit in the wrong case is taken if none fits exactly."""
    text = re.sub(r"\^|\*\*|\s", "", text.strip(" ()[]"))
    text = text.translate({0xB5: "u", 0x3BC: "u", 0xB2: "2", 0xB3: "3"})
    if text.lower() in PIXELS:
        return "px"
    if text.lower() in ("bl", "body_lengths"):
        return "BL"
    units = list(itertools.chain.from_iterable(UNITS.values()))
    if text in units:
        return text
    for unit in units:
        if unit.lower() == text.lower():
            return unit
    return ""


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
        """Line number and words of the header, in lower case."""
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
    def header_text(self) -> str:
        """The words of the header, for a Refusal. "" for a file without rows of
        numbers: it may be any file, whose first line no message should show."""
        if all(self.number(x) is None for x in self.first_cells()):
            return ""
        return f"the columns are {formatted(', '.join(self.words), 200)}"

    def first_cells(self) -> list[str]:
        """Return the cells of the first row; none without a row."""
        if not self.rows:
            return []
        return self.cells(self.rows[0][1])

    def cells(self, text: str) -> list[str]:
        """Return the cells of a row, without blanks and quotes around them."""
        return split(text, self.separator)

    def column(self, k: int) -> list[str]:
        """Return the cells (N,) of a column; each row has that many."""
        texts = [text for _, text in self.rows]
        if self.separator == " " or any('"' in text for text in texts):
            return [self.cells(text)[k] for text in texts]
        return [text.split(self.separator, k + 1)[k].strip() for text in texts]

    def number(self, cell: str) -> float | None:
        """Return the number in a cell, None if it is none. Digits in groups, as 1_000,
        digits of other scripts, nan and inf are no numbers."""
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
        Refusal with the line of a row that has anything else."""
        names = columns if selected is None else selected
        return self._numbers_at([[*columns].index(name) for name in names])

    def plain_numbers(self, indices: Sequence[int]) -> np.ndarray | None:
        """Return the numbers (N, k) in k columns of the file, read by NumPy at
        once; None where a row has anything else, which the caller reads cell by cell,
        to say where it is."""
        texts = [text for _, text in self.rows]
        separators = len(self.words) - 1
        if self.separator == " " or self.decimal != "." or not texts or not indices:
            return None
        for text in texts:
            if text.count(self.separator) != separators or '"' in text:
                return None
        try:
            values = np.loadtxt(
                texts,
                delimiter=self.separator,
                usecols=indices,
                comments=None,
                ndmin=2,
            )
        except ValueError:
            return None
        if not (np.abs(values) <= LARGEST_NUMBER).all():
            return None
        return values

    def _numbers_at(self, indices: list[int]) -> np.ndarray:
        """Return the numbers (N, k) in k columns of the file."""
        plain = self.plain_numbers(indices)
        if plain is not None:
            return plain
        values = [self._row_at(line, text, indices) for line, text in self.rows]
        return np.array(values).reshape(-1, len(indices))

    def _row_at(self, line: int, text: str, indices: list[int]) -> list[float]:
        cells = self.cells(text)
        names = ",".join(self.words)
        expected = f"{len(self.words)} finite numbers ({names})"
        what = f"a row must be {expected}, at most {LARGEST_NUMBER:g}"
        if len(cells) != len(self.words):
            raise Refusal(what, value=text[:40], where=f"{self.name}, line {line}")
        row = []
        for k in indices:
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
        """Return the times (N,) of a column, s, and a note or "".

        unit: that the header names, or "". Times since 1970 are recognised by their
        size, and are counted from the first row."""
        plain = self.plain_numbers([index])
        if plain is not None and not _unit_since_1970(plain[0, 0], unit):
            return plain[:, 0] * UNITS["time"].get(unit, 1.0), ""
        cells = self._time_cells(index)
        word = self.words[index]
        first = self.number(cells[0]) if cells else 0.0
        epoch_unit = _unit_since_1970(first, unit)
        if epoch_unit:
            note = (
                f"{word} is in {epoch_unit} since 1970 and is counted from the first "
                "row"
            )
            return self._since_first(cells) * UNITS["time"][epoch_unit], note
        if first > LARGEST_NUMBER and not unit:
            raise Refusal(
                f"{word} is {first:g}, and its unit cannot be recognised",
                where=f"{self.name}, line {self.lines[0]}",
                instead=f"name the unit, for example {word}_ns",
            )
        values = np.array([self.number(cell) for cell in cells], float)
        return values * UNITS["time"].get(unit, 1.0), ""

    def _time_cells(self, index: int) -> list[str]:
        """Return the cells of a column; Refusal for one that is no number."""
        cells = []
        for line, text in self.rows:
            row = self.cells(text)
            cell = row[index] if index < len(row) else ""
            if self.number(cell) is None:
                raise Refusal(
                    f"{formatted(cell, 30)} is not a time",
                    where=f"{self.name}, line {line}, column {self.words[index]}",
                    instead="give the time in s as a number",
                )
            cells.append(cell)
        return cells

    def _since_first(self, cells: list[str]) -> np.ndarray:
        """Return numbers (N,) less the first of them."""
        # Whole numbers are subtracted as such: a float cannot hold ns since 1970.
        if all(re.fullmatch("[0-9]+", cell) for cell in cells):
            start = int(cells[0])
            return np.array([int(cell) - start for cell in cells], float)
        values = np.array([self.number(cell) for cell in cells], float)
        return values - values[0]

    def find(
        self, columns: Sequence[Column], others: Sequence[Column] = ()
    ) -> dict[str, ColumnPlace]:
        """Return where columns are, by name: ``columns``, which are required, and those
        of ``others`` that the file has. Refusal for a column that is missing, that
        occurs twice, or that is in a unit of another kind."""
        places = {}
        for column in (*columns, *others):
            place = self._place_of(column)
            if place is not None:
                places[column.name] = place
            elif column in columns:
                required = ",".join(x.name for x in columns)
                raise Refusal(
                    f"the header has no column {column.name}",
                    where=self.place,
                    because=self.header_text,
                    instead=f"it must have {required}",
                )
        return places

    def _place_of(self, column: Column) -> ColumnPlace | None:
        """Return where a column is, None if the file does not have it."""
        matches = []
        for k, word in enumerate(self.words):
            unit = column.matches(word)
            if unit is not None:
                matches.append((k, unit))
        if not matches:
            return None
        if len(matches) > 1:
            raise Refusal(
                f"the header has {len(matches)} columns {column.name}",
                where=self.place,
                because=self.header_text,
                instead="keep one of them",
            )
        index, unit = matches[0]
        word = self.words[index]
        with located(self.place):
            factor = column.factor(word, unit)
        return ColumnPlace(
            index,
            unit,
            factor,
            is_time=column.kind == "time",
            note=column.unit_note(word, unit),
        )

    def take(
        self, columns: Sequence[Column], others: Sequence[Column] = ()
    ) -> dict[str, np.ndarray]:
        """Return the values (N,), by name, of the columns that `find` finds, in their
        units, and issue a note of what was decided."""
        values, notes = self.values(self.find(columns, others))
        self.issue(notes)
        return values

    def values(
        self, places: Mapping[str, ColumnPlace]
    ) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
        """Return the values (N,) of columns by name, and notes of what was decided."""
        notes = [*self.notes, *(x.note for x in places.values() if x.note)]
        values = {}
        indices = [x.index for x in places.values() if not x.is_time]
        numbers = iter(self._numbers_at(indices).T)
        for name, place in places.items():
            if place.is_time:
                values[name], note = self.times(place.index, place.unit)
                if note:
                    notes.append(note)
            elif place.factor == 1.0:
                values[name] = next(numbers)
            else:
                values[name] = next(numbers) * place.factor
        return values, tuple(notes)

    def issue(self, notes: Sequence[str] | None = None) -> None:
        """Warn (`Note`) of what was decided, in one line; by default of
        ``self.notes``."""
        notes = self.notes if notes is None else notes
        if notes:
            warn(f"{self.name}: {'; '.join(notes)}")


def read_header(path: str | Path, largest: int, what: str) -> tuple[str, ...]:
    """Return the words of the header that `read` finds, as `Rows.header` has them, from
    the first lines of a file, unless they are all comments."""
    _, words = read(path, largest, what, HEAD_LINES).header
    if any(words):
        return words
    return read(path, largest, what).header[1]


def read(
    path: str | Path, largest: int, what: str, most_lines: int | None = None
) -> Rows:
    """Return the table in a text file of at most ``largest`` bytes. Refusal if it is
    none. what: the cure of that refusal, the columns that the file should have.
    most_lines: from the top of the file, by default all."""
    if not isinstance(path, (str, Path)):
        raise Refusal("a table must be given by the name of its file", value=path)
    name = Path(path).name
    try:
        raw = files.read(path, largest)
    except (OSError, ValueError) as error:
        raise Refusal(
            f"cannot read {str(path)!r}",
            because=files.reason_of(error),
            instead=what,
        ) from None
    refuse_foreign(path, raw)
    text, notes = _decode(raw)
    if text is None:
        raise Refusal(
            f"cannot read {str(path)!r}", because="it is not text", instead=what
        )
    if most_lines is not None:
        text = "\n".join(text.split("\n", most_lines)[:most_lines])
    lines, comments = _without_comments(text)
    separator = _separator([line for _, line in lines[:SAMPLE_LINES]])
    if separator != ",":
        notes.append(f"columns are separated by {SEPARATORS[separator]}")
    # A line of separators alone is empty.
    lines = [(k, line) for k, line in lines if line.strip(separator + ' "\t')]
    with located(name):
        line, words, rows = _find_header(lines, comments, separator, notes)
    if line is None:
        columns = len(split(lines[0][1], separator))
        raise Refusal(
            f"the file has no header: its first line has {columns} numbers",
            where=f"{name}, line {lines[0][0]}",
            instead=f"add a line above with the names of its {columns} columns; {what}",
        )
    words, rows = _without_empty_column(words, rows, separator)
    rows = _without_cut_end(rows, len(words), separator, notes)
    decimal = _decimal_mark(rows, separator, name)
    if decimal == ",":
        notes.append("numbers have decimal commas")
    return Rows(
        name,
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


def _unit_since_1970(time: float, unit: str) -> str:
    """Return the unit in which a time is likely since 1970: ``unit``, or one of several
    if that is ""; "" if it is not since 1970."""
    units = [unit] if unit else ["s", "ms", "us", "ns"]
    for name in units:
        if EPOCH[0] < time * UNITS["time"].get(name, 0.0) < EPOCH[1]:
            return name
    return ""


def _encoding(raw: bytes) -> str:
    """Return the likely encoding of a text, UTF-16 or UTF-8.

    Excel writes UTF-16 with a byte order mark as "Unicode text". Without the mark every
    second byte of UTF-16 is 0, as long as the letters are Latin."""
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return "utf-16"
    if len(raw) > 3 and not any(raw[1:200:2]) and all(raw[0:200:2]):
        return "utf-16-le"
    if len(raw) > 3 and not any(raw[0:200:2]) and all(raw[1:200:2]):
        return "utf-16-be"
    return "utf-8-sig"


def _decode(raw: bytes) -> tuple[str | None, list[str]]:
    """Return the text of a file with line ends \\n, None if it has none, and notes."""
    notes = []
    encoding = _encoding(raw)
    try:
        text = raw.decode(encoding)
    except UnicodeDecodeError:
        if encoding != "utf-8-sig":
            return None, notes
        encoding = "cp1252"  # as Excel writes CSV
        text = raw.decode(encoding, "replace")
    if CONTROL.search(text):
        return None, notes
    if encoding == "cp1252":
        notes.append(
            "its characters are read as Windows-1252 because they are not valid UTF-8"
        )
    elif encoding != "utf-8-sig":
        notes.append("it is UTF-16")
    return text.replace("\r\n", "\n").replace("\r", "\n"), notes


def _without_comments(
    text: str,
) -> tuple[list[tuple[int, str]], list[tuple[int, str]]]:
    """Return (line number, text) of the lines that are not empty, and of the texts
    after #."""
    numbered = enumerate(text.split("\n"), 1)
    if "#" not in text:
        return [(k, line.strip(" ")) for k, line in numbered if line.strip()], []
    lines = []
    comments = []
    for number, line in numbered:
        line, _, comment = line.partition("#")
        if line.strip():
            lines.append((number, line.strip(" ")))
        if comment.strip():
            comments.append((number, comment.strip()))
    return lines, comments


def _with_points(comment: str, decimal: str) -> str:
    """Return a comment with decimal points, where the numbers have decimal commas."""
    if decimal == ",":
        return re.sub(r"(?<=[0-9]),(?=[0-9])", ".", comment)
    return comment


def split(text: str, separator: str) -> list[str]:
    """Return the cells of a line, without blanks and quotes around them. Several blanks
    count as one separator; a blank before a unit in parentheses is none."""
    if '"' in text:
        reader = csv.reader([text], delimiter=separator, skipinitialspace=True)
        try:
            cells = next(reader, [])
        except csv.Error:
            cells = text.split(separator)
    elif separator == " ":
        cells = re.split(r"[ \t]+(?![(\[])", text.strip())
    else:
        cells = text.split(separator)
    return [cell.strip(' \t"') for cell in cells]


def _is_number(cell: str) -> bool:
    """Return whether a cell looks like a number, with any decimal mark."""
    # A comma in a cell belongs to a number or a text: the line is split already.
    return any(form.fullmatch(cell) for form in (NUMBER, WITH_COMMA, THOUSANDS))


def _separator(lines: list[str]) -> str:
    """Return the separator that splits lines into most cells with numbers. Only lines
    with the usual number of cells count, which must be two or more."""
    best = ","
    highest = (0, 0)
    is_split = False  # all lines into as many cells, by another separator than blanks
    for separator in SEPARATORS:
        rows = [split(line, separator) for line in lines]
        widths = Counter(len(row) for row in rows if len(row) > 1)
        if not widths or (separator == " " and is_split):
            continue
        width, count = max(widths.items(), key=lambda item: (item[1], item[0]))
        is_split = is_split or count == len(lines)
        numbers = 0
        for row in rows:
            if len(row) == width:
                numbers += sum(map(_is_number, row))
        if (numbers, count) > highest:
            best = separator
            highest = (numbers, count)
    return best


def _find_header(
    lines: list[tuple[int, str]],
    comments: list[tuple[int, str]],
    separator: str,
    notes: list[str],
) -> tuple[int | None, list[str], list[tuple[int, str]]]:
    """Return line number and words of the header, and the lines below it; None for the
    line number if there is no header. Lines above it are added to the comments."""
    if not lines:
        return 1, [""], []
    cells = [split(text, separator) for _, text in lines[:SAMPLE_LINES]]
    for k, row in enumerate(cells):
        if row[0].lower() in DEEPLABCUT_WORDS:
            return lines[k][0], row, lines[k + 1 :]
    first_row = _first_row(cells)
    if first_row == 0:
        return _header_in_comment(lines, comments, separator, notes)

    # The last line of words above the rows; without rows or such a line the first one.
    words = []
    if first_row is not None:
        above = range(first_row)
        words = [k for k in above if len(cells[k]) > 1 and _is_words(cells[k])]
    head = words[-1] if words else 0
    below = head + 1
    units: list[str] = []
    if head > 0 and head - 1 in words and _is_units(cells[head]):
        units = cells[head]
        head -= 1
    line, _ = lines[head]
    if head > 0:
        notes.append(f"the lines above the header in line {line} are ignored")
        comments[:0] = lines[:head]
    header = cells[head]
    if units and len(units) == len(header):
        unit_line, _ = lines[below - 1]
        notes.append(f"line {unit_line} contains units")
        with located(f"line {unit_line}"):
            header = [_with_unit(word, unit) for word, unit in zip(header, units)]
    # ROS writes a % before the header.
    if header and header[0].startswith("%"):
        header = [header[0][1:].strip(), *header[1:]]
    return line, header, lines[below:]


def _first_row(cells: list[list[str]]) -> int | None:
    """Return the index of the first row of a table: the first line of the kind that
    most lines with numbers have. A kind is a number of cells, and which of them are
    words. None if no line has a number."""
    kinds = [_row_kind(row) for row in cells]
    counts = Counter(kind for kind in kinds if kind is not None)
    if not counts:
        return None
    usual = max(counts, key=lambda kind: counts[kind])
    return kinds.index(usual)


def _row_kind(row: list[str]) -> tuple[int, tuple[int, ...]] | None:
    """Return the number of cells of a line, and the indices of those with words; None
    for a line that is no row of numbers."""
    words = []
    has_number = False
    for k, cell in enumerate(row):
        if _is_number(cell):
            has_number = True
        elif cell.lower() not in MISSING:
            words.append(k)
    if not has_number or len(row) < 2:
        return None
    return len(row), tuple(words)


def _is_words(row: list[str]) -> bool:
    """Return whether a line may be a header: words, and no number."""
    return any(row) and not any(_is_number(cell) for cell in row)


def _is_units(row: list[str]) -> bool:
    """Return whether most words of a line are units."""
    words = [cell for cell in row if cell.strip("()[]- ")]
    units = [cell for cell in words if unit_of(cell)]
    return 2 * len(units) >= len(words) > 0


def _with_unit(word: str, unit: str) -> str:
    """Return a word of the header with the unit that stands below it; Refusal if the
    word has another unit."""
    unit = unit.strip("()[]- ")
    _, unit_of_word = split_unit(word)
    if unit_of_word and unit_of(unit) not in ("", unit_of_word):
        raise Refusal(
            f"{word} is in {unit} here", instead=("keep one of the units of the units")
        )
    if unit_of_word or not unit:
        return word
    return f"{word} ({unit})"


def _header_in_comment(
    lines: list[tuple[int, str]],
    comments: list[tuple[int, str]],
    separator: str,
    notes: list[str],
) -> tuple[int | None, list[str], list[tuple[int, str]]]:
    """Return the header and the lines, as `_find_header`, of a file that begins with
    numbers. The last comment before them is the header if it has as many words, as
    numpy.savetxt writes it."""
    first_line, first_text = lines[0]
    width = len(split(first_text, separator))
    above = [comment for comment in comments if comment[0] < first_line]
    if above:
        line, text = above[-1]
        words = split(text, separator)
        if len(words) == width and _is_words(words):
            notes.append(f"the comment in line {line} is read as the header")
            comments.remove((line, text))
            return line, words, lines
    return None, [], lines


def _without_empty_column(
    words: list[str], rows: list[tuple[int, str]], separator: str
) -> tuple[list[str], list[tuple[int, str]]]:
    """Return header and rows without an empty last column: lines may end with a
    separator, or with LabVIEW's comments."""
    if len(words) > 2 and words[-1].lower() == "comment":
        widths = {len(split(text, separator)) for _, text in rows}
        if widths == {len(words) - 1}:
            return words[:-1], rows
        return words, rows
    # The header has the column as well, without a name, or ends before it.
    width = len(words) + 1 if words[-1] else len(words)
    if separator == " " or not rows or width < 2:
        return words, rows
    ending = separator.strip() or separator
    if not all(text.rstrip().endswith(ending) for _, text in rows):
        return words, rows
    if any(len(split(text, separator)) != width for _, text in rows):
        return words, rows
    cut = [(line, text.rstrip().removesuffix(separator)) for line, text in rows]
    return words[: width - 1], cut


def _without_cut_end(
    rows: list[tuple[int, str]], width: int, separator: str, notes: list[str]
) -> list[tuple[int, str]]:
    """Return the rows without lines of words at the end, and without an incomplete last
    row, if complete rows remain."""
    end = len(rows)
    while end > 1:
        cells = split(rows[end - 1][1], separator)
        is_cut = end == len(rows) and len(cells) < width
        if not is_cut and (len(cells) == width or any(_is_number(x) for x in cells)):
            break
        end -= 1
    if end == len(rows):
        return rows
    if not any(len(split(text, separator)) == width for _, text in rows[:end]):
        return rows
    first = rows[end][0]
    last = rows[-1][0]
    lines = f"{first}" if first == last else f"{first} to {last}"
    notes.append(f"line {lines} at the end of the file is incomplete and is left out")
    return rows[:end]


def _decimal_mark(rows: list[tuple[int, str]], separator: str, name: str) -> str:
    """Return the decimal mark, "." or ",".

    It is a comma where a number has one, and the comma is no separator or stands in
    quotes. Refusal where all such numbers may have groups of thousands, as 1,234,
    unless the separator is a semicolon."""
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
    # Spreadsheets separate by semicolons where the comma is the decimal mark.
    if separator == ";":
        return ","
    line, cell = thousands
    raise Refusal(
        f"{formatted(cell, 30)} may have a decimal comma or thousands separators",
        where=f"{name}, line {line}",
        instead="write numbers with a decimal point and without thousands separators",
    )
