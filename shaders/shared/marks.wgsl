// A pressure is never negative: its sign says that there is a status to look up. Where there is none, none is written.
const SAID = 0x80000000u;
const NUMBER = 0x7fffffffu;

fn marked(pressures: Numbers, statuses: Words) -> Words {
    return bitcast<Words>(pressures) | select(Words(), Words(SAID), statuses != Words());
}

fn unmarked(pressures: Words) -> Numbers {
    return bitcast<Numbers>(pressures & Words(NUMBER));
}

fn is_marked(pressures: Words) -> bool {
    return any(pressures > Words(NUMBER));
}
