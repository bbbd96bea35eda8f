"""The committed messages are what Debian's protoc makes of `proto/`."""

import pathlib
import shutil
import subprocess

import pytest

PACKAGE = pathlib.Path(__file__).resolve().parents[1] / "src"
PROTO = pathlib.Path(__file__).resolve().parents[3] / "proto"
PROTOC_VERSION = "libprotoc 3.21"  # newer code does not load on the oldest protobuf allowed


def protoc() -> str:
    program = shutil.which("protoc")
    if program is None:
        pytest.skip("missing tool: protoc")
    version = subprocess.run([program, "--version"], capture_output=True, text=True, check=True)
    if not version.stdout.startswith(PROTOC_VERSION):
        pytest.skip(f"missing tool: {PROTOC_VERSION} (this one is {version.stdout.strip()})")
    return program


@pytest.mark.parametrize("name", ["mesh", "smoothing", "error_details"])
def test_generated_modules_are_current(name: str, tmp_path: pathlib.Path) -> None:
    command = [protoc(), f"-I{PROTO}", f"--python_out={tmp_path}", f"--pyi_out={tmp_path}"]
    subprocess.run([*command, f"meshsmooth/v1/{name}.proto"], check=True)
    for suffix in (".py", ".pyi"):
        path = f"meshsmooth/v1/{name}_pb2{suffix}"
        assert (PACKAGE / path).read_text() == (tmp_path / path).read_text(), path


def test_every_proto_has_its_module() -> None:
    protos = {path.stem for path in (PROTO / "meshsmooth" / "v1").glob("*.proto")}
    modules = (PACKAGE / "meshsmooth" / "v1").glob("*_pb2.py")
    assert {path.stem.removesuffix("_pb2") for path in modules} == protos
