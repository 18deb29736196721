"""The driver moves a unit: it starts, lands on the count when it said, and tracks on."""

from tc410_bench import Bench, OnSky


def test_a_target_is_reached_at_the_predicted_time_and_tracked() -> None:
    bench = Bench()
    star = bench.star(-20.0, -30.0)
    plan = bench.gone_to(star)
    path = OnSky(bench.planner, star, plan)
    bench.wait(plan.arrival - bench.now)
    one, two = bench.errors(path)
    print(f"at the stated arrival: axis 1 {one:+.3f}, axis 2 {two:+.3f} counts")
    assert max(abs(one), abs(two)) < 1.1
    bench.polled_until_landed()
    errors = bench.tracked(path, 20.0)[5:]
    assert max(abs(error) for pair in errors for error in pair) < 0.5
