"""Chooses the files that are stored in tests/corpus/files.

    store.py CACHE FOLDER

Small files of sources whose licences allow it without conditions beyond the notice: of each format
and source in turn, those whose hash comes first.
"""

import collections
import json
import pathlib
import shutil
import sys

import gather

PERMISSIVE = {"meshio", "meshioplusplus", "sfepy", "pyvista", "nutils", "capytaine", "openmesh",
              "python-escript", "libpetsc3.18-dev-examples", "trilinos"}
MOST_BYTES, MOST_FILES, MOST_OF_ALL = 20_000, 130, 1_400_000
# Text in a file beside it that says who may use it otherwise.
FOREIGN = ("nonbsd", "non-bsd")


def size_of(path):
    return sum(file.stat().st_size for file in path.iterdir()) if path.is_dir() else path.stat().st_size


def names_other_files(path):
    """Whether the file is nothing without others."""
    text = path.read_bytes().upper() if path.is_file() else b""
    return b"INPUT=" in text or b"\nINCLUDE" in text or b".H5:" in text


def main():
    cache, folder = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    queues = collections.defaultdict(list)
    for row in json.loads((cache / "files.json").read_text()):
        path = cache / row["file"]
        if (row["source"] not in PERMISSIVE or path.is_dir() or size_of(path) > MOST_BYTES
                or names_other_files(path) or any(word in row["file"].lower() for word in FOREIGN)):
            continue
        queues[row["format"], row["source"]].append((row["sha256"], path, row["source"]))
    for queue in queues.values():
        queue.sort()
    for source in PERMISSIVE:
        shutil.rmtree(folder / source, ignore_errors=True)
    chosen, total = 0, 0
    while chosen < MOST_FILES and any(queues.values()):
        for key in sorted(queues):
            if not queues[key] or chosen == MOST_FILES:
                continue
            digest, path, source = queues[key].pop(0)
            parts = [path] + ([path.with_suffix(".ele")] if path.suffix == ".node" else [])
            size = sum(part.stat().st_size for part in parts)
            if total + size > MOST_OF_ALL:
                continue
            for part in parts:
                into = folder / source / part.name
                if into.exists():
                    into = folder / source / f"{part.stem}-{digest[:6]}{part.suffix}"
                into.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(part, into)
            chosen += 1
            total += size
    print(f"{chosen} files, {total} bytes")


if __name__ == "__main__":
    gather.sys.dont_write_bytecode = True
    main()
