"""Every public thing has a docstring whose examples run; examples and docs do what they show."""

from __future__ import annotations

import doctest
import inspect
import re
import subprocess
import sys

import pytest
from conftest import ROOT, without_gpu

import somatic_touch as st


def documented():
    """Everything that is public, by name."""
    yield "somatic_touch", st
    for name in st.__all__:
        thing = getattr(st, name)
        if name != "__version__":
            yield name, thing
        if inspect.isclass(thing) and not issubclass(thing, (BaseException, int)):
            for member in vars(thing):
                if not member.startswith("_"):
                    yield f"{name}.{member}", vars(thing)[member]


EVERYTHING = list(documented())


@pytest.mark.parametrize(("name", "thing"), EVERYTHING, ids=[name for name, _ in EVERYTHING])
def test_examples_run(name: str, thing: object) -> None:
    text = inspect.getdoc(thing.__func__ if isinstance(thing, staticmethod) else thing) or ""
    assert len(text) > 10, "it has no docstring"
    test = doctest.DocTestParser().get_doctest(text, {}, name, None, 0)
    out: list[str] = []
    doctest.DocTestRunner(optionflags=doctest.IGNORE_EXCEPTION_DETAIL * 0).run(test, out=out.append)
    assert not out, "".join(out)


def test_there_are_examples() -> None:
    count = sum((inspect.getdoc(thing) or "").count(">>> ") > 0 for _, thing in EVERYTHING)
    assert count >= 25, count


EXAMPLES = sorted((ROOT / "python" / "examples").glob("*.py"))


@pytest.mark.once
@pytest.mark.parametrize("path", [path for path in EXAMPLES if path.stem not in ("grasps",)], ids=lambda path: path.stem)
def test_an_example_runs(path, tmp_path) -> None:
    done = subprocess.run([sys.executable, path], cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout


@pytest.mark.once
# many-recordings.md starts processes: test_batch.py
@pytest.mark.parametrize("page", ["README.md", "docs/how-to/python.md", "docs/reference/python.md"])
def test_a_page_shows_code_that_runs(page: str, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.DOTALL)
    assert blocks
    names: dict[str, object] = {}
    for block in blocks:
        try:
            exec(compile(block, page, "exec"), names)
        except st.SomaticError as error:
            if "st.render(" not in block:
                raise
            without_gpu(error)
    first = (ROOT / "python" / "examples" / "first_touch.py").read_text()
    if page == "README.md":
        assert blocks[0].strip() in first
