"""Runs the command on a recording in several ways and says what each costs."""

import json
import os
import statistics
import subprocess
import sys

somatic, recording, place, rounds = sys.argv[1], sys.argv[2], sys.argv[3], int(sys.argv[4])
info = json.loads(subprocess.run([somatic, "info", recording, "--json"], check=True, capture_output=True).stdout)
length = info["frames"] / info["rate_hz"]
every = ("total,peak,active,area,centroid,position,normal,orientation,principal_axis,anisotropy,displacement,direction,distance,"
         "radial_distance,speed,radial_speed,touches,filtered_displacement,filtered_direction,filtered_speed")


def run(arguments):
    """Processor time in s and peak memory in bytes of one run."""
    child = subprocess.Popen([somatic, "run", "--source", recording, "--backend", "cpu", "--quiet", *arguments])
    _, status, used = os.wait4(child.pid, 0)
    if status:
        sys.exit(f"benches/recordings: it ended with {os.waitstatus_to_exitcode(status)}")
    return used.ru_utime + used.ru_stime, used.ru_maxrss * 1024


out = os.path.join(place, "percepts.mcap")
text = os.path.join(place, "percepts.ndjson")
mcap = ["--sink", "mcap:" + out, "--force"]
run(["--outputs", every, "--sink", "ndjson:" + text, "--force"])
touched, lines, fields = 0, 0, set()
with open(text) as file:
    for line in file:
        felt = [f["field"] for f in json.loads(line)["fields"]]
        fields.update(felt)
        touched += len(felt)
        lines += 1
plan = json.loads(subprocess.run([somatic, "plan", "--source", recording, "--backend", "cpu", "--json"], check=True,
                                 capture_output=True).stdout)
count = plan["fields"][0] if isinstance(plan["fields"], list) else plan["fields"]
print(f"{info['taxels']} taxels, {count} fields, {info['frames']} frames at {info['rate_hz']:.0f} Hz: {length:.1f} s, "
      f"{info['bytes'] / 1e6:.0f} MB")
print(f"activity: {touched / lines:.1f} fields touched a frame ({100 * touched / lines / count:.1f} %), {len(fields)} over all")
ways = {
    "usual outputs to percepts": [*mcap, "--record", "percepts"],
    "every output to percepts": ["--outputs", every, *mcap, "--record", "percepts"],
    "every output to percepts and view": ["--outputs", every, *mcap, "--record", "percepts,view"],
    "every output to all": ["--outputs", every, *mcap],
    "every output, live a frame a call": ["--outputs", every, *mcap, "--record", "percepts", "--batch", "1"],
    "totals alone": ["--outputs", "total", *mcap, "--record", "percepts"],
}
for name, arguments in ways.items():
    taken = [run(arguments) for _ in range(rounds)]
    times = [time for time, _ in taken]
    print(f"{name:36} {min(times):6.3f} to {max(times):6.3f} s of processor time, median "
          f"{100 * statistics.median(times) / length:5.2f} % of a core, {os.path.getsize(out) / 1e6:7.1f} MB written, "
          f"peak {max(peak for _, peak in taken) / 1e6:.0f} MB")
