"""Configure Sphinx, which `python -m website` calls on the pages that it collects (`make docs`)."""

import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1]))

import gacompiler

project = "gacompiler"
author = copyright = "gacompiler contributors"
release = gacompiler.__version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "website.mathml", "website.names"]
root_doc = "index"
exclude_patterns = ["pictures"]

# Pages: Markdown as repository browsers show it, and notebooks with the outputs that are stored in them.
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
nb_execution_mode = "off"

# Docstrings have numpydoc sections. Single backticks are names, shown as code if there is no such target.
default_role = "py:obj"
napoleon_google_docstring = False
# Sections are kept as lists: types in fields of a function would be looked up among all names of the site.
napoleon_use_param = False
napoleon_use_rtype = False
napoleon_custom_sections = [("Attributes", "params_style")]
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
python_maximum_signature_line_length = 100
python_use_unqualified_type_names = True
add_module_names = False
toc_object_entries = False

# All files are local: no fonts, styles or scripts are loaded from the network.
html_extra_path = [str(Path(__file__).parents[1] / "build" / "site-scenes")]
html_static_path = ["website/static"]
html_css_files = ["site.css"]
html_js_files = ["versions.js"]
pygments_dark_style = "github-dark"
html_theme = "furo"
html_title = f"gacompiler {release}"
html_math_renderer = "mathml"
html_copy_source = False
html_show_sourcelink = False


def _is_skipped(app: Any, what: str, name: str, value: Any, skip: bool, options: Any) -> bool | None:
    """Skip the fields of named tuples, which the sections of their classes describe."""
    return True if (getattr(value, "__doc__", "") or "").startswith("Alias for field number") else None


def _without_type(app: Any, what: str, name: str, value: Any, options: Any, lines: list[str]) -> None:
    """Restore the type of an attribute before its description, because napoleon moves it to a separate line."""
    types = [line.removeprefix(":type: ") for line in lines if line.startswith(":type: ")]
    if types and what in ("attribute", "property"):
        lines[:] = [line for line in lines if not line.startswith(":type: ")]
        lines[0] = f"{types[0]}: {lines[0]}"


def setup(app: Any) -> None:
    """Register the functions of this file."""
    app.connect("autodoc-skip-member", _is_skipped)
    app.connect("autodoc-process-docstring", _without_type, priority=600)
