"""The documentation site. The source folder is the project's root, so that a link works here as it does on GitHub."""

import sys
from importlib.metadata import distribution
from pathlib import Path

import compfilt

sys.path.insert(0, str(Path(__file__).parent))
from figures import use_figures_of_this_build
from numpydoc_text import plain_text, words_are_no_names

project = "compfilt"
author = "the authors of compfilt"
release = version = compfilt.__version__
root_doc = "docs/index"
include_patterns = [
    "*.md",
    "docs/*.md",
    "docs/api/*.md",
    "docs/decisions/*.md",
    "docs/howto/*.md",
    "benches/README.md",
    "benches/results/check.md",
    "examples/README.md",
    "examples/*/README.md",
]
exclude_patterns = ["docs/_build", "target", ".venv", "crates"]

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "sphinx_copybutton",
]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4

napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # the docstrings have them in words, with shapes
nitpicky = True
# Types of the standard library and NumPy, and modules of our own that have no page.
nitpick_ignore_regex = [("py:class", r"(?!compfilt\.).*"), ("py:mod", r"compfilt\..*")]

# One file with its fonts, copied into the site: equations need no net. The package is a copy of MathJax, and needs no Django.
html_static_path = [
    str(distribution("django-static-mathjax").locate_file("mathjax/static/mathjax/es5/tex-svg.js"))
]
mathjax_path = "tex-svg.js"

html_theme = "furo"
html_title = f"compfilt {release}"
html_copy_source = False
html_extra_path = ["site"]  # the index of the site's root, which leads to the first page
# A block is copied without the prompt of an example.
copybutton_prompt_text = ">>> "


def setup(app: object) -> None:
    """Connect what the helpers do."""
    app.connect("doctree-read", use_figures_of_this_build)
    app.connect("doctree-read", words_are_no_names)
    app.connect("autodoc-process-docstring", plain_text, priority=400)  # before napoleon adds its markup
