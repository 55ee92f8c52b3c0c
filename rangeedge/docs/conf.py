"""The documentation: `python -m sphinx -W rangeedge/docs out/docs`, with the extra [docs]."""

import os
import re
import tempfile
from pathlib import Path

import sphinx_gallery.scrapers

import rangeedge

ROOT = Path(__file__).resolve().parents[2]
PICTURES = Path(tempfile.mkdtemp())  # what the samples write

project, author, copyright = "rangeedge", "the authors of rangeedge", "Apache 2.0"
version = release = rangeedge.__version__
extensions = ["sphinx.ext.autodoc", "sphinx.ext.mathjax", "numpydoc", "myst_nb", "sphinx_gallery.gen_gallery"]
exclude_patterns = ["gallery/*.ipynb", "gallery/*.py", "gallery/*.json", "gallery/*.zip"]
html_theme = "furo"
html_title = "rangeedge"
html_show_sourcelink = html_show_copyright = False
default_role = "code"
myst_enable_extensions = ["dollarmath"]
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 120
numpydoc_show_class_members = False
suppress_warnings = ["config.cache"]


class WrittenPictures:
    """Collects the pictures that a sample writes."""

    def __repr__(self):
        return "WrittenPictures"

    def __call__(self, block, block_vars, gallery_conf):
        shown = []
        for picture in sorted(PICTURES.glob("*.png"), key=os.path.getmtime):
            target = next(block_vars["image_path_iterator"])
            picture.replace(target)
            shown.append(target)
        return sphinx_gallery.scrapers.figure_rst(shown, gallery_conf["src_dir"])


def arguments(gallery_conf, script_vars):
    """Of every sample: where to write."""
    return ["--out", str(PICTURES)]


sphinx_gallery_conf = {
    "examples_dirs": [str(ROOT / "samples")],
    "gallery_dirs": ["gallery"],
    "filename_pattern": r"/\w+\.py$",
    "ignore_pattern": r"/ros2_\w+\.py$",
    "image_scrapers": (WrittenPictures(),),
    "reset_argv": arguments,
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_memory": False,
    "min_reported_time": 1e9,
    "write_computation_times": False,
    "plot_gallery": True,
}


def plain_text(app, what, name, obj, options, lines):
    """What the docstrings say is no markup: bars and stars are characters, indented lines are formulas."""
    sections = next((i for i, line in enumerate(lines) if set(line) == {"-"}), len(lines) + 1) - 1
    done, formula = [], False
    for i, line in enumerate(lines):
        if re.match(r"[\w.]+\(.*\) -> ", line):
            line = f"``{line}``"
        elif i < sections and line.startswith("    ") and not formula and (not lines[i - 1]):
            done += ["::", ""]
            formula = True
        elif not line.startswith("    ") and line:
            formula = False
        if not formula and not line.lstrip().startswith((">>>", "..")):
            parts = re.split(r"(``.*?``|`[^`]*`)", line)
            parts[::2] = [re.sub(r"[*|]|(?<=\w)_(?!\w)", r"\\\g<0>", part) for part in parts[::2]]
            line = "".join(parts)
        done.append(line)
    examples = next((i for i, line in enumerate(done) if line == "Examples"), len(done))
    start = next((i for i, line in enumerate(lines) if line == "Examples"), len(lines))
    lines[:] = done[:examples] + lines[start:]


def setup(app):
    app.connect("autodoc-process-docstring", plain_text, priority=100)
