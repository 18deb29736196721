"""How far a line is trusted that acknowledges nothing.

A command is believed once the box has answered `BELIEVED` questions in a row after it without a flaw: a line that
mutilates one command in a hundred would have shown so by then. Until then it may have been mutilated unseen.
"""

import math
from typing import NamedTuple

BELIEVED = 500
MOVES = "MEWNSns"
GUIDES = "+-"
STEPS = "<>D"
FLAGS = "C"


class Sent(NamedTuple):
    """A command, when it was sent, and the answers that had come before it."""

    letter: str
    time: float
    answers: int


class Trust:
    """Of one line."""

    def __init__(self) -> None:
        self.flaws = 0
        """How often something was lost or mutilated, as far as answers show it."""
        self._answers = 0
        self._doubtful: list[Sent] = []

    @property
    def complete(self) -> bool:
        """Whether all that was sent is believed."""
        return not self._doubtful

    def sent(self, letter: str, time: float) -> None:
        """A command was sent."""
        self._doubtful.append(Sent(letter, time, self._answers))

    def answered(self) -> None:
        """An answer came as it should."""
        self._answers += 1
        while self._doubtful and self._answers - self._doubtful[0].answers >= BELIEVED:
            del self._doubtful[0]

    def flawed(self) -> None:
        """Something did not come, or not as it should: all is to be shown anew."""
        self.flaws += 1
        self._doubtful = [each._replace(answers=self._answers) for each in self._doubtful]

    def told(self) -> None:
        """A person says where all that was sent has led."""
        self._doubtful.clear()

    def since(self, letters: str = MOVES + GUIDES + STEPS + FLAGS) -> float:
        """When the first of the commands with these letters was sent that are not believed; infinity for none."""
        return min((each.time for each in self._doubtful if each.letter in letters), default=math.inf)
