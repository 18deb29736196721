"""A seeded run of faults on a whole telescope, and the reckoning of many: what all campaigns of such runs share."""

import math
import random
import re
import time
from collections import Counter

from telescope_bench import star_at

from clockdrive.errors import ClockdriveError
from mounts.errors import DriveError
from pointing.errors import PointingError, Unreachable
from transports.errors import TransportError

OURS = (ClockdriveError, DriveError, PointingError, TransportError)


class FaultRun:
    """One seeded night's trouble; who knows the drive makes `scope` and `witness`, `trouble` and `afterwards`.

    Parameters
    ----------
    seed : int
        Decides all that is left to chance.
    """

    remedy = re.compile(r"`[a-z]|check|try again|again|find its cause|wait|give|say --", re.IGNORECASE)
    """What an error says that tells what to do."""
    lowest_deg = 20.0

    def __init__(self, seed):
        self.seed = seed
        self.chance = random.Random(seed)  # noqa: S311 - nothing secret
        self.kinds, self.happened, self.outcome = (), Counter(), ""

    @property
    def name(self):
        """What it was, in the reckoning."""
        return ", ".join(self.kinds)

    def go(self):
        with self.scope:
            try:
                self.trouble()
                self.afterwards()
            except BaseException as error:
                self.witness.fail(f"{type(error).__name__}: {error}")
                raise
            finally:
                self.last_look()

    def last_look(self):
        """Before it is closed."""

    def attempt(self, work):
        """Do it; return the error, which must be ours and say what to do."""
        try:
            work()
        except OURS as error:
            if not self.remedy.search(str(error)) and not isinstance(error, Unreachable):  # which says by how much
                self.witness.fail(f"no remedy in: {type(error).__name__}: {error}")
            return error
        except Exception as error:  # noqa: BLE001 - that is the claim
            self.witness.fail(f"a bare {type(error).__name__}: {error}")
            return error
        return None

    def arrives(self, done, *progress):
        """Go to a star after all; return it, or None where it does not go though all was `done` that can be."""
        target = self.star()
        error = self.attempt(lambda: self.scope.goto(target, *progress))
        if error is None:
            return target
        self.witness.fail(f"after {', '.join(done) or 'nothing'}, goto says: {type(error).__name__}: {error}")
        return None

    def star(self):
        """Somewhere up that can be gone to."""
        for _ in range(200):
            altitude = math.degrees(math.asin(self.chance.uniform(math.sin(math.radians(self.lowest_deg)), 0.97)))
            target = star_at(self.scope, self.chance.uniform(0.0, 360.0), altitude)
            if self.may_go(target):
                return target
        raise AssertionError("nowhere to go")


class Reckoning:
    """What many runs came to."""

    def __init__(self):
        self.began = time.perf_counter()
        self.happened, self.outcomes = Counter(), Counter()
        self.worst, self.runs, self.readings, self.lost, self.broken = (), 0, 0, 0, []

    def take(self, run):
        """Have it run, and keep what came of it."""
        witness = run.witness
        try:
            run.go()
        except Exception as error:  # noqa: BLE001 - told with all others
            witness.fail(f"escaped: {error!r}")
        if witness.broken:
            self.broken.append(run.seed)
            print(f"seed {run.seed} ({run.name}):", *witness.broken[:6], sep="\n    ", flush=True)
        self.happened += run.happened
        self.outcomes[run.outcome] += 1
        self.worst = max(self.worst, witness.worst)
        self.runs += 1
        self.readings += witness.readings
        self.lost += witness.unsynchronised
        return run

    def tell(self):
        took = time.perf_counter() - self.began
        print(f"{self.runs} runs, {self.readings} readings ({self.lost} unsynchronised), {took:.0f} s")
        print("faults:", ", ".join(f"{kind} {count}" for kind, count in self.happened.most_common()))
        print("outcomes:", "; ".join(f"{name} {count}" for name, count in self.outcomes.most_common()))
