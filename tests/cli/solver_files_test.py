"""Decks and SU2 meshes, smoothed from the command line."""

from pathlib import Path

from programs import USAGE, main
from solver_files import SolverFilesTest, deck, su2


class SolverFiles(SolverFilesTest):
    def test_a_deck_changes_in_its_coordinates_alone(self):
        self.check_text("bar.inp", deck())

    def test_an_su2_mesh_changes_in_its_coordinates_alone(self):
        self.check_text("bar.su2", su2())

    def test_sets_and_markers_fix_their_nodes(self):
        for name, text in (("bar.inp", deck()), ("bar.su2", su2())):
            path, output = Path(self.path(name)), Path(self.path("out-" + name))
            path.write_text(text)
            self.run_cli("smooth", path, "-o", output, "--boundary", "free", "--iterations", "3",
                         "--fixed-set", "low_z")
            for line, _ in self.changed(text, output.read_text()):
                self.assertNotRegex(line, r"[ ,] ?0(\.0)?( \d+)?$", "a node of z = 0")
            self.assertIn("low_z", self.error_of("smooth", path, "-o", output, "--fixed-set",
                                                 "nothing", exit_code=USAGE))

    def test_a_deck_becomes_a_vtu_and_a_reference_of_a_motion(self):
        path = Path(self.path("bar.inp"))
        path.write_text(deck())
        self.run_cli("quality", path, "-o", self.path("bar.vtu"))
        self.assertAlmostEqual(self.quality(self.path("bar.vtu")), self.quality(path))
        self.smooth(path, self.path("smooth.inp"))
        self.run_cli("move", self.path("smooth.inp"), "--to", path, "-o", self.path("moved.inp"))


if __name__ == "__main__":
    main()
