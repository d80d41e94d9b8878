"""The gallery's figures: those that this build has drawn stand in for those that are stored with the sources."""

from pathlib import Path

from docutils import nodes

__all__ = ["use_figures_of_this_build"]

DRAWN = Path("docs/_build/figures")
"""Where `make docs` lets the reproductions draw, one folder each."""


def use_figures_of_this_build(app: object, doctree: nodes.document) -> None:
    """Point each image examples/NAME/out/FILE to the one that was drawn now, if it was."""
    for image in doctree.findall(nodes.image):
        match Path(image["uri"]).parts:
            case ("examples", name, "out", file) if (Path(app.srcdir) / DRAWN / name / file).exists():
                drawn = str(DRAWN / name / file)
                app.env.images.pop(image["uri"], None)
                app.env.images.add_file(app.env.docname, drawn)
                image["uri"] = drawn
                image["candidates"] = {"*": drawn}
