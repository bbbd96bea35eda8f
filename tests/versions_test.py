#!/usr/bin/env python3
"""One version everywhere: that of CMakeLists.txt.

    tests/versions_test.py                 fails with each place that has another one
    tests/versions_test.py --notes         prints the changelog of this version, or what is
                                           unreleased
    tests/versions_test.py --released      also fails where the changelog has no such version
"""

import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
NUMBER = r"[0-9]+\.[0-9]+\.[0-9]+"
# Files and what stands before a version in them, with the least number of places.
PLACES = [
    ("CITATION.cff", r"^version: ", 1),
    ("deploy/kubernetes/overlays/*/kustomization.yaml", r"newTag: ", 2),
    ("client/python/pyproject.toml", r"meshsmooth-server==", 1),
    ("docker/compose.yaml", r"meshsmooth-server:", 1),
    # Not in tables, which have what was measured of a version.
    ("docs/*.md", r"^(?!\|).*?\bmeshsmooth(?:-server)?:", 3),
]
# Files that take it from CMakeLists.txt: what they must hold.
TAKEN = [
    ("client/python/pyproject.toml", 'path = "../../CMakeLists.txt"'),
    ("client/python/server/pyproject.toml", 'variable = "MESHSMOOTH_VERSION"'),
    ("cmake/packages.cmake", "@PROJECT_VERSION@"),
]


def project_version():
    text = (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
    return re.search(rf"^project\(meshsmooth VERSION ({NUMBER})", text, re.MULTILINE)[1]


def wrong_places(version):
    for pattern, before, least in PLACES:
        count = 0
        for file in sorted(ROOT.glob(pattern)):
            for match in re.finditer(rf"{before}({NUMBER})", file.read_text(encoding="utf-8"),
                                     re.MULTILINE):
                count += 1
                if match[1] != version:
                    yield f"{file.relative_to(ROOT)}: {match[0]}, but CMakeLists.txt has {version}"
        if count < least:
            yield f"{pattern}: {count} versions found, at least {least} expected"
    for name, text in TAKEN:
        if text not in (ROOT / name).read_text(encoding="utf-8"):
            yield f"{name}: takes its version from elsewhere ({text!r} is missing)"


def changelog_sections():
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    parts = re.split(r"^## \[(.*?)\].*\n", text, flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def main():
    version = project_version()
    sections = changelog_sections()
    notes = sections.get(version, "" if "--released" in sys.argv else sections.get("Unreleased", ""))
    problems = list(wrong_places(version))
    if not notes.strip():
        problems.append(f"CHANGELOG.md: nothing about version {version}")
    if problems:
        sys.exit("\n".join(problems))
    print(f"# meshsmooth {version}\n\n{notes.strip()}" if "--notes" in sys.argv else version)


if __name__ == "__main__":
    main()
