"""One simulated axis of the TC410: the drive's integer arithmetic, tick by tick.

Position has 48 bits, 24 of them fraction; velocity v moves it by v every 50 µs, 40·v in a 2 ms tick. This file works
the law out by stepping, and jumps only where the velocity stays the same, so that it can prove the closed form of
`slew`. The present tick is always computed to its end; a reading within it goes back by the 50 µs steps to come.
"""

from dataclasses import dataclass

STEPS = 40  # of 50 µs in a tick
FRACTION_BITS = 24
POSITION_MASK = (1 << 48) - 1


@dataclass
class SimulatedAxis:
    """Motion of one axis; positions are 48-bit, limits are 24-bit counts.

    `position` is what the drive counts and the host may overwrite; `position + offset` is where the axis really is.
    """

    position: int
    offset: int = 0
    velocity: int = 0
    moved: int = 0  # velocity during the tick under way: as `velocity`, but not yet zero in the tick that lands
    target: int = 0
    slewing: bool = False
    decelerating: bool = False
    creep_from: int = 0
    creep_tick: int = -1  # −1: not creeping
    acceleration: int = 26 << 8
    deceleration: int = 26 << 8
    top: int = 0xFFFFFF
    lower: int = 0
    upper: int = POSITION_MASK
    landing_ticks: int = 0
    landing_distance: int = 0

    def state(self) -> dict[str, int]:
        """Everything, for a snapshot."""
        return dict(vars(self))

    def at_step(self, step: int) -> int:
        """Counted position `step` 50 µs steps into the present tick."""
        return (self.position - self.moved * (STEPS - step)) & POSITION_MASK

    def synchronise(self, position: int, step: int) -> None:
        """Count on from `position`, without moving."""
        shift = position - (self.position - self.moved * (STEPS - step))
        self.position += shift
        self.offset -= shift
        self.creep_from += shift

    def halt(self, step: int) -> None:
        """Stand still at once, `step` steps into the present tick, as without power."""
        self.position -= self.moved * (STEPS - step)
        self.velocity = self.moved = 0
        self.end_slew()

    def begin_slew(self) -> None:
        """Go for the target from the next tick on."""
        self.slewing = True
        self.decelerating = False
        self.creep_tick = -1

    def end_slew(self) -> None:
        """Give the target up, or be there."""
        self.slewing = self.decelerating = False
        self.creep_tick = -1

    def blocked(self, direction: int) -> bool:
        """Whether a limit forbids to move this way."""
        return (direction > 0 and self.position >= self.upper) or (direction < 0 and self.position <= self.lower)

    def follow(self, wanted: int, ticks: int) -> None:
        """Ramp to the velocity `wanted` and keep it for `ticks` ticks in all."""
        wanted = max(-self.top, min(self.top, wanted))
        while ticks > 0:
            goal = 0 if self.blocked(wanted) else wanted
            count = 1
            if self.velocity == goal:
                count = min(ticks, self._ticks_to_limit(goal))
            else:
                self.velocity = self._ramped(goal)
            self._run(self.velocity, count)
            ticks -= count

    def slew(self, ticks: int) -> int:
        """Slew for at most `ticks` ticks; return how many it took to end, `ticks` if it has not."""
        left_ticks = ticks
        while self.slewing and left_ticks > 0:
            if self.creep_tick >= 0 or self._creep_begins():
                left_ticks -= self._creep(left_ticks)
            else:
                left_ticks -= self._approach(left_ticks)
        return ticks - left_ticks

    def _run(self, velocity: int, ticks: int) -> None:
        self.position += STEPS * velocity * ticks
        self.moved = velocity
        if self.position != self.position & POSITION_MASK:
            self._wrap()

    def _wrap(self) -> None:
        """Count on past the end of 48 bits without the axis moving."""
        wrapped = self.position & POSITION_MASK
        self.offset += self.position - wrapped
        self.position = wrapped

    def _ramped(self, goal: int) -> int:
        """Velocity of the next tick on the way to `goal`: by D towards rest, by A away from it."""
        v = self.velocity
        if v > 0:
            return min(v + self.acceleration, goal) if goal > v else max(v - self.deceleration, goal, 0)
        if v < 0:
            return max(v - self.acceleration, goal) if goal < v else min(v + self.deceleration, goal, 0)
        return max(-self.acceleration, min(self.acceleration, goal))

    def _ticks_to_limit(self, velocity: int) -> int:
        """Ticks at this velocity until a limit is reached, at least one."""
        if velocity == 0:
            return 1 << 62
        room = self.upper - self.position if velocity > 0 else self.position - self.lower
        return max(1, -(-room // (STEPS * abs(velocity))))

    def _creep_begins(self) -> bool:
        if not self.landing_ticks or abs(self.target - self.position) > self.landing_distance:
            return False
        if abs(self.velocity) > self.deceleration:
            return False
        self.creep_from, self.creep_tick = self.position, 0
        return True

    def _creep(self, ticks: int) -> int:
        """Cover the last stretch evenly; return the ticks used."""
        used = min(ticks, self.landing_ticks - self.creep_tick)
        self.creep_tick += used
        way = self.target - self.creep_from
        self.position = self.creep_from + way * self.creep_tick // self.landing_ticks
        self.velocity = self.moved = way // (STEPS * self.landing_ticks)
        self.decelerating = True
        if self.creep_tick == self.landing_ticks:
            self._land()
        return used

    def _land(self) -> None:
        self.position = self.target
        self.velocity = 0
        self.end_slew()

    def _approach(self, ticks: int) -> int:
        """Take one tick of the landing law, or many at top speed; return the ticks used."""
        aim = self.target
        if self.landing_ticks:
            aim += -self.landing_distance if aim > self.position else self.landing_distance
        left = aim - self.position
        sign = 1 if left >= 0 else -1
        left *= sign
        forward = self.velocity * sign
        if (forward > 0 or left) and self.blocked(sign if forward >= 0 else -sign):
            self.end_slew()
            return 0
        if forward == self.top and (spare := left - self._stop(forward)) >= 0:
            count = min(ticks, spare // (STEPS * forward) + 1, self._ticks_to_limit(self.velocity))
            speed = forward
        else:
            count, speed = 1, self._next(forward, left)
        self.decelerating = forward > speed or self.decelerating
        self.velocity = sign * speed
        self._run(self.velocity, count)
        if abs(aim - self.position) < STEPS and abs(speed) <= self.deceleration:
            self.position = aim
            self.velocity = 0
            if aim == self.target:
                self._land()
        return count

    def _stop(self, v: int) -> int:
        """Distance of v, v−D, v−2D … down to the last above zero."""
        terms = -(-v // self.deceleration)
        return STEPS * (terms * v - self.deceleration * (terms * (terms - 1) // 2))

    def _next(self, v: int, left: int) -> int:
        """The landing law: the velocity of the next tick towards the target, `left` away."""
        if v < 0:
            return min(0, v + self.deceleration)
        lowest = max(v - self.deceleration, 0)
        fastest = min(v + self.acceleration, self.top)
        if fastest <= lowest or self._stop(fastest) <= left:
            return max(fastest, lowest)
        if self._stop(lowest + 1) > left:
            return lowest
        if self._stop(lowest + 2) > left:
            return lowest + 1
        stops, too_fast = lowest + 2, fastest
        while too_fast - stops > 1:
            middle = (stops + too_fast) // 2
            if self._stop(middle) <= left:
                stops = middle
            else:
                too_fast = middle
        return stops
