"""A first touch: the bundled hand, and where it is touched."""

import somatic_touch as st

hand = st.read("hand")                          # or a file: CSV, MCAP, an export of a pressure system
touches = hand.engine().process(hand.t, hand.values).touches
for t, id, link, place in zip(touches.t, touches.id, touches.link, touches.position):
    print(f"{t:.2f} s: touch {id} on {link} at {(1000 * place).round(1)} mm")
