"""Random Nastran decks, read and written by us and read by pyNastran: the same mesh, and nothing but
coordinates changes. MESHSMOOTH_NASTRAN_DECKS: how many, by default 200."""

import json
import math
import os
import random
import re
import subprocess
import tempfile
import unittest
from pathlib import Path

from test_main import main

try:
    from pyNastran.bdf.bdf import BDF
except ImportError:
    BDF = None

DECKS = int(os.environ.get("MESHSMOOTH_NASTRAN_DECKS", "200"))
BATCH = 500
CARDS = {  # card: corners, nodes, our names, the order of Nastran's nodes in VTK's
    "CTRIA3": (3, 3, {3: "triangle"}), "CTRIAR": (3, 3, {3: "triangle"}),
    "CTRIA6": (3, 6, {3: "triangle", 6: "triangle6"}),
    "CQUAD4": (4, 4, {4: "quad"}), "CQUADR": (4, 4, {4: "quad"}), "CSHEAR": (4, 4, {4: "quad"}),
    "CQUAD8": (4, 8, {4: "quad", 8: "quad8"}),
    "CTETRA": (4, 10, {4: "tetrahedron", 10: "tetrahedron10"}),
    "CPYRAM": (5, 13, {5: "pyramid", 13: "pyramid13"}),
    "CPENTA": (6, 15, {6: "wedge", 15: "wedge15"}),
    "CHEXA": (8, 20, {8: "hexahedron", 20: "hexahedron20"}),
}
WEDGE = [0, 2, 1, 3, 5, 4, 8, 7, 6, 14, 13, 12, 9, 11, 10]
HEXAHEDRON = list(range(12)) + [16, 17, 18, 19, 12, 13, 14, 15]


def number(rng, columns, modest):
    """A random number in one of Nastran's forms that fills the columns or less."""
    for _ in range(100):
        exponent = rng.choice((0, 0, 1, -1, -3) if modest else (0, 0, 0, 0, 1, 3, -1, -3, -7, 5, -12, 30))
        value = rng.uniform(-10, 10) * 10.0 ** exponent
        if rng.random() < 0.1:
            value = float(rng.randint(-3, 3))
        text = f"{value:.{rng.randint(0, 9)}{rng.choice('eEfg')}}"
        mantissa, mark, power = re.match(r"([^eE]+)([eE]?)(.*)", text).groups()
        mantissa += "" if "." in mantissa else "."
        if rng.random() < 0.4:
            mantissa = re.sub(r"^(-?)0\.(\d)", r"\1.\2", mantissa)
        if mark:
            form = rng.choice(("E", "e", "D", "d", ""))
            sign = "-" if power.startswith("-") else rng.choice(("+", "+" if form == "" else ""))
            digits = power.lstrip("+-0") or "0"
            text = mantissa + form + sign + (digits if rng.random() < 0.7 else digits.zfill(2))
        else:
            text = mantissa
        if len(text) <= columns:
            return text
    return "1."


class Deck:
    """Pieces of text; a pair stands for a coordinate: its text, and what another may look like."""

    def __init__(self, rng):
        self.rng = rng
        self.pieces = []
        self.end = rng.choice(("\n", "\n", "\r\n"))
        self.make()

    def text(self):
        return "".join(piece if isinstance(piece, str) else piece[0] for piece in self.pieces)

    def pattern(self):
        return "".join(re.escape(piece) if isinstance(piece, str) else piece[1]
                       for piece in self.pieces)

    def add(self, text):
        self.pieces.append(text)

    def comment(self):
        if self.rng.random() < 0.1:
            self.add("$ comment, GRID,7" + self.end)
        if self.rng.random() < 0.03:
            self.add(self.end)

    def make(self):
        rng = self.rng
        count = rng.randint(21, 30)
        ids = rng.sample(range(1, rng.choice((60, 99999999))), count)
        parts = [lambda node=node: self.grid(node) for node in ids]
        systems = self.make_systems(ids)
        parts += systems
        for element in range(rng.randint(1, 8)):
            parts.append(lambda e=element: self.element(e + 1, ids))
        for _ in range(2):
            parts.append(lambda: self.card("FORCE", ["1", str(ids[0]), "", "1.", "0.", "0.", "1."]))
        if rng.random() < 0.5:
            rng.shuffle(parts)
        if rng.random() < 0.5:
            self.add("SOL 101" + self.end + "CEND" + self.end + "BEGIN BULK" + self.end)
        if rng.random() < 0.2 and self.systems and not self.in_basic:
            self.card("GRDSET", ["", str(rng.choice(self.systems))])
        for part in parts:
            self.comment()
            part()
        if rng.random() < 0.7:
            self.add(rng.choice(("ENDDATA", "enddata")) + rng.choice((self.end, "")))

    def make_systems(self, ids):
        rng = self.rng
        self.systems = []
        parts = []
        self.in_basic = set()
        if rng.random() < 0.5:
            return parts
        for system in range(1, rng.randint(2, 5)):
            kind = rng.choice("RCS")
            if rng.random() < 0.2 and not self.in_basic:
                self.in_basic = set(ids[:3])
                parts.append(lambda s=system, k=kind: self.card(
                    f"CORD1{k}", [str(s), *(str(node) for node in ids[:3])]))
            else:
                reference = rng.choice([0] + self.systems) if rng.random() < 0.6 else 0
                values = [f"{rng.uniform(1, 9):.3f}" for _ in range(9)]
                parts.append(lambda s=system, k=kind, r=reference, v=values: self.card(
                    f"CORD2{k}", [str(s), str(r) if r else rng.choice(("", "0")), *v]))
            self.systems.append(system)
        return parts

    def letters(self, name):
        return name.lower() if self.rng.random() < 0.1 else name

    def fields_of(self, fields, columns):
        align = self.rng.choice((str.ljust, str.ljust, str.rjust))
        return [align(field, columns) for field in fields]

    def card(self, name, fields):
        """Whole fields, none of which is a coordinate, in any form."""
        rng = self.rng
        form = rng.choice(("small", "small", "large", "free", "tabs"))
        if any(len(field) > 7 for field in fields) and form == "tabs":
            form = "free"
        width = 4 if form == "large" else 8
        rows = [fields[at:at + width] for at in range(0, len(fields), width)]
        if form == "large" and len(rows) == 1:
            rows.append([])
        name = self.letters(name)
        for place, row in enumerate(rows):
            last = place == len(rows) - 1
            marked = rng.random() < 0.5
            if form == "free":
                head = name if place == 0 else rng.choice(("", "+"))
                self.add(",".join([head, *row]) + self.end)
            elif form == "tabs":
                head = name if place == 0 else rng.choice(("", "+"))
                self.add("\t".join([head, *row]).rstrip("\t") + self.end)
                if self.pieces[-1].strip() == "":
                    self.pieces.pop()
            elif form == "small":
                head = name if place == 0 else rng.choice(("", "+", "+A1"))
                line = head.ljust(8) + "".join(self.fields_of(row, 8))
                self.add((line.ljust(72) + "+A1" if marked and not last else line.rstrip()) + self.end)
                if self.pieces[-1].strip() == "":
                    self.pieces.pop()
            else:
                head = name + "*" if place == 0 else rng.choice(("*", "*B2"))
                line = head.ljust(8) + "".join(self.fields_of(row, 16))
                self.add((line.ljust(72) + "*B2" if marked and not last else line.rstrip()) + self.end)
            if not last and rng.random() < 0.1:
                self.add("$ between" + self.end)

    def grid(self, node):
        rng = self.rng
        system = ""
        if node in self.in_basic:
            system = "0"
        elif self.systems and rng.random() < 0.5:
            system = str(rng.choice(self.systems))
        form = rng.choice(("small", "small", "large", "free", "tabs", "free large"))
        if form == "tabs" and node > 9999999:
            form = "small"
        columns = 16 if "large" in form else 7 if form == "tabs" else 8
        if node in self.in_basic:
            words = [f"{rng.uniform(-9, 9):.2f}" for _ in range(3)]
        else:
            modest = bool(self.systems)  # angles
            words = [number(rng, rng.choice((columns, 7)), modest) for _ in range(3)]
        if rng.random() < 0.15 and node not in self.in_basic:
            words[rng.randrange(3)] = ""
        rest = ["", "", "123"] if rng.random() < 0.3 else []
        getattr(self, "grid_" + form.replace(" ", "_"))(node, system, words, rest[1:])

    def end_of_line(self):
        if self.rng.random() < 0.1:
            self.add(self.rng.choice((" $ note", "$ GRID")))
        self.add(self.end)

    def columns(self, words, width, rest):
        """Right or left in their columns; the line may end in the last one."""
        fields = self.fields_of(words, width)
        if not rest:
            text = "".join(fields).rstrip()
            for at in range(len(words)):
                field = text[at * width:(at + 1) * width]
                self.pieces.append((field, rf"(?:{re.escape(field)} *|[-+.0-9 ]{{{width}}} *)"))
            return
        for field in fields:
            self.pieces.append((field, rf"[-+.0-9eEdD ]{{{width}}}"))
        self.add("".join(field.ljust(width) for field in rest).rstrip())

    def grid_small(self, node, system, words, rest):
        head = self.letters("GRID").ljust(8) + str(node).ljust(8) + system.rjust(8)
        if not any(words) and not rest:
            words = ["1.", "", ""]
        self.add(head)
        self.columns(words, 8, rest)
        self.end_of_line()

    def grid_large(self, node, system, words, rest):
        self.add(self.letters("GRID") + "*   " + str(node).ljust(16) + system.rjust(16))
        mark = self.rng.choice(("", "*C3"))
        self.columns(words[:2], 16, [mark] if mark else [])
        self.add(self.end)
        if self.rng.random() < 0.1:
            self.add("$ between" + self.end)
        self.add("*" + (mark[1:] if mark else "").ljust(7))
        self.columns(words[2:], 16, rest)
        self.end_of_line()

    def grid_tabs(self, node, system, words, rest):
        self.add("\t".join([self.letters("GRID"), str(node), system, ""]))
        for word in words:
            self.pieces.append((word, rf"(?:{re.escape(word)}|[-+.0-9 ]{{7}})"))
            self.add("\t")
        self.add("\t".join(rest) if rest else "0")
        self.add(self.end)

    def free(self, words):
        for word in words:
            blank = self.rng.choice(("", "", " ")) if word else ""
            self.add("," + blank)
            self.pieces.append((word, "[-+.0-9eEdD]*"))
            self.add(blank)

    def grid_free(self, node, system, words, rest):
        self.add(f"{self.letters('GRID')},{node},{system}")
        self.free(words)
        self.add("".join("," + field for field in rest))
        self.end_of_line()

    def grid_free_large(self, node, system, words, rest):
        self.add(f"{self.letters('GRID')}*,{node},{system}")
        self.free(words[:2])
        self.add(self.end + "*")
        self.free(words[2:])
        self.add("".join("," + field for field in rest))
        self.end_of_line()

    def element(self, element, ids):
        rng = self.rng
        card = "CTRIA3" if element == 1 else rng.choice(sorted(CARDS))
        corners, most, _ = CARDS[card]
        nodes = [str(node) for node in rng.sample(ids, rng.choice((corners, most)))]
        if len(nodes) > corners and rng.random() < 0.15:
            nodes[rng.randrange(corners, len(nodes))] = ""
        may_be_blank = card in ("CTRIA3", "CQUAD4")  # to pyNastran
        prop = "" if may_be_blank and rng.random() < 0.3 else str(rng.randint(1, 9))
        self.card(card, [str(element), prop, *nodes])


def read_by_peer(path):
    model = BDF(debug=None, log=None)
    model.read_bdf(path, xref=False, validate=False, punch="BEGIN" not in path.read_text("latin-1"))
    for coordinates in model.coords.values():
        if coordinates.cid:
            coordinates.cross_reference(model)
    for node in model.nodes.values():
        if model.grdset is not None and not node.cp:  # pyNastran forgets it
            node.cp = model.grdset.cp
        node.cross_reference(model)
    for coordinates in model.coords.values():
        coordinates.setup()
    return model


def bound(value, columns):
    """Half of the last digit that fits into the columns in the form 1.23-4."""
    if value == 0:
        return 0
    exponent = math.floor(math.log10(abs(value)))
    mark = 0 if exponent == 0 else 1 + len(str(abs(exponent)))
    digits = columns - (value < 0) - 1 - mark
    return 0.5001 * 10.0 ** (exponent + 1 - max(digits, 1))


@unittest.skipUnless(BDF, "pyNastran is not installed: pip install pyNastran")
class RandomDecks(unittest.TestCase):
    def check_same(self, deck, positions, ours, model, what):
        self.assertEqual(sorted(ours["ids"]), sorted(model.nodes), deck)
        for node, position in zip(ours["ids"], positions):
            theirs = model.nodes[node].get_position()
            scale = max(1e-300, max(abs(x) for x in (*theirs, *position)),
                        abs(model.nodes[node].xyz[0]))
            origin = max(abs(x) for x in model.nodes[node].cp_ref.origin)
            for mine, other in zip(position, theirs):
                self.assertLessEqual(abs(mine - other), 1e-12 * (scale + origin),
                                     f"{what}: node {node} of {deck}")

    def check_cells(self, deck, ours, model):
        found = {cell[1]: cell for cell in ours["cells"]}
        self.assertEqual(sorted(found), sorted(model.elements), deck)
        for element in model.elements.values():
            name, _, prop, nodes = found[element.eid]
            theirs = [node for node in element.node_ids if node]
            corners, most, names = CARDS[element.type]
            self.assertEqual(prop, element.pid, deck)
            if len(theirs) not in names:
                self.assertEqual(name, f"{element.type} with {len(theirs)} of {most} nodes", deck)
                self.assertEqual(nodes, theirs, deck)
                continue
            self.assertEqual(name, names[len(theirs)], deck)
            order = WEDGE if "wedge" in name else HEXAHEDRON if name == "hexahedron20" else range(30)
            self.assertEqual(nodes, [theirs[place] for place in order[:len(theirs)]], deck)

    def check_columns(self, deck, ours, model):
        """What was written is what was to be, up to the columns, of which a tab may take one."""
        for node, position in zip(ours["ids"], ours["moved"]):
            grid = model.nodes[node]
            size = max(1.0, *(abs(x) for x in position), *(abs(x) for x in grid.cp_ref.origin))
            rounding = 1e-11 * size if grid.cp else 0.0
            bounds = [bound(value, 7) for value in grid.xyz]
            if grid.cp_ref.type[-1] == "R":
                differences = grid.cp_ref.transform_node_to_local(position) - grid.xyz
            else:  # its angles are ill-conditioned near the axis
                differences = [math.dist(position, grid.get_position())]
                per_degree = abs(grid.xyz[0]) * math.pi / 180
                rest = bounds[2] * (per_degree if grid.cp_ref.type[-1] == "S" else 1)
                bounds = [bounds[0] + per_degree * bounds[1] + rest]
            for difference, most in zip(differences, bounds):
                self.assertLessEqual(abs(difference), 2 * most + rounding + 1e-15 * size,
                                     f"{grid} of {deck}: {position}")

    def check(self, deck, path, target, ours):
        self.assertNotIn("error", ours, path)
        model = read_by_peer(path)
        self.check_same(path, ours["positions"], ours, model, "read")
        self.check_cells(path, ours, model)
        after = read_by_peer(target)
        self.check_same(target, ours["again"], ours, after, "written")
        self.check_columns(target, ours, after)
        self.check_cells(target, ours, after)
        text = target.read_bytes().decode("latin-1")
        self.assertTrue(re.fullmatch(deck.pattern(), text), f"other bytes changed in {target}")

    def test_are_read_and_written_as_pynastran_reads_them(self):
        for first in range(0, DECKS, BATCH):
            with tempfile.TemporaryDirectory() as folder:
                decks = []
                for seed in range(first, min(first + BATCH, DECKS)):
                    deck = Deck(random.Random(seed))
                    path = Path(folder) / f"{seed}.bdf"
                    path.write_bytes(deck.text().encode("latin-1"))
                    decks.append((deck, path, Path(folder) / f"{seed}_moved.bdf"))
                lines = "".join(f"{path}\t{target}\n" for _, path, target in decks)
                output = subprocess.run([os.environ["MESHSMOOTH_NASTRAN_DECKS_PROGRAM"]],
                                        input=lines, capture_output=True, text=True, check=True)
                results = output.stdout.splitlines()
                self.assertEqual(len(results), len(decks))
                for (deck, path, target), result in zip(decks, results):
                    try:
                        self.check(deck, path, target, json.loads(result))
                    except Exception:
                        print(f"--- deck {path.name}\n{deck.text()}")
                        if target.exists():
                            print(f"--- written\n{target.read_text('latin-1')}")
                        raise
        print(f"{DECKS} decks")


if __name__ == "__main__":
    main()
