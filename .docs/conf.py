"""Settings of the documentation site; `.ci/docs` builds it."""

import os
import sys
from pathlib import Path

HERE = Path(__file__).parent
os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", NO_COLOR="1")
sys.path[:0] = [
    str(HERE),
    str(HERE.parent),
]  # the extensions of this folder; `figures` is no package of the wheel

import geomech  # noqa: E402

project = "geomech"
author = "the geomech maintainers"
project_copyright = "the geomech maintainers"
version = release = geomech.__version__
language = "en_GB"
smartquotes = False  # `--option` is no dash

extensions = [
    "sphinx.ext.autodoc",
    "numpydoc",
    "myst_nb",
    "sphinx_design",
    "sphinx_copybutton",
    "sphinxcontrib.bibtex",
    "made",
]
exclude_patterns = ["made/**", "generated/notebooks/**"]
nitpicky = True
nitpick_ignore_regex = [
    ("py:.*", ".*")
]  # types in signatures; links of prose are checked by MyST, glossary terms here
default_role = "code"

autodoc_default_options = {"members": True, "member-order": "bysource"}
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_class_signature = "mixed"
autodoc_preserve_defaults = True
toc_object_entries_show_parents = "hide"
python_maximum_signature_line_length = 88
numpydoc_show_class_members = False
numpydoc_xref_param_type = False

myst_enable_extensions = ["colon_fence", "deflist", "attrs_block"]
myst_heading_anchors = 4
bibtex_bibfiles = ["paper.bib"]
bibtex_default_style = "plain"
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 120
nb_execution_in_temp = True
suppress_warnings = ["ref.python"]  # two classes of one name in different packages

html_theme = "pydata_sphinx_theme"
html_title = "geomech"
html_static_path = ["static"]
html_extra_path = ["generated/extra"]  # the gait lab, made before anything is read
(HERE / "generated" / "extra").mkdir(parents=True, exist_ok=True)
html_css_files = ["site.css"]
html_show_sourcelink = False
html_copy_source = False
ALONE = (
    "index",
    "start",
    "lab",
    "tiers",
    "choosing",
    "validation",
    "coming-from",
    "glossary",
    "paper",
    "changelog",
    "citing",
)
html_sidebars = {page: [] for page in ALONE}
html_context = {"default_mode": "auto"}  # light or dark as the browser prefers
html_theme_options = {
    "logo": {"text": "geomech"},
    "navigation_with_keys": False,
    "show_prev_next": False,
    "navbar_align": "left",
    "header_links_before_dropdown": 6,
    "show_toc_level": 2,
    "secondary_sidebar_items": {"**": ["page-toc"], "index": []},
    "footer_start": ["copyright"],
    "footer_end": [],
    "pygments_light_style": "tango",
    "pygments_dark_style": "monokai",
}
copybutton_prompt_text = "$ "
