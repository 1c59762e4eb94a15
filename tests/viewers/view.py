"""How Rerun's viewer is to look at a recording, for a picture: from near, at its last moment, taxels as large as peas."""

import sys

import rerun as rr
import rerun.blueprint as rrb

view = rrb.Spatial3DView(
    origin="/",
    name="touch",
    overrides={"somatic/taxels": rr.Points3D.from_fields(radii=0.0025)},
    eye_controls=rrb.EyeControls3D(position=(0.04, 0.075, 0.085), look_target=(0.005, 0.0, 0.02), eye_up=(0, 1, 0)),
)
time = rrb.TimePanel(state="collapsed", timeline="message_log_time", play_state="following")
rrb.Blueprint(view, time, collapse_panels=True).save("somatic", sys.argv[1])
