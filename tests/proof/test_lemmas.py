"""The lemmas of docs/proof.md, each proved by Z3 for all real parameters: no counterexample exists."""

import pytest

z3 = pytest.importorskip("z3")

TIMEOUT = 20_000
"""Of the solver, ms; each lemma takes well below a second."""
speed, speed_up, braking, period, time = z3.Reals("v A b epsilon t")
turn, turn_up, turn_braking, rho = z3.Reals("w alpha beta rho")
distance, margin, obstacle = z3.Reals("d e g")
DRIVES = z3.And(speed_up >= 0, braking > 0, period >= 0, speed >= 0, margin >= 0)
TURNS = z3.And(rho >= 0, turn >= 0, turn_up >= 0, turn_braking > 0)


def refuted(hypotheses: list, claim) -> str:
    """The verdict on whether the hypotheses allow that the claim does not hold."""
    solver = z3.SolverFor("QF_NRA")
    solver.set("timeout", TIMEOUT)
    solver.add(*hypotheses, z3.Not(claim))
    return str(solver.check())


def proved(hypotheses: list, claim) -> bool:
    """Whether a claim follows from hypotheses that do not exclude each other: a robot of unit limits meets them."""
    units = [value == 1 for value in (speed, speed_up, braking, period, turn, turn_up, turn_braking)]
    return refuted(hypotheses, claim) == "unsat" and refuted([*hypotheses, *units], z3.BoolVal(False)) == "sat"


def stopping(v, w=0, g=0):
    """Clearance used up by full braking: by the way, the turn at the circumradius, and an obstacle that comes near."""
    return v * v / (2 * braking) + rho * w * w / (2 * turn_braking) + g * v / braking


def command(v, g=0):
    """Clearance used up beyond that by a command held for the period, at full acceleration."""
    drive = (speed_up / braking + 1) * (speed_up * period * period / 2 + period * v)
    return drive + g * (period + speed_up * period / braking)


def turning_command(w):
    """The same of turning."""
    return rho * (turn_up / turn_braking + 1) * (turn_up * period * period / 2 + period * w)


def test_a_command_that_is_held_leaves_room_to_brake() -> None:
    still = rho == 0
    allowed = distance - margin >= stopping(speed) + command(speed)
    left = distance - (speed * time + speed_up * time * time / 2) - margin
    within = z3.And(time >= 0, time <= period)
    assert proved([DRIVES, still, turn_braking > 0, within, allowed], left >= stopping(speed + speed_up * time))


def test_braking_never_uses_up_the_clearance() -> None:
    allowed = distance - margin >= stopping(speed)
    left = distance - (speed * time - braking * time * time / 2) - margin
    hypotheses = [DRIVES, rho == 0, turn_braking > 0, time >= 0, time * braking <= speed, allowed]
    assert proved(hypotheses, z3.And(left >= stopping(speed - braking * time), left >= 0))


def test_a_body_that_also_turns_keeps_room_to_brake() -> None:
    """Of what it needs, one part covers what driving uses up and must leave, another does so for turning."""
    within = [DRIVES, TURNS, time >= 0, time <= period]
    drive_left = stopping(speed + speed_up * time)
    swept = rho * (turn * time + turn_up * time * time / 2)
    assert proved(
        [*within, rho == 0], stopping(speed) + command(speed) >= speed * time + speed_up * time * time / 2 + drive_left
    )
    assert proved(within, stopping(0, turn) + turning_command(turn) >= swept + stopping(0, turn + turn_up * time))
    parts = z3.Reals("drive_needed turn_needed drive_used turn_used left")
    needed_v, needed_w, used_v, used_w, left = parts
    both = [needed_v >= used_v, needed_w >= used_w, distance - margin >= needed_v + needed_w]
    assert proved([*both, left == distance - margin - used_v - used_w], left >= 0)


def test_a_body_that_drives_and_turns_brakes_within_its_clearance() -> None:
    allowed = distance - margin >= stopping(speed, turn)
    way = speed * time - braking * time * time / 2 + rho * (turn * time - turn_braking * time * time / 2)
    while_both = z3.And(time >= 0, time * braking <= speed, time * turn_braking <= turn)
    left = distance - way - margin
    after = stopping(speed - braking * time, turn - turn_braking * time)
    assert proved([DRIVES, TURNS, while_both, allowed], z3.And(left >= after, left >= 0))


@pytest.mark.parametrize("turns_longer", [True, False])
def test_so_it_does_where_the_turn_or_the_drive_outlasts_the_other(turns_longer: bool) -> None:
    v, w = (0, turn) if turns_longer else (speed, 0)
    rate, limit = (turn, turn_braking) if turns_longer else (speed, braking)
    swept = rate * time - limit * time * time / 2
    left = distance - (rho * swept if turns_longer else swept) - margin
    after = stopping(0, w - limit * time) if turns_longer else stopping(v - limit * time)
    hypotheses = [DRIVES, TURNS, time >= 0, time * limit <= rate, distance - margin >= stopping(v, w)]
    assert proved(hypotheses, z3.And(left >= after, left >= 0))


@pytest.mark.parametrize("brakes", [True, False])
def test_the_invariant_holds_after_each_period_whether_it_commits_or_brakes(brakes: bool) -> None:
    """Clearance suffices to stop: if so before a period, then after it, for any acceleration that a command may ask."""
    acceleration, next_speed, next_distance, spent = z3.Reals("a next_v next_d s")
    before, after = distance - margin >= stopping(speed), next_distance - margin >= stopping(next_speed)
    common = [DRIVES, rho == 0, turn_braking > 0, before, spent >= 0, spent <= period]
    if brakes:  # it brakes for the period, or until it stands
        hypotheses = [
            z3.Or(spent == period, spent * braking == speed),
            spent * braking <= speed,
            next_speed == speed - braking * spent,
            next_distance == distance - (speed * spent - braking * spent * spent / 2),
        ]
    else:
        hypotheses = [
            distance - margin >= stopping(speed) + command(speed),
            spent == period,
            z3.And(-braking <= acceleration, acceleration <= speed_up),
            next_speed == speed + acceleration * period,
            next_speed >= 0,
            next_distance == distance - (speed * period + acceleration * period * period / 2),
        ]
    assert proved([*common, *hypotheses], z3.And(after, next_distance >= margin))


@pytest.mark.parametrize("brakes", [True, False])
def test_an_obstacle_of_bounded_speed_is_allowed_for_until_the_robot_stands(brakes: bool) -> None:
    """It comes closer by at most g t in any time t, whatever it does."""
    closer = z3.Real("c")
    rate = -braking if brakes else speed_up
    needed = stopping(speed, 0, obstacle) + (0 if brakes else command(speed, obstacle))
    within = time * braking <= speed if brakes else time <= period
    left = distance - (speed * time + rate * time * time / 2) - closer - margin
    bounded = z3.And(obstacle >= 0, closer <= obstacle * time)
    hypotheses = [DRIVES, rho == 0, turn_braking > 0, time >= 0, within, bounded, distance - margin >= needed]
    assert proved(hypotheses, z3.And(left >= stopping(speed + rate * time, 0, obstacle), left >= 0))


def test_an_obstacle_may_start_stop_and_turn_at_any_instant() -> None:
    """By induction over the instants: two legs in any directions lead no farther than the sum of their lengths."""
    (ax, ay, bx, by), (first, second, both) = z3.Reals("ax ay bx by"), z3.Reals("l m n")
    s, before = z3.Reals("s c")
    lengths = [
        first >= 0, second >= 0, both >= 0, obstacle >= 0, s >= 0, before >= 0,
        first * first == ax * ax + ay * ay,
        second * second == bx * bx + by * by,
        both * both == (ax + bx) * (ax + bx) + (ay + by) * (ay + by),
    ]  # fmt: skip
    assert proved(lengths, both <= first + second)
    assert proved([obstacle >= 0, s >= 0, first <= obstacle * before, second <= obstacle * s, both <= first + second],
                  both <= obstacle * (before + s))  # fmt: skip


@pytest.mark.parametrize("brakes", [True, False])
def test_an_obstacle_that_is_left_room_to_brake_needs_no_more_than_that(brakes: bool) -> None:
    """While the robot drives, and when it stands, the obstacle is no nearer than the way in which it can stop."""
    closer, slower, room, after = z3.Reals("c k f u")
    rate = -braking if brakes else speed_up
    needed = room + stopping(speed, 0, obstacle) + (0 if brakes else command(speed, obstacle))
    within = time * braking <= speed if brakes else time <= period
    left = distance - (speed * time + rate * time * time / 2) - closer - margin
    bounded = z3.And(obstacle >= 0, slower > 0, closer <= obstacle * time, room == obstacle * obstacle / (2 * slower))
    hypotheses = [DRIVES, rho == 0, turn_braking > 0, time >= 0, within, bounded, distance - margin >= needed]
    assert proved(hypotheses, left >= room + stopping(speed + rate * time, 0, obstacle))
    stops = z3.And(after >= 0, after * slower <= obstacle)
    way = obstacle * after - slower * after * after / 2
    assert proved([DRIVES, rho == 0, turn_braking > 0, bounded, stops], way <= room)


@pytest.mark.parametrize("weakened", ["command", "braking"])
def test_a_weaker_hypothesis_is_refuted(weakened: str) -> None:
    """That the solver finds counterexamples: without one of the terms the first lemma does not hold."""
    needed = stopping(speed) if weakened == "command" else command(speed)
    left = distance - (speed * time + speed_up * time * time / 2) - margin
    within = z3.And(time >= 0, time <= period)
    hypotheses = [DRIVES, rho == 0, turn_braking > 0, within, distance - margin >= needed]
    assert refuted(hypotheses, left >= stopping(speed + speed_up * time)) == "sat"
