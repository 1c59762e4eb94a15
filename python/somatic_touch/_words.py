"""What the library says, in the words of who calls it from Python."""

from __future__ import annotations

import re

# The flags of the command whose keywords are called otherwise.
_CALLED = {
    "rate": "rate_hz",
    "from": "from_s",
    "to": "to_s",
    "at": "at_s",
    "contact-tolerance": "contact_tolerance_m",
}
_KEYWORDS = {
    *("rate", "from", "to", "at", "format", "grid", "pitch", "unit", "layout", "body", "calibration", "backend"),
    *("force", "all-fields", "header", "wide", "taxels", "spacing", "regions", "seed", "even", "hidden", "clear"),
    *("up", "package", "geometry", "mirror", "rest", "press", "bits", "missing", "equalise", "known", "on", "mask-moved", "stamp"),
    *("joints", "contact-tolerance", "skip-bad"),
    *("gains-from", "wiring", "columns", "ids", "frame-end", "time", "within", "budget", "seconds", "frames"),
}
_TEXTS = {"format", "grid", "pitch", "unit", "layout", "spacing", "clear", "backend", "geometry", "up", "columns", "ids", "time", "within"}
_SWITCHES = {"force", "all-fields", "header", "wide", "equalise", "mask-moved", "skip-bad"}

# A flag with its value, if it has one: a number, what begins like one, a place for one, or what is wrong.
_FLAG = re.compile(r"--([a-z][a-z-]*)(?: (HZ\b|FILE\b|[^\s;)`]+(?= (?:is|are) (?:no|not)\b)|-?[0-9][^\s;)`]*[^\s;)`,:?.]|-?[0-9]))?")
# A command is shown as it is typed: in quotes, or up to the end of its sentence.
_COMMAND = re.compile(r"`(?:somatic|cargo) [^`]*`|\b(?:somatic|cargo) [a-z]+ [^`;]*?--[^`;)]*")
_OF_THE_COMMAND = re.compile(r" \(--strict stops instead\)")


def in_keywords(text: str) -> str:
    """`text` with keyword arguments in the place of the command's flags.

    >>> in_keywords("the recording has no times; give its frame rate with --rate HZ")
    'the recording has no times; give its frame rate with rate_hz=HZ'
    >>> in_keywords("if row 1 is a frame too, add --grid 31x11")
    "if row 1 is a frame too, add grid='31x11'"
    >>> in_keywords("add some, as with `somatic author --taxels 500`")
    'add some, as with `somatic author --taxels 500`'
    """
    if "--" not in text:
        return text
    text = _OF_THE_COMMAND.sub("", text)
    words, at = [], 0
    for command in _COMMAND.finditer(text):
        words += [_FLAG.sub(_keyword, text[at : command.start()]), command.group()]
        at = command.end()
    return "".join([*words, _FLAG.sub(_keyword, text[at:])])


def _keyword(found: re.Match[str]) -> str:
    flag, value = found.groups()
    if flag not in _KEYWORDS:
        return found.group()
    name = _CALLED.get(flag, flag.replace("-", "_"))
    if flag in _SWITCHES:
        return f"{name}=True"
    if value is None:
        return f"{name}="
    return f"{name}={value!r}" if flag in _TEXTS and not value.isupper() else f"{name}={value}"
