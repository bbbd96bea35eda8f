"""A server of its own: it serves, it ends with its owner, and its failures say why."""

import os
import re
import signal
import stat
import subprocess
import sys
import threading
import types
from pathlib import Path

import pytest
from local_server import (
    children_of,
    eventually,
    install_fake_engine,
    is_running,
    program,
    server_info,
    write_program,
)

from meshsmooth import _local
from meshsmooth._errors import Unavailable
from meshsmooth._local import LocalServer, default_server

# Starts a server, reports it, and lives until it is killed or its input ends.
OWNER = """
import sys
from meshsmooth._local import LocalServer
server = LocalServer(container=sys.argv[1] if len(sys.argv) > 1 else None)
print(server.address, flush=True)
sys.stdin.read()
"""

# Workers forked without exec; each reports the server that it uses once it has called it.
WORKERS = """
import multiprocessing, sys
from meshsmooth._local import default_server

def work(_):
    from local_server import server_info
    address = default_server().address
    assert server_info(address)
    barrier.wait()
    return address

if sys.argv[1] == "started":
    print(default_server().address)
context = multiprocessing.get_context("fork")
barrier = context.Barrier(4)
with context.Pool(4) as pool:
    print(*pool.map(work, range(4), chunksize=1), sep="\\n")
"""


def socket_of(address):
    assert address.startswith("unix:")
    return Path(address.removeprefix("unix:"))


_earlier: set[int] = set()  # processes of other test files in the same run


@pytest.fixture(autouse=True)
def _know_earlier_children():
    _earlier.clear()
    _earlier.update(children_of(os.getpid()))


def own_children():
    return [child for child in children_of(os.getpid()) if child not in _earlier]


@pytest.fixture
def server():
    with LocalServer() as server:
        yield server


@pytest.fixture
def owner():
    """Another process with a server; and the paths and processes of that."""
    with run_script(OWNER) as process:
        address = process.stdout.readline().strip()
        yield process, socket_of(address), children_of(process.pid)
        process.kill()


def run_script(text, *arguments, **environment):
    paths = [*map(str, Path(__file__).parents[:1]), *sys.path]
    return subprocess.Popen(
        [sys.executable, "-c", text, *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths), **environment},
    )


def test_it_serves_on_a_private_socket(server):
    path = socket_of(server.address)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
    assert server_info(server.address)


def test_nothing_is_left_when_it_is_closed():
    with LocalServer() as server:
        path = socket_of(server.address)
        children = own_children()
        assert children
    assert not any(is_running(child) for child in children)
    assert not path.parent.exists()
    with pytest.raises(ValueError, match="closed"):
        _ = server.address
    server.close()


def test_nothing_is_left_when_it_is_deleted():
    server = LocalServer()
    path = socket_of(server.address)
    del server
    assert eventually(lambda: not path.parent.exists())


@pytest.mark.parametrize("how", ["exit", "kill"])
def test_nothing_is_left_when_its_owner_ends(owner, how):
    process, path, children = owner
    assert path.is_socket()
    assert children
    if how == "exit":
        process.stdin.close()
    else:
        process.kill()
    assert eventually(lambda: not any(is_running(child) for child in children))
    assert eventually(lambda: not path.parent.exists())


def test_a_terminals_interrupt_does_not_reach_it(owner):
    process, _, children = owner
    assert [os.getsid(child) for child in children] != [os.getsid(process.pid)]


def test_it_starts_when_it_is_needed(monkeypatch):
    monkeypatch.setenv("MESHSMOOTH_SERVER_BINARY", "/nowhere")
    server = LocalServer()
    assert server.failure() is None
    server.close()


def test_threads_share_the_default_server():
    addresses = []
    threads = [
        threading.Thread(target=lambda: addresses.append(default_server().address))
        for _ in range(8)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(addresses) == 8
    assert len(set(addresses)) == 1


def test_a_default_server_that_ended_is_replaced():
    first = default_server()
    kill_server_of(first)
    assert first.failure(wait=60)
    second = default_server()
    assert server_info(second.address)
    second.close()
    assert default_server() is not second


@pytest.mark.parametrize("parent", ["started", "not started"])
def test_four_forked_workers_at_once(parent):
    output, _ = run_script(WORKERS, parent).communicate(timeout=120)
    addresses = output.split()
    if parent == "started":
        assert len(addresses) == 5
        assert len(set(addresses)) == 1
    else:
        assert len(set(addresses)) == 4
    assert eventually(lambda: not any(socket_of(a).parent.exists() for a in addresses))


@pytest.mark.filterwarnings("ignore:.*multi-threaded:DeprecationWarning")  # Python 3.12's, of fork
def test_a_forked_process_outlives_its_parents_server():
    server = LocalServer()
    address = server.address
    reports_end, child_end = os.pipe()
    goes_on, go_on = os.pipe()
    pid = os.fork()
    if pid == 0:
        os.close(go_on)
        os.write(child_end, b"same\n" if server.address == address else b"other\n")
        os.read(goes_on, 1)
        os.write(child_end, server.address.encode() + b"\n")
        server.close()
        os._exit(0)
    os.close(child_end)
    with os.fdopen(reports_end) as reports:
        assert reports.readline() == "same\n"
        server.close()
        assert not socket_of(address).exists()
        os.close(go_on)
        other = reports.readline().strip()
        assert other not in ("", address)
        os.waitpid(pid, 0)
    assert eventually(lambda: not socket_of(other).parent.exists())


def test_a_server_that_dies_reports_its_end(server):
    path = socket_of(server.address)
    assert server.failure() is None
    kill_server_of(server)
    assert server.failure(wait=60)
    with pytest.raises(Unavailable, match="was ended by SIGKILL"):
        _ = server.address
    assert not path.parent.exists()


def test_a_server_that_cannot_start_reports_its_last_lines():
    with pytest.raises(Unavailable) as error, LocalServer(settings={"lanes": "many"}) as server:
        _ = server.address
    for part in (program(), "exit code 2", '"many"', "flag --lanes"):
        assert part in str(error.value)


def test_a_server_that_dies_later_reports_its_last_lines(tmp_path, monkeypatch):
    text = """
import sys
print("a info event=start port=1 listen=unix:/nowhere/socket insecure=false", file=sys.stderr)
for i in range(100):
    print(f"line {i}", file=sys.stderr)
sys.exit(69)
"""
    monkeypatch.setenv("MESHSMOOTH_SERVER_BINARY", write_program(tmp_path / "server", text))
    error = end_of(LocalServer())
    assert "exit code 69" in error
    assert "line 98 | line 99" in error
    assert "line 50" not in error


def test_a_server_that_does_not_serve_is_ended(tmp_path, monkeypatch):
    path = write_program(tmp_path / "server", "import sys\nsys.stdin.read()\n")
    monkeypatch.setenv("MESHSMOOTH_SERVER_BINARY", path)
    with pytest.raises(Unavailable, match=r"did not serve within 0\.01 s"):
        _ = LocalServer(start_timeout=0.01).address
    assert not own_children()


def test_settings_reach_the_server_and_foreign_ones_do_not(monkeypatch):
    for name in ("LISTEN", "TLS_CERT", "TOKEN_FILE", "CONFIG", "LOG_LEVEL"):
        monkeypatch.setenv(f"MESHSMOOTH_{name}", "/nowhere")
    with LocalServer(settings={"max_node_count": 4321, "warm-up": True}) as server:
        assert server_info(server.address)
        command = Path(f"/proc/{only_child()}/cmdline").read_text().split("\0")
    assert "--max-node-count=4321" in command
    assert "--warm-up=true" in command


def test_settings_of_its_own_are_refused():
    with pytest.raises(ValueError, match="listen"):
        LocalServer(settings={"listen": "0.0.0.0:1"})
    with pytest.raises(ValueError, match="container"):
        LocalServer(engine="podman")


def test_a_missing_program_is_named(monkeypatch, tmp_path):
    monkeypatch.setenv("MESHSMOOTH_SERVER_BINARY", str(tmp_path / "gone"))
    with pytest.raises(Unavailable, match="gone") as error:
        _ = LocalServer().address
    assert "$MESHSMOOTH_SERVER_BINARY" in str(error.value)


def test_no_program_anywhere_says_what_to_do(monkeypatch, tmp_path):
    monkeypatch.delenv("MESHSMOOTH_SERVER_BINARY")
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setitem(sys.modules, "meshsmooth_server", None)
    with pytest.raises(Unavailable) as error:
        _ = LocalServer().address
    assert isinstance(error.value, ConnectionError)
    for part in (
        "pip install",
        "$MESHSMOOTH_SERVER_BINARY",
        "PATH",
        "$MESHSMOOTH_SERVER ",
        "container=",
    ):
        assert part in str(error.value)

    package = types.SimpleNamespace(path=lambda: str(tmp_path / "bin" / "meshsmooth-server"))
    monkeypatch.setitem(sys.modules, "meshsmooth_server", package)
    with pytest.raises(Unavailable, match="lacks its program"):
        _ = LocalServer().address


@pytest.mark.parametrize("where", ["package", "PATH"])
def test_the_program_is_found(monkeypatch, tmp_path, where):
    (tmp_path / "meshsmooth-server").symlink_to(os.path.abspath(program()))
    monkeypatch.delenv("MESHSMOOTH_SERVER_BINARY")
    package = None
    if where == "package":
        package = types.SimpleNamespace(path=lambda: str(tmp_path / "meshsmooth-server"))
    else:
        monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setitem(sys.modules, "meshsmooth_server", package)
    with LocalServer() as server:
        assert server_info(server.address)


@pytest.mark.parametrize("engine", [None, "podman"])
def test_a_container_serves_and_is_removed(monkeypatch, tmp_path, engine):
    install_fake_engine(tmp_path / "bin", engine or "docker")
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    with LocalServer(
        container="meshsmooth-server:test", engine=engine, engine_options=("--gpus", "all")
    ) as server:
        assert re.fullmatch(r"127\.0\.0\.1:\d+", server.address)
        assert server_info(server.address)
    calls = (tmp_path / "bin" / "calls").read_text().splitlines()
    assert [call.split()[0] for call in calls] == ["run", "port", "rm"]
    assert "--publish 127.0.0.1::50051 --gpus all meshsmooth-server:test" in calls[0]
    assert sorted(os.listdir(tmp_path / "bin")) == ["calls", engine or "docker"]


def test_a_container_that_dies_reports_its_last_lines(monkeypatch, tmp_path):
    install_fake_engine(tmp_path / "bin", "docker")
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    server = LocalServer(container="meshsmooth-server:test", settings={"lanes": "many"})
    with pytest.raises(Unavailable, match="flag --lanes"):
        _ = server.address
    calls = (tmp_path / "bin" / "calls").read_text().splitlines()
    assert calls[-1].startswith("rm --force meshsmooth-")


def test_a_container_ends_with_its_owner(tmp_path):
    install_fake_engine(tmp_path / "bin", "docker")
    path = str(tmp_path / "bin")
    with run_script(OWNER, "meshsmooth-server:test", PATH=path) as process:
        assert process.stdout.readline().startswith("127.0.0.1:")
        engines = children_of(process.pid)
        servers = [child for engine in engines for child in children_of(engine)]
        assert servers
        process.kill()
    assert eventually(lambda: not any(is_running(pid) for pid in engines + servers))


def test_no_engine_says_what_to_do(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(Unavailable, match="docker or podman"):
        _ = LocalServer(container="meshsmooth-server:test").address


def end_of(server):
    """What a server that ends by itself reports, at its start or after it."""
    try:
        _ = server.address
    except Unavailable as error:
        return str(error)
    return server.failure(wait=60)


def only_child():
    (child,) = own_children()
    return child


def kill_server_of(server):
    _ = server.address
    os.kill(only_child(), signal.SIGKILL)


@pytest.fixture(autouse=True)
def _no_default_server():
    yield
    if _local._default is not None:
        _local._default.close()
