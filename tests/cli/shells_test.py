"""Manual pages and completion scripts in the programs that read them: groff, mandoc, fish and zsh."""

import os
import pty
import re
import select
import subprocess
import time

from manual_test import ManualTest, Shell, needs
from test_main import main, needs_peers


@needs_peers
class Lint(ManualTest):
    @needs("groff")
    def test_groff_takes_them_without_a_warning(self):
        for page in self.pages():
            done = subprocess.run(["groff", "-man", "-ww", "-z", "-Kutf8", page],
                                  capture_output=True, text=True, timeout=60)
            self.assertEqual((done.returncode, done.stderr), (0, ""), page.name)

    @needs("mandoc")
    def test_mandoc_takes_them_without_a_warning(self):
        for page in self.pages():
            done = subprocess.run(["mandoc", "-T", "lint", "-W", "warning", page],
                                  capture_output=True, text=True, timeout=60)
            self.assertEqual((done.returncode, done.stdout), (0, ""), page.name)


@needs_peers
@needs("fish")
class Fish(Shell):
    def complete(self, line):
        script = f"source {self.manual}/fish/meshsmooth.fish; complete -C '{line}'"
        done = subprocess.run(["fish", "--no-config", "-c", script], timeout=60, text=True,
                              cwd=self.folder, env=self.path_with_program(), capture_output=True)
        self.assertEqual(done.stderr, "", line)
        return [candidate.split("\t")[0] for candidate in done.stdout.splitlines()]

    def test_it_completes(self):
        self.check_all()


@needs_peers
@needs("zsh")
class Zsh(Shell):
    """zsh completes only in its line editor: an interactive one behind a pseudo-terminal, whose
    compadd prints what it is given."""

    START = r"""
PROMPT= RPROMPT= zle_bracketed_paste=(); unsetopt zle_prompt_sp 2>/dev/null
autoload -Uz compinit && compinit -D -u
zstyle ':completion:*' insert-tab false
source @script@
compadd() {
  if [[ ${@[1,(i)(-|--)]} == *-(O|A|D)\ * ]]; then builtin compadd "$@"; return; fi
  local -a hits; builtin compadd -A hits "$@"
  local suffix= i=${@[(i)-S]}; local prefix=$IPREFIX
  for hit in $hits; do print -r -- "<hit>$prefix$hit</hit>"; done
  builtin compadd "$@"
}
finish() { print '<end>'; compstate[insert]= compstate[list]=; comppostfuncs=(finish) }
comppostfuncs=(finish)
bindkey '^I' complete-word
print '<rea''dy>'
"""

    def read_until(self, terminal, mark):
        text, deadline = "", time.monotonic() + 60
        while mark not in text:
            ready, _, _ = select.select([terminal], [], [], max(0.0, deadline - time.monotonic()))
            self.assertTrue(ready, f"no {mark} in {text!r}")
            text += os.read(terminal, 65536).decode(errors="replace")
        return text

    def complete(self, line):
        start = self.folder / "start.zsh"
        start.write_text(self.START.replace("@script@", f"{self.manual}/zsh/_meshsmooth"))
        child, terminal = pty.fork()
        if child == 0:
            os.chdir(self.folder)
            os.execvpe("zsh", ["zsh", "-f", "-i"], self.path_with_program())
        try:
            os.write(terminal, f"source {start}\n".encode())
            self.read_until(terminal, "<ready>")
            os.write(terminal, line.encode() + b"\t")
            text = self.read_until(terminal, "<end>")
        finally:
            os.kill(child, 9)
            os.waitpid(child, 0)
            os.close(terminal)
        hits = re.findall(r"<hit>(.*?)</hit>", text)
        return sorted({hit.removesuffix("=") for hit in hits})

    def test_it_completes(self):
        self.check_all()


if __name__ == "__main__":
    main()
