"""What is impossible in a configuration of axis controllers, and what unwise."""

from collections.abc import Iterator

from clockdrive.configuration_keys import Facts
from clockdrive.drives import Finding


def contradictions(facts: Facts) -> Iterator[Finding]:
    """Each axis of `apo` has a line of its own, or none has and the telescope is simulated."""
    if facts["drive.kind"] != "apo":
        return
    sections = [section for section in ("axis1", "axis2", "rotator") if f"{section}.min_deg" in facts]
    given = {f"{section}.link": facts.get(f"{section}.link") for section in sections}
    if not any(given.values()):
        if facts["drive.link"] != "sim:":
            text = f"drive.link = {facts['drive.link']}: each axis of apo has a line of its own, {', '.join(given)}"
            yield ("drive.link", *given), text
        return
    for name in (name for name, link in given.items() if link is None):
        yield (name,), f"{name} is missing: each axis of apo has a line of its own, as tcp://192.168.1.21:1024"
    for name, link in given.items():
        first = next(each for each in given if given[each] == link)
        if link not in {None, "sim:"} and first != name:
            yield (name, first), f"{name} = {link} is {first} too: each axis has a line of its own"
    if "sim:" in given.values() and set(given.values()) != {"sim:"}:
        yield tuple(given), f"{', '.join(given)}: some are sim:, others not; the simulator is all axes or none"


def cautions(_facts: Facts) -> Iterator[str]:
    """Nothing of it is possible, and unwise."""
    yield from ()
