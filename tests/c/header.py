"""The C library by its header: structures, constants and functions for ctypes, so that tests follow the header."""

import ctypes
import os
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
INCLUDE = ROOT / "client/c/include"
TEXT = "".join((INCLUDE / name).read_text(encoding="utf-8") for name in ("meshsmooth_options.h", "meshsmooth.h"))
PLAIN = re.sub(r"//.*", "", TEXT)

NUMBERS = {"int64_t": ctypes.c_int64, "double": ctypes.c_double, "size_t": ctypes.c_size_t,
           "const char*": ctypes.c_char_p, "int": ctypes.c_int, "void": None}
ON_PROGRESS = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)


def structures():
    """Name and members, as type and name, of each structure."""
    for name, body in re.findall(r"typedef struct (\w+) \{(.*?)\} \1;", PLAIN, re.DOTALL):
        yield name, re.findall(r"^\s*((?:const )?\w+\*{0,2}) (\w+);", body, re.MULTILINE)


def constants():
    return {name: int(value) for name, value in re.findall(r"\b(MESHSMOOTH_\w+) = (\d+)", PLAIN)}


def ctype(text):
    if text == "meshsmooth_on_progress":
        return ON_PROGRESS
    return NUMBERS.get(text.strip(), ctypes.c_void_p)


def structure(name):
    return type(name, (ctypes.Structure,), {"_fields_": [(member, ctype(kind)) for kind, member in dict(structures())[name]]})


def functions():
    """Name and type of the result of each function."""
    declared = re.findall(r"^(int|int64_t|double|void|const char\*) (meshsmooth_\w+)\(", PLAIN, re.MULTILINE)
    return {name: kind for kind, name in declared}


class Library:
    """The shared library; functions by their names without the prefix."""

    def __init__(self):
        self._library = ctypes.CDLL(os.environ["MESHSMOOTH_C_LIBRARY"])
        for name, kind in functions().items():
            getattr(self._library, name).restype = ctype(kind)

    def __getattr__(self, name):
        return getattr(self._library, "meshsmooth_" + name)
