"""docker/set-created makes one image of what two builds differ in, the times, and of nothing else.
Needs no container engine."""

import hashlib
import io
import json
import subprocess
import tarfile
import unittest
from pathlib import Path

from test_main import main

PROGRAM = Path(__file__).parents[2] / "docker/set-created"


def archive_of(files):
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w") as archive:
        for name, content in files.items():
            entry = tarfile.TarInfo(name)
            if isinstance(content, str):
                entry.type, entry.linkname = tarfile.SYMTYPE, content
                archive.addfile(entry)
            else:
                entry.size = len(content)
                archive.addfile(entry, io.BytesIO(content))
    return stream.getvalue()


def saved(built, layer=b"the files", label="x"):
    """What `docker save` writes of an image that was built at a time."""
    config = json.dumps({
        "created": built, "config": {"Labels": {"a": label}},
        "history": [{"created": built, "created_by": "LABEL", "empty_layer": True},
                    {"created": built, "created_by": "COPY"},
                    {"created": built, "created_by": "COPY"}],
        "rootfs": {"type": "layers", "diff_ids": [hashlib.sha256(layer).hexdigest()] * 2}}).encode()
    name = hashlib.sha256(config).hexdigest() + ".json"
    return archive_of({
        "1/VERSION": b"1.0", "1/json": json.dumps({"created": built}).encode(),
        "1/layer.tar": layer, "2/layer.tar": "../1/layer.tar", name: config, "repositories": b"{}",
        "manifest.json": json.dumps([{"Config": name, "RepoTags": ["meshsmooth:1"],
                                      "Layers": ["1/layer.tar", "2/layer.tar"]}]).encode()})


def rewritten(archive, seconds="1700000000"):
    return subprocess.run([PROGRAM, seconds], input=archive, check=True, timeout=60,
                          stdout=subprocess.PIPE).stdout


class SetCreated(unittest.TestCase):
    def test_two_builds_become_one_image(self):
        first = rewritten(saved("2026-11-25T01:46:47.979486503Z"))
        self.assertEqual(first, rewritten(saved("2026-11-25T02:03:00.1Z")))
        self.assertEqual(first, rewritten(first))
        self.assertNotEqual(first, rewritten(saved("2026-11-25T01:46:47Z", layer=b"others")))
        self.assertNotEqual(first, rewritten(saved("2026-11-25T01:46:47Z", label="y")))

    def test_changes_times_alone(self):
        with tarfile.open(fileobj=io.BytesIO(rewritten(saved("2026-11-25T01:46:47Z")))) as archive:
            [image] = json.load(archive.extractfile("manifest.json"))
            config = archive.extractfile(image["Config"]).read()
            layers = [archive.extractfile(layer).read() for layer in image["Layers"]]
        self.assertEqual(image["Config"], hashlib.sha256(config).hexdigest() + ".json")
        self.assertEqual(image["RepoTags"], ["meshsmooth:1"])
        self.assertEqual(layers, [b"the files"] * 2)
        config = json.loads(config)
        times = {config.pop("created"), *(entry.pop("created") for entry in config["history"])}
        self.assertEqual(times, {"2023-11-14T22:13:20Z"})
        self.assertEqual([entry["created_by"] for entry in config["history"]],
                         ["LABEL", "COPY", "COPY"])
        self.assertEqual(config["config"], {"Labels": {"a": "x"}})

    def test_needs_seconds(self):
        for arguments in ([], ["yesterday"]):
            result = subprocess.run([PROGRAM, *arguments], input=b"", capture_output=True,
                                    timeout=60)
            self.assertEqual(result.returncode, 1)
            self.assertIn(b"SOURCE_DATE_EPOCH", result.stderr)


if __name__ == "__main__":
    main()
