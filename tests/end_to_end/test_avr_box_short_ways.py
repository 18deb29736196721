"""Gotos of the stepper box over less than its shortest piece: its first microsteps are slower than its tracking."""

from telescope_bench import simulated

from clockdrive.clock import VirtualClock
from pointing.catalogue import find
from pointing.plan import Start

NIGHT = 1_795_626_939.0  # 2026-11-25T17:15:39Z
NEAR_CANOPUS = (2_727_125, -1_747_920)
STARTS, EVERY = 200, 7  # microsteps: ways of 1.3 times the shortest piece to either side


def test_a_short_goto_is_planned_from_wherever_it_begins(tmp_path):
    with simulated("avr-box", tmp_path, VirtualClock(NIGHT), limits__sun_avoidance_deg=20.0) as scope:
        planner, timing = scope._session.planner, scope._session.timing()
        star, lasts, off = find("Canopus"), [], []
        for number in range(STARTS):
            counts = NEAR_CANOPUS[0] + EVERY * (number - STARTS // 2), NEAR_CANOPUS[1]
            plan = planner.plan(star, Start(NIGHT, counts), timing)
            (angle, _), _ = planner.track(star, plan.arrival, plan.posture, tuple(axis.angle for axis in plan.axes))
            one, lasted = plan.axes[0].travel, plan.arrival - plan.start - timing.latency
            stands = one.landed + timing.slew[0].rate * (lasted - one.duration)
            off.append(abs(stands - planner.axes[0].gearing.counts(angle)))
            lasts.append(plan.arrival - plan.start)
    print(f"\n{STARTS} short gotos last {min(lasts):.2f} to {max(lasts):.2f} s, planned to {max(off):.1f} microsteps")
    assert max(off) <= 3.0  # a move is an even number, and rounds may end two off
