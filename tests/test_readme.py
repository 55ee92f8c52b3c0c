"""What the README prints runs as it stands, in the order it stands there."""

import re
import shlex
from glob import glob
from pathlib import Path

import cv2
import numpy as np
import pytest

from rangeedge.app.cli import main

README = Path(__file__).resolve().parents[1] / "README.md"


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```$", README.read_text("utf-8"), re.MULTILINE | re.DOTALL)


def commands():
    """The arguments of every call of `rangeedge`."""
    lines = "".join(blocks("sh")).replace("&&", "\n").splitlines()
    return [shlex.split(line)[1:] for line in lines if line.strip().startswith("rangeedge ")]


def test_readme_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert [argv[0] for argv in commands()] == ["demo", "detect", "explain", "segment", "lines", "clean", "batch"]
    for argv in commands():
        assert main([name for word in argv for name in (glob(word) if "*" in word else [word])]) == 0
        assert Path(argv[-1]).exists()
    capsys.readouterr()
    (program,) = blocks("python")
    exec(program, {})
    assert "EdgeStrength(640 x 480 pixels; jump at" in capsys.readouterr().out
    assert cv2.imread("out/edges.png").shape == (480, 640, 3)


@pytest.mark.parametrize(
    "name", re.findall(r"`(samples/\w+|\.github/[\w.]+|tests/[\w/.]+)`", README.read_text("utf-8"))
)
def test_files_of_the_readme_exist(name):
    assert (README.parent / name).exists()


def test_picture_of_the_readme_has_a_true_key():
    """Each colour of edges is in the key, as it is drawn, and tells apart from the others."""
    from rangeedge.draw.palette import KINDS

    key = cv2.imread(str(README.parent / ".github" / "overview.jpg"))[-28:].reshape(-1, 3).astype(int)
    for _, colour, text in KINDS:
        assert np.count_nonzero(np.abs(key - colour).max(axis=1) < 6) > 100, text
