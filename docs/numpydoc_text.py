"""Docstrings are plain text with numpydoc's headings: what reStructuredText would read into them is escaped."""

import re

from docutils import nodes
from sphinx import addnodes

__all__ = ["plain_text", "words_are_no_names"]

# Equations such as x-_0 and |w|, and *args, are no markup here.
MARKUP = re.compile(r"(?<!`)(\*|\||(?<=\w)_(?!\w))(?!`)")
CLASS = re.compile(r"([\w]+\.)*[A-Z]\w+")
CODE = re.compile(r"(``[^`]+``|`[^`]+`)")


def plain_text(*event: object) -> None:
    """Escape what is no markup, line by line; examples and literals stay as they are.

    The event is that of Sphinx, autodoc-process-docstring: its last argument is the list of lines, to be changed in place.
    """
    lines = event[-1]
    lines[:] = [line if line.lstrip().startswith((">>>", "...")) else _escaped(line) for line in lines]


def _escaped(line: str) -> str:
    return "".join(
        part if CODE.fullmatch(part) else MARKUP.sub(r"\\\1", part) for part in CODE.split(line) if part
    )


def words_are_no_names(app: object, doctree: nodes.document) -> None:
    """Take back the links that napoleon made of words in types: of "array_like, shape (n, channels)" none is a class."""
    del app
    for link in list(doctree.findall(addnodes.pending_xref)):
        if (link["refdomain"], link["reftype"]) == ("py", "class") and not CLASS.fullmatch(link["reftarget"]):
            link.replace_self(link.children)
