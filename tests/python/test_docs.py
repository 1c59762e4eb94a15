"""Every public thing has a docstring whose examples run; examples and docs do what they show."""

from __future__ import annotations

import doctest
import inspect
import os
import re
import subprocess
import sys

import pytest
from conftest import ROOT, without_gpu
from test_accuracy import session
from test_live import boards

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


TASKS = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "how-to" / "python-tasks.md").read_text(), re.DOTALL)


@pytest.mark.once
def test_there_are_twelve_tasks_of_at_most_ten_lines() -> None:
    assert len(TASKS) == 12
    assert all(len([line for line in task.splitlines() if line]) <= 10 for task in TASKS)


@pytest.mark.once
@pytest.mark.parametrize("task", TASKS, ids=range(1, len(TASKS) + 1))
def test_a_task_is_done_by_its_program(task: str, somatic, command, tmp_path) -> None:
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    if "survey.csv" in task:
        session(tmp_path / "survey.csv", st.Body.bundled("hand").taxels["id"], at_once=True)
    if "ros2-mcap:bag" in task:
        somatic("run", "--quiet", "--sink", f"ros2-mcap:{tmp_path / 'bag'}", "--outputs", "total")
    before = set(tmp_path.iterdir())
    environment = {**os.environ, "BROWSER": "true", "MPLBACKEND": "Agg"}

    def run(program: str) -> None:
        done = subprocess.run(
            [sys.executable, "-c", program], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120, check=False
        )
        assert done.returncode == 0, done.stderr
        assert done.stdout or set(tmp_path.iterdir()) - before

    if "/dev/ttyUSB0" in task and "live" in task:
        with boards(command, tmp_path) as port:
            run(task.replace("serial:/dev/ttyUSB0", port))
    else:
        run(task)
