"""What a metric says of an episode that it cannot judge."""

from handrail.controllers.errors import HandrailError


class DoesNotApply(HandrailError):  # noqa: N818, it says what the report says
    """A metric has no value for an episode or a dataset; the message says why, for the report.

    Raised instead of a NaN or a zero: "no contact was recorded" is not "no contact".
    """
