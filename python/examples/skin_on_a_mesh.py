"""A skin on a mesh, a simulated touch on it, and how far the percepts are off."""

import numpy as np
import somatic_touch as st

body = st.author("hand", spacing="5 mm", seed=1)           # or your own .stl, .obj, .dae, .ply, .urdf, .glb
field = max(body.fields.values(), key=len)
print(body, "- largest field:", field)

touch = st.simulate(
    f"""
    rate_hz = 100
    duration_s = 2
    body = "hand"
    [layer]
    thickness_m = 0.004
    [[touch]]
    on = "{field.anchor}"
    indenter = "ball"
    radius_m = 0.01
    path = [[0, 0.01, -0.02], [0, 0.01, 0.02]]
    times_s = [0, 2]
    force_newton = [[0, 5], [2, 5]]
    """,
    body=body,
)
recording = touch.recording
p = recording.engine({"outputs": ["position", "total"]}, backend="cpu").process(recording.t, recording.values)
row = touch.truth
position = p["position"][row["frame"], p.index(field.name)]
error = 1000 * np.linalg.norm(position - row["position"], axis=1)
print(f"{len(row)} frames, place off by {np.nanmedian(error):.2f} mm in the median")
