"""Settings of Sphinx for the reference of the Python package; scripts/reference runs it."""

import inspect
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "client/python/src"))

from meshsmooth._job_options import MOVE_OPTIONS

project = "meshsmooth"
author = copyright = "The meshsmooth authors"
extensions = ["sphinx.ext.autodoc", "sphinx.ext.napoleon"]
html_theme = "alabaster"
html_theme_options = {"page_width": "1100px", "fixed_sidebar": True}
html_show_sourcelink = False
# Docstrings are Google's, with names of code in single backticks.
default_role = "code"
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_custom_sections = [("Options", "params_style")]
autodoc_member_order = "bysource"
autodoc_mock_imports = ["jax", "pyvista", "torch"]  # which need not be installed
autodoc_typehints = "none"
autodoc_inherit_docstrings = False


def shortened(app, what, name, obj, options, signature, returns):
    """Writes **options where a signature lists each of them, as its docstring does too."""
    if "Options:" not in (getattr(obj, "__doc__", "") or "") or not hasattr(obj, "__signature__"):
        return None
    own = [
        parameter.replace(annotation=parameter.empty)
        for parameter in inspect.signature(obj).parameters.values()
        if parameter.name not in {*MOVE_OPTIONS, "self"}
    ]
    options = inspect.Parameter("options", inspect.Parameter.VAR_KEYWORD)
    return str(inspect.Signature([*own, options])), None


def setup(app):
    """Connects what is above."""
    app.connect("autodoc-process-signature", shortened)
