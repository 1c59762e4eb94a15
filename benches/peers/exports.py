"""Reading exports of pressure systems: somatic against a plain Python loop (.csv, .lst) and pandas.read_csv (.asc).

    exports.py SOMATIC FOLDER [--megabytes N] [--rounds N]

FOLDER has one recording of each system; each is made N megabytes long by repeating its frames. Somatic's time is that of
the whole program `somatic info`, which reads every frame and follows the contacts of every field. Both are timed in turns; the
fastest of all rounds counts.
"""

import argparse
import json
import pathlib
import subprocess
import tempfile
import time


def xsensor(path):
    """Frames of all sensors' cells."""
    frames, rows, left = [], [], 0
    in_sensor = False
    with open(path, encoding="utf-8-sig") as file:
        for line in file:
            cells = line.rstrip("\n").split(",")
            key = cells[0]
            if left:
                if key:
                    rows.append([float(cell) for cell in cells[:columns]])
                    left -= 1
            elif key == "FRAME":
                if rows:
                    frames.append(rows)
                rows = []
            elif key == "SENSOR":
                in_sensor = True
            elif key == "GROUP":
                in_sensor = False
            elif key == "Rows":
                count = int(cells[1])
            elif key == "Columns":
                columns = int(cells[1])
            elif key == "SENSELS" and in_sensor:
                left = count
    frames.append(rows)
    return len(frames)


def tekscan(path):
    frames, rows = [], None
    with open(path) as file:
        for line in file:
            if line.startswith("Frame"):
                rows = []
                frames.append(rows)
            elif rows is not None and line[0] not in "@\n":
                rows.append([-1.0 if cell == "B" else float(cell) for cell in line.rstrip("\n").split(",")])
    return len(frames)


def emed(path):
    frames, rows = [], None
    with open(path, encoding="latin-1") as file:
        for line in file:
            if "Pict-No" in line:
                rows = []
                frames.append(rows)
            elif rows is not None and line[0].isdigit():
                rows.append([float(cell) for cell in line.split()[1:-1]])
    return len(frames)


def table(path):
    """novel's .asc by pandas."""
    import pandas

    with open(path) as file:
        skip = next(index for index, line in enumerate(file) if line.startswith("time[")) + 1
    return len(pandas.read_csv(path, sep=r"\s+", skiprows=skip, header=None, engine="c"))


def first_table(path):
    """The frames of a pliance .asc by pandas: the first of its tables."""
    import pandas

    data = path.read_bytes()
    begin = data.index(b"\n", data.index(b"time[")) + 1
    skip, rows = data.count(b"\n", 0, begin), data.count(b"\n", begin, data.index(b"MPP", begin))
    return len(pandas.read_csv(path, sep=r"\s+", skiprows=skip, nrows=rows, header=None, engine="c"))


def longer(path, to, megabytes):
    """`path` with its frames repeated, at `to`."""
    data = path.read_bytes()
    if b"electrical:" in data:
        begin = data.index(b"\n", data.index(b"time[")) + 1
        end = data.rindex(b"\n", 0, data.index(b"MPP")) + 1
        body = data[begin:end]
        to.write_bytes(data[:begin] + body * max(1, int(megabytes * 1e6 / len(body))) + data[end:])
        return
    begin = {".csv": b"FRAME," if b"SENSELS" in data else b"Frame ", ".lst": b"\t\t\t\tPage", ".asc": b"\n     "}[path.suffix]
    at = data.index(begin)
    head, body = data[:at], data[at:].rstrip()
    if path.suffix == ".asc":
        head, body = head + b"\n", body.lstrip()
    body = body.removesuffix(b"@@") + b"\n"
    with open(to, "wb") as file:
        file.write(head)
        for turn in range(max(1, int(megabytes * 1e6 / len(body)))):
            # Pictures are told apart by their numbers.
            file.write(body.replace(b"Pict-No.: ", b"Pict-No.: %d" % (turn % 9 + 1)) if path.suffix == ".lst" else body)


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("somatic")
    arguments.add_argument("folder", type=pathlib.Path)
    arguments.add_argument("--megabytes", type=float, default=30)
    arguments.add_argument("--rounds", type=int, default=3)
    arguments = arguments.parse_args()
    peers = [("xsensor*.csv", xsensor, 10), ("iscan*.csv", tekscan, 10), ("emed*.lst", emed, 10), ("pedar*.asc", table, 3), ("pliance*.asc", first_table, 3)]
    print(f"{'file':<24}{'MB':>6}{'frames':>9}{'Python, s':>11}{'somatic, s':>12}{'times':>7}{'wanted':>8}")
    for pattern, peer, wanted in peers:
        for path in arguments.folder.glob(pattern):
            with tempfile.TemporaryDirectory() as folder:
                file = pathlib.Path(folder) / path.name
                longer(path, file, arguments.megabytes)
                ours, theirs = [], []
                for _ in range(arguments.rounds):
                    begin = time.perf_counter()
                    frames = peer(file)
                    theirs.append(time.perf_counter() - begin)
                    begin = time.perf_counter()
                    done = subprocess.run([arguments.somatic, "info", "--json", file], capture_output=True, check=True)
                    ours.append(time.perf_counter() - begin)
                    known = json.loads(done.stdout)
                assert known["frames"] == frames, (path, known["frames"], frames)
                size = file.stat().st_size / 1e6
                times = min(theirs) / min(ours)
                print(f"{path.name:<24}{size:>6.1f}{frames:>9}{min(theirs):>11.3f}{min(ours):>12.3f}{times:>7.1f}{wanted:>8}")


main()
