"""A first touch: the bundled hand, and where it is pressed."""

import numpy as np
import somatic_touch as st

touch = st.read("hand")                                    # or a file: CSV, MCAP, an export of a pressure system
engine = touch.engine({"outputs": ["total", "position", "principal_axis"]}, backend="cpu")
p = engine.process(touch.t, touch.values)                  # float32 [frames, taxels], read where it is

back = p.index("hand/back")
hardest = np.argmax(p["total"][:, back])
print(f"hardest at {p.t[hardest]:.2f} s: {p['total'][hardest, back]:.0f} {p.unit('total')}")
print("at", (1000 * p["position"][hardest, back]).round(2), "mm")
if p.present("principal_axis")[hardest, back]:
    print(f"along {np.degrees(p['principal_axis'][hardest, back]):.0f}°")
print(st.Flags(p.flags[hardest, back]) or "nothing in doubt")
