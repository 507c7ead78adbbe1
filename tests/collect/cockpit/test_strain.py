"""Laws: a loop that is late lets pictures wait first, then those who watch; and both come back."""

from handrail.collect.cockpit.strain import Strain


def periods(lag):
    strain = Strain()
    strain.note(lag)
    return strain.picture_period, strain.spectator_period


def test_pictures_wait_before_spectators_do():
    at_ease, some, more = periods(0.0), periods(0.02), periods(0.05)
    assert some[0] > at_ease[0]
    assert some[1] == at_ease[1]
    assert more[0] > some[0]
    assert more[1] > some[1]
    strain = Strain()
    for lag in (0.5, *400 * [0.0]):
        strain.note(lag)
    assert (strain.picture_period, strain.spectator_period) == at_ease  # it forgets
