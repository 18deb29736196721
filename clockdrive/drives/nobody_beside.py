"""In place of a dead-man process for an embedded simulator, which ends with its owner."""


class NobodyBeside:
    """Nobody, who needs nothing."""

    fate = ""

    def start(self) -> None:
        """Nobody starts."""

    def arm(self) -> None:
        """Nobody will act."""

    def hasten(self) -> None:
        """Nobody hurries."""

    def ease(self) -> None:
        """Nobody waits longer."""

    def beat(self) -> bool:
        """Nobody needs a sign of life."""
        return True

    def disarm(self) -> None:
        """Nobody would have acted."""

    def close(self) -> None:
        """Nobody ends."""
