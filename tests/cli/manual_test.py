"""Manual pages and completion scripts: each names every command and flag that `--help` has, and
bash completes what it should; other shells and readers of manuals are in shells_test.py."""

import os
import re
import shutil
import subprocess
import unittest
from pathlib import Path

from programs import CLI, DONE, SERVER, USAGE, CliTest, main, vtk_text

FLAG = re.compile(r"(?<![\w-])(--[a-z][a-z-]*)")
FIXED = ["fixed", "free", "slide"]

SETS = vtk_text([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 1, 2, 3)]) + """\
POINT_DATA 4
SCALARS inlet int 1
LOOKUP_TABLE default
0 1 1 0
SCALARS in_between int 1
LOOKUP_TABLE default
1 1 0 0
SCALARS wall int 1
LOOKUP_TABLE default
1 0 0 0
"""


def needs(program):
    found = shutil.which(program)
    return unittest.skipUnless(found, f"{program} is not installed (apt-get install {program})")


def help_of(*command):
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=True).stdout


def commands_below(*command):
    """The names under "Subcommands:" of a help."""
    _, _, listed = help_of(*command, "--help").partition("Subcommands:\n")
    return re.findall(r"^  ([a-z][\w-]*)", listed, re.MULTILINE)


def all_commands(*command):
    """Every command with its flags, as words after the program's name."""
    yield command[1:], set(FLAG.findall(flag_lines(help_of(*command, "--help"))))
    for name in commands_below(*command):
        yield from all_commands(*command, name)


def flag_lines(text):
    """The flags that a help describes, not those that it mentions."""
    return "\n".join(line.split("  ")[1] for line in text.splitlines()
                     if re.match(r"  -", line))


class ManualTest(CliTest):
    def setUp(self):
        super().setUp()
        self.manual = self.folder / "manual"
        self.run_cli("write-manual", self.manual)
        (self.folder / "mesh.vtk").write_text(SETS)
        (self.folder / "mesh.VTU").write_text("")
        (self.folder / "notes.txt").write_text("")
        (self.folder / "my mesh.ply").write_text("")
        (self.folder / "parts").mkdir()

    def pages(self):
        pages = sorted(self.manual.glob("man*/*"))
        self.assertGreater(len(pages), 10)
        return pages


class Pages(ManualTest):
    def test_writing_again_gives_the_same_bytes(self):
        environment = {**os.environ, "SOURCE_DATE_EPOCH": "1700000000"}
        texts = []
        for folder in ("first", "second"):
            subprocess.run([CLI, "write-manual", self.path(folder)], check=True, timeout=60,
                           env=environment)
            texts.append({str(file.relative_to(self.path(folder))): file.read_bytes()
                          for file in sorted(Path(self.path(folder)).rglob("*.*"))})
        self.assertEqual(*texts)
        self.assertIn(b'"2023-11-14"', texts[0]["man1/meshsmooth.1"])

    def test_every_command_and_flag_is_in_a_page(self):
        count = 0
        for words, flags in [*all_commands(CLI)]:
            name = "-".join(["meshsmooth", *words[:1]])  # shapes are in the page of generate
            text = (self.manual / "man1" / f"{name}.1").read_text().replace("\\-", "-")
            for flag in flags:
                count += 1
                self.assertIn(f"\\fB{flag}\\fR", text, words)
            if words[1:]:
                self.assertIn(f".SS {words[1]}\n", text)
            for section in ("NAME", "SYNOPSIS", "DESCRIPTION", "OPTIONS", "EXIT STATUS"):
                self.assertIn(f".SH {section}\n", text)
        self.assertGreater(count, 150)

        text = (self.manual / "man8/meshsmooth-server.8").read_text().replace("\\-", "-")
        flags = set(FLAG.findall(flag_lines(help_of(SERVER, "--help"))))
        self.assertGreater(len(flags), 40)
        self.assertEqual({flag for flag in flags if f"\\fB{flag}\\fR" not in text}, set())
        for section in ("ENVIRONMENT", "FILES", "EXAMPLES", "EXIT STATUS"):
            self.assertIn(f".SH {section}\n", text)

    def test_examples_have_flags_that_there_are(self):
        seen = 0
        for page in self.pages():
            for block in re.findall(r"\.EX\n(.*?)\.EE", page.read_text(), re.DOTALL):
                for line in block.replace("\\-", "-").splitlines():
                    words = line.split()
                    if words[0] == "source":
                        continue
                    command = [CLI, words[1]] if words[0] == "meshsmooth" else [SERVER]
                    if words[1:2] == ["generate"]:
                        command.append(words[2])
                    known = help_of(*command, "--help")
                    for flag in FLAG.findall(line):
                        seen += 1
                        self.assertIn(flag, known, line)
        self.assertGreater(seen, 8)


class Sets(ManualTest):
    def test_sets_are_listed_one_a_line(self):
        listed = self.run_cli("list-sets", self.path("mesh.vtk")).stdout
        self.assertEqual(listed.splitlines(), ["inlet", "in_between", "wall"])

    def test_a_missing_file_is_an_error(self):
        self.assertIn("there is no such file",
                      subprocess.run([CLI, "list-sets", self.path("none.vtk")],
                                     capture_output=True, text=True, timeout=60).stderr)

    def test_an_unknown_shell_is_refused_with_the_known_ones(self):
        self.assertIn("fish", self.error_of("completion", "tcsh", exit_code=USAGE))


class Shell(ManualTest):
    """What every shell must complete; `complete` of each gives the candidates of a line."""

    def complete(self, line):
        raise unittest.SkipTest("of no shell")

    def check(self, line, *expected):
        self.assertEqual(sorted(self.complete(line)), sorted(expected), line)

    def check_all(self):
        shapes = commands_below(CLI, "generate")
        self.assertLessEqual({"smooth", "move", "completion"}, set(self.complete("meshsmooth ")))
        self.assertNotIn("list-sets", self.complete("meshsmooth "))
        self.check("meshsmooth smo", "smooth")
        self.assertEqual(set(shapes), set(self.complete("meshsmooth generate ")) - {"--help", "-h"})
        self.check("meshsmooth smooth --fixed-n", "--fixed-nodes")
        self.check("meshsmooth smooth --boundary ", *FIXED)
        self.check("meshsmooth smooth --boundary f", *FIXED[:2])
        self.check("meshsmooth smooth --backend cu", "cuda")
        self.check("meshsmooth generate hub --deg", "--degrees")
        self.check("meshsmooth smooth --fixed-types wedge,he", "wedge,hexahedron",
                   "wedge,hexahedron20", "wedge,hexahedron27")
        self.check("meshsmooth smooth mesh", "mesh.VTU", "mesh.vtk")
        self.check("meshsmooth smooth --report no", "notes.txt")
        self.check("meshsmooth smooth mesh.vtk -o better.vtk --fixed-set in", "in_between", "inlet")
        self.check("meshsmooth smooth --quiet mesh.vtk --fixed-set w", "wall")
        self.check("meshsmooth move mesh.vtk --prescribed-set w", "wall")
        self.check("meshsmooth smooth --fixed-set w")

    def path_with_program(self):
        return {**os.environ, "PATH": f"{Path(CLI).parent}:{os.environ['PATH']}",
                "HOME": str(self.folder), "LC_ALL": "C.UTF-8", "TERM": "dumb"}


@needs("bash")
class Bash(Shell):
    def complete(self, line, program="meshsmooth"):
        words = re.findall(r"=|(?:\\.|[^ =])+", line)
        if line.endswith((" ", "=")):
            words.append("")
        script = (f'source "{self.manual}/bash/{program}"; COMP_WORDS=("$@"); COMP_CWORD=$(($#-1)); '
                  f'_{program.replace("-", "_")}; [[ ${{#COMPREPLY[@]}} == 0 ]] || '
                  "printf '%s\\n' \"${COMPREPLY[@]}\"")
        done = subprocess.run(["bash", "--norc", "-u", "-c", script, "bash", *words], timeout=60,
                              cwd=self.folder, env=self.path_with_program(), capture_output=True,
                              text=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""), line)
        return done.stdout.splitlines()

    def test_it_completes(self):
        self.check_all()
        self.check("meshsmooth smooth --boundary=s", "slide")
        self.check("meshsmooth smooth --boundary=", *FIXED)
        self.check("meshsmooth smooth pa", "parts")
        self.check("meshsmooth quality no")  # zsh falls back to all files
        self.check("meshsmooth smooth my", "my mesh.ply")  # which readline quotes

    def test_every_command_and_flag_is_completed(self):
        count = 0
        for words, flags in all_commands(CLI):
            found = self.complete(" ".join(["meshsmooth", *words, "--"]))
            count += len(flags)
            self.assertEqual(set(found), flags, words)
            below = set(commands_below(CLI, *words))
            if below:
                self.assertEqual(set(self.complete(" ".join(["meshsmooth", *words, ""]))), below)
        self.assertGreater(count, 150)
        flags = set(FLAG.findall(flag_lines(help_of(SERVER, "--help"))))
        self.assertEqual(set(self.complete("meshsmooth-server --", "meshsmooth-server")), flags)

    def test_the_command_prints_the_same_script(self):
        printed = self.run_cli("completion", "bash", exit_code=DONE).stdout
        self.assertEqual(printed, (self.manual / "bash/meshsmooth").read_text())

    @needs("shellcheck")
    def test_shellcheck_takes_it(self):
        for script in (self.manual / "bash").iterdir():
            done = subprocess.run(["shellcheck", "--shell", "bash", "--severity", "warning",
                                   "--exclude", "SC2034", script], capture_output=True, text=True,
                                  timeout=120)
            self.assertEqual((done.returncode, done.stdout), (0, ""))


if __name__ == "__main__":
    main()
