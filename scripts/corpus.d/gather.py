"""Downloads the packages of sources.tsv, unpacks them and collects the mesh files in them."""

import bz2
import csv
import gzip
import hashlib
import lzma
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
MAX_BYTES = 14_000_000

# Extensions that the program reads, and what the file must begin with to be a mesh of that format.
HDF5 = b"\x89HDF\r\n\x1a\n"
ADF = b"\xc0\xa8\xa3\xa9"
NETCDF = (b"CDF\x01", b"CDF\x02", b"CDF\x05", HDF5)
EXTENSIONS = {
    "vtu": None, "vtk": (b"# vtk",), "vtp": None, "ply": (b"ply",), "stl": None, "obj": None,
    "msh": None, "mesh": None, "meshb": None, "unv": None, "bdf": None, "nas": None, "inp": None,
    "su2": None, "node": None, "med": (HDF5,), "cgns": (HDF5, ADF), "exo": NETCDF, "e": NETCDF,
    "g": NETCDF, "ex2": NETCDF, "xdmf": None,
}
# Never unpacked: code, documents, pictures, and results that are no meshes.
SKIPPED = set("""py pyc pyi pyx c cc cpp cxx h hh hpp hxx f f90 for cu cl java js ts css html htm png jpg
jpeg svg gif ico eps pdf ps tex bib md rst po pot ui qrc svgz ipynb cmake am ac m4 pl sh bat tcl so a o
lib dll exe whl ttf woff woff2 mp4 webm qch map tag dox i swg xsl ent edp idp""".split())
ARCHIVE = re.compile(r"\.(tar(\.(gz|bz2|xz))?|tgz|tbz2|txz|zip|egg)$", re.IGNORECASE)
COMPRESSED = {".gz": gzip.open, ".bz2": bz2.open, ".xz": lzma.open}


class Unavailable(Exception):
    """Why a source cannot be had here, in one line."""


def read_sources():
    with open(HERE / "sources.tsv", encoding="utf-8", newline="") as file:
        rows = (line for line in file if not line.startswith("#"))
        return list(csv.DictReader(rows, delimiter="\t"))


def run(command, **options):
    done = subprocess.run(command, capture_output=True, text=True, **options)
    if done.returncode != 0:
        last = (done.stderr or done.stdout).strip().splitlines()[-1:] or ["no message"]
        raise Unavailable(f"{' '.join(map(str, command[:3]))}: {last[0]}")
    return done.stdout


class Apt:
    """apt with the source packages of the configured Debian suites, in a state of its own, so that
    the machine's is left alone."""

    def __init__(self, folder):
        self.folder = folder
        self.options = None

    def download(self, name, into):
        run(["apt-get", "-q", "-o", "APT::Sandbox::User=root", "download", name], cwd=into)
        return sorted(into.glob(f"{name}_*.deb"))

    def download_source(self, name, into):
        """The newest version that the mirrors have: they forget those of the security suite."""
        options = self._source_options()
        listed = run(["apt-cache", *options, "showsrc", "--only-source", name])
        versions = re.findall(r"(?m)^Version: (\S+)", listed)
        for wanted in [name, *(f"{name}={version}" for version in versions)]:
            try:
                run(["apt-get", "-q", *options, "source", "--download-only", wanted], cwd=into)
                return sorted(path for path in into.iterdir() if ".orig" in path.name)
            except Unavailable as unavailable:
                reason = unavailable
        raise reason

    def _source_options(self):
        if self.options is not None:
            return self.options
        for part in ("lists/partial", "archives/partial"):
            (self.folder / part).mkdir(parents=True, exist_ok=True)
        rows = run(["apt-get", "indextargets", "--format", "$(SITE)|$(RELEASE)|$(COMPONENT)",
                    "Created-By: Packages"]).splitlines()
        key = pathlib.Path("/usr/share/keyrings/debian-archive-keyring.gpg")
        trust = f"[signed-by={key}] " if key.exists() else ""
        lines = sorted({"deb-src {}{} {} {}\n".format(trust, *row.split("|")) for row in rows
                        if "/debian" in row and row.endswith("|main")})
        if not lines:
            raise Unavailable("apt has no Debian suite configured")
        (self.folder / "sources.list").write_text("".join(lines))
        options = {"Dir::Etc::sourcelist": self.folder / "sources.list",
                   "Dir::Etc::sourceparts": "/dev/null",
                   "Dir::State::lists": self.folder / "lists",
                   "Dir::Cache::archives": self.folder / "archives",
                   "Dir::Cache::pkgcache": "", "Dir::Cache::srcpkgcache": "",
                   "APT::Sandbox::User": "root"}
        flat = [part for name, value in options.items() for part in ("-o", f"{name}={value}")]
        run(["apt-get", "-q", *flat, "update"])
        self.options = flat
        return flat


def pip_download(python, source, into):
    """Of PyPI, with the recorded SHA-256; a source distribution needs its build backend, which pip
    fetches itself."""
    wanted = into / "requirements.txt"
    wanted.write_text(f"{source['name']}=={source['version']} --hash=sha256:{source['sha256']}\n")
    kind = (["--no-binary", source["name"]] if source["kind"] == "pypi-sdist"
            else ["--only-binary", ":all:"])
    run([python, "-m", "pip", "download", "-q", "--disable-pip-version-check", "--no-deps", *kind,
         "--require-hashes", "-r", wanted, "-d", into], timeout=600)
    wanted.unlink()
    return sorted(into.iterdir())


def sha256_of(path):
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def is_wanted(name):
    suffix = pathlib.PurePosixPath(name).suffix.lstrip(".")
    return suffix.lower() not in SKIPPED


def safe_target(folder, name):
    """Where an archive's member goes; none outside of the folder."""
    parts = [part for part in pathlib.PurePosixPath(name).parts if part not in ("/", ".")]
    return None if not parts or ".." in parts else folder.joinpath(*parts)


def write_member(target, stream):
    target.parent.mkdir(parents=True, exist_ok=True)
    with open(target, "wb") as file:
        shutil.copyfileobj(stream, file)


def unpack_archive(path, folder):
    if zipfile.is_zipfile(path):
        with zipfile.ZipFile(path) as archive:
            for member in archive.infolist():
                target = safe_target(folder, member.filename)
                if member.is_dir() or target is None or not is_wanted(member.filename):
                    continue
                if member.file_size <= 4 * MAX_BYTES:
                    write_member(target, archive.open(member))
        return
    with tarfile.open(path) as archive:
        for member in archive:
            target = safe_target(folder, member.name)
            if not member.isfile() or target is None or not is_wanted(member.name):
                continue
            if member.size <= 4 * MAX_BYTES:
                write_member(target, archive.extractfile(member))


def unpack(path, folder):
    """A package and the archives in it, two deep."""
    folder.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".deb":
        run(["dpkg-deb", "-x", path, folder])
    else:
        unpack_archive(path, folder)
    for _ in range(2):
        for inner in sorted(folder.rglob("*")):
            if not inner.is_file() or inner.is_symlink():
                continue
            try:
                if ARCHIVE.search(inner.name):
                    unpack_archive(inner, inner.with_name(inner.name + ".d"))
                    inner.unlink()
                elif inner.suffix in COMPRESSED and is_wanted(inner.stem):
                    with COMPRESSED[inner.suffix](inner) as stream:
                        write_member(inner.with_suffix(""), stream)
                    inner.unlink()
            except (OSError, EOFError, tarfile.TarError, zipfile.BadZipFile, lzma.LZMAError) as error:
                print(f"corpus: {inner}: {error}", file=sys.stderr)
                inner.unlink(missing_ok=True)


def fetch(source, cache, apt, python):
    """The unpacked folder of a source, downloaded at most once."""
    folder = cache / "sources" / source["name"]
    if (folder / ".complete").exists():
        return folder
    shutil.rmtree(folder, ignore_errors=True)
    into = cache / "downloads" / source["name"]
    into.mkdir(parents=True, exist_ok=True)
    packages = [path for path in into.iterdir() if path.suffix != ".dsc"]
    if not packages or source["kind"].startswith("pypi"):
        if source["kind"] == "deb":
            packages = apt.download(source["name"], into)
        elif source["kind"] == "deb-src":
            packages = apt.download_source(source["name"], into)
        elif not packages or sha256_of(packages[0]) != source["sha256"]:
            packages = pip_download(python, source, into)
    for package in packages:
        if ".debian.tar" not in package.name and not package.name.endswith(".asc"):
            unpack(package, folder)
    (folder / ".complete").touch()
    return folder


def is_meant(extension, head, path):
    """Whether a file is what its extension says, as far as extensions are shared with what holds no
    mesh: compilers' objects, chemistry, MED files of fields alone."""
    pointer = b"version https://git-lfs"  # to a file that is elsewhere
    if head.startswith((pointer, b"#!")):
        return False
    if extension == "node":
        return not path.with_suffix(".ele").read_bytes().startswith(pointer)
    if extension == "obj":
        return b"\0" not in head
    if extension == "inp":
        text = path.read_bytes()
        return bool(re.search(rb"(?im)^[ >]*\*[ ]*(node|element|include|heading|part)", text)
                    or re.match(rb"(#.*\n)*\s*\d+ +\d+ +\d+ +\d+ +\d+\s*\n", text))  # UCD
    if extension == "med":
        return b"ENS_MAA" in path.read_bytes()
    return True


def is_mesh_file(path):
    extension = path.suffix.lower().lstrip(".")
    if extension not in EXTENSIONS or path.is_symlink() or not path.is_file():
        return False
    size = path.stat().st_size
    if size == 0 or size > MAX_BYTES:
        return False
    if extension == "node" and not path.with_suffix(".ele").exists():
        return False
    begins = EXTENSIONS[extension]
    with open(path, "rb") as file:
        head = file.read(512)
    return (begins is None or head.startswith(begins)) and is_meant(extension, head, path)


def digest_of(path):
    """Of a file or of the five files of an OpenFOAM mesh."""
    digest = hashlib.sha256()
    for part in sorted(path.iterdir()) if path.is_dir() else [path]:
        if part.is_file():
            digest.update(part.read_bytes())
    return digest.hexdigest()


def find_meshes(folder):
    """Mesh files and polyMesh folders below a folder, in a fixed order."""
    found = []
    for root, folders, files in os.walk(folder):
        folders.sort()
        here = pathlib.Path(root)
        if here.name == "polyMesh" and {"points", "faces", "owner"} <= set(files):
            if sum((here / name).stat().st_size for name in files) <= MAX_BYTES:
                found.append(here)
            continue
        found += [here / name for name in sorted(files) if is_mesh_file(here / name)]
    return found


def extension_of(path):
    return "foam" if path.is_dir() else path.suffix.lower().lstrip(".")


def collect(folders, cache):
    """All meshes of the folders, identical ones once: a row for each."""
    seen, rows = set(), []
    for name, folder in folders:
        for path in find_meshes(folder):
            digest = digest_of(path)
            if digest in seen:
                continue
            seen.add(digest)
            rows.append({"file": str(path.relative_to(cache)), "format": extension_of(path),
                         "source": name, "sha256": digest})
    return rows
